//! `result.json`, checked against its schema.

use std::sync::LazyLock;

use jsonschema::Validator;
use serde_json::Value;

/// Schema of `result.json`, which allows no key that it does not describe.
static SCHEMA: LazyLock<Validator> = LazyLock::new(|| {
    let mut schema = mops::tasks::result_schema(&mops::catalogue());
    close(&mut schema);
    jsonschema::validator_for(&schema).unwrap()
});

/// Forbids keys that the schema does not describe, at any depth.
fn close(schema: &mut Value) {
    match schema {
        Value::Object(keys) => {
            keys.values_mut().for_each(close);
            if keys.get("properties").is_some_and(Value::is_object) {
                keys.insert("additionalProperties".to_owned(), Value::Bool(false));
            }
        }
        Value::Array(values) => values.iter_mut().for_each(close),
        _ => {}
    }
}

/// Reads a result, which must agree with the schema.
pub fn read(bytes: &[u8]) -> Result<Value, serde_json::Error> {
    let result = serde_json::from_slice(bytes)?;
    let wrong: Vec<String> = SCHEMA.iter_errors(&result).map(|e| format!("{}: {e}", e.instance_path)).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
    Ok(result)
}
