//! Integration from step to step: step sizes, breaks, events.
//!
//! Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition (1993), section
//! II.4 (step size, initial step); E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd edition (1996),
//! section IV.2 (PI control).

use mops_core::{Failure, Scalar, Work};

use super::dormand_prince::DormandPrince;
use super::esdirk::Esdirk;
use super::events::{event_delay, first_event, shift};
use super::{Dynamics, IntegrationMethod, Simulated, Sink, Tolerance};

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

    /// One component of [`Step::state`].
    #[inline]
    pub(super) fn component<S: Scalar>(&self, s: f64, i: usize) -> S
    where
        X: AsRef<[S]>,
    {
        let theta = s * (self.taken / self.length);
        let back = 1.0 - theta;
        let [r0, r1, r2, r3, r4] = &self.dense;
        let (r0, r1, r2, r3, r4) = (r0.as_ref()[i], r1.as_ref()[i], r2.as_ref()[i], r3.as_ref()[i], r4.as_ref()[i]);
        r0 + (r1 + (r2 + (r3 + r4 * back) * theta) * back) * theta
    }

    /// The state at `start + theta length`: `r0 + theta (r1 + (1 - theta)(r2 + theta (r3 + (1 - theta) r4)))`.
    #[inline]
    pub(super) fn at<S: Scalar>(&self, theta: f64, x: &mut X)
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

/// What a method is asked to do: a step of length `h` from `x` at `t`.
pub(super) struct Attempt<'a, X> {
    pub(super) t: f64,
    pub(super) h: f64,
    pub(super) x: &'a X,
    pub(super) tolerance: &'a Tolerance,
}

/// A one-step method with error estimate and dense output.
pub(super) trait Method<S: Scalar, D: Dynamics<S>> {
    /// The error of a step of length `h` is of this order in `h`.
    const ERROR_ORDER: f64;
    /// Whether it damps what decays in short steps alone.
    const IS_EXPLICIT: bool;

    fn new(f: &D, x: &D::State) -> Self;

    /// The solution begins anew at `x`: at the start, and where an event or a break made the right-hand side jump.
    fn restart(&mut self, f: &D, t: f64, x: &D::State, work: &mut Work);

    /// The derivative at the start of the next step.
    fn slope(&self) -> &D::State;

    /// Computes the state after the step, and its error over the tolerance; NaN where there is none.
    fn attempt(&mut self, f: &D, at: Attempt<'_, D::State>, next: &mut D::State, work: &mut Work) -> f64;

    /// The step was accepted, and the next begins where it ended.
    fn advance(&mut self);

    /// The coefficients of [`Step`] for the step last attempted.
    fn dense(&self, h: f64, x: &D::State, next: &D::State, dense: &mut [D::State; 5]);
}

/// Integrates from `t` to `end`; `sink` is told of every step and event.
///
/// # Errors
/// The state stops being finite, the steps run out, or become too small for the clock.
pub fn integrate<S: Scalar, D: Dynamics<S>>(
    dynamics: &mut D,
    t: f64,
    end: f64,
    x: D::State,
    tolerance: &Tolerance,
    sink: &mut impl Sink<S, D>,
) -> Simulated<D::State> {
    match tolerance.method {
        IntegrationMethod::Explicit => run::<S, D, DormandPrince<D::State>>(dynamics, (t, end), x, tolerance, sink),
        IntegrationMethod::Stiff => run::<S, D, Esdirk<D::State>>(dynamics, (t, end), x, tolerance, sink),
    }
}

fn run<S: Scalar, D: Dynamics<S>, M: Method<S, D>>(
    dynamics: &mut D,
    (mut t, end): (f64, f64),
    mut x: D::State,
    tolerance: &Tolerance,
    sink: &mut impl Sink<S, D>,
) -> Simulated<D::State> {
    let mut work = Work::default();
    let mut method = M::new(dynamics, &x);
    let mut next = x.clone();
    let mut at = x.clone();
    let mut spare = x.clone();
    let mut step = Step { start: t, length: 0.0, taken: 0.0, dense: std::array::from_fn(|_| x.clone()) };

    dynamics.pass_break(t, &mut x);
    method.restart(dynamics, t, &x, &mut work);
    let mut h = initial_step(dynamics, (t, end), &x, method.slope(), tolerance, M::ERROR_ORDER);
    work.derivatives += 1;
    let mut last_log_error = LOG_SMALL_ERROR;
    let mut rejected = false;
    let mut events_here = 0;
    let longest = dynamics.longest_step().min(if M::IS_EXPLICIT { dynamics.damped_step() } else { f64::INFINITY });

    while t < end {
        if work.steps + work.rejected >= tolerance.max_steps {
            return Err(Failure::StepLimit(t));
        }
        if let Some(failure) = sink.ends(t) {
            return Err(failure);
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
        let error = method.attempt(dynamics, Attempt { t, h, x: &x, tolerance }, &mut next, &mut work);
        if !error.is_finite() || error > 1.0 {
            if !error.is_finite() && (h < 1e-12 || !all_finite::<S>(x.as_ref())) {
                return Err(Failure::Diverged(t));
            }
            // Hairer's factors: 0.9 as safety, at most a fifth at once.
            h *= if error.is_finite() { (0.9 * error.powf(-1.0 / M::ERROR_ORDER)).max(0.2) } else { 0.1 };
            work.rejected += 1;
            rejected = true;
            continue;
        }
        work.steps += 1;
        step.start = t;
        step.length = h;
        step.taken = h;
        if sink.reads_steps() || dynamics.guards() > 0 || dynamics.remembers() {
            method.dense(h, &x, &next, &mut step.dense);
        }
        let event = first_event(dynamics, &mut step, &mut spare);
        sink.step(&step, dynamics);
        if dynamics.remembers() {
            dynamics.accepted(&step);
        }
        if let Some(index) = event {
            step.state(1.0, &mut at);
            // An event at the very start of a step is one at the same time as the last: modes that never agree on
            // whose turn it is are a failure, not a hang.
            events_here = if step.taken > 16.0 * f64::EPSILON * t.abs() { 0 } else { events_here + 1 };
            if events_here > 100 {
                return Err(Failure::StepTooSmall(t));
            }
            t += step.taken;
            let delay = event_delay(dynamics, index, &step, &mut spare);
            shift(dynamics, t, &mut at, &mut spare, delay);
            sink.event(t, dynamics.switch(index, t, &mut at));
            shift(dynamics, t, &mut at, &mut spare, -delay);
            std::mem::swap(&mut x, &mut at);
            rejected = false;
            // An event within rounding of a break must not swallow it.
            if t >= stop {
                t = stop;
                dynamics.pass_break(t, &mut x);
            }
            method.restart(dynamics, t, &x, &mut work);
            continue;
        }
        events_here = 0;
        std::mem::swap(&mut x, &mut next);
        if reaches {
            t = stop;
            dynamics.pass_break(t, &mut x);
            if t < end {
                method.restart(dynamics, t, &x, &mut work);
            }
        } else {
            t += h;
            method.advance();
        }
        // PI step-size control with beta = 0.04, as in the authors' DOPRI5: `0.9 error^-(1/q - 0.75 beta) last_error^beta`.
        let log_error = error.max(1e-10).ln();
        let factor = 0.9 * (0.04 * last_log_error - (1.0 / M::ERROR_ORDER - 0.04 * 0.75) * log_error).exp();
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

/// Root mean square of differences over their tolerance; each comes with the size it is relative to.
#[inline]
#[allow(clippy::cast_precision_loss)]
pub(super) fn scaled_norm(differences: impl ExactSizeIterator<Item = (f64, f64)>, tolerance: &Tolerance) -> f64 {
    let n = differences.len().max(1) as f64;
    let ratio = |(difference, size)| difference / (tolerance.absolute + tolerance.relative * size);
    (differences.map(ratio).map(|r: f64| r * r).sum::<f64>() / n).sqrt()
}

/// A first guess of the step size (algorithm II.4.14 of the source).
fn initial_step<S: Scalar, D: Dynamics<S>>(
    f: &D,
    (t, end): (f64, f64),
    x: &D::State,
    slope: &D::State,
    tolerance: &Tolerance,
    order: f64,
) -> f64 {
    let norm =
        |v: &[S], x: &[S]| scaled_norm(v.iter().map(|v| v.value()).zip(x.iter().map(|x| x.value().abs())), tolerance);
    let (mut stage, mut derivative) = (x.clone(), x.clone());
    let slope = slope.as_ref();
    let (d0, d1) = (norm(x.as_ref(), x.as_ref()), norm(slope, x.as_ref()));
    let h0 = if d0 < 1e-5 || d1 < 1e-5 { 1e-6 } else { 0.01 * d0 / d1 };
    let h0 = h0.min(end - t);
    for (i, s) in stage.as_mut().iter_mut().enumerate() {
        *s = x.as_ref()[i] + slope[i] * h0;
    }
    f.derivative(t + h0, &stage, &mut derivative);
    for (i, s) in stage.as_mut().iter_mut().enumerate() {
        *s = derivative.as_ref()[i] - slope[i];
    }
    let d2 = norm(stage.as_ref(), x.as_ref()) / h0;
    let largest = d1.max(d2);
    let h1 = if largest <= 1e-15 { (h0 * 1e-3).max(1e-6) } else { (0.01 / largest).powf(1.0 / order) };
    let h = (100.0 * h0).min(h1).min(end - t);
    if h.is_finite() && h > 0.0 { h } else { 1e-6_f64.min(end - t) }
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

    const TIGHT: Tolerance =
        Tolerance { relative: 1e-10, absolute: 1e-12, max_steps: 100_000, method: IntegrationMethod::Explicit };

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
        fn switch(&mut self, _: usize, t: f64, x: &mut [S; 2]) -> &str {
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
