//! Findings about tuners in sentences.

use mops_core::problem::Problem;
use mops_identification::{
    FAR, Local,
    blind::{BlindDirection, Limit},
    noise::OneSided,
};

use super::remarks::remarks;
use super::report::{DirectionReport, TunerSensitivity};
use super::words::{coefficient, counted, estimate, listed, percent};

/// Correlation above which a pair is reported.
const CORRELATED: f64 = 0.95;

/// Maximum number of reported correlated pairs, and of reported changes of estimates.
const MOST: usize = 5;

/// Returns the findings: the determined directions, the others with reasons, the accuracy, and further assumptions.
pub(super) fn sentences(
    problem: &Problem,
    local: &Local,
    tuners: &[TunerSensitivity],
    directions: &[DirectionReport],
) -> Vec<String> {
    // Initial states belong to a recording; their accuracy is not of interest.
    let asked: Vec<usize> = (0..tuners.len()).filter(|&k| !local.starts[k]).collect();
    let (vague, rest): (Vec<usize>, Vec<usize>) = asked.into_iter().partition(|&k| is_vague(local, tuners, k));
    let named = |of: &[usize]| listed(&of.iter().map(|&k| format!("`{}`", tuners[k].name)).collect::<Vec<_>>());
    let mut sentences = vec![determined(local, vague.is_empty())];
    sentences.extend(directions.iter().map(|direction| undetermined(local, direction)));
    if !vague.is_empty() {
        sentences.push(format!(
            "Practically not identifiable: {} (the standard error exceeds the value, or the range).",
            named(&vague)
        ));
    }
    sentences.extend(extremes(local, tuners, &rest));
    let weak: Vec<usize> = rest.into_iter().filter(|&k| tuners[k].trust == "weak").collect();
    if !weak.is_empty() {
        sentences.push(format!("Poorly determined: {} (standard error above 10 %).", named(&weak)));
    }
    sentences.extend(pairs(local, tuners));
    if let Some(covariance) = &local.covariance {
        sentences.extend(remarks(covariance.noise(), problem.study()));
    }
    sentences.extend(one_sided(problem, local, tuners));
    sentences.extend(alike(local, tuners));
    sentences
}

/// Returns true if the noise hides a tuner: its standard error exceeds its value, or a direction below the noise moves
/// it through its whole range.
fn is_vague(local: &Local, tuners: &[TunerSensitivity], k: usize) -> bool {
    let hidden = |direction: &BlindDirection| {
        direction.limit == Limit::Noise && direction.changes.iter().any(|&(member, _)| member == k)
    };
    let of_value = tuners[k].relative_to == "value" && tuners[k].relative_error > 1.0;
    of_value || (local.sensitivity.undetermined[k] && local.sensitivity.blind.iter().any(hidden))
}

/// Returns the number of determined directions, and the reasons for the others.
fn determined(local: &Local, all_practically: bool) -> String {
    let found = &local.sensitivity;
    let n = found.coordinates.len();
    let condition = coefficient(found.singular_values[0] / found.singular_values[n - 1]);
    if found.rank < n {
        let along = |(limit, what): (Limit, &str)| {
            let count = found.blind.iter().filter(|blind| blind.limit == limit).count();
            (count > 0).then(|| format!("{what} along {}", counted(count, "direction")))
        };
        let open = [
            (Limit::Nothing, if local.residuals { "no effect" } else { "no first-order effect" }),
            (Limit::Noise, "a change below the noise"),
            (Limit::Slopes, "derivatives of insufficient accuracy"),
        ];
        let what = if local.residuals { "The data determine" } else { "The criteria depend on" };
        let open: Vec<String> = open.into_iter().filter_map(along).collect();
        return format!("{what} {} of the {}; {}.", found.rank, counted(n, "direction"), listed(&open));
    }
    match (local.residuals, n) {
        (false, 1) => "The criteria depend on the tuner.".to_owned(),
        (false, _) => format!("The criteria depend on all {} (condition number {condition}).", counted(n, "direction")),
        (true, 1) => "The tuner is locally identifiable.".to_owned(),
        (true, _) if all_practically => {
            format!("All {n} tuners are locally identifiable (condition number {condition}).")
        }
        (true, _) => format!("All {n} tuners are locally identifiable in theory (condition number {condition})."),
    }
}

/// Returns the finding on a direction that is not determined, and the remedy.
fn undetermined(local: &Local, direction: &DirectionReport) -> String {
    let mut sentence = format!("{}.", capital(&direction.words));
    if direction.changes.len() > 1 && !direction.has_effect {
        sentence += match local.residuals {
            true => " Fix one of them, or measure a signal that distinguishes them.",
            false => " The criteria do not constrain this direction.",
        };
        if direction.remaining.is_finite() {
            let remaining = percent(direction.remaining);
            sentence += &format!(
                " (Check: a 10 % step along it causes {remaining} of the change that steps of its single tuners cause.)"
            );
        }
    }
    sentence
}

/// Returns the most and the least accurate of some tuners.
fn extremes(local: &Local, tuners: &[TunerSensitivity], of: &[usize]) -> Option<String> {
    let known = || of.iter().map(|&k| &tuners[k]).filter(|t| t.relative_error.is_finite());
    let by_error = |a: &&TunerSensitivity, b: &&TunerSensitivity| a.relative_error.total_cmp(&b.relative_error);
    let (best, worst) = (known().min_by(by_error)?, known().max_by(by_error)?);
    let aside = if local.starts.contains(&true) { ", initial states excluded" } else { "" };
    (best.name != worst.name).then(|| {
        format!(
            "Most accurate is `{}`, to {}; least accurate `{}`, to {} (one standard error{aside}).",
            best.name,
            relative(best),
            worst.name,
            relative(worst)
        )
    })
}

/// Relative change below which an estimate, in standard errors, and its error count as unchanged.
const SAME: f64 = 0.2;

/// Returns large deviations on one side beside a robust loss, and what the estimates would be without them.
fn one_sided(problem: &Problem, local: &Local, tuners: &[TunerSensitivity]) -> Vec<String> {
    let sentence = |found: &OneSided| {
        let (most, side) =
            if 2 * found.above >= found.count { (found.above, "above") } else { (found.count - found.above, "below") };
        let moves = |&k: &usize| !local.starts[k] && found.changes[k].abs() > SAME * tuners[k].std_error;
        let moved: Vec<usize> = (0..tuners.len()).filter(moves).collect();
        let would_be = |&k: &usize| {
            let TunerSensitivity { name, value, std_error, .. } = &tuners[k];
            format!(
                "`{name}` = {} instead of {}",
                estimate(value + found.changes[k], *std_error),
                estimate(*value, *std_error)
            )
        };
        let without = match moved.as_slice() {
            [] => "no estimate would change by more than a fifth of its standard error".to_owned(),
            some => some_of(some, would_be),
        };
        format!(
            "{most} of the {} samples of `{}` in `{}` that are more than {FAR} standard deviations of the noise off the model are {side} \
             it. A robust loss limits the bias by outliers on one side, but does not remove it; without these samples, to first \
             order: {without}.",
            found.count,
            found.signal,
            problem.study().cases()[found.case].name
        )
    };
    local.covariance.iter().flat_map(|covariance| covariance.noise().one_sided()).map(sentence).collect()
}

/// Lists the first items as text, and the number of the others.
fn some_of(items: &[usize], text: impl Fn(&usize) -> String) -> String {
    let more = items.len().saturating_sub(MOST);
    let mut parts: Vec<String> = items.iter().take(MOST).map(text).collect();
    parts.extend((more > 0).then(|| format!("{more} more")));
    listed(&parts)
}

/// Returns the changes with equal sample weights, if records differ much in length.
fn alike(local: &Local, tuners: &[TunerSensitivity]) -> Option<String> {
    let found = local.alike.as_ref()?;
    let [least, most] = found.samples;
    let changes = |&k: &usize| {
        let ((step, error), now) = (found.tuners[k], tuners[k].std_error);
        !local.starts[k] && now.is_finite() && (step.abs() > SAME * now || (error / now - 1.0).abs() > SAME)
    };
    let changed: Vec<usize> = (0..tuners.len()).filter(changes).collect();
    let begin = format!("The records have {least} to {most} samples. With equal weight for every sample");
    if changed.is_empty() {
        return Some(format!("{begin}, the estimates and their standard errors would be about the same."));
    }
    let would_be = |&k: &usize| {
        let ((step, error), tuner) = (found.tuners[k], &tuners[k]);
        let now = estimate(tuner.value, tuner.std_error);
        format!("`{}` = {} instead of {now}", tuner.name, estimate(tuner.value + step, error))
    };
    Some(format!("{begin}, to first order: {}.", some_of(&changed, would_be)))
}

/// Returns sentences about correlated tuners, the strongest correlation first.
fn pairs(local: &Local, tuners: &[TunerSensitivity]) -> Vec<String> {
    let found = &local.sensitivity;
    let n = tuners.len();
    let mut pairs: Vec<(usize, usize)> = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))).collect();
    pairs.retain(|&pair| found.correlation[pair].abs() > CORRELATED);
    pairs.sort_by(|&a, &b| found.correlation[b].abs().total_cmp(&found.correlation[a].abs()));
    let sentence = |&(i, j): &(usize, usize)| {
        let rho = found.correlation[(i, j)];
        let [a, b] = [&tuners[i], &tuners[j]];
        let error = |k: usize| local.covariance.as_ref().map_or(found.together[k], |c| c.of_tuner(k).deviation);
        let share = |k: usize| error(k) / found.coordinates[k].scale();
        // Major axis of the confidence ellipse: both move by their standard errors.
        let (most, least) = if share(i) >= share(j) { (i, j) } else { (j, i) };
        let change = |k: usize, sign: f64| {
            // A relative change has the sign of the value's change.
            if sign * found.coordinates[k].value.signum() < 0.0 { "decrease" } else { "increase" }
        };
        let by = percent(0.01 * share(least) / share(most));
        let mut text = format!(
            "`{}` and `{}` are correlated ({rho:.3}): a 1 % {} of `{}` is almost compensated by a {by} {} of `{}`.",
            a.name,
            b.name,
            change(most, 1.0),
            tuners[most].name,
            change(least, rho.signum()),
            tuners[least].name
        );
        let is_known = tuners[most].relative_error.is_finite() && !local.starts[most];
        if let Some(covariance) = local.covariance.as_ref().filter(|_| is_known) {
            // With one of them fixed, the estimate of the other loses the uncertainty due to the first.
            let mut slopes = vec![0.0; n];
            slopes[most] = 1.0;
            slopes[least] = -found.inverse[(most, least)] / found.inverse[(least, least)];
            let fixed = tuners[most].relative_error * covariance.spread(&slopes).deviation / error(most);
            text += &format!(
                " With `{}` fixed, the standard error of `{}` would be {} instead of {}.",
                tuners[least].name,
                tuners[most].name,
                percent(fixed),
                percent(tuners[most].relative_error)
            );
        }
        text
    };
    pairs.iter().take(MOST).map(sentence).collect()
}

/// Returns the relative error as text.
fn relative(tuner: &TunerSensitivity) -> String {
    let of = if tuner.relative_to == "range" { " of its range" } else { "" };
    format!("{}{of}", percent(tuner.relative_error))
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().collect::<String>() + letters.as_str())
}
