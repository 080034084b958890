//! Units of measure, and quantities such as `"15 s"`.

use std::f64::consts::PI;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserialize, Deserializer, Visitor};

use crate::diagnostic::nearest;
use crate::math;

/// Exponents of the base units m, kg, s, A, K, mol, and of the decibel (a unit apart, as it is not a ratio).
type Dimension = [i32; 7];

/// A unit of measure: a product of powers of SI units, prefixes allowed (`kg m2`, `N m s/rad`, `mm/s^2`).
///
/// Factors stand side by side or are joined by `*` or a dot; `/` divides by the one factor, or the parenthesis, after it; an
/// exponent follows its unit, with or without `^`. The radian counts as 1, as in the SI; a revolution is 2 pi of it, so that
/// 1 Hz is 6.28 rad/s. `degC` is a difference of temperatures: no offset is applied.
#[derive(Debug, Clone)]
pub struct Unit {
    text: String,
    dimension: Dimension,
    /// Value of this unit in SI base units.
    factor: f64,
}

/// Symbol, dimension, value in SI base units. Source: BIPM, The International System of Units, 9th edition (2019).
#[rustfmt::skip]
const UNITS: &[(&str, Dimension, f64)] = &[
    ("1",    [0, 0, 0, 0, 0, 0, 0],   1.0),
    ("rad",  [0, 0, 0, 0, 0, 0, 0],   1.0),
    ("deg",  [0, 0, 0, 0, 0, 0, 0],   PI / 180.0),
    ("rev",  [0, 0, 0, 0, 0, 0, 0],   2.0 * PI),
    ("%",    [0, 0, 0, 0, 0, 0, 0],   0.01),
    ("dB",   [0, 0, 0, 0, 0, 0, 1],   1.0),
    ("m",    [1, 0, 0, 0, 0, 0, 0],   1.0),
    ("g",    [0, 1, 0, 0, 0, 0, 0],   1e-3),
    ("s",    [0, 0, 1, 0, 0, 0, 0],   1.0),
    ("min",  [0, 0, 1, 0, 0, 0, 0],   60.0),
    ("h",    [0, 0, 1, 0, 0, 0, 0],   3600.0),
    ("A",    [0, 0, 0, 1, 0, 0, 0],   1.0),
    ("K",    [0, 0, 0, 0, 1, 0, 0],   1.0),
    ("degC", [0, 0, 0, 0, 1, 0, 0],   1.0),
    ("mol",  [0, 0, 0, 0, 0, 1, 0],   1.0),
    ("Hz",   [0, 0, -1, 0, 0, 0, 0],  2.0 * PI),
    ("rpm",  [0, 0, -1, 0, 0, 0, 0],  2.0 * PI / 60.0),
    ("N",    [1, 1, -2, 0, 0, 0, 0],  1.0),
    ("Pa",   [-1, 1, -2, 0, 0, 0, 0], 1.0),
    ("bar",  [-1, 1, -2, 0, 0, 0, 0], 1e5),
    ("J",    [2, 1, -2, 0, 0, 0, 0],  1.0),
    ("W",    [2, 1, -3, 0, 0, 0, 0],  1.0),
    ("C",    [0, 0, 1, 1, 0, 0, 0],   1.0),
    ("V",    [2, 1, -3, -1, 0, 0, 0], 1.0),
    ("Ohm",  [2, 1, -3, -2, 0, 0, 0], 1.0),
    ("S",    [-2, -1, 3, 2, 0, 0, 0], 1.0),
    ("F",    [-2, -1, 4, 2, 0, 0, 0], 1.0),
    ("H",    [2, 1, -2, -2, 0, 0, 0], 1.0),
    ("Wb",   [2, 1, -2, -1, 0, 0, 0], 1.0),
    ("T",    [0, 1, -2, -1, 0, 0, 0], 1.0),
    ("L",    [3, 0, 0, 0, 0, 0, 0],   1e-3),
    ("l",    [3, 0, 0, 0, 0, 0, 0],   1e-3),
    ("day",  [0, 0, 1, 0, 0, 0, 0],   86400.0),
    ("ohm",  [2, 1, -3, -2, 0, 0, 0], 1.0),
    ("\u{3a9}", [2, 1, -3, -2, 0, 0, 0], 1.0),
    ("\u{2126}", [2, 1, -3, -2, 0, 0, 0], 1.0),
    ("Nm",   [2, 1, -2, 0, 0, 0, 0],  1.0),
];

const PREFIXES: &[(&str, f64)] = &[
    ("n", 1e-9),
    ("u", 1e-6),
    ("\u{b5}", 1e-6),
    ("m", 1e-3),
    ("c", 1e-2),
    ("d", 1e-1),
    ("h", 1e2),
    ("k", 1e3),
    ("M", 1e6),
    ("G", 1e9),
];

impl Unit {
    /// The unit of a pure number.
    pub fn one() -> Self {
        Self { text: "1".to_owned(), dimension: [0; 7], factor: 1.0 }
    }

    /// Reads a unit; an empty text is the unit of a pure number.
    ///
    /// # Errors
    /// An unknown symbol, or a text that is not a product of powers: one sentence that says which.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut rest = text.trim();
        let mut unit = Self { text: if rest.is_empty() { "1".into() } else { rest.into() }, ..Self::one() };
        let mut divide = false;
        while !rest.is_empty() {
            if let Some(after) = rest.strip_prefix('/') {
                divide = true;
                rest = after.trim_start();
            } else if let Some(after) = rest.strip_prefix(['*', '.', '\u{b7}']) {
                rest = after.trim_start();
            }
            let (factor, after) = factor(rest).ok_or_else(|| {
                let place = if rest == text.trim() { String::new() } else { format!(" in `{text}`") };
                let end = rest.find(|c: char| !c.is_alphabetic()).unwrap_or(rest.len());
                // A slip seldom hits the first letter, and one letter alone is near to everything.
                let first = |text: &str| text.chars().next().map(|c| c.to_lowercase().to_string());
                let alike = |symbol: &&str| symbol.len() > 1 && first(symbol) == first(rest);
                let near = nearest(&rest[..end], UNITS.iter().map(|(symbol, ..)| *symbol).filter(alike));
                let meant = near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
                format!("`{rest}` is not a known unit{place}{meant}")
            })?;
            let sign = if divide { -1 } else { 1 };
            for (sum, exponent) in unit.dimension.iter_mut().zip(factor.dimension) {
                *sum += sign * exponent;
            }
            unit.factor *= math::powi(factor.factor, sign);
            divide = false;
            rest = after.trim_start();
        }
        if divide { Err(format!("nothing follows the `/` in `{text}`")) } else { Ok(unit) }
    }

    /// A unit that is written in the program, not by a user.
    ///
    /// # Panics
    /// If `text` is not a unit.
    pub fn known(text: &str) -> Self {
        Self::parse(text).expect("units in the program are spelled right")
    }

    /// A number with this unit, as it stands in a sentence: `3 rad`; a pure number alone.
    pub fn amount(&self, number: f64) -> String {
        if self.text == "1" { number.to_string() } else { format!("{number} {self}") }
    }

    /// Whether quantities in the two units can be compared.
    pub fn is_compatible(&self, other: &Self) -> bool {
        self.dimension == other.dimension
    }

    /// Factor that turns a number in this unit into one in `other`; `None` where they measure different things.
    pub fn factor_to(&self, other: &Self) -> Option<f64> {
        // Equal units must convert without a rounding, so that no bit of a study's numbers changes.
        if self.factor == other.factor {
            return self.is_compatible(other).then_some(1.0);
        }
        self.is_compatible(other).then_some(self.factor / other.factor)
    }

    /// The unit of a product of powers of units.
    #[must_use]
    pub fn product(factors: &[(&Self, i32)]) -> Self {
        let mut text = String::new();
        for (unit, power) in factors.iter().filter(|(unit, power)| *power > 0 && unit.text != "1") {
            text.push_str(if text.is_empty() { "" } else { " " });
            text.push_str(&unit.power(*power, 0).text);
        }
        if text.is_empty() {
            text.push('1');
        }
        for (unit, power) in factors.iter().filter(|(unit, power)| *power < 0 && unit.text != "1") {
            let own = if unit.text.contains(|c: char| !c.is_alphabetic()) {
                format!("({})", unit.text)
            } else {
                unit.text.clone()
            };
            text.push_str(&format!("/{own}"));
            if *power < -1 {
                text.push_str(&format!("^{}", -power));
            }
        }
        Self::known(&text)
    }

    /// The unit of a product of powers of this unit and seconds, as `unit^power s^seconds`.
    #[must_use]
    pub fn power(&self, power: i32, seconds: i32) -> Self {
        let own = match (self.text.as_str(), power) {
            ("1", _) | (_, 0) => String::new(),
            (text, 1) => text.to_owned(),
            (text, _) if text.contains(|c: char| !c.is_alphabetic()) => format!("({text})^{power}"),
            (text, _) => format!("{text}^{power}"),
        };
        let time = match seconds {
            0 => "",
            1 => "s",
            -1 => "/s",
            _ => return Self::known(&format!("{own} s^{seconds}")),
        };
        Self::known(
            match (own.is_empty(), time.starts_with('/')) {
                (true, true) => "1/s".to_owned(),
                (_, true) => format!("{own}{time}"),
                _ => format!("{own} {time}").trim().to_owned(),
            }
            .as_str(),
        )
    }
}

/// Reads one factor: a symbol or a parenthesis, with its exponent. Returns it and the rest of the text.
fn factor(text: &str) -> Option<(Unit, &str)> {
    let (mut unit, rest) = if let Some(inner) = text.strip_prefix('(') {
        let mut depth = 1;
        let closes = |c: char| {
            depth += i32::from(c == '(') - i32::from(c == ')');
            depth == 0
        };
        let end = inner.find(closes)?;
        (Unit::parse(&inner[..end]).ok()?, &inner[end + 1..])
    } else {
        let end = text.find(|c: char| !(c.is_alphabetic() || c == '%')).unwrap_or(text.len());
        let end = if end == 0 && text.starts_with('1') { 1 } else { end };
        (symbol(&text[..end])?, &text[end..])
    };
    let rest = rest.strip_prefix('^').unwrap_or(rest);
    let end = rest.find(|c: char| !(c.is_ascii_digit() || c == '-')).unwrap_or(rest.len());
    let exponent = if end == 0 { 1 } else { rest[..end].parse::<i32>().ok().filter(|e| e.abs() < 100)? };
    unit.dimension = unit.dimension.map(|e| e * exponent);
    unit.factor = math::powi(unit.factor, exponent);
    Some((unit, &rest[end..]))
}

fn symbol(text: &str) -> Option<Unit> {
    let find = |name: &str| UNITS.iter().find(|(symbol, ..)| *symbol == name);
    let (dimension, factor) = match find(text) {
        Some((_, dimension, factor)) => (dimension, *factor),
        None => PREFIXES.iter().find_map(|(prefix, scale)| {
            let (_, dimension, factor) = find(text.strip_prefix(prefix)?)?;
            Some((dimension, scale * factor))
        })?,
    };
    Some(Unit { text: text.to_owned(), dimension: *dimension, factor })
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl PartialEq for Unit {
    fn eq(&self, other: &Self) -> bool {
        self.dimension == other.dimension && self.factor == other.factor
    }
}

/// A number, with its unit where one was given: `15`, `"15 s"`, `"30 deg"`.
///
/// Without a unit the number is in the unit that the place expects.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// The number as written.
    pub number: f64,
    /// The unit as written.
    pub unit: Option<Unit>,
}

impl Quantity {
    /// Reads a number with or without a unit after it.
    ///
    /// # Errors
    /// A text that does not begin with a number, or whose unit is unknown.
    pub fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        // The longest prefix that reads as a number: `1e3 s` and `5 eV` both come out right.
        let end = (1..=text.len())
            .rev()
            .filter(|&end| text.is_char_boundary(end))
            .find(|&end| text[..end].trim_end().parse::<f64>().is_ok())
            .ok_or_else(|| format!("`{text}` does not begin with a number, as in \"15 s\""))?;
        let number: f64 = text[..end].trim_end().parse().expect("checked in the search");
        let unit = text[end..].trim();
        Ok(Self { number, unit: if unit.is_empty() { None } else { Some(Unit::parse(unit)?) } })
    }

    /// The number in `unit`.
    ///
    /// # Errors
    /// A unit that measures something else.
    pub fn to(&self, unit: &Unit) -> Result<f64, String> {
        match &self.unit {
            None => Ok(self.number),
            Some(given) => match given.factor_to(unit) {
                Some(factor) => Ok(self.number * factor),
                None if unit.text == "1" => {
                    Err(format!("a quantity in `{given}` stands where a pure number is expected"))
                }
                None => Err(format!("a quantity in `{given}` stands where one in `{unit}` is expected")),
            },
        }
    }
}

impl From<f64> for Quantity {
    fn from(number: f64) -> Self {
        Self { number, unit: None }
    }
}

impl<'de> Deserialize<'de> for Quantity {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrText;
        impl Visitor<'_> for NumberOrText {
            type Value = Quantity;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number, or a text with a unit such as \"15 s\"")
            }
            fn visit_f64<E: de::Error>(self, number: f64) -> Result<Quantity, E> {
                Ok(number.into())
            }
            #[allow(clippy::cast_precision_loss)]
            fn visit_i64<E: de::Error>(self, number: i64) -> Result<Quantity, E> {
                Ok((number as f64).into())
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<Quantity, E> {
                Quantity::parse(text).map_err(E::custom)
            }
        }
        deserializer.deserialize_any(NumberOrText)
    }
}

impl JsonSchema for Quantity {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Quantity".into()
    }
    fn inline_schema() -> bool {
        true
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["number", "string"] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_a_product_of_powers_however_it_is_spelled() {
        for text in ["N m s/rad", "N*m*s", "kg m2/s", "kg*m^2*s^-1", "J s", "kg m2 / s", "(kg m2)/s"] {
            assert_eq!(Unit::known(text), Unit::known("N m s"), "{text}");
        }
    }

    #[test]
    fn common_spellings_are_known_and_slips_lead_to_the_unit() {
        for (text, known) in
            [("ohm", "Ohm"), ("k\u{3a9}", "kOhm"), ("Nm/rad", "N m"), ("N.m", "N m"), ("ml", "cm3"), ("day", "h")]
        {
            assert!(Unit::known(text).is_compatible(&Unit::known(known)), "{text}");
        }
        assert_eq!(Unit::known("day").factor_to(&Unit::known("h")), Some(24.0));
        assert_eq!(Unit::known("mNm"), Unit::known("N mm"));
        assert_eq!(Unit::parse("Ohms").unwrap_err(), "`Ohms` is not a known unit; did you mean `Ohm`?");
    }

    #[test]
    fn prefixes_and_other_units_convert() {
        assert_eq!(Unit::known("mm/ms").factor_to(&Unit::known("m/s")), Some(1.0));
        assert_eq!(Unit::known("Hz").factor_to(&Unit::known("rad/s")), Some(2.0 * PI));
        assert_eq!(Unit::known("min").factor_to(&Unit::known("s")), Some(60.0));
        assert_eq!(Unit::known("m").factor_to(&Unit::known("s")), None);
    }

    #[test]
    fn a_quantity_converts_to_the_unit_of_its_place() {
        assert_eq!(Quantity::parse("1.5 min").unwrap().to(&Unit::known("s")), Ok(90.0));
        assert_eq!(Quantity::parse("180 deg").unwrap().to(&Unit::known("rad")), Ok(PI));
        assert_eq!(Quantity::parse("1e-3").unwrap().to(&Unit::known("V")), Ok(1e-3));
        assert!(Quantity::parse("15 s").unwrap().to(&Unit::known("m")).is_err());
        assert!(Quantity::parse("fast").is_err());
        assert!(Quantity::parse("3 parsecs").is_err());
    }

    #[test]
    fn powers_of_units_read_back() {
        assert_eq!(Unit::known("rad/s").power(2, 1).to_string(), "(rad/s)^2 s");
        assert_eq!(Unit::one().power(2, 1).to_string(), "s");
        assert_eq!(Unit::known("V").power(1, -1).to_string(), "V/s");
        assert_eq!(Unit::known("(rad/s)^2").power(2, 1), Unit::known("s^-3"));
    }
}
