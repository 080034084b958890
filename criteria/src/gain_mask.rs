//! Gain within a mask over frequency.

use mops_core::{AnalysisKind, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError, Value};
use mops_language::{Quantity, Unit};
use mops_linear::{Mask, Masked, StateSpace};
use mops_math as math;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{Channel, LinearCriterion, Values, number};

/// Largest ratio `max_w max(|G(j w)|/upper(w), lower(w)/|G(j w)|)`, dimensionless: 1 if the gain touches its mask.
///
/// Each bound is given by points `[frequency, gain]` and is a straight line between them in the Bode plot; beyond its
/// ends there is none. Frequencies without a unit are in rad/s. Gains are in the unit of the output divided by that of
/// the input, or in dB with `decibel = true`. At least one bound is needed. Example: `of = "sensitivity"`,
/// `upper = [["0.1 Hz", -40], ["1 Hz", -20], ["10 Hz", 6],
/// ["100 Hz", 6]]`, `decibel = true`.
///
/// The ratio is located by bounds of the response over all frequencies of the mask, with or without delay, not on a
/// grid. A sampled system is compared up to half of the sampling frequency; a bound that begins above it is refused.
///
/// Less is better. Range: from 0 up. The default demand is 1. There is no value if a loop is unstable.
///
/// Source: S. Skogestad, I. Postlethwaite, Multivariable Feedback Control, 2nd edition (2005), sections 2.7 and 2.8.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct GainMask {
    /// Input; may be omitted if there is only one.
    pub input: Option<String>,
    /// Output; may be omitted if there is only one.
    pub output: Option<String>,
    /// Transfer function that is bounded.
    pub of: Bounded,
    /// Points `[frequency, gain]` of the upper bound, by increasing frequency.
    pub upper: Vec<[Quantity; 2]>,
    /// Points `[frequency, gain]` of the lower bound, by increasing frequency.
    pub lower: Vec<[Quantity; 2]>,
    /// `true` for gains in dB.
    pub decibel: bool,
}

/// Transfer function that is bounded.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Bounded {
    /// The system itself.
    #[default]
    System,
    /// Sensitivity of the loop whose transfer function is the system.
    Sensitivity,
    /// Complementary sensitivity of the loop whose transfer function is the system.
    ComplementarySensitivity,
}

impl CriterionOptions for GainMask {
    const KIND: &'static str = "gain-mask";
}

impl CriterionSpec for GainMask {
    fn reads(&self) -> Option<AnalysisKind> {
        Some(AnalysisKind::Linear)
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?;
        let (channel, of, unit) = match self.of {
            Bounded::System => {
                let unit = channel.unit.clone();
                (channel, Masked::System, unit)
            }
            Bounded::Sensitivity => (channel.in_loop()?, Masked::Sensitivity, Unit::one()),
            Bounded::ComplementarySensitivity => (channel.in_loop()?, Masked::Complementary, Unit::one()),
        };
        let mut masks = Vec::new();
        for (key, points, is_upper) in [("upper", &self.upper, true), ("lower", &self.lower, false)] {
            if points.is_empty() {
                continue;
            }
            let point = |[frequency, gain]: &[Quantity; 2]| {
                let frequency = number(key, frequency, &Unit::known("rad/s"))?;
                let gain = match self.decibel {
                    true => math::powf(10.0, number(key, gain, &Unit::one())? / 20.0),
                    false => number(key, gain, &unit)?,
                };
                Ok::<_, StudyError>([frequency, gain])
            };
            let points = points.iter().map(point).collect::<Result<Vec<_>, _>>()?;
            masks.push(Mask::new(&points, is_upper).map_err(|why| StudyError::new(key, why))?);
        }
        if masks.is_empty() {
            return Err(StudyError::here("a mask needs at least one bound")
                .with_help("add `upper = [[frequency, gain], ...]` or `lower = [[frequency, gain], ...]`"));
        }
        let value = move |system: StateSpace| {
            let half = system.period.map(|period| std::f64::consts::PI / period);
            if let Some(half) = half
                && let Some(first) = masks.iter().map(Mask::first).find(|first| *first >= half)
            {
                return Err(format!(
                    "a bound begins at {first} rad/s, above half of the sampling frequency, {half} rad/s: nothing is compared"
                ));
            }
            let ratios = masks.iter().map(|mask| mask.largest_ratio(&system, of).map(|(ratio, _)| ratio));
            let ratios = ratios.collect::<Result<Vec<f64>, String>>()?;
            let largest = ratios.into_iter().fold(0.0, f64::max);
            Ok(match half.is_some_and(|half| masks.iter().any(|mask| mask.last() > half)) {
                true => Value::noted(largest, "not compared above half of the sampling frequency"),
                false => largest.into(),
            })
        };
        let values = Values::of(Unit::one(), Sense::Less).within(0.0, f64::INFINITY).demanding(1.0);
        Ok(LinearCriterion::boxed(channel, values, value))
    }
}
