//! A study as it is written down, in a file or in Rust: nothing checked yet.

use super::{Study, Task, TasksDraft};
use crate::catalogue::Catalogue;
use crate::criterion::{CriterionSpec, Usage};
use crate::evaluation::Objective;
use crate::experiment::{Input, ResponseData, Role};
use crate::mistake::Mistake;
use crate::model::Model;
use crate::placement::EffectDraft;
use crate::tuner::Scale;
use crate::unit::{Quantity, Unit};

/// A study as it is written down. [`Draft::build`] checks it.
#[derive(Default)]
pub struct Draft {
    /// Name.
    pub name: String,
    /// What it is for.
    pub task: Task,
    /// How scaled values are combined; by the task where absent.
    pub objective: Option<Objective>,
    /// Seed of all random streams.
    pub seed: u64,
    /// Models, by name.
    pub models: Vec<(String, ModelDraft)>,
    /// Tuners, by name.
    pub tuners: Vec<(String, TunerDraft)>,
    /// Cases and experiments.
    pub cases: Vec<CaseDraft>,
    /// Criteria, by name.
    pub criteria: Vec<(String, CriterionDraft)>,
    /// What tasks other than design and calibration are asked.
    pub tasks: TasksDraft,
}

impl Draft {
    /// Checks every name, size, bound and unit.
    ///
    /// # Errors
    /// The first mistake, with the keys that lead to it.
    pub fn build(self) -> Result<Study, Mistake> {
        super::build::build(self)
    }
}

/// A model with values for some of its parameters.
pub struct ModelDraft {
    /// The model.
    pub model: Box<dyn Model>,
    /// Values that hold unless a tuner or a case sets the parameter.
    pub parameters: Vec<(String, Quantity)>,
}

impl ModelDraft {
    /// Adds effects at places of the model; each strength is a parameter `name.strength`.
    ///
    /// # Errors
    /// As [`Catalogue::with_effects`].
    pub fn with_effects(self, catalogue: &Catalogue, effects: &[EffectDraft]) -> Result<Self, Mistake> {
        Ok(Self { model: catalogue.with_effects(self.model.into(), effects)?, ..self })
    }
}

impl<M: Model + 'static> From<M> for ModelDraft {
    fn from(model: M) -> Self {
        Self { model: Box::new(model), parameters: Vec::new() }
    }
}

/// A tuner as it is written down.
#[derive(Debug, Clone, Default)]
pub struct TunerDraft {
    /// Value at the start.
    pub start: Option<Quantity>,
    /// Smallest value.
    pub min: Option<Quantity>,
    /// Largest value.
    pub max: Option<Quantity>,
    /// Unit; the parameter's where absent.
    pub unit: Option<Unit>,
    /// How the range is spread.
    pub scale: Scale,
    /// Whole numbers only.
    pub integer: bool,
    /// These values only.
    pub values: Option<Vec<Quantity>>,
    /// Kept at its start value.
    pub inactive: bool,
    /// Follows from other tuners.
    pub tie: Option<String>,
    /// One of its own for every case.
    pub per_case: bool,
    /// Values at the start in cases that begin elsewhere, by name.
    pub starts: Vec<(String, Quantity)>,
}

impl TunerDraft {
    /// A tuner that starts at `start` and stays between `min` and `max`.
    pub fn new(start: f64, min: f64, max: f64) -> Self {
        Self { start: Some(start.into()), min: Some(min.into()), max: Some(max.into()), ..Self::default() }
    }

    /// Spreads the range evenly in the logarithm.
    #[must_use]
    pub fn log(mut self) -> Self {
        self.scale = Scale::Log;
        self
    }
}

/// A case or an experiment as it is written down.
#[derive(Debug, Clone, Default)]
pub struct CaseDraft {
    /// Name.
    pub name: String,
    /// Parameter values that hold in it.
    pub parameters: Vec<(String, Quantity)>,
    /// Inputs, with the unit of their values where one is given.
    pub inputs: Vec<(String, Input, Option<Unit>)>,
    /// End of the simulation, s.
    pub horizon: Option<f64>,
    /// What was measured; this makes it an experiment.
    pub measured: Option<Measured>,
    /// What deserves a word before a run.
    pub warnings: Vec<String>,
}

/// What an experiment brings.
#[derive(Debug, Clone, Default)]
pub struct Measured {
    /// Measured signals.
    pub channels: Vec<ChannelDraft>,
    /// Measured frequency responses.
    pub responses: Vec<ResponseData>,
    /// What it is used for.
    pub role: Role,
    /// States whose start values are estimated.
    pub free: Vec<Free>,
}

/// A state whose start value is estimated; what is absent is read off the data.
#[derive(Debug, Clone, Default)]
pub struct Free {
    /// Name of the state.
    pub state: String,
    /// First guess.
    pub start: Option<Quantity>,
    /// Smallest value.
    pub min: Option<Quantity>,
    /// Largest value.
    pub max: Option<Quantity>,
}

/// A measured signal as it is written down.
#[derive(Debug, Clone, Default)]
pub struct ChannelDraft {
    /// The model's signal.
    pub signal: String,
    /// Times, s, increasing.
    pub times: Vec<f64>,
    /// Samples; NaN is a gap.
    pub values: Vec<f64>,
    /// Unit of the samples; the signal's where absent.
    pub unit: Option<Unit>,
    /// Standard deviation of the noise.
    pub noise: Option<Quantity>,
}

/// A criterion with what the study does with it.
pub struct CriterionDraft {
    /// What computes the value.
    pub criterion: Box<dyn CriterionSpec>,
    /// The model it reads; the only one where absent.
    pub model: Option<String>,
    /// The cases it is evaluated in; all where absent.
    pub cases: Option<Vec<String>>,
    /// What the study does with it.
    pub usage: Usage,
    /// The value to reach.
    pub demand: Option<Quantity>,
    /// Value that scales to 0.
    pub good: Option<Quantity>,
    /// Value that scales to 1.
    pub bad: Option<Quantity>,
    /// Weight in the objective.
    pub weight: f64,
}

impl CriterionDraft {
    /// A criterion to be minimised, with a demand in its own unit.
    pub fn minimise(criterion: impl CriterionSpec + 'static, demand: f64) -> Self {
        Self {
            criterion: Box::new(criterion),
            model: None,
            cases: None,
            usage: Usage::Minimise,
            demand: Some(demand.into()),
            good: None,
            bad: None,
            weight: 1.0,
        }
    }

    /// Gives it another usage.
    #[must_use]
    pub fn used_as(mut self, usage: Usage) -> Self {
        self.usage = usage;
        self
    }
}
