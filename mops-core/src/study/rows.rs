//! Rows and jobs of a study: what is computed of which model in which case.

use std::sync::Arc;

use mops_language::Unit;

use crate::case::Case;
use crate::criterion::{Criterion, Demand, Scaled, Usage, Value};
use crate::evaluation::{FEASIBLE, Reading};
use crate::failure::caught;
use crate::model::Analysis;

/// A criterion-case pair.
#[derive(Clone)]
pub struct Row {
    /// Name of the criterion.
    pub name: String,
    /// Job whose analysis the criterion reads, as index into [`super::Study::jobs`].
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
    /// Index into [`super::Study::models`].
    pub model: usize,
    /// Index into [`super::Study::cases`].
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
        /// Index into [`super::Study::tuners`].
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
