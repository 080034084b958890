//! Values of a study file, read with their schema; units, times and kinds.

use std::ops::Range;

use mops_core::catalogue::{schema_of, schema_once};
use mops_language::{Diagnostic, Quantity, Unit, suggestion};
use schemars::{JsonSchema, Schema};
use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeValue, ValueDeserializer};

use super::keys::documentation;
use super::shape;
use super::tree::Node;

/// Help on units.
pub(super) const UNIT_HELP: &str =
    "units are s, ms, min, Hz, m, kg, rad, deg, N, V, A and the like, and products such as \"kg m2\" or \"N m s/rad\"";

/// Returns the only key of a table that is not a common one, as a kind of the catalogue.
pub(super) fn kind<'t, 'k, K>(
    node: &Node<'t>,
    common: &[&'static str],
    known: &'k [K],
    name_of: impl Fn(&K) -> &'static str,
    what: &str,
) -> Result<(&'k K, Node<'t>), Diagnostic> {
    let mut found = None;
    for (key, value) in node.entries()? {
        if common.contains(&key.as_str()) {
            continue;
        }
        let Some(kind) = known.iter().find(|k| name_of(k) == key) else {
            let names: Vec<&str> = known.iter().map(&name_of).chain(common.iter().copied()).collect();
            let help = suggestion(&key, names.iter().copied());
            return Err(value
                .key_diagnostic(format!("`{key}` is neither a kind of {what} nor an option"))
                .with_help(help));
        };
        if found.is_some() {
            let article = if what.starts_with('e') { "an" } else { "a" };
            return Err(value
                .key_diagnostic(format!("{article} {what} has one kind, but two are given"))
                .with_help("remove one of them"));
        }
        found = Some((kind, value));
    }
    found.ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(name_of).collect();
        // Long lists have their own page.
        let help = if names.len() > 40 {
            "`mops list` shows the kinds".to_owned()
        } else {
            format!("use one of: {}", names.join(", "))
        };
        node.key_diagnostic(format!("the {what} has no kind")).with_help(help)
    })
}

pub(super) fn read_unit(node: &Node<'_>, key: &str, text: &str) -> Result<Unit, Diagnostic> {
    Unit::parse(text).map_err(|why| at_key(node, key, why).with_help(UNIT_HELP))
}

/// Returns an error in the value under a key, or in the value itself if there is no such key.
pub(super) fn at_key(node: &Node<'_>, key: &str, why: String) -> Diagnostic {
    node.child(key).as_ref().unwrap_or(node).diagnostic(why)
}

pub(super) fn read_seconds(node: &Node<'_>, key: &str, quantity: Option<&Quantity>) -> Result<Option<f64>, Diagnostic> {
    let second = Unit::known("s");
    let Some(quantity) = quantity else { return Ok(None) };
    let seconds =
        quantity.to(&second).map_err(|why| at_key(node, key, why).with_help("a number without a unit is in s"))?;
    if seconds.is_nan() {
        return Err(at_key(node, key, format!("`{key}` is not a number")).with_help("give a time"));
    }
    Ok(Some(seconds))
}

impl<'t> Node<'t> {
    /// Reads the value as a `T`; unknown keys and wrong types are rejected at their position.
    pub fn read<T: DeserializeOwned + JsonSchema>(&self) -> Result<T, Diagnostic> {
        self.read_with(&schema_once(schema_of::<T>), T::deserialize)
    }

    /// Reads the value with a reader and its schema.
    pub fn read_with<T>(
        &self,
        schema: &Schema,
        reader: impl FnOnce(ValueDeserializer<'t>) -> Result<T, toml::de::Error>,
    ) -> Result<T, Diagnostic> {
        shape::check(self, schema.as_value())?;
        reader(ValueDeserializer::from(self.value.as_ref().clone())).map_err(|error| self.type_error(schema, &error))
    }

    /// Returns the error of a reader for a value of the right shape, such as a quantity with an unknown unit.
    fn type_error(&self, schema: &Schema, error: &toml::de::Error) -> Diagnostic {
        let span = error.span().unwrap_or_else(|| self.value.span());
        let message = error.message().trim_end().replace('\n', "; ");
        let message = match message.split_once(", expected ") {
            Some((_, expected)) => format!("expected {expected}, found {}", &self.source.text[span.clone()]),
            None => message,
        };
        let key = self.key_around(&span).and_then(|key| documentation(schema.as_value(), &key).map(|d| (key, d)));
        let written = self.source.text[span.clone()].trim_matches(['"', '\'']);
        let is_unit = written.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
            && Quantity::parse(written).is_err_and(|why| why == message);
        let help = match key {
            _ if is_unit => UNIT_HELP.to_owned(),
            Some((key, about)) => format!("`{key}`: {about}"),
            None => "`mops describe` explains each key".to_owned(),
        };
        Diagnostic::new(message).with_help(help).at(self.source, span)
    }

    /// Returns the key of this table whose value contains the position.
    fn key_around(&self, place: &Range<usize>) -> Option<String> {
        let table = self.value.get_ref().as_table()?;
        let around = |value: &Spanned<DeValue<'_>>| value.span().start <= place.start && place.end <= value.span().end;
        table.iter().find(|(_, value)| around(value)).map(|(key, _)| key.get_ref().to_string())
    }
}
