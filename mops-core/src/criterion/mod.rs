//! Criteria: a number for every analysis, with its unit, sense and range.

mod demand;
mod in_unit;
mod loss;
mod samples;
mod window;

pub use loss::Loss;
pub use samples::Samples;

use std::sync::Arc;

use mops_language::Unit;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::case::Case;
use crate::error::StudyError;
use crate::model::{Analysis, AnalysisKind, Interface};

pub use demand::{Demand, Scaled};
pub(crate) use in_unit::InUnit;
use window::Window;

/// Options of a criterion as written in the study; names and quantities are not yet checked against a model.
pub trait CriterionSpec: Send + Sync {
    /// Returns the kind of analysis that the criterion reads. A study rejects models with another kind of analysis.
    fn reads(&self) -> AnalysisKind {
        AnalysisKind::Time
    }

    /// Returns true if the criterion reads both kinds of analysis.
    fn reads_any(&self) -> bool {
        false
    }

    /// Checks names and units against the interface of the model.
    ///
    /// # Errors
    /// Returns an error for an unknown signal, a quantity in a wrong unit or an invalid option. The error names the
    /// option.
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError>;

    /// Returns the name of the measured signal if the criterion compares with a measurement; it then applies only to
    /// cases that have one.
    fn needs_measurement(&self) -> Option<&str> {
        None
    }

    /// Returns the names in the criterion that may be those of other criteria of the study.
    fn names(&self) -> Vec<String> {
        Vec::new()
    }

    /// Checks names and units as [`CriterionSpec::bind`] does, with the criteria of the same model that
    /// [`CriterionSpec::names`] refers to.
    ///
    /// # Errors
    /// Returns an error as [`CriterionSpec::bind`] does.
    fn bind_with(&self, model: &Interface, _others: &[Other]) -> Result<Box<dyn Criterion>, StudyError> {
        self.bind(model)
    }

    /// Binds the criterion as [`CriterionSpec::bind_with`] does, restricted to a part of the simulation from one time
    /// to another, s. All its times then count from the first.
    ///
    /// # Errors
    /// Returns an error as [`CriterionSpec::bind`] does.
    fn bind_within(
        &self,
        model: &Interface,
        others: &[Other],
        [from, until]: [f64; 2],
    ) -> Result<Box<dyn Criterion>, StudyError> {
        Ok(Box::new(Window::new(self.bind_with(model, others)?, from, until)))
    }
}

/// Another criterion of the study, by its name.
pub type Other = (String, Arc<dyn Criterion>);

/// A criterion with checked names and units: a number for every analysis.
pub trait Criterion: Send + Sync {
    /// Returns the unit of the value.
    fn unit(&self) -> Unit;

    /// Returns the names of the signals that the criterion reads.
    fn signals(&self) -> Vec<String>;

    /// Checks that the case provides all data that the criterion needs, whatever the analysis. By default, every case
    /// does.
    ///
    /// # Errors
    /// Returns an error if data are missing: which, and how to provide them.
    fn suits(&self, _case: &Case) -> Result<(), StudyError> {
        Ok(())
    }

    /// Computes the value for one case.
    ///
    /// # Errors
    /// Returns one sentence if the criterion is not defined for the response.
    fn value(&self, case: &Case, analysis: &Analysis) -> Result<Value, String>;

    /// Computes the value for one case, with the parameters of the model in the order of [`Interface::parameters`]. By
    /// default, they do not matter.
    ///
    /// # Errors
    /// Returns an error as [`Criterion::value`] does.
    fn value_with(&self, case: &Case, analysis: &Analysis, _parameters: &[f64]) -> Result<Value, String> {
        self.value(case, analysis)
    }

    /// Returns which values are better; [`Sense::Open`] if the study decides.
    fn sense(&self) -> Sense {
        Sense::Open
    }

    /// Returns the smallest and the largest possible value, in the criterion's unit. A demand outside this range is an
    /// error.
    fn range(&self) -> [f64; 2] {
        [f64::NEG_INFINITY, f64::INFINITY]
    }

    /// Returns the assumption made for an absent option, as one sentence. The check of the study prints it as a note.
    fn assumption(&self) -> Option<String> {
        None
    }

    /// Returns the default demand. Without one, a criterion with a usage other than monitor needs a demand in the
    /// study.
    fn natural_demand(&self) -> Option<f64> {
        None
    }

    /// Computes the directional derivative of the value and of its residuals along a tangent of the analysis. The
    /// default is a central difference of two analyses moved by `± tangent.reach`, without simulation; by less where
    /// the order of jumps and corners would change.
    ///
    /// # Errors
    /// Returns one sentence if the criterion has no derivative for the response.
    fn slope(&self, case: &Case, tangent: &Tangent<'_>) -> Result<Value, String> {
        let Tangent { analysis, along, parameters, seed, reach, .. } = *tangent;
        let room = analysis.room(along);
        if room.is_nan() || room < LEAST_REACH {
            return Err("two instants coincide whose derivatives differ".into());
        }
        let reach = room.min(reach);
        let [high, low] = [reach, -reach].map(|distance| {
            let there: Vec<f64> = parameters.iter().zip(seed).map(|(value, slope)| value + distance * slope).collect();
            self.value_with(case, &analysis.moved(along, distance), &there)
        });
        let (high, low) = (high?, low?);
        let slope = |(high, low): (&f64, &f64)| (high - low) / (2.0 * reach);
        Ok(Value {
            number: slope((&high.number, &low.number)),
            residuals: high.residuals.iter().zip(&low.residuals).map(slope).collect(),
            ..Value::default()
        })
    }

    /// Returns the measured samples behind the residuals; their noise determines the standard errors of a calibration.
    /// The default `None` means: no residuals, or residuals of which only equal variance is assumed.
    fn samples(&self, _case: &Case) -> Option<Samples> {
        None
    }

    /// Returns input and output of the loop transfer function of a criterion that closes the loop by unity negative
    /// feedback.
    fn feedback_channel(&self) -> Option<[String; 2]> {
        None
    }

    /// Returns bounds to draw next to the signals, if any.
    fn marks(&self, _demand: &Demand, _analysis: &Analysis) -> Vec<Mark> {
        Vec::new()
    }
}

/// Smallest distance that [`Criterion::slope`] moves an analysis by, in the unit box: rounding of the values then
/// changes a difference by some 1e-9 of the value. Jumps and corners that change their order within it coincide.
const LEAST_REACH: f64 = 1e-7;

/// Which values of a criterion are better.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Sense {
    /// Smaller values: a demand is an upper limit.
    Less,
    /// Larger values: a demand is a lower limit.
    More,
    /// Values near a target: a single demand is ambiguous.
    Target,
    /// Not fixed by the kind, as for the value of a signal. A demand is an upper limit; a pair `good`, `bad` sets
    /// either direction.
    #[default]
    Open,
}

/// Point and direction of a derivative.
#[derive(Debug, Clone, Copy)]
pub struct Tangent<'a> {
    /// The analysis.
    pub analysis: &'a Analysis,
    /// Value of the criterion for this analysis.
    pub value: &'a Value,
    /// Derivative of the analysis.
    pub along: &'a Analysis,
    /// Parameters of the model.
    pub parameters: &'a [f64],
    /// Derivatives of the parameters.
    pub seed: &'a [f64],
    /// Distance along the derivative within which the derivative is to describe the criterion.
    pub reach: f64,
}

/// Smallest share by which the number of a missed criterion exceeds 1. The share is larger than the constraint
/// tolerance
/// [`crate::evaluation::FEASIBLE`], so that a missed criterion never meets its demand.
const LEAST_MISS: f64 = 1e-5;

/// The value of a criterion.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Value {
    /// The number, in the criterion's unit.
    pub number: f64,
    /// Terms before squaring if the number is a sum of squares: `number = sum r_i^2`; else empty.
    pub residuals: Vec<f64>,
    /// Remark on the number, such as `not settled at the end`.
    pub note: Option<&'static str>,
    /// Set if the condition of the criterion was never reached. `number` is then a measure of the distance, see
    /// [`Missed`].
    pub missed: Option<Missed>,
}

/// A condition of a criterion, such as settling, that was not reached in a simulation or at any frequency.
///
/// The criterion then has no value, and no demand is met. To guide solvers, the number is `h (1 + e/(e + b))`. `h` is
/// the time available to reach the condition, in the criterion's unit. For a criterion that is not a time, `h` is 1 and
/// the number a ratio, whatever the unit. `e` is the distance of the response from its target and `b` the tolerance.
/// [`crate::Demand::scaled`] defines the scaled value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Missed {
    /// Time available to reach the condition, in the criterion's unit; `None` if the criterion is not a time.
    pub horizon: Option<f64>,
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Self { number, ..Self::default() }
    }
}

impl Value {
    /// Returns a value with a remark.
    pub fn noted(number: f64, note: &'static str) -> Self {
        Self { number, note: Some(note), ..Self::default() }
    }

    /// Returns the value of a missed criterion. `horizon` is the available time in s if the criterion is a time.
    /// `distance` is the distance of the response from its target and `near` the tolerance, in the same unit.
    pub fn missed(horizon: Option<f64>, distance: f64, near: f64, note: &'static str) -> Self {
        let share = (distance / (distance + near)).clamp(LEAST_MISS, 1.0);
        let number = horizon.unwrap_or(1.0) * (1.0 + if share.is_nan() { 1.0 } else { share });
        Self { number, note: Some(note), missed: Some(Missed { horizon }), ..Self::default() }
    }

    /// Returns the derivative of [`Value::sum_of_squares`], given the residuals and their derivatives.
    pub fn slope_of_squares(residuals: &[f64], slopes: Vec<f64>) -> Self {
        let number = residuals.iter().zip(&slopes).map(|(r, slope)| 2.0 * r * slope).sum();
        Self { number, residuals: slopes, ..Self::default() }
    }

    /// Returns the sum of squares of `residuals`.
    pub fn sum_of_squares(residuals: Vec<f64>) -> Self {
        Self { number: residuals.iter().map(|r| r * r).sum(), residuals, ..Self::default() }
    }
}

/// Usage of a criterion in a study.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Usage {
    /// Part of the objective.
    #[default]
    Minimise,
    /// Constraint: the scaled value must be at most 1.
    Inequality,
    /// Constraint: the scaled value must be 1.
    Equality,
    /// Reported only.
    Monitor,
}

/// Bound of a signal used by a criterion, to be drawn in plots: a straight line over a range of times.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// The signal.
    pub signal: String,
    /// Short name of the bound.
    pub label: String,
    /// Start and end, s; the end may be infinite if both values are equal.
    pub times: [f64; 2],
    /// Values at the start and the end, in the signal's unit.
    pub values: [f64; 2],
    /// Side that the demand excludes; `None` if the bound excludes nothing by itself.
    pub excluded: Option<Side>,
}

/// Side of a bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Larger values.
    Above,
    /// Smaller values.
    Below,
}

impl Mark {
    /// Returns the part of the bound within a range of times, if any.
    #[must_use]
    pub fn within(self, from: f64, until: f64) -> Option<Self> {
        let ([t0, t1], [v0, v1]) = (self.times, self.values);
        let at = |t: f64| if v0 == v1 { v0 } else { v0 + (v1 - v0) * (t - t0) / (t1 - t0) };
        let times = [t0.max(from), t1.min(until)];
        (times[0] < times[1]).then(|| Self { times, values: times.map(at), ..self })
    }
}
