use mops_core::{Input, Job, Model, case::Hold};
use mops_math as math;

use crate::fit::Meter;
use crate::testing::{Record, fitted, subject};

const OSCILLATOR: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", d = "N s/m", k = "N/m", bias = { unit = "N", default = 0 } }
der        = { x = "v", v = "m*v' = u + bias - d*v - k*x - 3 [1/m2]*k*x^3" }
outputs    = { a = { value = "(u - d*v - k*x - 3 [1/m2]*k*x^3)/m", unit = "m/s^2" } }
"#;

/// Mass that a sampled controller with a computing delay moves to the input.
const SAMPLED: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "m" }
parameters = { m = "kg", bias = { unit = "N", default = 0 } }
constants  = { T = "70 ms", kp = "30 N/m", ki = "20 N/(m s)", kd = "8 N s/m" }
der        = { x = "v", v = "m*v' = f + bias - 3 [N s/m]*v" }
let        = { next = "s + T*(u - x)" }
clocks.c   = { every = "T", delay = "25 ms", memory = { f = "N", s = "m s" }, next = { s = "next", f = "kp*(u - x) + ki*next - kd*v" } }
tolerance  = { relative = 1e-10 }
"#;

/// Mass on a spring whose force arrives late.
const LATE: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", bias = { unit = "N", default = 0 } }
der        = { x = "v", v = "m*v' = u + bias - 5 [N/m]*delay(x, 0.1 [s]) - 2 [N s/m]*v" }
tolerance  = { relative = 1e-10 }
"#;

#[test]
fn a_force_beside_clocks_and_delays_has_the_tangent_of_the_simulation() {
    // A delay line is a Pade approximant.
    for (text, amplitude, states, allowed) in [(SAMPLED, 0.8, 4, 1e-7), (LATE, 2.0, 2, 1e-4)] {
        let truth: Vec<f64> = [2.0, 0.5].into_iter().chain(std::iter::repeat_n(0.1, states)).collect();
        let subject = subject(text, &truth, states, vec![record(&["x", "v"], amplitude, 0.02)]);
        let simulations = Meter::new(&());
        let (fit, variant, mut at, _) = fitted(&subject, &simulations);
        at.globals = truth[..2].to_vec();
        at.locals = vec![truth[2..].to_vec()];
        let along = super::Trajectory::new(&fit, &variant.model, 0, &at).expect("it simulates");
        let unit = vec![1.0; along.moments.len()];
        let response = along.response(along.inputs(), &unit);
        let piece = &fit.pieces[0];
        let job = Job { case: &piece.case, parameters: &truth, signals: &[0, 1], horizon: piece.horizon };
        let seed = (0..truth.len()).map(|i| f64::from(u8::from(i == 1))).collect();
        let (_, tangents) = variant.model.tangents(&job, &[seed]).expect("exact").expect("it simulates");
        for (s, response) in piece.series.iter().zip(response.chunks(200)) {
            let expected = tangents[0].trace(&s.name).sample(&s.times);
            let largest = expected.iter().fold(0.0_f64, |most, e| most.max(e.abs()));
            let off = response.iter().zip(&expected).map(|(r, e)| (r * s.noise - e).abs()).fold(0.0, f64::max);
            assert!(off < allowed * largest, "{} {states}: {off} of {largest}", s.name);
        }
    }
}

fn record(names: &[&'static str], amplitude: f64, step: f64) -> Record {
    let times: Vec<f64> = (0..200).map(|k| f64::from(k) * step).collect();
    let values = times.iter().map(|t| amplitude * math::sin(3.0 * t)).collect();
    let input = Input::Sampled { times: times.clone(), values, hold: Hold::First };
    let signals = names.iter().map(|&name| (name, vec![0.0; 200], 0.5)).collect();
    Record { inputs: vec![("u", input)], times, signals }
}

#[test]
fn a_unit_force_moves_an_oscillator_at_rest_as_the_closed_form_says() {
    // m x'' + k x = 1 from rest: x = (1 - cos(w t))/k, w^2 = k/m = 4; coarse steps of 0.2 rad.
    let subject = subject(OSCILLATOR, &[2.0, 0.0, 8.0, 0.0, 0.0, 0.0], 2, vec![record(&["x", "a"], 0.0, 0.1)]);
    let simulations = Meter::new(&());
    let (_, _, _, trajectories) = fitted(&subject, &simulations);
    let along = &trajectories[0];
    let unit = vec![1.0; along.moments.len()];
    let response = along.response(along.inputs(), &unit);
    for k in 0..200_u32 {
        let t = 0.1 * f64::from(k);
        let x = (1.0 - math::cos(2.0 * t)) / 8.0 / 0.5;
        assert!((response[k as usize] - x).abs() < 1e-5, "{t}: {} {x}", response[k as usize]);
    }
    // The pulse of one interval: nothing before it.
    let mut pulse = vec![0.0; along.moments.len()];
    pulse[200] = 1.0;
    pulse[201] = 1.0;
    let response = along.response(along.inputs(), &pulse);
    assert!(response[..=100].iter().all(|&r| r == 0.0) && response[101] > 0.0);
}

#[test]
fn a_constant_force_along_a_nonlinear_motion_has_the_tangent_of_the_simulation() {
    let truth = [2.0, 0.8, 8.0, 0.5, 0.3, -0.2];
    let subject = subject(OSCILLATOR, &truth, 2, vec![record(&["x", "v", "a"], 6.0, 0.02)]);
    let simulations = Meter::new(&());
    let (fit, variant, mut at, _) = fitted(&subject, &simulations);
    at.globals = truth[..4].to_vec();
    at.locals = vec![truth[4..].to_vec()];
    let along = super::Trajectory::new(&fit, &variant.model, 0, &at).expect("it simulates");
    let unit = vec![1.0; along.moments.len()];
    let response = along.response(along.inputs(), &unit);
    let piece = &fit.pieces[0];
    let job = Job { case: &piece.case, parameters: &truth, signals: &[0, 1, 2], horizon: piece.horizon };
    let seed = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
    let (_, tangents) = variant.model.tangents(&job, &[seed]).expect("exact").expect("it simulates");
    for (s, response) in piece.series.iter().zip(response.chunks(200)) {
        let expected = tangents[0].trace(&s.name).sample(&s.times);
        for ((r, e), t) in response.iter().zip(&expected).zip(&s.times) {
            let r = r * s.noise;
            // The output `a` is taken at a node, a fifth of a step after the sample.
            let allowed = if s.name == "a" { 2e-2 } else { 1e-5 };
            assert!((r - e).abs() < allowed * (1.0 + e.abs()), "{} {t}: {r} {e}", s.name);
        }
    }
}
