//! Common terms of effects.

use std::f64::consts::{FRAC_PI_2, PI};

use mops_core::effect::{Dimension, EffectParameter, InitialGrid, ParameterKind};
use mops_language::Scalar;

/// Bounds of a parameter that may be any number.
pub(super) const ANY: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Bounds of a parameter that is not negative.
pub(super) const NOT_NEGATIVE: [f64; 2] = [0.0, f64::INFINITY];

/// Quantities of a store of matter: level, volume, mass, pressure.
pub(super) const CONTENTS: &[&str] = &["m", "m^3", "kg", "Pa"];

/// Quantities of a store of heat or matter.
pub(super) const STORED: &[&str] = &["K", "m", "m^3", "kg", "Pa"];

/// Returns the parameter for the phase of a sine, rad, with initial values at every quarter turn. The bounds extend one
/// turn further, so that no fit stops at the end of the first turn.
pub(super) const fn phase() -> EffectParameter {
    let quarters = InitialGrid::Plain(&[-FRAC_PI_2, 0.0, FRAC_PI_2, PI]);
    EffectParameter::shape("phase", "phase of the sine, rad", Dimension::ONE, [-3.0 * PI, 3.0 * PI], quarters)
        .of_kind(ParameterKind::Phase)
}

/// Source of [`radiated`] and [`emission`].
pub(super) const RADIATION: &str = "F. P. Incropera, D. P. DeWitt, T. L. Bergman, A. S. Lavine, Fundamentals of Heat and \
                                    Mass Transfer, 6th edition (Wiley 2007), section 1.2.3";

/// Returns the parameter for the radiated heat per difference of fourth powers.
pub(super) const fn emission() -> EffectParameter {
    EffectParameter::positive(
        "k",
        "emissivity times area times the Stefan-Boltzmann constant",
        Dimension::OUTPUT.over(Dimension::POSITION.power(4)),
    )
}

/// Returns the heat radiated from one temperature to another; `zero` is the offset to absolute temperatures.
pub(super) fn radiated<S: Scalar>(k: S, temperature: S, around: S, zero: S) -> S {
    let fourth = |x: S| x * x * x * x;
    k * (fourth(temperature + zero) - fourth(around + zero))
}

/// Returns the longest step with which the explicit method damps a mode with this time constant. At rest no error
/// limits the step, and tangents would grow. The method is stable up to 3.3 time constants along the real axis, and up
/// to 1 along the imaginary axis.
///
/// Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd edition (1996), section IV.2.
pub(super) fn damped<S: Scalar>(time: S) -> f64 {
    if time.value() > 0.0 { 2.0 * time.value() } else { f64::INFINITY }
}

/// Quantises `x`; the null value 0 of `step` leaves `x` unchanged. The derivative with respect to `x` is set to 1, its
/// mean over the staircase. The exact derivative is 0 on each stair and carries no information.
pub(super) fn quantised<S: Scalar>(x: S, step: S) -> S {
    if step.value() > 0.0 { x + (step * (x.value() / step.value()).round() - x.value()) } else { x }
}

/// Returns -1, 0 or 1.
pub(super) fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// Limits `x` to the range from `low` to `high`; if these have crossed, returns their middle.
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

/// Limits `x` to `limit` on both sides; `beyond` selects one law until the step ends.
pub(super) fn limited<S: Scalar>(x: S, limit: S, beyond: Option<bool>) -> S {
    let beyond = beyond.unwrap_or(x.value().abs() > limit.value());
    if beyond { limit * sign(x.value()) } else { x }
}

/// Removes from `x` what is within `width` of `centre`; `within` selects one law until the step ends.
pub(super) fn without_gap<S: Scalar>(x: S, centre: S, width: S, within: Option<bool>) -> S {
    let from = (x - centre).value();
    if within.unwrap_or(from.abs() < width.value()) { centre } else { x - width * sign(from) }
}

/// Damped contact.
#[derive(Clone, Copy)]
pub(super) struct Pressed<S> {
    /// Penetration, a length or an angle.
    pub into: S,
    /// Rate of penetration times damping divided by stiffness, in the unit of `into`.
    pub damped: S,
}

impl<S: Scalar> Pressed<S> {
    /// Returns the gap: positive if the bodies are apart, or separate so fast that the contact would pull. Negative
    /// while the contact pushes.
    pub fn gap(self) -> S {
        if self.damped.value() > 0.0 { -self.into } else { -self.into - self.damped }
    }

    /// Returns the contact force divided by the stiffness. The force jumps when contact is made; `closed` selects one
    /// law until the step ends.
    pub fn force(self, closed: Option<bool>) -> S {
        if closed.unwrap_or(self.gap().value() < 0.0) { self.into + self.damped } else { S::from(0.0) }
    }
}

/// Returns `x^exponent` for `x > 0`, else 0.
pub(super) fn power<S: Scalar>(x: S, exponent: S) -> S {
    if x.value() > 0.0 { (exponent * x.ln()).exp() } else { S::from(0.0) }
}

/// Returns `head^exponent` over an edge, 0 below it. `closed` selects one law until the step ends: with the exponent 1
/// the outflow bends at the edge.
pub(super) fn over<S: Scalar>(head: S, exponent: S, closed: Option<bool>) -> S {
    match closed {
        Some(false) => S::from(0.0),
        Some(true) if exponent.value() == 1.0 => head,
        _ => power(head, exponent),
    }
}

/// Returns the parameter for a start time in an experiment, s, with initial values at these fractions of the record.
pub(super) const fn from(shares: &'static [f64]) -> EffectParameter {
    EffectParameter::shape("from", "start", Dimension::TIME, NOT_NEGATIVE, InitialGrid::Moments(shares))
        .of_kind(ParameterKind::Instant)
}

/// Fractions of a record for the initial values of the start of a parameter step.
pub(super) const STEPS_BEGIN: &[f64] = &[0.05, 0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85];

/// Fractions of a record for the initial values of the duration of a parameter step.
pub(super) const STEPS_LAST: &[f64] = &[0.03, 0.12];

/// Returns the parameter for a duration, s, with initial values at these fractions of the record.
pub(super) const fn length(shares: &'static [f64]) -> EffectParameter {
    EffectParameter::shape("length", "duration", Dimension::TIME, NOT_NEGATIVE, InitialGrid::Moments(shares))
        .of_kind(ParameterKind::Duration)
}

/// Returns the parameter for a wave number along a position.
pub(super) const fn waves(trials: InitialGrid) -> EffectParameter {
    let about = "wave number: 2 pi divided by the period; for an angle, the number of periods per turn";
    EffectParameter::shape("n", about, Dimension::ONE.over(Dimension::POSITION), NOT_NEGATIVE, trials)
        .of_kind(ParameterKind::WaveNumber)
}

/// Time span with the parameters [`from`] and [`length`].
pub(super) struct Span<S> {
    from: S,
    length: S,
}

impl<S: Scalar> Span<S> {
    /// Creates the time span with these two parameters.
    pub fn new(parameters: &[S]) -> Self {
        Self { from: parameters[0], length: parameters[1] }
    }

    /// Returns start and end of the time span, s.
    pub fn breaks(&self) -> Vec<S> {
        vec![self.from, self.from + self.length]
    }

    /// Returns the elapsed fraction of the time span: 0 before, 1 after.
    pub fn passed(&self, t: S) -> S {
        let since = t - self.from;
        if since.value() <= 0.0 {
            S::from(0.0)
        } else if since.value() >= self.length.value() {
            S::from(1.0)
        } else {
            since / self.length
        }
    }

    /// Rises from 0 to 1 along half a period of a cosine: `(1 - cos(pi (t - from)/length))/2`, 0 before, 1 after.
    pub fn risen(&self, t: S) -> S {
        (-(self.passed(t) * PI).cos() + 1.0) * 0.5
    }
}
