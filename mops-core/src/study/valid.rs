//! Study with all names, sizes, bounds and units checked, and what it asks of its task.

use std::any::Any;
use std::fmt;
use std::sync::Arc;

use mops_language::Scalar;
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize, Serializer};

use super::distribution::Uncertain;
use super::rows::{JobPlan, ParameterSource, Row};
use super::tuner::Tuner;
use crate::cancellation::Cancellation;
use crate::case::Case;
use crate::effect::Effect;
use crate::error::StudyError;
use crate::evaluation::Objective;
use crate::failure::{Failure, caught};
use crate::model::{Analysis, Job, Model};

/// A study with all names, sizes, bounds and units checked. Built by [`super::StudyBuilder::build`] or read from a
/// file; what may be changed afterwards has a method.
#[derive(Clone)]
pub struct Study {
    pub(crate) name: String,
    pub(crate) task: Task,
    pub(crate) options: Vec<Task>,
    pub(crate) uncertain: Vec<Uncertain>,
    pub(crate) objective: Objective,
    pub(crate) seed: u64,
    pub(crate) models: Vec<(String, Arc<dyn Model>)>,
    /// Values of parameters in the tables of the models.
    pub(crate) fixed: Vec<Vec<(String, f64)>>,
    pub(crate) cases: Vec<Case>,
    pub(crate) tuners: Vec<Tuner>,
    pub(crate) rows: Vec<Row>,
    pub(crate) jobs: Vec<JobPlan>,
    pub(crate) warnings: Vec<String>,
    pub(crate) notes: Vec<String>,
}

/// Access to the parts of a study.
impl Study {
    /// Returns the name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the task.
    pub fn task(&self) -> &Task {
        &self.task
    }

    /// Returns the options of a kind of task, if the study gives any; the study may perform another task.
    pub fn options<T: TaskSpec>(&self) -> Option<&T> {
        std::iter::once(&self.task).chain(&self.options).find_map(|task| task.options())
    }

    /// Returns the uncertain parameters.
    pub fn uncertain(&self) -> &[Uncertain] {
        &self.uncertain
    }

    /// Returns the combination of the scaled values into the objective.
    pub fn objective(&self) -> Objective {
        self.objective
    }

    /// Returns the seed of all random streams.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Returns the models with their names.
    pub fn models(&self) -> &[(String, Arc<dyn Model>)] {
        &self.models
    }

    /// Returns the cases: situations in which the criteria are evaluated.
    pub fn cases(&self) -> &[Case] {
        &self.cases
    }

    /// Returns the tuners: first those of the study, then those of single cases.
    pub fn tuners(&self) -> &[Tuner] {
        &self.tuners
    }

    /// Returns the rows: one per criterion and case.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Returns the jobs: one per model and case with at least one row.
    pub fn jobs(&self) -> &[JobPlan] {
        &self.jobs
    }

    /// Returns the warnings shown before a run, such as a suspicious first sample.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Returns the assumptions made where the study specifies nothing, such as the unit of a column.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Adds notes for the user.
    pub fn add_notes(&mut self, notes: impl IntoIterator<Item = String>) {
        self.notes.extend(notes);
    }

    /// Sets the seed of all random streams.
    pub fn set_seed(&mut self, seed: u64) {
        self.seed = seed;
    }

    /// Sets the initial value of a tuner, by index into [`Self::tuners`].
    pub fn set_start(&mut self, tuner: usize, value: f64) {
        self.tuners[tuner].start = value;
    }

    /// Fixes a tuner at its initial value, by index into [`Self::tuners`].
    pub fn fix(&mut self, tuner: usize) {
        self.tuners[tuner].active = false;
    }

    /// Returns the study without criteria, and so without simulations.
    #[must_use]
    pub fn without_criteria(self) -> Self {
        Self { rows: Vec::new(), jobs: Vec::new(), ..self }
    }

    /// Returns the study with these rows in place of its own.
    ///
    /// # Panics
    /// If a row reads a job that the study does not have.
    #[must_use]
    pub fn with_rows(self, rows: Vec<Row>) -> Self {
        assert!(rows.iter().all(|row| row.job < self.jobs.len()), "every row reads a job of the study");
        Self { rows, ..self }
    }

    /// Replaces the measured values of a channel, by indices of the case and of the channel in its experiment.
    ///
    /// # Panics
    /// If the case is no experiment, or the number of samples changes.
    pub fn set_samples(&mut self, case: usize, channel: usize, values: Vec<f64>) {
        let experiment = self.cases[case].experiment.as_mut().expect("the case is an experiment");
        let channel = &mut experiment.channels[channel];
        assert_eq!(channel.values.len(), values.len(), "every sample is replaced");
        channel.values = values;
    }

    /// Assembles a study without criteria from parts that nobody has checked, for tests.
    #[doc(hidden)]
    pub fn unchecked(
        task: Task,
        models: Vec<(String, Arc<dyn Model>)>,
        cases: Vec<Case>,
        tuners: Vec<Tuner>,
        jobs: Vec<JobPlan>,
    ) -> Self {
        Self {
            name: String::new(),
            task,
            options: Vec::new(),
            uncertain: Vec::new(),
            objective: Objective::default(),
            seed: 1,
            models,
            fixed: Vec::new(),
            cases,
            tuners,
            rows: Vec::new(),
            jobs,
            warnings: Vec::new(),
            notes: Vec::new(),
        }
    }
}

impl Study {
    /// Returns the key of a row in reports: `case/criterion`.
    pub fn key(&self, row: &Row) -> String {
        format!("{}/{}", self.case_of(row).name, row.name)
    }

    /// Returns the case of a row.
    pub fn case_of(&self, row: &Row) -> &Case {
        &self.cases[self.jobs[row.job].case]
    }

    /// Returns true if equal tuner values give equal row values in both studies. This requires equal models, criteria,
    /// cases and tuners; demands, usages, weights and roles of experiments may differ.
    pub fn measures_as(&self, other: &Self) -> bool {
        let same_case = |a: &Case, b: &Case| {
            (&a.name, &a.parameters, &a.inputs) == (&b.name, &b.parameters, &b.inputs)
                && (a.horizon, a.begins) == (b.horizon, b.begins)
                && match (&a.experiment, &b.experiment) {
                    (Some(a), Some(b)) => a.channels == b.channels && a.responses == b.responses,
                    (a, b) => a.is_none() && b.is_none(),
                }
        };
        let same_job = |a: &JobPlan, b: &JobPlan| {
            (a.model, a.case, &a.parameters, &a.signals, a.horizon)
                == (b.model, b.case, &b.parameters, &b.signals, b.horizon)
        };
        let same_row = |a: &Row, b: &Row| a.job == b.job && Arc::ptr_eq(&a.criterion, &b.criterion);
        let same_tuner = |a: &Tuner, b: &Tuner| {
            let range = |t: &Tuner| (t.bounds.map(f64::to_bits), t.scale, t.grid.clone(), t.active);
            (&a.name, a.case, a.tie.is_some(), range(a)) == (&b.name, b.case, b.tie.is_some(), range(b))
        };
        same(&self.models, &other.models, |(_, a), (_, b)| Arc::ptr_eq(a, b))
            && same(&self.cases, &other.cases, same_case)
            && same(&self.jobs, &other.jobs, same_job)
            && same(&self.rows, &other.rows, same_row)
            && same(&self.tuners, &other.tuners, same_tuner)
    }

    /// Analyses one case with a model, by index into [`Self::models`]; a panic of the model is a failure.
    pub(crate) fn analyse(&self, model: usize, job: &Job<'_>) -> Result<Analysis, Failure> {
        let (name, model) = &self.models[model];
        let panicked = |why| Err(Failure::Undefined(format!("model `{name}` {why}")));
        caught(|| model.analyse(job)).unwrap_or_else(panicked)
    }

    /// Connects the simulations of this study, and of every study derived from it, to a cancellation request.
    pub fn cancelled_by(&mut self, cancellation: &Cancellation) {
        self.cases.iter_mut().for_each(|case| case.cancellation.clone_from(cancellation));
    }

    /// Returns the initial guess of all tuners, ties applied.
    pub fn start(&self) -> Vec<f64> {
        let mut values: Vec<f64> = self.tuners.iter().map(|t| t.start).collect();
        self.apply_ties(&mut values);
        values
    }

    /// Sets every tied tuner from the tuners in its expression; expressions are evaluated in coherent units.
    pub fn apply_ties<S: Scalar>(&self, values: &mut [S]) {
        for (i, tuner) in self.tuners.iter().enumerate() {
            if let Some((expression, of)) = &tuner.tie {
                let coherent = |j: usize| {
                    let unit = &self.tuners[j].unit;
                    values[j] * unit.factor() + S::from(unit.zero())
                };
                let arguments: Vec<S> = of.iter().map(|&j| coherent(j)).collect();
                let value = expression.evaluate(&arguments);
                let unit = &tuner.unit;
                values[i] = (value - S::from(unit.zero())) / S::from(unit.factor());
            }
        }
    }

    /// Returns the parameter values of a job for given values of all tuners.
    pub fn parameters(&self, job: &JobPlan, tuners: &[f64]) -> Vec<f64> {
        job.parameters
            .iter()
            .map(|source| match *source {
                ParameterSource::Constant(value) => value,
                ParameterSource::Tuner { tuner, factor } => tuners[tuner] * factor,
            })
            .collect()
    }

    /// Returns the derivative of a job's parameters for a given derivative of all tuners.
    pub fn parameter_slopes(&self, job: &JobPlan, tuners: &[f64]) -> Vec<f64> {
        let slope = |source: &ParameterSource| match *source {
            ParameterSource::Constant(_) => 0.0,
            ParameterSource::Tuner { tuner, factor } => tuners[tuner] * factor,
        };
        job.parameters.iter().map(slope).collect()
    }
}

/// Returns true if two lists have equal length and pairwise equal elements.
pub(super) fn same<T>(a: &[T], b: &[T], alike: impl Fn(&T, &T) -> bool) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| alike(a, b))
}

/// Point at which a task is performed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Place {
    /// The optimum: the study is solved first.
    #[default]
    Optimum,
    /// The initial guess of the tuners; nothing is solved.
    Start,
}

/// Facts of a task with its options.
pub trait TaskSpec: Any + fmt::Debug + Send + Sync {
    /// Returns the point at which the task is performed, so that [`Place::Optimum`] needs a solver; `None` if it is
    /// performed at no point.
    fn at(&self) -> Option<Place>;

    /// Returns the objective of a search unless the study gives one; `is_measured`: the study has experiments. By
    /// default that of the study which a task examines: a calibration if there are experiments, else a design.
    fn objective(&self, is_measured: bool) -> Objective {
        if is_measured { Objective::Sum } else { Objective::Max }
    }

    /// Returns true if the task needs a criterion.
    fn needs_criteria(&self) -> bool {
        true
    }

    /// Returns true if the values of the tuners are the result, so that a criterion must count on data for calibration.
    fn chooses_tuners(&self) -> bool {
        false
    }

    /// Returns the signals to be simulated besides those that criteria read: model, case, signals.
    fn signals(&self, _study: &Study) -> Vec<(usize, usize, Vec<String>)> {
        Vec::new()
    }

    /// Returns a note for a study whose uncertain parameters the task ignores against expectation.
    fn ignores_uncertain(&self) -> Option<&'static str> {
        None
    }

    /// Checks the options. `is_performed`: the study performs this task; else it only has the options.
    ///
    /// # Errors
    /// The first error; it names the key, within the table of the task.
    fn check(&self, study: &Study, is_performed: bool) -> Result<(), StudyError>;

    /// Checks names of effects in the options; `effects` are those of the catalogue.
    ///
    /// # Errors
    /// The first unknown name.
    fn check_effects(&self, _effects: &[Arc<dyn Effect>]) -> Result<(), StudyError> {
        Ok(())
    }
}

/// Options of a kind of task, as written in its table of a study file; their documentation is the page of the table.
pub trait TaskOptions: TaskSpec + DeserializeOwned + JsonSchema {
    /// Word of the task in study files.
    const NAME: &'static str;

    /// Name of the table with the options.
    const TABLE: &'static str = Self::NAME;

    /// Purpose of the task, in a sentence.
    const ABOUT: &'static str;

    /// Example of the table, for a message that it is missing.
    const EXAMPLE: &'static str = "";

    /// Returns the options of a study without the table; `None` if the task needs it.
    fn absent() -> Option<Self>;
}

/// Task of a study, with its options.
#[derive(Debug, Clone)]
pub struct Task {
    name: &'static str,
    spec: Arc<dyn TaskSpec>,
}

impl<T: TaskOptions> From<T> for Task {
    fn from(task: T) -> Self {
        Self { name: T::NAME, spec: Arc::new(task) }
    }
}

impl std::ops::Deref for Task {
    type Target = dyn TaskSpec;

    fn deref(&self) -> &Self::Target {
        &*self.spec
    }
}

impl Task {
    /// Returns the word of the task in study files.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Returns the options if they are those of the kind `T`.
    pub fn options<T: TaskSpec>(&self) -> Option<&T> {
        let any: &dyn Any = &*self.spec;
        any.downcast_ref()
    }

    /// Returns true if the task is of the kind `T`.
    pub fn is<T: TaskSpec>(&self) -> bool {
        self.options::<T>().is_some()
    }
}

impl Serialize for Task {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name)
    }
}
