//! Models from text, compared with an independent integration, closed forms and compiled models.

use mops_core::{Analysis, Case, Failure, Input, Job, Model, Response, StudyError};
use mops_math as math;
use mops_models::equations::EquationsOptions;
use mops_models::{equations, kernel::Simulated};

type Equations = Simulated<equations::Equations>;

mod clocks;
mod controllers;
mod delays;
mod dry_friction;
mod events;
mod filters;
mod graph;
mod key;
mod large;
mod linear;
mod order;
mod scales;
mod tables;
mod units;

const TIGHT: &str = "\n[tolerance]\nrelative = 1e-10\nabsolute = 1e-12\n";

fn read(text: &str) -> Result<Equations, StudyError> {
    let options = toml::from_str::<EquationsOptions>(text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    equations::Equations::new(&options).map(Simulated::new)
}

fn model(text: &str) -> Equations {
    read(&format!("{text}{TIGHT}")).unwrap_or_else(|mistake| panic!("{mistake}\n{text}"))
}

fn values(model: &Equations, given: &[(&str, f64)]) -> Vec<f64> {
    let value = |p: &mops_core::Parameter| {
        let given = given.iter().find(|(name, _)| *name == p.variable.name).map(|(_, v)| *v);
        given.or(p.default).unwrap_or_else(|| panic!("{} has no value", p.variable.name))
    };
    for (name, _) in given {
        assert!(model.interface().parameters.iter().any(|p| p.variable.name == *name), "no parameter {name}");
    }
    model.interface().parameters.iter().map(value).collect()
}

fn attempt(model: &Equations, inputs: &[(&str, Input)], given: &[(&str, f64)], end: f64) -> Result<Response, Failure> {
    let inputs = inputs.iter().map(|(name, input)| ((*name).to_owned(), input.clone())).collect();
    let case = Case { inputs, ..Case::default() };
    let signals: Vec<usize> = (0..model.interface().signals.len()).collect();
    let job = Job { case: &case, parameters: &values(model, given), signals: &signals, horizon: end };
    let Analysis::Time(response) = model.analyse(&job)? else { panic!("a simulation") };
    Ok(response)
}

fn respond(model: &Equations, inputs: &[(&str, Input)], given: &[(&str, f64)], end: f64) -> Response {
    attempt(model, inputs, given, end).expect("it simulates")
}

fn at(response: &Response, signal: &str, t: f64) -> f64 {
    response.trace(signal).unwrap_or_else(|| panic!("no signal {signal}")).at(t)
}

fn sine(amplitude: f64, angular: f64, offset: f64) -> Input {
    Input::Sine { amplitude, frequency: angular / std::f64::consts::TAU, phase: 0.0, offset }
}

/// Test plant of `tests/equations`: text, inputs, parameters, end of the simulation, final states.
type Plant = (&'static str, Vec<(&'static str, Input)>, Vec<(&'static str, f64)>, f64, &'static [f64]);

macro_rules! text {
    ($name:literal) => {
        include_str!(concat!("../../equations/", $name, ".toml"))
    };
}

/// Returns the test plants. The final states are those printed by `tests/equations/reference.py`.
#[rustfmt::skip]
fn plants() -> Vec<Plant> {
    vec![
        (text!("furuta-free"), vec![("u", sine(0.05, 4.0, 0.0))],
            vec![("b", 0.0075), ("c", 0.0036), ("d", 0.21), ("bp", 2e-4), ("ba", 9e-4), ("th0", 2.0), ("ph0", 0.3)],
            3.0, &[3.7431043318, 5.7152360653, 4.4469232724, 1.704247677]),
        (text!("furuta-driven"), vec![("u", sine(0.05, 4.0, 0.0))],
            vec![("a", 0.00614), ("b", 0.0118), ("c", 0.00233), ("d", 0.137), ("bp", 5e-4), ("ba", 1.5e-3), ("th0", 3.2), ("thd0", 0.5), ("phd0", -1.0)],
            3.0, &[2.9368409441, 0.62482343323, -0.0070260250304, -0.79610725078]),
        (text!("servo"), vec![("i", sine(2.0, 3.0, 0.0))],
            vec![("J", 2.8e-3), ("b", 7e-4), ("q0", 0.2), ("w0", -1.0)], 4.0, &[31.013125906, -6.770044775]),
        (text!("spring"), vec![("u", sine(3.0, 10.0, 0.0))],
            vec![("m", 0.8), ("c", 0.64), ("k", 127.0), ("x0", 0.01), ("v0", 0.5)], 3.0, &[-0.05789980177, -0.031249271441]),
        (text!("tanks"), vec![("u", sine(2.0, 0.1, 5.0))],
            vec![("kp", 19.5), ("a1", 1.12), ("a2", 0.468), ("h10", 8.9), ("h20", 8.0)], 120.0, &[1.8866588958, 20.151717135]),
        (text!("pendulum"), vec![], vec![("L", 0.444), ("b", 0.138), ("th0", 1.1)], 5.0, &[-0.74596138245, 0.83689455346]),
        (text!("pendulum-height"), vec![],
            vec![("L", 0.2), ("b", 0.204), ("th0", 0.9), ("w0", 0.3)], 5.0, &[-0.40622404271, -2.3412278909]),
        (text!("axis"), vec![("u", sine(5.0, 2.0, 0.0))],
            vec![("m", 1.48), ("b", 5.92), ("v0", 0.1)], 4.0, &[0.32933137636, 0.71764076787]),
        (text!("ball"), vec![], vec![("b", 0.0944), ("y0", 1.2), ("v0", 8.5)], 1.5, &[2.5551717626, -6.3429282144]),
        (text!("room"), vec![("P", Input::Constant(1.5)), ("To", sine(3.0, 7e-5, 5.0))],
            vec![("C", 1320.0), ("R", 5.89), ("eta", 0.484), ("T0", 18.0)], 86400.0, &[7.5120213086]),
    ]
}

#[test]
fn ten_plants_written_by_hand_agree_with_an_independent_integration() {
    for (text, inputs, given, end, states) in plants() {
        let model = model(text);
        let response = respond(&model, &inputs, &given, end);
        for (state, expected) in model.interface().states.iter().zip(states) {
            let last = response.trace(&state.name).unwrap().last();
            assert!(
                (last - expected).abs() < 1e-7 * expected.abs().max(1.0),
                "{} {last} {expected}\n{text}",
                state.name
            );
        }
    }
}

#[test]
fn the_tape_of_the_furuta_pendulum_is_about_as_short_as_its_equations() {
    for text in [text!("furuta-free"), text!("furuta-driven")] {
        let instructions = model(text).plant_model().instructions();
        assert!(instructions <= 24, "{instructions}");
    }
}

#[test]
fn tangents_agree_with_central_differences() {
    for (text, inputs, given, end, _) in plants() {
        let model = model(text);
        let inputs = inputs.iter().map(|(name, input)| ((*name).to_owned(), input.clone())).collect();
        let case = Case { inputs, ..Case::default() };
        let parameters = values(&model, &given);
        let signals: Vec<usize> = (0..model.interface().states.len()).collect();
        let seeds: Vec<Vec<f64>> = (0..parameters.len())
            .map(|i| (0..parameters.len()).map(|j| f64::from(u8::from(i == j))).collect())
            .collect();
        let analyse = |parameters: &[f64]| {
            let job = Job { case: &case, parameters, signals: &signals, horizon: end };
            model.analyse(&job).expect("it simulates")
        };
        let job = Job { case: &case, parameters: &parameters, signals: &signals, horizon: end };
        let (value, tangents) = model.tangents(&job, &seeds).unwrap().unwrap();
        for (i, tangent) in tangents.iter().enumerate() {
            let h = 1e-5 * parameters[i].abs().max(1e-2);
            let moved = |sign: f64| {
                let mut p = parameters.clone();
                p[i] += sign * h;
                analyse(&p)
            };
            let (up, down) = (moved(1.0), moved(-1.0));
            for state in &model.interface().states {
                let last = |a: &Analysis| a.trace(&state.name).last();
                assert_eq!(last(&value), last(&analyse(&parameters)), "tangents change no value");
                let difference = (last(&up) - last(&down)) / (2.0 * h);
                let close = 1e-4 * difference.abs().max(1e-3 / h * 1e-4).max(1e-4);
                assert!(
                    (last(tangent) - difference).abs() < close,
                    "{} {i}: {} {difference}\n{text}",
                    state.name,
                    last(tangent)
                );
            }
        }
    }
}

#[test]
fn a_model_from_text_agrees_with_the_compiled_model_with_dry_friction() {
    use mops_models::furuta::Furuta;
    use mops_models::kernel::Tolerance;
    let friction = "\n[friction]\nth = { viscous = 'bp', coulomb = 'cp' }\nphd = { viscous = 'ba', coulomb = 'ca' }\n";
    let text = text!("furuta-driven")
        .replace(" - bp*thd\"", "\"")
        .replace(" - ba*phd\"", "\"")
        .replace("ba = \"N m s/rad\"", "ba = \"N m s/rad\", ca = \"N m\", cp = \"N m\"");
    let ours = model(&format!("{text}{friction}"));
    let torque = sine(0.012, 4.0, 0.0);
    let p = [
        ("a", 0.0044),
        ("b", 0.0118),
        ("c", 0.0036),
        ("d", 0.105),
        ("ba", 2e-3),
        ("bp", 3e-4),
        ("ca", 0.01),
        ("cp", 2e-3),
    ];
    let given: Vec<(&str, f64)> = p.iter().copied().chain([("th0", 2.2), ("thd0", 1.78)]).collect();
    let response = respond(&ours, &[("u", torque.clone())], &given, 6.0);
    let compiled = Furuta::model(None, Tolerance { relative: 1e-10, absolute: Some(1e-12), ..Tolerance::default() });
    let case = Case { inputs: vec![("u".into(), torque)], ..Case::default() };
    let parameters: Vec<f64> = p.iter().map(|(_, v)| *v).chain([0.0, 0.0, 2.2, 1.78]).collect();
    let job = Job { case: &case, parameters: &parameters, signals: &[0, 2], horizon: 6.0 };
    let reference = compiled.analyse(&job).unwrap();
    let sticks = |events: &[mops_core::model::Event]| events.iter().filter(|e| e.what.contains("sticks")).count();
    assert!(sticks(&response.events) >= 3, "{:?}", response.events);
    assert_eq!(response.events.len(), reference.response().unwrap().events.len());
    for (mine, its) in response.events.iter().zip(&reference.response().unwrap().events) {
        assert!((mine.time - its.time).abs() < 1e-7, "{mine:?} {its:?}");
    }
    for t in [0.5, 2.0, 4.0, 6.0] {
        assert!((at(&response, "ph", t) - reference.trace("phi").at(t)).abs() < 1e-8);
        assert!((at(&response, "th", t) - reference.trace("theta").at(t)).abs() < 1e-8);
    }
}

#[test]
fn a_block_on_a_belt_sticks_and_slips_with_the_period_of_the_closed_form() {
    // Position x of the block, spring force k x, belt with speed w. Positions are relative to the start of the belt, so
    // the speed relative to the belt is u = v - w. The block sticks while k |x| <= peak c, then follows a sine about x
    // = c/k until u is 0 again.
    let (m, k, c, peak, w) = (1.0_f64, 4.0_f64, 2.0_f64, 1.5_f64, 0.3_f64);
    let text = "
        states = { x = 'm', s = 'm', u = 'm/s' }
        parameters = { m = 'kg', k = 'N/m', c = 'N', w = 'm/s' }
        der = { s = 'u', x = 'u + w', u = \"m*u' = -k*x\" }
        friction.s = { coulomb = 'c', peak = 1.5 }
        start = { x = '-c/k' }";
    let model = model(text);
    let response = respond(&model, &[], &[("m", m), ("k", k), ("c", c), ("w", w)], 20.0);
    let slides: Vec<f64> = response.events.iter().filter(|e| e.what == "s slides").map(|e| e.time).collect();
    // The belt carries the block in +x until the spring force is peak c; then x = c/k + A cos(angular t - start).
    let angular = (k / m).sqrt();
    let above = (peak - 1.0) * c / k; // break-away position relative to the centre of the sine at x = c/k
    let start = math::atan2(w / angular, above);
    // Speed of x: -A angular sin(angular t - start), equal to w at t = 0 and at angular t = 2 start + pi.
    let slip = (2.0 * start + std::f64::consts::PI) / angular;
    let stick = 2.0 * above / w;
    assert!(slides.len() > 3, "{:?}", response.events);
    for pair in slides[1..].windows(2) {
        assert!((pair[1] - pair[0] - (slip + stick)).abs() < 1e-8, "{} {}", pair[1] - pair[0], slip + stick);
    }
}

#[test]
fn no_step_crosses_a_kink_and_a_kink_costs_one_event() {
    // x' = max(sin t, 0): x = 1 - cos t up to pi, then 2 up to 2 pi.
    let rectifier = model("states = { x = '1' }\nder = { x = 'max(sin(time), 0)' }");
    let response = respond(&rectifier, &[], &[], 20.0);
    for t in [1.0_f64, 3.0, 4.0, 6.0] {
        let exact = if t < std::f64::consts::PI { 1.0 - math::cos(t) } else { 2.0 };
        assert!((at(&response, "x", t) - exact).abs() < 1e-9, "{t}");
    }
    assert!(response.work.steps < 400, "{:?}", response.work);
    // Saturation and dead zone, by the area under them.
    let clipped = model("states = { x = '1' }\nder = { x = 'clip(time - 1, -0.5, 0.5) + deadzone(time, -1, 2)' }");
    let response = respond(&clipped, &[], &[], 3.0);
    // clip: -0.5 up to 0.5 s, a ramp up to 1.5 s, 0.5 up to 3 s; deadzone: (t - 2) from 2 s on.
    let exact = -0.5 * 0.5 + 0.0 + 0.5 * 1.5 + 0.5;
    assert!((at(&response, "x", 3.0) - exact).abs() < 1e-10, "{} {exact}", at(&response, "x", 3.0));
}

#[test]
fn a_tank_runs_empty_stays_empty_and_fills_again() {
    let inflow = Input::Step { time: 60.0, before: 0.0, after: 5.0 };
    let model = model(text!("tanks"));
    let given = [("kp", 19.5), ("a1", 1.12), ("a2", 0.468), ("h10", 8.9), ("h20", 0.0)];
    let response = respond(&model, &[("u", inflow)], &given, 100.0);
    // sqrt(h) decreases by a1/A1 sqrt(g/2) per second: empty after 95/1.12 sqrt(2 8.9/981) = 11.43 s.
    let empty = 95.0 / 1.12 * (2.0 * 8.9_f64 / 981.0).sqrt();
    let half = 8.9 * math::powi(1.0 - 5.0 / empty, 2);
    assert!((at(&response, "h1", 5.0) - half).abs() < 1e-8);
    for t in [empty + 0.1, 30.0, 59.0] {
        assert!(at(&response, "h1", t).abs() < 1e-7, "{t}: {}", at(&response, "h1", t));
    }
    assert!(at(&response, "h1", 100.0) > 1.0);
    assert!(response.work.steps + response.work.rejected < 2000, "{:?}", response.work);
}

#[test]
fn a_noisy_input_at_a_kink_costs_steps_in_proportion_to_its_samples() {
    // A tank that stays nearly empty, with an inflow that changes every second.
    let times: Vec<f64> = (0..200).map(f64::from).collect();
    let levels: Vec<f64> = (0..200).map(|k| f64::from(k * 7919 % 13) * 0.02).collect();
    let inflow = Input::Sampled { times, values: levels, hold: mops_core::case::Hold::Zero };
    let model = model(text!("tanks"));
    let given = [("kp", 19.5), ("a1", 1.12), ("a2", 0.468)];
    let response = respond(&model, &[("u", inflow)], &given, 200.0);
    assert!(response.work.steps < 100 * 200, "{:?}", response.work);
}

#[test]
fn a_ball_bounces_by_its_rule() {
    let text = "
        states = { h = 'm', v = 'm/s' }
        parameters = { e = '1' }
        constants = { g = '9.81 m/s2' }
        der = { h = 'v', v = '-g' }
        start = { h = 1 }
        when.bounce = { guard = 'h', reset = { v = '-e*v' } }";
    let response = respond(&model(text), &[], &[("e", 0.8)], 2.0);
    let fall = (2.0 / 9.81_f64).sqrt();
    let exact = [fall, fall * 2.6, fall * 3.88];
    let bounces: Vec<f64> = response.events.iter().filter(|e| e.what == "bounce").map(|e| e.time).collect();
    assert_eq!(bounces.len(), 3, "{bounces:?}");
    for (t, exact) in bounces.iter().zip(exact) {
        assert!((t - exact).abs() < 1e-10, "{t} {exact}");
    }
}

#[test]
fn an_event_happens_once_until_its_guard_was_positive_again() {
    // Thermostat: the heater switches on below 19 and off above 21; its power is a state that events set.
    let text = "
        states = { T = 'K', heat = 'K/s' }
        der = { T = '-0.1 [1/s]*(T - 10) + heat', heat = 0 }
        start = { T = 20 }
        when.on  = { guard = 'T - 19', reset = { heat = 2 } }
        when.off = { guard = '21 - T', reset = { heat = 0 } }";
    let response = respond(&model(text), &[], &[], 30.0);
    let names: Vec<&str> = response.events.iter().map(|e| e.what.as_str()).collect();
    assert!(names.len() > 6, "{names:?}");
    for (k, name) in names.iter().enumerate() {
        assert_eq!(*name, if k % 2 == 0 { "on" } else { "off" }, "{names:?}");
    }
    assert!((response.events[0].time - 10.0 * math::ln(10.0_f64 / 9.0)).abs() < 1e-9);
}

#[test]
fn jumps_are_exact_and_dry_friction_as_a_sign_is_reported_as_a_failure() {
    let jump = model(
        "states = { x = '1' }\nparameters = { when_ = 's' }\nder = { x = 'if(time >= when_, 3, time < 0.5, 1, 0)' }",
    );
    let response = respond(&jump, &[], &[("when_", 1.25)], 2.0);
    assert!((at(&response, "x", 2.0) - (0.5 + 3.0 * 0.75)).abs() < 1e-12, "{}", at(&response, "x", 2.0));
    let chatter = model("states = { x = '1' }\nstart = { x = 1 }\nder = { x = '-sign(x)' }");
    let failure = attempt(&chatter, &[], &[], 2.0).unwrap_err();
    assert!(failure.to_string().contains("friction"), "{failure}");
}

#[test]
fn a_mass_matrix_of_three_is_solved_and_a_singular_one_is_a_failure() {
    // M x' = (1, 2, 3) with M = [[2, 1, 0], [1, p, 1], [0, 1, 4]]. For p = 3 the derivatives follow from Cramer's rule;
    // for p = 0.75 the determinant 8 p - 6 is zero.
    let text = "
        states = { x = '1', y = '1', z = '1' }
        parameters = { p = '1' }
        der = { x = \"2*x' + y' = 1\", y = \"x' + p*y' + z' = 2\", z = \"y' + 4*z' = 3\" }
        outputs = { rate = \"x' + y'\" }";
    let model = model(text);
    let response = respond(&model, &[], &[("p", 3.0)], 1.0);
    let d = 18.0;
    let y = (2.0 * (2.0 * 4.0 - 3.0) - 4.0) / d;
    let (x, z) = ((1.0 - y) / 2.0, (3.0 - y) / 4.0);
    for (signal, exact) in [("x", x), ("y", y), ("z", z), ("rate", x + y)] {
        assert!((at(&response, signal, 1.0) - exact).abs() < 1e-12, "{signal}");
    }
    let failure = attempt(&model, &[], &[("p", 0.75)], 1.0).unwrap_err();
    assert_eq!(failure, Failure::Undefined("the mass matrix is singular at the start".into()));
}

#[test]
fn a_heat_rod_of_a_hundred_nodes_takes_few_lines() {
    let text = "
        states = { 'T[1..100]' = 'K' }
        parameters = { k = '1/s' }
        constants = { n = 100 }
        let = { 'q[i=1..99]' = 'k*(T[i+1] - T[i])' }
        start = { 'T[i]' = '20 K' }
        [der]
        'T[i]'   = 'q[i] - q[i-1]'
        'T[1]'   = 'q[1]'
        'T[100]' = '-q[n-1] + k*(50 - T[n])'";
    let model = model(text);
    assert_eq!(model.interface().states[99].start, "T0[100]");
    let response = respond(&model, &[], &[("k", 10.0)], 2.0);
    // Explicit Euler with tiny steps would be slow as a reference. Instead: the middle is still unaffected, the end
    // warms like a half-infinite rod, and heat is conserved.
    assert!((at(&response, "T[10]", 2.0) - 20.0).abs() < 1e-9);
    let warm: Vec<f64> = (1..=100).map(|k| at(&response, &format!("T[{k}]"), 2.0)).collect();
    assert!(warm.windows(2).all(|w| w[1] >= w[0] - 1e-9), "monotone");
    // In units of the spacing: u(d) = 30 erfc(d / sqrt(4 k t)), with the distance d from the wall at node 101.
    let erfc_of_half = 0.479_500_122_2;
    let d = 0.5 * (4.0_f64 * 10.0 * 2.0).sqrt();
    let node = 101.0 - d;
    let (low, part) = (node.floor(), node.fract());
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let index = low as usize - 1;
    let here = warm[index] * (1.0 - part) + warm[index + 1] * part;
    assert!((here - 20.0 - 30.0 * erfc_of_half).abs() < 0.15, "{here}");
    let pattern = model.plant_model().jacobian_pattern();
    assert_eq!(pattern.len(), 3 * 100 - 2);
    assert!(pattern.iter().all(|&(row, column)| row.abs_diff(column) <= 1));
}

#[test]
fn a_stiff_rod_by_the_stiff_method_takes_few_steps_to_the_same_result() {
    // A radiating rod, so that the Jacobian changes; exact Jacobian, eight columns at once.
    let text = "
        states = { 'T[1..100]' = 'K' }
        parameters = { k = '1/s' }
        start = { 'T[i]' = 300 }
        [der]
        'T[i]'   = 'k*(T[i-1] - 2*T[i] + T[i+1]) - 1e-10 [1/K3/s]*(T[i]^4 - 300^4)'
        'T[1]'   = 'k*(400 - 2*T[1] + T[2]) - 1e-10 [1/K3/s]*(T[1]^4 - 300^4)'
        'T[100]' = 'k*(T[99] - T[100]) - 1e-10 [1/K3/s]*(T[100]^4 - 300^4)'
        [tolerance]
        relative = 1e-8
        absolute = 1e-8
        ";
    let explicit = respond(&read(text).unwrap(), &[], &[("k", 1000.0)], 1.0);
    let stiff = respond(&read(&format!("{text}method = 'stiff'")).unwrap(), &[], &[("k", 1000.0)], 1.0);
    for signal in ["T[1]", "T[20]", "T[50]"] {
        let (a, b) = (at(&explicit, signal, 1.0), at(&stiff, signal, 1.0));
        assert!((a - b).abs() < 1e-4, "{signal}: {a} {b}");
    }
    assert!(stiff.work.steps * 5 < explicit.work.steps, "{:?} {:?}", stiff.work, explicit.work);
}

#[test]
fn derivatives_at_an_operating_point_are_those_of_the_equations() {
    use mops_core::model::OperatingPoint;
    let model = model(&format!("{}friction.q = {{ coulomb = 0.3 }}", text!("servo")));
    let (j, b) = (2.0, 0.5);
    let point = OperatingPoint {
        parameters: &[j, b, 0.0, 0.0],
        states: &[0.1, 0.0],
        inputs: &[3.0],
        past: &[],
        at_rest: false,
    };
    let local = model.local(&point).unwrap().unwrap();
    assert_eq!(local.rates, [0.0, 0.052 * 3.0 / j]);
    assert!((local.slopes[(1, 1)] + b / j).abs() < 1e-15 && (local.slopes[(1, 2)] - 0.052 / j).abs() < 1e-15);
    assert_eq!(local.slopes[(0, 1)], 1.0);
}

#[test]
fn dry_friction_is_omitted_at_an_equilibrium_and_in_its_derivatives() {
    use mops_core::{
        Case,
        model::{Linearise, Linearised, OperatingPoint},
    };
    use mops_language::Quantity;
    let text = "
        states = { ph = 'rad', w = 'rad/s' }
        inputs = { u = 'N m' }
        der = { ph = 'w', w = \"0.01 [kg m2]*w' = u - 0.6 [N m]*sin(ph)\" }
        friction.ph = { coulomb = 0.05, viscous = 0.002, peak = 1.3 }
        ";
    let at = vec![("ph".to_owned(), Quantity::parse("0.3").unwrap())];
    let options = Linearise { at, equilibrium: true, free: vec!["u".to_owned()], ..Linearise::default() };
    let trim = Linearised::new(std::sync::Arc::new(model(text)), &options).unwrap();
    // From rest, and from a search that passes through speeds of either sign.
    for w0 in [0.0, 1e-6, -3.0] {
        let found = trim.at(&Case::default(), &[0.0, w0]).unwrap();
        assert!((found.inputs[0] - 0.6 * math::sin(0.3)).abs() < 1e-12, "{}", found.inputs[0]);
        assert!((found.system.a[(1, 0)] + 60.0 * math::cos(0.3)).abs() < 1e-9, "{}", found.system.a);
        assert!((found.system.a[(1, 1)] + 0.2).abs() < 1e-12 && found.frictionless == ["ph"]);
    }
    let rate = |w: f64, at_rest: bool| {
        let point = OperatingPoint { parameters: &[0.0, 0.0], states: &[0.0, w], inputs: &[0.0], past: &[], at_rest };
        let local = model(text).local(&point).unwrap().unwrap();
        (local.rates[1], local.frictionless.len())
    };
    // A moving joint slides; speeds within rounding count as rest.
    assert!((rate(2.0, false).0 + 5.4).abs() < 1e-12 && (rate(-2.0, false).0 - 5.4).abs() < 1e-12);
    assert!(rate(1e-12, false).0.abs() < 1e-9 && rate(2.0, false).1 == 0 && rate(1e-12, false).1 == 1);
    assert!((rate(2.0, true).0 + 0.4).abs() < 1e-12);
}

#[test]
fn places_of_effects_have_the_names_of_joints_states_inputs_and_signals() {
    let places =
        |text: &str| -> Vec<String> { model(text).interface().ports.iter().map(ToString::to_string).collect() };
    assert_eq!(
        places(text!("furuta-free")),
        [
            "joint:th",
            "process:th",
            "joint:ph",
            "process:ph",
            "actuator:u",
            "sensor:th",
            "sensor:thd",
            "sensor:ph",
            "sensor:phd"
        ]
    );
    assert_eq!(places(text!("room")), ["process:T", "actuator:P", "actuator:To", "sensor:T"]);
    let named = format!("{}\n[ports]\narm = {{ joint = 'ph' }}", text!("furuta-free"));
    assert!(places(&named).contains(&"joint:arm".to_owned()));
}

#[test]
fn an_output_of_time_is_exact_while_the_state_rests() {
    let model = model(
        "states = { x = '1' }\nder = { x = '0' }\noutputs = { y = 'sin(20*time)', z = '1/(1 + 25*(time - 4)^2)' }",
    );
    let response = respond(&model, &[], &[("x0", 1.0)], 10.0);
    for i in 0..=1000 {
        let t = 0.01 * f64::from(i);
        let (y, z) = (math::sin(20.0 * t), 1.0 / (1.0 + 25.0 * math::powi(t - 4.0, 2)));
        assert!((at(&response, "y", t) - y).abs() < 1e-8 && (at(&response, "z", t) - z).abs() < 1e-8, "{t}");
    }
}

#[test]
fn definitions_are_in_any_order_and_initial_values_may_be_expressions() {
    let text = "
        states = { x = 'm', v = 'm/s' }
        parameters = { w = 'rad/s', A = 'm', s = 'm' }
        let = { a = '-k*x', k = 'w^2' }
        start = { x = 's', v = '2*A*w' }
        der = { x = 'v', v = 'a' }";
    let model = model(text);
    let response = respond(&model, &[], &[("w", 3.0), ("A", 0.5), ("s", 0.1)], 1.0);
    assert!((at(&response, "x", 1.0) - (0.1 * math::cos(3.0) + math::sin(3.0))).abs() < 1e-9);
    let response = respond(&model, &[], &[("w", 3.0), ("A", 0.5), ("s", 0.1), ("v0", 0.0)], 1.0);
    assert!(
        (at(&response, "x", 1.0) - 0.1 * math::cos(3.0)).abs() < 1e-9,
        "a given initial value overrides the expression"
    );
    assert_eq!(model.start_values(&[3.0, 0.5, 0.1, f64::NAN]), Some(vec![0.1, 3.0]));
    assert_eq!(model.interface().states[0].start, "s");
    assert_eq!(model.interface().states[1].rate_of.as_deref(), Some("x"));
}

#[test]
fn every_mistake_names_its_place() {
    let of = |text: &str| {
        let mistake = read(text).err().unwrap_or_else(|| panic!("nothing wrong?\n{text}"));
        (mistake.path.join("."), mistake.span.clone().map(|s| (s.start, s.end)), mistake.to_string())
    };
    let base = "states = { x = 'm', v = 'm/s' }\n";
    type Wrong = (&'static str, &'static str, Option<(usize, usize)>, &'static str);
    let cases: [Wrong; 16] = [
        ("der = { x = 'v', v = '-q*x' }", "der.v", Some((1, 2)), "no quantity `q`"),
        ("der = { x = 'v' }", "states.v", None, "state `v` has no equation"),
        ("der = { x = 'v', y = '1', v = '0' }", "der.y", None, "no state `y`"),
        ("der = { x = 'v', v = '2*(x + 1' }", "der.v", Some((8, 8)), "`)`"),
        ("der = { x = 'a', v = '0' }\nlet = { a = '2*b', b = 'a' }", "let.b", Some((0, 1)), "circular"),
        ("parameters = { x = 'm' }\nder = { x = 'v', v = '0' }", "parameters.x", None, "both a state and a parameter"),
        ("parameters = { k = 'parsec' }\nder = { x = 'v', v = '0' }", "parameters.k", None, "not a known unit"),
        ("der = { x = 'v', v = \"x'^2 = 1\" }", "der.v", Some((0, 2)), "derivative is not allowed"),
        ("der = { x = \"v' = 1\", v = \"2*v' = x\" }", "der.x", None, "do not determine the derivative of `x`"),
        ("der = { x = 'v', v = 'v = 1' }", "der.v", None, "contains no derivative"),
        ("der = { x = 'v', v = '0' }\nstart = { x = '2*v' }", "start.x", Some((2, 3)), "parameters and constants only"),
        ("der = { x = 'v', v = '0' }\nfriction.v2 = { coulomb = 1 }", "friction.v2", None, "friction needs a joint"),
        ("parameters = { x0 = 'm' }\nder = { x = 'v', v = '0' }", "parameters.x0", None, "initial value"),
        ("der = { x = 'v', v = '0' }\nlet = { unused = 'qq' }", "let.unused", Some((0, 2)), "no quantity `qq`"),
        ("der = { x = 'v', v = 'table(x, 1, 2, 0, 3)' }", "der.v", Some((15, 16)), "must rise, but 0 follows 1"),
        ("der = { x = 'v', v = '0' }\nmass = { v = '1' }", "mass.v", None, "a row and a column"),
    ];
    for (text, path, span, words) in cases {
        let (found, place, message) = of(&format!("{base}{text}"));
        assert_eq!((found.as_str(), place), (path, span), "{message}\n{text}");
        assert!(message.contains(words), "{message}\n{text}");
    }
    let rod = "states = { 'T[1..3]' = 'K' }\nder = { 'T[i]' = 'T[i-1] - T[i]' }";
    assert!(of(rod).2.contains("there is no `T[0]` (where i is 1)"), "{}", of(rod).2);
}
