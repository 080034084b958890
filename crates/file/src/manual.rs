//! Manual pages of kinds and tables, derived from their schemas.

use schemars::Schema;
use serde_json::Value;

use super::keys::{Keys, keys_of};

/// Key of a schema, for its manual page.
pub struct Entry {
    /// Name of the key.
    pub name: String,
    /// Type, range and default, such as `quantity, above 0, required`.
    pub facts: String,
    /// Documentation.
    pub about: String,
    /// Name of the group of `below`, if its entries can occur under arbitrary names.
    pub any_name: Option<String>,
    /// Keys of the table that is the value.
    pub below: Vec<Self>,
}

/// Returns the documentation of a schema; empty if it has none. Formulas are fenced.
pub fn about(schema: &Schema) -> &str {
    schema.as_value().get("description").and_then(Value::as_str).unwrap_or_default()
}

/// Returns the keys that a schema allows, with their documentation.
pub fn entries(schema: &Schema) -> Vec<Entry> {
    below(schema.as_value())
}

fn below(schema: &Value) -> Vec<Entry> {
    let Some(Keys::Known(known)) = keys_of(schema) else { return Vec::new() };
    let required: Vec<&str> =
        schema.get("required").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str).collect();
    let entry = |(key, option): &(&String, &Value)| {
        let default = option.get("default").filter(|d| !d.is_null()).map(|d| format!("default {d}"));
        // A count is obviously not negative.
        let range = super::shape::range_in_words(option).filter(|range| range != "at least 0");
        let need = if required.contains(&key.as_str()) { Some("required".to_owned()) } else { default };
        let facts: Vec<String> = [Some(type_name(option)), range, need].into_iter().flatten().collect();
        let (any_name, inside) = match keys_of(option) {
            Some(Keys::Any(each)) if matches!(keys_of(each), Some(Keys::Known(_))) => (Some(type_name(each)), each),
            _ => (None, *option),
        };
        Entry {
            name: (*key).clone(),
            facts: facts.join(", "),
            about: option.get("description").and_then(Value::as_str).unwrap_or_default().to_owned(),
            any_name,
            below: below(inside),
        }
    };
    known.iter().map(entry).collect()
}

/// Returns the manual page of a kind, from its schema: description and options.
pub fn describe(name: &str, schema: &Schema) -> String {
    let mut page = format!("{name}\n\n");
    let about = about(schema);
    if !about.is_empty() {
        page += &without_fences(about);
        page += "\n\n";
    }
    page += "Options:\n";
    let entries = entries(schema);
    if entries.is_empty() {
        page += "  none\n";
    }
    list(&mut page, &entries, 1);
    page
}

/// Returns all places of a key in a schema, at any depth: the keys that lead there, such as `clocks.NAME.filter`, and
/// the documentation.
pub fn places_of(key: &str, schema: &Schema) -> Vec<(String, String)> {
    fn find(key: &str, entries: &[Entry], path: &str, found: &mut Vec<(String, String)>) {
        for entry in entries {
            let here = format!("{path}{}", entry.name);
            if entry.name == key {
                let mut page = String::new();
                list(&mut page, std::slice::from_ref(entry), 1);
                found.push((here.clone(), page));
            }
            let name = if entry.any_name.is_some() { "NAME." } else { "" };
            find(key, &entry.below, &format!("{here}.{name}"), found);
        }
    }
    let mut found = Vec::new();
    find(key, &entries(schema), "", &mut found);
    found
}

fn list(page: &mut String, entries: &[Entry], depth: usize) {
    let indent = "  ".repeat(depth);
    for entry in entries {
        *page += &format!("{indent}{} ({})\n", entry.name, entry.facts);
        for line in entry.about.lines() {
            *page += &format!("{indent}    {line}\n");
        }
        match &entry.any_name {
            Some(name) => {
                *page += &format!("{indent}    NAME ({name})\n");
                list(page, &entry.below, depth + 4);
            }
            None => list(page, &entry.below, depth + 2),
        }
    }
}

/// Indents the fenced formulas of a documentation, for the terminal.
fn without_fences(text: &str) -> String {
    let mut inside = false;
    let mut lines = Vec::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            inside = !inside;
        } else {
            lines.push(if inside { format!("    {line}") } else { line.to_owned() });
        }
    }
    lines.join("\n")
}

fn type_name(schema: &Value) -> String {
    if let Some(values) = schema.get("enum").and_then(Value::as_array) {
        return values.iter().filter_map(Value::as_str).collect::<Vec<_>>().join(" | ");
    }
    if let Some(value) = schema.get("const").and_then(Value::as_str) {
        return value.to_owned();
    }
    for choice in ["anyOf", "oneOf"] {
        if let Some(alternatives) = schema.get(choice).and_then(Value::as_array) {
            let mut names: Vec<String> = alternatives.iter().map(type_name).filter(|n| n != "null").collect();
            names.dedup();
            return names.join(" | ");
        }
    }
    let names: Vec<&str> = match schema.get("type") {
        Some(Value::String(name)) => vec![name],
        Some(Value::Array(names)) => names.iter().filter_map(Value::as_str).filter(|n| *n != "null").collect(),
        _ => vec!["object"],
    };
    match names[..] {
        // A quantity is a number, or a string with a unit.
        ["number", "string"] => "quantity".to_owned(),
        ["array"] => format!("list of {}", schema.get("items").map_or_else(|| "anything".into(), type_name)),
        ["object"] => "table".to_owned(),
        _ => names.join(" | "),
    }
}
