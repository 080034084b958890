//! Recorded signals, compared with the functions that define them.

use mops_core::{Failure, Halt, Instant, Plant};
use mops_language::{Dual, Scalar};
use mops_math as math;
use mops_models::kernel::{Driven, Tolerance, Wanted, record};

/// State with this constant rate, 0 or that of the clock, so that steps are as long as possible. The signal is a
/// function of time and state.
struct Idle<F>(f64, F);
impl<S: Scalar, F: Fn(f64, S) -> S> Plant<S> for Idle<F> {
    fn start(&self) -> Vec<S> {
        vec![S::from(0.0)]
    }
    fn rates(&self, _: &Instant<'_, S>, dx: &mut [S]) {
        dx[0] = S::from(self.0);
    }
    fn signal(&self, _: usize, at: &Instant<'_, S>) -> S {
        self.1(at.t, at.x[0])
    }
}

const TOLERANCE: Tolerance = Tolerance { max_steps: 1000, ..Tolerance::DEFAULT };

/// Size of a segment of a trace in bytes: 7 numbers.
const SEGMENT: usize = 56;

/// Returns the largest difference between the recorded signal and its function of time and state, over a thousand
/// times.
fn difference<S: Scalar>(start: S, rate: f64, horizon: f64, f: impl Fn(f64, S) -> S) -> [f64; 2] {
    let signals = vec![(0, "y".to_owned())].into();
    let recording = record(&mut Driven::alone(Idle(rate, &f)), &[start], horizon, &TOLERANCE, &signals).unwrap();
    let traces = std::iter::once(&recording.response).chain(&recording.tangents).map(|r| &r.traces[0].1);
    let mut largest = [0.0_f64; 2];
    for (k, trace) in traces.enumerate() {
        for i in 0..=1000 {
            let t = horizon * f64::from(i) / 1000.0;
            let exact = f(t, start + rate * t);
            let exact = if k == 0 { exact.value() } else { exact.tangents()[k - 1] };
            largest[k] = largest[k].max((trace.at(t) - exact).abs());
        }
    }
    largest
}

#[test]
fn a_signal_that_follows_the_clock_is_exact_while_the_state_rests() {
    // Periods that divide the horizon, and so coincide with the nodes of a step.
    for angular in [20.0, 2.0 * std::f64::consts::TAU, 8.0 * std::f64::consts::TAU] {
        let [off, _] = difference(1.0, 0.0, 10.0, |t, _| math::sin(angular * t));
        assert!(off < 2e-7, "{angular}: {off}");
    }
    // NIST StRD, Thurber, with its certified parameters: a quotient of cubics, from 1 s to 1400 s.
    let thurber = |t: f64| {
        let x = t - 3.0;
        let over = 1288.13968 + x * (1491.0792535 + x * (583.23836877 + x * 75.416644291));
        over / (1.0 + x * (0.96629502864 + x * (0.39797285797 + x * 0.049727297349)))
    };
    let [off, _] = difference(0.0, 0.0, 5.2, |t, _| thurber(t));
    assert!(off < 2e-7 * 1400.0, "{off}");
}

#[test]
fn a_signal_that_bends_more_than_the_states_is_exact_with_its_tangents() {
    let [off, _] = difference(0.0, 1.0, 10.0, |_, x: f64| math::sin(20.0 * x));
    assert!(off < 2e-7, "{off}");
    let start = Dual::<1>::variable(0.1, 0);
    let [value, tangent] = difference(start, 1.0, 10.0, |_, x| (x * 20.0).sin());
    assert!(value < 2e-7 && tangent < 2e-5, "{value} {tangent}");
}

#[test]
fn a_signal_far_faster_than_its_state_keeps_its_size() {
    // Ten thousand periods in a step.
    let [off, _] = difference(0.0, 1.0, 10.0, |_, x: f64| math::sin(6500.0 * x));
    assert!(off < 2e-6, "{off}");
}

#[test]
fn a_signal_that_jumps_within_a_step_is_recorded_all_the_same() {
    let signals = vec![(0, "y".to_owned())].into();
    let jump = |t: f64, _: f64| if t < 7.3 { 0.0 } else { 1.0 };
    let recording = record(&mut Driven::alone(Idle(0.0, jump)), &[0.0], 10.0, &TOLERANCE, &signals).unwrap();
    let trace = &recording.response.traces[0].1;
    assert!(trace.knots().len() < 200, "{}", trace.knots().len());
    assert!((trace.at(7.29), trace.at(7.31)) == (0.0, 1.0));
}

/// System `y' = 1` in steps of 1 s. Every signal is `y`; each evaluation calls the function with its time.
struct Clock<F>(F);
impl<S: Scalar, F: Fn(f64)> Plant<S> for Clock<F> {
    fn start(&self) -> Vec<S> {
        vec![S::from(0.0)]
    }
    fn rates(&self, _: &Instant<'_, S>, dx: &mut [S]) {
        dx[0] = S::from(1.0);
    }
    fn longest_step(&self) -> f64 {
        1.0
    }
    fn signal(&self, _: usize, at: &Instant<'_, S>) -> S {
        self.0(at.t);
        at.x[0]
    }
}

#[test]
fn the_limit_of_a_recording_counts_tangents_and_signals() {
    let endless = Tolerance { max_steps: usize::MAX, ..TOLERANCE };
    for signals in [1, 2, 7] {
        let mut wanted = Wanted::from((0..signals).map(|i| (i, format!("y{i}"))).collect::<Vec<_>>());
        wanted.room = 100 * signals * SEGMENT;
        // Steps of 1 s: the limit allows 100 of them, and a quarter of that with three tangents.
        let run = |end: f64| record(&mut Driven::alone(Clock(|_| ())), &[0.0], end, &endless, &wanted);
        assert!(run(95.0).is_ok());
        let Err(Failure::RecordLimit(t)) = run(1e300) else { panic!("it ends") };
        assert!((95.0..=105.0).contains(&t), "{t}");
        let start = [Dual::<3>::from(0.0)];
        let run = |end: f64| record(&mut Driven::alone(Clock(|_| ())), &start, end, &endless, &wanted);
        assert!(run(20.0).is_ok());
        let Err(Failure::RecordLimit(t)) = run(1e300) else { panic!("it ends") };
        assert!((20.0..=30.0).contains(&t), "{t}");
    }
}

#[test]
fn a_simulation_ends_at_the_step_after_the_request() {
    let endless = Tolerance { max_steps: usize::MAX, ..TOLERANCE };
    for (why, patient) in [(Halt::Interrupted, false), (Halt::Budget, false), (Halt::Budget, true)] {
        let mut wanted = Wanted::from(vec![(0, "y".to_owned())]);
        let request = wanted.cancellation.clone();
        if patient {
            wanted.cancellation = request.patient();
        }
        // Requested during the simulation, at 50 s.
        let mut clock = Driven::alone(Clock(|t: f64| {
            if t > 50.0 {
                request.request(why);
            }
            if t > 80.0 {
                request.insist();
            }
        }));
        let end = if patient { 70.0 } else { 1e300 };
        let found = record(&mut clock, &[0.0], end, &endless, &wanted);
        assert_eq!(found.err(), (!patient).then_some(Failure::Cancelled));
        request.insist();
        assert_eq!(record(&mut clock, &[0.0], 1.0, &endless, &wanted).err(), Some(Failure::Cancelled));
    }
}
