//! Step size control: the initial step size, and the next step size from the error of the last step.
//!
//! Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition (1993), section
//! II.4 (step size, first step); E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd edition (1996),
//! section IV.2 (PI control).

use mops_language::Scalar;
use mops_math as math;

use super::Driven;
use super::integrable::Integrable;

/// PI control of the step size. The next step size is `0.9 error^-(1/q - 0.75 beta) last_error^beta` times the last. As
/// in the authors' DOPRI5 `beta = 0.04`; `q` is the order of the error in the step size.
pub(super) struct StepSizes {
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
    pub(super) fn new(order: f64) -> Self {
        Self { order, last: SMALL }
    }

    /// Returns the ratio of the next step size to that of the step accepted with this error.
    #[inline]
    pub(super) fn after_acceptance(&mut self, error: f64, was_rejected: bool) -> f64 {
        let error = log2(error.max(1e-10));
        let factor = SAFETY * exp2(BETA * self.last - (1.0 / self.order - 0.75 * BETA) * error);
        self.last = error.max(SMALL);
        factor.clamp(SHORTEST, if was_rejected { 1.0 } else { LONGEST })
    }

    /// Returns the ratio of the next step size to that of the step rejected with this error, which is above 1 or not
    /// finite.
    pub(super) fn after_rejection(&self, error: f64) -> f64 {
        if error.is_finite() { (SAFETY * exp2(-log2(error) / self.order)).max(SHORTEST) } else { WITHOUT_ERROR }
    }
}

/// Returns the base-2 logarithm of a normal positive number, to 0.0011. Adds to its exponent a cubic of its mantissa
/// that is exact at powers of 2. Step size control needs no higher accuracy and calls this at every step.
#[inline]
fn log2(x: f64) -> f64 {
    const MANTISSA: u64 = (1 << 52) - 1;
    let bits = x.to_bits();
    #[allow(clippy::cast_precision_loss)]
    let exponent = (bits >> 52) as f64 - 1023.0;
    let m = f64::from_bits(bits & MANTISSA | 1.0f64.to_bits()) - 1.0;
    exponent + m * (1.42 + m * (-0.5717 + m * 0.1517))
}

/// Returns 2 to the power `x`, to 0.012 %: 2 to the floor of `x`, times a cubic of the fractional part that is exact at
/// both ends. `x` lies within the exponent range of normal numbers.
#[inline]
fn exp2(x: f64) -> f64 {
    #[allow(clippy::cast_possible_truncation)]
    let biased = (x + 1023.0) as i32;
    let m = x + 1023.0 - f64::from(biased);
    let power = f64::from_bits(u64::from(biased.unsigned_abs()) << 52);
    power * (1.0 + m * (0.695 + m * (0.2275 + m * 0.0775)))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithm_and_power_have_their_stated_accuracy() {
        for k in -3000..3000 {
            let x = f64::from(k) / 97.0;
            let power = math::exp2(x);
            assert!((exp2(x) / power - 1.0).abs() < 1.2e-4, "{x}");
            assert!((log2(power) - x).abs() < 1.1e-3, "{x}");
        }
    }

    #[test]
    fn an_error_equal_to_the_tolerance_gives_the_safety_factor_and_a_rejection_stays_within_its_bounds() {
        let mut sizes = StepSizes { order: 5.0, last: 0.0 };
        assert_eq!(sizes.after_acceptance(1.0, false), SAFETY);
        assert_eq!(sizes.after_acceptance(0.0, false), LONGEST);
        assert_eq!(sizes.after_acceptance(1e-3, true), 1.0);
        assert!((sizes.after_rejection(32.0) - SAFETY / 2.0).abs() < 1e-12);
        assert_eq!((sizes.after_rejection(1e300), sizes.after_rejection(f64::NAN)), (SHORTEST, WITHOUT_ERROR));
    }
}
