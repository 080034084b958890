//! Dry friction that is 0, always or for a while, has no effect.

use mops_math as math;

use super::*;

fn joint(rate: &str, friction: &str) -> Equations {
    let text = format!(
        "states = {{ q = 'm', w = 'm/s' }}\nparameters = {{ c = 'm/s2' }}\nder = {{ q = 'w', w = '{rate}' }}\n\
         start = {{ q = 'q0', w = 'w0' }}\nfriction.q = {{ {friction} }}"
    )
    .replace("parameters = {", "parameters = { q0 = 'm', w0 = 'm/s',");
    read(&text).unwrap_or_else(|mistake| panic!("{mistake}\n{text}"))
}

fn end(model: &Equations, given: &[(&str, f64)], end: f64) -> [f64; 2] {
    let response = respond(model, &[], given, end);
    [at(&response, "q", end), at(&response, "w", end)]
}

fn close(found: [f64; 2], expected: [f64; 2]) {
    assert!(
        (0..2).all(|i| (found[i] - expected[i]).abs() < 1e-6 * expected[i].abs().max(1.0)),
        "{found:?} {expected:?}"
    );
}

#[test]
fn a_throw_without_friction_reverses() {
    let zeros = ["coulomb = 'c'", "coulomb = '0'", "coulomb = 'c*abs(q)/1 [m]'", "coulomb = 'c', peak = '1.5'"];
    for friction in zeros {
        for w0 in [1.0, 0.0, -1.0] {
            let model = joint("-1", friction);
            close(end(&model, &[("c", 0.0), ("q0", 0.0), ("w0", w0)], 4.0), [4.0 * w0 - 8.0, w0 - 4.0]);
        }
    }
}

#[test]
fn an_oscillator_without_friction_keeps_its_amplitude() {
    let model = joint("-1 [1/s2]*q", "coulomb = 'c'");
    close(end(&model, &[("c", 0.0), ("q0", 1.0), ("w0", 0.0)], 20.0), [math::cos(20.0), -math::sin(20.0)]);
    let damped = joint("-1 [1/s2]*q", "coulomb = 'c', viscous = '0.2'");
    let exact = |t: f64| {
        let nu = 0.99_f64.sqrt();
        let envelope = math::exp(-0.1 * t);
        [envelope * (math::cos(nu * t) + 0.1 / nu * math::sin(nu * t)), -envelope * math::sin(nu * t) / nu]
    };
    close(end(&damped, &[("c", 0.0), ("q0", 1.0), ("w0", 0.0)], 15.0), exact(15.0));
}

#[test]
fn a_brake_that_is_off_at_first_then_stops_the_motion() {
    // The block moves backward at -1 m/s. From 1.5 s on the brake decelerates it by 0.5 m/s2: at rest after 2 s and 1
    // m.
    for coulomb in ["if(time > 1.5, 0.5, 0)", "clip(1e6 [m/s3]*(time - 1.5), 0, 0.5)"] {
        let model = joint("0", &format!("coulomb = '{coulomb}'"));
        let [q, w] = end(&model, &[("c", 0.0), ("q0", 0.0), ("w0", -1.0)], 10.0);
        assert!((q + 2.5).abs() < 1e-5 && w == 0.0, "{coulomb}: {q} {w}");
    }
}

#[test]
fn a_joint_without_friction_moves_while_another_sticks() {
    let text = "states = { a = 'm', va = 'm/s', b = 'm', vb = 'm/s' }\nparameters = { ca = 'm/s2', cb = 'm/s2' }\n\
                der = { a = 'va', va = '-1 [1/s2]*a', b = 'vb', vb = '0.1 [1/s2]*a' }\n\
                friction = { a = { coulomb = 'ca' }, b = { coulomb = 'cb' } }";
    let response = respond(&read(text).unwrap(), &[], &[("ca", 0.0), ("cb", 0.3), ("a0", 1.0)], 20.0);
    assert!((at(&response, "a", 20.0) - math::cos(20.0)).abs() < 1e-6);
    assert_eq!(at(&response, "b", 20.0), 0.0);
}

#[test]
fn no_friction_is_the_limit_of_little() {
    let model = joint("-1 [1/s2]*q", "coulomb = 'c'");
    let [none, little] = [0.0, 1e-12].map(|c| end(&model, &[("c", c), ("q0", 1.0), ("w0", 0.0)], 20.0));
    close(none, little);
}

#[test]
fn a_joint_whose_friction_is_zero_throughout_has_no_events() {
    let without = joint("-1 [1/s2]*q", "viscous = '1.4'");
    let with = joint("-1 [1/s2]*q", "coulomb = 'c', viscous = '1.4'");
    let work = |model: &Equations| {
        let response = respond(model, &[], &[("c", 0.0), ("q0", 1.0), ("w0", 0.0)], 60.0);
        (response.events.len(), response.work.steps, response.work.derivatives)
    };
    assert_eq!(work(&with), work(&without));
}
