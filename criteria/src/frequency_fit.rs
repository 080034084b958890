//! Fit to a measured frequency response.

use mops_core::{
    Analysis, AnalysisKind, Case, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError, Value,
};
use mops_language::Unit;
use mops_linear::Complex;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{Channel, NOT_NEGATIVE};

/// Frequency-response fit `J = 1/N sum_i |G(j w_i)/G_i - 1|^2`, dimensionless: the mean square of the relative
/// deviation from a measured frequency response `G_i` at the angular frequencies `w_i`.
///
/// With `absolute = true`: `1/N sum_i |G(j w_i) - G_i|^2`, in the square of the unit of the output divided by that of
/// the input.
///
/// Deviations are complex, so that magnitude and phase both count: 1 % is equivalent to 0.01 rad. Their real and
/// imaginary parts, divided by `sqrt N`, are the residuals that least-squares solvers use. A relative deviation gives a
/// resonance and the response far below it the same weight, as a Bode plot does.
///
/// The response is measured in an experiment with `frequency` and `responses`. Less is better. Range: from 0 up;
/// relative noise of standard deviation s in magnitude and phase contributes about 2 s^2.
///
/// Source: R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd edition (2012), section
/// 9.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct FrequencyFit {
    /// Output that is compared with its measurement.
    pub signal: String,
    /// Input of the response; may be omitted if there is only one.
    pub input: Option<String>,
    /// If `true`, the responses themselves are compared instead of their ratio.
    #[serde(default)]
    pub absolute: bool,
}

impl CriterionOptions for FrequencyFit {
    const KIND: &'static str = "frequency-fit";
}

impl CriterionSpec for FrequencyFit {
    fn reads(&self) -> Option<AnalysisKind> {
        Some(AnalysisKind::Linear)
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let channel = Channel::bind(model, self.input.as_ref(), Some(&self.signal))
            .map_err(|m| if m.path == ["output"] { StudyError { path: vec!["signal".to_owned()], ..m } } else { m })?;
        Ok(Box::new(Bound { channel, signal: self.signal.clone(), absolute: self.absolute }))
    }

    fn needs_measurement(&self) -> Option<&str> {
        Some(&self.signal)
    }
}

struct Bound {
    channel: Channel,
    signal: String,
    absolute: bool,
}

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        if self.absolute { self.channel.unit.power(2, 0) } else { Unit::one() }
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

    #[allow(clippy::cast_precision_loss)]
    fn value(&self, case: &Case, analysis: &Analysis) -> Result<Value, String> {
        let data = case.experiment.as_ref().and_then(|experiment| experiment.response(&self.signal));
        let data = data.ok_or_else(|| format!("`{}` does not measure the response of `{}`", case.name, self.signal))?;
        let response = self.channel.system(analysis)?.response()?;
        let weight = 1.0 / (data.values.len() as f64).sqrt();
        let mut residuals = Vec::with_capacity(2 * data.values.len());
        for (&frequency, &[re, im]) in data.frequencies.iter().zip(&data.values) {
            let measured = Complex::new(re, im);
            let computed = response.scalar(frequency);
            let deviation = if self.absolute { computed - measured } else { computed / measured - 1.0 };
            if !deviation.is_finite() {
                return Err(format!("at {frequency} rad/s the computed or measured response is 0 or infinite"));
            }
            residuals.extend([deviation.re * weight, deviation.im * weight]);
        }
        Ok(Value::sum_of_squares(residuals))
    }
}
