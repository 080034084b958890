//! Study files: `study.toml`, read in two stages. The first keeps every position and checks keys and types. The second
//! ([`mops_core::StudyBuilder::build`]) checks the contents; its errors are mapped back to their positions.

mod built;
mod columns;
mod content;
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
use serde::Deserialize;

use columns::entry;
use inputs::Reader;
use mops_core::case::Input;
use mops_core::catalogue::Shipped;
use mops_core::catalogue::{Catalogue, SolverChoice, schema_once};
use mops_core::criterion::{Other, Usage};
use mops_core::model::{AnalysisKind, Interface};
use mops_core::study::StudyError;
use mops_core::study::{CaseBuilder, CriterionBuilder, ModelBuilder, Study, StudyBuilder, TunerBuilder};
use mops_language::Expression;
use mops_language::Quantity;
use mops_language::files::read_regular;
use mops_language::{Diagnostic, Source};
use reading::{kind, read_seconds, read_unit};
use sections::{CaseOptions, CriterionCommon, PerCase, SensorSection, SolverCommon, StudySection, TunerSection};
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

/// A study file, read and checked.
pub struct StudyFile {
    /// Study.
    pub study: Study,
    /// Solver of the study, or the first of the catalogue.
    pub solver: SolverChoice,
    /// Maximum number of evaluated points, if the study limits it.
    pub max_evaluations: Option<usize>,
    /// Text of the file, with the settings of the command line appended.
    pub source: Arc<Source>,
    /// Contents of the file, settings included, without comments and layout.
    pub content: serde_json::Value,
    /// Data files that were read: names as in the study, and digests of their bytes.
    pub data: Vec<(String, String)>,
    /// Digest of the program, if its own code computes values or builds the study ([`Catalogue::program`]).
    pub program: Option<String>,
    text: Arc<Text>,
}

impl StudyFile {
    /// Returns the diagnostic of an error that occurred when the study was run, with its location in the text.
    pub fn locate(&self, mistake: &StudyError) -> Diagnostic {
        match self.text.parse() {
            Ok(root) => self.text.settle(root.locate(mistake)),
            Err(_) => Diagnostic { help: mistake.help.clone(), ..Diagnostic::new(mistake.message.clone()) },
        }
    }
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

/// Largest number of cases of a grid.
const MOST_CASES: usize = 1000;

/// Reads the cases of a table: one, or one for every combination of the values in its `grid`.
fn read_cases(
    name: &str,
    node: &Node<'_>,
    models: &[(String, ModelBuilder)],
    files: &dyn Files,
) -> Result<Vec<CaseBuilder>, Diagnostic> {
    let entries = node.entries()?;
    let options: CaseOptions = node.only(CaseOptions::KEYS).read()?;
    let mut parameters = Vec::new();
    for (key, value) in entries {
        if !CaseOptions::KEYS.contains(&key.as_str()) {
            parameters.push((key, value.read::<Quantity>()?));
        }
    }
    let horizon = read_seconds(node, "horizon", options.horizon.as_ref())?;
    let interfaces = || models.iter().map(|(_, draft)| draft.model.interface());
    let longest = interfaces().filter_map(|interface| interface.horizon).reduce(f64::max);
    let until = horizon.or(longest);
    let mut inputs = Vec::new();
    for (name, section) in &options.inputs.0 {
        let known = interfaces().flat_map(|interface| &interface.inputs).find(|v| v.name == *name);
        let input = match known {
            Some(v) => Reader { unit: &v.unit, until, files }.read(section, &entry(node, "inputs", name))?,
            // Rejected when the study is built.
            None => Input::Constant(0.0),
        };
        inputs.push((name.clone(), input, None));
    }
    let one = CaseBuilder { name: name.to_owned(), parameters, inputs, horizon, ..CaseBuilder::default() };
    let mut cases = vec![one];
    for (parameter, values) in &options.grid.0 {
        let place = entry(node, "grid", parameter);
        if values.is_empty() {
            return Err(place.diagnostic(format!("`{parameter}` has no values")).with_help("list at least one"));
        }
        if cases[0].parameters.iter().any(|(known, _)| known == parameter) {
            let fact = format!("`{parameter}` is given twice, in the case and in its `grid`");
            return Err(place.key_diagnostic(fact).with_help("remove one of them"));
        }
        if cases.len() * values.len() > MOST_CASES {
            let fact = format!("the grid has more than {MOST_CASES} cases");
            return Err(place.key_diagnostic(fact).with_help("list fewer values"));
        }
        let with = |case: &CaseBuilder, value: &Quantity| {
            let unit = value.unit.as_ref().map(|unit| unit.to_string().replace(' ', "")).unwrap_or_default();
            let mut case = case.clone();
            case.name += &format!("-{parameter}={}{unit}", value.number);
            case.parameters.push((parameter.clone(), value.clone()));
            case
        };
        cases = cases.iter().flat_map(|case| values.iter().map(|value| with(case, value))).collect();
    }
    Ok(cases)
}

fn read_criterion(catalogue: &Catalogue, node: &Node<'_>) -> Result<CriterionBuilder, Diagnostic> {
    let (kind, options) = kind(node, CriterionCommon::KEYS, &catalogue.criteria, |k| k.name, "criterion")?;
    let common: CriterionCommon = node.only(CriterionCommon::KEYS).read()?;
    let criterion = options.read_with(&schema_once(kind.schema), kind.read)?;
    Ok(CriterionBuilder {
        criterion: Box::new(Located { inner: criterion, kind: kind.name }),
        model: common.model,
        cases: common.cases,
        usage: common.usage.unwrap_or(Usage::Minimise),
        demand: common.demand,
        good: common.good,
        bad: common.bad,
        weight: common.weight.unwrap_or(1.0),
        from: common.from,
        until: common.until,
        unit: common.unit.as_deref().map(|unit| read_unit(node, "unit", unit)).transpose()?,
    })
}

/// A criterion of a study file; its errors are located under the name of its kind.
struct Located {
    inner: Box<dyn mops_core::criterion::CriterionSpec>,
    kind: &'static str,
}

impl mops_core::criterion::CriterionSpec for Located {
    fn reads(&self) -> AnalysisKind {
        self.inner.reads()
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn mops_core::criterion::Criterion>, StudyError> {
        self.inner.bind(model).map_err(|mistake| mistake.within(self.kind))
    }

    fn needs_measurement(&self) -> Option<&str> {
        self.inner.needs_measurement()
    }

    fn names(&self) -> Vec<String> {
        self.inner.names()
    }

    fn bind_within(
        &self,
        model: &Interface,
        others: &[Other],
        window: [f64; 2],
    ) -> Result<Box<dyn mops_core::criterion::Criterion>, StudyError> {
        self.inner.bind_within(model, others, window).map_err(|mistake| mistake.within(self.kind))
    }

    fn reads_any(&self) -> bool {
        self.inner.reads_any()
    }

    fn bind_with(
        &self,
        model: &Interface,
        others: &[Other],
    ) -> Result<Box<dyn mops_core::criterion::Criterion>, StudyError> {
        self.inner.bind_with(model, others).map_err(|mistake| mistake.within(self.kind))
    }
}

fn read_solver(catalogue: &Catalogue, root: &Node<'_>) -> Result<(SolverChoice, Option<usize>), Diagnostic> {
    let default = || catalogue.solvers.first().expect("a catalogue has a solver").default_choice();
    let Some(node) = root.child("solver") else { return Ok((default(), None)) };
    let common: SolverCommon = node.only(SolverCommon::KEYS).read()?;
    if common.max_evaluations == Some(0) {
        let place = node.child("max-evaluations").expect("it was read");
        return Err(place
            .diagnostic("expected at least 1 evaluation, found 0".to_owned())
            .with_help("omit `max-evaluations` for the default"));
    }
    if node.entries()?.iter().all(|(key, _)| SolverCommon::KEYS.contains(&key.as_str())) {
        return Ok((default(), common.max_evaluations));
    }
    let (kind, options) = kind(&node, SolverCommon::KEYS, &catalogue.solvers, |k| k.name, "solver")?;
    Ok((options.read_with(&schema_once(kind.schema), kind.read)?, common.max_evaluations))
}
