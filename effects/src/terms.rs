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

/// Where [`radiated`] and [`emission`] come from.
pub(super) const RADIATION: &str = "F. P. Incropera, D. P. DeWitt, T. L. Bergman, A. S. Lavine, Fundamentals of Heat and \
                                    Mass Transfer, 6th edition (Wiley 2007), section 1.2.3";

/// How much heat a temperature radiates per difference of fourth powers.
pub(super) const fn emission() -> Strength {
    Strength::positive(
        "k",
        "emissivity times area times the Stefan-Boltzmann constant",
        Dimension::OUTPUT.over(Dimension::POSITION.power(4)),
    )
}

/// The heat that is radiated at a temperature to another one; `zero` makes them absolute.
pub(super) fn radiated<S: Scalar>(k: S, temperature: S, around: S, zero: S) -> S {
    let fourth = |x: S| x * x * x * x;
    k * (fourth(temperature + zero) - fourth(around + zero))
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

/// A damped contact.
#[derive(Clone, Copy)]
pub(super) struct Pressed<S> {
    /// How far it is pressed in, a length or an angle.
    pub into: S,
    /// How fast, times its damping over its stiffness: likewise.
    pub damped: S,
}

impl<S: Scalar> Pressed<S> {
    /// How far it is open: apart, or parting so fast that it would pull; negative while it pushes.
    pub fn gap(self) -> S {
        if self.damped.value() > 0.0 { -self.into } else { -self.into - self.damped }
    }

    /// What it pushes back with, over its stiffness. It jumps as contact is made; `closed` keeps to one law until a step ends.
    pub fn force(self, closed: Option<bool>) -> S {
        if closed.unwrap_or(self.gap().value() < 0.0) { self.into + self.damped } else { S::from(0.0) }
    }
}

/// `x^exponent` for `x > 0`, else 0.
pub(super) fn power<S: Scalar>(x: S, exponent: S) -> S {
    if x.value() > 0.0 { (exponent * x.ln()).exp() } else { S::from(0.0) }
}

/// When something begins in an experiment, s, tried at these shares of the record.
pub(super) const fn from(shares: &'static [f64]) -> Strength {
    Strength::shape("from", "start", Dimension::TIME, NOT_NEGATIVE, Trials::Moments(shares))
}

/// Shares of a record at which the step of a parameter is tried to begin.
pub(super) const STEPS_BEGIN: &[f64] = &[0.05, 0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85];

/// Shares of a record that it is tried to take.
pub(super) const STEPS_LAST: &[f64] = &[0.03, 0.12];

/// How long it lasts, s, tried likewise.
pub(super) const fn length(shares: &'static [f64]) -> Strength {
    Strength::shape("length", "duration", Dimension::TIME, NOT_NEGATIVE, Trials::Moments(shares))
}

/// A wave number along a position.
pub(super) const fn waves(trials: Trials) -> Strength {
    let about = "wave number, rad over the period; of an angle the periods in a turn";
    Strength::shape("n", about, Dimension::ONE.over(Dimension::POSITION), NOT_NEGATIVE, trials)
}

/// A stretch of time, of the strengths [`from`] and [`length`].
pub(super) struct Span<S> {
    from: S,
    length: S,
}

impl<S: Scalar> Span<S> {
    /// The stretch with these two strengths.
    pub fn new(strengths: &[S]) -> Self {
        Self { from: strengths[0], length: strengths[1] }
    }

    /// Its ends, s.
    pub fn breaks(&self) -> Vec<f64> {
        vec![self.from.value(), self.from.value() + self.length.value()]
    }

    /// The share of it that has passed at a time: 0 before, 1 after.
    pub fn passed(&self, t: f64) -> S {
        let since = -self.from + t;
        if since.value() <= 0.0 {
            S::from(0.0)
        } else if since.value() >= self.length.value() {
            S::from(1.0)
        } else {
            since / self.length
        }
    }

    /// From 0 to 1 along half a period of a cosine: `(1 - cos(pi (t - from)/length))/2`, 0 before, 1 after.
    pub fn risen(&self, t: f64) -> S {
        (-(self.passed(t) * PI).cos() + 1.0) * 0.5
    }
}
