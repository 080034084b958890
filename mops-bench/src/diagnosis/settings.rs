//! Settings of the diagnosis by name, to see what depends on them.

use mops::diagnosis::Settings;
use serde_json::{Map, Number, Value};

/// Returns the names of all settings; those of a group follow its name, as `coverage.periods`.
pub(crate) fn names() -> Vec<String> {
    let mut all = Vec::new();
    for (name, value) in tree(&Settings::default()) {
        match value {
            Value::Object(group) => all.extend(group.keys().map(|own| format!("{name}.{own}"))),
            _ => all.push(name),
        }
    }
    all
}

/// Returns the settings with one of them multiplied by a factor, whole numbers rounded and at least 1; `None` if there
/// is none of this name.
pub(crate) fn scaled(settings: &Settings, name: &str, factor: f64) -> Option<Settings> {
    let mut tree = Value::Object(tree(settings));
    let value = tree.pointer_mut(&format!("/{}", name.replace('.', "/")))?;
    let Value::Number(number) = value else { return None };
    *number = match number.as_f64()? * factor {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        product if number.is_u64() => (product.round().max(1.0) as u64).into(),
        product => Number::from_f64(product)?,
    };
    serde_json::from_value(tree).ok()
}

fn tree(settings: &Settings) -> Map<String, Value> {
    match serde_json::to_value(settings) {
        Ok(Value::Object(tree)) => tree,
        _ => Map::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_is_a_number_that_can_be_halved_and_doubled() {
        let settings = Settings::default();
        let names = names();
        assert!(names.len() > 20 && names.contains(&"coverage.periods".to_owned()), "{names:?}");
        for name in &names {
            let doubled = scaled(&settings, name, 2.0).expect("it is a number");
            assert_ne!(doubled, settings, "{name}");
            assert_eq!(scaled(&doubled, name, 0.5), Some(settings.clone()), "{name}");
        }
        assert_eq!(scaled(&settings, "coverage", 2.0), None);
    }
}
