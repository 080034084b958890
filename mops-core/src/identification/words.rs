//! Numbers and lists inside sentences.

/// A number to three significant digits: `0.0150`, `4.00`, `1230`, `3.20e-7`.
pub(super) fn coefficient(value: f64) -> String {
    let scientific = format!("{value:.2e}");
    let Some((_, exponent)) = scientific.split_once('e') else { return scientific };
    match exponent.parse::<i32>() {
        Ok(exponent @ -4..=5) => {
            let rounded: f64 = scientific.parse().unwrap_or(value);
            format!("{rounded:.*}", usize::try_from(2 - exponent).unwrap_or(0))
        }
        _ => scientific,
    }
}

/// A share in percent, to two digits.
pub(super) fn percent(share: f64) -> String {
    let rounded: f64 = format!("{:.1e}", 100.0 * share).parse().unwrap_or(f64::NAN);
    if rounded.abs() < 1e-4 || rounded.abs() >= 1e6 { format!("{rounded:e} %") } else { format!("{rounded} %") }
}

/// `a, b and c`.
pub(super) fn listed(parts: &[String]) -> String {
    match parts {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// `1 parameter`, `3 parameters`.
pub(super) fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        assert_eq!([0.015_006, 4.0, 1234.5, 3.2e-7].map(coefficient), ["0.0150", "4.00", "1230", "3.20e-7"]);
        assert_eq!([0.0312, 1.0, 1e-9].map(percent), ["3.1 %", "100 %", "1e-7 %"]);
        assert_eq!(listed(&["a".into(), "b".into(), "c".into()]), "a, b and c");
    }
}
