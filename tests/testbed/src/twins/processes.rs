//! Flows of liquid and heat.

use mops_math as math;

use super::law::{Law, dynamic, term};

fn fourth(x: f64) -> f64 {
    math::powi(x, 4)
}

/// Returns the law of a flow with this name.
pub(super) fn law(name: &str, p: &[f64]) -> Option<Law> {
    let law = match *p {
        [k, around] if name == "linear-loss" => term(move |at| -k * (at.q - around)),
        [k, hole] if name == "leak" => {
            term(move |at| -k * (at.q - hole).max(0.0).sqrt()).with_guard(move |at| at.q - hole)
        }
        [k, level, n] if name == "overflow" => {
            term(move |at| -k * math::powf((at.q - level).max(0.0), n)).with_guard(move |at| at.q - level)
        }
        [k, level, n, share] if name == "spill-over" => {
            let flow = term(move |at| -k * math::powf((at.q - level).max(0.0), n));
            Law { onward: -share, ..flow }.with_guard(move |at| at.q - level)
        }
        [k, around, zero] if name == "radiation-loss" => {
            term(move |at| -k * (fourth(at.q + zero) - fourth(around + zero)))
        }
        [k, zero] if name == "radiation-exchange" => {
            term(move |at| -k * (fourth(at.q + zero) - fourth(at.other + zero)))
        }
        [k, tau] if name == "hidden-store" => dynamic(
            1,
            |at, z| z[0] = at.q,
            move |at, dz| dz[0] = (at.q - at.z[0]) / tau,
            move |at| k * (at.z[0] - at.q),
        ),
        [k] if name == "quadratic-loss" => term(move |at| -k * at.q * at.q.abs()),
        [k, n] if name == "orifice-exponent" => term(move |at| -k * math::powf(at.q.max(0.0), n)).with_guard(|at| at.q),
        _ => return None,
    };
    Some(law)
}
