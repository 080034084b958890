//! Fit to a measurement: the integral of the squared residual.

use mops_core::{
    Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError, Value, Variable,
    criterion::{Loss, Samples, Tangent},
};
use mops_language::Unit;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{NOT_NEGATIVE, compare, compared_slopes};

/// Fit `J = weight integral (y_simulated - y_measured)^2 dt` over the measured time, in signal^2 s.
///
/// The trapezoid rule on the sample times t_i gives `J = sum_i r_i^2`. The residuals
/// `r_i = sqrt(weight w_i) (y_simulated - y_measured)(t_i)` are those that least-squares solvers use.
/// `w_i = (t_(i+1) - t_(i-1))/2`, half an interval at both ends. The simulated curve is evaluated at these times.
/// Missing samples are omitted, so that a gap is one long interval.
///
/// Use one such criterion per signal to fit several signals together; `weight` balances them. The criterion is
/// evaluated in the experiments that measure the signal.
///
/// Less is better. Range: from 0 up; noise of standard deviation s contributes about weight s^2 times the measured
/// time.
///
/// Source: Greybox Identification and Control Design with Dymola (master thesis, Lund Institute of Technology), section
/// 4.5.1: there J is the sum over the arm's angle, with weight 2.5, and the pendulum's, with weight 1.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Fit {
    /// Signal that is compared with its measurement.
    pub signal: String,
    /// Factor on the squared residual, positive.
    #[serde(default = "one")]
    pub weight: f64,
}

fn one() -> f64 {
    1.0
}

impl Default for Fit {
    fn default() -> Self {
        Self { signal: String::new(), weight: one() }
    }
}

impl CriterionOptions for Fit {
    const KIND: &'static str = "fit";
}

impl CriterionSpec for Fit {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let signal = model.signal(&self.signal)?.clone();
        if !(self.weight.is_finite() && self.weight > 0.0) {
            return Err(StudyError::new("weight", format!("`weight` must be positive, not {}", self.weight)));
        }
        Ok(Box::new(Bound { signal, weight: self.weight }))
    }

    fn needs_measurement(&self) -> Option<&str> {
        Some(&self.signal)
    }
}

struct Bound {
    signal: Variable,
    weight: f64,
}

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        self.signal.unit.power(2, 1)
    }

    fn signals(&self) -> Vec<String> {
        vec![self.signal.name.clone()]
    }

    fn sense(&self) -> Sense {
        Sense::Less
    }

    fn range(&self) -> [f64; 2] {
        NOT_NEGATIVE
    }

    fn value(&self, case: &Case, analysis: &Analysis) -> Result<Value, String> {
        let comparison = compare(case, analysis, &self.signal.name)?;
        let times = &comparison.channel.times;
        if times.len() == 1 {
            return Err(format!(
                "the measurement of `{}` has a single sample, so that the integral is undefined",
                self.signal.name
            ));
        }
        let differences = comparison.differences.iter().enumerate();
        Ok(Value::sum_of_squares(differences.map(|(i, d)| self.root_weight(times, i) * d).collect()))
    }

    fn slope(&self, case: &Case, tangent: &Tangent<'_>) -> Result<Value, String> {
        let (channel, slopes) = compared_slopes(case, tangent.along, &self.signal.name)?;
        let slopes = slopes.iter().enumerate().map(|(i, d)| self.root_weight(&channel.times, i) * d).collect();
        Ok(Value::slope_of_squares(&tangent.value.residuals, slopes))
    }

    fn samples(&self, case: &Case) -> Option<Samples> {
        let channel = case.experiment.as_ref()?.channel(&self.signal.name)?;
        let weights = (0..channel.times.len()).map(|i| self.root_weight(&channel.times, i)).collect();
        Some(Samples { signal: self.signal.name.clone(), first: 0, weights, noise: channel.noise, loss: Loss::Squares })
    }
}

impl Bound {
    /// Returns `sqrt(weight w_i)`.
    fn root_weight(&self, times: &[f64], i: usize) -> f64 {
        let interval = 0.5 * (times[(i + 1).min(times.len() - 1)] - times[i.saturating_sub(1)]);
        (self.weight * interval).sqrt()
    }
}
