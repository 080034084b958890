//! Springs, stops, masses and external forces of joints.

use std::f64::consts::TAU;

use mops_math as math;

use super::law::{At, Law, dynamic, sign, term};

/// Returns the difference between a coupling with backlash and the same coupling without, for the displacement `e` and
/// its rate.
fn play(k: f64, gap: f64, tau: f64, e: f64, rate: f64) -> f64 {
    let contact = if e > 0.5 * gap {
        (e - 0.5 * gap + tau * rate).max(0.0)
    } else if e < -0.5 * gap {
        (e + 0.5 * gap + tau * rate).min(0.0)
    } else {
        0.0
    };
    k * (e + tau * rate - contact)
}

/// Returns the law of a force at a joint with this name.
pub(super) fn law(name: &str, p: &[f64]) -> Option<Law> {
    let law = match *p {
        [k, rest] if name == "linear-stiffness" => term(move |at| -k * (at.q - rest)),
        [k, rest] if name == "quadratic-stiffness" => term(move |at| -k * math::powi(at.q - rest, 2)),
        [k, rest] if name == "cubic-stiffness" => term(move |at| -k * math::powi(at.q - rest, 3)),
        [k, gap] if name == "spring-play" => term(move |at| k * at.q.clamp(-0.5 * gap, 0.5 * gap)),
        [k, gap, tau] if name == "coupling-play" => {
            let force = move |at: &At<'_>| play(k, gap, tau, at.q - at.other, at.v - at.other_speed);
            let law = Law { onward: -1.0, ..term(force) };
            law.with_guard(move |at| at.q - at.other - 0.5 * gap).with_guard(move |at| at.q - at.other + 0.5 * gap)
        }
        [k, low, high, tau] if name == "end-stop" => {
            let force = move |at: &At<'_>| {
                let above = if at.q > high { -k * (at.q - high + tau * at.v).max(0.0) } else { 0.0 };
                let below = if at.q < low { k * (low - at.q - tau * at.v).max(0.0) } else { 0.0 };
                above + below
            };
            term(force).with_guard(move |at| at.q - high).with_guard(move |at| at.q - low)
        }
        [a, n, phase] if matches!(name, "cogging" | "position-ripple") => {
            term(move |at| a * math::sin(n * at.q + phase))
        }
        [a, phase] if name == "imbalance" => term(move |at| -a * math::sin(at.q - phase)),
        [m, w, d] if name == "flexible-mode" => {
            let pull = move |at: &At<'_>| w * w * (at.z[0] - at.q) + 2.0 * d * w * (at.z[1] - at.v);
            let begin = |at: &At<'_>, z: &mut [f64]| (z[0], z[1]) = (at.q, at.v);
            let rates = move |at: &At<'_>, dz: &mut [f64]| (dz[0], dz[1]) = (at.z[1], -pull(at));
            dynamic(2, begin, rates, move |at| m * pull(at))
        }
        [c, y, sigma, n] if name == "bouc-wen" => {
            let rates = move |at: &At<'_>, dz: &mut [f64]| {
                let (z, v) = (at.z[0], at.v);
                let power = math::powf(z.abs(), n);
                // |z|^(n - 1) z, which is 0 at 0.
                let odd = sign(z) * power;
                dz[0] = (v - sigma * v.abs() * odd + (sigma - 1.0) * v * power) / y;
            };
            dynamic(1, |_, _| (), rates, move |at| -c * at.z[0])
        }
        [k, h, y] if name == "torsional-hysteresis" => {
            let rates = move |at: &At<'_>, dz: &mut [f64]| dz[0] = (at.v - at.v.abs() * at.z[0]) / y;
            dynamic(1, |_, _| (), rates, move |at| -k * (at.q + h * y * at.z[0]))
        }
        [m] if name == "added-mass" => Law { added: m, ..Law::default() },
        [r] if name == "mass-loss" => Law { lost: r, ..Law::default() },
        [f] if name == "constant-force" => term(move |_| f),
        [a, w, phase] if name == "periodic-disturbance" => term(move |at| a * math::sin(w * at.t + phase)),
        [a, from, length] if name == "wind-gust" => term(move |at| {
            let share = (at.t - from) / length;
            if share > 0.0 && share < 1.0 { 0.5 * a * (1.0 - math::cos(TAU * share)) } else { 0.0 }
        }),
        _ => return None,
    };
    Some(law)
}
