//! JSON schema of study files, derived from the types that read them, and the manual pages derived from it.

use std::sync::Arc;

use schemars::Schema;
use serde_json::{Map, Value, json};

use super::entries::Entries;
use super::robustness::{
    MonteCarloSection, RobustSection, UncertainSection, UncertainTable, UncertaintySection, WorstCaseSection,
};
use super::sections::{
    CaseOptions, CriterionCommon, EffectSection, ExperimentSection, ModelCommon, SolverCommon, StudySection,
    TunerSection,
};
use super::tasks::{DiagnosisSection, ExcitationSection, ParetoSection, SensitivitySection, SweepSection};
use crate::catalogue::{Catalogue, schema_of};
use crate::effect::Effect;
use crate::unit::Quantity;

/// Returns the schema of a complete study file, for editors.
pub fn study_schema(catalogue: &Catalogue) -> Value {
    let kinds = |list: Vec<(&str, Schema)>| -> Map<String, Value> {
        list.into_iter().map(|(name, schema)| (name.to_owned(), schema.to_value())).collect()
    };
    let models = kinds(catalogue.models.iter().map(|k| (k.name, (k.schema)())).collect());
    let criteria = kinds(catalogue.criteria.iter().map(|k| (k.name, (k.schema)())).collect());
    let solvers = kinds(catalogue.solvers.iter().map(|k| (k.name, (k.schema)())).collect());
    let value = |schema: Schema| schema.to_value();
    let mut case = value(schema_of::<CaseOptions>());
    case["additionalProperties"] = value(schema_of::<Quantity>());
    json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "mops study",
        "type": "object",
        "additionalProperties": false,
        "required": ["study", "models"],
        "properties": {
            "study": value(schema_of::<StudySection>()),
            "models": named(one_kind(with_effects(value(schema_of::<ModelCommon>()), catalogue), models, true)),
            "tuners": value(schema_of::<Entries<TunerSection>>()),
            "cases": named(case),
            "experiments": value(schema_of::<Entries<ExperimentSection>>()),
            "criteria": named(one_kind(value(schema_of::<CriterionCommon>()), criteria, true)),
            "solver": one_kind(value(schema_of::<SolverCommon>()), solvers, false),
            "excitation": value(schema_of::<ExcitationSection>()),
            "sensitivity": value(schema_of::<SensitivitySection>()),
            "sweep": value(schema_of::<SweepSection>()),
            "pareto": value(schema_of::<ParetoSection>()),
            "diagnosis": value(schema_of::<DiagnosisSection>()),
            "uncertain": value(schema_of::<UncertainTable>()),
            "worst-case": value(schema_of::<WorstCaseSection>()),
            "robust": value(schema_of::<RobustSection>()),
            "monte-carlo": value(schema_of::<MonteCarloSection>()),
            "uncertainty": value(schema_of::<UncertaintySection>()),
        },
    })
}

/// Returns the schema of a model with the effects of the catalogue, by name.
fn with_effects(mut common: Value, catalogue: &Catalogue) -> Value {
    let section = schema_of::<EffectSection>().to_value();
    let kind = |effect: &Arc<dyn Effect>| {
        let mut schema = section.clone();
        schema["description"] = json!(format!("{} `{}`", effect.about(), effect.formula()));
        (effect.name().to_owned(), schema)
    };
    let kinds = catalogue.effects.iter().map(kind).collect();
    let one = one_kind(json!({ "type": "object", "additionalProperties": false }), kinds, true);
    common["properties"]["effects"]["additionalProperties"] = one;
    common
}

/// Returns the schema of a table with arbitrary names, each with the given schema.
fn named(schema: Value) -> Value {
    json!({ "type": "object", "additionalProperties": schema })
}

/// Returns the schema of the common keys with exactly one kind, or at most one if the kind is optional.
fn one_kind(mut common: Value, kinds: Map<String, Value>, must_be: bool) -> Value {
    if must_be {
        common["oneOf"] = kinds.keys().map(|name| json!({ "required": [name] })).collect();
    }
    if !common["properties"].is_object() {
        common["properties"] = json!({});
    }
    common["properties"].as_object_mut().expect("just made").extend(kinds);
    common
}

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
    keys_of(schema)?.get(key)?.get("description")?.as_str().map(super::shape::on_one_line)
}

/// Returns the tables of a study file: name and schema of each.
pub fn tables() -> Vec<(&'static str, Schema)> {
    vec![
        ("study", schema_of::<StudySection>()),
        ("models", schema_of::<ModelCommon>()),
        ("tuners", schema_of::<TunerSection>()),
        ("cases", schema_of::<CaseOptions>()),
        ("experiments", schema_of::<ExperimentSection>()),
        ("criteria", schema_of::<CriterionCommon>()),
        ("solver", schema_of::<SolverCommon>()),
        ("excitation", schema_of::<ExcitationSection>()),
        ("sensitivity", schema_of::<SensitivitySection>()),
        ("sweep", schema_of::<SweepSection>()),
        ("pareto", schema_of::<ParetoSection>()),
        ("diagnosis", schema_of::<DiagnosisSection>()),
        ("uncertain", schema_of::<UncertainSection>()),
        ("worst-case", schema_of::<WorstCaseSection>()),
        ("robust", schema_of::<RobustSection>()),
        ("monte-carlo", schema_of::<MonteCarloSection>()),
        ("uncertainty", schema_of::<UncertaintySection>()),
    ]
}

/// Returns the tables of a study file that contain a key, at any depth.
pub fn tables_with(key: &str) -> Vec<&'static str> {
    let with = tables().into_iter().filter(|(_, schema)| has_key(schema.as_value(), key));
    with.map(|(table, _)| table).collect()
}

fn has_key(schema: &Value, key: &str) -> bool {
    match keys_of(schema) {
        Some(Keys::Known(known)) => known.iter().any(|(name, below)| *name == key || has_key(below, key)),
        Some(Keys::Any(each)) => has_key(each, key),
        None => false,
    }
}

/// Returns the manual page of a kind, from its schema: description and options.
pub fn describe(name: &str, schema: &Schema) -> String {
    let schema = schema.as_value();
    let mut page = format!("{name}\n\n");
    if let Some(about) = schema.get("description").and_then(Value::as_str) {
        page += &without_fences(about);
        page += "\n\n";
    }
    page += "Options:\n";
    let count = options(&mut page, schema, 1);
    if count == 0 {
        page += "  none\n";
    }
    page
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

fn options(page: &mut String, schema: &Value, depth: usize) -> usize {
    let Some(Keys::Known(known)) = keys_of(schema) else { return 0 };
    let required: Vec<&str> =
        schema.get("required").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str).collect();
    for (key, option) in &known {
        let indent = "  ".repeat(depth);
        let default = option.get("default").filter(|d| !d.is_null()).map(|d| format!(", default {d}"));
        let need = if required.contains(&key.as_str()) { ", required".to_owned() } else { default.unwrap_or_default() };
        // A count is obviously not negative.
        let range = super::shape::range_in_words(option).filter(|range| range != "at least 0");
        let range = range.map_or_else(String::new, |range| format!(", {range}"));
        *page += &format!("{indent}{key} ({}{range}{need})\n", type_name(option));
        let about = option.get("description").and_then(Value::as_str).unwrap_or_default();
        for line in about.lines() {
            *page += &format!("{indent}    {line}\n");
        }
        // A table with arbitrary names: the options under each name.
        match keys_of(option) {
            Some(Keys::Any(each)) if matches!(keys_of(each), Some(Keys::Known(_))) => {
                *page += &format!("{indent}    NAME ({})\n", type_name(each));
                options(page, each, depth + 4);
            }
            _ => {
                options(page, option, depth + 2);
            }
        }
    }
    known.len()
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
    match schema.get("type") {
        Some(Value::String(name)) if name == "array" => {
            format!("list of {}", schema.get("items").map_or_else(|| "anything".into(), type_name))
        }
        Some(Value::String(name)) if name == "object" => "table".to_owned(),
        Some(Value::String(name)) => name.clone(),
        Some(Value::Array(names)) => {
            let names: Vec<&str> = names.iter().filter_map(Value::as_str).filter(|n| *n != "null").collect();
            // A quantity is a number, or a string with a unit.
            if names == ["number", "string"] { "quantity".to_owned() } else { names.join(" | ") }
        }
        _ => "table".to_owned(),
    }
}
