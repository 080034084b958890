//! Numbers with units.

use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserialize, Deserializer, Visitor};

use super::conversion::Unit;

/// Number with an optional unit: `15`, `"15 s"`, `"30 deg"`.
///
/// A number without a unit has the unit expected at its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Number as written.
    pub number: f64,
    /// Unit as written.
    pub unit: Option<Unit>,
}

impl Quantity {
    /// Parses a number with or without a unit after it.
    ///
    /// # Errors
    /// If the text does not start with a number, or if the unit is unknown.
    pub fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        // The longest prefix that parses as a number: both `1e3 s` and `5 eV` are correct.
        let end = (1..=text.len())
            .rev()
            .filter(|&end| text.is_char_boundary(end))
            .find(|&end| text[..end].trim_end().parse::<f64>().is_ok())
            .ok_or_else(|| format!("expected a number such as \"15 s\", found `{text}`"))?;
        let number: f64 = text[..end].trim_end().parse().expect("checked in the search");
        let unit = text[end..].trim();
        if let Some(rest) = unit.strip_prefix(',').filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit())) {
            let whole = text[..end].trim_end();
            return Err(format!("`{text}` has a decimal comma; write \"{whole}.{rest}\""));
        }
        Ok(Self { number, unit: if unit.is_empty() { None } else { Some(Unit::parse(unit)?) } })
    }

    /// Returns the number in `unit`, including the zeros of temperature scales: 20 degC are 293.15 K, or 20 K for
    /// [`Unit::difference`].
    ///
    /// # Errors
    /// If the unit has another dimension, or if the value is ambiguous there, see [`Unit::ambiguity_in`].
    pub fn to(&self, unit: &Unit) -> Result<f64, String> {
        let Some(given) = &self.unit else { return Ok(self.number) };
        match given.ambiguity_in(unit) {
            Some(why) => Err(why),
            None => given.convert(self.number, unit).ok_or_else(|| misplaced(given, unit)),
        }
    }
}

fn misplaced(given: &Unit, unit: &Unit) -> String {
    if unit.to_string() == "1" {
        return format!("expected a pure number, found `{given}`");
    }
    format!("expected a quantity in `{unit}`, found `{given}`")
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
