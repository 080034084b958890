//! Formatting of numbers and lists in sentences.

use mops_math as math;

/// Largest number of findings of one kind, on different cases, with a sentence each; more of them have one in common.
pub(super) const MANY: usize = 4;

/// Returns names without repetitions, in the order of their first occurrence.
pub(super) fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    names.fold(Vec::new(), |mut known, name| {
        if !known.contains(&name) {
            known.push(name);
        }
        known
    })
}

/// Formats a number with three significant digits: `0.0150`, `4.00`, `1230`, `3.20e-7`.
pub(super) fn coefficient(value: f64) -> String {
    digits(value, 3)
}

/// Formats a number with `count` significant digits, at least one.
fn digits(value: f64, count: usize) -> String {
    let decimals = count - 1;
    let scientific = format!("{value:.decimals$e}");
    let Some((_, exponent)) = scientific.split_once('e') else { return scientific };
    match exponent.parse::<i32>() {
        Ok(exponent @ -4..=5) => {
            let rounded: f64 = scientific.parse().unwrap_or(value);
            format!("{rounded:.*}", usize::try_from(i32::try_from(decimals).unwrap_or(0) - exponent).unwrap_or(0))
        }
        _ => scientific,
    }
}

/// Formats an estimate and its standard error, to two digits of the error: `0.9989 +- 0.0011`.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
pub(super) fn estimate(value: f64, error: f64) -> String {
    let more = math::log10(value.abs() / error).floor().clamp(-1.0, 13.0);
    let count = if more.is_finite() { (more + 2.0) as usize } else { 3 };
    format!("{} +- {}", digits(value, count.max(1)), digits(error, 2))
}

/// Formats a share in percent, with two digits.
pub(super) fn percent(share: f64) -> String {
    let rounded: f64 = format!("{:.1e}", 100.0 * share).parse().unwrap_or(f64::NAN);
    if rounded.abs() < 1e-4 || rounded.abs() >= 1e6 { format!("{rounded:e} %") } else { format!("{rounded} %") }
}

/// Joins parts to `a, b and c`.
pub(super) fn listed(parts: &[String]) -> String {
    match parts {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Formats a count with its noun: `1 parameter`, `3 parameters`.
pub(super) fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        assert_eq!([0.015_006, 4.0, 1234.5, 3.2e-7].map(coefficient), ["0.0150", "4.00", "1230", "3.20e-7"]);
        assert_eq!(estimate(0.998_872, 0.001_11), "0.9989 +- 0.0011");
        assert_eq!(estimate(-9.316, 5.297), "-9.3 +- 5.3");
        assert_eq!(estimate(0.0, 0.012), "0 +- 0.012");
        assert_eq!([0.0312, 1.0, 1e-9].map(percent), ["3.1 %", "100 %", "1e-7 %"]);
        assert_eq!(listed(&["a".into(), "b".into(), "c".into()]), "a, b and c");
    }
}
