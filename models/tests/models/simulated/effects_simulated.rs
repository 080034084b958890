//! Effects in simulations, compared with closed forms.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use mops_core::{
    Analysis, Case, Effect, Input, Job, Model, ModelOptions,
    case::Hold,
    effect::{Between, EffectParameter, Placement, Port, PortKind},
};
use mops_effects::effects;
use mops_math as math;
use mops_models::WithEffects;
use mops_models::equations::EquationsOptions;

const BLOCK: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg" }
der        = { x = "v", v = "m*v' = u" }
"#;

/// [`BLOCK`] with a damper, with and without its position.
const DAMPED: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", d = "N*s/m" }
der        = { x = "v", v = "m*v' = u - d*v" }
"#;

const SPEED: &str = r#"
states     = { v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", d = "N*s/m" }
der        = { v = "m*v' = u - d*v" }
"#;

const TANK: &str = r#"
states     = { h = "m" }
inputs     = { u = "m^3/s" }
parameters = { A = "m^2" }
der        = { h = "A*h' = u" }
"#;

const PAIR: &str = r#"
states     = { g = "m", h = "m" }
inputs     = { u = "m^3/s" }
parameters = { A = "m^2" }
der        = { g = "A*g' = u", h = "A*h' = 0" }
"#;

const COUPLED: &str = r#"
states     = { x = "m", v = "m/s", y = "m", w = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", k = "N/m" }
der        = { x = "v", v = "m*v' = u - k*(x - y)", y = "w", w = "m*w' = k*(x - y)" }
"#;

/// Returns an effect of the catalogue; between two joints if it has a companion only there.
fn effect(name: &str, has_companion: bool) -> Arc<dyn Effect> {
    let effect = effects().into_iter().find(|e| e.name() == name).expect("it is in the catalogue");
    if has_companion && effect.second_port().is_none() { Between::of(&effect).expect("it acts there") } else { effect }
}

/// Creates a model with one effect at a place.
fn with(text: &str, name: &str, place: &str, companion: Option<&str>) -> WithEffects {
    let options: EquationsOptions = toml::from_str(text).expect("it is TOML");
    let model: Arc<dyn Model> = Arc::from(options.build().expect("it is a model"));
    let port = |place: &str| -> Port {
        model.interface().ports.iter().find(|p| p.to_string() == place).expect("the port is there").clone()
    };
    let placement = Placement {
        name: "e".into(),
        effect: effect(name, companion.is_some()),
        port: port(place),
        companion: companion.map(port),
    };
    WithEffects::new(Arc::clone(&model), vec![placement]).expect("it fits")
}

fn analysis(model: &dyn Model, parameters: &[f64], input: Input, end: f64) -> Analysis {
    let case = Case { inputs: vec![("u".to_owned(), input)], ..Case::default() };
    let signals: Vec<usize> = (0..model.interface().signals.len()).collect();
    model.analyse(&Job { case: &case, parameters, signals: &signals, horizon: end }).expect("it simulates")
}

/// Returns the values of a signal at some times.
fn values(model: &dyn Model, parameters: &[f64], input: Input, signal: &str, times: &[f64]) -> Vec<f64> {
    let end = times.last().expect("there are times");
    let analysis = analysis(model, parameters, input, *end);
    times.iter().map(|&t| analysis.trace(signal).at(t)).collect()
}

fn close(found: &[f64], expected: &[f64], tolerance: f64) {
    let worst = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < tolerance, "{worst}: {found:?} {expected:?}");
}

const STEP: Input = Input::Step { time: 1.0, before: 0.0, after: 2.0 };
const NOTHING: Input = Input::Constant(0.0);

#[test]
fn a_tank_with_a_leak_empties_by_torricellis_law() {
    let model = with(TANK, "leak", "process:h", None);
    // sqrt(h - hole) decreases by k/(2 A) per second; A = 2, h0 = 1.44 + 0.5, k = 0.8, hole = 0.5: h reaches the hole
    // at 6 s.
    let times = [1.0, 3.0, 5.0, 8.0];
    let found = values(&model, &[2.0, 1.94, 0.8, 0.5], NOTHING, "h", &times);
    let level = |t: f64| 0.5 + math::powi((1.2 - 0.2 * t).max(0.0), 2);
    close(&found, &times.map(level), 1e-6);
}

#[test]
fn an_edge_keeps_a_level_where_as_much_spills_as_comes_in() {
    let model = with(TANK, "overflow", "process:h", None);
    // A = 2, h0 = 0, inflow 0.5, k = 4, plain edge at 1: h = 1 + 0.125 (1 - exp(-2 (t - 4))).
    let times = [2.0, 4.0, 5.0, 9.0];
    let found = values(&model, &[2.0, 0.0, 4.0, 1.0, 1.0], Input::Constant(0.5), "h", &times);
    let level = |t: f64| if t < 4.0 { 0.25 * t } else { 1.0 + 0.125 * (1.0 - math::exp(-2.0 * (t - 4.0))) };
    close(&found, &times.map(level), 1e-6);
}

#[test]
fn what_spills_runs_into_the_next_tank() {
    let model = with(PAIR, "spill-over", "process:g", Some("process:h"));
    // Same as the tank above; a quarter of the spilled volume, 0.5 t - A g, is in the second tank.
    let times = [2.0, 5.0, 9.0];
    let parameters = [2.0, 0.0, 0.0, 4.0, 1.0, 1.0, 0.25];
    let upper = values(&model, &parameters, Input::Constant(0.5), "g", &times);
    let lower = values(&model, &parameters, Input::Constant(0.5), "h", &times);
    let expected: Vec<f64> = times.iter().zip(&upper).map(|(t, g)| 0.25 * (0.5 * t - 2.0 * g) / 2.0).collect();
    close(&lower, &expected, 1e-9);
    close(&upper[1..2], &[1.0 + 0.125 * (1.0 - math::exp(-2.0))], 1e-6);
}

#[test]
fn a_loss_to_the_surroundings_decays_to_them() {
    let model = with(TANK, "linear-loss", "process:h", None);
    let times = [0.5, 2.0, 6.0];
    let found = values(&model, &[2.0, 3.0, 1.0, -1.0], NOTHING, "h", &times);
    close(&found, &times.map(|t| -1.0 + 4.0 * math::exp(-t / 2.0)), 1e-7);
}

#[test]
fn radiation_to_an_input_follows_stefans_law() {
    let model = with(TANK, "radiation-exchange", "process:h", Some("actuator:u"));
    // A T' = -k T^4 with surroundings at 0: 1/T^3 = 1/T0^3 + 3 k t/A.
    let times = [0.5, 2.0, 6.0];
    let found = values(&model, &[2.0, 3.0, 0.1, 0.0], NOTHING, "h", &times);
    close(&found, &times.map(|t| math::powf(1.0 / 27.0 + 0.15 * t, -1.0 / 3.0)), 1e-6);
    // With an inflow u, A T' = u - k ((T + 1)^4 - (u + 1)^4) has the equilibrium (T + 1)^4 = (u + 1)^4 + u/k.
    let found = values(&model, &[2.0, 3.0, 0.1, 1.0], Input::Constant(0.5), "h", &[200.0]);
    close(&found, &[math::powf(math::powi(1.5, 4) + 5.0, 0.25) - 1.0], 1e-6);
}

#[test]
fn a_hidden_store_exchanges_until_both_are_equal() {
    let model = with(TANK, "hidden-store", "process:h", None);
    // A = 2, k = 1, tau = 4: the capacity of the hidden store is k tau = 4. From h = 3 and z = 0 both end at 1, at the
    // rate 1/2 + 1/4.
    let times = [0.5, 2.0, 6.0];
    let found = values(&model, &[2.0, 3.0, 1.0, 4.0, -3.0], NOTHING, "h", &times);
    close(&found, &times.map(|t| 1.0 + 2.0 * math::exp(-0.75 * t)), 1e-7);
}

#[test]
fn a_lag_follows_a_step_exponentially() {
    let model = with(BLOCK, "actuator-lag", "actuator:u", None);
    let times = [1.0, 1.3, 2.0, 4.0];
    let found = values(&model, &[2.0, 0.0, 0.0, 0.5, 0.0], STEP, "v", &times);
    // v' = 1 - exp(-(t - 1)/tau) from 1 s on.
    close(&found, &times.map(|t| (t - 1.0) - 0.5 * (1.0 - math::exp(-(t - 1.0) / 0.5))), 1e-7);
}

#[test]
fn a_lag_starts_from_its_free_initial_state() {
    let model = with(BLOCK, "actuator-lag", "actuator:u", None);
    let found = values(&model, &[2.0, 0.0, 0.0, 0.5, 3.0], NOTHING, "v", &[2.0]);
    close(&found, &[1.5 * 0.5 * (1.0 - math::exp(-4.0))], 1e-7);
}

#[test]
fn a_sensor_with_a_lag_does_not_affect_the_plant() {
    let model = with(BLOCK, "sensor-lag", "sensor:v", None);
    let times = [0.5, 2.0];
    // v = t: z = t - tau (1 - exp(-t/tau)).
    let found = values(&model, &[2.0, 0.0, 0.0, 0.5, 0.0], Input::Constant(2.0), "v", &times);
    close(&found, &times.map(|t: f64| t - 0.5 * (1.0 - math::exp(-t / 0.5))), 1e-7);
    let x = values(&model, &[2.0, 0.0, 0.0, 0.5, 0.0], Input::Constant(2.0), "x", &times);
    close(&x, &times.map(|t| t * t / 2.0), 1e-7);
}

#[test]
fn a_second_order_lag_has_the_overshoot_of_its_damping_ratio() {
    let model = with(BLOCK, "second-order-lag", "sensor:x", None);
    let (tau, d) = (0.2_f64, 0.3_f64);
    // Constant x = 1, with the state of the lag starting 1 below: the step response.
    let times: Vec<f64> = (1..40).map(|k| f64::from(k) * 0.05).collect();
    let found = values(&model, &[1.0, 1.0, 0.0, tau, d, -1.0, 0.0], NOTHING, "x", &times);
    let wd = (1.0 - d * d).sqrt() / tau;
    let step = |t: &f64| 1.0 - math::exp(-d * t / tau) * (math::cos(wd * t) + d / (wd * tau) * math::sin(wd * t));
    close(&found, &times.iter().map(step).collect::<Vec<_>>(), 1e-6);
}

#[test]
fn a_delayed_step_comes_later() {
    let model = with(BLOCK, "input-delay", "actuator:u", None);
    let times = [1.0, 1.3, 1.5, 3.0];
    let found = values(&model, &[2.0, 0.0, 0.0, 0.4], STEP, "v", &times);
    close(&found, &times.map(|t| (t - 1.4_f64).max(0.0)), 1e-9);
    let late = with(BLOCK, "sensor-delay", "sensor:v", None);
    let found = values(&late, &[2.0, 0.0, 0.0, 0.4], STEP, "v", &times);
    close(&found, &times.map(|t| (t - 1.4_f64).max(0.0)), 1e-9);
}

#[test]
fn an_actuator_of_limited_rate_takes_its_time() {
    let model = with(BLOCK, "input-rate-limit", "actuator:u", None);
    // To 2 within 0.5 s from 1 s on, and back to 0 from 3 s on.
    let pulse = Input::Sampled { times: vec![0.0, 1.0, 3.0], values: vec![0.0, 2.0, 0.0], hold: Hold::Zero };
    let found = values(&model, &[1.0, 0.0, 0.0, 4.0, 0.0], pulse, "v", &[1.0, 1.25, 1.5, 3.0, 3.25, 3.5, 4.0]);
    close(&found, &[0.0, 0.125, 0.5, 3.5, 3.875, 4.0, 4.0], 5e-6);
}

#[test]
fn an_actuator_with_a_rate_limit_starts_from_its_free_initial_state() {
    let model = with(BLOCK, "input-rate-limit", "actuator:u", None);
    // From 1 to the command 0 within 0.25 s.
    let found = values(&model, &[1.0, 0.0, 0.0, 4.0, 1.0], NOTHING, "v", &[0.125, 0.25, 1.0]);
    close(&found, &[0.09375, 0.125, 0.125], 5e-6);
}

#[test]
fn play_at_an_actuator_waits_for_half_its_gap() {
    let model = with(BLOCK, "backlash", "actuator:u", None);
    let pulse = Input::Sampled { times: vec![0.0, 1.0, 2.0, 3.0], values: vec![0.0, 2.0, 1.5, 0.0], hold: Hold::Zero };
    let found = values(&model, &[1.0, 0.0, 0.0, 1.0, 0.0], pulse, "v", &[1.0, 2.0, 3.0, 4.0]);
    close(&found, &[0.0, 1.5, 3.0, 3.5], 1e-9);
}

#[test]
fn play_at_a_sensor_keeps_its_value_after_a_reversal() {
    let model = with(BLOCK, "backlash", "sensor:x", None);
    // x = 1 - cos t; the output is x - 0.25 while x rises, and 1.75 after the reversal until x is below 1.5.
    let cosine = Input::Sine { amplitude: 1.0, frequency: 1.0 / TAU, phase: PI / 2.0, offset: 0.0 };
    let times = [1.0, 2.0, 3.1, 3.5, 4.0, 5.0, 6.0];
    let found = values(&model, &[1.0, 0.0, 0.0, 0.5, 0.0], cosine, "x", &times);
    let shown = |t: f64| {
        let x = 1.0 - math::cos(t);
        if t < PI { x - 0.25 } else { (x + 0.25).min(1.75) }
    };
    close(&found, &times.map(shown), 2e-3);
}

#[test]
fn a_mass_on_a_flexible_mode_swings_at_both_its_frequencies() {
    let model = with(BLOCK, "flexible-mode", "joint:x", None);
    let (m1, m2, w, k) = (2.0_f64, 0.5, 3.0, 8.0);
    // With a spring k at the first mass, in closed form: a cosine of each eigenfrequency, started in its own mode
    // shape.
    let spring = BLOCK.replace("= u\"", "= u - 8 [N/m]*x\"");
    let sprung = with(&spring, "flexible-mode", "joint:x", None);
    let (a, b) = ((k + m2 * w * w) / m1 + w * w, k / m1 * w * w);
    for sign in [-1.0, 1.0] {
        let square: f64 = (a + sign * (a * a - 4.0 * b).sqrt()) / 2.0;
        let shape = w * w / (w * w - square);
        let times: Vec<f64> = (1..30).map(|i| f64::from(i) * 0.1).collect();
        let found = values(&sprung, &[m1, 1.0, 0.0, m2, w, 0.0, shape - 1.0, 0.0], NOTHING, "x", &times);
        close(&found, &times.iter().map(|t| math::cos(square.sqrt() * t)).collect::<Vec<_>>(), 1e-6);
    }
    // Without the spring the masses move on together, with the initial momentum.
    let found = values(&model, &[m1, 0.0, 1.0, m2, w, 0.5, 0.0, -1.0], NOTHING, "v", &[60.0]);
    close(&found, &[m1 / (m1 + m2)], 1e-6);
}

#[test]
fn a_coupling_with_play_transmits_nothing_within_its_gap() {
    let model = with(COUPLED, "coupling-play", "joint:x", Some("joint:y"));
    // Two masses of 2, at distance 0, with x at speed 1. The gap of 1 is crossed after 0.5 s. They are then in contact
    // for half a period of sqrt(2 k/m) = 4 rad/s, and have exchanged their speeds.
    let parameters = [2.0, 16.0, 0.0, 1.0, 0.0, 0.0, 16.0, 1.0, 0.0];
    let times = [0.4, 0.5 + PI / 4.0 + 0.2];
    close(&values(&model, &parameters, NOTHING, "v", &times), &[1.0, 0.0], 1e-5);
    close(&values(&model, &parameters, NOTHING, "w", &times), &[0.0, 1.0], 1e-5);
}

/// Checks the coefficient of restitution of a contact with damping ratio z, exp(-z / sqrt(1 - z^2) (pi - 2 asin(z))).
/// The contact cannot pull: it ends when the relative acceleration is zero.
#[test]
fn damped_contact_in_a_coupling_reduces_speed_and_does_not_pull() {
    let ratio: f64 = 0.3;
    let tau = 2.0 * ratio / 4.0;
    let damped = COUPLED.replace("k*(x - y)", "(k*(x - y) + 2.4 [N s/m]*(v - w))");
    let model = with(&damped, "coupling-play", "joint:x", Some("joint:y"));
    let parameters = [2.0, 16.0, 0.0, 1.0, 0.0, 0.0, 16.0, 1.0, tau];
    let restitution = math::exp(-ratio / (1.0 - ratio * ratio).sqrt() * (PI - 2.0 * math::asin(ratio)));
    close(&values(&model, &parameters, NOTHING, "v", &[0.4, 2.0]), &[1.0, 0.5 * (1.0 - restitution)], 1e-5);
    close(&values(&model, &parameters, NOTHING, "w", &[0.4, 2.0]), &[0.0, 0.5 * (1.0 + restitution)], 1e-5);
}

#[test]
fn a_spring_with_play_has_no_force_within_its_gap() {
    let model = with(&BLOCK.replace("= u\"", "= u - 8 [N/m]*x\""), "spring-play", "joint:x", None);
    let found = values(&model, &[2.0, 0.0, 1.0, 8.0, 1.0], NOTHING, "v", &[0.4, 0.5 + PI / 2.0 + 0.2]);
    close(&found, &[1.0, -1.0], 1e-5);
}

#[test]
fn an_added_mass_is_as_heavy_as_one_that_was_declared() {
    let model = with(BLOCK, "added-mass", "joint:x", None);
    close(&values(&model, &[2.0, 0.0, 0.0, 3.0], Input::Constant(10.0), "v", &[2.0]), &[4.0], 1e-9);
}

#[test]
fn a_mass_that_becomes_less_is_faster_by_a_logarithm() {
    let model = with(BLOCK, "mass-loss", "joint:x", None);
    // v = (F/r) ln(m/(m - r t)).
    let times = [1.0, 3.0];
    let found = values(&model, &[2.0, 0.0, 0.0, 0.5], Input::Constant(1.0), "v", &times);
    close(&found, &times.map(|t| 2.0 * math::ln(2.0 / (2.0 - 0.5 * t))), 1e-7);
}

#[test]
fn a_block_in_a_fluid_slows_down_by_the_powers_of_the_speed() {
    let cases = [("viscous-friction", 1.0), ("quadratic-drag", 2.0), ("cubic-drag", 3.0)];
    for (name, p) in cases {
        let model = with(BLOCK, name, "joint:x", None);
        let found = values(&model, &[2.0, 0.0, 3.0, 0.5], NOTHING, "v", &[4.0]);
        // v' = -(c/m) v^p.
        let speed: f64 = if p == 1.0 {
            3.0 * math::exp(-1.0)
        } else {
            math::powf(math::powf(3.0, 1.0 - p) + (p - 1.0), 1.0 / (1.0 - p))
        };
        close(&found, &[speed], 1e-7);
        if p > 1.0 {
            let power = with(BLOCK, "power-friction", "joint:x", None);
            close(&values(&power, &[2.0, 0.0, 3.0, 0.5, p], NOTHING, "v", &[4.0]), &[speed], 1e-6);
        }
    }
}

#[test]
fn stiction_sticks_up_to_its_limit_and_slides_with_less() {
    let model = with(BLOCK, "stiction", "joint:x", None);
    // 2 N while sliding, 4 N to break away.
    close(&values(&model, &[2.0, 0.0, 0.0, 2.0, 1.0], Input::Constant(3.9), "v", &[3.0]), &[0.0], 1e-300);
    close(&values(&model, &[2.0, 0.0, 0.0, 2.0, 1.0], Input::Constant(5.0), "v", &[3.0]), &[4.5], 1e-8);
}

#[test]
fn friction_that_differs_by_direction_stops_earlier_one_way() {
    let model = with(BLOCK, "asymmetric-friction", "joint:x", None);
    for (v0, c) in [(3.0, 6.0), (-3.0, 2.0)] {
        let found = values(&model, &[2.0, 0.0, v0, 4.0, 0.5], NOTHING, "x", &[6.0]);
        close(&found, &[v0 * 3.0 * 2.0 / (2.0 * c)], 1e-7);
    }
}

#[test]
fn bent_bristles_act_like_dry_friction() {
    // Beyond the displacement y the friction force is c: energy m v0^2/2 = c (x - y (1 - ...)), to within c y.
    for (name, shape) in [("dahl-friction", vec![1e-3]), ("lugre-friction", vec![0.0, 0.1, 1e-3, 0.0])] {
        let model = with(BLOCK, name, "joint:x", None);
        let parameters: Vec<f64> = [2.0, 0.0, 3.0, 4.0].into_iter().chain(shape).collect();
        let found = values(&model, &parameters, NOTHING, "x", &[1.4]);
        close(&found, &[3.0 * 1.4 - 1.4 * 1.4], 6e-3);
    }
}

#[test]
fn a_hysteresis_at_small_strokes_is_a_spring() {
    let model = with(BLOCK, "bouc-wen", "joint:x", None);
    // Far below the yield force: stiffness c/y = 8, mass 2, frequency 2 rad/s.
    let times = [0.4, 1.0, 2.0];
    let found = values(&model, &[2.0, 0.0, 0.002, 8.0, 1.0, 1.0, 1.5, 0.0], NOTHING, "x", &times);
    close(&found, &times.map(|t: f64| 0.001 * math::sin(2.0 * t)), 3e-6);
}

#[test]
fn back_emf_is_viscous_friction_where_the_input_is_the_force() {
    let model = with(BLOCK, "back-emf", "actuator:u", Some("joint:x"));
    let found = values(&model, &[2.0, 0.0, 0.0, 0.5], Input::Constant(1.0), "v", &[3.0]);
    close(&found, &[2.0 * (1.0 - math::exp(-0.75))], 1e-7);
    assert_eq!(model.interface().parameters.last().expect("it has one").variable.unit.to_string(), "N/(m/s)");
}

#[test]
fn friction_of_a_loaded_gear_grows_with_the_input() {
    let model = with(BLOCK, "load-dependent-friction", "joint:x", Some("actuator:u"));
    let found = values(&model, &[2.0, 0.0, 0.0, 0.25], Input::Constant(4.0), "v", &[2.0]);
    close(&found, &[3.0], 1e-9);
}

/// Returns the time integral of half a period of a cosine that rises from 0 at `from` to 1 within `length`.
fn risen_so_far(t: f64, from: f64, length: f64) -> f64 {
    let since = (t - from).max(0.0);
    let rising = since.min(length);
    0.5 * (rising - length / PI * math::sin(PI * rising / length)) + (since - rising)
}

#[test]
fn a_block_whose_friction_changes_with_time_slows_down_by_its_integral() {
    let (times, from, length) = ([0.5, 1.4, 2.2, 4.0], 1.0, 0.8);
    // m = 2, v0 = 3: v = v0 exp(-(integral of the factor)/m).
    let drift = with(BLOCK, "damping-drift", "joint:x", None);
    let found = values(&drift, &[2.0, 0.0, 3.0, 0.4], NOTHING, "v", &times);
    close(&found, &times.map(|t| 3.0 * math::exp(-0.4 * t * t / 4.0)), 1e-6);
    let step = with(BLOCK, "damping-step", "joint:x", None);
    let found = values(&step, &[2.0, 0.0, 3.0, 0.9, from, length], NOTHING, "v", &times);
    close(&found, &times.map(|t| 3.0 * math::exp(-0.45 * risen_so_far(t, from, length))), 1e-6);
}

#[test]
fn a_command_whose_gain_changes_with_time_pushes_by_its_integral() {
    let (times, from, length) = ([0.5, 1.4, 2.2, 4.0], 1.0, 0.8);
    // m = 2, u = 3: v = u/m (t + integral of the relative change of the gain).
    let drift = with(BLOCK, "input-gain-drift", "actuator:u", None);
    let found = values(&drift, &[2.0, 0.0, 0.0, -0.1], Input::Constant(3.0), "v", &times);
    close(&found, &times.map(|t| 1.5 * (t - 0.05 * t * t)), 1e-6);
    let step = with(BLOCK, "input-gain-step", "actuator:u", None);
    let found = values(&step, &[2.0, 0.0, 0.0, -0.6, from, length], Input::Constant(3.0), "v", &times);
    close(&found, &times.map(|t| 1.5 * (t - 0.6 * risen_so_far(t, from, length))), 1e-6);
}

#[test]
fn a_vibration_shakes_a_block_by_its_integrals() {
    let model = with(BLOCK, "periodic-disturbance", "joint:x", None);
    let times = [0.3, 1.0, 2.5];
    let found = values(&model, &[2.0, 0.0, 0.0, 3.0, 5.0, PI / 2.0], NOTHING, "v", &times);
    close(&found, &times.map(|t: f64| 0.3 * math::sin(5.0 * t)), 1e-7);
}

#[test]
fn a_short_gust_is_not_stepped_over() {
    let model = with(BLOCK, "wind-gust", "joint:x", None);
    let found = values(&model, &[2.0, 0.0, 0.0, 40.0, 50.0, 0.01], NOTHING, "v", &[100.0]);
    close(&found, &[0.1], 1e-7);
}

#[test]
fn elastic_effects_return_their_energy() {
    type Potential = fn(f64) -> f64;
    let cases: [(&str, Vec<f64>, Potential); 8] = [
        ("constant-force", vec![0.7], |q| -0.7 * q),
        ("linear-stiffness", vec![3.0, 0.2], |q| 1.5 * math::powi(q - 0.2, 2)),
        ("cubic-stiffness", vec![3.0, 0.2], |q| 0.75 * math::powi(q - 0.2, 4)),
        ("quadratic-stiffness", vec![0.3, 0.2], |q| 0.1 * math::powi(q - 0.2, 3)),
        ("end-stop", vec![30.0, -0.3, 0.4, 0.0], |q| {
            15.0 * (math::powi((q - 0.4).max(0.0), 2) + math::powi((-0.3 - q).max(0.0), 2))
        }),
        ("imbalance", vec![2.0, 0.3], |q| -2.0 * math::cos(q - 0.3)),
        ("cogging", vec![2.0, 6.0, 0.3], |q| math::cos(6.0 * q + 0.3) / 3.0),
        ("position-ripple", vec![2.0, 5.5, 0.3], |q| 2.0 * math::cos(5.5 * q + 0.3) / 5.5),
    ];
    for (name, strengths, potential) in cases {
        let model = with(BLOCK, name, "joint:x", None);
        let parameters: Vec<f64> = [2.0, 0.1, 0.8].into_iter().chain(strengths).collect();
        let times: Vec<f64> = (1..20).map(|k| f64::from(k) * 0.25).collect();
        let [x, v] = ["x", "v"].map(|signal| values(&model, &parameters, NOTHING, signal, &times));
        let energy: Vec<f64> = x.iter().zip(&v).map(|(x, v)| v * v + potential(*x)).collect();
        let start = 0.8 * 0.8 + potential(0.1);
        close(&energy, &vec![start; energy.len()], 1e-5);
    }
}

/// Returns a place of each kind on a block or in a tank, with the second place that effects there need.
fn everywhere() -> Vec<(WithEffects, &'static str, bool)> {
    let mut all = Vec::new();
    for effect in effects() {
        for port in effect.ports() {
            let process = *port == PortKind::Process;
            let place = match port {
                PortKind::Joint => "joint:x",
                PortKind::Speed => "speed:v",
                PortKind::Process => "process:g",
                PortKind::Actuator => "actuator:u",
                PortKind::Sensor => "sensor:x",
            };
            let coupled = effect.name() == "coupling-play";
            let companion = effect.second_port().map(|kind| match kind {
                PortKind::Joint if coupled => "joint:y",
                PortKind::Speed => "speed:v",
                PortKind::Joint => "joint:x",
                PortKind::Process => "process:h",
                PortKind::Actuator => "actuator:u",
                PortKind::Sensor => "sensor:v",
            });
            let text = if process {
                PAIR
            } else if *port == PortKind::Speed {
                SPEED
            } else if coupled {
                COUPLED
            } else {
                BLOCK
            };
            all.push((with(text, effect.name(), place, companion), effect.name(), process));
        }
        if effect.acts_between() {
            all.push((with(COUPLED, effect.name(), "joint:x", Some("joint:y")), effect.name(), false));
        }
    }
    all
}

#[test]
fn an_effect_on_a_speed_without_a_position_acts_as_on_one_with_it() {
    let times: Vec<f64> = (1..40).map(|k| 0.1 * f64::from(k)).collect();
    let samples: Vec<f64> = (0..40).map(|k| 6.0 * math::sin(0.35 * f64::from(k))).collect();
    let input =
        Input::Sampled { times: (0..40).map(|k| 0.1 * f64::from(k)).collect(), values: samples, hold: Hold::First };
    let on_speeds = effects().into_iter().filter(|effect| effect.ports().contains(&PortKind::Speed));
    for effect in on_speeds {
        let strength = |of: &EffectParameter| match of.bounds {
            [low, high] if high.is_finite() => low + 0.4 * (high - low),
            [low, _] if low.is_finite() => low + 0.7,
            _ => 0.7,
        };
        let companion = effect.second_port().map(|_| "actuator:u");
        let speeds =
            [(DAMPED, "joint:x", vec![0.0, 0.5]), (SPEED, "speed:v", vec![0.5])].map(|(text, place, start)| {
                let model = with(text, effect.name(), place, companion);
                let strengths = effect.parameters().iter().map(strength);
                let mut parameters: Vec<f64> = [2.0, 0.6].into_iter().chain(start).chain(strengths).collect();
                parameters.resize(model.interface().parameters.len(), 0.0);
                values(&model, &parameters, input.clone(), "v", &times)
            });
        close(&speeds[1], &speeds[0], 1e-6);
        let without = with(SPEED, "viscous-friction", "speed:v", None);
        let plain = values(&without, &[2.0, 0.6, 0.5, 0.0], input.clone(), "v", &times);
        let moved = plain.iter().zip(&speeds[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(moved > 1e-3, "{} does something: {moved}", effect.name());
    }
}

#[test]
fn an_effect_between_two_joints_is_the_term_in_both_equations() {
    let written = COUPLED.replace("k*(x - y)", "(k*(x - y) + 40 [N/m3]*(x - y - 0.1 [m])^3 + 0.3 [N s/m]*(v - w))");
    let options: EquationsOptions = toml::from_str(&written).expect("it is TOML");
    let written = options.build().expect("it is a model");
    let cubic = with(COUPLED, "cubic-stiffness", "joint:x", Some("joint:y"));
    let model: Arc<dyn Model> = Arc::new(cubic);
    let ports = &model.interface().ports;
    let port = |name: &str| ports.iter().find(|port| port.to_string() == name).expect("the port is there").clone();
    let damper = Placement {
        name: "d".into(),
        effect: effect("viscous-friction", true),
        port: port("joint:x"),
        companion: Some(port("joint:y")),
    };
    let both = WithEffects::new(Arc::clone(&model), vec![damper]).expect("it fits");
    // Mass, stiffness and initial states; then k and rest of the cubic spring, and the damping.
    let own = [2.0, 3.0, 0.2, 0.0, -0.1, 0.5];
    let all = [&own[..], &[40.0, 0.1, 0.3]].concat();
    let names: Vec<&str> = both.interface().parameters.iter().map(|p| &*p.variable.name).collect();
    assert_eq!(names[own.len()..], ["e.k", "e.rest", "d.d"]);
    let times: Vec<f64> = (1..=30).map(|k| 0.1 * f64::from(k)).collect();
    for signal in ["x", "y"] {
        let as_written = values(written.as_ref(), &own, STEP, signal, &times);
        close(&values(&both, &all, STEP, signal, &times), &as_written, 1e-7);
    }
}

/// Returns parameters for which the effects are active within the range of the motion below.
fn acting(name: &str, effect: &dyn Effect) -> Vec<f64> {
    let of = |s: &EffectParameter| match s.name {
        "limit" | "w" | "n" => 1.1,
        "rest" | "centre" | "hole" | "around" | "phase" | "skew" => 0.15,
        "low" => -0.4,
        "high" | "level" | "sigma" => 0.6,
        "zero" => 0.0,
        "r1" | "r2" | "r3" | "top" => 1.2,
        "rate" => 1.37,
        "length" => 1.3,
        "p" => 1.4,
        _ => 0.3,
    };
    let mut all: Vec<f64> = effect.parameters().iter().map(of).collect();
    if name == "bouc-wen" {
        all[3] = 1.5;
    }
    // With damping, the force jumps on contact, and the time of contact has no tangent.
    match name {
        "end-stop" => all[3] = 0.0,
        "coupling-play" => all[2] = 0.0,
        _ => {}
    }
    all
}

#[test]
fn every_effect_simulates_at_its_ports_with_tangents_that_agree_with_differences() {
    // A command in steps whose levels are no multiples of any parameter.
    let times: Vec<f64> = (0..8).map(|k| f64::from(k) * 0.5).collect();
    let levels = vec![1.3, 0.4, -1.7, 0.7, 1.9, -0.9, -1.4, 0.8];
    for (model, name, process) in everywhere() {
        let values = if process { levels.iter().map(|u| u + 1.8).collect() } else { levels.clone() };
        let input = Input::Sampled { times: times.clone(), values, hold: Hold::Zero };
        let effect = Arc::clone(&model.placements()[0].effect);
        let is_coupled = model.interface().parameters[1].variable.name == "k";
        let mut parameters = match process {
            _ if is_coupled => vec![2.0, 3.0, 0.1, 0.6, 0.0, 0.0],
            true => vec![2.0, 0.7, 0.8],
            false => vec![2.0, 0.1, 0.6],
        };
        let first = parameters.len();
        parameters.extend(acting(name, effect.as_ref()));
        let count = parameters.len();
        parameters.resize(model.interface().parameters.len(), 0.05);
        let case = Case { inputs: vec![("u".to_owned(), input.clone())], ..Case::default() };
        let signals: Vec<usize> = (0..model.interface().signals.len()).collect();
        let job = Job { case: &case, parameters: &parameters, signals: &signals, horizon: 3.7 };
        let plain = analysis(&model, &parameters, input.clone(), 3.7);
        // Rounding has zero derivative between its jumps.
        let shaped = |k: &usize| !name.ends_with("quantisation") && !effect.parameters()[*k].fixed;
        let moved: Vec<usize> = (0..count - first).filter(shaped).map(|k| first + k).collect();
        let seed = |i: &usize| (0..parameters.len()).map(|j| f64::from(u8::from(*i == j))).collect();
        let seeds: Vec<Vec<f64>> = moved.iter().map(seed).collect();
        let (value, tangents) = model.tangents(&job, &seeds).expect("it has them").expect("it simulates");
        let names: Vec<String> = model.interface().signals.iter().map(|s| s.name.clone()).collect();
        for signal in &names {
            let same = value.trace(signal).last().to_bits() == plain.trace(signal).last().to_bits();
            assert!(same, "{name}: tangents change no bit");
        }
        for (i, tangent) in moved.iter().zip(&tangents) {
            let run = |by: f64| {
                let mut parameters = parameters.clone();
                parameters[*i] += by;
                analysis(&model, &parameters, input.clone(), 3.7)
            };
            let (up, down) = (run(1e-4), run(-1e-4));
            for signal in &names {
                let difference = (up.trace(signal).last() - down.trace(signal).last()) / 2e-4;
                let exact = tangent.trace(signal).last();
                // If a step crosses a kink, the accuracy of tangents depends on the length of the step.
                let agree = (exact - difference).abs() < 5e-3 * (1.0 + difference.abs());
                assert!(
                    agree,
                    "{name} {} {signal} {exact} {difference}",
                    model.interface().parameters[*i].variable.name
                );
            }
        }
    }
}

#[test]
fn a_sensor_effect_does_not_affect_other_signals() {
    for (model, name, _) in everywhere() {
        if !matches!(model.placements()[0].port, Port::Sensor { .. }) {
            continue;
        }
        let effect = Arc::clone(&model.placements()[0].effect);
        let mut parameters = vec![2.0, 0.1, 0.6];
        parameters.extend(acting(name, effect.as_ref()));
        parameters.resize(model.interface().parameters.len(), 0.05);
        close(&values(&model, &parameters, Input::Constant(0.7), "v", &[3.0]), &[0.6 + 0.35 * 3.0], 1e-8);
    }
}
