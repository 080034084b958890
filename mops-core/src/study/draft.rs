//! Drafts: studies as written in a file or in Rust, not yet checked.

use mops_language::{Quantity, Unit};

use super::UncertainBuilder;
use crate::case::{Input, ResponseData, Role};
use crate::criterion::{CriterionSpec, Usage};
use crate::evaluation::Objective;
use crate::model::Model;
use crate::study::Scale;
use crate::study::task::Task;

/// A study as written, not yet checked. [`StudyBuilder::build`] checks it.
#[derive(Default)]
pub struct StudyBuilder {
    /// Name.
    pub name: String,
    /// Task, with its options.
    pub task: Task,
    /// Options of tasks that the study does not perform.
    pub options: Vec<Task>,
    /// Uncertain parameters, by name.
    pub uncertain: Vec<(String, UncertainBuilder)>,
    /// Combination of the scaled values into the objective; `None` for the default of the task.
    pub objective: Option<Objective>,
    /// Seed of all random streams.
    pub seed: u64,
    /// Models, by name.
    pub models: Vec<(String, ModelBuilder)>,
    /// Tuners, by name.
    pub tuners: Vec<(String, TunerBuilder)>,
    /// Cases and experiments.
    pub cases: Vec<CaseBuilder>,
    /// Standard deviations of the noise of sensors, by signal, for all channels without a noise of their own.
    pub sensors: Vec<(String, Quantity)>,
    /// Criteria, by name.
    pub criteria: Vec<(String, CriterionBuilder)>,
}

/// A model with values for some of its parameters.
pub struct ModelBuilder {
    /// The model.
    pub model: Box<dyn Model>,
    /// Parameter values, used unless a tuner or a case sets the parameter.
    pub parameters: Vec<(String, Quantity)>,
}

impl<M: Model + 'static> From<M> for ModelBuilder {
    fn from(model: M) -> Self {
        Self { model: Box::new(model), parameters: Vec::new() }
    }
}

/// A tuner as written, not yet checked.
#[derive(Debug, Clone, Default)]
pub struct TunerBuilder {
    /// Initial guess.
    pub start: Option<Quantity>,
    /// Smallest value.
    pub min: Option<Quantity>,
    /// Largest value.
    pub max: Option<Quantity>,
    /// Unit; `None` for the unit of the parameter.
    pub unit: Option<Unit>,
    /// Mapping of the range to [0, 1].
    pub scale: Scale,
    /// True for integers only.
    pub integer: bool,
    /// Allowed values, if the tuner is restricted to a list.
    pub values: Option<Vec<Quantity>>,
    /// True if the tuner keeps its initial guess.
    pub inactive: bool,
    /// Expression in other tuners that sets this tuner.
    pub tie: Option<String>,
    /// True for a separate tuner in every case.
    pub per_case: bool,
    /// Cases with a separate tuner, by name or pattern, while all others share one.
    pub separate_in: Vec<String>,
    /// Initial guesses of single cases, by name of the case.
    pub starts: Vec<(String, Quantity)>,
}

impl TunerBuilder {
    /// Creates a tuner with the initial guess `start` and the bounds `min` and `max`.
    pub fn new(start: f64, min: f64, max: f64) -> Self {
        Self { start: Some(start.into()), min: Some(min.into()), max: Some(max.into()), ..Self::default() }
    }

    /// Makes the mapping of the range logarithmic.
    #[must_use]
    pub fn log(mut self) -> Self {
        self.scale = Scale::Log;
        self
    }
}

/// A case or an experiment as written, not yet checked.
#[derive(Debug, Clone, Default)]
pub struct CaseBuilder {
    /// Name.
    pub name: String,
    /// Parameter values of the case.
    pub parameters: Vec<(String, Quantity)>,
    /// Inputs, with the unit of their values if one is given.
    pub inputs: Vec<(String, Input, Option<Unit>)>,
    /// End of the simulation, s.
    pub horizon: Option<f64>,
    /// Measurement; `Some` makes the case an experiment.
    pub measured: Option<Measured>,
    /// Warnings shown before a run.
    pub warnings: Vec<String>,
}

/// Data of an experiment.
#[derive(Debug, Clone, Default)]
pub struct Measured {
    /// Measured signals.
    pub channels: Vec<ChannelBuilder>,
    /// Measured frequency responses.
    pub responses: Vec<ResponseData>,
    /// Role of the experiment.
    pub role: Role,
    /// States whose initial values are estimated.
    pub free: Vec<Free>,
    /// Columns of the data files that the experiment does not use: one of them may be an input that is not given.
    pub unused: Vec<String>,
}

/// A state whose initial value is estimated; absent values are derived from the data.
#[derive(Debug, Clone, Default)]
pub struct Free {
    /// Name of the state.
    pub state: String,
    /// Initial guess.
    pub start: Option<Quantity>,
    /// Smallest value.
    pub min: Option<Quantity>,
    /// Largest value.
    pub max: Option<Quantity>,
}

/// A measured signal as written, not yet checked.
#[derive(Debug, Clone, Default)]
pub struct ChannelBuilder {
    /// Signal of the model.
    pub signal: String,
    /// Times, s, increasing.
    pub times: Vec<f64>,
    /// Samples; NaN for a missing sample.
    pub values: Vec<f64>,
    /// Unit of the samples; `None` for the unit of the signal.
    pub unit: Option<Unit>,
    /// Standard deviation of the noise.
    pub noise: Option<Quantity>,
    /// True for an angle counted within one turn, to which whole turns are added so that no step exceeds half a turn.
    /// False if steps of a turn are real; `None` if that is not known.
    pub unwrap: Option<bool>,
}

/// A criterion with its usage in the study.
pub struct CriterionBuilder {
    /// Criterion that computes the value.
    pub criterion: Box<dyn CriterionSpec>,
    /// Kind under whose name the options stand in a study file, for errors; `None` in Rust.
    pub kind: Option<&'static str>,
    /// Model that the criterion reads; `None` for the only one.
    pub model: Option<String>,
    /// Cases in which the criterion is evaluated; `None` for all.
    pub cases: Option<Vec<String>>,
    /// Usage of the criterion in the study.
    pub usage: Usage,
    /// Demand.
    pub demand: Option<Quantity>,
    /// Value that scales to 0.
    pub good: Option<Quantity>,
    /// Value that scales to 1.
    pub bad: Option<Quantity>,
    /// Weight in the objective.
    pub weight: f64,
    /// Start of the part of the simulation that the criterion reads; `None` for its start. All times of the criterion
    /// count from there.
    pub from: Option<Quantity>,
    /// End of the part of the simulation that the criterion reads; `None` for its end.
    pub until: Option<Quantity>,
    /// Unit of the values; `None` for that of `demand`, or else of `bad`, or else of the kind.
    pub unit: Option<Unit>,
}

impl CriterionBuilder {
    /// Creates a criterion to be minimised, with a demand in its own unit.
    pub fn minimise(criterion: impl CriterionSpec + 'static, demand: f64) -> Self {
        Self {
            criterion: Box::new(criterion),
            kind: None,
            model: None,
            cases: None,
            usage: Usage::Minimise,
            demand: Some(demand.into()),
            good: None,
            bad: None,
            weight: 1.0,
            from: None,
            until: None,
            unit: None,
        }
    }

    /// Sets another usage.
    #[must_use]
    pub fn used_as(mut self, usage: Usage) -> Self {
        self.usage = usage;
        self
    }
}
