//! What a criterion is, and how a value is scaled by its demand.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::case::Case;
use crate::model::{Analysis, Variable};
use crate::study::Mistake;
use crate::unit::Unit;

/// A criterion as the study gives it: names and quantities not yet checked against a model.
pub trait CriterionSpec: Send + Sync {
    /// Checks names and units against the signals of the model it reads.
    ///
    /// # Errors
    /// An unknown signal, a quantity in a wrong unit, an impossible option; the mistake names the option.
    fn bind(&self, signals: &[Variable]) -> Result<Box<dyn Criterion>, Mistake>;

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

    /// The value for one case.
    ///
    /// # Errors
    /// A response for which the criterion is not defined: one sentence.
    fn value(&self, case: &Case, analysis: &Analysis) -> Result<Value, String>;
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

/// Value at which a criterion's scaled value is 0, and value at which it is 1.
///
/// A demand `d > 0` is `good = 0`, `bad = d`: the scaled value is `c/d`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Demand {
    /// Scaled value 0.
    pub good: f64,
    /// Scaled value 1.
    pub bad: f64,
}

impl Demand {
    /// `(c - good)/(bad - good)`, either way round.
    pub fn scale(&self, value: f64) -> f64 {
        if self.good == 0.0 { value / self.bad } else { (value - self.good) / (self.bad - self.good) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_demand_scales_by_division_and_a_pair_either_way_round() {
        assert_eq!(Demand { good: 0.0, bad: 0.1 }.scale(0.05), 0.05 / 0.1);
        let margin = Demand { good: 12.0, bad: 6.0 };
        assert_eq!((margin.scale(12.0), margin.scale(6.0), margin.scale(3.0)), (0.0, 1.0, 1.5));
    }
}
