//! Play is looked for in what one shaft is ahead of the other, however far both turn.

use mops_core::{Input, case::Hold, effect::Port};

use crate::fit::Meter;
use crate::motion::{relative_sizes, sizes};
use crate::records::Subject;
use crate::settings::Coverage;
use crate::testing::{Record, catalogue, fitted, integrated, study, subject, white};
use crate::{Options, diagnose};
use mops_outcome::diagnosis::{StrengthValue, Verdict};

/// Two inertias with an elastic shaft between.
const DRIVE: &str = r#"
states     = { q1 = "rad", w1 = "rad/s", q2 = "rad", w2 = "rad/s" }
inputs     = { u = "N*m" }
parameters = { J1 = "kg*m^2", J2 = "kg*m^2", k = "N*m/rad", d = "N*m*s/rad", b = "N*m*s/rad" }
der        = { q1 = "w1", q2 = "w2", w1 = "J1*w1' = u - k*(q1 - q2) - d*(w1 - w2)", w2 = "J2*w2' = k*(q1 - q2) + d*(w1 - w2) - b*w2" }
"#;

const NOISE: f64 = 7e-4;

/// How the shaft is damped.
#[derive(Clone, Copy)]
enum Damper {
    /// Within the gap too.
    Always,
    /// In contact, which never pulls.
    InContact,
}

/// A run with a gap of 9 mrad, 5 rad and more in all.
fn run(label: &str, mean: f64, damper: Damper) -> Record {
    const EVERY: f64 = 0.02;
    let torques: Vec<f64> = white(label, 0.4, 151).iter().map(|u| mean + u).collect();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let rates = |t: f64, x: &[f64; 4]| {
        let u = torques[((t / EVERY) as usize).min(150)];
        let ahead = x[0] - x[2];
        let (into, damped) = (ahead - ahead.clamp(-0.0045, 0.0045), 0.012 * (x[1] - x[3]));
        let shaft = match damper {
            Damper::Always => 6.0 * into + damped,
            Damper::InContact if into > 0.0 => (6.0 * into + damped).max(0.0),
            Damper::InContact if into < 0.0 => (6.0 * into + damped).min(0.0),
            Damper::InContact => 0.0,
        };
        [x[1], (u - shaft) / 0.0012, x[3], (shaft - 0.013 * x[3]) / 0.004]
    };
    let states = integrated(rates, [0.0; 4], 0.01, 300);
    assert!(states[299][2].abs() > 5.0, "{}", states[299][2]);
    let signal = |name: &'static str, index: usize| {
        let noise = white(&format!("{label} {name}"), NOISE, states.len());
        (name, states.iter().zip(noise).map(|(x, e)| x[index] + e).collect(), NOISE)
    };
    let times = (0..151).map(|k| EVERY * f64::from(k)).collect();
    let input = Input::Sampled { times, values: torques.clone(), hold: Hold::Zero };
    Record {
        inputs: vec![("u", input)],
        times: (0..300).map(|k| 0.01 * f64::from(k)).collect(),
        signals: vec![signal("q1", 0), signal("q2", 2)],
    }
}

fn drive(damper: Damper) -> Subject {
    let start = [0.0015, 0.005, 4.5, 0.015, 0.01, 0.0, 0.0, 0.0, 0.0];
    subject(DRIVE, &start, 4, vec![run("forward", 0.08, damper), run("backward", -0.08, damper)])
}

#[test]
fn gaps_are_tried_as_wide_as_one_shaft_is_ahead_of_the_other() {
    let subject = drive(Damper::Always);
    let simulations = Meter::new(&());
    let (fit, variant, _, trajectories) = fitted(&subject, &simulations);
    let ports = &variant.model.model().interface().ports;
    let joints: Vec<&Port> = ports.iter().filter(|port| matches!(port, Port::Joint { .. })).collect();
    let turned = sizes(joints[0], &variant.model, &fit.pieces, &trajectories, Coverage::DEFAULT).unwrap();
    let ahead =
        relative_sizes(joints[0], joints[1], &variant.model, &fit.pieces, &trajectories, Coverage::DEFAULT).unwrap();
    assert!(turned.position > 10.0 && (0.0045..0.3).contains(&ahead.position), "{turned:?} {ahead:?}");
    assert_eq!(ahead.output, turned.output);
}

/// The gap and the time constant of the damping in contact that are found.
fn found(damper: Damper) -> [StrengthValue; 2] {
    let subject = drive(damper);
    let effects = catalogue(&["coupling-play", "cubic-stiffness", "flexible-mode", "periodic-disturbance"]);
    let made =
        diagnose(&study(&subject), &effects, &Options { max_effects: 1, level: 0.01, ..Options::default() }, &())
            .unwrap();
    assert_eq!(made.verdict, Verdict::Effect, "{:?}", made.found);
    assert_eq!((made.found[0].effect.as_str(), made.found[0].place.as_str()), ("coupling-play", "joint:q1"));
    assert!(covers(&made.found[0].strengths[0], 6.0), "{:?}", made.found[0].strengths);
    [1, 2].map(|k| made.found[0].strengths[k].clone())
}

fn covers(found: &StrengthValue, value: f64) -> bool {
    found.interval95.is_some_and(|[low, high]| low <= value && value <= high && high - low < value)
}

#[test]
#[ignore = "full tier"]
fn play_between_shafts_that_turn_far_is_found() {
    let [gap, tau] = found(Damper::Always);
    assert!(covers(&gap, 0.009), "{gap:?}");
    assert!(tau.value < 2e-4, "{tau:?}");
}

/// Of the damping of the shaft too the gap takes away what does not act in contact; 0.012 N m s/rad over 6 N m/rad.
#[test]
#[ignore = "full tier"]
fn play_with_a_damper_that_acts_in_contact_alone_is_found() {
    let [gap, tau] = found(Damper::InContact);
    assert!(covers(&gap, 0.009), "{gap:?}");
    assert!(covers(&tau, 0.002), "{tau:?}");
}
