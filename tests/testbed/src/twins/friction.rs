//! Friction and drag of joints.

use mops_math as math;

use super::law::{At, Law, dynamic, sign, term};
use crate::law::Dry;

/// Creates dry friction with equal levels in both directions, as functions of the state.
fn dry(slide: impl Fn(&At<'_>) -> f64 + 'static, hold: impl Fn(&At<'_>) -> f64 + 'static) -> Law {
    let levels = move |at: &At<'_>, _: f64| Dry { slide: slide(at), hold: hold(at) };
    Law { dry: Some(Box::new(levels)), ..Law::default() }
}

/// Returns the law of friction with this name.
pub(super) fn law(name: &str, p: &[f64]) -> Option<Law> {
    let law = match *p {
        [c] if name == "coulomb-friction" => dry(move |_| c, move |_| c),
        [c, rise] if name == "stiction" => dry(move |_| c, move |_| c * (1.0 + rise)),
        [c, rise, vs] if name == "stribeck-friction" => {
            let slide = move |at: &At<'_>| c * (1.0 + rise * math::exp(-math::powi(at.v / vs, 2)));
            dry(slide, move |_| c * (1.0 + rise))
        }
        [c, skew] if name == "asymmetric-friction" => {
            let levels = move |_: &At<'_>, way: f64| {
                let level = c * (1.0 + way * skew);
                Dry { slide: level, hold: level }
            };
            Law { dry: Some(Box::new(levels)), ..Law::default() }
        }
        [mu] if name == "load-dependent-friction" => {
            let level = move |at: &At<'_>| mu * at.other.abs();
            dry(level, level)
        }
        [c, a, n, phase] if name == "position-dependent-friction" => {
            let level = move |at: &At<'_>| c * (1.0 + a * math::cos(n * at.q + phase));
            dry(level, level)
        }
        [c, r1, r2, r3, top] if name == "tabulated-friction" => {
            let table = [1.0, r1, r2, r2 + (r3 - r2) / 2.0, r3];
            let slide = move |at: &At<'_>| {
                let s = (4.0 * at.v.abs() / top).min(4.0);
                let k = (s as usize).min(3);
                c * (table[k] + (s - k as f64) * (table[k + 1] - table[k]))
            };
            dry(slide, move |_| c)
        }
        [c, p] if name == "power-friction" => {
            term(move |at| -c * math::powf(at.v.abs(), p) * sign(at.v)).with_guard(|at| at.v)
        }
        [c, y] if name == "dahl-friction" => {
            let rates = move |at: &At<'_>, dz: &mut [f64]| dz[0] = (at.v - at.v.abs() * at.z[0]) / y;
            dynamic(1, |_, _| (), rates, move |at| -c * at.z[0])
        }
        [c, rise, vs, y, tau] if name == "lugre-friction" => {
            let rate = move |at: &At<'_>| {
                let limit = 1.0 + rise * math::exp(-math::powi(at.v / vs, 2));
                (at.v - at.v.abs() * at.z[0] / limit) / y
            };
            let rates = move |at: &At<'_>, dz: &mut [f64]| dz[0] = rate(at);
            dynamic(1, |_, _| (), rates, move |at| -c * (at.z[0] + tau * rate(at)))
        }
        [d] if name == "viscous-friction" => term(move |at| -d * at.v),
        [k] if name == "quadratic-drag" => term(move |at| -k * at.v * at.v.abs()),
        [k] if name == "cubic-drag" => term(move |at| -k * at.v * at.v * at.v),
        [r] if name == "damping-drift" => term(move |at| -r * at.t * at.v),
        [d, from, length] if name == "damping-step" => {
            term(move |at| -d * super::law::change(at.t, from, length) * at.v)
        }
        _ => return None,
    };
    Some(law)
}
