//! What a problem's data can tell: sensitivities at a point, excitation of the inputs, and sentences about both.

use nalgebra::DMatrix;

use super::report::{DirectionReport, ExcitationReport, RelativeReport, SensitivityReport, TunerSensitivity};
use super::sensitivity::{Coordinate, DIFFERENCES, Eigen, Sensitivity, TANGENTS};
use super::words::{coefficient, counted, listed, percent};
use super::{BlindDirection, excitation};
use crate::case::Case;
use crate::criterion::Usage;
use crate::experiment::Input;
use crate::problem::{Evaluation, Problem};
use crate::run::{Budget, Run};
use crate::solver::Oracle;
use crate::study::Study;
use crate::tuner::{Grid, Tuner};

/// Share of the value up to which an estimate counts as determined.
const TRUSTED: f64 = 0.1;

/// Correlations above this are spoken of.
const CORRELATED: f64 = 0.95;

/// Sensitivities at a point with the noise that the residuals show.
pub struct Local {
    /// The sensitivity matrix and all that follows from it.
    pub sensitivity: Sensitivity,
    /// Standard deviation of the residuals per degree of freedom; NaN without residuals or degrees of freedom.
    pub deviation: f64,
    /// Whether slopes are exact.
    exact: bool,
    /// Whether they are slopes of residuals; else of the scaled criteria that count.
    residuals: bool,
    /// Which tuners are start values of an experiment.
    starts: Vec<bool>,
}

/// Sensitivities of the active tuners; `None` where there is no tuner, no criterion that counts, or no slope.
pub fn local(problem: &Problem, tuners: &[f64], zero: Option<f64>) -> Option<Local> {
    let study = problem.study();
    let n = problem.active().len();
    // A run of its own: slopes are computed even when the budget is spent.
    let mut probe = Run::new(problem, Budget { evaluations: usize::MAX }, &());
    let found = probe.linearise(&problem.point_of(tuners), 1.0).ok().flatten()?;
    let exact = probe.linearisations() > 0;
    let residuals = !found.at.residuals.is_empty();
    let counting = counting(problem);
    let rows = if residuals { found.at.residuals.len() } else { counting.len() };
    if n == 0 || rows == 0 || (residuals && found.residuals.iter().any(|column| column.len() != rows)) {
        return None;
    }
    let active: Vec<&Tuner> = problem.active().iter().map(|&i| &study.tuners[i]).collect();
    let values: Vec<f64> = problem.active().iter().map(|&i| tuners[i]).collect();
    let jacobian = DMatrix::from_fn(rows, n, |i, k| {
        let slope = if residuals { found.residuals[k][i] } else { found.rows[counting[i]][k] };
        slope / unit_slope(active[k], values[k])
    });
    let coordinates = active.iter().zip(&values).map(|(tuner, &value)| Coordinate {
        name: tuner.name.clone(),
        value,
        range: tuner.bounds[1] - tuner.bounds[0],
        unit: tuner.unit.to_string(),
    });
    let zero = zero.unwrap_or(if exact { TANGENTS } else { DIFFERENCES });
    #[allow(clippy::cast_precision_loss)]
    let deviation = match rows {
        m if residuals && m > n => (found.at.merit.objective / (m - n) as f64).sqrt(),
        _ => f64::NAN,
    };
    let starts = start_parameters(study);
    let starts =
        active.iter().map(|tuner| tuner.case.is_some() && starts.contains(&tuner.parameter.as_str())).collect();
    let sensitivity = Sensitivity::of(&jacobian, coordinates.collect(), zero);
    Some(Local { sensitivity, deviation, exact, residuals, starts })
}

/// Derivative of a tuner along its coordinate of the unit box.
fn unit_slope(tuner: &Tuner, value: f64) -> f64 {
    match tuner.grid {
        Grid::List(_) => tuner.bounds[1] - tuner.bounds[0],
        _ => tuner.slope_at(value),
    }
}

/// Rows that enter the objective or a constraint.
fn counting(problem: &Problem) -> Vec<usize> {
    let rows = problem.shape().rows.iter().enumerate();
    rows.filter(|(_, (usage, _))| *usage != Usage::Monitor).map(|(i, _)| i).collect()
}

/// What the data tell of the active tuners at given values of all tuners; `zero` is the share of the largest singular
/// value that counts as zero, where another than that of the slopes' accuracy is wanted.
pub fn sensitivity_at(problem: &Problem, tuners: &[f64], zero: Option<f64>) -> Option<SensitivityReport> {
    let local = local(problem, tuners, zero)?;
    Some(report(problem, tuners, &local))
}

/// The report on sensitivities that were found.
pub(crate) fn report(problem: &Problem, at: &[f64], local: &Local) -> SensitivityReport {
    let found = &local.sensitivity;
    let directions: Vec<DirectionReport> = found
        .blind
        .iter()
        .map(|blind| DirectionReport {
            words: blind.words.clone(),
            changes: blind.changes.iter().map(|&(k, c)| (found.coordinates[k].name.clone(), c)).collect(),
            remaining: remaining(problem, at, blind, &found.coordinates),
        })
        .collect();
    let tuners: Vec<TunerSensitivity> = (0..found.coordinates.len()).map(|k| tuner(local, k)).collect();
    let split = |eigen: &Eigen| -> (Vec<f64>, Vec<Vec<f64>>) { eigen.iter().cloned().unzip() };
    let (eigenvalues, eigenvectors) = split(&found.own);
    let (relative_values, relative_vectors) = split(&found.relative);
    let rows = |m: &DMatrix<f64>| m.row_iter().map(|row| row.iter().copied().collect()).collect();
    SensitivityReport {
        words: words(local, &tuners, &directions),
        slopes: if local.exact { "tangents" } else { "differences" },
        of: if local.residuals { "residuals" } else { "criteria" },
        rank: found.rank,
        singular_values: found.singular_values.clone(),
        zero: found.zero,
        tuners,
        matrix: rows(&found.matrix),
        eigenvalues,
        eigenvectors,
        relative: RelativeReport {
            scales: found.coordinates.iter().map(Coordinate::scale).collect(),
            eigenvalues: relative_values,
            eigenvectors: relative_vectors,
        },
        directions,
        correlations: rows(&found.correlation),
    }
}

fn tuner(local: &Local, k: usize) -> TunerSensitivity {
    let found = &local.sensitivity;
    let coordinate = &found.coordinates[k];
    let [alone, together] = [found.alone[k], found.together[k]];
    let std_error = local.deviation * together;
    // A start value near zero is as good as known where it is so by its range.
    let by_range = local.starts[k] || coordinate.value == 0.0;
    let scale = if by_range { coordinate.range } else { coordinate.scale() };
    let relative_error = std_error / scale;
    TunerSensitivity {
        name: coordinate.name.clone(),
        value: coordinate.value,
        unit: coordinate.unit.clone(),
        effect: coordinate.scale() / alone,
        std_error,
        std_error_alone: local.deviation * alone,
        relative_error,
        relative_to: if by_range { "range" } else { "value" },
        inflation: together / alone,
        trust: match relative_error {
            _ if together.is_nan() => "undetermined",
            error if error > TRUSTED => "weak",
            _ => "determined",
        },
    }
}

/// What the residuals still change a tenth along a blind direction, as a share of what its tuners change one by one.
fn remaining(problem: &Problem, at: &[f64], blind: &BlindDirection, coordinates: &[Coordinate]) -> f64 {
    let study = problem.study();
    let vector = |evaluation: Evaluation| -> Option<Vec<f64>> {
        let scaled = evaluation.scaled?;
        let of_rows = || counting(problem).into_iter().map(|i| scaled[i]).collect();
        Some(if evaluation.residuals.is_empty() { of_rows() } else { evaluation.residuals })
    };
    let moved = |changes: &[(usize, f64)]| {
        let mut tuners = at.to_vec();
        for &(k, share) in changes {
            let (i, step) = (problem.active()[k], 0.1 * share);
            let straight = blind.straight || tuners[i] == 0.0;
            tuners[i] = if straight { tuners[i] + step * coordinates[k].scale() } else { tuners[i] * step.exp() };
        }
        study.apply_ties(&mut tuners);
        vector(problem.evaluate_at(&tuners))
    };
    let Some(here) = vector(problem.evaluate_at(at)) else { return f64::NAN };
    let change = |changes: &[(usize, f64)]| -> f64 {
        let Some(there) = moved(changes) else { return f64::NAN };
        there.iter().zip(&here).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };
    let one_by_one = blind.changes.iter().map(|&one| change(&[one])).fold(0.0, f64::max);
    let together = change(&blind.changes);
    if together == 0.0 { 0.0 } else { together / one_by_one }
}

/// The findings in sentences.
fn words(local: &Local, tuners: &[TunerSensitivity], directions: &[DirectionReport]) -> Vec<String> {
    let found = &local.sensitivity;
    let n = tuners.len();
    let what = if local.residuals { "The data determine" } else { "The criteria react to" };
    let mut words = Vec::new();
    if found.rank == n {
        let condition = found.singular_values[0] / found.singular_values[n - 1];
        words.push(format!(
            "{what} every direction of the {}: locally, none can be traded for another (condition {}).",
            counted(n, "tuner"),
            coefficient(condition)
        ));
    } else {
        let open = counted(n - found.rank, "direction");
        words.push(format!("{what} {} of the {}; along {open} nothing changes.", found.rank, counted(n, "direction")));
    }
    for direction in directions {
        let mut sentence = format!("{}.", capital(&direction.words));
        if direction.changes.len() > 1 {
            sentence += match local.residuals {
                true => " Hold one of them, or measure something that tells them apart.",
                false => " There the criteria leave the design free.",
            };
            if direction.remaining.is_finite() {
                let remaining = percent(direction.remaining);
                sentence += &format!(
                    " (Checked by going a tenth along it: the change is {remaining} of that of its tuners one by one.)"
                );
            }
        }
        words.push(sentence);
    }
    // Start values belong to a recording: nobody asks how far they can be trusted.
    let asked = || tuners.iter().zip(&local.starts).filter(|(_, start)| !**start).map(|(tuner, _)| tuner);
    let known = || asked().filter(|t| t.relative_error.is_finite());
    let by_error = |a: &&TunerSensitivity, b: &&TunerSensitivity| a.relative_error.total_cmp(&b.relative_error);
    if let (Some(best), Some(worst), true) = (known().min_by(by_error), known().max_by(by_error), n > 1) {
        let aside = if local.starts.contains(&true) { "; start values aside" } else { "" };
        words.push(format!(
            "Best known is `{}`, to {}; least `{}`, to {} (one standard error{aside}).",
            best.name,
            relative(best),
            worst.name,
            relative(worst)
        ));
    }
    let weak: Vec<String> = asked().filter(|t| t.trust == "weak").map(|t| format!("`{}`", t.name)).collect();
    if !weak.is_empty() {
        words.push(format!("Do not trust the numbers of {}: uncertain by more than 10 %.", listed(&weak)));
    }
    words.extend(pairs(local, tuners));
    words
}

/// Sentences about tuners that are hard to tell apart, the closest pairs first.
fn pairs(local: &Local, tuners: &[TunerSensitivity]) -> Vec<String> {
    let found = &local.sensitivity;
    let n = tuners.len();
    let mut pairs: Vec<(usize, usize)> = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))).collect();
    pairs.retain(|&pair| found.correlation[pair].abs() > CORRELATED);
    pairs.sort_by(|&a, &b| found.correlation[b].abs().total_cmp(&found.correlation[a].abs()));
    let sentence = |&(i, j): &(usize, usize)| {
        let rho = found.correlation[(i, j)];
        let [a, b] = [&tuners[i], &tuners[j]];
        let share = |k: usize| found.together[k] / found.coordinates[k].scale();
        // The axis of the ellipse of confidence: both move by their errors.
        let (most, least) = if share(i) >= share(j) { (i, j) } else { (j, i) };
        let verb = |k: usize, sign: f64| {
            // The sign of a relative change is that of the value's.
            if sign * found.coordinates[k].value.signum() < 0.0 { "lowering" } else { "raising" }
        };
        let by = percent(0.01 * share(least) / share(most));
        let mut text = format!(
            "`{}` and `{}` are correlated ({rho:.3}): {} `{}` by 1 % is nearly undone by {} `{}` by {by}.",
            a.name,
            b.name,
            verb(most, 1.0),
            tuners[most].name,
            verb(least, rho.signum()),
            tuners[least].name
        );
        if tuners[most].relative_error.is_finite() && !local.starts[most] {
            let held = tuners[most].relative_error * (1.0 - rho * rho).sqrt();
            text += &format!(
                " With `{}` held, `{}` would be known to {} instead of {}.",
                tuners[least].name,
                tuners[most].name,
                percent(held),
                percent(tuners[most].relative_error)
            );
        }
        text
    };
    pairs.iter().take(5).map(sentence).collect()
}

/// A relative error in words.
fn relative(tuner: &TunerSensitivity) -> String {
    let of = if tuner.relative_to == "range" { " of its range" } else { "" };
    format!("{}{of}", percent(tuner.relative_error))
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().collect::<String>() + letters.as_str())
}

/// Which inputs are looked at, and how.
#[derive(Debug, Clone, Default)]
pub struct ExcitationQuestion {
    /// The inputs; all where absent.
    pub inputs: Option<Vec<String>>,
    /// Time between two samples, s; that of the recording where absent.
    pub sample_time: Option<f64>,
    /// Standard deviation of the noise on inputs, in the models' units.
    pub noise: Vec<(String, f64)>,
    /// Number of parameters to be estimated; that of the tuners that act in the case where absent.
    pub parameters: Option<usize>,
}

/// How rich the inputs of every case are.
pub fn excitations(study: &Study, question: &ExcitationQuestion) -> Vec<ExcitationReport> {
    let mut reports = Vec::new();
    for (index, case) in study.cases.iter().enumerate() {
        let horizon = case.horizon.or_else(|| study.models.iter().find_map(|(_, m)| m.interface().horizon));
        for (name, input) in &case.inputs {
            if question.inputs.as_ref().is_some_and(|wanted| !wanted.contains(name)) {
                continue;
            }
            let Some((values, sample_time)) = samples(case, input, question.sample_time, horizon) else { continue };
            let noise = question.noise.iter().find(|(of, _)| of == name).map(|(_, noise)| *noise);
            let variables = study.models.iter().flat_map(|(_, m)| &m.interface().inputs);
            let unit = variables.into_iter().find(|v| v.name == *name).map(|v| v.unit.to_string()).unwrap_or_default();
            let parameters = question.parameters.unwrap_or_else(|| tuners_in(study, index));
            let names = [case.name.as_str(), name, &unit];
            reports.push(excitation_report(&values, noise, names, sample_time, Some(parameters)));
        }
    }
    reports
}

/// The report on one signal: names of its case or file, its own and that of its unit; the time between samples, s; and the
/// number of parameters that are to be estimated, where there are some.
pub fn excitation_report(
    values: &[f64],
    noise: Option<f64>,
    [case, input, unit]: [&str; 3],
    sample_time: f64,
    parameters: Option<usize>,
) -> ExcitationReport {
    let found = excitation(values, noise);
    let suffices = found.suffices(parameters.unwrap_or(0));
    let order = if found.is_at_least() { format!("at least {}", found.order) } else { found.order.to_string() };
    let mut words = format!("`{input}` in `{case}` is persistently exciting of order {order}");
    match found.next {
        None => words += &format!(" (smallest eigenvalue {} of its power)", percent(found.eigenvalue)),
        Some(next) if found.order > 0 => {
            words += &format!(
                ": its weakest direction carries {} of its power, the next order {}",
                percent(found.eigenvalue),
                if next <= 1e-3 * found.zero { "none".to_owned() } else { percent(next) }
            );
        }
        Some(_) => words += ": it stays excited in no direction",
    }
    words += ". ";
    let linear =
        |n: usize| format!("a linear model (impulse response, transfer function) with {}", counted(n, "parameter"));
    words += &match (parameters, suffices) {
        (None, _) => format!("In the long run that suffices for {}.", linear(found.order)),
        (Some(0), _) => "No tuner depends on it.".to_owned(),
        (Some(n), true) => format!(
            "In the long run that suffices for {}, as many as tuners act here; what it tells of these, the sensitivities say.",
            linear(n)
        ),
        (Some(n), false) if found.is_at_least() => {
            format!("Whether it suffices for {} cannot be told from {} samples.", linear(n), values.len())
        }
        (Some(n), false) => {
            let once = match found.transient {
                Some(share) if share > found.zero => " What happens only once (an edge) excites more.",
                _ => "",
            };
            format!(
                "In the long run that does not suffice for {}, as many as tuners act here.{once} A model that is nonlinear, or \
                 whose parameters are tied by physics, may need less: what the data tell of the tuners, the sensitivities say.",
                linear(n)
            )
        }
    };
    ExcitationReport {
        words,
        case: case.to_owned(),
        input: input.to_owned(),
        unit: unit.to_owned(),
        samples: found.samples,
        sample_time,
        order: found.order,
        at_least: found.is_at_least(),
        power: found.power,
        eigenvalue: found.eigenvalue,
        next_eigenvalue: found.next,
        transient: found.transient,
        zero: found.zero,
        parameters,
        suffices,
        spectrum: found.spectrum,
    }
}

/// Parameters that set where a simulation begins.
fn start_parameters(study: &Study) -> Vec<&str> {
    study.models.iter().flat_map(|(_, m)| m.interface().states.iter().map(|s| s.start.as_str())).collect()
}

/// Active tuners that act in a case; start values are not excited by inputs and do not count.
fn tuners_in(study: &Study, case: usize) -> usize {
    let starts = start_parameters(study);
    let acts = |t: &&Tuner| t.active && t.case.is_none_or(|c| c == case) && !starts.contains(&t.parameter.as_str());
    study.tuners.iter().filter(acts).count()
}

/// Equally spaced samples of an input and the time between them, s; `None` where nothing says how long it lasts.
fn samples(case: &Case, input: &Input, wanted: Option<f64>, horizon: Option<f64>) -> Option<(Vec<f64>, f64)> {
    let recorded = match input {
        Input::Sampled { times, .. } => Some(times.as_slice()),
        _ => case.experiment.as_ref().and_then(|e| e.channels.first()).map(|c| c.times.as_slice()),
    };
    if let (None, Input::Sampled { times, values, .. }) = (wanted, input)
        && let Some(step) = spacing(times)
    {
        return Some((values.clone(), step));
    }
    let first = if let Input::Sampled { times, .. } = input { times[0] } else { 0.0 };
    let end = recorded.and_then(|times| times.last().copied()).or(horizon)?;
    let step = wanted.or_else(|| recorded.map(median_step)).unwrap_or(end / 1000.0);
    if !(step > 0.0 && end > first) {
        return None;
    }
    // No record is so long that this many samples would not tell its order.
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let count = (((end - first) / step + 1e-6).floor() as usize + 1).min(1_000_000);
    #[allow(clippy::cast_precision_loss)]
    let values = (0..count).map(|i| input.at(first + i as f64 * step)).collect();
    Some((values, step))
}

/// The time between samples that are equally spaced, to a thousandth of it.
pub fn spacing(times: &[f64]) -> Option<f64> {
    let step = median_step(times);
    let even = |pair: &[f64]| (pair[1] - pair[0] - step).abs() <= 1e-3 * step;
    (step > 0.0 && times.windows(2).all(even)).then_some(step)
}

fn median_step(times: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}
