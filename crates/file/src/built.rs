//! Studies built in Rust, read as if they were files: settings of the command line replace values of the draft.

use std::sync::Arc;

use mops_core::{
    case::Case,
    catalogue::{BuiltStudy, Catalogue, schema_of},
    criterion::Demand,
    evaluation::Objective,
    failure::caught,
    study::{Study, StudyBuilder},
};
use mops_language::{Diagnostic, Quantity, suggestion};
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

use super::solver::read_solver;
use super::tree::{Node, Text};
use super::{StudyFile, content, digest, schema, tasks, uncertain};

/// What settings may replace in `[study]`.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct StudySettings {
    /// Task.
    task: Option<String>,
    /// Combination of the scaled values: `max` or `sum`.
    objective: Option<Objective>,
    /// Seed of all random numbers.
    seed: Option<u64>,
}

/// What settings may replace in a tuner.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct TunerSettings {
    /// Initial value.
    start: Option<Quantity>,
    /// Lower bound.
    min: Option<Quantity>,
    /// Upper bound.
    max: Option<Quantity>,
}

/// Builds a study and applies `settings`, which are `key=value` pairs: `study.task`, `study.objective`, `study.seed`,
/// `start`, `min` and `max` of tuners, `solver`, and the tables of tasks. The identity of a run includes
/// [`Catalogue::program`]: stored evaluations of another build are not reused.
///
/// # Errors
/// The first mistake, in the settings or in the study.
pub fn built(catalogue: &Catalogue, study: &BuiltStudy, settings: &[String]) -> Result<StudyFile, Diagnostic> {
    let text = Arc::new(Text::new(study.name(), "", settings));
    read(catalogue, study, &text).map_err(|mistake| text.settle(mistake))
}

fn read(catalogue: &Catalogue, built: &BuiltStudy, text: &Arc<Text>) -> Result<StudyFile, Diagnostic> {
    let root = text.parse()?;
    root.check_keys(&[&["study", "tuners", "solver"][..], &tasks::tables(catalogue)[..]].concat())
        .map_err(|mistake| mistake.with_help("change everything else in the source code of the study"))?;
    let mut draft = caught(|| built.draft()).map_err(|why| {
        Diagnostic::new(format!("the function that builds the study `{}` {why}", built.name()))
            .with_help("correct the function; the panic message on standard error shows the line")
    })?;
    draft.name = built.name().to_owned();
    let mut word = None;
    if let Some(node) = root.child("study") {
        let mut schema = schema_of::<StudySettings>().to_value();
        schema::add_words(&mut schema, catalogue);
        let schema = schema.try_into().expect("it is a schema");
        let settings = node.read_with(&schema, StudySettings::deserialize)?;
        word = settings.task;
        draft.objective = settings.objective.or(draft.objective);
        draft.seed = settings.seed.unwrap_or(draft.seed);
    }
    for (name, node) in root.table("tuners")? {
        set_tuner(&mut draft, &name, &node)?;
    }
    uncertain::read(&root, &mut draft)?;
    tasks::read(&root, catalogue, word.as_deref(), &mut draft)?;
    let (solver, max_evaluations) = read_solver(catalogue, &root)?;
    let study = draft.build().map_err(|mistake| {
        let located = root.locate(&mistake);
        match &located.place {
            Some((_, span)) if *span != (0..0) => located,
            // An error of the program has no position in the settings: its keys name the entry.
            _ => Diagnostic { message: format!("{}: {}", mistake.path.join("."), mistake.message), ..located },
        }
    })?;
    Ok(StudyFile {
        content: content_of(&root, &study),
        study,
        solver,
        max_evaluations,
        source: Arc::clone(text.source()),
        data: Vec::new(),
        program: catalogue.program.clone(),
        text: Arc::clone(text),
    })
}

fn set_tuner(draft: &mut StudyBuilder, name: &str, node: &Node<'_>) -> Result<(), Diagnostic> {
    let names: Vec<String> = draft.tuners.iter().map(|(name, _)| name.clone()).collect();
    let tuner = draft.tuners.iter_mut().find(|(known, _)| known == name).map(|(_, tuner)| tuner).ok_or_else(|| {
        node.key_diagnostic(format!("the study has no tuner `{name}`"))
            .with_help(suggestion(name, names.iter().map(String::as_str)))
    })?;
    let settings: TunerSettings = node.read()?;
    for (value, new) in
        [(&mut tuner.start, settings.start), (&mut tuner.min, settings.min), (&mut tuner.max, settings.max)]
    {
        if new.is_some() {
            *value = new;
        }
    }
    Ok(())
}

/// Content of the study as far as it is data, in the layout of a study file: its settings, with the values that they
/// replace. The digest of the program stands for the rest.
fn content_of(root: &Node<'_>, study: &Study) -> Value {
    let tuners = study.tuners().iter().map(|tuner| {
        let [min, max] = tuner.bounds;
        (tuner.name.clone(), json!({ "start": tuner.start, "min": min, "max": max, "scale": tuner.scale }))
    });
    let cases = study.cases().iter().map(|case| (case.name.clone(), json!(data(case))));
    let criteria = study.rows().iter().map(|row| {
        let demand = match row.demand {
            Demand::AtMost(demand) | Demand::AtLeast(demand) => json!({ "demand": demand }),
            Demand::Pair { good, bad } => json!({ "good": good, "bad": bad }),
            Demand::None => json!({}),
        };
        let Value::Object(mut table) = demand else { unreachable!("it is a table") };
        table.extend([("usage".to_owned(), json!(row.usage)), ("weight".to_owned(), json!(row.weight))]);
        (row.name.clone(), Value::Object(table))
    });
    let Value::Object(mut content) = content::of(root.value()) else { unreachable!("the root is a table") };
    content.extend([
        (
            "study".to_owned(),
            json!({ "name": study.name(), "task": study.task(), "objective": study.objective(), "seed": study.seed() }),
        ),
        ("tuners".to_owned(), Value::Object(tuners.collect())),
        ("cases".to_owned(), Value::Object(cases.collect())),
        ("criteria".to_owned(), Value::Object(criteria.collect())),
    ]);
    Value::Object(content)
}

/// Returns the digest of the values and data of a case.
fn data(case: &Case) -> String {
    let Case { parameters, inputs, experiment, horizon, .. } = case;
    digest(format!("{:?}", (parameters, inputs, experiment, horizon)).as_bytes())
}
