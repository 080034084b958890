//! Events: the guard that becomes negative first within a step, located on the dense output.

use mops_core::Scalar;

use super::{Dynamics, Step};

/// The guard that becomes negative first within the step, which is shortened to that time. Guards are looked at in four
/// places of the step, so that one that dips below zero and comes back is rarely missed.
#[inline]
pub(super) fn first_event<S: Scalar, D: Dynamics<S>>(
    f: &D,
    step: &mut Step<D::State>,
    x: &mut D::State,
) -> Option<usize> {
    const PLACES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
    let count = f.guards();
    if count == 0 {
        return None;
    }
    let time = |theta: f64| step.start + theta * step.length;
    for place in PLACES.windows(2) {
        let (from, to) = (place[0], place[1]);
        let mut first: Option<(usize, f64)> = None;
        step.at(to, x);
        for index in 0..count {
            let here = f.guard(index, time(to), x).value();
            if here < 0.0 {
                let zero = first_zero(from, (to, here), |theta| {
                    step.at(theta, x);
                    f.guard(index, time(theta), x).value()
                });
                if first.is_none_or(|(_, earliest)| zero < earliest) {
                    first = Some((index, zero));
                }
                step.at(to, x);
            }
        }
        if let Some((index, theta)) = first {
            step.taken = theta * step.length;
            return Some(index);
        }
    }
    None
}

/// The tangents of the time of an event, as a number without value: `dt = -dg / (dg/dt)` by the implicit function
/// theorem, with the slope of the guard along the solution from the dense output. Where the guard only grazes zero the
/// time has no derivative, and 0 stands for it.
///
/// Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition (1993), section
/// I.14; jumps of tangents at events: S. Galan, W. Feehery, P. Barton, Applied Numerical Mathematics 31 (1999) 17-47.
pub(super) fn event_delay<S: Scalar, D: Dynamics<S>>(
    f: &D,
    index: usize,
    step: &Step<D::State>,
    x: &mut D::State,
) -> S {
    /// Part of the step between the two places that give the slope.
    const APART: f64 = 1e-3;
    if S::DIRECTIONS == 0 {
        return S::from(0.0);
    }
    let theta = step.taken / step.length;
    let guard = |theta: f64, x: &mut D::State| {
        step.at(theta, x);
        f.guard(index, step.start + theta * step.length, x)
    };
    let rise = guard(theta + APART, x).value() - guard(theta - APART, x).value();
    let slope = rise / (2.0 * APART * step.length);
    let here = guard(theta, x);
    let delay = -(here - here.value()) / slope;
    if delay.tangents().iter().all(|d| d.is_finite()) { delay } else { S::from(0.0) }
}

/// Moves the state by `delay` along its derivative: to first order, and its value not at all.
pub(super) fn shift<S: Scalar, D: Dynamics<S>>(f: &D, t: f64, x: &mut D::State, dx: &mut D::State, delay: S) {
    if S::DIRECTIONS > 0 {
        f.derivative(t, x, dx);
        for (x, dx) in x.as_mut().iter_mut().zip(dx.as_ref()) {
            *x += *dx * delay;
        }
    }
}

/// Where a guard that is not negative at `from` becomes so, before the place `to` where it is.
fn first_zero(from: f64, to: (f64, f64), mut value: impl FnMut(f64) -> f64) -> f64 {
    let mut before = (from, value(from));
    // A guard that begins at zero, such as the speed of a joint that just broke away, may rise and fall again between
    // two looks: look closer before it counts as an event on the spot.
    if before.1 <= 0.0 {
        let closer = (1..=40).map(|k| from + (to.0 - from) * 0.5_f64.powi(k));
        before = closer.map(|theta| (theta, value(theta))).find(|(_, g)| *g > 0.0).unwrap_or(before);
    }
    if before.1 <= 0.0 { from } else { zero_between(before, to, &mut value) }
}

/// A zero between a place where `f` is positive and one where it is negative (Illinois method).
fn zero_between(mut a: (f64, f64), mut b: (f64, f64), f: &mut impl FnMut(f64) -> f64) -> f64 {
    for _ in 0..80 {
        let middle = (a.0 * b.1 - b.0 * a.1) / (b.1 - a.1);
        let middle = if middle > a.0.min(b.0) && middle < a.0.max(b.0) { middle } else { 0.5 * (a.0 + b.0) };
        let here = (middle, f(middle));
        if here.1 == 0.0 || (b.0 - a.0).abs() < 1e-14 {
            return middle;
        }
        if here.1 * b.1 < 0.0 {
            a = b;
        } else {
            a.1 *= 0.5;
        }
        b = here;
    }
    b.0
}
