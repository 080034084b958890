//! Deviation of a step response from that of a reference model.

use mops_core::{Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError, Value};
use mops_language::{Quantity, Unit};
use mops_math as math;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{NOT_NEGATIVE, Step, StepOptions, part, positive, second};

/// Deviation from a reference model, `sqrt(mean_t (y - y_ref)^2)` from the step to the end, in the unit of the signal,
/// with `y_ref = from + (target - from) h(t)`.
///
/// `h` is the unit step response of a reference model, with `t` counted from the step. The model is `1/(T s + 1)` for a
/// `time-constant` T. It is `w^2/(s^2 + 2 z w s + w^2)` for `frequency` w and `damping` z, z at least 0.05. The
/// response is evaluated in closed form, and the deviation is integrated along the curve.
///
/// Less is better. Range: from 0 up; 0 if the response equals that of the reference model.
///
/// Source: K. J. Astrom, B. Wittenmark, Adaptive Control (2nd ed., 1995), chapter 5 (model-reference systems); step
/// responses: K. J. Astrom, R. M. Murray, Feedback Systems (2nd ed., 2021), section 7.3.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct ModelTracking {
    /// Signal that is measured.
    pub signal: String,
    /// Value at which the reference model settles.
    pub target: Quantity,
    /// Value before the step; by default the signal's first value.
    pub from: Option<Quantity>,
    /// Time of the step, 0 s by default; earlier values are ignored.
    pub step_time: Option<Quantity>,
    /// Time constant of a first-order reference model.
    pub time_constant: Option<Quantity>,
    /// Undamped angular frequency of a second-order reference model, in rad/s; requires `damping`.
    pub frequency: Option<Quantity>,
    /// Damping ratio of a second-order reference model, at least 0.05; requires `frequency`.
    pub damping: Option<Quantity>,
}

/// Step to 1 without a reference model, to be completed.
impl Default for ModelTracking {
    fn default() -> Self {
        Self {
            signal: String::new(),
            target: 1.0.into(),
            from: None,
            step_time: None,
            time_constant: None,
            frequency: None,
            damping: None,
        }
    }
}

impl CriterionOptions for ModelTracking {
    const KIND: &'static str = "model-tracking";
}

impl CriterionSpec for ModelTracking {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let options = StepOptions {
            signal: &self.signal,
            target: Some(&self.target),
            from: self.from.as_ref(),
            step_time: self.step_time.as_ref(),
        };
        let step = options.bind(model)?;
        let time_constant = positive("time-constant", self.time_constant.as_ref(), &second())?;
        let frequency = positive("frequency", self.frequency.as_ref(), &Unit::known("rad/s"))?;
        let damping = positive("damping", self.damping.as_ref(), &Unit::one())?;
        let reference = match (time_constant, frequency, damping) {
            (Some(time_constant), None, None) => Reference::First { time_constant },
            (None, Some(_), Some(damping)) if damping < LEAST_DAMPING => {
                return Err(StudyError::new("damping", format!("a damping of {damping} is below {LEAST_DAMPING}"))
                    .with_help("choose a reference model with more damping"));
            }
            (None, Some(frequency), Some(damping)) => Reference::Second { frequency, damping },
            _ => {
                return Err(StudyError::here("the reference model is missing or ambiguous").with_help(
                    "give either `time-constant` (first order) or `frequency` and `damping` (second order)",
                ));
            }
        };
        let given = self.frequency.as_ref().filter(|q| q.unit.as_ref().is_some_and(Unit::counts_cycles));
        let note = given.zip(frequency).map(|(given, angular)| {
            let unit = given.unit.as_ref().map(ToString::to_string).unwrap_or_default();
            format!("`frequency` of {} {unit} is {angular} rad/s", given.number)
        });
        Ok(Box::new(Bound { step, reference, note }))
    }
}

/// Smallest damping ratio. Below it the reference model rings for over a hundred periods, which the quadrature must
/// resolve.
const LEAST_DAMPING: f64 = 0.05;

/// Reference model of gain 1.
enum Reference {
    First { time_constant: f64 },
    Second { frequency: f64, damping: f64 },
}

impl Reference {
    /// Returns the unit step response.
    fn response(&self, t: f64) -> f64 {
        match *self {
            Self::First { time_constant } => -math::exp_m1(-t / time_constant),
            Self::Second { frequency, damping } if damping < 1.0 => {
                let damped = frequency * (1.0 - damping * damping).sqrt();
                let (sin, cos) = math::sin_cos(damped * t);
                1.0 - math::exp(-damping * frequency * t) * (cos + damping * frequency / damped * sin)
            }
            Self::Second { frequency, damping } => {
                // exp(-z w t) (cosh(b t) + z w sinh(b t)/b) with b = w sqrt(z^2 - 1), in a form without overflow, and
                // without cancellation at b = 0.
                let b = frequency * (damping * damping - 1.0).sqrt();
                let slow = frequency / (damping + (damping * damping - 1.0).sqrt());
                let sinh_over_b = if b > 0.0 { -math::exp_m1(-2.0 * b * t) / (2.0 * b) } else { t };
                let cosh = 0.5 * (1.0 + math::exp(-2.0 * b * t));
                1.0 - math::exp(-slow * t) * (cosh + damping * frequency * sinh_over_b)
            }
        }
    }

    /// Returns the magnitudes of the fastest and the slowest mode (of the real part, if oscillating), 1/s.
    fn rates(&self) -> [f64; 2] {
        match *self {
            Self::First { time_constant } => [1.0 / time_constant; 2],
            Self::Second { frequency, damping } if damping < 1.0 => [frequency, damping * frequency],
            Self::Second { frequency, damping } => {
                let ratio = damping + (damping * damping - 1.0).sqrt();
                [frequency * ratio, frequency / ratio]
            }
        }
    }

    /// Returns times from the step to `length` between which the response is smooth enough for the quadrature of a
    /// trace.
    ///
    /// Steps of half a radian or half a time constant cause a relative error below 1e-12. Without oscillation the steps
    /// may grow with time, because only slow modes remain. After 40 slow time constants the response is at rest.
    fn knots(&self, length: f64) -> Vec<f64> {
        let [fast, slow] = self.rates();
        let growth = if matches!(self, Self::Second { damping, .. } if *damping < 1.0) { 0.0 } else { 0.2 };
        let mut knots = vec![0.0];
        let mut t = 0.0f64;
        while t < length && t < 40.0 / slow {
            t += (growth * t).max(0.5 / fast);
            if t < length {
                knots.push(t);
            }
        }
        knots.push(length);
        knots
    }
}

struct Bound {
    step: Step,
    reference: Reference,
    /// Note on a frequency in Hz and its value in rad/s.
    note: Option<String>,
}

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        self.step.unit.difference()
    }

    fn signals(&self) -> Vec<String> {
        vec![self.step.signal.clone()]
    }

    fn sense(&self) -> Sense {
        Sense::Less
    }

    fn assumption(&self) -> Option<String> {
        self.note.clone()
    }

    fn range(&self) -> [f64; 2] {
        NOT_NEGATIVE
    }

    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        let answer = self.step.answer(analysis)?;
        let (height, length) = (answer.height()?, answer.length());
        let knots: Vec<f64> = self.reference.knots(length).into_iter().map(|t| answer.time + t).collect();
        let square = part(&answer.trace, &knots, |_, y| y).integral(|t, y| {
            let reference = answer.from + height * self.reference.response(t - answer.time);
            (y - reference) * (y - reference)
        });
        Ok((square / length).sqrt().into())
    }
}
