//! Properties of all effects of the catalogue.

use std::collections::BTreeSet;

use mops_core::{
    Effect,
    effect::{BoundEffect, EffectClass, EffectParameter, InitialGrid, PortKind, PortState},
};
use mops_language::{Dual7, Scalar};
use mops_math as math;

use super::effects;

/// Numbers that fill the range from 0 to 1 evenly: the fractional parts of multiples of the golden ratio.
struct Even(f64);

impl Even {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = (self.0 + 0.618_033_988_749_895).fract();
        low + (high - low) * self.0
    }
}

/// Names of all quantities that an effect may use, including its states: one number each.
const SEEN: [&str; 12] =
    ["value", "q", "v", "a", "mobility", "other", "other speed", "z1", "z2", "memory 1", "memory 2", "memory 3"];

/// Returns a value for every quantity.
fn place(even: &mut Even) -> [f64; 12] {
    SEEN.map(|name| match name {
        "mobility" => even.between(0.5, 2.0),
        "z1" | "z2" => even.between(-0.9, 0.9),
        // The second is a time in the past.
        "memory 2" => even.between(-2.0, 0.2),
        _ => even.between(-2.0, 2.0),
    })
}

fn at<S: Scalar>(seen: &[S; 12]) -> PortState<'static, S> {
    let [value, q, v, a, mobility, other, other_speed, ..] = *seen;
    PortState { t: S::from(0.3), value, q, v, a, mobility, other, other_speed, u: &[], closed: None }
}

/// Returns the output of an effect: value, delay, the four numbers of dry friction, and the rates of its states.
fn answer<S: Scalar>(effect: &dyn Effect, acting: &dyn BoundEffect<S>, seen: &[S; 12]) -> Vec<S> {
    let at = at(seen);
    let z = &seen[7..7 + effect.states()];
    let mut all = vec![if effect.hysteresis_states() > 0 {
        acting.hysteresis_value(&at, &seen[9..9 + effect.hysteresis_states()])
    } else {
        acting.value(&at, z)
    }];
    all.extend(acting.delay());
    if let Some(friction) = acting.friction(&at, z) {
        all.extend(friction.sliding);
        all.extend(friction.limit);
    }
    let mut dz = vec![S::from(0.0); effect.states()];
    acting.rates(&at, z, &mut dz);
    all.extend(dz);
    all
}

/// Returns a value within the bounds.
fn parameter(of: &EffectParameter, even: &mut Even) -> f64 {
    match of.bounds {
        [low, high] if high.is_finite() => low + (high.min(low + 3.0) - low) * even.between(0.2, 0.8),
        [low, _] if low.is_finite() => even.between(0.3, 1.5),
        _ => even.between(-1.5, 1.5),
    }
}

fn parameters(effect: &dyn Effect, even: &mut Even) -> Vec<f64> {
    effect.parameters().iter().map(|of| parameter(of, even)).collect()
}

fn at_joints(effect: &dyn Effect) -> bool {
    effect.ports().contains(&PortKind::Joint)
}

#[test]
fn names_are_unique_and_in_kebab_case() {
    let mut names = BTreeSet::new();
    for effect in effects() {
        assert!(names.insert(effect.name()), "two effects have the name `{}`", effect.name());
    }
    let plain = |name: &&str| name.chars().all(|c| c.is_ascii_lowercase() || c == '-') && !name.starts_with('-');
    assert!(names.iter().all(plain), "{names:?}");
}

#[test]
fn every_effect_has_a_description_a_formula_and_a_source() {
    for effect in effects() {
        for text in [effect.about(), effect.formula(), effect.source()] {
            assert!(!text.is_empty() && !text.contains("  "), "{}: {text}", effect.name());
        }
        assert!(effect.about().ends_with('.'), "{}", effect.name());
        assert!(effect.source().contains(['1', '2']), "{} has a year in its source", effect.name());
        assert!(!effect.ports().is_empty(), "{}", effect.name());
    }
}

#[test]
fn only_the_first_strength_has_a_null_value_and_it_is_within_the_bounds() {
    for effect in effects() {
        let [first, shapes @ ..] = effect.parameters() else { panic!("{} has no parameter", effect.name()) };
        let neutral = first.null_value.expect("the first parameter makes it vanish");
        assert!(first.bounds[0] <= neutral && neutral <= first.bounds[1], "{}", effect.name());
        for shape in shapes {
            let fact = "only the first parameter is a strength: make this one a shape, such as a ratio to it";
            assert!(shape.null_value.is_none(), "{}: `{}`: {fact}", effect.name(), shape.name);
        }
        let names: BTreeSet<&str> = effect.parameters().iter().map(|s| s.name).collect();
        assert_eq!(names.len(), effect.parameters().len(), "{}", effect.name());
    }
}

#[test]
fn first_trials_are_few_and_allowed() {
    for effect in effects() {
        let mut count = 1;
        for of in effect.parameters() {
            let allowed = |values: &[f64]| values.iter().all(|v| of.bounds[0] <= *v && *v <= of.bounds[1]);
            match of.grid {
                InitialGrid::Linear => assert!(of.null_value == Some(0.0), "{}: {}", effect.name(), of.name),
                InitialGrid::Plain(values) | InitialGrid::Jumps(values) | InitialGrid::Zeros(values) => {
                    assert!(allowed(values), "{}", effect.name());
                    count *= values.len();
                }
                InitialGrid::Scaled(values) | InitialGrid::Within(values) | InitialGrid::WithinSize(values) => {
                    count *= values.len()
                }
                InitialGrid::SlewAndScaled(shares, multiples) => count *= shares.len() + multiples.len(),
                InitialGrid::WithinAndGap(values) | InitialGrid::ScaledAndGap(values) => count *= values.len() + 1,
                InitialGrid::PlainAndScaled(values, multiples) => {
                    assert!(allowed(values), "{}", effect.name());
                    count *= values.len() + multiples.len();
                }
                InitialGrid::Frequencies(_) | InitialGrid::Steps | InitialGrid::Moments(_) => {}
            }
        }
        assert!(count <= 44, "{}: {count}", effect.name());
    }
}

#[test]
fn a_neutral_effect_changes_no_bit() {
    let mut even = Even(0.1);
    for effect in effects() {
        for _ in 0..50 {
            let mut s = parameters(effect.as_ref(), &mut even);
            s[0] = effect.parameters()[0].null_value.expect("the first parameter makes it vanish");
            let (acting, seen) = (effect.bind(&s), place(&mut even));
            let all = answer(effect.as_ref(), acting.as_ref(), &seen);
            if effect.ports().iter().any(|port| matches!(port, PortKind::Actuator | PortKind::Sensor)) {
                assert_eq!(all[0].to_bits(), seen[0].to_bits(), "{} {s:?} {seen:?}", effect.name());
            } else {
                assert_eq!(all[0], 0.0, "{} {s:?} {seen:?}", effect.name());
            }
            assert_eq!(acting.delay().unwrap_or(0.0), 0.0, "{}", effect.name());
            if let Some(friction) = acting.friction(&at(&seen), &[]) {
                assert_eq!((friction.sliding, friction.limit), ([0.0; 2], [0.0; 2]), "{}", effect.name());
            }
        }
    }
}

#[test]
fn dissipative_effects_add_no_energy() {
    let mut even = Even(0.2);
    let dissipative = |e: &&_| -> bool {
        let e: &std::sync::Arc<dyn Effect> = e;
        e.class() == EffectClass::Dissipative && at_joints(e.as_ref()) && e.states() == 0
    };
    for effect in effects().iter().filter(dissipative) {
        for _ in 0..200 {
            let acting = effect.bind(&parameters(effect.as_ref(), &mut even));
            let at = at(&place(&mut even));
            assert!(acting.value(&at, &[]) * at.v <= 0.0, "{} {at:?}", effect.name());
            let Some(friction) = acting.friction(&at, &[]) else { continue };
            assert!(friction.sliding.iter().all(|force| *force >= 0.0), "{} {at:?}", effect.name());
            let rest = acting.friction(&PortState { v: 0.0, ..at }, &[]).expect("it has friction");
            let holds = rest.limit.iter().zip(rest.sliding).all(|(limit, sliding)| *limit >= sliding);
            assert!(holds, "{} {at:?}", effect.name());
        }
    }
}

#[test]
fn friction_with_states_dissipates_energy_over_a_cycle() {
    for effect in effects().iter().filter(|e| e.class() == EffectClass::Dissipative && e.states() > 0) {
        let acting = effect.bind(&parameters(effect.as_ref(), &mut Even(0.3)));
        let (mut z, mut dz) = ([0.0], [0.0]);
        let (mut work, h) = (0.0, 1e-4);
        // q = sin t over three periods, of which the last counts.
        for step in 0..(6.0 * std::f64::consts::PI / h) as usize {
            let t = step as f64 * h;
            let mut seen = [0.0; 12];
            (seen[1], seen[2]) = (math::sin(t), math::cos(t));
            let at = at(&seen);
            acting.rates(&at, &z, &mut dz);
            if t > 4.0 * std::f64::consts::PI {
                work += acting.value(&at, &z) * at.v * h;
            }
            z[0] += h * dz[0];
        }
        assert!(work < -0.1, "{} {work}", effect.name());
    }
}

#[test]
fn odd_effects_are_odd() {
    let odd = ["viscous-friction", "quadratic-drag", "cubic-drag", "power-friction", "quadratic-loss"];
    let passing = ["input-saturation", "input-dead-zone", "quadratic-input"];
    let mut even = Even(0.4);
    for effect in effects().iter().filter(|e| odd.contains(&e.name()) || passing.contains(&e.name())) {
        let acting = effect.bind(&parameters(effect.as_ref(), &mut even));
        for _ in 0..50 {
            let seen = place(&mut even);
            let there = acting.value(&at(&seen), &[]);
            assert_eq!(there, -acting.value(&at(&seen.map(|x| -x)), &[]), "{}", effect.name());
        }
    }
}

/// Returns the output of an effect after a change of one of its parameters or of one of its input quantities.
fn moved(effect: &dyn Effect, s: &[f64], seen: &[f64; 12], index: usize, by: f64) -> Vec<f64> {
    let (mut s, mut seen) = (s.to_vec(), *seen);
    if index < s.len() {
        s[index] += by;
    } else {
        seen[index - s.len()] += by;
    }
    answer(effect, effect.bind(&s).as_ref(), &seen)
}

#[test]
fn tangents_agree_with_differences() {
    let mut even = Even(0.5);
    for effect in effects() {
        for _ in 0..30 {
            let (s, seen) = (parameters(effect.as_ref(), &mut even), place(&mut even));
            for index in 0..s.len() + seen.len() - 1 {
                let lifted = |i: usize, x: f64| if i == index { Dual7::variable(x, 0) } else { Dual7::from(x) };
                let with: Vec<Dual7> = s.iter().enumerate().map(|(i, &x)| lifted(i, x)).collect();
                let sees: [Dual7; 12] = std::array::from_fn(|i| lifted(s.len() + i, seen[i]));
                let exact = answer(effect.as_ref(), effect.bind_dual(&with).as_ref(), &sees);
                let plain = answer(effect.as_ref(), effect.bind(&s).as_ref(), &seen);
                let [up, down] = [1e-6, -1e-6].map(|by| moved(effect.as_ref(), &s, &seen, index, by));
                for (k, exact) in exact.iter().enumerate() {
                    assert_eq!(exact.value, plain[k], "{}: tangents change no value", effect.name());
                    let difference = (up[k] - down[k]) / 2e-6;
                    let agree = (exact.tangent[0] - difference).abs() < 1e-5 * (1.0 + difference.abs());
                    // The tangent of a quantised value with respect to the value is set to 1, which differences cannot
                    // confirm.
                    let stairs = effect.name().ends_with("quantisation") && index == s.len();
                    assert!(agree || stairs, "{} {index} {} {difference} {s:?}", effect.name(), exact.tangent[0]);
                }
            }
        }
    }
}

/// An experiment that began elsewhere differs from the first instant on, in what the effect passes on or in its rates.
#[test]
fn free_initial_values_are_those_of_all_states_and_each_matters_at_once() {
    let mut even = Even(0.3);
    for effect in effects().iter().filter(|effect| !effect.free_starts().is_empty()) {
        // Of a hysteresis state the output is free, which a model begins with.
        let (first, all) = if effect.hysteresis_states() > 0 { (9, 1) } else { (7, effect.states()) };
        assert_eq!(effect.free_starts().len(), all, "{}", effect.name());
        for k in first..first + all {
            let (parameters, mut seen) = (parameters(effect.as_ref(), &mut even), place(&mut even));
            // Away from both flanks of a play.
            seen[10] = 0.0;
            let acting = effect.bind(&parameters);
            let [low, high] = [-0.5, 0.5].map(|start| {
                let mut seen = seen;
                seen[k] = start;
                answer(effect.as_ref(), acting.as_ref(), &seen)
            });
            assert!(low != high, "{}: {}", effect.name(), SEEN[k]);
        }
    }
}

#[test]
fn the_catalogue_has_the_effects_that_engineers_name() {
    let named = "coulomb-friction stribeck-friction stiction viscous-friction quadratic-drag cubic-stiffness \
                 linear-stiffness sensor-dead-zone sensor-bias sensor-gain sensor-delay sensor-lag sensor-drift input-delay \
                 input-saturation input-dead-zone input-gain input-bias actuator-lag backlash cogging constant-force \
                 flexible-mode overflow leak periodic-disturbance radiation-loss mass-loss bouc-wen wind-gust";
    let all = effects();
    for name in named.split_whitespace() {
        assert!(all.iter().any(|e| e.name() == name), "{name}");
    }
}

#[test]
fn play_keeps_its_output_until_the_gap_is_crossed() {
    let play = effects().into_iter().find(|e| e.name() == "backlash").expect("it is there").bind(&[0.4]);
    let mut memory = [f64::NAN; 2];
    let follow = |value: f64, memory: &mut [f64; 2]| {
        let at = at(&[value, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        play.update_hysteresis(&at, memory);
        play.hysteresis_value(&at, memory)
    };
    let output = [0.0, 0.1, 0.3, 1.0, 0.7, 0.5, -1.0].map(|u| follow(u, &mut memory));
    for (found, expected) in output.into_iter().zip([0.0, 0.0, 0.1, 0.8, 0.8, 0.7, -0.8]) {
        assert!((found - expected).abs() < 1e-15, "{output:?}");
    }
}

#[test]
fn a_gust_has_the_impulse_of_its_integral() {
    let gust = effects().into_iter().find(|e| e.name() == "wind-gust").expect("it is there").bind(&[3.0, 0.7, 0.45]);
    let h = 1e-4;
    let push: f64 =
        (0..20_000).map(|k| gust.value(&PortState { t: f64::from(k) * h, ..at(&[0.0; 12]) }, &[]) * h).sum();
    assert!((push - 3.0 * 0.45 / 2.0).abs() < 1e-9, "{push}");
}

#[test]
fn what_passes_an_actuator_or_a_sensor_is_what_the_formula_says() {
    let cases: [(&str, &[f64], f64, f64); 23] = [
        ("input-bias", &[0.3], 1.0, 1.3),
        ("input-gain", &[-0.2], 2.0, 1.6),
        ("input-saturation", &[1.5], -2.0, -1.5),
        ("input-saturation", &[1.5], 1.2, 1.2),
        ("input-dead-zone", &[0.5], -2.0, -1.5),
        ("input-dead-zone", &[0.5], 0.4, 0.0),
        ("input-asymmetry", &[0.25], 2.0, 2.5),
        ("input-asymmetry", &[0.25], -2.0, -1.5),
        ("quadratic-input", &[0.1], -2.0, -2.4),
        ("input-quantisation", &[0.25], 0.9, 1.0),
        ("sensor-bias", &[0.3], 1.0, 1.3),
        ("sensor-gain", &[-0.2], 2.0, 1.6),
        ("sensor-saturation", &[1.5, 0.0], 2.0, 1.5),
        ("sensor-saturation", &[1.5, 0.0], -2.0, -1.5),
        ("sensor-saturation", &[1.5, 1.0], 2.0, 1.5),
        ("sensor-saturation", &[1.5, 1.0], -2.0, -2.0),
        ("sensor-saturation", &[-1.5, -1.0], -2.0, -1.5),
        ("sensor-saturation", &[-1.5, -1.0], 2.0, 2.0),
        ("sensor-quantisation", &[0.25], -0.9, -1.0),
        ("sensor-dead-zone", &[0.5, 1.0], 2.0, 1.5),
        ("sensor-dead-zone", &[0.5, 1.0], 1.3, 1.0),
        ("sensor-gap", &[0.5, 1.0], 1.3, 1.0),
        ("sensor-gap", &[0.5, 1.0], 1.6, 1.6),
    ];
    for (name, parameters, value, expected) in cases {
        let effect = effects().into_iter().find(|e| e.name() == name).expect("it is in the catalogue");
        let mut seen = [0.0; 12];
        seen[0] = value;
        let found = effect.bind(parameters).value(&at(&seen), &[]);
        assert!((found - expected).abs() < 1e-15, "{name} {value}: {found}");
    }
}

/// Returns the force of an effect along a motion, with the rates of its states and of its dry friction while it slides.
fn along(effect: &dyn Effect, parameters: &[f64], motion: &[[f64; 3]], step: f64) -> Vec<f64> {
    let acting = effect.bind(parameters);
    let mut z = vec![0.0; effect.states()];
    let of = |&[q, v, a]: &[f64; 3]| PortState {
        t: 0.0,
        value: q,
        q,
        v,
        a,
        mobility: 1.0,
        other: 0.0,
        other_speed: 0.0,
        u: &[],
        closed: None,
    };
    acting.start(&of(&motion[0]), &mut z);
    let mut rates = z.clone();
    let force = |pair: &[[f64; 3]]| {
        let at = of(&pair[0]);
        let sliding = acting.friction(&at, &z).map_or(0.0, |f| if at.v > 0.0 { -f.sliding[0] } else { f.sliding[1] });
        let force = acting.value(&at, &z) - acting.inertia(&at) * at.a + sliding;
        // The states follow the middle of the step.
        let middle: [f64; 3] = std::array::from_fn(|k| 0.5 * (pair[0][k] + pair[1][k]));
        for _ in 0..20 {
            acting.rates(&of(&middle), &z, &mut rates);
            z.iter_mut().zip(&rates).for_each(|(z, rate)| *z += step / 20.0 * rate);
        }
        force
    };
    motion.windows(2).map(force).collect()
}

/// Returns the root mean square of what a multiple of one signal and a constant leave of another, relative to its
/// deviation.
fn left(signal: &[f64], of: &[f64]) -> f64 {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let centred = |x: &[f64]| x.iter().map(|v| v - mean(x)).collect::<Vec<f64>>();
    let (a, b) = (centred(signal), centred(of));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    (1.0 - math::powi(dot(&a, &b), 2) / (dot(&a, &a) * dot(&b, &b))).max(0.0).sqrt()
}

#[test]
fn an_effect_at_an_end_of_a_shape_is_the_simpler_effect_that_it_names() {
    // A swing of two frequencies about 0.3, between -1.2 and 1.8.
    let step = 1e-3;
    let motion: Vec<[f64; 3]> = (0..12_000)
        .map(|k| {
            let t = step * f64::from(k);
            let (w, u) = (2.0, 3.1);
            [
                0.3 + math::sin(w * t) + 0.5 * math::cos(u * t),
                w * math::cos(w * t) - 0.5 * u * math::sin(u * t),
                -w * w * math::sin(w * t) - 0.5 * u * u * math::cos(u * t),
            ]
        })
        .collect();
    let catalogue = effects();
    let mut compared = 0;
    for effect in &catalogue {
        for (k, shape) in effect.parameters().iter().enumerate() {
            for (end, names) in shape.simpler.iter().enumerate() {
                for name in *names {
                    let simpler = catalogue.iter().find(|other| other.name() == *name).expect("it is in the catalogue");
                    assert!(simpler.parameters().len() < effect.parameters().len(), "{name} in {}", effect.name());
                    assert!(simpler.ports().iter().any(|port| effect.ports().contains(port)), "{name}");
                    if effect.second_port().is_some() || !at_joints(effect.as_ref()) && effect.states() == 0 {
                        continue;
                    }
                    // Far enough for the limit, within what steps of a millisecond follow.
                    let extreme = match (end, shape.bounds) {
                        (0, [0.0, _]) if shape.name == "y" || shape.name == "w" || shape.name == "vs" => 0.02,
                        (0, [low, _]) if low.is_finite() && shape.name != "y" => low,
                        (0, _) if shape.name == "y" => 0.01,
                        (1, [_, high]) if high.is_finite() => high,
                        (0, _) => -1e3,
                        (_, _) if shape.name == "w" => 60.0,
                        _ => 1e3,
                    };
                    let value = |of: &EffectParameter| match of.name {
                        "y" => 0.4,
                        "vs" | "rise" | "h" | "a" => 0.7,
                        "sigma" | "n" | "d" => 1.0,
                        "tau" if effect.name() == "second-order-lag" => 0.02,
                        "tau" => 0.0,
                        _ if of.null_value == Some(0.0) => 1.0,
                        _ => 0.0,
                    };
                    let mut own: Vec<f64> = effect.parameters().iter().map(value).collect();
                    own[k] = extreme;
                    let mut theirs: Vec<f64> = simpler.parameters().iter().map(value).collect();
                    if (effect.name(), shape.name, end) == ("lugre-friction", "vs", 1) {
                        // The bristles bend as much farther as the force is larger.
                        theirs[1] *= 1.7;
                    }
                    if effect.name() == "second-order-lag" {
                        theirs[0] = 2.0 * extreme * own[0];
                    }
                    // After a transient, away from where the motion turns.
                    let of = |effect: &dyn Effect, parameters: &[f64]| {
                        let forces = along(effect, parameters, &motion, step);
                        let moves = forces.into_iter().zip(&motion).skip(6_000).filter(|(_, [_, v, _])| v.abs() > 0.7);
                        moves.map(|(force, _)| force).collect::<Vec<f64>>()
                    };
                    let (own, theirs) = (of(effect.as_ref(), &own), of(simpler.as_ref(), &theirs));
                    let left = if theirs.iter().all(|force| *force == theirs[0]) {
                        // Of a constant force only the mean is left.
                        let mean = own.iter().sum::<f64>() / own.len() as f64;
                        own.iter().map(|force| (force / mean - 1.0).abs()).fold(0.0, f64::max)
                    } else {
                        left(&theirs, &own)
                    };
                    assert!(left < 0.1, "{} with {} = {extreme} is {name} but for {left}", effect.name(), shape.name);
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 12, "{compared}");
}
