//! The explicit Runge-Kutta method of Dormand and Prince: order 5(4), dense output of order 4, events.
//!
//! Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition (1993), section
//! II.4 (step size, initial step), table II.5.2 (coefficients), II.6 (dense output).

use mops_core::{Failure, Scalar, Work};

use super::{Dynamics, Simulated, Sink, Tolerance};

/// An accepted step from `start` to `start + taken`, with its dense output.
pub struct Step<X> {
    /// Time at which it begins, s.
    pub start: f64,
    /// Length of the step for which the dense output was made, s.
    pub length: f64,
    /// Part of it that holds, s: less than `length` where an event ended it.
    pub taken: f64,
    dense: [X; 5],
}

impl<X> Step<X> {
    /// The state at `start + s taken`, `s` in [0, 1].
    #[inline]
    pub fn state<S: Scalar>(&self, s: f64, x: &mut X)
    where
        X: AsRef<[S]> + AsMut<[S]>,
    {
        self.at(s * (self.taken / self.length), x);
    }

    /// The state at `start + theta length`: `r0 + theta (r1 + (1 - theta)(r2 + theta (r3 + (1 - theta) r4)))`.
    #[inline]
    fn at<S: Scalar>(&self, theta: f64, x: &mut X)
    where
        X: AsRef<[S]> + AsMut<[S]>,
    {
        let back = 1.0 - theta;
        let [r0, r1, r2, r3, r4] = &self.dense;
        let (r0, r1, r2, r3, r4) = (r0.as_ref(), r1.as_ref(), r2.as_ref(), r3.as_ref(), r4.as_ref());
        for (i, x) in x.as_mut().iter_mut().enumerate() {
            *x = r0[i] + (r1[i] + (r2[i] + (r3[i] + r4[i] * back) * theta) * back) * theta;
        }
    }
}

/// Integrates from `t` to `end`; `sink` is told of every step and event.
///
/// # Errors
/// The state stops being finite, the steps run out, or become too small for the clock.
pub fn integrate<S: Scalar, D: Dynamics<S>>(
    dynamics: &mut D,
    mut t: f64,
    end: f64,
    mut x: D::State,
    tolerance: &Tolerance,
    sink: &mut impl Sink<S, D>,
) -> Simulated<D::State> {
    let mut work = Work::default();
    let zero = x.clone();
    let mut k: [D::State; 7] = std::array::from_fn(|_| zero.clone());
    let mut next = zero.clone();
    let mut stage = zero.clone();
    let mut step = Step { start: t, length: 0.0, taken: 0.0, dense: std::array::from_fn(|_| zero.clone()) };

    dynamics.pass_break(t, &mut x);
    dynamics.derivative(t, &x, &mut k[0]);
    let mut h = initial_step(dynamics, t, end, &x, &k, &mut stage, &mut next, tolerance);
    work.derivatives += 2;
    let mut last_log_error = LOG_SMALL_ERROR;
    let mut rejected = false;
    let mut events_here = 0;
    let longest = dynamics.longest_step();

    while t < end {
        if work.steps + work.rejected >= tolerance.max_steps {
            return Err(Failure::StepLimit(t));
        }
        let stop = dynamics.next_break(t).min(end);
        h = h.min(longest);
        // A step that would leave a sliver before the stop is made to reach it.
        let reaches = t + 1.01 * h >= stop;
        if reaches {
            h = stop - t;
        } else if h <= 16.0 * f64::EPSILON * t.abs() {
            return Err(Failure::StepTooSmall(t));
        }
        stages(dynamics, t, h, &x, &mut k, &mut stage, &mut next);
        work.derivatives += 6;
        let error = error_norm(h, &x, &next, &k, tolerance);
        if !error.is_finite() || error > 1.0 {
            if !error.is_finite() && (h < 1e-12 || !all_finite::<S>(x.as_ref())) {
                return Err(Failure::Diverged(t));
            }
            // Hairer's factors: 0.9 as safety, at most a fifth at once.
            h *= if error.is_finite() { (0.9 * error.powf(-0.2)).max(0.2) } else { 0.1 };
            work.rejected += 1;
            rejected = true;
            continue;
        }
        work.steps += 1;
        step.start = t;
        step.length = h;
        step.taken = h;
        if sink.reads_steps() || dynamics.guards() > 0 || dynamics.remembers() {
            dense_output(h, &x, &next, &k, &mut step.dense);
        }
        let event = first_event(dynamics, &mut step, &mut stage);
        sink.step(&step, dynamics);
        if dynamics.remembers() {
            dynamics.accepted(&step);
        }
        if let Some(index) = event {
            let mut at = stage.clone();
            step.state(1.0, &mut at);
            // An event at the very start of a step is one at the same time as the last: modes that never agree on
            // whose turn it is are a failure, not a hang.
            events_here = if step.taken > 16.0 * f64::EPSILON * t.abs() { 0 } else { events_here + 1 };
            if events_here > 100 {
                return Err(Failure::StepTooSmall(t));
            }
            t += step.taken;
            let delay = event_delay(dynamics, index, &step, &mut stage);
            shift(dynamics, t, &mut at, &mut stage, delay);
            let what = dynamics.switch(index, t, &mut at);
            shift(dynamics, t, &mut at, &mut stage, -delay);
            sink.event(t, what);
            x = at;
            rejected = false;
            // An event within rounding of a break must not swallow it.
            if t >= stop {
                t = stop;
                dynamics.pass_break(t, &mut x);
            }
            dynamics.derivative(t, &x, &mut k[0]);
            work.derivatives += 1;
            continue;
        }
        events_here = 0;
        std::mem::swap(&mut x, &mut next);
        if reaches {
            t = stop;
            dynamics.pass_break(t, &mut x);
            if t < end {
                dynamics.derivative(t, &x, &mut k[0]);
                work.derivatives += 1;
            }
        } else {
            t += h;
            k.swap(0, 6); // First same as last.
        }
        // PI step-size control with beta = 0.04 (section IV.2 of part II, as in the authors' DOPRI5):
        // `0.9 error^-(0.2 - 0.75 beta) last_error^beta`.
        let log_error = error.max(1e-10).ln();
        let factor = 0.9 * (0.04 * last_log_error - (0.2 - 0.04 * 0.75) * log_error).exp();
        let factor = factor.clamp(0.2, if rejected { 1.0 } else { 10.0 });
        // A step cut short by a break says little about the next.
        h = if reaches { (h * factor).max(h) } else { h * factor };
        last_log_error = log_error.max(LOG_SMALL_ERROR);
        rejected = false;
    }
    if all_finite::<S>(x.as_ref()) { Ok((x, work)) } else { Err(Failure::Diverged(t)) }
}

/// `ln 1e-4`: the error that an earlier step counts as having had at least.
const LOG_SMALL_ERROR: f64 = -9.210_340_371_976_182;

fn all_finite<S: Scalar>(x: &[S]) -> bool {
    x.iter().all(|x| x.value().is_finite())
}

/// The six new stages; `k[0]` is given, `k[6]` is the derivative at the new state.
#[rustfmt::skip]
#[inline]
fn stages<S: Scalar, D: Dynamics<S>>(
    f: &D, t: f64, h: f64, x: &D::State, k: &mut [D::State; 7], stage: &mut D::State, next: &mut D::State,
) {
    let n = x.as_ref().len();
    // Terms in the order of the stages, so that the newest derivative, which is waited for, comes in last.
    macro_rules! combine {
        ($target:expr, $($i:literal * $c:expr),+) => {{
            let (target, x) = ($target.as_mut(), x.as_ref());
            for j in 0..n {
                target[j] = x[j] $(+ k[$i].as_ref()[j] * (h * ($c)))+;
            }
        }};
    }
    combine!(stage, 0 * (1.0 / 5.0));
    f.derivative(t + h / 5.0, stage, &mut k[1]);
    combine!(stage, 0 * (3.0 / 40.0), 1 * (9.0 / 40.0));
    f.derivative(t + 0.3 * h, stage, &mut k[2]);
    combine!(stage, 0 * (44.0 / 45.0), 1 * (-56.0 / 15.0), 2 * (32.0 / 9.0));
    f.derivative(t + 0.8 * h, stage, &mut k[3]);
    combine!(stage, 0 * (19372.0 / 6561.0), 1 * (-25360.0 / 2187.0), 2 * (64448.0 / 6561.0), 3 * (-212.0 / 729.0));
    f.derivative(t + 8.0 / 9.0 * h, stage, &mut k[4]);
    combine!(stage, 0 * (9017.0 / 3168.0), 1 * (-355.0 / 33.0), 2 * (46732.0 / 5247.0), 3 * (49.0 / 176.0), 4 * (-5103.0 / 18656.0));
    f.derivative(t + h, stage, &mut k[5]);
    combine!(next, 0 * (35.0 / 384.0), 2 * (500.0 / 1113.0), 3 * (125.0 / 192.0), 4 * (-2187.0 / 6784.0), 5 * (11.0 / 84.0));
    f.derivative(t + h, next, &mut k[6]);
}

/// Root mean square of the embedded error estimate over its tolerance.
#[rustfmt::skip]
#[inline]
fn error_norm<S: Scalar, X: AsRef<[S]>>(h: f64, x: &X, next: &X, k: &[X; 7], tolerance: &Tolerance) -> f64 {
    let n = x.as_ref().len();
    let mut sum = 0.0;
    for j in 0..n {
        let kj = |i: usize| k[i].as_ref()[j].value();
        let error = h * (71.0 / 57600.0 * kj(0) - 71.0 / 16695.0 * kj(2) + 71.0 / 1920.0 * kj(3)
            - 17253.0 / 339_200.0 * kj(4) + 22.0 / 525.0 * kj(5) - 1.0 / 40.0 * kj(6));
        let size = x.as_ref()[j].value().abs().max(next.as_ref()[j].value().abs());
        let ratio = error / (tolerance.absolute + tolerance.relative * size);
        sum += ratio * ratio;
    }
    #[allow(clippy::cast_precision_loss)]
    let mean = sum / n.max(1) as f64;
    mean.sqrt()
}

#[rustfmt::skip]
#[inline]
fn dense_output<S: Scalar, X: AsRef<[S]> + AsMut<[S]>>(h: f64, x: &X, next: &X, k: &[X; 7], dense: &mut [X; 5]) {
    const D: [f64; 7] = [
        -12_715_105_075.0 / 11_282_082_432.0, 0.0, 87_487_479_700.0 / 32_700_410_799.0, -10_690_763_975.0 / 1_880_347_072.0,
        701_980_252_875.0 / 199_316_789_632.0, -1_453_857_185.0 / 822_651_844.0, 69_997_945.0 / 29_380_423.0,
    ];
    for j in 0..x.as_ref().len() {
        let (x0, x1) = (x.as_ref()[j], next.as_ref()[j]);
        let (k1, k7) = (k[0].as_ref()[j] * h, k[6].as_ref()[j] * h);
        let difference = x1 - x0;
        let bspl = k1 - difference;
        dense[0].as_mut()[j] = x0;
        dense[1].as_mut()[j] = difference;
        dense[2].as_mut()[j] = bspl;
        dense[3].as_mut()[j] = difference - k7 - bspl;
        let sum = k[0].as_ref()[j] * D[0] + k[2].as_ref()[j] * D[2] + k[3].as_ref()[j] * D[3]
            + k[4].as_ref()[j] * D[4] + k[5].as_ref()[j] * D[5] + k[6].as_ref()[j] * D[6];
        dense[4].as_mut()[j] = sum * h;
    }
}

/// A first guess of the step size (algorithm II.4.14 of the source).
#[allow(clippy::too_many_arguments)]
fn initial_step<S: Scalar, D: Dynamics<S>>(
    f: &D,
    t: f64,
    end: f64,
    x: &D::State,
    k: &[D::State; 7],
    stage: &mut D::State,
    derivative: &mut D::State,
    tolerance: &Tolerance,
) -> f64 {
    let norm = |v: &[S], scale: &[S]| {
        #[allow(clippy::cast_precision_loss)]
        let n = v.len().max(1) as f64;
        let ratio = |(v, x): (&S, &S)| v.value() / (tolerance.absolute + tolerance.relative * x.value().abs());
        (v.iter().zip(scale).map(ratio).map(|r| r * r).sum::<f64>() / n).sqrt()
    };
    let slope = k[0].as_ref();
    let (d0, d1) = (norm(x.as_ref(), x.as_ref()), norm(slope, x.as_ref()));
    let h0 = if d0 < 1e-5 || d1 < 1e-5 { 1e-6 } else { 0.01 * d0 / d1 };
    let h0 = h0.min(end - t);
    for (i, s) in stage.as_mut().iter_mut().enumerate() {
        *s = x.as_ref()[i] + slope[i] * h0;
    }
    f.derivative(t + h0, stage, derivative);
    for (i, s) in stage.as_mut().iter_mut().enumerate() {
        *s = derivative.as_ref()[i] - slope[i];
    }
    let d2 = norm(stage.as_ref(), x.as_ref()) / h0;
    let largest = d1.max(d2);
    let h1 = if largest <= 1e-15 { (h0 * 1e-3).max(1e-6) } else { (0.01 / largest).powf(0.2) };
    let h = (100.0 * h0).min(h1).min(end - t);
    if h.is_finite() && h > 0.0 { h } else { 1e-6_f64.min(end - t) }
}

/// The guard that becomes negative first within the step, which is shortened to that time. Guards are looked at in four
/// places of the step, so that one that dips below zero and comes back is rarely missed.
#[inline]
fn first_event<S: Scalar, D: Dynamics<S>>(f: &D, step: &mut Step<D::State>, x: &mut D::State) -> Option<usize> {
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
fn event_delay<S: Scalar, D: Dynamics<S>>(f: &D, index: usize, step: &Step<D::State>, x: &mut D::State) -> S {
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
fn shift<S: Scalar, D: Dynamics<S>>(f: &D, t: f64, x: &mut D::State, dx: &mut D::State, delay: S) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use mops_core::Dual;

    /// `x'' = -x`.
    struct Oscillator;
    impl<S: Scalar> Dynamics<S> for Oscillator {
        type State = [S; 2];
        fn derivative(&self, _: f64, x: &[S; 2], dx: &mut [S; 2]) {
            *dx = [x[1], -x[0]];
        }
    }

    const TIGHT: Tolerance = Tolerance { relative: 1e-10, absolute: 1e-12, max_steps: 100_000 };

    #[test]
    fn the_harmonic_oscillator_comes_back_after_a_period() {
        let period = std::f64::consts::TAU;
        let (x, work) = integrate(&mut Oscillator, 0.0, period, [1.0, 0.0], &TIGHT, &mut ()).unwrap();
        assert!((x[0] - 1.0).abs() < 1e-8 && x[1].abs() < 1e-8, "{x:?} {work:?}");
    }

    #[test]
    fn tangents_are_exact_and_change_no_value() {
        let (plain, _) = integrate(&mut Oscillator, 0.0, 3.0, [1.0, 0.5], &TIGHT, &mut ()).unwrap();
        let x0 = [Dual::<1>::variable(1.0, 0), Dual::from(0.5)];
        let (dual, _) = integrate(&mut Oscillator, 0.0, 3.0, x0, &TIGHT, &mut ()).unwrap();
        assert_eq!((dual[0].value, dual[1].value), (plain[0], plain[1]));
        assert!((dual[0].tangent[0] - 3f64.cos()).abs() < 1e-9);
    }

    /// `x' = x^2`, which is infinite at `t = 1` from `x = 1`.
    struct Explosion;
    impl Dynamics<f64> for Explosion {
        type State = [f64; 1];
        fn derivative(&self, _: f64, x: &[f64; 1], dx: &mut [f64; 1]) {
            dx[0] = x[0] * x[0];
        }
    }

    #[test]
    fn a_solution_that_becomes_infinite_is_a_failure() {
        let failure = integrate(&mut Explosion, 0.0, 2.0, [1.0], &TIGHT, &mut ()).unwrap_err();
        assert!(matches!(failure, Failure::Diverged(_) | Failure::StepTooSmall(_)), "{failure:?}");
    }

    #[test]
    fn steps_are_limited() {
        let tolerance = Tolerance { max_steps: 10, ..TIGHT };
        let failure = integrate(&mut Oscillator, 0.0, 100.0, [1.0, 0.0], &tolerance, &mut ()).unwrap_err();
        assert!(matches!(failure, Failure::StepLimit(_)), "{failure:?}");
    }

    /// A ball that bounces on the floor and keeps the part `rebound` of its speed.
    struct Ball<S> {
        rebound: S,
        bounces: Vec<f64>,
    }
    impl<S: Scalar> Dynamics<S> for Ball<S> {
        type State = [S; 2];
        fn derivative(&self, _: f64, x: &[S; 2], dx: &mut [S; 2]) {
            *dx = [x[1], S::from(-9.81)];
        }
        fn guards(&self) -> usize {
            1
        }
        fn guard(&self, _: usize, _: f64, x: &[S; 2]) -> S {
            x[0]
        }
        fn switch(&mut self, _: usize, t: f64, x: &mut [S; 2]) -> &'static str {
            *x = [S::from(0.0), -x[1] * self.rebound];
            self.bounces.push(t);
            "bounce"
        }
    }

    #[test]
    fn events_are_located_to_rounding() {
        let mut ball = Ball { rebound: 1.0, bounces: Vec::new() };
        integrate(&mut ball, 0.0, 3.0, [1.0, 0.0], &TIGHT, &mut ()).unwrap();
        let fall = (2.0 / 9.81_f64).sqrt();
        let exact: Vec<f64> = [1.0, 3.0, 5.0].iter().map(|n| n * fall).filter(|&t| t < 3.0).collect();
        assert_eq!(ball.bounces.len(), exact.len());
        for (t, exact) in ball.bounces.iter().zip(exact) {
            assert!((t - exact).abs() < 1e-10, "{t} {exact}");
        }
    }

    #[test]
    fn tangents_jump_at_events_as_the_closed_form_does() {
        // Height and speed at 1.2 s, after bounces at 0.45 s and, for a rebound of 0.8, at 1.17 s.
        let closed = |height: f64, rebound: f64| {
            let (g, fall) = (9.81, (2.0 * height / 9.81).sqrt());
            let second = fall * (1.0 + 2.0 * rebound);
            assert!(second < 1.2);
            let (up, t) = (g * fall * rebound * rebound, 1.2 - second);
            [up * t - 0.5 * g * t * t, up - g * t]
        };
        let mut ball = Ball { rebound: Dual::<2>::variable(0.8, 1), bounces: Vec::new() };
        let start = [Dual::variable(1.0, 0), Dual::from(0.0)];
        let (x, _) = integrate(&mut ball, 0.0, 1.2, start, &TIGHT, &mut ()).unwrap();
        let h = 1e-5;
        for (i, x) in x.iter().enumerate() {
            let slopes = [
                (closed(1.0 + h, 0.8)[i] - closed(1.0 - h, 0.8)[i]) / (2.0 * h),
                (closed(1.0, 0.8 + h)[i] - closed(1.0, 0.8 - h)[i]) / (2.0 * h),
            ];
            assert!((x.value - closed(1.0, 0.8)[i]).abs() < 1e-9);
            for (tangent, slope) in x.tangent.iter().zip(slopes) {
                assert!((tangent - slope).abs() < 1e-7, "state {i}: {tangent} {slope}");
            }
        }
    }
}
