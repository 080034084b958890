//! Effects between a signal and its measurement.

use mops_math as math;

use super::actuators::{curve, lag, late, staircase};
use super::law::{Law, term};

/// Returns the law of a sensor effect with this name.
pub(super) fn law(name: &str, p: &[f64]) -> Option<Law> {
    let law = match *p {
        [b] if name == "sensor-bias" => curve(move |y| y + b),
        [g] if name == "sensor-gain" => curve(move |y| y * (1.0 + g)),
        [delay] if name == "sensor-delay" => late(delay),
        [tau] if name == "sensor-lag" => lag(tau),
        [r] if name == "sensor-drift" => term(move |at| at.value + r * at.t),
        [width, centre] if name == "sensor-dead-zone" => {
            let shown = curve(move |y| y - (y - centre).clamp(-width, width));
            shown.with_guard(move |at| (at.value - centre).abs() - width)
        }
        [width, centre] if name == "sensor-gap" => {
            let shown = curve(move |y| if (y - centre).abs() < width { centre } else { y });
            shown.with_guard(move |at| (at.value - centre).abs() - width)
        }
        [limit, 0.0] if name == "sensor-saturation" => {
            curve(move |y| y.clamp(-limit.abs(), limit.abs())).with_guard(move |at| at.value.abs() - limit.abs())
        }
        [limit, side] if name == "sensor-saturation" => {
            let shown = curve(move |y| if side > 0.0 { y.min(limit) } else { y.max(limit) });
            shown.with_guard(move |at| at.value - limit)
        }
        [step] if name == "sensor-quantisation" => staircase(step),
        [a, phase] if name == "eccentricity" => curve(move |y| y + a * math::sin(y + phase)),
        [k] if name == "cross-talk" => term(move |at| at.value + k * at.other),
        _ => return None,
    };
    Some(law)
}
