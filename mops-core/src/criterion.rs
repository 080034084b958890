//! What a criterion is: a number for every analysis, with its unit, its sense and its range.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::case::Case;
use crate::mistake::Mistake;
use crate::model::{Analysis, AnalysisKind, Interface};
use crate::samples::Samples;
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

    /// Which values are better; the study says it where a criterion does not.
    fn sense(&self) -> Sense {
        Sense::Open
    }

    /// The smallest and the largest value it can have, in its unit; a demand beyond them is a mistake.
    fn range(&self) -> [f64; 2] {
        [f64::NEG_INFINITY, f64::INFINITY]
    }

    /// What it assumes where an option is absent, in one sentence, to be noted when the study is checked.
    fn assumption(&self) -> Option<String> {
        None
    }

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
            ..Value::default()
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

/// Which values of a criterion are better.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Sense {
    /// Smaller ones: a demand is the largest that is accepted.
    Less,
    /// Larger ones: a demand is the smallest that is accepted.
    More,
    /// Those near a target: a demand alone is ambiguous.
    Target,
    /// The kind does not say, as for the value of a signal: a demand is the largest that is accepted, and a pair `good`, `bad`
    /// says it either way.
    #[default]
    Open,
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

/// Share by which a criterion that is missed exceeds 1 at least: above what rounding may take a constraint beyond its demand
/// ([`crate::FEASIBLE`]), so that nothing that was missed is ever met.
const LEAST_MISS: f64 = 1e-5;

/// The value of a criterion.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Value {
    /// The number, in the criterion's unit.
    pub number: f64,
    /// Where the number is a sum of squares, its terms before squaring: `number = sum r_i^2`.
    pub residuals: Vec<f64>,
    /// What a reader must know of the number, such as `not settled at the end`.
    pub note: Option<&'static str>,
    /// What the criterion asks for was never reached. `number` then only tells how far it was, see [`Missed`].
    pub missed: Option<Missed>,
}

/// What a criterion asks for, such as that a response settles, was not reached in a simulation or at any frequency.
///
/// The criterion has no value then, and no demand is met. So that solvers still see which way is better, it has the number
/// `h (1 + e/(e + b))`: `h` is the time in which it could have been reached (1 where the criterion is no time), `e` the distance
/// of the response from where it should be and `b` what counts as near. [`crate::Demand::scaled`] says how it counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Missed {
    /// The time in which it could have been reached, s; `None` where the criterion is no time.
    pub horizon: Option<f64>,
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Self { number, ..Self::default() }
    }
}

impl Value {
    /// A number with something to know about it.
    pub fn noted(number: f64, note: &'static str) -> Self {
        Self { number, note: Some(note), ..Self::default() }
    }

    /// Nothing was reached: within `horizon` in s, where the criterion is a time; `distance` is that of the response from where
    /// it should be, `near` what counts as near, in the same unit.
    pub fn missed(horizon: Option<f64>, distance: f64, near: f64, note: &'static str) -> Self {
        let share = (distance / (distance + near)).clamp(LEAST_MISS, 1.0);
        let number = horizon.unwrap_or(1.0) * (1.0 + if share.is_nan() { 1.0 } else { share });
        Self { number, note: Some(note), missed: Some(Missed { horizon }), ..Self::default() }
    }

    /// The derivative of [`Value::sum_of_squares`], given the residuals and their derivatives.
    pub fn slope_of_squares(residuals: &[f64], slopes: Vec<f64>) -> Self {
        let number = residuals.iter().zip(&slopes).map(|(r, slope)| 2.0 * r * slope).sum();
        Self { number, residuals: slopes, ..Self::default() }
    }

    /// The sum of squares of `residuals`.
    pub fn sum_of_squares(residuals: Vec<f64>) -> Self {
        Self { number: residuals.iter().map(|r| r * r).sum(), residuals, ..Self::default() }
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
