//! Kinds that a study file can name, and the catalogue of them.

use std::any::Any;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use mops_language::Diagnostic;
use mops_language::files::{Files, Folder};
use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema};
use serde::de::DeserializeOwned;
use toml::de::ValueDeserializer;

use super::study::CatalogueStudy;
use crate::criterion::CriterionSpec;
use crate::effect::{Effect, Placement};
use crate::error::StudyError;
use crate::model::Model;
use crate::solver::Solver;
use crate::study::task::{Task, TaskOptions};

/// Function that adds effects to a model with ports. It is injected because core does not contain the simulation.
pub type Augment = fn(Arc<dyn Model>, Vec<Placement>) -> Result<Box<dyn Model>, StudyError>;

/// Options of a kind of model, as written in a study file; their documentation is the manual page of the kind.
pub trait ModelOptions: DeserializeOwned + JsonSchema {
    /// Name of the kind in study files.
    const KIND: &'static str;

    /// Checks the options and builds the model.
    ///
    /// # Errors
    /// Returns an error if options contradict each other; it names the key.
    fn build(self) -> Result<Box<dyn Model>, StudyError>;

    /// Builds the model as [`ModelOptions::build`] does, with data files that the options may name.
    ///
    /// # Errors
    /// Returns an error as [`ModelOptions::build`] does, or if a file cannot be read.
    fn build_with(self, _files: &dyn Files) -> Result<Box<dyn Model>, StudyError> {
        self.build()
    }
}

/// Options of a kind of criterion, as written in a study file; their documentation is the manual page of the kind.
pub trait CriterionOptions: CriterionSpec + DeserializeOwned + JsonSchema + 'static {
    /// Name of the kind in study files.
    const KIND: &'static str;
}

/// Options of a kind of solver, as written in a study file; their documentation is the manual page of the kind.
pub trait SolverOptions: DeserializeOwned + JsonSchema + Send + Sync + 'static {
    /// Name of the kind in study files.
    const KIND: &'static str;

    /// Builds a solver with these options.
    fn build(&self) -> Box<dyn Solver>;
}

pub(super) type Reader<T> = fn(ValueDeserializer<'_>) -> Result<T, toml::de::Error>;

/// A kind of model.
#[derive(Clone, Copy)]
pub struct ModelKind {
    /// Name in study files.
    pub name: &'static str,
    /// Returns the schema of the options, with their documentation.
    pub schema: fn() -> Schema,
    /// Reads options.
    pub read: ModelReader,
}

impl ModelKind {
    /// Creates the kind with options `O`.
    pub fn of<O: ModelOptions>() -> Self {
        Self {
            name: O::KIND,
            schema: schema_of::<O>,
            read: |value, files| O::deserialize(value).map(|o| o.build_with(files)),
        }
    }

    /// Returns a model of this kind with default options, if every option has a default.
    pub fn default_model(&self) -> Option<Box<dyn Model>> {
        let empty = ValueDeserializer::parse("{}").expect("an empty table is TOML");
        (self.read)(empty, &Folder::default()).ok()?.ok()
    }
}

/// Reader of the options of a model, with the data files that they may name.
pub(super) type ModelReader =
    fn(ValueDeserializer<'_>, &dyn Files) -> Result<Result<Box<dyn Model>, StudyError>, toml::de::Error>;

/// A kind of criterion.
#[derive(Clone, Copy)]
pub struct CriterionKind {
    /// Name in study files.
    pub name: &'static str,
    /// Returns the schema of the options, with their documentation.
    pub schema: fn() -> Schema,
    /// Reads options.
    pub read: Reader<Box<dyn CriterionSpec>>,
}

impl CriterionKind {
    /// Creates the kind with options `O`.
    pub fn of<O: CriterionOptions>() -> Self {
        Self {
            name: O::KIND,
            schema: schema_of::<O>,
            read: |value| O::deserialize(value).map(|options| Box::new(options) as Box<dyn CriterionSpec>),
        }
    }
}

/// A kind of solver.
#[derive(Clone, Copy)]
pub struct SolverKind {
    /// Name in study files.
    pub name: &'static str,
    /// Returns the schema of the options, with their documentation.
    pub schema: fn() -> Schema,
    /// Reads options.
    pub read: Reader<SolverChoice>,
}

impl SolverKind {
    /// Creates the kind with options `O`.
    pub fn of<O: SolverOptions>() -> Self {
        Self {
            name: O::KIND,
            schema: schema_of::<O>,
            read: |value| {
                let options = O::deserialize(value)?;
                Ok(SolverChoice { kind: O::KIND, make: Arc::new(move || options.build()) })
            },
        }
    }

    /// Returns a solver of this kind with default options.
    pub fn default_choice(&self) -> SolverChoice {
        let empty = ValueDeserializer::parse("{}").expect("an empty table is TOML");
        (self.read)(empty).expect("every option of a solver has a default")
    }
}

/// A kind of solver with its options: creates any number of solvers.
#[derive(Clone)]
pub struct SolverChoice {
    /// Name of the kind.
    pub kind: &'static str,
    make: Arc<dyn Fn() -> Box<dyn Solver> + Send + Sync>,
}

impl SolverChoice {
    /// Creates a new solver.
    pub fn make(&self) -> Box<dyn Solver> {
        (self.make)()
    }
}

/// A kind of task.
#[derive(Clone)]
pub struct TaskKind {
    /// Word in study files.
    pub name: &'static str,
    /// Table of study files with its options.
    pub table: &'static str,
    /// Purpose, in a sentence.
    pub about: &'static str,
    /// Example of the table, for a message that it is missing.
    pub example: &'static str,
    /// Returns the schema of the options, with their documentation.
    pub schema: fn() -> Schema,
    /// Reads options.
    pub read: Reader<Task>,
    /// Returns the task of a study without the table; `None` if it needs one.
    pub absent: fn() -> Option<Task>,
    /// What performs the task and shows its result, of a type that the core does not know.
    pub room: Arc<dyn Any + Send + Sync>,
}

impl TaskKind {
    /// Creates the kind with options `O`, performed by `room`.
    pub fn of<O: TaskOptions>(room: Arc<dyn Any + Send + Sync>) -> Self {
        Self {
            name: O::NAME,
            table: O::TABLE,
            about: O::ABOUT,
            example: O::EXAMPLE,
            schema: schema_of::<O>,
            read: |value| O::deserialize(value).map(Task::from),
            absent: || O::absent().map(Task::from),
            room,
        }
    }
}

/// All kinds and studies that a study file or a command can name.
#[derive(Clone, Default)]
pub struct Catalogue {
    /// Models.
    pub models: Vec<ModelKind>,
    /// Criteria.
    pub criteria: Vec<CriterionKind>,
    /// Solvers; the first is the default.
    pub solvers: Vec<SolverKind>,
    /// Tasks; the first is the default.
    pub tasks: Vec<TaskKind>,
    /// Candidate effects that a model may lack.
    pub effects: Vec<Arc<dyn Effect>>,
    /// Function that adds effects to a model; without it no study can name an effect.
    pub augment: Option<Augment>,
    /// Studies known by name.
    pub studies: Vec<CatalogueStudy>,
    /// Digest of the program, if its own code computes values or builds studies; part of the identity of runs.
    pub program: Option<String>,
    /// Folders whose files studies may read, besides those in their own folder.
    pub readable: Vec<PathBuf>,
}

impl Catalogue {
    /// Returns the source of the data files of a study in a folder.
    pub fn folder(&self, path: impl Into<PathBuf>) -> Folder {
        Folder::new(path).reading(self.readable.iter().cloned())
    }

    /// Adds a kind of model.
    #[must_use]
    pub fn with_model(mut self, kind: ModelKind) -> Self {
        self.models.push(kind);
        self
    }

    /// Adds a kind of criterion.
    #[must_use]
    pub fn with_criterion(mut self, kind: CriterionKind) -> Self {
        self.criteria.push(kind);
        self
    }

    /// Adds an effect, as in `catalogue.with_effect(effect::<EddyBrake>())`.
    #[must_use]
    pub fn with_effect(mut self, effect: Arc<dyn Effect>) -> Self {
        self.effects.push(effect);
        self
    }

    /// Adds a kind of solver.
    #[must_use]
    pub fn with_solver(mut self, kind: SolverKind) -> Self {
        self.solvers.push(kind);
        self
    }

    /// Adds a kind of task.
    #[must_use]
    pub fn with_task(mut self, kind: TaskKind) -> Self {
        self.tasks.push(kind);
        self
    }

    /// Adds a study: files in the program ([`crate::catalogue::Shipped`]), a folder
    /// ([`crate::catalogue::StudyFolder`]), or one built in Rust ([`crate::catalogue::BuiltStudy`]). Names must be
    /// unique: see [`Self::check_names`].
    #[must_use]
    pub fn with_study(mut self, study: impl Into<CatalogueStudy>) -> Self {
        self.studies.push(study.into());
        self
    }

    /// Checks that no two kinds of one sort and no two studies have the same name; the command line calls it before
    /// every command.
    ///
    /// # Errors
    /// Returns an error that names the two.
    pub fn check_names(&self) -> Result<(), Diagnostic> {
        let sorts: [(&str, Vec<&str>); 4] = [
            ("models", self.models.iter().map(|kind| kind.name).collect()),
            ("criteria", self.criteria.iter().map(|kind| kind.name).collect()),
            ("solvers", self.solvers.iter().map(|kind| kind.name).collect()),
            ("effects", self.effects.iter().map(|effect| effect.name()).collect()),
        ];
        for (sort, names) in sorts {
            if let Some([first, _]) = twice(&names) {
                return Err(Diagnostic::new(format!("the catalogue has two {sort} named `{}`", names[first]))
                    .with_help("rename one of them: a study selects a kind by its name"));
            }
        }
        let names: Vec<&str> = self.studies.iter().map(CatalogueStudy::name).collect();
        match twice(&names) {
            Some([first, second]) => {
                let [a, b] = [first, second].map(|index| self.studies[index].origin());
                Err(Diagnostic::new(format!("two studies are named `{}`: one {a}, one {b}", names[first])).with_help(
                    "rename one of them; the name of a study in a folder is `name` in [study] of its study.toml",
                ))
            }
            None => Ok(()),
        }
    }

    /// Returns the study of this name.
    pub fn study(&self, name: &str) -> Option<&CatalogueStudy> {
        self.studies.iter().find(|study| study.name() == name)
    }
}

/// Returns the indices of the first two equal names.
pub(super) fn twice(names: &[&str]) -> Option<[usize; 2]> {
    (0..names.len()).find_map(|i| Some([names[..i].iter().position(|name| *name == names[i])?, i]))
}

/// Returns the self-contained schema of a type.
pub fn schema_of<T: JsonSchema>() -> Schema {
    let mut settings = SchemaSettings::draft07();
    settings.inline_subschemas = true;
    settings.meta_schema = None;
    settings.into_generator().into_root_schema_for::<T>()
}

/// Returns a schema that is made once: a study has as many entries of one kind as it likes.
pub fn schema_once(of: fn() -> Schema) -> Arc<Schema> {
    static MADE: Mutex<BTreeMap<usize, Arc<Schema>>> = Mutex::new(BTreeMap::new());
    // Functions at one address are the same.
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    made.entry(of as usize).or_insert_with(|| Arc::new(of())).clone()
}
