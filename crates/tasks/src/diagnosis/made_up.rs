//! Made-up diagnoses for tests of the output.

use mops_core::Role;
use mops_math as math;
use mops_outcome::diagnosis::{
    Change, Curve, Dependence, Diagnosis, ExperimentError, Found, LatentInput, Noticeable, ParameterMove, Prediction,
    Ranked, Rival, Rule, Step, StrengthValue, Unexplained, Verdict,
};

/// Returns a pseudorandom value between -1 and 1.
fn chance(i: usize) -> f64 {
    let x = math::sin(i as f64 * 12.9898) * 43_758.547;
    2.0 * (x - x.floor()) - 1.0
}

fn strength(name: &str, value: f64, unit: &str) -> StrengthValue {
    StrengthValue {
        name: name.into(),
        value,
        unit: unit.into(),
        std_error: Some(0.02 * value.abs()),
        interval95: Some([value - 0.05 * value.abs(), value + 0.05 * value.abs()]),
        at_bound: false,
    }
}

/// Returns a channel: the nominal model is underdamped, the recalibrated one correct.
fn prediction(experiment: &str, role: Role, signal: &str, phase: f64) -> Prediction {
    let times: Vec<f64> = (0..300).map(|i| 0.01 * i as f64).collect();
    let swing = |t: f64, decay: f64| math::exp(-decay * t) * math::cos(7.0 * t + phase);
    let noise = 0.003;
    Prediction {
        experiment: experiment.into(),
        role,
        signal: signal.into(),
        unit: "rad".into(),
        noise,
        measured: times.iter().enumerate().map(|(i, &t)| swing(t, 0.5) + 1.7 * noise * chance(i)).collect(),
        before: times.iter().map(|&t| swing(t, 0.5) + 0.012 * t * math::sin(7.0 * t + phase)).collect(),
        after: times.iter().map(|&t| swing(t, 0.5)).collect(),
        times,
    }
}

fn error(name: &str, role: Role, [phi, theta, normalised]: [f64; 3]) -> ExperimentError {
    ExperimentError {
        name: name.into(),
        role,
        channels: vec![("phi".into(), phi), ("theta".into(), theta)],
        normalised,
        in_windows: None,
    }
}

/// Returns a torque over time, speed and position: Coulomb friction of 0.0124 N m.
fn latent(place: &str) -> LatentInput {
    let times: Vec<f64> = (0..300).map(|i| 0.01 * i as f64).collect();
    let speed: Vec<f64> = times.iter().map(|&t| -7.0 * math::exp(-0.5 * t) * math::sin(7.0 * t)).collect();
    let force: Vec<f64> =
        speed.iter().enumerate().map(|(i, v)| -0.0124 * math::tanh(4.0 * v) + 0.0012 * chance(i + 7)).collect();
    let found: Vec<f64> = speed.iter().map(|v| -0.0124 * v.signum()).collect();
    let position = times.iter().map(|t| math::cos(7.0 * t)).collect();
    let curve = |x: Vec<f64>| Curve { x, estimated: force.clone(), found: found.clone() };
    LatentInput {
        place: place.into(),
        unit: "N m".into(),
        over_time: vec![("swing".into(), curve(times))],
        over: vec![("speed".into(), "rad/s".into(), curve(speed)), ("position".into(), "rad".into(), curve(position))],
    }
}

fn ranked(effect: &str, place: &str, probability: f64, bic_gain: f64) -> Ranked {
    Ranked {
        effect: effect.into(),
        place: place.into(),
        class: "dissipative".into(),
        probability,
        bic_gain,
        strengths: vec![strength("c", 0.0124, "N m")],
        absorbed: 0.87,
        normalised: 1.01,
        failed: (bic_gain < 2400.0).then_some(Rule::Probability),
    }
}

/// Returns a curve that jumps where its coordinate changes its sign.
fn dependence(coordinate: &str, place: &str, gain: f64) -> Dependence {
    let point = |k: i32| [f64::from(k), -0.0124 * math::tanh(3.0 * f64::from(k))];
    Dependence {
        coordinate: coordinate.into(),
        place: place.into(),
        other: None,
        gain,
        unit: "rad/s".into(),
        signal_unit: "N m".into(),
        curve: (-7..=7).map(point).collect(),
    }
}

fn moved(name: &str, before: f64, after: f64) -> ParameterMove {
    ParameterMove {
        name: name.into(),
        unit: "kg m2".into(),
        before,
        after,
        std_error: Some(0.01 * after.abs()),
        interval95: Some([0.98 * after, 1.02 * after]),
        at_bound: false,
    }
}

/// Returns a diagnosis of Coulomb friction at `joint:phi`, from two experiments with two channels each.
pub fn coulomb() -> Diagnosis {
    let rival = |effect: &str, bic_behind: f64| Rival {
        effect: effect.into(),
        place: "joint:phi".into(),
        probability: 0.01,
        bic_behind,
        cosine: 0.995,
    };
    let mut made = Diagnosis::default();
    made.verdict = Verdict::Effect;
    made.probability = 0.95;
    made.is_first = true;
    made.converged = true;
    made.is_sure = true;
    made.explained_share = Some(0.996);
    made.depends_on = Some(dependence("speed", "joint:phi", 310.0));
    made.p_value = 1e-9;
    made.found = vec![Found {
        effect: "coulomb-friction".into(),
        place: "joint:phi".into(),
        name: "phi-coulomb-friction".into(),
        companion: None,
        only: None,
        class: "dissipative".into(),
        formula: "-torque sgn(speed), with a stuck mode".into(),
        strengths: vec![strength("c", 0.0124, "N m")],
        probability: 0.9,
        class_probability: 0.95,
        alike: Vec::new(),
        claimed: true,
        given: false,
        bic_gain: 2400.0,
        indistinguishable: vec![rival("stribeck-friction", 0.7), rival("quadratic-drag", 4.1)],
        held_out: Vec::new(),
    }];
    made.removed = Vec::new();
    made.steps =
        vec![Step { did: Change::Added, effects: vec!["coulomb-friction at joint:phi".into()], normalised: 1.0 }];
    made.ranked = vec![
        ranked("coulomb-friction", "joint:phi", 0.9, 2400.0),
        ranked("stribeck-friction", "joint:phi", 0.04, 2399.3),
        ranked("quadratic-drag", "joint:phi", 0.01, 2395.9),
        ranked("quadratic-drag", "joint:theta", f64::NAN, 310.0),
        ranked("delay", "actuator:u", f64::NAN, f64::NAN),
    ];
    made.unexplained = None;
    made.next_experiment = Some("Swing slowly, below 0.5 rad/s in the joint `phi`.".into());
    made.before = vec![
        error("swing", Role::Calibration, [0.0126, 0.0125, 4.2]),
        error("push", Role::Validation, [0.046, 0.047, 15.4]),
    ];
    made.after = vec![
        error("swing", Role::Calibration, [0.003, 0.003, 1.0]),
        error("push", Role::Validation, [0.0031, 0.003, 1.02]),
    ];
    made.parameters = vec![moved("b", 2.1e-3, 1.133e-3), moved("d", 2.6e-2, 2.5267e-2)];
    made.noticeable = Vec::new();
    made.places = vec![
        dependence("speed", "joint:phi", 812.0),
        dependence("position", "joint:theta", 260.0),
        dependence("input", "actuator:u", 90.0),
    ];
    made.latent = vec![latent("joint:phi")];
    made.predictions = vec![
        prediction("swing", Role::Calibration, "phi", 0.0),
        prediction("swing", Role::Calibration, "theta", 1.0),
        prediction("push", Role::Validation, "phi", 0.3),
        prediction("push", Role::Validation, "theta", 1.3),
    ];
    made.notes = vec!["The noise of `phi` was estimated from the data: 0.003 rad.".into()];
    made.starts = vec![("swing".into(), "phi0".into(), 0.98), ("swing".into(), "theta0".into(), 0.51)];
    made.simulations = 731;
    made
}

/// Returns a diagnosis with the verdict `none`.
pub fn nothing() -> Diagnosis {
    let mut diagnosis = coulomb();
    for prediction in &mut diagnosis.predictions {
        prediction.before.clone_from(&prediction.after);
    }
    let noticeable = |effect: &str, value: f64| Noticeable {
        effect: effect.into(),
        place: "joint:phi".into(),
        strength: strength("c", value, "N m"),
    };
    let mut made = diagnosis.clone();
    made.verdict = Verdict::None;
    made.explained_share = None;
    made.depends_on = None;
    made.probability = 0.93;
    made.p_value = 0.43;
    made.found = Vec::new();
    made.before = diagnosis.after.clone();
    made.noticeable = vec![noticeable("coulomb-friction", 4e-4), noticeable("stribeck-friction", 6e-4)];
    made.next_experiment = None;
    made
}

/// Returns a diagnosis with the verdict `unexplained`, with a table for `process:x`.
pub fn unexplained() -> Diagnosis {
    let diagnosis = coulomb();
    let table = (0..9).map(|i| [f64::from(i), math::sin(0.7 * f64::from(i))]).collect();
    let unexplained = Unexplained { place: "process:x".into(), over: "position".into(), table };
    let mut made = diagnosis.clone();
    made.verdict = Verdict::Unexplained;
    made.probability = f64::NAN;
    made.is_sure = false;
    made.explained_share = None;
    made.depends_on = Some(dependence("position", "process:x", 42.0));
    made.found = Vec::new();
    made.unexplained = Some(unexplained);
    made.after = diagnosis.before.clone();
    made
}
