//! Tests of the integration over all steps, with breaks and events.

use mops_core::plant::{EventInstant, InputRates};
use mops_core::{Failure, Instant, Plant, plant};
use mops_language::{Dual, Scalar};
use mops_math as math;
use mops_models::kernel::{Driven, Tolerance, integrate};

/// Harmonic oscillator `x'' = -x`.
struct Oscillator;
impl<S: Scalar> Plant<S> for Oscillator {
    fn start(&self) -> Vec<S> {
        vec![S::from(1.0), S::from(0.0)]
    }
    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        dx.copy_from_slice(&[at.x[1], -at.x[0]]);
    }
}

const TIGHT: Tolerance = Tolerance { relative: 1e-10, max_steps: 100_000, ..Tolerance::DEFAULT };

#[test]
fn the_harmonic_oscillator_comes_back_after_a_period() {
    let period = std::f64::consts::TAU;
    let (x, work) = integrate(&mut Driven::alone(Oscillator), 0.0, period, &[1.0, 0.0], &TIGHT, &mut ()).unwrap();
    assert!((x[0] - 1.0).abs() < 1e-8 && x[1].abs() < 1e-8, "{x:?} {work:?}");
}

#[test]
fn tangents_are_exact_and_change_no_value() {
    let (plain, _) = integrate(&mut Driven::alone(Oscillator), 0.0, 3.0, &[1.0, 0.5], &TIGHT, &mut ()).unwrap();
    let x0 = [Dual::<1>::variable(1.0, 0), Dual::from(0.5)];
    let (dual, _) = integrate(&mut Driven::alone(Oscillator), 0.0, 3.0, &x0, &TIGHT, &mut ()).unwrap();
    assert_eq!([dual[0].value, dual[1].value], [plain[0], plain[1]]);
    assert!((dual[0].tangent[0] - math::cos(3.0)).abs() < 1e-9);
}

/// System `x' = x^2`, whose solution from `x = 1` is infinite at `t = 1`.
struct Explosion;
impl Plant<f64> for Explosion {
    fn start(&self) -> Vec<f64> {
        vec![1.0]
    }
    fn rates(&self, at: &Instant<'_, f64>, dx: &mut [f64]) {
        dx[0] = at.x[0] * at.x[0];
    }
}

#[test]
fn a_solution_that_becomes_infinite_is_a_failure() {
    let failure = integrate(&mut Driven::alone(Explosion), 0.0, 2.0, &[1.0], &TIGHT, &mut ()).unwrap_err();
    assert!(matches!(failure, Failure::Diverged(_) | Failure::StepTooSmall(_)), "{failure:?}");
}

#[test]
fn steps_are_limited() {
    let tolerance = Tolerance { max_steps: 10, ..TIGHT };
    let failure = integrate(&mut Driven::alone(Oscillator), 0.0, 100.0, &[1.0, 0.0], &tolerance, &mut ()).unwrap_err();
    assert!(matches!(failure, Failure::StepLimit(..)), "{failure:?}");
}

/// Ball that bounces on the floor and keeps the fraction `rebound` of its speed.
struct Ball<S> {
    rebound: S,
    bounces: Vec<f64>,
}
impl<S: Scalar> Plant<S> for Ball<S> {
    fn start(&self) -> Vec<S> {
        vec![S::from(1.0), S::from(0.0)]
    }
    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        dx.copy_from_slice(&[at.x[1], S::from(-9.81)]);
    }
    fn events(&self) -> Option<&dyn plant::Events<S>> {
        Some(self)
    }
    fn events_mut(&mut self) -> Option<&mut dyn plant::Events<S>> {
        Some(self)
    }
}
impl<S: Scalar> plant::Events<S> for Ball<S> {
    fn guards(&self) -> usize {
        1
    }
    fn guard(&self, _: usize, at: &Instant<'_, S>, _: InputRates<'_>) -> S {
        at.x[0]
    }
    fn switch(&mut self, _: usize, event: &EventInstant<'_, S>, x: &mut [S]) -> &str {
        x.copy_from_slice(&[S::from(0.0), -x[1] * self.rebound]);
        self.bounces.push(event.at.t);
        "bounce"
    }
}

#[test]
fn events_are_located_to_rounding() {
    let mut ball = Driven::alone(Ball { rebound: 1.0, bounces: Vec::new() });
    integrate(&mut ball, 0.0, 3.0, &[1.0, 0.0], &TIGHT, &mut ()).unwrap();
    let fall = (2.0 / 9.81_f64).sqrt();
    let exact: Vec<f64> = [1.0, 3.0, 5.0].iter().map(|n| n * fall).filter(|&t| t < 3.0).collect();
    assert_eq!(ball.plant.bounces.len(), exact.len());
    for (t, exact) in ball.plant.bounces.iter().zip(exact) {
        assert!((t - exact).abs() < 1e-10, "{t} {exact}");
    }
}

#[test]
fn tangents_jump_at_events_as_the_closed_form_does() {
    // Height and speed at 1.2 s, after bounces at 0.45 s and at 1.17 s (for a rebound of 0.8).
    let closed = |height: f64, rebound: f64| {
        let (g, fall) = (9.81, (2.0 * height / 9.81).sqrt());
        let second = fall * (1.0 + 2.0 * rebound);
        assert!(second < 1.2);
        let (up, t) = (g * fall * rebound * rebound, 1.2 - second);
        [up * t - 0.5 * g * t * t, up - g * t]
    };
    let mut ball = Driven::alone(Ball { rebound: Dual::<2>::variable(0.8, 1), bounces: Vec::new() });
    let start = [Dual::variable(1.0, 0), Dual::from(0.0)];
    let (x, _) = integrate(&mut ball, 0.0, 1.2, &start, &TIGHT, &mut ()).unwrap();
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
