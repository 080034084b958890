//! Sentences on a diagnosis, for the terminal and the report; names are between backticks.

use mops_core::Role;
use mops_outcome::diagnosis::{
    Alignment, Dependence, Diagnosis, Found, HeldOut, NamedBy, Removed, Rival, Rule, StrengthValue, Verdict,
    WiderRange, WiderRanges, together,
};

use mops_content::numbers::significant;

/// BIC difference up to which the data cannot distinguish an alternative from an effect. Source: R. E. Kass, A. E.
/// Raftery, Bayes Factors, JASA 90 (1995), section 3.2: a difference up to 2 is not worth more than a bare mention.
pub const BARE_MENTION: f64 = 2.0;

/// Returns the verdict in one to three sentences.
pub fn verdict(diagnosis: &Diagnosis) -> String {
    match diagnosis.verdict {
        Verdict::None => {
            let provided =
                alignment(diagnosis).map_or_else(String::new, |alignment| format!(", provided that {alignment}"));
            format!(
                "No missing effect detected{provided}. Residual: {} ({} for white residuals).",
                residual_level(diagnosis),
                p_value(diagnosis.p_value)
            )
        }
        Verdict::Effect => {
            let terms: Vec<String> = diagnosis.removed.iter().map(|dropped| format!("`{}`", dropped.term)).collect();
            let lacking = claims(diagnosis).map(|claims| format!("lacks {claims}"));
            let needless = (!terms.is_empty()).then(|| format!("does not need {}", list(&terms)));
            let finding: Vec<String> = lacking.into_iter().chain(needless).collect();
            let finding = finding.join(", and ");
            let sentences = [aligned(diagnosis), explained(diagnosis), proposed(diagnosis), remaining(diagnosis)];
            let more: String = sentences.into_iter().flatten().map(|sentence| format!(" {sentence}")).collect();
            format!("The model {finding}: {}.{more}", error_change(diagnosis))
        }
        Verdict::Unexplained if diagnosis.wider.is_some() => wider(diagnosis),
        Verdict::Unexplained => {
            let coordinate = diagnosis.depends_on.as_ref().map(|on| format!("that depends on {}", depends_on(on)));
            let what = match (coordinate, diagnosis.found.is_empty()) {
                (Some(coordinate), true) => format!("something {coordinate}, and no effect is named"),
                (Some(coordinate), false) => format!("something {coordinate}"),
                (None, true) => "something that no tested effect explains".to_owned(),
                (None, false) => "something".to_owned(),
            };
            let sentences = [proposed(diagnosis), aligned(diagnosis)];
            let more: String = sentences.into_iter().flatten().map(|sentence| format!(" {sentence}")).collect();
            format!("The model lacks {what}: {}.{more}", error_change(diagnosis))
        }
    }
}

/// Returns that ranges of declared parameters end too early.
fn wider(diagnosis: &Diagnosis) -> String {
    let Some(WiderRanges { ranges, error }) = &diagnosis.wider else { return String::new() };
    let of = |range: &WiderRange| {
        let [value, end] = [range.value, range.end].map(|value| significant(value, 3));
        let unit = if range.unit == "1" { String::new() } else { format!(" {}", range.unit) };
        format!("`{}` = {value}{unit}, beyond the end {end}{unit} of its range", range.parameter)
    };
    let before = together(&diagnosis.before, Role::Calibration).map_or_else(String::new, times);
    let range = if ranges.len() == 1 { "range" } else { "ranges" };
    format!(
        "No effect is named, as the {range} may be too narrow: with {} the declared model leaves {} times the noise \
         level on calibration data instead of {before}, no more than with any effect. Widen the {range} if that is \
         plausible, and diagnose again.",
        list(&ranges.iter().map(of).collect::<Vec<String>>()),
        times(*error),
    )
}

/// Returns what is claimed: class and place, each with the effect that describes it best; `None` if nothing is.
fn claims(diagnosis: &Diagnosis) -> Option<String> {
    let claimed: Vec<&Found> = diagnosis.found.iter().filter(|found| found.claimed).collect();
    let mut entries: Vec<(String, String)> = claimed.iter().map(|f| (f.class.clone(), f.places())).collect();
    entries.dedup();
    let claim = |(class, place): &(String, String)| {
        let own: Vec<&&Found> = claimed.iter().filter(|f| f.class == *class && f.places() == *place).collect();
        let names: Vec<String> = own.iter().map(|found| format!("`{}`", found.effect)).collect();
        let certainty = own.first().filter(|f| !f.class_probability.is_nan());
        let certainty =
            certainty.map_or_else(String::new, |f| format!(" (probability {})", probability(f.class_probability)));
        // What the data cannot distinguish is one claim.
        let alike: String = own.iter().map(|found| or_alike(found)).collect();
        format!("{} {}{alike}{certainty}, best described by {}", self::class(class), at(place), list(&names))
    };
    (!entries.is_empty()).then(|| list(&entries.iter().map(claim).collect::<Vec<String>>()))
}

/// Returns the classes and places that the records cannot distinguish from those of an effect, each after `, or`.
fn or_alike(found: &Found) -> String {
    let others = found.alike.iter().filter_map(|other| other.split_once(" at "));
    others.map(|(class, place)| format!(", or {class} {}", at(place))).collect()
}

/// Returns an effect of a class with its article: `an elastic effect`.
pub fn class(class: &str) -> String {
    let article = if class.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {class} effect")
}

/// Returns a sentence on recorded inputs that act at other times than the study says.
fn aligned(diagnosis: &Diagnosis) -> Option<String> {
    alignment(diagnosis).map(|alignment| format!("The records agree better with the model if {alignment}."))
}

/// Returns when recorded inputs act, if at other times than the study says.
fn alignment(diagnosis: &Diagnosis) -> Option<String> {
    let of = |own: &Alignment| {
        let earlier = if own.shift < 0.0 {
            format!("acts {} s before its time stamps", significant(-own.shift, 4))
        } else {
            "is interpolated otherwise between its samples".to_owned()
        };
        format!("the input `{}` {earlier} (`hold = \"{}\"`)", own.input, own.hold.name())
    };
    let all: Vec<String> = diagnosis.alignment.iter().map(of).collect();
    (!all.is_empty()).then(|| list(&all))
}

/// Returns a sentence on the share of the held-out error that the effects explain.
fn explained(diagnosis: &Diagnosis) -> Option<String> {
    let explained = diagnosis.explained_share.filter(|_| !diagnosis.found.is_empty())?;
    let is_known = |role: &Role| {
        let errors = [&diagnosis.before, &diagnosis.after].map(|errors| together(errors, *role));
        errors.into_iter().all(|error| error.is_some_and(f64::is_finite))
    };
    let role = [Role::Validation, Role::Selection].into_iter().find(is_known)?;
    let most = if diagnosis.explains_most() { "" } else { "; most remains unexplained" };
    let left = together(&diagnosis.after, role).map_or_else(String::new, times);
    let left = format!("; an error of {left} times the noise level is left");
    Some(format!(
        "The effects found explain {} of the squared error on {} data{}.",
        share(explained),
        role.name(),
        if diagnosis.explains_most() && explained > NEARLY_ALL { &left } else { most }
    ))
}

/// Returns a sentence on the effects that describe the data, but are not claimed.
fn proposed(diagnosis: &Diagnosis) -> Option<String> {
    let proposed: Vec<String> = diagnosis
        .found
        .iter()
        .filter(|found| !found.claimed && !found.given)
        .map(|found| format!("`{}` {}{}", found.effect, at(&found.places()), or_alike(found)))
        .collect();
    let by = match diagnosis.named_by {
        NamedBy::Evidence => "Not claimed, but the best description:",
        NamedBy::LeastSquares => {
            "Not claimed, as correlated errors explain as much, but the best description by least squares:"
        }
    };
    (!proposed.is_empty()).then(|| format!("{by} {}.", list(&proposed)))
}

/// Returns a sentence on what remains with the effects found.
fn remaining(diagnosis: &Diagnosis) -> Option<String> {
    diagnosis.remaining.as_ref().map(|dependence| format!("What remains depends on {}.", depends_on(dependence)))
}

/// Returns a coordinate with its place in words: ``the speed in the joint `q` ``.
pub fn depends_on(dependence: &Dependence) -> String {
    let name = |place: &str| place.split_once(':').map_or(place, |(_, name)| name).to_owned();
    let Dependence { coordinate, place, other, .. } = dependence;
    match other {
        Some(other) if coordinate == "level" => {
            format!("the level of `{}`, as a flow into `{}`", name(place), name(other))
        }
        Some(other) => format!("the {coordinate} between the joints `{}` and `{}`", name(place), name(other)),
        None => format!("the {coordinate} {}", at(place)),
    }
}

/// Returns the event that the probability of a diagnosis refers to, as the end of a phrase.
pub fn of_what(diagnosis: &Diagnosis) -> &'static str {
    match diagnosis.verdict {
        Verdict::Effect => "of class and place",
        Verdict::None | Verdict::Unexplained => "of the verdict",
    }
}

/// Returns whether an effect is claimed, proposed or given.
pub fn status(found: &Found) -> &'static str {
    match (found.given, found.claimed) {
        (true, _) => "given",
        (false, true) => "claimed",
        (false, false) => "proposed",
    }
}

/// Returns why a candidate was not claimed.
pub fn failed(rule: Rule) -> &'static str {
    match rule {
        Rule::Evidence => "no evidence",
        Rule::Forecast => "no better forecast",
        Rule::Curve => "most remains",
        Rule::Probability => "less probable",
        Rule::Error => "leaves more",
        Rule::Claim => "proposed",
    }
}

/// Smallest p-value that is shown as a number.
const LEAST_P: f64 = 1e-4;

/// Returns a p-value as `p = 0.43` or `p < 0.0001`.
fn p_value(p: f64) -> String {
    match p {
        p if p.is_nan() => "p not known".to_owned(),
        p if p < LEAST_P => format!("p < {LEAST_P}"),
        p => format!("p = {}", significant(p, 2)),
    }
}

/// Returns a p-value in a table or a list: `0.43`, `below 0.0001`, `n/a`.
pub fn chance(p: f64) -> String {
    if p < LEAST_P { format!("below {LEAST_P}") } else { significant(p, 2) }
}

/// Returns a sentence on the errors by role, as `the error falls from 2.10 to 1.00 times the noise level on calibration
/// data and from 15.40 to 1.00 on validation data`.
fn error_change(diagnosis: &Diagnosis) -> String {
    let mut last = "";
    let change = by_role(" times the noise level", |role| {
        let [before, after] = [together(&diagnosis.before, role)?, together(&diagnosis.after, role)?];
        let [from, to] = [before, after].map(times);
        let verb = match () {
            () if from == to => "stays at ",
            () if after < before => "falls from ",
            () => "rises from ",
        };
        // A repeated verb is omitted.
        let repeated = std::mem::replace(&mut last, verb) == verb;
        let verb = if repeated { verb.split_once(' ').map_or("", |(_, rest)| rest) } else { verb };
        let numbers = if from == to { from } else { format!("{from} to {to}") };
        Some(format!("{verb}{numbers}"))
    });
    format!("the error {}", change.unwrap_or_else(|| "is not known".to_owned()))
}

/// Returns the residual of the model without missing effects, its inputs aligned: `1.02 x noise on calibration data`.
fn residual_level(diagnosis: &Diagnosis) -> String {
    let level = by_role(" x noise", |role| together(&diagnosis.after, role).map(times));
    level.unwrap_or_else(|| "not known".to_owned())
}

/// Lists `text` for every role that has one, with the unit after the first; `None` if no role has one.
fn by_role(unit: &str, mut text: impl FnMut(Role) -> Option<String>) -> Option<String> {
    let mut parts = Vec::new();
    for role in ROLES {
        if let Some(text) = text(role) {
            let unit = if parts.is_empty() { unit } else { "" };
            parts.push(format!("{text}{unit} on {} data", role.name()));
        }
    }
    (!parts.is_empty()).then(|| list(&parts))
}

const ROLES: [Role; 3] = [Role::Calibration, Role::Selection, Role::Validation];

/// Formats an error in units of the noise level.
pub fn times(error: f64) -> String {
    if error.is_finite() && error < 100.0 { format!("{error:.2}") } else { significant(error, 3) }
}

/// Returns a place in words: ``in the joint `phi` ``, of an effect on two of a kind ``between the joints `a` and `b`
/// ``.
pub fn at(place: &str) -> String {
    if let Some((first, second)) = place.split_once(" with ") {
        let name = |place: &str| place.split_once(':').map_or(place, |(_, name)| name).to_owned();
        let between = if first.starts_with("joint:") { "between the joints" } else { "in the equations of" };
        return format!("{between} `{}` and `{}`", name(first), name(second));
    }
    match place.split_once(':') {
        Some(("joint", name)) => format!("in the joint `{name}`"),
        Some(("speed", name)) => format!("against the speed `{name}`"),
        Some(("process", name)) => format!("in the equation of `{name}`"),
        Some(("extra_state", name)) => format!("in an additional state at `{name}`"),
        Some(("actuator", name)) => format!("at the actuator `{name}`"),
        Some(("sensor", name)) => format!("at the sensor of `{name}`"),
        _ => format!("at `{place}`"),
    }
}

/// Returns a dropped term with its place, if known.
pub fn term(dropped: &Removed) -> String {
    let place = if dropped.place.is_empty() { String::new() } else { format!(" {}", at(&dropped.place)) };
    format!("`{}`{place}", dropped.term)
}

/// Returns the ends of an interval, or that there is none because its parameter stands at a bound.
pub fn ends(interval: Option<[f64; 2]>, at_bound: bool, digits: usize) -> [String; 2] {
    match interval {
        Some(ends) => ends.map(|end| significant(end, digits)),
        None if at_bound => ["at a bound".to_owned(), String::new()],
        None => Default::default(),
    }
}

/// Returns a parameter of an effect with its interval: `torque = 0.0124 (0.0118 to 0.0130) N m`.
pub fn strength(strength: &StrengthValue) -> String {
    let StrengthValue { name, value, unit, interval95, at_bound, .. } = strength;
    let range = interval95.filter(|ends| ends.iter().all(|v| v.is_finite()));
    let range =
        range.map_or_else(String::new, |[low, high]| format!(" ({} to {})", significant(low, 3), significant(high, 3)));
    let unit = if unit.is_empty() || unit == "1" { String::new() } else { format!(" {unit}") };
    let bound = if *at_bound { " (at a bound)" } else { "" };
    format!("{name} = {}{range}{unit}{bound}", significant(*value, 4))
}

/// Returns sentences on an effect: its only experiment, held-out errors and alternatives.
pub fn remarks(found: &Found) -> Vec<String> {
    let only = |only: &String| format!("`{}` {} acts in experiment `{only}` only.", found.effect, at(&found.places()));
    let only = found.only.iter().map(only);
    only.chain(held_out_errors(found)).chain(alternatives(found)).collect()
}

/// Returns sentences on the errors with and without an effect on held-out data.
fn held_out_errors(found: &Found) -> Vec<String> {
    let effect = format!("`{}` {}", found.effect, at(&found.places()));
    let errors = |is: fn(f64, f64) -> bool| {
        let of_sign = found.held_out.iter().filter(|h| times(h.with) != times(h.without) && is(h.with, h.without));
        let error = |(k, h): (usize, &HeldOut)| {
            let unit = if k == 0 { " times the noise level" } else { "" };
            let selected = if h.role == Role::Selection { " (used to select the effects)" } else { "" };
            format!("{} instead of {}{unit} on {} data{selected}", times(h.without), times(h.with), h.role.name())
        };
        of_sign.enumerate().map(error).collect::<Vec<String>>()
    };
    let (better, worse) = (errors(|with, without| with < without), errors(|with, without| with > without));
    let sentence = |start: &str, errors: &[String]| {
        let text = || format!("{start} the error is {}.", list(errors));
        (!errors.is_empty()).then(text)
    };
    let better = sentence(&format!("The model predicts better with {effect}: without it,"), &better);
    better.into_iter().chain(sentence(&format!("The model predicts better without {effect}:"), &worse)).collect()
}

/// Returns a sentence on the alternatives that the data do not exclude; `None` if there are none.
fn alternatives(found: &Found) -> Option<String> {
    let listed = |rivals: &mut dyn Iterator<Item = &Rival>| -> Vec<String> {
        rivals.map(|r| format!("`{}` {} ({})", r.effect, at(&r.place), probability(r.probability))).collect()
    };
    let rivals = |is: fn(f64) -> bool| listed(&mut found.indistinguishable.iter().filter(|r| is(r.bic_behind)));
    let likelier = rivals(|behind| behind <= -BARE_MENTION);
    let equal = rivals(|behind| behind.abs() < BARE_MENTION);
    let behind = rivals(|behind| behind >= BARE_MENTION);
    let effect = format!("`{}` {}", found.effect, at(&found.places()));
    let mut clauses = Vec::new();
    if !likelier.is_empty() {
        clauses.push(format!("the data favour {} over {effect}", list(&likelier)));
    }
    if !equal.is_empty() {
        clauses.push(format!("the data cannot distinguish {effect} from {}", list(&equal)));
    }
    match (clauses.is_empty(), behind.is_empty()) {
        (_, true) => {}
        (true, false) => clauses.push(format!("less likely than {effect}, but not excluded: {}", list(&behind))),
        (false, false) => clauses.push(format!("less likely, but not excluded: {}", list(&behind))),
    }
    (!clauses.is_empty()).then(|| capitalised(&format!("{}.", clauses.join("; "))))
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Formats a probability in percent; never rounded to 0 or 100 %.
pub fn probability(p: f64) -> String {
    match p {
        p if p.is_nan() => "n/a".to_owned(),
        p if p < 1e-4 => "<0.01 %".to_owned(),
        p if p > 0.9999 => ">99.99 %".to_owned(),
        p if p > 0.99 => format!("{} %", significant(100.0 * p, 4)),
        p => format!("{} %", significant(100.0 * p, 2)),
    }
}

/// Share above which no number is printed: what is left counts then.
const NEARLY_ALL: f64 = 0.99;

/// Formats a share in percent.
pub fn share(share: f64) -> String {
    match share {
        share if !share.is_finite() => "n/a".to_owned(),
        share if share > NEARLY_ALL => format!("more than {:.0} %", 100.0 * NEARLY_ALL),
        share => format!("{:.0} %", 100.0 * share),
    }
}

/// Joins parts: `a`, `a and b`, `a, b and c`.
pub fn list(parts: &[String]) -> String {
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
    fn every_verdict_names_the_place_and_the_errors() {
        let found = verdict(&made_up::coulomb());
        for part in [
            "falls from 4.20 to 1.00 times the noise level on calibration data and from 15.40 to 1.02 on validation data",
            "lacks a dissipative effect in the joint `phi` (probability 95 %), best described by `coulomb-friction`",
            "explain more than 99 % of the squared error on validation data; an error of 1.02 times the noise level is left",
        ] {
            assert!(found.contains(part), "{part}: {found}");
        }
        assert_eq!(
            verdict(&made_up::nothing()),
            "No missing effect detected. Residual: 1.00 x noise on calibration data and 1.02 on validation data \
             (p = 0.43 for white residuals)."
        );
        let unexplained = verdict(&made_up::unexplained());
        assert!(unexplained.contains("depends on the position in the equation of `x`"), "{unexplained}");
        let mut proposed = made_up::unexplained();
        proposed.found = made_up::coulomb().found;
        proposed.found[0].claimed = false;
        let text = verdict(&proposed);
        assert!(
            text.ends_with("Not claimed, but the best description: `coulomb-friction` in the joint `phi`."),
            "{text}"
        );
    }

    #[test]
    fn equally_likely_alternatives_are_listed_before_those_not_excluded() {
        let text = alternatives(&made_up::coulomb().found[0]).unwrap();
        let equal = "cannot distinguish `coulomb-friction` in the joint `phi` from `stribeck-friction`";
        assert!(text.contains(equal), "{text}");
        assert!(text.contains("not excluded: `quadratic-drag`"), "{text}");
    }

    #[test]
    fn held_out_errors_are_reported_with_and_without_the_effect() {
        let mut found = made_up::coulomb().found.remove(0);
        assert!(held_out_errors(&found).is_empty());
        let held_out = |role, without, with| HeldOut { role, without, with };
        found.held_out = vec![held_out(Role::Selection, 1.27, 1.0), held_out(Role::Validation, 0.99, 1.03)];
        assert_eq!(
            held_out_errors(&found),
            [
                "The model predicts better with `coulomb-friction` in the joint `phi`: without it, the error is 1.27 instead of 1.00 times the noise level on selection data (used to select the effects).",
                "The model predicts better without `coulomb-friction` in the joint `phi`: the error is 0.99 instead of 1.03 times the noise level on validation data.",
            ]
        );
        found.held_out = vec![held_out(Role::Validation, 1.001, 1.004)];
        assert!(held_out_errors(&found).is_empty());
    }

    #[test]
    fn a_likelier_alternative_is_reported_first() {
        let mut found = made_up::coulomb().found.remove(0);
        found.indistinguishable[0].bic_behind = -3.0;
        let text = alternatives(&found).unwrap();
        assert!(
            text.starts_with(
                "The data favour `stribeck-friction` in the joint `phi` (1 %) over `coulomb-friction` in the joint `phi`"
            ),
            "{text}"
        );
        assert!(text.contains("; less likely, but not excluded: `quadratic-drag`"), "{text}");
    }

    #[test]
    fn probabilities_are_never_rounded_to_zero_or_one() {
        let cases = [(0.974, "97 %"), (0.9973, "99.73 %"), (0.99999, ">99.99 %"), (1e-9, "<0.01 %"), (f64::NAN, "n/a")];
        for (p, text) in cases {
            assert_eq!(probability(p), text);
        }
    }
}
