//! A study: models, cases, tuners and criteria that belong together. Once built, it is valid.

mod build;
mod diagnosis;
mod distribution;
mod draft;
mod robustness;
mod scenarios;
mod tasks;
mod uncertain;

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use diagnosis::DiagnosisTask;
pub use distribution::{Distribution, Uncertain};
pub use draft::{CaseDraft, ChannelDraft, CriterionDraft, Draft, Free, Measured, ModelDraft, TunerDraft};
pub use robustness::{Chosen, MonteCarloTask, RobustTask, SensitivityMethod, UncertaintyTask, WorstCaseTask};
pub use scenarios::Scenario;
pub use tasks::{
    Axis, AxisDraft, ExcitationDraft, ExcitationQuestion, ExcitationTask, ParetoTask, Place, RegressionDraft,
    RegressionTask, SensitivityTask, SweepDraft, SweepTask, Tasks, TasksDraft,
};
pub use uncertain::{DistributionDraft, UncertainDraft};

use crate::cancellation::Cancellation;
use crate::case::Case;
use crate::criterion::{Criterion, Usage, Value};
use crate::demand::{Demand, Scaled};
use crate::evaluation::{FEASIBLE, Objective, Reading};
use crate::model::Model;
use crate::scalar::Scalar;
use crate::tuner::Tuner;
use crate::unit::Unit;

/// What a study is for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Task {
    /// Choose the tuners so that the worst scaled criterion is as small as it can be.
    #[default]
    Design,
    /// Estimate the tuners from measurements.
    Calibration,
    /// Tell how rich the inputs are.
    Excitation,
    /// Tell which tuners, or which combinations of them, the criteria or the data determine.
    Sensitivity,
    /// Draw the objective over one tuner or two.
    Sweep,
    /// Find the physical effect that the model lacks.
    Diagnosis,
    /// Find the largest scaled value of every criterion over a box of uncertain parameters.
    WorstCase,
    /// Tell how the criteria are distributed where parameters are uncertain.
    MonteCarlo,
    /// Find the designs that no other is better than in every criterion, and what one criterion costs in terms of another.
    Pareto,
}

/// A study whose every name, size, bound and unit has been checked.
#[derive(Clone)]
pub struct Study {
    /// Name.
    pub name: String,
    /// What it is for.
    pub task: Task,
    /// How scaled values are combined.
    pub objective: Objective,
    /// Seed of all random streams.
    pub seed: u64,
    /// Models, by name.
    pub models: Vec<(String, Arc<dyn Model>)>,
    /// Cases.
    pub cases: Vec<Case>,
    /// Tuners: of the study first, then of single cases.
    pub tuners: Vec<Tuner>,
    /// One row per criterion and case.
    pub rows: Vec<Row>,
    /// One job per model and case that has a row.
    pub jobs: Vec<JobPlan>,
    /// What tasks other than design and calibration are asked.
    pub tasks: Tasks,
    /// What deserves a word before a run, such as a first sample that looks wrong.
    pub warnings: Vec<String>,
    /// What was assumed where nothing was said, such as the unit of a column.
    pub notes: Vec<String>,
}

/// A criterion in one case.
#[derive(Clone)]
pub struct Row {
    /// Name of the criterion.
    pub name: String,
    /// The job whose analysis it reads, by index into [`Study::jobs`].
    pub job: usize,
    /// What computes the value.
    pub criterion: Arc<dyn Criterion>,
    /// What the study does with it.
    pub usage: Usage,
    /// How it is scaled.
    pub demand: Demand,
    /// Whether its scaled value counts with the other sign: where the worst of it is sought.
    pub reversed: bool,
    /// Weight of its scaled value in the objective.
    pub weight: f64,
    /// Unit of the value.
    pub unit: Unit,
}

impl Row {
    /// The value of its criterion, under its demand.
    pub fn reading(&self, value: &Value) -> Reading {
        let Scaled { value: scaled, slope } = self.demand.scaled(value);
        let sign = if self.reversed { -1.0 } else { 1.0 };
        let number = if value.missed.is_some() { f64::NAN } else { value.number };
        Reading { value: number, scaled: sign * scaled, slope: sign * slope, note: value.note }
    }

    /// Whether a scaled value meets what is asked for.
    pub fn is_met(&self, scaled: f64) -> bool {
        match self.usage {
            _ if self.demand == Demand::None => true,
            Usage::Equality => (scaled - 1.0).abs() <= FEASIBLE,
            _ => scaled <= 1.0 + FEASIBLE,
        }
    }
}

/// A model in a case: what to analyse, and where its parameters come from.
#[derive(Debug, Clone)]
pub struct JobPlan {
    /// Index into [`Study::models`].
    pub model: usize,
    /// Index into [`Study::cases`].
    pub case: usize,
    /// Where each of the model's parameters comes from.
    pub parameters: Vec<ParameterSource>,
    /// Signals that criteria read, as indices into the model's.
    pub signals: Vec<usize>,
    /// End of the simulation, s.
    pub horizon: f64,
}

/// Where the value of a model's parameter comes from.
#[derive(Debug, Clone, Copy)]
pub enum ParameterSource {
    /// A number of the study, in the parameter's unit; not a number where the model computes it.
    Constant(f64),
    /// A tuner, times a factor that turns its unit into the parameter's.
    Tuner {
        /// Index into [`Study::tuners`].
        tuner: usize,
        /// Factor.
        factor: f64,
    },
}

/// Sources are equal by the bits of their numbers: one that the model computes is equal to itself.
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
    /// The key of a row in reports: `case/criterion`.
    pub fn key(&self, row: &Row) -> String {
        format!("{}/{}", self.case_of(row).name, row.name)
    }

    /// The case of a row.
    pub fn case_of(&self, row: &Row) -> &Case {
        &self.cases[self.jobs[row.job].case]
    }

    /// Whether the same values of all tuners give the same values of all rows in both studies: they have the same models,
    /// criteria, cases and tuners. Demands, usages and weights may differ, and the roles of experiments.
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

    /// Lets a request to end reach the simulations of this study, and of every study that is made from it.
    pub fn cancelled_by(&mut self, cancellation: &Cancellation) {
        self.cases.iter_mut().for_each(|case| case.cancellation.clone_from(cancellation));
    }

    /// Start values of all tuners, ties applied.
    pub fn start(&self) -> Vec<f64> {
        let mut values: Vec<f64> = self.tuners.iter().map(|t| t.start).collect();
        self.apply_ties(&mut values);
        values
    }

    /// Sets every tied tuner from the ones it follows; expressions are evaluated in coherent units.
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

    /// Values of a job's parameters for given values of all tuners.
    pub fn parameters(&self, job: &JobPlan, tuners: &[f64]) -> Vec<f64> {
        job.parameters
            .iter()
            .map(|source| match *source {
                ParameterSource::Constant(value) => value,
                ParameterSource::Tuner { tuner, factor } => tuners[tuner] * factor,
            })
            .collect()
    }

    /// Derivative of a job's parameters for a given derivative of all tuners.
    pub fn parameter_slopes(&self, job: &JobPlan, tuners: &[f64]) -> Vec<f64> {
        let slope = |source: &ParameterSource| match *source {
            ParameterSource::Constant(_) => 0.0,
            ParameterSource::Tuner { tuner, factor } => tuners[tuner] * factor,
        };
        job.parameters.iter().map(slope).collect()
    }
}

/// Whether two lists are as long, and the same one by one.
fn same<T>(a: &[T], b: &[T], alike: impl Fn(&T, &T) -> bool) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| alike(a, b))
}
