//! Numbers with units.

use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserialize, Deserializer, Visitor};

use super::Unit;

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
        if let Some(rest) = unit.strip_prefix(',').filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit())) {
            let whole = text[..end].trim_end();
            return Err(format!("`{text}` has a comma for its decimal point; write \"{whole}.{rest}\""));
        }
        Ok(Self { number, unit: if unit.is_empty() { None } else { Some(Unit::parse(unit)?) } })
    }

    /// The number in `unit`, scales of temperature by their zeros: 20 degC are 293.15 K, or 20 K as [`Unit::difference`].
    ///
    /// # Errors
    /// A unit that measures something else, or that leaves open in which unit its angles are counted.
    pub fn to(&self, unit: &Unit) -> Result<f64, String> {
        match &self.unit {
            None => Ok(self.number),
            Some(given) if given.leaves_angles_open(unit) => {
                Err(format!("a quantity in `{given}` counts no angle, one in `{unit}` does; give it in `{unit}`"))
            }
            Some(given) => given.convert(self.number, unit).ok_or_else(|| misplaced(given, unit)),
        }
    }
}

fn misplaced(given: &Unit, unit: &Unit) -> String {
    if unit.to_string() == "1" {
        return format!("a quantity in `{given}` stands where a pure number is expected");
    }
    format!("a quantity in `{given}` stands where one in `{unit}` is expected")
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
