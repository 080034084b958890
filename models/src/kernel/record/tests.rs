//! Recorded signals against what they are functions of.

use super::*;

/// A state that rests, or runs with the clock: either way steps are as long as they may be.
struct Idle(f64);
impl<S: Scalar> Dynamics<S> for Idle {
    type State = [S; 1];
    fn derivative(&self, _: f64, _: &[S; 1], dx: &mut [S; 1]) {
        *dx = [S::from(self.0)];
    }
}

const TOLERANCE: Tolerance = Tolerance { max_steps: 1000, ..Tolerance::DEFAULT };

/// The largest difference between the recorded signal and the function of time and state it is, over a thousand times.
fn difference<S: Scalar>(start: S, rate: f64, horizon: f64, f: impl Fn(f64, S) -> S) -> [f64; 2] {
    let signals = [(0, "y".to_owned())];
    let output = |_: &Idle, _: usize, t: f64, x: &[S; 1]| f(t, x[0]);
    let recording = record(&mut Idle(rate), [start], horizon, &TOLERANCE, &signals, &output).unwrap();
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
    // Periods that divide the horizon, and with it the nodes of a step.
    for angular in [20.0, 2.0 * std::f64::consts::TAU, 8.0 * std::f64::consts::TAU] {
        let [off, _] = difference(1.0, 0.0, 10.0, |t, _| (angular * t).sin());
        assert!(off < 2e-7, "{angular}: {off}");
    }
    // NIST StRD, Thurber, with its certified parameters: a quotient of cubics, from 1 s to 1400.
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
    let [off, _] = difference(0.0, 1.0, 10.0, |_, x: f64| (20.0 * x).sin());
    assert!(off < 2e-7, "{off}");
    let start = Dual::<1>::variable(0.1, 0);
    let [value, tangent] = difference(start, 1.0, 10.0, |_, x| (x * 20.0).sin());
    assert!(value < 2e-7 && tangent < 2e-5, "{value} {tangent}");
}

#[test]
fn a_signal_that_jumps_within_a_step_is_recorded_all_the_same() {
    let signals = [(0, "y".to_owned())];
    let output = |_: &Idle, _: usize, t: f64, _: &[f64; 1]| if t < 7.3 { 0.0 } else { 1.0 };
    let recording = record(&mut Idle(0.0), [0.0], 10.0, &TOLERANCE, &signals, &output).unwrap();
    let trace = &recording.response.traces[0].1;
    assert!(trace.knots().len() < 200, "{}", trace.knots().len());
    assert!((trace.at(7.29), trace.at(7.31)) == (0.0, 1.0));
}
