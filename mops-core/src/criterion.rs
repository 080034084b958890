//! What a criterion is, and how a value is scaled by its demand.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::case::Case;
use crate::model::{Analysis, AnalysisKind, Interface};
use crate::samples::Samples;
use crate::study::Mistake;
use crate::unit::Unit;

/// A criterion as the study gives it: names and quantities not yet checked against a model.
pub trait CriterionSpec: Send + Sync {
    /// What it reads; a study refuses it for a model that gives something else.
    fn reads(&self) -> AnalysisKind {
        AnalysisKind::Time
    }

    /// Checks names and units against what the model it reads offers.
    ///
    /// # Errors
    /// An unknown signal, a quantity in a wrong unit, an impossible option; the mistake names the option.
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, Mistake>;

    /// Whether it compares with a measurement, so that it applies only to cases that have one.
    fn needs_measurement(&self) -> Option<&str> {
        None
    }
}

/// A criterion whose names and units have been checked: a number for every analysis.
pub trait Criterion: Send + Sync {
    /// Unit of the value.
    fn unit(&self) -> Unit;

    /// Names of the signals it reads.
    fn signals(&self) -> Vec<String>;

    /// Whether the case has what the value needs, whatever the analysis; every case has where a criterion says nothing.
    ///
    /// # Errors
    /// The case lacks something: what, and the way out.
    fn suits(&self, _case: &Case) -> Result<(), Mistake> {
        Ok(())
    }

    /// The value for one case.
    ///
    /// # Errors
    /// A response for which the criterion is not defined: one sentence.
    fn value(&self, case: &Case, analysis: &Analysis) -> Result<Value, String>;

    /// The demand where the study gives none; without one, a criterion that is more than watched needs its own.
    fn natural_demand(&self) -> Option<f64> {
        None
    }

    /// The derivative of the value, residuals included, along a tangent of the analysis. Where a criterion says nothing
    /// else it is the central difference of two analyses moved by `tangent.reach` to both sides, without simulation.
    ///
    /// # Errors
    /// A response for which the criterion has no derivative: one sentence.
    fn slope(&self, case: &Case, tangent: &Tangent<'_>) -> Result<Value, String> {
        let Tangent { analysis, along, reach, .. } = *tangent;
        let [high, low] = [reach, -reach].map(|distance| self.value(case, &analysis.moved(along, distance)));
        let (high, low) = (high?, low?);
        let slope = |(high, low): (&f64, &f64)| (high - low) / (2.0 * reach);
        Ok(Value {
            number: slope((&high.number, &low.number)),
            residuals: high.residuals.iter().zip(&low.residuals).map(slope).collect(),
            note: None,
        })
    }

    /// The samples that its residuals compare with: the standard errors of a calibration rest on their noise. `None`, the
    /// default, where there are no residuals, or where nothing is known of them but that they have one variance.
    fn samples(&self, _case: &Case) -> Option<Samples> {
        None
    }

    /// Levels to draw beside the signals, where the criterion has some; `limit` is the value that scales to 1.
    fn marks(&self, _limit: Option<f64>, _analysis: &Analysis) -> Vec<Mark> {
        Vec::new()
    }
}

/// Where a derivative is taken, and along what.
#[derive(Debug, Clone, Copy)]
pub struct Tangent<'a> {
    /// The analysis.
    pub analysis: &'a Analysis,
    /// The value of the criterion for it.
    pub value: &'a Value,
    /// Derivative of the analysis.
    pub along: &'a Analysis,
    /// Distance along the derivative within which the slope is to describe the criterion.
    pub reach: f64,
}

/// The value of a criterion.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Value {
    /// The number, in the criterion's unit.
    pub number: f64,
    /// Where the number is a sum of squares, its terms before squaring: `number = sum r_i^2`.
    pub residuals: Vec<f64>,
    /// What a reader must know of the number, such as `not settled at the end`.
    pub note: Option<&'static str>,
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Self { number, ..Self::default() }
    }
}

impl Value {
    /// A number with something to know about it.
    pub fn noted(number: f64, note: &'static str) -> Self {
        Self { number, residuals: Vec::new(), note: Some(note) }
    }

    /// The derivative of [`Value::sum_of_squares`], given the residuals and their derivatives.
    pub fn slope_of_squares(residuals: &[f64], slopes: Vec<f64>) -> Self {
        let number = residuals.iter().zip(&slopes).map(|(r, slope)| 2.0 * r * slope).sum();
        Self { number, residuals: slopes, note: None }
    }

    /// The sum of squares of `residuals`.
    pub fn sum_of_squares(residuals: Vec<f64>) -> Self {
        Self { number: residuals.iter().map(|r| r * r).sum(), residuals, note: None }
    }
}

/// What a study does with a criterion.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Usage {
    /// It enters the objective.
    #[default]
    Minimise,
    /// Its scaled value must be at most 1.
    Inequality,
    /// Its scaled value must be 1.
    Equality,
    /// It is only reported.
    Monitor,
}

/// How a value is scaled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Demand {
    /// Divided by this positive number.
    Value(f64),
    /// 0 at `good`, 1 at `bad`, either way round.
    Pair {
        /// Scaled value 0.
        good: f64,
        /// Scaled value 1.
        bad: f64,
    },
    /// Nothing was asked for: the criterion is only watched, and its scaled value is NaN.
    None,
}

impl Demand {
    /// The scaled value: `c/d`, or `(c - good)/(bad - good)`.
    pub fn scale(&self, value: f64) -> f64 {
        match *self {
            Self::Value(demand) => value / demand,
            Self::Pair { good, bad } => (value - good) / (bad - good),
            Self::None => f64::NAN,
        }
    }

    /// The value that scales to 1.
    pub fn limit(&self) -> Option<f64> {
        match *self {
            Self::Value(demand) => Some(demand),
            Self::Pair { bad, .. } => Some(bad),
            Self::None => None,
        }
    }
}

/// A level of a signal that a criterion looks at, to be drawn in plots.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// The signal.
    pub signal: String,
    /// What the level is, in a word or two.
    pub label: String,
    /// Where it lies, in the signal's unit.
    pub level: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_demand_scales_by_division_and_a_pair_either_way_round() {
        assert_eq!(Demand::Value(0.1).scale(0.05), 0.05 / 0.1);
        let margin = Demand::Pair { good: 12.0, bad: 6.0 };
        assert_eq!((margin.scale(12.0), margin.scale(6.0), margin.scale(3.0)), (0.0, 1.0, 1.5));
    }
}
