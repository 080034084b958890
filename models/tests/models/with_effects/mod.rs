//! Models with effects, compared with closed forms.

use std::sync::Arc;

use mops_core::{
    Case, Failure, Input, Instant, Interface, Job, Model, ModelOptions, Parameter, Plant, Variable,
    case::Hold,
    effect::{Placement, Port},
    model::OperatingPoint,
};
use mops_effects::effects;
use mops_language::Scalar;
use mops_math as math;
use mops_models::WithEffects;
use mops_models::equations::EquationsOptions;
use mops_models::kernel::{PlantModel, Simulated, mechanism};

use crate::simulated::{check_tangents_by, respond};

mod along;
mod past;

fn equations(text: &str) -> Arc<dyn Model> {
    let options: EquationsOptions = toml::from_str(text).expect("it is TOML");
    Arc::from(options.build().expect("it is a model"))
}

fn with(model: &Arc<dyn Model>, list: &[(&str, &str)]) -> WithEffects {
    let port = |place: &str| -> Port {
        model.interface().ports.iter().find(|p| p.to_string() == place).expect("the port is there").clone()
    };
    let place = |(i, (name, place)): (usize, &(&str, &str))| Placement {
        name: format!("e{i}"),
        effect: effects().into_iter().find(|e| e.name() == *name).expect("it is in the catalogue"),
        port: port(place),
        companion: None,
    };
    WithEffects::new(Arc::clone(model), list.iter().enumerate().map(place).collect()).expect("it fits")
}

const BLOCK: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg" }
der        = { x = "v", v = "m*v' = u" }
"#;

/// Returns the final values of `x` and `v`.
fn run(model: &dyn Model, parameters: &[f64], inputs: Vec<(String, Input)>, end: f64) -> [f64; 2] {
    let case = Case { inputs, ..Case::default() };
    let job = Job { case: &case, parameters, signals: &[0, 1], horizon: end };
    let analysis = model.analyse(&job).expect("it simulates");
    ["x", "v"].map(|signal| analysis.trace(signal).last())
}

#[test]
fn a_block_with_dry_friction_stops_where_its_energy_is_used_up() {
    let model = with(&equations(BLOCK), &[("coulomb-friction", "joint:x")]);
    // m = 2, x0 = 0, v0 = 3, c = 4: the block stops after m v0/c = 1.5 s at m v0^2/(2 c) = 2.25 m, and stays.
    let end = run(&model, &[2.0, 0.0, 3.0, 4.0], Vec::new(), 5.0);
    assert!((end[0] - 2.25).abs() < 1e-8 && end[1] == 0.0, "{end:?}");
    let early = run(&model, &[2.0, 0.0, 3.0, 4.0], Vec::new(), 1.0);
    assert!((early[1] - 1.0).abs() < 1e-8 && (early[0] - 2.0).abs() < 1e-8, "{early:?}");
}

#[test]
fn a_force_below_the_limit_moves_nothing_and_one_above_it_moves_with_the_difference() {
    let model = with(&equations(BLOCK), &[("coulomb-friction", "joint:x")]);
    let push = |force: f64| vec![("u".to_owned(), Input::Constant(force))];
    assert_eq!(run(&model, &[2.0, 1.0, 0.0, 4.0], push(3.9), 5.0), [1.0, 0.0]);
    let end = run(&model, &[2.0, 1.0, 0.0, 4.0], push(5.0), 2.0);
    assert!((end[1] - 1.0).abs() < 1e-9 && (end[0] - 2.0).abs() < 1e-9, "{end:?}");
}

#[test]
fn an_equation_written_the_other_way_round_has_the_same_friction() {
    let turned = BLOCK.replace("m*v' = u", "u = m*v'");
    let model = with(&equations(&turned), &[("coulomb-friction", "joint:x"), ("viscous-friction", "joint:x")]);
    let end = run(&model, &[2.0, 0.0, 3.0, 4.0, 0.0], Vec::new(), 5.0);
    assert!((end[0] - 2.25).abs() < 1e-8 && end[1] == 0.0, "{end:?}");
    let end = run(&model, &[2.0, 0.0, 3.0, 0.0, 1.0], Vec::new(), 2.0);
    assert!((end[1] - 3.0 * math::exp(-1.0)).abs() < 1e-8, "{end:?}");
}

#[test]
fn a_looser_tolerance_saves_steps_and_a_tighter_one_changes_no_bit() {
    let job = Job { case: &Case::default(), parameters: &[2.0, 0.3, 3.0, 1.0], signals: &[0], horizon: 4.0 };
    let model = || with(&equations(BLOCK), &[("viscous-friction", "joint:x")]);
    let simulated = |model: WithEffects| {
        let analysis = model.analyse(&job).expect("it simulates");
        let steps = analysis.response().expect("it is in time").work.steps;
        (analysis.trace("x").sample(&[4.0])[0], steps)
    };
    let (exact, loose) = (simulated(model()), simulated(model().with_tolerance(1e-4)));
    assert_eq!(simulated(model().with_tolerance(1e-12)), exact);
    assert!(loose.1 < exact.1, "{loose:?} {exact:?}");
    // Under viscous friction alone a mass m with speed v comes to `x + m v (1 - exp(-d t/m))/d`.
    let closed = 0.3 + 2.0 * 3.0 * (1.0 - math::exp(-2.0));
    assert!((exact.0 - closed).abs() < 1e-7 && (loose.0 - closed).abs() < 1e-2, "{loose:?} {exact:?} {closed}");
}

#[test]
fn neutral_effects_change_no_bit() {
    let plain = equations(BLOCK);
    let model = with(&plain, &[("coulomb-friction", "joint:x"), ("viscous-friction", "joint:x")]);
    let times: Vec<f64> = (0..50).map(|k| f64::from(k) * 0.1).collect();
    let values = times.iter().map(|t| math::sin(3.0 * t)).collect();
    let inputs = vec![("u".to_owned(), Input::Sampled { times, values, hold: Hold::Zero })];
    let a = run(plain.as_ref(), &[2.0, 0.3, 0.7], inputs.clone(), 4.9);
    let b = run(&model, &[2.0, 0.3, 0.7, 0.0, 0.0], inputs, 4.9);
    assert_eq!(a.map(f64::to_bits), b.map(f64::to_bits));
}

#[test]
fn a_disturbance_acts_as_an_input_that_adds_the_same_rate() {
    let friction = [("coulomb-friction", "joint:x")];
    let mass = 2.0;
    let times: Vec<f64> = (0..50).map(|k| f64::from(k) * 0.1).collect();
    let sampled = |size: f64| {
        let values = times.iter().map(|t| size * math::sin(3.0 * t)).collect();
        Input::Sampled { times: times.clone(), values, hold: Hold::Zero }
    };
    let disturbed = Case { disturbances: vec![("v".to_owned(), sampled(3.0))], ..Case::default() };
    let driven = Case { inputs: vec![("u".to_owned(), sampled(3.0 * mass))], ..Case::default() };
    for effects in [&friction[..], &[]] {
        let model = with(&equations(BLOCK), effects);
        let parameters = &[mass, 0.3, 0.7, 2.5][..3 + effects.len()];
        // By the initial speed, on which the disturbance does not depend.
        let seeds = [[0.0, 0.0, 1.0, 0.0][..parameters.len()].to_vec()];
        let simulated = [&disturbed, &driven].map(|case| {
            let job = Job { case, parameters, signals: &[0, 1], horizon: 4.9 };
            let (analysis, tangents) = model.tangents(&job, &seeds).expect("it has them").expect("it simulates");
            let all = std::iter::once(&analysis).chain(&tangents);
            all.map(|a| ["x", "v"].map(|signal| a.trace(signal).sample(&[1.0, 2.05, 3.3, 4.9]))).collect::<Vec<_>>()
        });
        for (a, b) in simulated[0].iter().flatten().flatten().zip(simulated[1].iter().flatten().flatten()) {
            assert!((a - b).abs() < 1e-9 * (1.0 + b.abs()), "{a} {b}");
        }
        let moments = [&disturbed, &driven].map(|case| {
            let job = Job { case, parameters, signals: &[0, 1], horizon: 4.9 };
            model.along(&job, &[0.55, 2.05]).expect("it simulates")
        });
        for (a, b) in moments[0].moments.iter().zip(&moments[1].moments) {
            assert!((a.rates[1] - b.rates[1]).abs() < 1e-7, "{:?} {:?}", a.rates, b.rates);
            // The columns of the input and of the force are equal.
            assert_eq!(a.b[(1, 0)], a.b[(1, 1)]);
        }
        let job = Job { case: &disturbed, parameters, signals: &[0, 1], horizon: 4.9 };
        assert_eq!(model.mobilities(&job).expect("it starts"), [1.0 / mass]);
        // Twice the mass under twice the friction moves alike.
        let doubled: Vec<f64> =
            parameters.iter().enumerate().map(|(k, p)| if k == 1 || k == 2 { *p } else { 2.0 * p }).collect();
        let same = Job { parameters: &doubled, ..job };
        let end = |job: &Job<'_>| model.analyse(job).expect("it simulates").trace("x").sample(&[4.9])[0];
        assert!((end(&job) - end(&same)).abs() < 1e-9 * end(&job).abs(), "{} {}", end(&job), end(&same));
    }
    let lost = Case { disturbances: vec![("w".to_owned(), Input::Constant(1.0))], ..Case::default() };
    let job = Job { case: &lost, parameters: &[2.0, 0.3, 0.7], signals: &[0], horizon: 1.0 };
    assert!(
        with(&equations(BLOCK), &[]).analyse(&job).is_err(),
        "a disturbance at an unknown place must not be ignored"
    );
    let plain = equations(BLOCK);
    let job = Job { case: &disturbed, parameters: &[2.0, 0.3, 0.7], signals: &[0], horizon: 4.9 };
    assert!(plain.analyse(&job).is_err(), "a model without effects must not ignore a disturbance");
}

#[test]
fn tangents_with_respect_to_effect_parameters_agree_with_differences() {
    let model = with(&equations(BLOCK), &[("coulomb-friction", "joint:x"), ("viscous-friction", "joint:x")]);
    let inputs = vec![("u".to_owned(), Input::Sine { amplitude: 6.0, frequency: 0.4, phase: 0.3, offset: 0.5 })];
    let case = Case { inputs, ..Case::default() };
    let parameters = [2.0, 0.0, 3.0, 2.5, 0.8];
    let job = Job { case: &case, parameters: &parameters, signals: &[0, 1], horizon: 4.0 };
    let seeds: Vec<Vec<f64>> = (0..5).map(|i| (0..5).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    let (_, tangents) = model.tangents(&job, &seeds).expect("it has them").expect("it simulates");
    for (i, tangent) in tangents.iter().enumerate() {
        let moved = |by: f64| {
            let mut p = parameters;
            p[i] += by;
            run(&model, &p, case.inputs.clone(), 4.0)
        };
        let (up, down) = (moved(1e-5), moved(-1e-5));
        for (k, signal) in ["x", "v"].into_iter().enumerate() {
            let (exact, difference) = (tangent.trace(signal).last(), (up[k] - down[k]) / 2e-5);
            assert!((exact - difference).abs() < 1e-4 * (1.0 + difference.abs()), "{i} {signal} {exact} {difference}");
        }
    }
}

/// Checks tangents where the force of a damped stop jumps on contact, at a time that depends on all earlier parameters.
#[test]
fn tangents_across_damped_contacts_agree_with_differences() {
    let exact = "tolerance = { relative = 1e-12, absolute = 1e-14 }";
    let model = with(&equations(&format!("{BLOCK}{exact}")), &[("end-stop", "joint:x")]);
    let case = Case { inputs: vec![("u".to_owned(), Input::Constant(1.0))], ..Case::default() };
    let thrown = [("m", 2.0), ("x0", 0.0), ("v0", 3.0)];
    let stops = [("e0.k", 5000.0), ("e0.low", -0.2), ("e0.high", 0.3), ("e0.tau", 4e-3)];
    let parameters = [thrown.as_slice(), &stops].concat();
    check_tangents_by(1e-6, &model, &case, &parameters, 0.6);
    let events = respond(&model, &case, &parameters, 0.6).events;
    assert!(events.iter().filter(|event| event.what == "a contact closes").count() > 1, "{events:?}");
}

#[test]
fn stops_that_have_crossed_are_one_spring_about_their_middle() {
    let model = with(&equations(BLOCK), &[("end-stop", "joint:x")]);
    let (m, k): (f64, f64) = (2.0, 50.0);
    let [x, v] = run(&model, &[m, 0.3, 0.0, k, 0.5, -0.3, 0.0], Vec::new(), 4.0);
    let omega = (k / m).sqrt();
    assert!((x - 0.1 - 0.2 * math::cos(4.0 * omega)).abs() < 1e-5, "{x}");
    assert!((v + 0.2 * omega * math::sin(4.0 * omega)).abs() < 1e-5, "{v}");
}

/// Checks a wall 20 mm behind the stop, which reverses the block and resets it to 0.2 m in front of the stop.
#[test]
fn a_contact_is_updated_where_the_state_jumps() {
    let text = format!("{BLOCK}when = {{ wall = {{ guard = \"0.32 - x\", reset = {{ x = \"0.1\", v = \"-v\" }} }} }}");
    let model = with(&equations(&text), &[("end-stop", "joint:x")]);
    let [x, v] = run(&model, &[2.0, 0.0, 3.0, 500.0, -9.0, 0.3, 1e-3], Vec::new(), 0.2);
    // The block moves freely afterwards, with no contact but the first.
    assert!(v < -2.9 && x < 0.1, "{x} {v}");
    let case = Case::default();
    let thrown =
        [("m", 2.0), ("x0", 0.0), ("v0", 3.0), ("e0.k", 500.0), ("e0.low", -9.0), ("e0.high", 0.3), ("e0.tau", 1e-3)];
    let events = respond(&model, &case, &thrown, 0.2).events;
    assert_eq!(events.len(), 2, "{events:?}");
}

#[test]
fn a_stop_is_a_spring_in_the_linear_system_while_it_is_reached() {
    let model = with(&equations(BLOCK), &[("end-stop", "joint:x")]);
    let (m, k) = (2.0, 5000.0);
    let parameters = [m, 0.0, 3.0, k, -0.2, 0.3, 4e-3];
    let job = Job { case: &Case::default(), parameters: &parameters, signals: &[0], horizon: 0.3 };
    // Reached at 0.1 s, for at most half a period, 63 ms.
    let moments = model.along(&job, &[0.05, 0.12, 0.2]).expect("it simulates");
    let stiffness: Vec<f64> = moments.moments.iter().map(|moment| moment.a[(1, 0)]).collect();
    assert_eq!(stiffness, [0.0, -k / m, 0.0]);
}

#[test]
fn a_lag_at_rest_has_tangents_that_decay() {
    let model = with(&equations(BLOCK), &[("actuator-lag", "actuator:u")]);
    // The command is constantly 1 and the lag starts at 1: only its time constant limits the step.
    let (tau, mass) = (1.5e-3, 2.0);
    let u = Input::Constant(1.0);
    let case = Case { inputs: vec![("u".into(), u)], ..Case::default() };
    let parameters = [mass, 0.0, 0.0, tau, 0.0];
    let job = Job { case: &case, parameters: &parameters, signals: &[0, 1], horizon: 10.0 };
    let mut of_start = vec![0.0; parameters.len()];
    of_start[4] = 1.0;
    let (_, tangents) = model.tangents(&job, &[of_start]).expect("it has them").expect("it simulates");
    // An initial state that is 1 too high adds an impulse of tau.
    assert!((tangents[0].trace("v").last() * mass / tau - 1.0).abs() < 1e-3, "{}", tangents[0].trace("v").last());
}

#[test]
fn a_window_of_a_record_agrees_with_the_whole_record_for_actuators_with_hysteresis_or_delay() {
    const BEGINS: f64 = 1.03;
    let times: Vec<f64> = (0..20).map(|k| f64::from(k) * 0.1).collect();
    let values: Vec<f64> = (0..20).map(|k| math::sin(f64::from(k) * 1.7)).collect();
    let block = equations(BLOCK);
    for (effect, parameter) in [("input-rate-limit", 1.9), ("backlash", 0.8), ("input-delay", 0.17)] {
        let model = with(&block, &[(effect, "actuator:u")]);
        for hold in [Hold::Zero, Hold::First] {
            let input = |from: f64| {
                let times = times.iter().map(|t| t - from).collect();
                vec![("u".to_owned(), Input::Sampled { times, values: values.clone(), hold })]
            };
            let parameters = |[x, v]: [f64; 2]| {
                let mut parameters = vec![2.0, x, v, parameter];
                parameters.resize(model.interface().parameters.len(), 0.0);
                parameters
            };
            let part = run(&model, &parameters([0.1, 0.2]), input(0.0), BEGINS);
            let whole = run(&model, &parameters([0.1, 0.2]), input(0.0), 1.9);
            let parameters = parameters(part);
            let case = Case { inputs: input(BEGINS), begins: BEGINS, ..Case::default() };
            let job = Job { case: &case, parameters: &parameters, signals: &[0, 1], horizon: 1.9 - BEGINS };
            let window = model.analyse(&job).expect("it simulates");
            let end = ["x", "v"].map(|signal| window.trace(signal).last());
            for (signal, whole) in ["x", "v"].into_iter().zip(whole) {
                let window = window.trace(signal).last();
                // Kinks within a step reduce the accuracy of the integrator.
                assert!((window - whole).abs() < 1e-6, "{effect} {hold:?} {signal}: {window} {whole}");
            }
            // Samples before time 0 count, whatever the clock.
            let late = run(&model, &parameters, input(BEGINS), 1.9 - BEGINS);
            assert!((late[1] - end[1]).abs() < 1e-6, "{effect} {hold:?}: {late:?} {end:?}");
        }
    }
}

fn built_in(kind: &str) -> Arc<dyn Model> {
    let kinds = mops_models::kinds();
    let kind = kinds.iter().find(|known| known.name == kind).expect("it is there");
    Arc::from(kind.default_model().expect("every option has a default"))
}

/// Returns parameters in the order of the model, given by name; others have their defaults.
fn values(model: &dyn Model, given: &[(&str, f64)]) -> Vec<f64> {
    let unknown = given.iter().find(|(name, _)| !model.interface().parameters.iter().any(|p| p.variable.name == *name));
    assert_eq!(unknown, None);
    let value =
        |p: &Parameter| given.iter().find(|(name, _)| *name == p.variable.name).map(|(_, value)| *value).or(p.default);
    model.interface().parameters.iter().map(|p| value(p).expect(&p.variable.name)).collect()
}

/// Returns traces of signals over 6 s and the events, for a torque that rises, stays constant and is removed.
fn pushed(
    model: &dyn Model,
    given: &[(&str, f64)],
    signals: &[&str],
) -> (Vec<mops_core::Trace>, Vec<mops_core::model::Event>) {
    let times: Vec<f64> = (0..60).map(|k| f64::from(k) * 0.1).collect();
    let push = |&t: &f64| {
        if t < 2.0 {
            0.06 * math::sin(4.0 * t)
        } else if t < 4.0 {
            0.008
        } else {
            -0.03
        }
    };
    let values_of = times.iter().map(push).collect();
    let inputs = vec![("u".to_owned(), Input::Sampled { times, values: values_of, hold: Hold::Zero })];
    let case = Case { inputs, ..Case::default() };
    let index = |name: &&str| model.interface().signals.iter().position(|s| s.name == **name).expect("it is there");
    let wanted: Vec<usize> = signals.iter().map(index).collect();
    let parameters = values(model, given);
    let job = Job { case: &case, parameters: &parameters, signals: &wanted, horizon: 6.0 };
    let analysis = model.analyse(&job).expect("it simulates");
    let response = analysis.response().expect("it is a simulation").clone();
    (
        signals.iter().map(|name| response.trace(name).expect("the signal was requested").clone()).collect(),
        response.events,
    )
}

/// Returns the largest difference of two models' signals, each divided by the maximum of the signal or 1.
fn apart(a: &[mops_core::Trace], b: &[mops_core::Trace]) -> f64 {
    let times = || (0..460).map(|k| f64::from(k) * 0.013);
    let largest = |of: &dyn Fn(f64) -> f64| times().map(|t| of(t).abs()).fold(0.0, f64::max);
    let relative = |(a, b): (&mops_core::Trace, &mops_core::Trace)| {
        largest(&|t| a.at(t) - b.at(t)) / largest(&|t| a.at(t)).max(1.0)
    };
    a.iter().zip(b).map(relative).fold(0.0, f64::max)
}

const LUMPED: [(&str, f64); 7] =
    [("a", 0.0044), ("b", 0.012), ("c", 0.004), ("d", 0.05), ("ba", 0.002), ("bp", 3e-4), ("theta0", 2.2)];

#[test]
fn dry_friction_as_an_effect_agrees_with_that_of_the_model_with_sticking() {
    let plain = built_in("furuta");
    let signals = ["phi", "dphi", "theta", "dtheta"];
    let (own, events) = pushed(plain.as_ref(), &[&LUMPED[..], &[("ca", 0.012)]].concat(), &signals);
    assert!(events.iter().any(|event| event.what == "arm sticks"), "{events:?}");
    let arm = with(&plain, &[("coulomb-friction", "joint:phi")]);
    let (added, events) = pushed(&arm, &[&LUMPED[..], &[("e0.c", 0.012)]].concat(), &signals);
    assert!(events.iter().any(|event| event.what == "a joint sticks"), "{events:?}");
    assert!(apart(&own, &added) < 1e-7, "{}", apart(&own, &added));

    // Equal friction in both joints, shared between the model and the effect.
    let (own, _) = pushed(plain.as_ref(), &[&LUMPED[..], &[("ca", 0.012), ("cp", 0.001)]].concat(), &signals);
    let both = with(&plain, &[("coulomb-friction", "joint:phi"), ("coulomb-friction", "joint:theta")]);
    let (added, _) = pushed(&both, &[&LUMPED[..], &[("e0.c", 0.012), ("e1.c", 0.001)]].concat(), &signals);
    assert!(apart(&own, &added) < 1e-7, "{}", apart(&own, &added));
    let (shared, _) = pushed(&arm, &[&LUMPED[..], &[("ca", 0.008), ("cp", 0.001), ("e0.c", 0.004)]].concat(), &signals);
    assert!(apart(&own, &shared) < 1e-7, "{}", apart(&own, &shared));
}

#[test]
fn a_pendulum_of_equations_takes_friction_as_the_built_in_one_does() {
    let text = equations(include_str!("../../equations/furuta-free.toml"));
    let text = with(&text, &[("coulomb-friction", "joint:ph"), ("coulomb-friction", "joint:th")]);
    let of_text = [("b", 0.012), ("c", 0.004), ("d", 0.05), ("ba", 0.002), ("bp", 3e-4), ("th0", 2.2)];
    let (added, _) = pushed(&text, &[&of_text[..], &[("e0.c", 0.012), ("e1.c", 0.001)]].concat(), &["ph", "th"]);
    let plain = built_in("furuta");
    let (own, _) = pushed(plain.as_ref(), &[&LUMPED[..], &[("ca", 0.012), ("cp", 0.001)]].concat(), &["phi", "theta"]);
    assert!(apart(&own, &added) < 1e-7, "{}", apart(&own, &added));
}

#[test]
fn bodies_with_bearings_take_forces_at_every_joint() {
    // A bearing with a flat table is Coulomb friction; one that rises by 0.002 in 1 rad/s also has viscous friction.
    let bodies = [("J", 4e-3), ("Ja", 0.01), ("m", 0.04), ("l", 0.1), ("r", 0.2), ("theta0", 2.2)];
    for (kind, signals) in [("furuta-2-joint", &["phi", "theta"][..]), ("furuta-3-joint", &["phi", "theta", "psi"])] {
        let plain = built_in(kind);
        let third: &[(&str, f64)] = if signals.len() == 3 { &[("c", 2.0), ("d", 2e-3), ("psi0", 0.02)] } else { &[] };
        let own = [&bodies[..], third, &[("tau11", 0.012), ("tau21", 0.001), ("tau22", 0.002)]].concat();
        let mut own = own;
        own.extend(if third.is_empty() {
            vec![("tau12", 0.012)]
        } else {
            ["tau01", "tau05", "tau12"].map(|n| (n, 0.012)).to_vec()
        });
        let (own, _) = pushed(plain.as_ref(), &own, signals);
        let added = with(
            &plain,
            &[
                ("coulomb-friction", "joint:phi"),
                ("coulomb-friction", "joint:theta"),
                ("viscous-friction", "joint:theta"),
            ],
        );
        let parameters = [("e0.c", 0.012), ("e1.c", 0.001), ("e2.d", 0.001)];
        let (added, _) = pushed(&added, &[&bodies[..], third, &parameters].concat(), signals);
        assert!(apart(&own, &added) < 1e-7, "{kind}: {}", apart(&own, &added));
    }
}

/// Pendulum `theta'' = u - 4 sin(theta) + w`, written in Rust.
struct Pendulum(Interface);

impl Pendulum {
    fn new() -> Self {
        let joint = mechanism::Joint { angle: "theta", about: "pendulum", start: 0.5, events: [""; 4] };
        let gravity = vec![Parameter::new("d", "N m", "gravity torque")];
        let interface = mechanism::interface(&[joint], gravity, vec![Variable::new("u", "N m", "torque")]);
        Self(Interface { ports: mechanism::ports(&["theta"], &["u"]), ..interface })
    }
}

struct WithParameters<S>([S; 3]);

impl<S: Scalar> Plant<S> for WithParameters<S> {
    fn start(&self) -> Vec<S> {
        self.0[1..].to_vec()
    }
    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        dx[0] = at.x[1];
        dx[1] = at.u[0] - self.0[0] * at.x[0].sin() + at.w[0];
    }
}

impl PlantModel for Pendulum {
    fn interface(&self) -> &Interface {
        &self.0
    }
    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
        Ok(WithParameters(parameters.try_into().expect("one parameter and two initial states")))
    }
}

#[test]
fn a_plant_of_ones_own_is_simulated_linearised_and_takes_effects_like_one_of_text() {
    let own: Arc<dyn Model> = Arc::new(Simulated::new(Pendulum::new()));
    let text = equations(
        r#"
        states = { theta = "rad", dtheta = "rad/s" }
        inputs = { u = "N m" }
        parameters = { d = "N m" }
        constants = { J = "1 kg m2" }
        start = { theta = "0.5" }
        der = { theta = "dtheta", dtheta = "J*dtheta' = u - d*sin(theta)" }
        "#,
    );
    let names: Vec<String> = own.interface().ports.iter().map(ToString::to_string).collect();
    assert_eq!(names, ["joint:theta", "process:theta", "actuator:u", "sensor:theta", "sensor:dtheta"]);
    let signals = ["theta", "dtheta"];
    let both = |given: &[(&str, f64)], effects: &[(&str, &str)]| {
        let [a, b] = [&own, &text].map(|model| pushed(&with(model, effects), given, &signals).0);
        apart(&a, &b)
    };
    assert!(both(&[("d", 4.0)], &[]) < 1e-8);
    assert!(both(&[("d", 4.0), ("e0.c", 0.05)], &[("coulomb-friction", "joint:theta")]) < 1e-7);

    let at =
        OperatingPoint { parameters: &[4.0, 0.0, 0.0], states: &[0.3, 0.0], inputs: &[0.0], past: &[], at_rest: true };
    let local = own.local(&at).expect("it has equations").expect("it is defined");
    assert!((local.slopes[(1, 0)] + 4.0 * math::cos(0.3)).abs() < 1e-14 && local.slopes[(1, 2)] == 1.0);
    assert_eq!(own.start_values(at.parameters), Some(vec![0.0, 0.0]));

    let case = Case::default();
    let job = Job { case: &case, parameters: &[4.0, 0.01, 0.0], signals: &[0], horizon: 2.0 };
    let (analysis, tangents) = own.tangents(&job, &[vec![0.0, 1.0, 0.0]]).expect("it has them").expect("it simulates");
    // A small swing is 0.01 cos(2 t), and so is its derivative with respect to the initial angle, to 1e-4.
    assert!((analysis.trace("theta").at(2.0) - 0.01 * math::cos(4.0)).abs() < 1e-6);
    assert!((tangents[0].trace("theta").at(2.0) - math::cos(4.0)).abs() < 1e-3);
}

#[test]
fn tangents_of_a_stiff_overflow_stay_bounded() {
    let tank = equations(
        r#"
        states     = { h = "m" }
        inputs     = { u = "m/s" }
        parameters = { c = "m^0.5/s" }
        der        = { h = "h' = u - c*sqrt(max(h, 0 [m]))" }
        "#,
    );
    let model = with(&tank, &[("overflow", "process:h")]).with_tolerance(1e-4);
    let times: Vec<f64> = (0..500).map(|k| 4.0 * f64::from(k)).collect();
    let values: Vec<f64> = (0..500).map(|k: i32| 0.1 + 0.08 * math::sin(f64::from(k) * f64::from(k))).collect();
    let case =
        Case { inputs: vec![("u".to_owned(), Input::Sampled { times, values, hold: Hold::Zero })], ..Case::default() };
    // Outflow, initial level; k, level and exponent of the overflow.
    let parameters = [0.03, 5.0, 29.0, 10.0, 1.0];
    let job = Job { case: &case, parameters: &parameters, signals: &[0], horizon: 2000.0 };
    let seed: Vec<f64> = (0..5).map(|k| f64::from(u8::from(k == 3))).collect();
    let (value, tangents) = model.tangents(&job, &[seed]).expect("it has them").expect("it simulates");
    let (value, tangent) = (value.trace("h"), tangents[0].trace("h"));
    // A level follows the edge or stays below it: its derivative by the edge lies between 0 and 1.
    let derivatives = (1..=500).map(|k| tangent.at(4.0 * f64::from(k)));
    assert!(value.at(600.0) > 10.0, "it overflows");
    let [low, high] = derivatives.fold([0.0_f64, 0.0_f64], |[low, high], d| [low.min(d), high.max(d)]);
    assert!(low > -0.05 && high < 1.05 && high > 0.9, "{low} {high}");
}
