//! JSON schema of study files, derived from the types that read them.

use std::sync::Arc;

use mops_core::{
    catalogue::{Catalogue, schema_of},
    effect::Effect,
};
use mops_language::Quantity;
use schemars::Schema;
use serde_json::{Map, Value, json};

use super::entries::Entries;
use super::robustness::{
    MonteCarloSection, RobustSection, UncertainSection, UncertainTable, UncertaintySection, WorstCaseSection,
};
use super::sections::{
    CaseOptions, CriterionCommon, EffectSection, ExperimentSection, ModelCommon, SensorSection, SolverCommon,
    StudySection, TunerSection,
};
use super::tasks::{DiagnosisSection, ExcitationSection, ParetoSection, SensitivitySection, SweepSection};

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
            "sensors": value(schema_of::<Entries<SensorSection>>()),
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
        let mut choices: Vec<Value> = kinds.keys().map(|name| json!({ "required": [name] })).collect();
        if common["properties"]["like"].is_object() {
            // A table that is like another one takes the kind from there.
            choices.push(json!({ "required": ["join"] }));
            choices.push(json!({ "required": ["like"], "not": { "anyOf": choices.clone() } }));
        }
        common["oneOf"] = choices.into();
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
        ("sensors", schema_of::<SensorSection>()),
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
