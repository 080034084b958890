//! Effects in series at one place and at one joint, and what inputs were before time 0, compared with closed forms.

use std::f64::consts::TAU;
use std::sync::Arc;

use mops_core::{Analysis, Case, Input, Job, Model, ModelOptions, case::Hold, effect::Placement};
use mops_effects::effects;
use mops_math as math;
use mops_models::WithEffects;
use mops_models::equations::EquationsOptions;

/// Tank that collects its input: `h` is the integral of what reaches the plant.
const TANK: &str = r#"
states     = { h = "m" }
inputs     = { u = "m/s" }
der        = { h = "h' = u" }
"#;

const BLOCK: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
der        = { x = "v", v = "1 [kg]*v' = u" }
"#;

/// Creates a model with effects at places, in this order.
fn with(text: &str, names: &[(&str, &str)]) -> WithEffects {
    let options: EquationsOptions = toml::from_str(text).expect("it is TOML");
    let model: Arc<dyn Model> = Arc::from(options.build().expect("it is a model"));
    let placement = |(k, (name, place)): (usize, &(&str, &str))| Placement {
        name: format!("e{k}"),
        effect: effects().into_iter().find(|e| e.name() == *name).expect("it is in the catalogue"),
        port: model.interface().ports.iter().find(|p| p.to_string() == *place).expect("the port is there").clone(),
        companion: None,
    };
    let placements = names.iter().enumerate().map(placement).collect();
    WithEffects::new(Arc::clone(&model), placements).expect("they fit")
}

fn case(input: Input) -> Case {
    Case { inputs: vec![("u".to_owned(), input)], ..Case::default() }
}

/// Returns the values of the first signal at some times.
fn values(model: &WithEffects, parameters: &[f64], input: Input, times: &[f64]) -> Vec<f64> {
    let job = Job { case: &case(input), parameters, signals: &[0], horizon: times[times.len() - 1] };
    let Ok(Analysis::Time(response)) = model.analyse(&job) else { panic!("it simulates") };
    times.iter().map(|&t| response.traces[0].1.at(t)).collect()
}

/// Returns the derivatives of the first signal with respect to a parameter at some times.
fn slopes(model: &WithEffects, parameters: &[f64], index: usize, input: Input, times: &[f64]) -> Vec<f64> {
    let job = Job { case: &case(input), parameters, signals: &[0], horizon: times[times.len() - 1] };
    let mut seed = vec![0.0; parameters.len()];
    seed[index] = 1.0;
    let (_, tangents) = model.tangents(&job, &[seed]).expect("there are tangents").expect("it simulates");
    let [Analysis::Time(response)] = &tangents[..] else { panic!("one tangent") };
    times.iter().map(|&t| response.traces[0].1.at(t)).collect()
}

fn close(found: &[f64], expected: &[f64], tolerance: f64) {
    let worst = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < tolerance, "{worst}: {found:?} {expected:?}");
}

fn step(time: f64, before: f64, after: f64) -> Input {
    Input::Step { time, before, after }
}

/// Integral of the unit step response of a lag.
fn lag_integral(tau: f64, t: f64) -> f64 {
    if t < 0.0 { 0.0 } else { t - tau * (1.0 - math::exp(-t / tau)) }
}

/// Integral of the unit step response of two lags in series.
fn two_lags_integral([a, b]: [f64; 2], t: f64) -> f64 {
    (a * lag_integral(a, t) - b * lag_integral(b, t)) / (a - b)
}

const TIMES: [f64; 5] = [0.5, 1.2, 2.0, 3.3, 6.0];

#[test]
fn lags_of_one_actuator_act_in_series() {
    let model = with(TANK, &[("actuator-lag", "actuator:u"), ("actuator-lag", "actuator:u")]);
    let exact = TIMES.map(|t| two_lags_integral([0.3, 0.7], t - 1.0));
    close(&values(&model, &[0.0, 0.3, 0.0, 0.7, 0.0], step(1.0, 0.0, 1.0), &TIMES), &exact, 1e-7);
}

#[test]
fn a_lag_follows_the_output_of_the_effect_before_it() {
    let model = with(TANK, &[("input-saturation", "actuator:u"), ("actuator-lag", "actuator:u")]);
    let exact = TIMES.map(|t| 0.5 * lag_integral(0.4, t - 1.0));
    close(&values(&model, &[0.0, 0.5, 0.4, 0.0], step(1.0, 0.0, 2.0), &TIMES), &exact, 1e-7);
}

#[test]
fn a_step_at_time_0_reaches_a_delayed_lag_after_the_delay() {
    let model = with(TANK, &[("input-delay", "actuator:u"), ("actuator-lag", "actuator:u")]);
    let exact = TIMES.map(|t| lag_integral(0.4, t - 1.1));
    close(&values(&model, &[0.0, 1.1, 0.4, 0.0], step(0.0, 0.0, 1.0), &TIMES), &exact, 1e-7);
}

#[test]
fn the_derivative_with_respect_to_the_delay_of_a_lag_is_exact() {
    let model = with(TANK, &[("input-delay", "actuator:u"), ("actuator-lag", "actuator:u")]);
    for time in [0.0, 0.9] {
        // h depends on t - delay: the derivative is minus the output of the lag.
        let exact = TIMES.map(|t| if t < time + 1.1 { 0.0 } else { math::exp(-(t - time - 1.1) / 0.4) - 1.0 });
        close(&slopes(&model, &[0.0, 1.1, 0.4, 0.0], 1, step(time, 0.0, 1.0), &TIMES), &exact, 1e-7);
    }
}

#[test]
fn the_derivative_with_respect_to_the_delay_of_a_ramp_has_no_part_of_the_other_side() {
    let model = with(TANK, &[("input-delay", "actuator:u")]);
    let ramp = Input::Sampled { times: vec![0.0, 10.0], values: vec![0.0, 10.0], hold: Hold::First };
    let exact = TIMES.map(|t| -(t - 1.1_f64).max(0.0));
    close(&slopes(&model, &[0.0, 1.1], 1, ramp, &TIMES), &exact, 1e-9);
}

#[test]
fn actuators_start_at_rest_at_the_value_before_a_step_at_time_0() {
    let starts = [0.2, 0.5, 1.5, 3.0];
    let lag = with(TANK, &[("actuator-lag", "actuator:u")]);
    let exact = starts.map(|t| t + lag_integral(0.4, t));
    close(&values(&lag, &[0.0, 0.4, 0.0], step(0.0, 1.0, 2.0), &starts), &exact, 1e-7);
    let limited = with(TANK, &[("input-rate-limit", "actuator:u")]);
    // The output rises from 1 by 0.5 per second until it is 2.
    let exact = starts.map(|t| if t < 2.0 { t + 0.25 * t * t } else { 3.0 + 2.0 * (t - 2.0) });
    close(&values(&limited, &[0.0, 0.5, 0.0], step(0.0, 1.0, 2.0), &starts), &exact, 1e-8);
}

#[test]
fn the_samples_before_time_0_are_what_a_delay_passes_on() {
    let model = with(TANK, &[("input-delay", "actuator:u")]);
    let times: Vec<f64> = (-3..=3).map(f64::from).collect();
    let recorded =
        |hold| Input::Sampled { values: times.iter().map(|t| 4.0 + t).collect(), times: times.clone(), hold };
    // The input is 4 + t, so that the delayed one is 2.5 + t.
    let at = [0.5, 1.0, 3.0];
    close(&values(&model, &[0.0, 1.5], recorded(Hold::First), &at), &at.map(|t| 2.5 * t + 0.5 * t * t), 1e-9);
    // Constant between samples: 2 until 0.5 s, then 3.
    close(&values(&model, &[0.0, 1.5], recorded(Hold::Zero), &[0.5, 1.0]), &[1.0, 2.5], 1e-9);
}

#[test]
fn a_lag_of_a_sensor_follows_the_output_of_the_effect_before_it() {
    let model = with(TANK, &[("sensor-saturation", "sensor:h"), ("sensor-lag", "sensor:h")]);
    // The level rises by 1 per second, and the sensor saturates at 1.
    let tau = 0.5;
    let exact = TIMES.map(|t| {
        let ramp = |t: f64| t - tau * (1.0 - math::exp(-t / tau));
        if t < 1.0 { ramp(t) } else { 1.0 + (ramp(1.0) - 1.0) * math::exp(-(t - 1.0) / tau) }
    });
    close(&values(&model, &[0.0, 1.0, 1.0, tau, 0.0], Input::Constant(1.0), &TIMES), &exact, 1e-7);
}

/// Integral of a course given by its values at equal steps.
fn integral(h: f64, values: &[f64], t: f64) -> f64 {
    let count = (t / h).round() as usize;
    (0..count).map(|k| 0.5 * h * (values[k] + values[k + 1])).sum()
}

#[test]
fn backlash_holds_the_extrema_of_a_smooth_input() {
    let model = with(TANK, &[("backlash", "actuator:u")]);
    let (h, half) = (1e-4, 0.3);
    let mut output: f64 = 0.0;
    let course: Vec<f64> = (0..=60_000)
        .map(|k| {
            let u = math::sin(TAU * 0.4 * h * f64::from(k));
            output = output.clamp(u - half, u + half);
            output
        })
        .collect();
    let sine = Input::Sine { amplitude: 1.0, frequency: 0.4, phase: 0.0, offset: 0.0 };
    let exact = TIMES.map(|t| integral(h, &course, t));
    close(&values(&model, &[0.0, 2.0 * half, 0.0], sine, &TIMES), &exact, 1e-6);
}

#[test]
fn a_rate_limit_follows_a_smooth_input_as_far_as_it_can() {
    let model = with(TANK, &[("input-rate-limit", "actuator:u")]);
    let (h, rate) = (1e-5, 1.2);
    let mut output: f64 = 0.0;
    let course: Vec<f64> = (0..=600_000)
        .map(|k| {
            let u = math::sin(TAU * 0.4 * h * f64::from(k));
            output += (u - output).clamp(-rate * h, rate * h);
            output
        })
        .collect();
    let sine = Input::Sine { amplitude: 1.0, frequency: 0.4, phase: 0.0, offset: 0.0 };
    let exact = TIMES.map(|t| integral(h, &course, t));
    close(&values(&model, &[0.0, rate, 0.0], sine, &TIMES), &exact, 1e-5);
}

#[test]
fn dry_frictions_of_one_joint_add_up() {
    let kinds = ["coulomb-friction", "stiction", "stribeck-friction", "asymmetric-friction"];
    // Parameters for a friction of 0.1 N in motion.
    let parameters = |kind: &str| match kind {
        "coulomb-friction" => vec![0.1],
        "stiction" => vec![0.1, 0.5],
        "stribeck-friction" => vec![0.1, 0.0, 1.0],
        _ => vec![0.1, 0.0],
    };
    for a in kinds {
        for b in kinds {
            let model = with(BLOCK, &[(a, "joint:x"), (b, "joint:x")]);
            let all = [vec![0.0, 0.0], parameters(a), parameters(b)].concat();
            let found = values(&model, &all, step(0.5, 0.0, 2.0), &[0.5, 4.0]);
            close(&found, &[0.0, 0.5 * 1.8 * 3.5 * 3.5], 1e-6);
        }
    }
}
