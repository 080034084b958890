//! A diagnosis in sentences, for the terminal and for the report; names stand between backticks.

use mops_core::Role;
use mops_discrepancy::{Diagnosis, Found, HeldBack, Removed, Rival, StrengthValue, Unexplained, Verdict, together};

use crate::numbers::significant;

/// Rivals whose BIC lies no farther behind than this cannot be told from an effect. Source: R. E. Kass, A. E. Raftery,
/// Bayes Factors, JASA 90 (1995), section 3.2: a difference up to 2 is worth no more than a bare mention.
pub(crate) const BARE_MENTION: f64 = 2.0;

/// The verdict in a sentence or two.
pub(crate) fn verdict(diagnosis: &Diagnosis) -> String {
    match diagnosis.verdict {
        Verdict::None => format!(
            "Nothing is missing that these data could show: {}, and as much structure as there is comes with probability {} where nothing is missing.",
            left(diagnosis),
            probability(diagnosis.p_value)
        ),
        Verdict::Effect => {
            let listed = diagnosis.found.iter().map(|found| format!("`{}` {}", found.effect, at(&found.place)));
            let listed: Vec<String> = listed.collect();
            let terms: Vec<String> = diagnosis.removed.iter().map(|removed| format!("`{}`", removed.term)).collect();
            let sure = match diagnosis.found.as_slice() {
                [only] if !only.probability.is_nan() => format!(" (probability {})", probability(only.probability)),
                _ => String::new(),
            };
            let what = match (listed.as_slice(), terms.as_slice()) {
                (listed, []) => format!("lacks {}{sure}", list(listed)),
                ([], terms) => format!("does not need {}", list(terms)),
                (listed, terms) => format!("lacks {}{sure}, and does not need {}", list(listed), list(terms)),
            };
            format!("The model {what}: {}.", changed(diagnosis))
        }
        Verdict::Unexplained => {
            let listed: Vec<String> = diagnosis.found.iter().map(|found| format!("`{}`", found.effect)).collect();
            let place = diagnosis.unexplained.as_ref().map_or_else(String::new, |u| format!(" {}", at(&u.place)));
            let (subject, free) = if listed.is_empty() {
                (format!("Something is missing{place}"), "; a free signal there takes".to_owned())
            } else {
                // The place is where the residual of the declared model comes from.
                let subject = format!("Even with {} something is missing", list(&listed));
                (subject, format!(". Without them a free signal{place} takes"))
            };
            let told = |u: &Unexplained| format!("{free} {} of what is above the noise", share(u.share));
            let free = diagnosis.unexplained.as_ref().map_or_else(String::new, told);
            format!("{subject} that none of the effects tried explains: {}{free}.", changed(diagnosis))
        }
    }
}

/// What the probability of a diagnosis is of.
pub(crate) fn of_what(diagnosis: &Diagnosis) -> &'static str {
    let several = diagnosis.verdict == Verdict::Effect && diagnosis.found.len() > 1;
    if several { "that all of these are right" } else { "of the verdict" }
}

/// `the error falls from 2.10 to 1.00 times the noise on calibration data and from 15.40 to 1.00 on validation data`.
fn changed(diagnosis: &Diagnosis) -> String {
    let mut last = "";
    let text = by_role(|role| {
        let [before, after] = [together(&diagnosis.before, role)?, together(&diagnosis.after, role)?];
        let [from, to] = [before, after].map(times);
        let verb = match () {
            () if from == to => "stays at ",
            () if after < before => "falls from ",
            () => "rises from ",
        };
        // A verb that was just said is not said again.
        let again = std::mem::replace(&mut last, verb) == verb;
        let said = if again { verb.split_once(' ').map_or("", |(_, rest)| rest) } else { verb };
        let numbers = if from == to { from } else { format!("{from} to {to}") };
        Some(format!("{said}{numbers}"))
    });
    format!("the error {text}")
}

/// `the model leaves 1.02 times the noise on calibration data`.
fn left(diagnosis: &Diagnosis) -> String {
    format!("the model leaves {}", by_role(|role| together(&diagnosis.before, role).map(times)))
}

/// What there is to say of each role, with the unit after the first.
fn by_role(mut say: impl FnMut(Role) -> Option<String>) -> String {
    let mut parts = Vec::new();
    for role in ROLES {
        if let Some(text) = say(role) {
            let unit = if parts.is_empty() { " times the noise" } else { "" };
            parts.push(format!("{text}{unit} on {} data", role.name()));
        }
    }
    if parts.is_empty() { "is not known".to_owned() } else { list(&parts) }
}

const ROLES: [Role; 3] = [Role::Calibration, Role::Selection, Role::Validation];

/// An error in units of the noise.
pub(crate) fn times(error: f64) -> String {
    if error.is_finite() && error < 100.0 { format!("{error:.2}") } else { significant(error, 3) }
}

/// Where a place is: `in the joint `phi``.
pub(crate) fn at(place: &str) -> String {
    match place.split_once(':') {
        Some(("joint", name)) => format!("in the joint `{name}`"),
        Some(("process", name)) => format!("in the equation of `{name}`"),
        Some(("extra_state", name)) => format!("in a further state at `{name}`"),
        Some(("actuator", name)) => format!("at the actuator `{name}`"),
        Some(("sensor", name)) => format!("at the sensor of `{name}`"),
        _ => format!("at `{place}`"),
    }
}

/// A declared term, and where it acts as far as that is known.
pub(crate) fn term(removed: &Removed) -> String {
    let at = if removed.place.is_empty() { String::new() } else { format!(" {}", at(&removed.place)) };
    format!("`{}`{at}", removed.term)
}

/// `torque = 0.0124 (0.0118 to 0.0130) N m`.
pub(crate) fn strength(strength: &StrengthValue) -> String {
    let StrengthValue { name, value, unit, interval95, .. } = strength;
    let range = interval95.filter(|ends| ends.iter().all(|v| v.is_finite()));
    let range =
        range.map_or_else(String::new, |[low, high]| format!(" ({} to {})", significant(low, 3), significant(high, 3)));
    let unit = if unit.is_empty() || unit == "1" { String::new() } else { format!(" {unit}") };
    format!("{name} = {}{range}{unit}", significant(*value, 4))
}

/// When an effect acted, and why it may be another, in sentences.
pub(crate) fn remarks(found: &Found) -> Vec<String> {
    let once = |only: &String| format!("`{}` {} acted once, in `{only}` alone.", found.effect, at(&found.place));
    found.only.iter().map(once).chain(forecasts(found)).chain(confusable(found)).chain(unstable(found)).collect()
}

/// What an effect does for data that were held back, in sentences.
fn forecasts(found: &Found) -> Vec<String> {
    let about = format!("`{}` {}", found.effect, at(&found.place));
    let told = |is: fn(f64, f64) -> bool| {
        let those = found.held_back.iter().filter(|h| times(h.with) != times(h.without) && is(h.with, h.without));
        let error = |(k, h): (usize, &HeldBack)| {
            let unit = if k == 0 { " times the noise" } else { "" };
            let had_a_say = if h.role == Role::Selection { " (which had a say)" } else { "" };
            format!("{} instead of {}{unit} on {} data{had_a_say}", times(h.without), times(h.with), h.role.name())
        };
        those.enumerate().map(error).collect::<Vec<String>>()
    };
    let (better, worse) = (told(|with, without| with < without), told(|with, without| with > without));
    let said = |sentence: &str, errors: &[String]| {
        let text = || format!("{sentence} the error is {}.", list(errors));
        (!errors.is_empty()).then(text)
    };
    let borne_out = said(&format!("The model forecasts better with {about}: without it"), &better);
    borne_out.into_iter().chain(said(&format!("The model forecasts better without {about}:"), &worse)).collect()
}

/// That the choice of an effect hangs on parts of the data; `None` where it holds in 95 % of those drawn anew.
fn unstable(found: &Found) -> Option<String> {
    let stability = found.stability.as_ref()?;
    let hangs =
        stability.hangs_on.iter().map(|h| format!("without `{}` it is `{}` {}", h.experiment, h.effect, at(&h.place)));
    let hangs: Vec<String> = hangs.collect();
    (stability.share < 0.95 || !hangs.is_empty()).then(|| {
        let others = if hangs.is_empty() { String::new() } else { format!("; {}", list(&hangs)) };
        let (effect, place, percent) = (&found.effect, at(&found.place), share(stability.share));
        format!("`{effect}` {place} does best in {percent} of data sets drawn anew in blocks from these{others}.")
    })
}

/// What the data cannot tell from an effect, a sentence; `None` where there is nothing.
fn confusable(found: &Found) -> Option<String> {
    let close = |rivals: &mut dyn Iterator<Item = &Rival>| -> Vec<String> {
        rivals.map(|r| format!("`{}` {} ({})", r.effect, at(&r.place), probability(r.probability))).collect()
    };
    let told = |is: fn(f64) -> bool| close(&mut found.indistinguishable.iter().filter(|r| is(r.bic_behind)));
    let likelier = told(|behind| behind <= -BARE_MENTION);
    let equal = told(|behind| behind.abs() < BARE_MENTION);
    let behind = told(|behind| behind >= BARE_MENTION);
    let about = format!("`{}` {}", found.effect, at(&found.place));
    let mut said = Vec::new();
    if !likelier.is_empty() {
        said.push(format!("in the place of {about} the data prefer {}", list(&likelier)));
    }
    if !equal.is_empty() {
        said.push(format!("the data cannot tell {about} from {}", list(&equal)));
    }
    match (said.is_empty(), behind.is_empty()) {
        (_, true) => {}
        (true, false) => said.push(format!("less likely than {about}, but not excluded: {}", list(&behind))),
        (false, false) => said.push(format!("less likely, but not excluded: {}", list(&behind))),
    }
    (!said.is_empty()).then(|| capitalised(&format!("{}.", said.join("; "))))
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// A probability in percent, honest at both ends.
pub(crate) fn probability(p: f64) -> String {
    match p {
        p if p.is_nan() => "n/a".to_owned(),
        p if p < 1e-4 => "<0.01 %".to_owned(),
        p if p > 0.9999 => ">99.99 %".to_owned(),
        p if p > 0.99 => format!("{} %", significant(100.0 * p, 4)),
        p => format!("{} %", significant(100.0 * p, 2)),
    }
}

/// A share in percent.
pub(crate) fn share(share: f64) -> String {
    if share.is_finite() { format!("{:.0} %", 100.0 * share) } else { "n/a".to_owned() }
}

/// `a`, `a and b`, `a, b and c`.
pub(crate) fn list(parts: &[String]) -> String {
    match parts {
        [] => String::new(),
        [one] => one.clone(),
        [all @ .., last] => format!("{} and {last}", all.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::made_up;
    use super::*;

    #[test]
    fn every_verdict_is_one_sentence_with_the_place_and_the_numbers() {
        let found = verdict(&made_up::coulomb());
        for part in [
            "falls from 4.20 to 1.00 times the noise on calibration data and from 15.40 to 1.02 on validation data",
            "lacks `coulomb-friction` in the joint `phi`",
            "probability 97 %",
        ] {
            assert!(found.contains(part), "{part}: {found}");
        }
        assert!(verdict(&made_up::nothing()).starts_with("Nothing is missing that these data could show"));
        let unexplained = verdict(&made_up::unexplained());
        assert!(unexplained.contains("in the equation of `x`") && unexplained.contains("80 %"), "{unexplained}");
    }

    #[test]
    fn what_is_equally_likely_is_told_from_what_is_only_not_excluded() {
        let text = confusable(&made_up::coulomb().found[0]).unwrap();
        assert!(text.contains("cannot tell `coulomb-friction` in the joint `phi` from `stribeck-friction`"), "{text}");
        assert!(text.contains("not excluded: `quadratic-drag`"), "{text}");
        let text = &remarks(&made_up::coulomb().found[0])[1];
        assert!(text.contains("does best in 83 % of data sets") && text.contains("without `swing` it is"), "{text}");
    }

    #[test]
    fn what_an_effect_does_for_data_held_back_is_told_with_both_errors() {
        let mut found = made_up::coulomb().found.remove(0);
        assert!(forecasts(&found).is_empty());
        let held_back = |role, without, with| HeldBack { role, without, with };
        found.held_back = vec![held_back(Role::Selection, 1.27, 1.0), held_back(Role::Validation, 0.99, 1.03)];
        assert_eq!(
            forecasts(&found),
            [
                "The model forecasts better with `coulomb-friction` in the joint `phi`: without it the error is 1.27 instead of 1.00 times the noise on selection data (which had a say).",
                "The model forecasts better without `coulomb-friction` in the joint `phi`: the error is 0.99 instead of 1.03 times the noise on validation data.",
            ]
        );
        found.held_back = vec![held_back(Role::Validation, 1.001, 1.004)];
        assert!(forecasts(&found).is_empty());
    }

    #[test]
    fn a_rival_that_is_likelier_is_told_first() {
        let mut found = made_up::coulomb().found.remove(0);
        found.indistinguishable[0].bic_behind = -3.0;
        let text = confusable(&found).unwrap();
        assert!(
            text.starts_with(
                "In the place of `coulomb-friction` in the joint `phi` the data prefer `stribeck-friction` in the joint `phi`"
            ),
            "{text}"
        );
        assert!(text.contains("; less likely, but not excluded: `quadratic-drag`"), "{text}");
    }

    #[test]
    fn probabilities_near_certainty_keep_their_distance_from_it() {
        let cases = [(0.974, "97 %"), (0.9973, "99.73 %"), (0.99999, ">99.99 %"), (1e-9, "<0.01 %"), (f64::NAN, "n/a")];
        for (p, text) in cases {
            assert_eq!(probability(p), text);
        }
    }
}
