//! Elastic end stops with dampers that cannot pull.

use mops_core::effect::{
    BoundEffect, Characteristic, Dimension, EffectClass, EffectParameter, InitialGrid, ParameterKind, PortKind,
    PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::{ANY, NOT_NEGATIVE, Pressed};

/// Effect `end-stop`.
pub struct EndStop;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
    low: S,
    high: S,
    tau: S,
}

impl Definition for EndStop {
    const NAME: &'static str = "end-stop";
    const ABOUT: &'static str =
        "Damped elastic stops beyond a lower and an upper position; they push back but never pull.";
    const FORMULA: &'static str = "-k max(q - high + tau v, 0) for q > high, k max(low - q - tau v, 0) for q < low";
    const SOURCE: &'static str = "B. Brogliato, Nonsmooth Mechanics, 3rd edition (Springer 2016), chapter 2";
    const CLASS: EffectClass = EffectClass::Elastic;
    const CHARACTERISTIC: Option<Characteristic> = Some(Characteristic::Stops);
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const ACTS_BETWEEN: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("k", "stiffness of the stops", Dimension::OUTPUT.over(Dimension::POSITION))
            .restarted_from(&[1.0, 10.0]),
        EffectParameter::shape(
            "low",
            "position of the lower stop",
            Dimension::POSITION,
            ANY,
            InitialGrid::Within(&[-0.05, 0.0, 0.05, 0.2]),
        )
        .of_kind(ParameterKind::LowerEdge),
        EffectParameter::shape(
            "high",
            "position of the upper stop",
            Dimension::POSITION,
            ANY,
            InitialGrid::Within(&[0.8, 0.95, 1.0, 1.05]),
        )
        .of_kind(ParameterKind::UpperEdge),
        EffectParameter::shape(
            "tau",
            "damping of the stops divided by their stiffness",
            Dimension::TIME,
            NOT_NEGATIVE,
            InitialGrid::Plain(&[0.0]),
        )
        .of_kind(ParameterKind::Damping),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0], low: s[1], high: s[2], tau: s[3] })
    }
}

impl<S: Scalar> AtParameters<S> {
    /// Returns the contact with the nearer stop, and the direction of its force. If the stops have crossed, both are at
    /// their middle.
    fn nearer(&self, at: &PortState<'_, S>) -> (Pressed<S>, f64) {
        let middle = (self.low + self.high) * 0.5;
        let (low, high) = if self.low.value() > self.high.value() { (middle, middle) } else { (self.low, self.high) };
        let (below, above) = (low - at.q, at.q - high);
        let (into, to) = if below.value() > above.value() { (below, 1.0) } else { (above, -1.0) };
        (Pressed { into, damped: self.tau * at.v * -to }, to)
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        let (pressed, to) = self.nearer(at);
        self.k * pressed.force(at.closed) * to
    }

    fn gap(&self, at: &PortState<'_, S>) -> Option<S> {
        (self.k.value() != 0.0).then(|| self.nearer(at).0.gap())
    }
}
