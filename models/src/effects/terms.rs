//! Terms that several effects are made of.

use std::f64::consts::{FRAC_PI_2, PI};

use mops_core::{Dimension, Scalar, Strength, Trials};

/// Bounds of a shape that may be any number.
pub(super) const ANY: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Bounds of a shape that is not negative.
pub(super) const NOT_NEGATIVE: [f64; 2] = [0.0, f64::INFINITY];

/// The phase of a sine, rad, tried from quarter to quarter of a turn; it may go a turn beyond, so that no fit stops where the
/// first turn ends.
pub(super) const fn phase() -> Strength {
    let quarters = Trials::Plain(&[-FRAC_PI_2, 0.0, FRAC_PI_2, PI]);
    Strength::shape("phase", "phase of the sine, rad", Dimension::ONE, [-3.0 * PI, 3.0 * PI], quarters)
}

/// The longest step within which the explicit method damps what decays in a time: at rest no error would tell it to keep to
/// that, and tangents would grow. Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd edition (1996),
/// section IV.2: to 3.3 of these times along the real axis, to 1 along the imaginary one.
pub(super) fn damped<S: Scalar>(time: S) -> f64 {
    if time.value() > 0.0 { 2.0 * time.value() } else { f64::INFINITY }
}

/// `x` in steps; a neutral 0 leaves it as it is. Its slope by `x` is that of the stairs seen from afar, 1: on each stair it would
/// be 0, and tell nothing.
pub(super) fn quantised<S: Scalar>(x: S, step: S) -> S {
    if step.value() > 0.0 { x + (step * (x.value() / step.value()).round() - x.value()) } else { x }
}

/// -1, 0 or 1.
pub(super) fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// `x`, not below `low` and not above `high`; where these cross, the middle between them.
pub(super) fn clamp<S: Scalar>(x: S, low: S, high: S) -> S {
    if low.value() > high.value() {
        (low + high) / 2.0
    } else if x.value() < low.value() {
        low
    } else if x.value() > high.value() {
        high
    } else {
        x
    }
}

/// `max(x, 0)`.
pub(super) fn above<S: Scalar>(x: S) -> S {
    if x.value() > 0.0 { x } else { S::from(0.0) }
}

/// `x^exponent` for `x > 0`, else 0.
pub(super) fn power<S: Scalar>(x: S, exponent: S) -> S {
    if x.value() > 0.0 { (exponent * x.ln()).exp() } else { S::from(0.0) }
}

/// `(1 - cos(pi (t - from)/length))/2` from `from` on for a `length`, 0 before, 1 later; all in s.
pub(super) fn risen<S: Scalar>(t: f64, from: S, length: S) -> S {
    let since = -from + t;
    if since.value() <= 0.0 {
        S::from(0.0)
    } else if since.value() >= length.value() {
        S::from(1.0)
    } else {
        (-(since / length * PI).cos() + 1.0) * 0.5
    }
}
