//! Models, compared with closed forms, published values and an independent integration.

mod effects_simulated;
mod effects_together;
mod furuta_bodies;
mod state_feedback;

use mops_core::{Case, Input, Job, Model, ModelOptions, Parameter, Response};
use mops_math as math;
use mops_models::furuta::Furuta;
use mops_models::kernel::Tolerance;
use mops_models::pid_loop::PidLoopOptions;

fn values(model: &dyn Model, given: &[(&str, f64)]) -> Vec<f64> {
    let value = |p: &Parameter| {
        let given = given.iter().find(|(name, _)| *name == p.variable.name).map(|(_, v)| *v);
        given.or(p.default).unwrap_or_else(|| panic!("{} has no value", p.variable.name))
    };
    model.interface().parameters.iter().map(value).collect()
}

pub(crate) fn respond(model: &dyn Model, case: &Case, parameters: &[(&str, f64)], horizon: f64) -> Response {
    simulate(model, case, &values(model, parameters), horizon)
}

fn simulate(model: &dyn Model, case: &Case, parameters: &[f64], horizon: f64) -> Response {
    let signals: Vec<usize> = (0..model.interface().signals.len()).collect();
    let analysis = model.analyse(&Job { case, parameters, signals: &signals, horizon }).expect("it simulates");
    analysis.response().expect("a simulation").clone()
}

/// Calls [`check_tangents_by`] with a relative step of one millionth.
fn check_tangents(model: &dyn Model, case: &Case, parameters: &[(&str, f64)], horizon: f64) {
    check_tangents_by(1e-6, model, case, parameters, horizon);
}

/// Compares tangents with respect to every parameter with central differences of simulations, at 200 times. The
/// difference step of a parameter is `step` times its value.
pub(crate) fn check_tangents_by(step: f64, model: &dyn Model, case: &Case, parameters: &[(&str, f64)], horizon: f64) {
    let values = values(model, parameters);
    let signals: Vec<usize> = (0..model.interface().signals.len()).collect();
    let finite: Vec<usize> = (0..values.len()).filter(|&i| values[i].is_finite()).collect();
    let seed = |&i: &usize| (0..values.len()).map(|j| f64::from(u8::from(i == j))).collect();
    let seeds: Vec<Vec<f64>> = finite.iter().map(seed).collect();
    let job = Job { case, parameters: &values, signals: &signals, horizon };
    let (analysis, tangents) = model.tangents(&job, &seeds).expect("there are tangents").expect("it simulates");
    let plain = simulate(model, case, &values, horizon);
    assert_eq!(plain.traces, analysis.response().unwrap().traces, "tangents change no bit");
    let times: Vec<f64> = (0..200).map(|i| horizon * (f64::from(i) + 0.5) / 200.0).collect();
    for (&i, tangent) in finite.iter().zip(&tangents) {
        let h = if values[i] == 0.0 { step } else { step * values[i].abs() };
        let moved = |by: f64| {
            let mut moved = values.clone();
            moved[i] += by;
            simulate(model, case, &moved, horizon)
        };
        let (high, low) = (moved(h), moved(-h));
        for (((name, tangent), (_, high)), (_, low)) in
            tangent.response().unwrap().traces.iter().zip(&high.traces).zip(&low.traces)
        {
            let tangent = tangent.sample(&times);
            let largest = tangent.iter().fold(0.1, |m: f64, t| m.max(t.abs()));
            let differences = high.sample(&times).into_iter().zip(low.sample(&times)).map(|(a, b)| (a - b) / (2.0 * h));
            let far = tangent.iter().zip(differences).map(|(t, d)| (t - d).abs()).fold(0.0, f64::max) / largest;
            let along = &model.interface().parameters[i].variable.name;
            assert!(far < 2e-5, "{name} along {along}: {far:.1e}");
        }
    }
}

const EXACT: Tolerance =
    Tolerance { relative: 1e-12, absolute: Some(1e-14), max_steps: 1_000_000, ..Tolerance::DEFAULT };

#[test]
fn tangents_of_a_furuta_pendulum_that_sticks_agree_with_differences() {
    let model = Furuta::model(None, EXACT);
    let swing = [
        ("a", 0.0044),
        ("b", 0.0118),
        ("c", 0.0036),
        ("d", 0.105),
        ("ba", 0.002),
        ("bp", 0.0003),
        ("ca", 0.02),
        ("cp", 0.004),
        ("theta0", 1.68),
        ("dtheta0", 1.78),
        ("phi0", 0.1),
        ("dphi0", -0.3),
    ];
    let torque = Input::Sine { amplitude: 0.05, frequency: 0.6, phase: 0.4, offset: 0.0 };
    let case = Case { inputs: vec![("u".into(), torque)], ..Case::default() };
    let events = respond(&model, &case, &swing, 3.0).events;
    assert!(
        events.iter().any(|e| e.what == "arm sticks") && events.iter().any(|e| e.what == "arm slides"),
        "{events:?}"
    );
    check_tangents(&model, &case, &swing, 3.0);
}

#[test]
fn tangents_of_a_saturated_pid_loop_agree_with_differences() {
    let model =
        pid(&format!("{THESIS_PLANT}limit = [-0.1, 1.2]\ntolerance = {{ relative = 1e-12, absolute = 1e-14 }}"));
    let values = [("k", 4.0), ("Ti", 2.0), ("Td", 1.0), ("Tt", 1.5), ("a", 0.0), ("b", -4.0), ("c", -1.0)];
    let events = respond(model.as_ref(), &Case::default(), &values, 20.0).events;
    assert!(events.len() > 1, "{events:?}");
    check_tangents(model.as_ref(), &Case::default(), &values, 20.0);
}

fn pid(options: &str) -> Box<dyn Model> {
    toml::from_str::<PidLoopOptions>(options).expect("options are right").build().expect("options make sense")
}

const THESIS_PLANT: &str = "plant = { poles = ['a', 'b', 'c'], gain = 1.0 }\nhorizon = 60.0\n";

/// Returns the overshoot over 1 and the last time outside 1 +- 0.01, from the trace.
fn overshoot_and_settling(response: &Response) -> (f64, f64) {
    let y = response.trace("y").unwrap();
    let mut settled = 0.0;
    for piece in y.pieces() {
        for level in [0.99, 1.01] {
            settled = y.crossing(&piece, level).map_or(settled, |t: f64| t.max(settled));
        }
    }
    (y.maximum().0 - 1.0, settled)
}

#[test]
fn pid_loop_agrees_with_the_published_design_tables() {
    let model = pid(THESIS_PLANT);
    // (k, Ti, Td), (a, b, c), overshoot, settling time: tables 5.1 to 5.3 of the thesis. Digits from an independent
    // integration (SciPy DOP853, rtol 1e-12).
    let rows = [
        ((4.0, 2.0, 1.0), (0.0, -4.0, -1.0), 0.315_794_212_2, 17.609_910_4),
        ((5.48078, 4.6697, 1.41883), (0.0, -4.0, -1.0), 0.086_381_008_3, 12.953_760_5),
        ((5.52434, 5.93807, 1.34739), (0.0, -4.0, -1.0), 0.073_613_621_5, 15.000_062_6),
        ((5.52434, 5.93807, 1.34739), (0.2, -4.8, -1.2), 0.274_298_879_3, 23.376_133_4),
        ((5.52434, 5.93807, 1.34739), (0.2, -3.2, -0.8), 0.394_611_329_7, 13.220_600_5),
        ((5.81163, 6.53286, 0.931463), (0.0, -4.0, -1.0), 0.105_139_131_0, 14.943_815_4),
        ((5.81163, 6.53286, 0.931463), (0.2, -4.8, -1.2), 0.307_592_255_9, 14.688_220_9),
        ((5.81163, 6.53286, 0.931463), (0.2, -3.2, -0.8), 0.410_065_018_9, 14.476_069_1),
    ];
    for ((k, ti, td), (a, b, c), overshoot, settling) in rows {
        let values = [("k", k), ("Ti", ti), ("Td", td), ("a", a), ("b", b), ("c", c)];
        let (o, s) = overshoot_and_settling(&respond(model.as_ref(), &Case::default(), &values, 60.0));
        assert!((o - overshoot).abs() < 2e-6, "overshoot {o} {overshoot}");
        assert!((s - settling).abs() < 1e-4, "settling {s} {settling}");
    }
}

#[test]
fn proportional_control_of_a_first_order_plant_is_its_closed_form() {
    // G = 1/(s + 1), k = 4: y = 0.8 (1 - exp(-5 t)); a load of 1 adds 0.2 times the same response.
    let model = pid("plant = { poles = [-1.0] }\nhorizon = 4.0\nload = { time = 2.0, size = 1.0 }");
    let values = [("k", 4.0), ("Ti", f64::INFINITY), ("Td", 0.0)];
    let response = respond(model.as_ref(), &Case::default(), &values, 4.0);
    let y = response.trace("y").unwrap();
    for t in [0.1_f64, 0.7, 1.9, 2.5, 3.9] {
        let load: f64 = if t > 2.0 { 0.2 * (1.0 - math::exp(-5.0 * (t - 2.0))) } else { 0.0 };
        let exact = 0.8 * (1.0 - math::exp(-5.0 * t)) + load;
        assert!((y.at(t) - exact).abs() < 1e-7, "{t}: {} {exact}", y.at(t));
    }
}

#[test]
fn a_transfer_function_is_the_same_by_roots_and_by_coefficients() {
    let roots = pid("plant = { poles = [0.0, -4.0, -1.0], zeros = [-2.0], gain = 3.0 }\nhorizon = 20.0");
    let coefficients = pid("plant = { numerator = [3.0, 6.0], denominator = [1.0, 5.0, 4.0, 0.0] }\nhorizon = 20.0");
    let values = [("k", 1.0), ("Ti", 3.0), ("Td", 0.2)];
    let [a, b] = [roots, coefficients].map(|m| respond(m.as_ref(), &Case::default(), &values, 20.0));
    assert_eq!(a.trace("y"), b.trace("y"));
}

#[test]
fn a_limited_actuator_stays_within_its_limits_and_does_not_wind_up() {
    let free = pid("plant = { poles = [0.0, -1.0] }\nhorizon = 30.0");
    let limited = pid("plant = { poles = [0.0, -1.0] }\nhorizon = 30.0\nlimit = [-0.5, 0.5]");
    let values = [("k", 3.0), ("Ti", 2.0), ("Td", 0.5)];
    let [free, limited] = [free, limited].map(|m| respond(m.as_ref(), &Case::default(), &values, 30.0));
    assert!(free.trace("u").unwrap().maximum().0 > 3.0);
    let u = limited.trace("u").unwrap();
    assert!(u.maximum().0 <= 0.5 + 1e-9 && u.minimum().0 >= -0.5 - 1e-9);
    assert!(!limited.events.is_empty());
    assert!((limited.trace("y").unwrap().last() - 1.0).abs() < 0.01);
}

#[test]
fn a_sampled_controller_tends_to_the_continuous_one_with_its_period() {
    let continuous = pid("plant = { poles = [-1.0, -2.0] }\nhorizon = 10.0");
    let values = [("k", 2.0), ("Ti", 1.5), ("Td", 0.3)];
    let exact = respond(continuous.as_ref(), &Case::default(), &values, 10.0);
    let mut errors = Vec::new();
    for period in [0.02, 0.01, 0.005] {
        let sampled =
            pid(&format!("plant = {{ poles = [-1.0, -2.0] }}\nhorizon = 10.0\nsample-time = {period}\ndelay = 0.0"));
        let response = respond(sampled.as_ref(), &Case::default(), &values, 10.0);
        errors.push((response.trace("y").unwrap().at(1.0) - exact.trace("y").unwrap().at(1.0)).abs());
    }
    // First order in the period: half the period halves the error.
    assert!(errors[0] < 0.05 && errors[1] / errors[0] < 0.6 && errors[2] / errors[1] < 0.6, "{errors:?}");
}

#[test]
fn a_sampled_controller_acts_after_its_delay() {
    let model = pid("plant = { poles = [-1.0] }\nhorizon = 1.0\nsample-time = 0.1\ndelay = 0.04");
    let response = respond(model.as_ref(), &Case::default(), &[("k", 2.0), ("Ti", 1.0), ("Td", 0.0)], 1.0);
    let u = response.trace("u").unwrap();
    assert_eq!((u.at(0.03), u.at(0.05)), (0.0, 2.0));
    // Delay of one period: the first output acts from the second sample to the third.
    let model = pid("plant = { poles = [-1.0] }\nhorizon = 1.0\nsample-time = 0.1\ndelay = 0.1");
    let response = respond(model.as_ref(), &Case::default(), &[("k", 2.0), ("Ti", 1.0), ("Td", 0.0)], 1.0);
    let u = response.trace("u").unwrap();
    assert_eq!((u.at(0.09), u.at(0.11), u.at(0.19)), (0.0, 2.0, 2.0));
    assert!(u.at(0.21) > 2.0, "the second sample's integral has grown");
}

/// Lumped parameters from table 4.5 of the thesis, before rounding.
const FURUTA: [(&str, f64); 4] = [("a", 9.035_24e-4), ("b", 1.133_13e-3), ("c", 6.309_84e-4), ("d", 2.526_663e-2)];

fn furuta(extra: &[(&'static str, f64)], case: &Case, horizon: f64) -> Response {
    let tolerance = Tolerance { relative: 1e-10, absolute: Some(1e-12), max_steps: 1_000_000, ..Tolerance::default() };
    let values: Vec<(&str, f64)> = FURUTA.iter().chain(extra).copied().collect();
    respond(&Furuta::model(None, tolerance), case, &values, horizon)
}

/// Returns kinetic and potential energy, J, from the Lagrangian of the equations.
fn energy(response: &Response, t: f64) -> f64 {
    let [phi_rate, theta, theta_rate] = ["dphi", "theta", "dtheta"].map(|s| response.trace(s).unwrap().at(t));
    let [a, b, c, d] = FURUTA.map(|(_, v)| v);
    let (sin, cos) = math::sin_cos(theta);
    0.5 * a * theta_rate * theta_rate
        + 0.5 * (b + a * sin * sin) * phi_rate * phi_rate
        + c * cos * phi_rate * theta_rate
        + d * cos
}

#[test]
fn without_friction_the_furuta_pendulum_keeps_its_energy() {
    let response = furuta(&[("theta0", 1.6803), ("dtheta0", 1.7812), ("dphi0", -0.0635)], &Case::default(), 10.0);
    let (start, end) = (energy(&response, 0.0), energy(&response, 10.0));
    assert!(((end - start) / start.abs().max(d_of_furuta())).abs() < 1e-7, "{start} {end}");
}

fn d_of_furuta() -> f64 {
    FURUTA[3].1
}

#[test]
fn small_swings_have_the_period_of_the_linearised_pendulum() {
    // About theta = pi with the arm free: w^2 = b d/(a b - c^2).
    let [a, b, c, d] = FURUTA.map(|(_, v)| v);
    let period = std::f64::consts::TAU / (b * d / (a * b - c * c)).sqrt();
    let response = furuta(&[("theta0", std::f64::consts::PI + 1e-4)], &Case::default(), 3.0);
    let theta = response.trace("theta").unwrap();
    assert!((theta.at(period) - std::f64::consts::PI - 1e-4).abs() < 1e-9);
}

#[test]
fn coulomb_friction_brings_the_pendulum_to_rest_and_it_stays_there_exactly() {
    let response = furuta(&[("theta0", 3.6), ("ca", 2e-3), ("cp", 8e-4)], &Case::default(), 20.0);
    let last = response.events.iter().rev().find(|e| e.what.contains("sticks")).expect("it sticks").time;
    assert!(last < 15.0, "{last}");
    for signal in ["phi", "theta"] {
        let trace = response.trace(signal).unwrap();
        assert_eq!(trace.at(last + 0.5), trace.at(20.0), "{signal} does not creep");
    }
    let theta = response.trace("theta").unwrap().at(20.0);
    assert!(theta != std::f64::consts::PI, "the pendulum rests off centre because of friction");
}

#[test]
fn a_stuck_arm_breaks_away_when_the_torque_exceeds_its_friction() {
    let ramp = Input::Sampled { times: vec![0.0, 1.0], values: vec![0.0, 4e-3], hold: mops_core::case::Hold::First };
    let case = Case { inputs: vec![("u".into(), ramp)], ..Case::default() };
    // Hanging at rest, only the input torque acts on the arm: the arm breaks away when the ramp reaches 1e-3, at 0.25
    // s.
    let response = furuta(&[("theta0", std::f64::consts::PI), ("ca", 1e-3)], &case, 1.0);
    let away = response.events.iter().find(|e| e.what == "arm slides").expect("it breaks away");
    assert!((away.time - 0.25).abs() < 1e-9, "{}", away.time);
    assert_eq!(response.trace("phi").unwrap().at(0.25), 0.0);
    assert!(response.trace("phi").unwrap().at(0.5) > 0.0);
}

#[test]
fn a_sliding_mass_stops_by_coulomb_friction_as_in_the_closed_form() {
    // With c = 0 and no gravity the arm is decoupled: constant deceleration ca/b, stop after w^2 b/(2 ca).
    let tolerance = Tolerance { relative: 1e-10, absolute: Some(1e-12), max_steps: 100_000, ..Tolerance::default() };
    let values = [("a", 1.0), ("b", 2.0), ("c", 0.0), ("d", 0.0), ("ca", 0.5), ("dphi0", 1.5)];
    let response = respond(&Furuta::model(None, tolerance), &Case::default(), &values, 10.0);
    assert!((response.trace("phi").unwrap().at(10.0) - 1.5 * 1.5 * 2.0 / (2.0 * 0.5)).abs() < 1e-9);
    assert!((response.events[0].time - 1.5 * 2.0 / 0.5).abs() < 1e-9);
}

#[test]
fn a_joint_that_breaks_away_for_a_moment_only_sticks_again() {
    // Torques that exceed the friction by 1 % briefly: in each period the arm moves a little and stops.
    let sine = Input::Sine { amplitude: 1.01e-3, frequency: 2.0, phase: 0.0, offset: 0.0 };
    let case = Case { inputs: vec![("u".into(), sine)], ..Case::default() };
    let response = furuta(&[("theta0", std::f64::consts::PI), ("ca", 1e-3)], &case, 5.0);
    let slides = response.events.iter().filter(|e| e.what == "arm slides").count();
    assert_eq!(slides, 20, "twice a period: {:?}", response.events);
}

#[test]
fn swings_with_dry_friction_never_chatter() {
    // Over a grid of frictions and initial states every simulation finishes, with a moderate number of events.
    for ca in [1e-4, 7.67e-4, 8.28e-4, 2e-3] {
        for cp in [0.0, 1.2e-4, 1.77e-4] {
            for theta0 in [-2.07, 0.4, 1.68, 3.0] {
                let start = [("theta0", theta0), ("dtheta0", -9.2), ("dphi0", -2.1), ("ca", ca), ("cp", cp)];
                let response = furuta(&start, &Case::default(), 6.0);
                assert!(response.events.len() < 200, "{ca} {cp} {theta0}: {}", response.events.len());
            }
        }
    }
}
