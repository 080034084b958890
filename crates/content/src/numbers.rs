//! Formats of numbers and names for a reader: significant digits, units, percent, and portable file names.

use std::collections::HashMap;

/// Formats a number to five significant digits without trailing zeros: `0.86341`, `12`, `1.2e-7`.
pub fn number(value: f64) -> String {
    significant(value, 5)
}

/// Formats a number to six significant digits, for tables on the terminal.
pub fn precise(value: f64) -> String {
    significant(value, 6)
}

/// Formats a number to `digits` significant digits, or to as many more as distinguish it from the limit that it misses.
pub fn apart(value: f64, limit: Option<f64>, digits: usize) -> String {
    /// Number of decimal digits that distinguish all `f64`.
    const ALL: usize = 17;
    let differs = |&digits: &usize| limit.is_none_or(|limit| significant(value, digits) != significant(limit, digits));
    let digits =
        if value.is_nan() || Some(value) == limit { digits } else { (digits..ALL).find(differs).unwrap_or(ALL) };
    significant(value, digits)
}

/// Formats a number to `digits` significant digits, without trailing zeros.
pub fn significant(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "n/a".to_owned();
    }
    if value.is_infinite() {
        return if value > 0.0 { "infinite".to_owned() } else { "-infinite".to_owned() };
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    // The exponent after rounding: 9.9999999 has 1, not 0.
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    let (mantissa, exponent) = scientific.split_once('e').expect("`{:e}` writes an exponent");
    let exponent: i32 = exponent.parse().expect("an exponent is a whole number");
    if !(-4..6).contains(&exponent) {
        return format!("{}e{exponent}", trimmed(mantissa));
    }
    let decimals = usize::try_from(digits as i64 - 1 - i64::from(exponent)).unwrap_or(0);
    trimmed(&format!("{value:.decimals$}")).to_owned()
}

fn trimmed(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

/// Formats a number with its unit; a dimensionless number without one.
pub fn with_unit(value: f64, unit: &str) -> String {
    if unit == "1" || unit.is_empty() { number(value) } else { format!("{} {unit}", number(value)) }
}

/// Formats the label of an axis: name and unit in brackets; the name alone for a dimensionless quantity.
pub fn labelled(name: &str, unit: &str) -> String {
    if unit == "1" || unit.is_empty() { name.to_owned() } else { format!("{name} ({unit})") }
}

/// Formats a fraction in percent, to two significant digits: `3.1 %`.
pub fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share, 2))
}

/// Formats a fraction in percent, to three significant digits; rounding errors as 0, and nothing if it is unknown.
pub fn share(value: f64) -> String {
    if value.abs() < 1e-13 {
        "0 %".to_owned()
    } else if value.is_finite() {
        format!("{} %", significant(100.0 * value, 3))
    } else {
        String::new()
    }
}

/// Formats a number to six significant digits; nothing if it is unknown.
pub fn known(value: f64) -> String {
    if value.is_finite() { precise(value) } else { String::new() }
}

/// Formats a count with its noun: `1 case`, `3 cases`.
pub fn counted(count: usize, noun: &str) -> String {
    match (count, noun) {
        (1, _) => format!("1 {noun}"),
        (_, "criterion") => format!("{count} criteria"),
        _ => format!("{count} {noun}s"),
    }
}

/// Returns a portable file name: letters and digits of all scripts, `_` and `.` stay, each run of other characters
/// becomes one `-`.
pub fn file_name(name: &str) -> String {
    let mut safe = String::new();
    for c in name.chars() {
        if c.is_alphanumeric() || c == '_' || c == '.' {
            safe.push(c);
        } else if !safe.ends_with('-') {
            safe.push('-');
        }
        if safe.len() >= 100 {
            break;
        }
    }
    let safe = safe.trim_matches(['-', '.']);
    if safe.is_empty() { "unnamed".to_owned() } else { safe.to_owned() }
}

/// Generator of unique file names, also for file systems that ignore case.
#[derive(Debug, Default)]
pub struct FileNames {
    /// Names in lower case, each with the number to be tried next.
    taken: HashMap<String, usize>,
}

impl FileNames {
    /// Returns a portable file name for `name` that was not returned before.
    pub fn unique(&mut self, name: &str) -> String {
        let safe = file_name(name);
        let mut number = self.taken.get(&safe.to_lowercase()).copied().unwrap_or(1);
        let mut chosen = if number == 1 { safe.clone() } else { format!("{safe}-{number}") };
        while self.taken.contains_key(&chosen.to_lowercase()) {
            number += 1;
            chosen = format!("{safe}-{number}");
        }
        self.taken.insert(safe.to_lowercase(), number + 1);
        self.taken.entry(chosen.to_lowercase()).or_insert(2);
        chosen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_five_digits_and_no_more() {
        let cases = [
            (0.0, "0"),
            (0.863_412_7, "0.86341"),
            (12.0, "12"),
            (-9.999_999, "-10"),
            (123_456.7, "123457"),
            (1.25e-7, "1.25e-7"),
            (5.4321e9, "5.4321e9"),
            (f64::NAN, "n/a"),
        ];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
        assert_eq!(
            (percent(0.0312), with_unit(15.0, "s"), with_unit(0.1, "1")),
            ("3.1 %".into(), "15 s".into(), "0.1".into())
        );
    }

    #[test]
    fn file_names_are_safe_and_unique() {
        assert_eq!(file_name("../../etc/passwd"), "etc-passwd");
        assert_eq!(file_name("fit-d\u{e9}part:1-\u{3c6}\\x"), "fit-d\u{e9}part-1-\u{3c6}-x");
        assert_eq!(file_name("\u{65e5}\u{672c} 2"), "\u{65e5}\u{672c}-2");
        assert_eq!(file_name("///"), "unnamed");
        let mut names = FileNames::default();
        assert_eq!([names.unique("a/b"), names.unique("A-b"), names.unique("a b")], ["a-b", "A-b-2", "a-b-3"]);
    }
}
