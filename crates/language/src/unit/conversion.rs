//! Units from their symbols, and conversions between them.

use std::f64::consts::PI;
use std::fmt;

use mops_math as math;

use super::dimension::Dimension;
use super::symbols::{SYMBOLS, Turning};
use crate::nearest;

/// Unit of measure: a product of powers of SI units, with optional prefixes (`kg m2`, `N.m.s/rad`, `mm/s^2`,
/// `V^0.5/s`).
///
/// Factors are separated by a blank, `*` or a dot. `/` divides by the one factor, or the parenthesis, after it. An
/// exponent follows its unit, with or without `^`, and may be a fraction (`m^0.5`, `m^(1/2)`).
///
/// The radian equals 1, as in the SI; a revolution is 2 pi rad, so that rev/s and rpm are angular speeds. Hz counts
/// cycles: 1 Hz is 1 1/s, and 2 pi rad/s where a frequency in rad/s is expected.
///
/// degC and degF alone are temperature scales with their own zero. In a product (`W/degC`) they are differences.
#[derive(Debug, Clone)]
pub struct Unit {
    text: String,
    dimension: Dimension,
    /// Value of this unit in the coherent SI unit.
    factor: f64,
    /// Zero of a temperature scale, in K.
    zero: f64,
    /// Whether quantities in the unit are differences.
    kind: Kind,
    /// Exponents of units that count angles, and of those that count cycles.
    turning: [f64; 2],
    /// Value of the angle units in the coherent unit: 180/pi for V/deg, 1 for rad.
    angles: f64,
    /// Exponents of the unit in which a quantity is declared, as in `turning`, if this unit is another one for its
    /// values.
    declared: Option<[f64; 2]>,
}

/// Meaning of quantities in a unit, which matters for temperatures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Values of a quantity: 20 degC are 293.15 K.
    Value,
    /// Differences, which ignore the zeros of scales: 20 degC are 20 K.
    Difference,
    /// Either, which cannot be known: degC is refused.
    Unknown,
}

impl Unit {
    /// Returns the unit of a pure number.
    pub fn one() -> Self {
        Self {
            text: "1".to_owned(),
            dimension: Dimension::NONE,
            factor: 1.0,
            zero: 0.0,
            kind: Kind::Value,
            turning: [0.0; 2],
            angles: 1.0,
            declared: None,
        }
    }

    /// Parses a unit; an empty text is the unit of a pure number.
    ///
    /// # Errors
    /// If a symbol is unknown, or if the text is not a product of powers; the message is one sentence that names the
    /// part.
    pub fn parse(text: &str) -> Result<Self, String> {
        if text.len() > LONGEST {
            return Err(format!("the unit has {} characters; the limit is {LONGEST}", text.chars().count()));
        }
        let mut rest = text.trim();
        let mut unit = Self { text: if rest.is_empty() { "1".into() } else { rest.into() }, ..Self::one() };
        let mut divide = false;
        let mut first = true;
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
                // Typing errors seldom affect the first letter, and a single letter is similar to any other.
                let first = |text: &str| text.chars().next().map(|c| c.to_lowercase().to_string());
                let alike = |symbol: &&str| symbol.len() > 1 && first(symbol) == first(rest);
                let near = nearest(&rest[..end], SYMBOLS.iter().map(|known| known.symbol).filter(alike));
                let meant = near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
                if rest.starts_with(|c: char| c.is_ascii_digit()) {
                    return format!("expected a unit, found the number `{rest}`{place}");
                }
                format!("`{rest}` is not a known unit{place}{meant}")
            })?;
            let sign = if divide { -1.0 } else { 1.0 };
            unit.zero = if first && !divide { factor.zero } else { 0.0 };
            unit.dimension = unit.dimension.times(&factor.dimension, sign);
            unit.factor *= raised(factor.factor, sign);
            unit.angles *= raised(factor.angles, sign);
            for (sum, power) in unit.turning.iter_mut().zip(factor.turning) {
                *sum += sign * power;
            }
            (divide, first) = (false, false);
            rest = after.trim_start();
        }
        if divide { Err(format!("expected a unit after the `/` in `{text}`")) } else { Ok(unit) }
    }

    /// Parses a unit written in the program, not by a user.
    ///
    /// # Panics
    /// If `text` is not a unit.
    pub fn known(text: &str) -> Self {
        Self::parse(text).expect("units in the program are valid")
    }

    /// Returns the coherent SI unit of a dimension.
    pub fn coherent(dimension: &Dimension) -> Self {
        Self { text: dimension.coherent(), dimension: *dimension, ..Self::one() }
    }

    /// Returns the dimension of the unit.
    pub fn dimension(&self) -> &Dimension {
        &self.dimension
    }

    /// Returns the value of the unit in the coherent SI unit: 0.01 for cm.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Returns the zero of the scale in K: 273.15 for degC; 0 unless a temperature scale.
    pub fn zero(&self) -> f64 {
        self.zero
    }

    /// Returns the absolute temperature at the zero of the scale, in the unit itself: 459.67 for degF; `None` unless a
    /// temperature scale with a zero of its own.
    pub fn absolute_zero_offset(&self) -> Option<f64> {
        (self.zero != 0.0).then(|| self.zero / self.factor)
    }

    /// Returns true if the unit counts angles: rad, deg, rev, and derived units.
    pub fn is_angle(&self) -> bool {
        self.turning[0] != 0.0
    }

    /// Returns true if the unit is that of a speed: m/s, rad/s and derived units.
    pub fn is_speed(&self) -> bool {
        let [metre, radian] = ["m/s", "rad/s"].map(Self::known);
        self.dimension == metre.dimension || self.is_angle() && self.dimension == radian.dimension
    }

    /// Returns true if the unit is of a mechanical or thermal quantity: an angle, or a product of powers of m, kg, s
    /// and K other than a pure number.
    pub fn is_mechanical_or_thermal(&self) -> bool {
        self.is_angle() || self.dimension.is_mechanical_or_thermal()
    }

    /// Returns why a number in this unit has no certain value in `other`, and in which unit it has; `None` if it has
    /// one.
    ///
    /// V is ambiguous for V/deg, and 1/s for rpm. V is not ambiguous for V/rad, because the radian is 1. Of a quantity
    /// in 1/s, Hz and rad/s are ambiguous beside each other; and of one of unknown kind, such as the value of a
    /// formula, degC, Hz and rpm.
    pub fn ambiguity_in(&self, other: &Self) -> Option<String> {
        if !self.is_compatible(other) {
            return None;
        }
        let [plain, of_other] = [self, other].map(|unit| unit.turning == [0.0; 2]);
        let is_unknown = other.kind == Kind::Unknown;
        let counts = if self.counts_cycles() { ["cycles", "angles"] } else { ["angles", "cycles"] };
        if is_unknown && self.zero != other.zero {
            let difference = self.difference();
            return Some(format!(
                "`{self}` has a zero of its own, but the value may be a difference; write it in `{difference}`"
            ));
        }
        if is_unknown && of_other && !self.dimension.is_none() && (self.counts_cycles() || self.angles != 1.0) {
            let [own, others] = counts;
            return Some(format!("`{self}` counts {own}, but the value may count {others}; write it in `{other}`"));
        }
        if plain && other.is_angle() && other.angles != 1.0 {
            return Some(format!(
                "expected a quantity in `{other}`, found `{self}` without an angle unit; write it in `{other}`"
            ));
        }
        if other.declared == Some([0.0; 2]) && self.turns_to(other) != 1.0 {
            let [own, others] = counts;
            return Some(format!(
                "`{self}` counts {own} and `{other}` {others}, but the quantity counts neither; write it in `{other}`"
            ));
        }
        None
    }

    /// Returns true if the unit counts cycles, as Hz does; conversion to an angle unit multiplies by 2 pi.
    pub fn counts_cycles(&self) -> bool {
        self.turning[1] != 0.0
    }

    /// Returns true if numbers in the unit equal numbers in the coherent SI unit.
    pub fn is_coherent(&self) -> bool {
        self.factor == 1.0 && self.zero == 0.0
    }

    /// Returns the unit of differences, rates and errors of quantities in this unit: K for degC, degR for degF,
    /// otherwise the unit itself.
    ///
    /// A temperature converted to it is a difference: 5 degC are 5 K.
    #[must_use]
    pub fn difference(&self) -> Self {
        let unit = match (self.zero == 0.0, self.factor == 1.0) {
            (true, _) => self.clone(),
            (_, true) => Self::known("K"),
            _ => Self::known("degR"),
        };
        Self { kind: Kind::Difference, ..unit }
    }

    /// Returns the unit for values of which it is unknown whether they are differences, such as those of a formula:
    /// quantities on a temperature scale are refused.
    #[must_use]
    pub fn of_unknown_kind(self) -> Self {
        Self { kind: Kind::Unknown, ..self }
    }

    /// Returns the unit as one for values of a quantity that is declared in `own`. Units that count neither angles nor
    /// cycles then count what `own` counts: of a quantity in rad/s, 1 1/s is 1 rad/s, and 2 pi 1/s are 1 Hz.
    #[must_use]
    pub fn of_quantity_in(self, own: &Self) -> Self {
        Self { kind: own.kind, declared: own.declared.or(Some(own.turning)), ..self }
    }

    /// Formats a number with this unit for a sentence: `3 rad`; a pure number without unit.
    pub fn amount(&self, number: f64) -> String {
        // Written out, very small and very large numbers have hundreds of digits.
        let is_readable = number == 0.0 || (1e-5..1e15).contains(&number.abs());
        let number = if is_readable { number.to_string() } else { format!("{number:e}") };
        if self.text == "1" { number } else { format!("{number} {self}") }
    }

    /// Returns true if quantities in the two units are comparable.
    pub fn is_compatible(&self, other: &Self) -> bool {
        self.dimension == other.dimension
    }

    /// Returns the factor that converts a difference in this unit to `other`; `None` for different dimensions.
    ///
    /// Zeros of temperature scales are ignored; see [`Unit::convert`] for them. A frequency in cycles is multiplied by
    /// 2 pi for rad.
    pub fn factor_to(&self, other: &Self) -> Option<f64> {
        if !self.is_compatible(other) {
            return None;
        }
        let turns = self.turns_to(other);
        // Equal units must convert without rounding, so that no bit of a study's numbers changes.
        Some(if self.factor == other.factor { turns } else { self.factor / other.factor * turns })
    }

    /// Returns the factor from cycles to angles that converts this unit to `other`.
    fn turns_to(&self, other: &Self) -> f64 {
        let declared = self.declared.or(other.declared).unwrap_or_default();
        let [[angles, cycles], [others, of_other]] =
            [self, other].map(|unit| if unit.turning == [0.0; 2] { declared } else { unit.turning });
        let counted = cycles - of_other;
        if counted != 0.0 && counted == others - angles { raised(2.0 * PI, counted) } else { 1.0 }
    }

    /// Converts a number from this unit to `other`, including the zeros of temperature scales: 20 degC is 293.15 K.
    /// Returns `None` for different dimensions.
    pub fn convert(&self, number: f64, other: &Self) -> Option<f64> {
        let factor = self.factor_to(other)?;
        if self.zero == other.zero || self.kind == Kind::Difference || other.kind == Kind::Difference {
            return Some(number * factor);
        }
        Some((number * self.factor + self.zero - other.zero) / other.factor)
    }

    /// Returns the unit of a product of powers of units; temperatures count as differences.
    #[must_use]
    pub fn product(factors: &[(&Self, i32)]) -> Self {
        let factors: Vec<(Self, i32)> = factors.iter().map(|(unit, power)| (unit.difference(), *power)).collect();
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
        Self::known(&text).difference()
    }

    /// Returns the unit of a product of powers of this unit and seconds, as `unit^power s^seconds`; temperatures count
    /// as differences.
    #[must_use]
    pub fn power(&self, power: i32, seconds: i32) -> Self {
        let own = match (self.difference().text.as_str(), power) {
            ("1", _) | (_, 0) => String::new(),
            (text, 1) => text.to_owned(),
            (text, _) if text.contains(|c: char| !c.is_alphabetic()) => format!("({text})^{power}"),
            (text, _) => format!("{text}^{power}"),
        };
        let time = match seconds {
            0 => "",
            1 => "s",
            -1 => "/s",
            _ => return Self::known(&format!("{own} s^{seconds}")).difference(),
        };
        let text = match (own.is_empty(), time.starts_with('/')) {
            (true, true) => "1/s".to_owned(),
            (_, true) => format!("{own}{time}"),
            _ => format!("{own} {time}").trim().to_owned(),
        };
        Self::known(&text).difference()
    }
}

/// Largest number of characters of a unit, which limits the nesting of parentheses.
const LONGEST: usize = 200;

/// Parses one factor: a symbol or a parenthesis, with its exponent. Returns the factor and the rest of the text.
fn factor(text: &str) -> Option<(Unit, &str)> {
    let (mut unit, rest) = if let Some((inner, rest)) = parenthesis(text) {
        (Unit::parse(inner).ok()?, rest)
    } else {
        let end = text.find(|c: char| !(c.is_alphabetic() || "%\u{b0}".contains(c))).unwrap_or(text.len());
        let is_one = text.strip_prefix('1').is_some_and(|rest| rest.is_empty() || rest.trim_start().starts_with('/'));
        let end = if end == 0 && is_one { 1 } else { end };
        (symbol(&text[..end])?, &text[end..])
    };
    let (exponent, rest) = exponent(rest)?;
    if exponent != 1.0 {
        unit.dimension = Dimension::NONE.times(&unit.dimension, exponent);
        unit.factor = raised(unit.factor, exponent);
        unit.angles = raised(unit.angles, exponent);
        unit.zero = 0.0;
        unit.turning = unit.turning.map(|power| power * exponent);
    }
    Some((unit, rest))
}

/// Returns the content of the parenthesis at the start of a text, and the rest.
fn parenthesis(text: &str) -> Option<(&str, &str)> {
    let inner = text.strip_prefix('(')?;
    let mut depth = 1;
    let closes = |c: char| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        depth == 0
    };
    let end = inner.find(closes)?;
    Some((&inner[..end], &inner[end + 1..]))
}

/// Returns the exponent at the start of a text, or 1, and the rest: `2`, `^-1`, `^0.5`, `^(1/2)`, superscripts.
fn exponent(text: &str) -> Option<(f64, &str)> {
    const SUPERSCRIPTS: &str = "\u{207b}\u{2070}\u{b9}\u{b2}\u{b3}\u{2074}\u{2075}\u{2076}\u{2077}\u{2078}\u{2079}";
    let end = text.find(|c: char| !SUPERSCRIPTS.contains(c)).unwrap_or(text.len());
    if end > 0 {
        let plain = |c: char| SUPERSCRIPTS.chars().zip("-0123456789".chars()).find(|(raised, _)| *raised == c);
        let digits: String = text[..end].chars().filter_map(plain).map(|(_, digit)| digit).collect();
        return Some((limited(digits.parse().ok()?)?, &text[end..]));
    }
    let (text, raised) = text.strip_prefix('^').map_or((text, false), |text| (text, true));
    if raised && let Some((inner, rest)) = parenthesis(text) {
        let (above, below) = inner.split_once('/').unwrap_or((inner, "1"));
        let number = |text: &str| text.trim().parse::<f64>().ok();
        return Some((limited(number(above)? / number(below)?)?, rest));
    }
    let digits = |text: &str| text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let sign = usize::from(text.starts_with('-'));
    let mut end = sign + digits(&text[sign..]);
    // A dot without a digit after it multiplies.
    if end > sign && text[end..].starts_with('.') {
        let fraction = digits(&text[end + 1..]);
        end += if fraction > 0 { 1 + fraction } else { 0 };
    }
    match end {
        0 if !raised => Some((1.0, text)),
        _ => Some((limited(text[..end].parse().ok()?)?, &text[end..])),
    }
}

/// Returns the exponent, or `None` beyond 100, which is a typing error.
fn limited(exponent: f64) -> Option<f64> {
    (exponent.abs() < 100.0).then_some(exponent)
}

/// Returns a power of a factor: integer exponents by products, which keeps 10 and its powers exact.
fn raised(factor: f64, exponent: f64) -> f64 {
    if factor == 1.0 {
        return 1.0;
    }
    #[allow(clippy::cast_possible_truncation)]
    if exponent.fract() == 0.0 { math::powi(factor, exponent as i32) } else { math::powf(factor, exponent) }
}

fn symbol(text: &str) -> Option<Unit> {
    let (found, prefix) = super::symbols::find(text)?;
    let turning = match found.turning {
        Turning::No => [0.0, 0.0],
        Turning::Angle => [1.0, 0.0],
        Turning::Cycle => [0.0, 1.0],
    };
    let factor = prefix * found.factor;
    Some(Unit {
        text: text.to_owned(),
        dimension: found.dimension,
        factor,
        zero: found.zero,
        kind: Kind::Value,
        turning,
        angles: if turning[0] == 0.0 { 1.0 } else { factor },
        declared: None,
    })
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl PartialEq for Unit {
    fn eq(&self, other: &Self) -> bool {
        let alike = self.factor == other.factor && self.zero == other.zero && self.turning[1] == other.turning[1];
        alike && self.dimension == other.dimension
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::Quantity;

    #[test]
    fn a_unit_is_a_product_of_powers_however_it_is_spelled() {
        for text in ["N m s/rad", "N*m*s", "kg m2/s", "kg*m^2*s^-1", "J s", "kg m2 / s", "(kg m2)/s"] {
            assert_eq!(Unit::known(text), Unit::known("N m s"), "{text}");
        }
    }

    #[test]
    fn common_spellings_are_known_and_slips_suggest_the_unit() {
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
    fn hertz_count_cycles_and_become_angles_only_where_angles_are_expected() {
        let factor = |from: &str, to: &str| Unit::known(from).factor_to(&Unit::known(to)).unwrap();
        assert_eq!([factor("Hz", "1/s"), factor("1/s", "Hz"), factor("kHz", "1/ms"), factor("Hz s", "1")], [1.0; 4]);
        assert_eq!(factor("Hz", "rad/s"), 2.0 * PI);
        assert_eq!(factor("Hz", "rpm"), 60.0);
        assert_eq!(factor("rad/s", "Hz"), 1.0 / (2.0 * PI));
        assert_eq!(factor("N m/Hz", "N m s/rad"), 1.0 / (2.0 * PI));
        assert_eq!([factor("1/s", "rad/s"), factor("N m s", "N m s/rad")], [1.0; 2]);
        assert_eq!(factor("rev/s", "rad/s"), 2.0 * PI);
    }

    #[test]
    fn the_unit_in_which_a_quantity_is_declared_decides_what_its_other_units_count() {
        let shown = |unit: &str, own: &str| Unit::known(unit).of_quantity_in(&Unit::known(own));
        let read = |text: &str, unit: &str, own: &str| Quantity::parse(text).unwrap().to(&shown(unit, own));
        for (text, unit, own, value) in [
            ("1 Hz", "1/s", "rad/s", 2.0 * PI),
            ("1 Hz", "1/min", "rad/s", 120.0 * PI),
            ("1 1/s", "Hz", "rad/s", 0.5 / PI),
            ("1 1/s", "Hz", "Hz", 1.0),
            ("1 rad/s", "1/s", "Hz", 0.5 / PI),
            ("60 rpm", "1/s", "Hz", 1.0),
            ("1 Hz", "1/min", "1/s", 60.0),
            ("1 rad/s", "1/s", "1/s", 1.0),
            ("2 N m s", "N m/Hz", "N m s/rad", 4.0 * PI),
        ] {
            let found = read(text, unit, own).unwrap();
            assert!((found - value).abs() <= 1e-12 * value, "{text} in {unit} of {own}: {found}");
            let there = Unit::known(own).factor_to(&shown(unit, own)).unwrap();
            let back = shown(unit, own).factor_to(&Unit::known(own)).unwrap();
            assert!((there * back - 1.0).abs() < 1e-12, "{unit} of {own}");
            let direct = Quantity::parse(text).unwrap().to(&Unit::known(own)).unwrap();
            assert!((found - direct * there).abs() <= 1e-12 * value, "{text} in {unit} of {own}");
        }
        for (text, unit) in [("1 Hz", "rad/s"), ("1 rad/s", "Hz"), ("60 rpm", "kHz"), ("1 Hz", "rpm")] {
            let mistake = read(text, unit, "1/s").unwrap_err();
            assert!(mistake.contains("the quantity counts neither"), "{text} in {unit}: {mistake}");
        }
        let formula = Unit::known("1/s").of_unknown_kind();
        for text in ["1 Hz", "60 rpm", "5 deg/s"] {
            let mistake = Quantity::parse(text).unwrap().to(&formula).unwrap_err();
            assert!(mistake.ends_with("write it in `1/s`"), "{text}: {mistake}");
        }
        assert_eq!(Quantity::parse("1 rad/s").unwrap().to(&formula), Ok(1.0));
    }

    #[test]
    fn scales_of_temperature_have_zeros_and_their_differences_have_none() {
        let [kelvin, celsius, fahrenheit] = ["K", "degC", "degF"].map(Unit::known);
        assert_eq!(celsius.convert(20.0, &kelvin), Some(293.15));
        assert_eq!(kelvin.convert(293.15, &celsius), Some(20.0));
        assert!((fahrenheit.convert(212.0, &celsius).unwrap() - 100.0).abs() < 1e-12);
        assert!((celsius.convert(-40.0, &fahrenheit).unwrap() + 40.0).abs() < 1e-12);
        assert_eq!(celsius.factor_to(&kelvin), Some(1.0));
        assert_eq!(celsius.difference(), kelvin);
        assert_eq!(fahrenheit.difference().factor_to(&kelvin), Some(5.0 / 9.0));
        for text in ["W/degC", "degC/s", "degC^2", "degC m", "1/degC"] {
            assert_eq!(Unit::known(text).zero(), 0.0, "{text}");
        }
        assert_eq!([celsius.power(1, 0), Unit::product(&[(&celsius, 1)])], [kelvin.clone(), kelvin.clone()]);
        assert_eq!(celsius.convert(5.0, &kelvin.difference()), Some(5.0));
        assert!(Unit::parse("mdegC").is_err());
    }

    #[test]
    fn exponents_may_be_fractions_and_dots_multiply() {
        for (text, same) in [
            ("V^0.5/s", "V^(1/2) s^-1"),
            ("N.m.s/rad", "N m s"),
            ("kg.m2.s-2", "J"),
            ("m^1.5", "m m^0.5"),
            ("m2.5", "m^(5/2)"),
            ("m^2.s", "m2 s"),
            ("m^(1/3) m^(1/3) m^(1/3)", "m"),
        ] {
            assert!(Unit::known(text).is_compatible(&Unit::known(same)), "{text}");
        }
        assert_eq!(Unit::known("cm^0.5").factor(), 0.1);
        assert!(["m^", "m^x", "m^(1/0)", "m^200"].iter().all(|text| Unit::parse(text).is_err()));
    }

    #[test]
    fn a_dimension_is_written_with_few_symbols_and_reads_back() {
        for (text, coherent) in [
            ("g cm2/ms^2", "N m"),
            ("kg m2", "kg m2"),
            ("kN/mm", "N/m"),
            ("N m s/rad", "N m s"),
            ("mA", "A"),
            ("V/krpm", "V s"),
            ("pF", "F"),
            ("cm3/s", "m3/s"),
            ("V^0.5/s", "V^0.5/s"),
            ("m^(2/3)/s", "m^(2/3)/s"),
            ("%", "1"),
            ("1/min", "1/s"),
            ("kOhm", "Ohm"),
            ("Hz", "1/s"),
        ] {
            let unit = Unit::known(text);
            let found = unit.dimension().coherent();
            assert!(Unit::known(&found).is_compatible(&unit) && Unit::known(&found).is_coherent(), "{text}: {found}");
            assert_eq!(found, coherent, "{text}");
        }
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
    fn an_angle_is_not_read_into_a_quantity_that_counts_none() {
        let read = |text: &str, unit: &str| Quantity::parse(text).unwrap().to(&Unit::known(unit));
        for (text, unit) in [("0.3 V", "V/deg"), ("10 1/s", "rpm"), ("50 %", "deg"), ("2 N m s", "N m s/deg")] {
            assert!(read(text, unit).unwrap_err().contains("without an angle unit"), "{text} as {unit}");
        }
        for (text, unit, value) in [
            ("0.3 V", "V/rad", 0.3),
            ("300 mV/rad", "V", 0.3),
            ("0.3 V/deg", "V", 0.3 * 180.0 / PI),
            ("0.3 V/deg", "V/deg", 0.3),
            ("2 Hz", "rpm", 120.0),
            ("2 N m s", "mN m s/rad", 2000.0),
        ] {
            let found = read(text, unit).unwrap();
            assert!((found - value).abs() <= 1e-12 * value, "{text} as {unit}: {found}");
        }
    }

    #[test]
    fn powers_of_units_read_back() {
        assert_eq!(Unit::known("rad/s").power(2, 1).to_string(), "(rad/s)^2 s");
        assert_eq!(Unit::one().power(2, 1).to_string(), "s");
        assert_eq!(Unit::known("V").power(1, -1).to_string(), "V/s");
        assert_eq!(Unit::known("(rad/s)^2").power(2, 1), Unit::known("s^-3"));
    }
}
