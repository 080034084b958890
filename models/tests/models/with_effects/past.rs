//! Effects of plants with clocks, delays and memory, compared with the same physics in the equations.

use super::*;

/// Mass that a sampled controller with a computing delay moves to `r`.
const SERVO: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { r = "m" }
parameters = { m = "kg", c = { unit = "N", default = 0 } }
constants  = { T = "50 ms", kp = "30 N/m", ki = "20 N/(m s)", kd = "8 N s/m" }
der        = { x = "v", v = "m*v' = f" }
let        = { next = "s + T*(r - x)" }
clocks.c   = { every = "T", delay = "20 ms", memory = { f = "N", s = "m s" }, next = { s = "next", f = "kp*(r - x) + ki*next - kd*v" } }
tolerance  = { relative = 1e-10 }
"#;

/// Mass on a spring whose force arrives late, and a late command.
const LATE: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", c = { unit = "N", default = 0 } }
der        = { x = "v", v = "m*v' = 2*delay(u, 0.2 [s]) - 5 [N/m]*delay(x, 0.1 [s]) - 2 [N s/m]*v" }
tolerance  = { relative = 1e-10 }
"#;

fn step(name: &str) -> Case {
    let input = Input::Step { time: 0.3, before: 0.0, after: 1.0 };
    Case { inputs: vec![(name.to_owned(), input)], ..Case::default() }
}

/// Returns `x` and `v`, and their derivatives with respect to a parameter, at some times.
fn motion(model: &dyn Model, case: &Case, parameters: &[f64], by: usize) -> Vec<[f64; 2]> {
    let job = Job { case, parameters, signals: &[0, 1], horizon: 4.0 };
    let seed = (0..parameters.len()).map(|i| f64::from(u8::from(i == by))).collect();
    let (analysis, tangents) = model.tangents(&job, &[seed]).expect("it has them").expect("it simulates");
    let times = [0.31, 0.5, 0.77, 1.0, 1.6, 2.5, 4.0];
    let of = |name: &str| {
        let [value, slope] = [&analysis, &tangents[0]].map(|a| a.trace(name).sample(&times));
        value.into_iter().zip(slope).map(|(a, b)| [a, b]).collect::<Vec<_>>()
    };
    [of("x"), of("v")].concat()
}

#[test]
fn friction_as_an_effect_is_friction_in_the_equations_beside_clocks_and_delays() {
    for (text, input, m, c) in [(SERVO, "r", 2.0, 3.0), (LATE, "u", 1.5, 0.4)] {
        let plain = equations(text);
        let own = equations(&format!("{text}\n[friction]\nx = {{ coulomb = 'c' }}\n"));
        let added = with(&plain, &[("coulomb-friction", "joint:x")]);
        let starts = plain.interface().parameters.len() - 2;
        let rest = vec![0.0; starts];
        let inside = [&[m, c][..], &rest].concat();
        let outside = [&[m, 0.0][..], &rest, &[c]].concat();
        let case = step(input);
        let expected = motion(own.as_ref(), &case, &inside, 1);
        let found = motion(&added, &case, &outside, outside.len() - 1);
        assert!(expected[3][0].abs() > 0.01, "{input}: it moves");
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found[0] - expected[0]).abs() < 1e-7, "{input}: {found:?} {expected:?}");
            assert!((found[1] - expected[1]).abs() < 1e-5, "{input}: {found:?} {expected:?}");
        }
    }
}

#[test]
fn a_dead_time_before_a_delay_adds_to_it() {
    let longer = equations(&LATE.replace("0.2 [s]", "0.35 [s]"));
    let added = with(&equations(LATE), &[("input-delay", "actuator:u")]);
    let case = step("u");
    let expected = motion(longer.as_ref(), &case, &[1.5, 0.0, 0.0, 0.0], 0);
    let found = motion(&added, &case, &[1.5, 0.0, 0.0, 0.0, 0.15], 0);
    for (found, expected) in found.iter().zip(&expected) {
        assert!(
            (found[0] - expected[0]).abs() < 1e-8 && (found[1] - expected[1]).abs() < 1e-6,
            "{found:?} {expected:?}"
        );
    }
}

#[test]
fn a_window_continues_with_the_phase_of_its_clock() {
    let model = with(&equations(SERVO), &[("viscous-friction", "joint:x")]);
    let parameters = [2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.5];
    let signals = [0, 1, 2, 3];
    let names = ["x", "v", "f", "s"];
    let case = step("r");
    let whole = model.analyse(&Job { case: &case, parameters: &parameters, signals: &signals, horizon: 3.0 });
    let whole = whole.expect("it simulates");
    // At an instant of the clock, after its values have arrived, and between both, where what it has computed is not
    // known.
    for (begin, allowed) in [(0.65, 1e-8), (0.68, 1e-8), (0.66, 0.02)] {
        let at = names.map(|name| whole.trace(name).sample(&[begin - 1e-12])[0]);
        let inputs = case.inputs.iter().map(|(name, input)| (name.clone(), input.since(begin))).collect();
        let window = Case { inputs, begins: begin, ..Case::default() };
        let parameters = [2.0, 0.0, at[0], at[1], at[2], at[3], 1.5];
        let job = Job { case: &window, parameters: &parameters, signals: &signals, horizon: 3.0 - begin };
        let found = model.analyse(&job).expect("it simulates");
        for t in [0.7, 0.9, 1.7, 3.0] {
            let [a, b] = [whole.trace("x").sample(&[t])[0], found.trace("x").sample(&[t - begin])[0]];
            assert!((a - b).abs() < allowed, "{begin} {t}: {a} {b}");
        }
    }
}
