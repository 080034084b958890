//! Where effects are tried, and at which values.

use mops_core::effect::{Dimension, EffectParameter, InitialGrid, ParameterKind, Port};
use mops_effects::effects;
use mops_math as math;

use crate::candidates::{Candidate, Sizes, candidates};
use crate::fit::Meter;
use crate::selection::prepare;
use crate::testing::{Record, catalogue, model, subject};

/// Two masses on a spring.
const COUPLED: &str = r#"
states     = { x = "m", v = "m/s", y = "m", w = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", k = "N/m" }
der        = { x = "v", v = "m*v' = u - k*(x - y)", y = "w", w = "m*w' = k*(x - y)" }
"#;

/// A heated room.
const ROOM: &str = r#"
states     = { T = "degC" }
inputs     = { P = "kW", To = "degC" }
parameters = { C = "kJ/K", k = "kW/K" }
der        = { T = "C*T' = P - k*(T - To)" }
"#;

fn of(text: &str, effect: &str) -> Vec<Candidate> {
    let parameters = vec![1.0; model(text).interface().parameters.len()];
    let signals = ["x", "y"].map(|name| (name, vec![0.0; 2], 1.0));
    let signals =
        signals.into_iter().filter(|(name, ..)| model(text).interface().signals.iter().any(|s| s.name == *name));
    let record = Record { inputs: Vec::new(), times: vec![0.0, 1.0], signals: signals.collect() };
    candidates(&subject(text, &parameters, 0, vec![record]), &catalogue(&[effect]))
}

#[test]
fn play_in_a_coupling_is_one_candidate_from_either_end() {
    assert_eq!(of(COUPLED, "coupling-play").len(), 1);
    assert_eq!(of(COUPLED, "cross-talk").len(), 2, "what one sensor gets of the other is not what that gets of it");
}

/// Returns the candidates that the records of two masses cover; `forces` are those on both, without the input.
fn covered(unit: &str, forces: [&str; 2], effects: &[&str]) -> Vec<Candidate> {
    let rate = format!("{unit}/s");
    let text = format!(
        r#"
        states     = {{ x = "{unit}", v = "{rate}", y = "{unit}", w = "{rate}" }}
        parameters = {{ k = "1/s^2" }}
        der        = {{ x = "v", v = "{}", y = "w", w = "{}" }}
        "#,
        forces[0], forces[1]
    );
    // A light spring swings nearly so.
    let times: Vec<f64> = (0..80).map(|k| 0.1 * f64::from(k)).collect();
    let signal = |amplitude: f64| times.iter().map(|t| amplitude * math::cos(2.0 * t)).collect::<Vec<f64>>();
    let signals = vec![("x", signal(1.0), 0.01), ("y", signal(-1.0), 0.01)];
    let record = Record { inputs: Vec::new(), times: times.clone(), signals };
    let subject = subject(&text, &[2.0, 1.0, 0.0, -1.0, 0.0], 4, vec![record]);
    let meter = Meter::new(&());
    prepare(&subject, &catalogue(effects), &meter).expect("it is simulated").0.candidates
}

#[test]
fn a_spring_between_two_joints_is_tried_where_the_model_has_one() {
    let between = |all: Vec<Candidate>| all.into_iter().filter(|candidate| candidate.companion.is_some()).count();
    assert_eq!(between(of(COUPLED, "cubic-stiffness")), 1);
    assert_eq!(between(of(COUPLED, "coulomb-friction")), 0, "dry friction holds one joint");
    let springs = |forces| between(covered("m", forces, &["cubic-stiffness"]));
    assert_eq!(springs(["-k*(x - y)", "k*(x - y)"]), 1);
    assert_eq!(springs(["-k*x", "-k*y"]), 0);
    assert_eq!(springs(["-k*x", "k*(x - y)"]), 0, "a force without a reaction is no spring");
}

#[test]
fn what_repeats_by_the_turn_needs_an_angle() {
    let count = |unit: &str| covered(unit, ["-k*x", "-k*y"], &["cogging", "eccentricity"]).len();
    assert_eq!([count("m"), count("rad")], [0, 4]);
}

#[test]
fn a_room_radiates_to_temperatures_alone() {
    let all = of(ROOM, "radiation-exchange");
    let companions: Vec<String> = all.iter().map(|c| c.companion.as_ref().expect("it has one").to_string()).collect();
    assert_eq!(companions, ["actuator:To"]);
}

/// Returns the effects that are tried on a store whose state has a unit.
fn of_store(unit: &str) -> Vec<&'static str> {
    let text = format!("states = {{ x = \"{unit}\" }}\nparameters = {{ a = \"1/s\" }}\nder = {{ x = \"-a*x\" }}\n");
    let record = Record { inputs: Vec::new(), times: vec![0.0, 1.0], signals: vec![("x", vec![0.0; 2], 1.0)] };
    let all = candidates(&subject(&text, &[1.0, 1.0], 1, vec![record]), &effects());
    all.iter().filter(|c| !matches!(c.port, Port::Sensor { .. })).map(|c| c.effect.name()).collect()
}

#[test]
fn the_unit_of_a_state_says_what_it_may_lose() {
    let tried = |unit: &str, effect: &str| of_store(unit).contains(&effect);
    for (unit, heat, level, friction) in [
        ("K", true, false, false),
        ("m", false, true, false),
        ("m^3", false, true, false),
        ("m/s", false, false, true),
        ("rad/s", false, false, true),
        ("N", false, false, false),
        ("V", true, true, false),
        ("%", true, true, false),
        ("1", true, true, false),
    ] {
        let found = ["radiation-loss", "leak", "coulomb-friction"].map(|effect| tried(unit, effect));
        assert_eq!(found, [heat, level, friction], "{unit}");
        assert!(tried(unit, "constant-force"), "{unit}");
    }
}

#[test]
fn the_zero_of_a_temperature_is_that_of_its_scale() {
    let zeros = InitialGrid::Zeros(&[0.0, 273.15, 293.15]);
    let tried = |zero| Sizes { zero, ..Sizes::UNKNOWN }.values(Dimension::POSITION, zeros, [0.0, f64::INFINITY]);
    assert_eq!(tried(Some(273.15)), [273.15]);
    assert_eq!(tried(None), [0.0, 273.15, 293.15]);
}

#[test]
fn limits_and_rates_are_tried_where_the_command_is() {
    let sizes = |range: [f64; 2], slew: Option<f64>| Sizes { value: 2.0, time: 0.5, range, slew, ..Sizes::UNKNOWN };
    let tried = |sizes: Sizes, trials| sizes.values(Dimension::VALUE, trials, [0.0, f64::INFINITY]);
    let half = InitialGrid::WithinSize(&[0.5]);
    // Of a command of either sign half its largest size; of one with an offset half of the way that it moves.
    assert_eq!(tried(sizes([-4.0, 1.0], None), half), [2.0]);
    assert_eq!(tried(sizes([18.0, 22.0], None), half), [20.0]);
    assert_eq!(tried(sizes([-22.0, -18.0], None), half), [20.0]);
    let rates = InitialGrid::SlewAndScaled(&[0.1], &[3.0]);
    assert_eq!(tried(sizes([0.0, 1.0], Some(50.0)), rates), [5.0, 6.0]);
    assert_eq!(tried(sizes([0.0, 1.0], None), rates), [6.0]);
}

#[test]
fn every_effect_is_tried_however_large_or_small_what_is_measured() {
    for size in [1e-3, 1.0, 1e3] {
        let range = [-size, size];
        let all =
            Sizes { output: size, position: size, speed: size, value: size, range, record: 10.0, ..Sizes::UNKNOWN };
        for effect in effects() {
            // Waves of a given number per turn are not seen over a thousandth of a radian.
            let is_per_turn =
                |p: &EffectParameter| p.kind == ParameterKind::WaveNumber && matches!(p.grid, InitialGrid::Plain(_));
            let is_seen = size >= 1.0 || !effect.parameters().iter().any(is_per_turn);
            assert_eq!(all.combinations(effect.as_ref()).is_empty(), !is_seen, "{} at {size}", effect.name());
        }
    }
}
