//! Studies: models, cases, tuners and criteria that belong together. A [`Study`] is valid once built.

mod build;
mod distribution;
mod draft;
mod moved;
mod scenarios;
pub mod task;
mod tuner;
mod uncertain;
mod wildcard;

pub use crate::error::StudyError;
pub use tuner::{Grid, Scale, Tuner};
pub use wildcard::matches_pattern;

use std::sync::Arc;

pub use distribution::{Distribution, Uncertain};
pub use draft::{
    CaseBuilder, ChannelBuilder, CriterionBuilder, Free, Measured, ModelBuilder, StudyBuilder, TunerBuilder,
};
pub use scenarios::Scenario;
pub use uncertain::{DistributionBuilder, UncertainBuilder};

use mops_language::{Scalar, Unit};

use crate::cancellation::Cancellation;
use crate::case::Case;
use crate::criterion::{Criterion, Demand, Scaled, Usage, Value};
use crate::evaluation::{FEASIBLE, Objective, Reading};
use crate::failure::{Failure, caught};
use crate::model::{Analysis, Job, Model};
use crate::study::task::{DesignTask, Place, Task, TaskSpec};

/// A study with all names, sizes, bounds and units checked. Built by [`StudyBuilder::build`] or read from a file; what
/// may be changed afterwards has a method.
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

    /// Returns true if the task rests on a design for the given cases, although the study has the table of a design
    /// against worst cases.
    pub fn leaves_worst_cases_out(&self) -> bool {
        let is_robust = self.options::<DesignTask>().is_some_and(|design| design.robust.is_some());
        is_robust && !self.task.is::<DesignTask>() && self.task.at() == Some(Place::Optimum)
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

    /// Assembles a study from parts that nobody has checked, for tests.
    #[doc(hidden)]
    pub fn from_parts(parts: StudyParts) -> Self {
        let StudyParts {
            name,
            task,
            options,
            uncertain,
            objective,
            seed,
            models,
            fixed,
            cases,
            tuners,
            rows,
            jobs,
            warnings,
            notes,
        } = parts;
        Self {
            name,
            task,
            options,
            uncertain,
            objective,
            seed,
            models,
            fixed,
            cases,
            tuners,
            rows,
            jobs,
            warnings,
            notes,
        }
    }

    /// Returns the parts, to change what has no method, for tests.
    #[doc(hidden)]
    pub fn into_parts(self) -> StudyParts {
        let Self {
            name,
            task,
            options,
            uncertain,
            objective,
            seed,
            models,
            fixed,
            cases,
            tuners,
            rows,
            jobs,
            warnings,
            notes,
        } = self;
        StudyParts {
            name,
            task,
            options,
            uncertain,
            objective,
            seed,
            models,
            fixed,
            cases,
            tuners,
            rows,
            jobs,
            warnings,
            notes,
        }
    }
}

/// Parts of [`Study::from_parts`]; their meaning is that of the methods of [`Study`].
#[doc(hidden)]
#[allow(missing_docs)]
#[derive(Clone, Default)]
pub struct StudyParts {
    pub name: String,
    pub task: Task,
    pub options: Vec<Task>,
    pub uncertain: Vec<Uncertain>,
    pub objective: Objective,
    pub seed: u64,
    pub models: Vec<(String, Arc<dyn Model>)>,
    pub fixed: Vec<Vec<(String, f64)>>,
    pub cases: Vec<Case>,
    pub tuners: Vec<Tuner>,
    pub rows: Vec<Row>,
    pub jobs: Vec<JobPlan>,
    pub warnings: Vec<String>,
    pub notes: Vec<String>,
}

/// A criterion-case pair.
#[derive(Clone)]
pub struct Row {
    /// Name of the criterion.
    pub name: String,
    /// Job whose analysis the criterion reads, as index into [`Study::jobs`].
    pub job: usize,
    /// Criterion that computes the value.
    pub criterion: Arc<dyn Criterion>,
    /// Usage of the criterion in the study.
    pub usage: Usage,
    /// Demand that scales the value.
    pub demand: Demand,
    /// True if the scaled value counts with reversed sign, as in a search for its worst case.
    pub reversed: bool,
    /// Weight of the scaled value in the objective.
    pub weight: f64,
    /// Unit of the value.
    pub unit: Unit,
}

impl Row {
    /// Computes the value for one case; a panic of the criterion is an error.
    ///
    /// # Errors
    /// If the criterion is undefined for the analysis.
    pub fn value(&self, case: &Case, analysis: &Analysis, parameters: &[f64]) -> Result<Value, String> {
        caught(|| self.criterion.value_with(case, analysis, parameters)).unwrap_or_else(Err)
    }

    /// Returns the reading of a value: the value scaled by the demand.
    pub fn reading(&self, value: &Value) -> Reading {
        let Scaled { value: scaled, slope } = self.demand.scaled(value);
        let sign = if self.reversed { -1.0 } else { 1.0 };
        let number = if value.missed.is_some() { f64::NAN } else { value.number };
        Reading { value: number, scaled: sign * scaled, slope: sign * slope, note: value.note }
    }

    /// Returns true if a scaled value meets the demand, false if it is NaN; `None` without a demand.
    pub fn is_met(&self, scaled: f64) -> Option<bool> {
        match self.usage {
            _ if self.demand == Demand::None => None,
            Usage::Equality => Some((scaled - 1.0).abs() <= FEASIBLE),
            _ => Some(scaled <= 1.0 + FEASIBLE),
        }
    }
}

/// A model-case pair: the analysis to run, and the sources of its parameters.
#[derive(Debug, Clone)]
pub struct JobPlan {
    /// Index into [`Study::models`].
    pub model: usize,
    /// Index into [`Study::cases`].
    pub case: usize,
    /// Source of each parameter of the model.
    pub parameters: Vec<ParameterSource>,
    /// Signals that criteria read, as indices into the signals of the model.
    pub signals: Vec<usize>,
    /// End of the simulation, s.
    pub horizon: f64,
}

/// Source of the value of a model parameter.
#[derive(Debug, Clone, Copy)]
pub enum ParameterSource {
    /// A constant of the study, in the unit of the parameter; NaN if the model computes the value.
    Constant(f64),
    /// A tuner, multiplied by a factor that converts its unit to the unit of the parameter.
    Tuner {
        /// Index into [`Study::tuners`].
        tuner: usize,
        /// Conversion factor between the units.
        factor: f64,
    },
}

/// Equality compares the bits of the numbers: a NaN, for a value computed by the model, equals itself.
impl PartialEq for ParameterSource {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Constant(a), Self::Constant(b)) => a.to_bits() == b.to_bits(),
            (Self::Tuner { tuner: a, factor: p }, Self::Tuner { tuner: b, factor: q }) => (a, p) == (b, q),
            _ => false,
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
fn same<T>(a: &[T], b: &[T], alike: impl Fn(&T, &T) -> bool) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| alike(a, b))
}

/// Returns the fact that a share, a ratio or a logarithm of a parameter on a temperature scale has no meaning.
fn ratio_of_temperatures(name: &str, unit: &Unit) -> String {
    format!("`{name}` is a temperature in {unit}, of which a share or a ratio depends on the zero of the scale")
}
