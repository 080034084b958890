//! Effects between a command and the plant; some also act at sensors.

use std::f64::consts::PI;

use mops_math as math;

use super::law::{At, Law, change, dynamic, term};

/// Creates a static characteristic.
pub(super) fn curve(f: impl Fn(f64) -> f64 + 'static) -> Law {
    term(move |at| f(at.value))
}

/// Creates a lag of first order that starts at rest.
pub(super) fn lag(tau: f64) -> Law {
    dynamic(1, |at, z| z[0] = at.value, move |at, dz| dz[0] = (at.value - at.z[0]) / tau, |at| at.z[0])
}

/// Creates a delay, s.
pub(super) fn late(delay: f64) -> Law {
    Law { delay, ..curve(|value| value) }
}

/// Creates a staircase with steps in the middle between its levels.
pub(super) fn staircase(step: f64) -> Law {
    curve(move |value| step * (value / step).round()).with_guard(move |at| math::cos(PI * at.value / step))
}

/// Creates a rate limit: the output follows as far as the time since the last one permits.
fn rate_limit(rate: f64) -> Law {
    let output = move |at: &At<'_>| {
        let far = rate * at.elapsed;
        if at.last.is_nan() { at.value } else { at.value.clamp(at.last - far, at.last + far) }
    };
    let meets = |way: f64| move |at: &At<'_>| at.value - at.last - way * rate * at.elapsed;
    term(output).with_guard(meets(1.0)).with_guard(meets(-1.0))
}

/// Creates a play: the output moves only as far as needed to stay within half the gap of the input.
fn play(gap: f64) -> Law {
    let output = move |at: &At<'_>| match at.last.is_nan() {
        true => at.value,
        false => at.last.clamp(at.value - 0.5 * gap, at.value + 0.5 * gap),
    };
    let touches = |way: f64| move |at: &At<'_>| at.value - at.last - way * 0.5 * gap;
    term(output).with_guard(touches(1.0)).with_guard(touches(-1.0))
}

/// Returns the law of an actuator effect with this name.
pub(super) fn law(name: &str, p: &[f64]) -> Option<Law> {
    let law = match *p {
        [b] if name == "input-bias" => curve(move |u| u + b),
        [delay] if name == "input-delay" => late(delay),
        [limit] if name == "input-saturation" => {
            curve(move |u| u.clamp(-limit, limit)).with_guard(move |at| at.value.abs() - limit)
        }
        [width] if name == "input-dead-zone" => {
            curve(move |u| u - u.clamp(-width, width)).with_guard(move |at| at.value.abs() - width)
        }
        [g] if name == "input-gain" => curve(move |u| u * (1.0 + g)),
        [tau] if name == "actuator-lag" => lag(tau),
        [r] if name == "input-gain-drift" => term(move |at| at.value * (1.0 + r * at.t)),
        [g, from, length] if name == "input-gain-step" => {
            term(move |at| at.value * (1.0 + g * change(at.t, from, length)))
        }
        [step] if name == "input-quantisation" => staircase(step),
        [k] if name == "back-emf" => term(move |at| at.value - k * at.other_speed),
        [a] if name == "quadratic-input" => curve(move |u| u + a * u * u.abs()),
        [a] if name == "input-asymmetry" => curve(move |u| u + a * u.abs()).with_guard(|at| at.value),
        [a, n, phase] if name == "torque-ripple" => {
            term(move |at| at.value * (1.0 + a * math::sin(n * at.other + phase)))
        }
        [rate] if name == "input-rate-limit" => rate_limit(rate),
        [gap] if name == "backlash" => play(gap),
        [tau, d] if name == "second-order-lag" => dynamic(
            2,
            |at, z| (z[0], z[1]) = (at.value, 0.0),
            move |at, dz| (dz[0], dz[1]) = (at.z[1], (at.value - at.z[0] - 2.0 * d * tau * at.z[1]) / (tau * tau)),
            |at| at.z[0],
        ),
        _ => return None,
    };
    Some(law)
}
