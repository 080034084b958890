//! Sensor with a limited range.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::{ANY, sign};

/// Effect `sensor-saturation`.
pub struct SensorSaturation;

/// Effect at given parameters.
struct AtParameters<S> {
    limit: S,
    side: f64,
}

impl Definition for SensorSaturation {
    const NAME: &'static str = "sensor-saturation";
    const ABOUT: &'static str = "The sensor saturates at a limit: above, below, or on both sides.";
    const FORMULA: &'static str =
        "side 1: min(y, limit); side -1: max(y, limit); side 0: clamp(y, -limit, limit); limit infinite: y";
    const SOURCE: &'static str = "H. K. Khalil, Nonlinear Systems, 3rd edition (Prentice Hall 2002), section 1.2.7";
    const CLASS: EffectClass = EffectClass::Gain;
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("limit", "limit", Dimension::VALUE)
            .within(ANY[0], ANY[1])
            .null_at(f64::INFINITY)
            .with_grid(InitialGrid::Within(&[0.04, 0.1, 0.2, 0.3, 0.6, 0.7, 0.8, 0.9, 0.96])),
        EffectParameter::shape(
            "side",
            "side that saturates: 1 above, -1 below, 0 both",
            Dimension::ONE,
            [-1.0, 1.0],
            InitialGrid::Plain(&[1.0, 0.0, -1.0]),
        )
        .kept(),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { limit: s[0], side: s[1].value() })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        let Some(gap) = self.gap(at) else { return at.value };
        match at.closed.unwrap_or(gap.value() < 0.0) {
            false => at.value,
            true if self.side == 0.0 => self.limit.abs() * sign(at.value.value()),
            true => self.limit,
        }
    }

    fn gap(&self, at: &PortState<'_, S>) -> Option<S> {
        let inside =
            |value: S| if self.side == 0.0 { self.limit.abs() - value.abs() } else { (self.limit - value) * self.side };
        self.limit.value().is_finite().then(|| inside(at.value))
    }
}
