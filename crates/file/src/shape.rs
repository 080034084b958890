//! Check of a value against a schema: keys, types, words and ranges, with messages for users.

use mops_language::{Diagnostic, suggestion};
use serde_json::Value;
use toml::de::{DeInteger, DeValue};

use super::keys::{Keys, keys_of, on_one_line};
use super::tree::Node;

/// A key, and its documentation.
#[derive(Clone, Copy)]
struct Key<'k> {
    name: &'k str,
    about: Option<&'k str>,
}

/// Rejects keys that are unknown or missing and values of the wrong type or out of range, at any depth.
pub(super) fn check(node: &Node<'_>, schema: &Value) -> Result<(), Diagnostic> {
    let name = node.key_text();
    check_value(node, schema, Key { name: &name, about: None })
}

fn check_value(node: &Node<'_>, schema: &Value, key: Key<'_>) -> Result<(), Diagnostic> {
    let alternatives = alternatives(schema);
    let fitting: Vec<&Value> = alternatives.iter().copied().filter(|schema| accepts(schema, node.value())).collect();
    if fitting.is_empty() {
        return Err(wrong_type(node, &alternatives, key));
    }
    match node.value() {
        DeValue::Table(_) => check_table(node, &fitting, key),
        DeValue::Array(_) => check_list(node, fitting[0], key),
        DeValue::String(text) => check_word(node, text, &fitting, key),
        DeValue::Integer(number) => check_whole(node, number, fitting[0], key),
        DeValue::Float(number) => number.as_str().parse().map_or(Ok(()), |v| check_range(node, v, fitting[0], key)),
        _ => Ok(()),
    }
}

/// Returns the alternative schemas of a value.
fn alternatives(schema: &Value) -> Vec<&Value> {
    let choice = ["anyOf", "oneOf"].iter().find_map(|choice| schema.get(choice)?.as_array());
    match choice {
        Some(list) => list.iter().filter(|schema| schema["type"] != "null").flat_map(alternatives).collect(),
        None => vec![schema],
    }
}

/// Returns the names of the types that a schema allows; empty if it allows all.
fn types(schema: &Value) -> Vec<&str> {
    match &schema["type"] {
        Value::String(name) => vec![name],
        Value::Array(names) => names.iter().filter_map(Value::as_str).filter(|name| *name != "null").collect(),
        _ if schema.get("const").is_some() || schema.get("enum").is_some() => vec!["string"],
        _ => Vec::new(),
    }
}

fn accepts(schema: &Value, value: &DeValue<'_>) -> bool {
    let types = types(schema);
    let fits = |name: &str| match name {
        "number" => matches!(value, DeValue::Integer(_) | DeValue::Float(_)),
        "integer" => matches!(value, DeValue::Integer(_)),
        "string" => value.is_str(),
        "boolean" => value.is_bool(),
        "array" => value.is_array(),
        "object" => value.is_table(),
        _ => true,
    };
    types.is_empty() || types.into_iter().any(fits)
}

fn check_whole(node: &Node<'_>, number: &DeInteger<'_>, schema: &Value, key: Key<'_>) -> Result<(), Diagnostic> {
    let Ok(value) = i64::from_str_radix(number.as_str(), number.radix()) else {
        return Err(node
            .diagnostic(format!("{number} is too large for an integer"))
            .with_help("write it with a decimal point or an exponent, such as 1e20"));
    };
    #[allow(clippy::cast_precision_loss)]
    check_range(node, value as f64, schema, key)
}

/// Returns the range of numbers that a schema allows, in words; `None` if it allows all.
pub(super) fn range_in_words(schema: &Value) -> Option<String> {
    let bound = |name: &str| schema[name].as_f64();
    if let (Some(low), Some(high)) = (bound("minimum"), bound("maximum")) {
        return Some(format!("from {low} to {high}"));
    }
    let low = match (bound("exclusiveMinimum"), bound("minimum")) {
        (Some(low), _) => Some(format!("above {low}")),
        (None, Some(low)) => Some(format!("at least {low}")),
        (None, None) => None,
    };
    let high = match (bound("exclusiveMaximum"), bound("maximum")) {
        (Some(high), _) => Some(format!("below {high}")),
        (None, Some(high)) => Some(format!("at most {high}")),
        (None, None) => None,
    };
    match (low, high) {
        (Some(low), Some(high)) => Some(format!("{low} and {high}")),
        (low, high) => low.or(high),
    }
}

fn check_range(node: &Node<'_>, value: f64, schema: &Value, key: Key<'_>) -> Result<(), Diagnostic> {
    let within = |name: &str, holds: fn(&f64, &f64) -> bool| schema[name].as_f64().is_none_or(|b| holds(&value, &b));
    let allowed = within("minimum", f64::ge)
        && within("maximum", f64::le)
        && within("exclusiveMinimum", f64::gt)
        && within("exclusiveMaximum", f64::lt);
    match range_in_words(schema) {
        Some(range) if !allowed => {
            let fact = format!("`{}` must be {range}, not {}", key.name, node.value_text());
            Err(node.diagnostic(fact).with_help(help(key)))
        }
        _ => Ok(()),
    }
}

fn wrong_type(node: &Node<'_>, alternatives: &[&Value], key: Key<'_>) -> Diagnostic {
    let mut wanted: Vec<&str> = alternatives.iter().flat_map(|schema| types(schema)).map(in_words).collect();
    wanted.dedup();
    let found = match node.value() {
        DeValue::Float(_) if wanted == ["an integer"] => "a number with a decimal point or an exponent",
        _ => node.in_words(),
    };
    let fact = format!("expected {}, found {found}", wanted.join(" or "));
    let keys: Vec<&str> = alternatives.iter().filter_map(|schema| keys_of(schema)).flat_map(|k| k.names()).collect();
    let way_out = if wanted != ["a table"] {
        help(key)
    } else if keys.is_empty() {
        format!("write {} = {{ name = value }}", key.name)
    } else {
        format!("write {} = {{ key = value }}; keys: {}", key.name, keys.join(", "))
    };
    node.diagnostic(fact).with_help(way_out)
}

fn in_words(name: &str) -> &str {
    match name {
        "number" => "a number",
        "integer" => "an integer",
        "string" => "a string",
        "boolean" => "`true` or `false`",
        "array" => "a list",
        _ => "a table",
    }
}

fn help(key: Key<'_>) -> String {
    match key.about {
        Some(about) => format!("`{}`: {}", key.name, on_one_line(about)),
        None => "`mops describe` explains each key".to_owned(),
    }
}

fn check_word(node: &Node<'_>, word: &str, fitting: &[&Value], key: Key<'_>) -> Result<(), Diagnostic> {
    let mut known = Vec::new();
    for schema in fitting {
        match (schema["const"].as_str(), schema["enum"].as_array()) {
            (Some(word), _) => known.push(word),
            (None, Some(words)) => known.extend(words.iter().filter_map(Value::as_str)),
            (None, None) => return Ok(()),
        }
    }
    if known.contains(&word) {
        return Ok(());
    }
    Err(node.diagnostic(format!("invalid value `{word}` of `{}`", key.name)).with_help(suggestion(word, known)))
}

fn check_list(node: &Node<'_>, schema: &Value, key: Key<'_>) -> Result<(), Diagnostic> {
    let elements = node.elements();
    let count = |bound: &str| schema[bound].as_u64().and_then(|n| usize::try_from(n).ok());
    if let (Some(least), Some(most)) = (count("minItems"), count("maxItems"))
        && !(least..=most).contains(&elements.len())
    {
        let wanted = if least == most { least.to_string() } else { format!("{least} to {most}") };
        let fact = format!("expected {wanted} values, found {}", elements.len());
        return Err(node.diagnostic(fact).with_help(help(key)));
    }
    match schema.get("items") {
        Some(items) => elements.iter().try_for_each(|element| check_value(element, items, key)),
        None => Ok(()),
    }
}

fn check_table(node: &Node<'_>, fitting: &[&Value], key: Key<'_>) -> Result<(), Diagnostic> {
    let entries = node.entries()?;
    let mut known: Vec<(&String, &Value)> = Vec::new();
    for schema in fitting {
        match keys_of(schema) {
            None => return Ok(()),
            Some(Keys::Any(schema)) => {
                let below = |(name, node): &(String, Node<'_>)| check_value(node, schema, described(name, schema, key));
                return entries.iter().try_for_each(below);
            }
            Some(Keys::Known(keys)) => known.extend(keys),
        }
    }
    let names: Vec<&str> = known.iter().map(|(name, _)| name.as_str()).collect();
    if let Some((name, node)) = entries.iter().find(|(name, _)| !names.contains(&name.as_str())) {
        return Err(node.unknown_key(name, &names));
    }
    if let &[schema] = fitting {
        check_required(node, schema, &known)?;
    } else if entries.len() != 1 {
        // Alternatives are the variants of an enumeration, each with one key.
        let number = if entries.is_empty() { "none" } else { "more than one" };
        let fact = format!("expected exactly one of {}, found {number}", names.join(", "));
        return Err(node.diagnostic(fact).with_help(format!("as in {} = {{ {} = ... }}", key.name, names[0])));
    }
    entries.iter().try_for_each(|(name, node)| {
        let (_, schema) = known.iter().find(|(known, _)| *known == name).expect("unknown keys are refused above");
        check_value(node, schema, described(name, schema, Key { name, about: None }))
    })
}

/// Returns the key with its own documentation, or else with that of its table.
fn described<'k>(name: &'k str, schema: &'k Value, above: Key<'k>) -> Key<'k> {
    Key { name, about: schema["description"].as_str().or(above.about) }
}

fn check_required(node: &Node<'_>, schema: &Value, known: &[(&String, &Value)]) -> Result<(), Diagnostic> {
    let required = schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str);
    for name in required {
        if node.child(name).is_none() {
            let about = known.iter().find(|(known, _)| *known == name).and_then(|(_, s)| s["description"].as_str());
            let about = about.map_or_else(String::new, |about| format!(": {}", on_one_line(about)));
            let fact = format!("`{name}` is missing");
            return Err(node.key_diagnostic(fact).with_help(format!("add `{name} = ...`{about}")));
        }
    }
    Ok(())
}
