//! Fit to a measurement, in units of its noise level.

use mops_core::{
    Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError, Value,
    case::Channel,
    criterion::{Loss, Samples, Tangent},
};
use mops_language::{Quantity, Unit};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{NOT_NEGATIVE, compare, compared_slopes, positive};

/// Normalised error `mean_i ((y_simulated - y_measured)(t_i)/noise)^2`, dimensionless: 1 if the residual is pure noise.
///
/// `noise` is the noise level (standard deviation) of the measurement: the option, or else that of the channel in the
/// experiment. The value is the sum of squares of the residuals
/// `r_i = (y_simulated - y_measured)(t_i)/(noise sqrt(N))`, N samples, that least-squares solvers use.
///
/// With a robust `loss`, the squares are replaced by Huber's loss or that of Student's distribution with 4 degrees of
/// freedom; pure normal noise then has the value 0.93 or 0.97. Standard errors and profiles are those of M-estimates,
/// and the bootstrap resamples the residuals with their outliers.
///
/// The criterion is evaluated in the experiments that measure the signal. Less is better. Range: from 0 up. A value
/// well below 1 means that the noise level is too high or that the model fits the noise. A value well above 1 means
/// that the model lacks an effect. The default demand is 1.
///
/// Source: P. R. Bevington, D. K. Robinson, Data Reduction and Error Analysis for the Physical Sciences (3rd ed.,
/// 2003), chapter 11 (reduced chi-square, here without the number of estimated parameters). Robust losses: P. J. Huber,
/// E. M. Ronchetti, Robust Statistics (2nd ed., 2009), sections 4.5, 7.3.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct NormalisedError {
    /// Signal that is compared with its measurement.
    pub signal: String,
    /// Noise level (standard deviation), in the unit of the signal; by default that of the channel.
    pub noise: Option<Quantity>,
    /// How much a deviation counts. `squares` (default) is right for normal noise. `huber` grows linearly beyond 1.345
    /// standard deviations and `student` with the logarithm, so that outliers have little or no influence.
    #[serde(default)]
    pub loss: Loss,
}

impl CriterionOptions for NormalisedError {
    const KIND: &'static str = "normalised-error";
}

impl CriterionSpec for NormalisedError {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let signal = model.signal(&self.signal)?;
        let noise = positive("noise", self.noise.as_ref(), &signal.unit)?;
        Ok(Box::new(Bound { signal: signal.name.clone(), noise, loss: self.loss }))
    }

    fn needs_measurement(&self) -> Option<&str> {
        Some(&self.signal)
    }
}

/// Mean square below which the residual is not plausible noise: a tenth of the noise level.
///
/// With 20 samples or more it occurs by chance in less than one of 1e9 records, including ten estimated parameters.
const FAR_BELOW: f64 = 0.01;
const SAMPLES: usize = 20;

struct Bound {
    signal: String,
    noise: Option<f64>,
    loss: Loss,
}

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        Unit::one()
    }

    /// Returns 1: the residual is pure noise.
    fn natural_demand(&self) -> Option<f64> {
        Some(1.0)
    }

    fn signals(&self) -> Vec<String> {
        vec![self.signal.clone()]
    }

    fn sense(&self) -> Sense {
        Sense::Less
    }

    fn range(&self) -> [f64; 2] {
        NOT_NEGATIVE
    }

    fn suits(&self, case: &Case) -> Result<(), StudyError> {
        let channel = case.experiment.as_ref().and_then(|experiment| experiment.channel(&self.signal));
        match channel {
            Some(channel) if self.noise.or(channel.noise).is_none() => Err(StudyError::here(format!(
                "the noise level of `{}` in `{}` is unknown",
                self.signal, case.name
            ))
            .with_help(
                "set `noise` here or in the channel of the experiment; `mops data` estimates it, `fit` does not need it",
            )),
            _ => Ok(()),
        }
    }

    fn value(&self, case: &Case, analysis: &Analysis) -> Result<Value, String> {
        let comparison = compare(case, analysis, &self.signal)?;
        let [noise, share] = self.noise_and_share(comparison.channel)?;
        let residual = |d: &f64| self.loss.residual(d / noise)[0] * share;
        let value = Value::sum_of_squares(comparison.differences.iter().map(residual).collect());
        let is_far_below = value.number < FAR_BELOW && value.residuals.len() >= SAMPLES;
        let note = is_far_below.then_some("far below the noise: check the unit of `noise`");
        Ok(Value { note, ..value })
    }

    fn slope(&self, case: &Case, tangent: &Tangent<'_>) -> Result<Value, String> {
        let (channel, slopes) = compared_slopes(case, tangent.along, &self.signal)?;
        let [noise, share] = self.noise_and_share(channel)?;
        let slopes = if self.loss == Loss::Squares {
            slopes.iter().map(|d| d / noise * share).collect()
        } else {
            let differences = compare(case, tangent.analysis, &self.signal)?.differences;
            let slope = |(d, slope): (&f64, &f64)| self.loss.residual(d / noise)[1] * slope / noise * share;
            differences.iter().zip(&slopes).map(slope).collect()
        };
        Ok(Value::slope_of_squares(&tangent.value.residuals, slopes))
    }

    fn samples(&self, case: &Case) -> Option<Samples> {
        let channel = case.experiment.as_ref()?.channel(&self.signal)?;
        let [noise, share] = self.noise_and_share(channel).ok()?;
        let weights = vec![share / noise; channel.times.len()];
        let (signal, loss) = (self.signal.clone(), self.loss);
        Some(Samples { signal, first: 0, weights, noise: Some(noise), loss })
    }
}

impl Bound {
    /// Returns the noise level and `1/sqrt(N)`.
    #[allow(clippy::cast_precision_loss)]
    fn noise_and_share(&self, channel: &Channel) -> Result<[f64; 2], String> {
        let noise =
            self.noise.or(channel.noise).ok_or_else(|| format!("the noise level of `{}` is unknown", self.signal))?;
        Ok([noise, 1.0 / (channel.times.len() as f64).sqrt()])
    }
}
