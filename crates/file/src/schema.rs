//! JSON schema of study files, derived from the types that read them.

use std::sync::Arc;

use mops_core::{
    catalogue::{Catalogue, TaskKind, schema_of},
    effect::Effect,
};
use mops_language::{Quantity, entries::Entries};
use schemars::Schema;
use serde_json::{Map, Value, json};

use super::sections::{
    CaseOptions, CriterionCommon, EffectSection, ExperimentSection, ModelCommon, SensorSection, SolverCommon,
    StudySection, TunerSection,
};
use super::uncertain::{self, UncertainSection, UncertainTable};

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
    let mut tables = json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "mops study",
        "type": "object",
        "additionalProperties": false,
        "required": ["study", "models"],
        "properties": {
            "study": study_section(catalogue).to_value(),
            "models": named(one_kind(with_effects(value(schema_of::<ModelCommon>()), catalogue), models, true)),
            "tuners": value(schema_of::<Entries<TunerSection>>()),
            "cases": named(case),
            "experiments": value(schema_of::<Entries<ExperimentSection>>()),
            "sensors": value(schema_of::<Entries<SensorSection>>()),
            "criteria": named(one_kind(value(schema_of::<CriterionCommon>()), criteria, true)),
            "solver": one_kind(value(schema_of::<SolverCommon>()), solvers, false),
            "uncertain": value(schema_of::<UncertainTable>()),
        },
    });
    let properties = tables["properties"].as_object_mut().expect("it was just made");
    properties.extend(catalogue.tasks.iter().map(|kind| (kind.table.to_owned(), (kind.schema)().to_value())));
    tables
}

/// Returns the schema of `[study]` with the tasks of a catalogue.
pub(super) fn study_section(catalogue: &Catalogue) -> Schema {
    let mut schema = schema_of::<StudySection>().to_value();
    add_words(&mut schema, catalogue);
    schema.try_into().expect("it is a schema")
}

/// Adds the words of the tasks to the schema of `[study]`.
pub(super) fn add_words(schema: &mut Value, catalogue: &Catalogue) {
    let word = |kind: &TaskKind| json!({ "const": kind.name, "type": "string", "description": kind.about });
    let about = schema["properties"]["task"]["description"].take();
    let words: Vec<Value> = catalogue.tasks.iter().map(word).collect();
    schema["properties"]["task"] = json!({ "description": about, "oneOf": words });
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

/// Returns the tables of a study file: name and schema of each.
pub fn tables(catalogue: &Catalogue) -> Vec<(&'static str, Schema)> {
    let mut tables = vec![
        ("study", study_section(catalogue)),
        ("models", schema_of::<ModelCommon>()),
        ("tuners", schema_of::<TunerSection>()),
        ("cases", schema_of::<CaseOptions>()),
        ("experiments", schema_of::<ExperimentSection>()),
        ("sensors", schema_of::<SensorSection>()),
        ("criteria", schema_of::<CriterionCommon>()),
        ("solver", schema_of::<SolverCommon>()),
        (uncertain::TABLE, schema_of::<UncertainSection>()),
    ];
    tables.extend(catalogue.tasks.iter().map(|kind| (kind.table, (kind.schema)())));
    tables
}
