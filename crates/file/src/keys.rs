//! Keys that a schema allows, and their documentation.

use serde_json::Value;

/// Keys that a table may contain.
pub(super) enum Keys<'s> {
    /// Arbitrary keys, all with one schema.
    Any(&'s Value),
    /// Listed keys.
    Known(Vec<(&'s String, &'s Value)>),
}

impl<'s> Keys<'s> {
    pub fn get(&self, key: &str) -> Option<&'s Value> {
        match self {
            Self::Any(schema) => Some(schema),
            Self::Known(known) => known.iter().find(|(name, _)| *name == key).map(|(_, schema)| *schema),
        }
    }

    pub fn names(&self) -> Vec<&'s str> {
        match self {
            Self::Any(_) => Vec::new(),
            Self::Known(known) => known.iter().map(|(name, _)| name.as_str()).collect(),
        }
    }
}

/// Returns the keys that a schema allows; `None` if it allows no table, or anything.
pub(super) fn keys_of(schema: &Value) -> Option<Keys<'_>> {
    if let Some(Value::Object(any)) = schema.get("additionalProperties").filter(|s| s.is_object()) {
        let _ = any;
        return Some(Keys::Any(&schema["additionalProperties"]));
    }
    let mut known: Vec<(&String, &Value)> = Vec::new();
    if let Some(properties) = schema.get("properties").and_then(Value::as_object) {
        known.extend(properties);
    }
    for choice in ["anyOf", "oneOf", "allOf"] {
        for alternative in schema.get(choice).and_then(Value::as_array).into_iter().flatten() {
            match keys_of(alternative) {
                Some(Keys::Any(schema)) => return Some(Keys::Any(schema)),
                Some(Keys::Known(more)) => known.extend(more),
                None => {}
            }
        }
    }
    let closed = schema.get("additionalProperties") == Some(&Value::Bool(false));
    (closed || !known.is_empty()).then_some(Keys::Known(known))
}

/// Returns the documentation of a key, as the end of a sentence.
pub(super) fn documentation(schema: &Value, key: &str) -> Option<String> {
    keys_of(schema)?.get(key)?.get("description")?.as_str().map(on_one_line)
}

/// Returns a documentation as the end of a sentence.
pub(super) fn on_one_line(about: &str) -> String {
    let about = about.replace('\n', " ");
    let about = about.trim_end_matches('.');
    let mut letters = about.chars();
    match (letters.next(), letters.next()) {
        (Some(first), Some(second)) if !second.is_uppercase() => {
            first.to_lowercase().chain(about.chars().skip(1)).collect()
        }
        _ => about.to_owned(),
    }
}
