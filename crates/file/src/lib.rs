//! Study files: `study.toml`, read in two stages. The first keeps every position and checks keys and types. The second
//! ([`mops_core::StudyBuilder::build`]) checks the contents; its errors are mapped back to their positions.

mod built;
mod cases;
mod columns;
mod content;
mod criterion;
pub mod edit;
mod effects;
mod experiment;
mod frequency;
mod input_sections;
mod inputs;
mod keys;
mod manual;
mod models;
mod parts;
mod reading;
mod schema;
mod sections;
mod shape;
mod solver;
mod study_file;
mod syntax;
mod tasks;
mod tree;
mod uncertain;

use std::path::Path;
use std::sync::Arc;

pub use built::built;
pub use content::digest;
pub use manual::{Entry, about, describe, entries, places_of};
use mops_language::files::Files;
pub use parts::{cases, criterion, experiments, model};
pub use schema::{study_schema, tables};

use cases::read_cases;
use criterion::read_criterion;
use mops_core::catalogue::Catalogue;
use mops_core::catalogue::Shipped;
use mops_core::study::{Study, StudyBuilder, TunerBuilder};
use mops_language::Expression;
use mops_language::files::read_regular;
use mops_language::{Diagnostic, Source};
use reading::read_unit;
use sections::{PerCase, SensorSection, StudySection, TunerSection};
use serde::Deserialize;
use solver::read_solver;
pub use study_file::StudyFile;
use tree::{Node, Text};

/// Reads the study file at `path`. Data files are in its folder and below, or in a folder that the catalogue names as
/// readable.
///
/// # Errors
/// The file cannot be read, or its first mistake with line and column.
pub fn read_study(catalogue: &Catalogue, path: impl AsRef<Path>) -> Result<Study, Diagnostic> {
    let path = path.as_ref();
    let name = path.display().to_string();
    let bytes = read_regular(path).map_err(|error| Diagnostic::new(format!("{name} cannot be read: {error}")))?;
    let source = Source::from_bytes(&name, bytes)?;
    let folder = catalogue.folder(path.parent().unwrap_or(Path::new("")));
    Ok(read(catalogue, &name, &source.text, &[], &folder)?.study)
}

/// Reads a study from the text of a study file. Data files are in the working directory and below, or in a folder that
/// the catalogue names as readable.
///
/// # Errors
/// The first mistake with line and column.
pub fn parse_study(catalogue: &Catalogue, text: &str) -> Result<Study, Diagnostic> {
    Ok(read(catalogue, "study", text, &[], &catalogue.folder(""))?.study)
}

/// Reads a study whose files are in the program; `settings` are `key=value` pairs that replace values.
///
/// # Errors
/// The first mistake, in the settings or in the file.
///
/// # Panics
/// If the study has no `study.toml` in UTF-8.
pub fn read_shipped(catalogue: &Catalogue, study: &Shipped, settings: &[String]) -> Result<StudyFile, Diagnostic> {
    let text = study.file("study.toml").expect("every shipped study has a study.toml");
    let text = std::str::from_utf8(text).expect("shipped studies are UTF-8");
    read(catalogue, &format!("{}/study.toml", study.name), text, settings, study)
}

/// Reads a study file; `settings` are `key=value` pairs that override it.
///
/// # Errors
/// Returns the first error, with file, line and column, description and suggested fix.
pub fn read(
    catalogue: &Catalogue,
    name: &str,
    text: &str,
    settings: &[String],
    files: &dyn Files,
) -> Result<StudyFile, Diagnostic> {
    let text = Arc::new(Text::new(name, text, settings));
    read_text(catalogue, &text, files).map_err(|mistake| text.settle(mistake))
}

fn read_text(catalogue: &Catalogue, text: &Arc<Text>, files: &dyn Files) -> Result<StudyFile, Diagnostic> {
    let root = text.parse()?;
    let files = &content::Listed::new(files);
    let tables = ["study", "models", "tuners", "cases", "experiments", "sensors", "criteria", "solver"];
    root.check_keys(&[&tables[..], &tasks::tables(catalogue)[..]].concat())?;
    let section = schema::study_section(catalogue);
    let study = root.required("study", "add [study] with name = \"...\"")?;
    let study = study.read_with(&section, StudySection::deserialize)?;

    let mut draft = StudyBuilder {
        name: study.name,
        objective: study.objective,
        seed: study.seed.unwrap_or(1),
        ..StudyBuilder::default()
    };
    let nodes = root.table("models")?;
    for (name, node) in &nodes {
        draft.models.push((name.clone(), models::read(catalogue, &nodes, (name, node), files)?));
    }
    for (name, node) in root.table("tuners")? {
        draft.tuners.push((name, read_tuner(&node)?));
    }
    for (name, node) in root.table("cases")? {
        let cases = read_cases(&name, &node, &draft.models, files)?;
        draft.cases.extend(cases);
    }
    for (name, node) in root.table("experiments")? {
        if draft.cases.iter().any(|case| case.name == name) {
            return Err(node
                .key_diagnostic(format!("a case and an experiment are both called `{name}`"))
                .with_help("rename one of them: results are listed by these names"));
        }
        draft.cases.extend(experiment::read(&name, &node, files)?);
    }
    for (signal, node) in root.table("sensors")? {
        let SensorSection { noise } = node.read()?;
        draft.sensors.push((signal, noise));
    }
    for (name, node) in root.table("criteria")? {
        draft.criteria.push((name, read_criterion(catalogue, &node)?));
    }
    uncertain::read(&root, &mut draft)?;
    tasks::read(&root, catalogue, study.task.as_deref(), &mut draft)?;
    let (solver, max_evaluations) = read_solver(catalogue, &root)?;
    let mut study = draft.build().map_err(|mistake| root.locate(&mistake))?;
    let unused = tasks::unused(&root, catalogue, study.task());
    study.add_notes(unused);
    let content = content::of(root.value());
    let data = files.digests();
    Ok(StudyFile {
        study,
        solver,
        max_evaluations,
        source: Arc::clone(text.source()),
        content,
        data,
        program: catalogue.program.clone(),
        text: Arc::clone(text),
    })
}

fn read_tuner(node: &Node<'_>) -> Result<TunerBuilder, Diagnostic> {
    let section: TunerSection = node.read()?;
    if let (Some(place), Some(tie)) = (node.child("tie"), &section.tie) {
        Expression::parse(tie).map_err(|wrong| {
            place.diagnostic_within(wrong.span, wrong.message).with_help("as in tie = \"2*Ti + 0.1\"")
        })?;
    }
    Ok(TunerBuilder {
        unit: section.unit.as_deref().map(|unit| read_unit(node, "unit", unit)).transpose()?,
        start: section.start,
        min: section.min,
        max: section.max,
        scale: section.scale,
        integer: section.integer,
        values: section.values,
        inactive: section.active == Some(false),
        tie: section.tie,
        per_case: section.per_case == PerCase::All(true),
        separate_in: match section.per_case {
            PerCase::In(cases) => cases,
            PerCase::All(_) => Vec::new(),
        },
        starts: section.starts.0,
    })
}
