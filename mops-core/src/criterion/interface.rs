//! Interface of criteria.

use mops_language::Unit;

use super::demand::Demand;
use super::samples::Samples;
use super::value::{Sense, Value};
use crate::case::Case;
use crate::error::StudyError;
use crate::model::Analysis;

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

    /// Computes the value for one case, with the parameters of the model in the order of
    /// [`crate::Interface::parameters`]. By default, they do not matter.
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
pub(super) const LEAST_REACH: f64 = 1e-7;

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
