//! Step size control: the initial step size, and the next step size from the error of the last step.
//!
//! Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition (1993), section
//! II.4 (step size, first step); E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd edition (1996),
//! section IV.2 (PI control).

use mops_language::Scalar;
use mops_math as math;
use mops_math::rough::{exp2, log2};

use super::Driven;
use super::integrable::Integrable;

/// PI control of the step size. The next step size is `0.9 error^-(1/q - 0.75 beta) last_error^beta` times the last. As
/// in the authors' DOPRI5 `beta = 0.04`; `q` is the order of the error in the step size. Errors are in units of the
/// tolerance.
#[derive(Debug, Clone)]
pub struct StepSizes {
    order: f64,
    /// Base-2 logarithm of the error of the previous step.
    last: f64,
}

const SAFETY: f64 = 0.9;
const BETA: f64 = 0.04;

/// Bounds on the ratio of a step size to the previous one.
const SHORTEST: f64 = 0.2;
const LONGEST: f64 = 10.0;

/// Ratio of step sizes after a step whose error was not finite.
const WITHOUT_ERROR: f64 = 0.1;

/// Lower bound on the error of the previous step, as `log2 1e-4`.
const SMALL: f64 = -13.287_712_379_549_449;

impl StepSizes {
    /// Starts the control with the order `q` of the error, as after a step with an error of at most 1e-4.
    pub fn new(order: f64) -> Self {
        Self { order, last: SMALL }
    }

    /// Returns the ratio of the next step size to that of the step accepted with this error: from 0.2 to 10, and at
    /// most 1 if the step was rejected before.
    #[inline]
    pub fn after_acceptance(&mut self, error: f64, was_rejected: bool) -> f64 {
        let error = log2(error.max(1e-10));
        let factor = SAFETY * exp2(BETA * self.last - (1.0 / self.order - 0.75 * BETA) * error);
        self.last = error.max(SMALL);
        factor.clamp(SHORTEST, if was_rejected { 1.0 } else { LONGEST })
    }

    /// Returns the ratio of the next step size to that of the step rejected with this error, which is above 1 or not
    /// finite: at least 0.2, or 0.1 if the error is not finite.
    pub fn after_rejection(&self, error: f64) -> f64 {
        if error.is_finite() { (SAFETY * exp2(-log2(error) / self.order)).max(SHORTEST) } else { WITHOUT_ERROR }
    }
}

/// Returns an initial step size (algorithm II.4.14 of the source). Times are in units of the interval, and each state
/// in units of its size, so that the guess depends on no unit. The size of a state that starts at 0 is its initial rate
/// times a thousandth of the interval.
pub(super) fn first_step<S: Scalar, P: Integrable<S> + ?Sized>(
    f: &Driven<'_, S, P>,
    (t, end): (f64, f64),
    x: &[S],
    slope: &[S],
    order: f64,
) -> f64 {
    let span = end - t;
    let size = |i: usize| match x[i].value().abs() {
        0.0 => 1e-3 * span * slope[i].value().abs(),
        size => size,
    };
    // Sizes divided by the default tolerance; the guess varies with the fifth root of the tolerance.
    let scaled = |v: &[S]| {
        let ratio = |i: usize| if size(i) > 0.0 { v[i].value() / (1e-8 * size(i)) } else { 0.0 };
        #[allow(clippy::cast_precision_loss)]
        let n = v.len().max(1) as f64;
        ((0..v.len()).map(|i| ratio(i) * ratio(i)).sum::<f64>() / n).sqrt()
    };
    let (mut stage, mut derivative) = (x.to_vec(), x.to_vec());
    let (d0, d1) = (scaled(x), span * scaled(slope));
    let h0 = if d0 < 1e-5 || d1 < 1e-5 { 1e-6 } else { (0.01 * d0 / d1).min(1.0) };
    for (i, s) in stage.iter_mut().enumerate() {
        *s = x[i] + slope[i] * (h0 * span);
    }
    f.derivative(t + h0 * span, &stage, &mut derivative);
    for (i, s) in stage.iter_mut().enumerate() {
        *s = derivative[i] - slope[i];
    }
    let d2 = span * scaled(&stage) / h0;
    let largest = d1.max(d2);
    let h1 = if largest <= 1e-15 { (h0 * 1e-3).max(1e-6) } else { math::powf(0.01 / largest, 1.0 / order) };
    let h = (100.0 * h0).min(h1).min(1.0) * span;
    if h.is_finite() && h > 0.0 { h } else { 1e-6 * span }
}
