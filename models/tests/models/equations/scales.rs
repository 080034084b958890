//! Errors relative to the size of each state: the accuracy does not depend on units.

use mops_math as math;

use super::*;

/// Decades of the size of the states relative to 1.
const DECADES: [i32; 7] = [-12, -9, -6, -3, 0, 3, 6];

/// Returns the largest difference of a signal from its closed form, divided by the size of the signal.
fn off(response: &Response, signal: &str, size: f64, end: f64, exact: impl Fn(f64) -> f64) -> f64 {
    let time = |k: i32| end * f64::from(k) / 200.0;
    (0..=200).map(|k| (at(response, signal, time(k)) - exact(time(k))).abs() / size).fold(0.0, f64::max)
}

/// Accuracy that results from default tolerances of 1e-8 per step.
const ACCURACY: f64 = 1e-6;

#[test]
fn a_capacitor_is_charged_as_in_the_closed_form_from_picofarads_on() {
    let text = "states = { q = 'C' }\ninputs = { u = 'V' }\nparameters = { R = 'ohm', C = 'F' }\nder = { q = '(u - q/C)/R' }\n\
                outputs = { v = { value = 'q/C', unit = 'V' } }";
    let model = read(text).unwrap();
    for decade in DECADES {
        let c = math::powi(10.0, decade);
        let constant = 1e6 * c;
        for end in [2.0, 20.0, 200.0] {
            let response = respond(&model, &[("u", Input::Constant(5.0))], &[("R", 1e6), ("C", c)], end * constant);
            let worst = off(&response, "v", 5.0, end * constant, |t| 5.0 * (1.0 - math::exp(-t / constant)));
            assert!(worst < ACCURACY, "{c} F, {end} time constants: {worst}");
        }
    }
}

#[test]
fn a_spring_swings_as_in_the_closed_form_at_all_sizes() {
    let text = "states = { x = 'm', v = 'm/s' }\nparameters = { k = '1/s2' }\nder = { x = 'v', v = '-k*x' }";
    let model = read(text).unwrap();
    for size in DECADES.map(|decade| math::powi(10.0, decade)) {
        for time in [1e-6_f64, 1.0, 1e6] {
            let given = [("k", math::powi(time, -2)), ("x0", size)];
            let response = respond(&model, &[], &given, 30.0 * time);
            let worst = off(&response, "x", size, 30.0 * time, |t| size * math::cos(t / time));
            assert!(worst < 10.0 * ACCURACY, "{size} m, {time} s: {worst}");
        }
    }
}

#[test]
fn a_pendulum_of_any_length_swings_alike() {
    let text = "states = { th = 'rad', w = 'rad/s' }\nparameters = { l = 'm' }\nder = { th = 'w', w = '-9.81 [m/s2]/l*sin(th)' }";
    let model = read(text).unwrap();
    for start in [1e-12, 1e-6, 1.0, 3.0] {
        let ends: Vec<f64> = DECADES
            .iter()
            .map(|&decade| {
                let l = math::powi(10.0, decade);
                at(&respond(&model, &[], &[("l", l), ("th0", start)], 10.0 * l.sqrt()), "th", 10.0 * l.sqrt())
            })
            .collect();
        for end in &ends {
            assert!((end - ends[0]).abs() < ACCURACY * start, "{start}: {ends:?}");
        }
    }
}

#[test]
fn a_chain_of_integrators_starts_from_rest() {
    // x6 = t^6/720 is of higher order than the method, so that no first step is exact to the relative tolerance.
    let states: Vec<String> = (1..=6).map(|k| format!("x{k} = '1'")).collect();
    let der: Vec<String> = (1..=5).map(|k| format!("x{} = 'x{k}'", k + 1)).collect();
    let text = format!("states = {{ {} }}\nder = {{ x1 = '1', {} }}", states.join(", "), der.join(", "));
    let model = read(&text).unwrap();
    let response = respond(&model, &[], &[], 2.0);
    assert!((at(&response, "x6", 2.0) - 64.0 / 720.0).abs() < 1e-7);
    assert!(response.work.steps < 2_000, "{:?}", response.work);
}

#[test]
fn a_difference_within_rounding_does_not_limit_the_steps() {
    // Two equal masses under equal forces: their distance e is 0 except for rounding.
    let text = "states = { e = 'm', a = 'm/s', b = 'm/s' }\nparameters = { k = '1/s2' }\n\
                der = { e = 'a - b', a = '3.3 [m/s2]*cos(7 [1/s]*time) - 0.1 [1/s]*a - k*e', b = '3.3 [m/s2]*cos(7 [1/s]*time) - 0.1 [1/s]*b + k*e' }";
    let model = read(text).unwrap();
    let response = respond(&model, &[], &[("k", 30.0), ("a0", 1.1), ("b0", 1.1 * (1.0 + 1e-15))], 20.0);
    assert!(at(&response, "e", 20.0).abs() < 1e-12);
    assert!(response.work.steps < 5_000, "{:?}", response.work);
}

#[test]
fn a_limit_on_the_step_finds_a_state_that_rests_elsewhere() {
    let text = "states = { x = '1' }\nder = { x = 'exp(-(time - 500)^2)' }\ntolerance = { max-step = '1 s' }";
    let response = respond(&read(text).unwrap(), &[], &[], 1000.0);
    assert!((at(&response, "x", 1000.0) - std::f64::consts::PI.sqrt()).abs() < 1e-6);
}

#[test]
fn a_declared_size_replaces_an_unknown_one() {
    let text = "states = { q = { unit = 'C', scale = '1 nC' } }\nder = { q = '0' }";
    assert!(read(text).is_ok());
    let mistake = read("states = { q = { unit = 'C', scale = '-1 nC' } }\nder = { q = '0' }").err().expect("a mistake");
    assert_eq!(mistake.to_string(), "states.q.scale: expected a positive size, found -0.000000001");
}

#[test]
fn a_state_that_only_integrates_a_cancelled_difference_does_not_stop_the_simulation() {
    // A disturbance d acts on w after 35 s, and through a feedforward on x, so that x + w is 0 in exact arithmetic. The
    // integrator i of the controller has the rounding of x + w, which returns through the delay of 14.7 s.
    let text = "states = { x = 'K', w = 'K', i = 'V', z = '1' }\ninputs = { d = '1' }\n\
                outputs = { y = { value = 'x + w', unit = 'K' } }\n\
                let = { f = '-1 [V]*(21.3/25*d + (1 - 21.3/25)*z)', u = '-1 [V/K]*(x + w) + i + delay(f, \"20.3 s\")' }\n\
                [der]\nx = '(1 [K/V]*delay(u, \"14.7 s\") - x)/21.3 [s]'\nw = '(1 [K]*delay(d, \"35 s\") - w)/25 [s]'\n\
                i = '-1 [V/K]*(x + w)/30 [s]'\nz = '(d - z)/25 [s]'";
    let model = read(text).unwrap_or_else(|mistake| panic!("{mistake}\n{text}"));
    let step = Input::Step { time: 0.0, before: 0.0, after: 1.0 };
    let response = respond(&model, &[("d", step)], &[], 500.0);
    assert!((at(&response, "w", 60.0) - (1.0 - math::exp(-1.0))).abs() < 1e-8);
    assert!(at(&response, "i", 500.0).abs() < 1e-9 && at(&response, "y", 100.0).abs() < 1e-9);
    let pieces = response.traces.iter().map(|(_, trace)| trace.knots().len()).max().unwrap();
    assert!(response.work.steps < 30_000 && pieces < 60_000, "{:?} {pieces}", response.work);
}
