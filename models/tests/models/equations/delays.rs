//! Delays, compared with the polynomials of the method of steps and with closed forms of delayed inputs.

use mops_math as math;

use super::*;

fn tight(text: &str) -> Equations {
    read(&format!("{text}\n[tolerance]\nrelative = 1e-11\nabsolute = 1e-12\n")).unwrap_or_else(|e| panic!("{e}"))
}

/// Returns the derivatives of the last values of the states with respect to a parameter.
fn tangents_at_end(model: &Equations, inputs: &[(&str, Input)], given: &[(&str, f64)], of: &str, end: f64) -> Vec<f64> {
    let parameters = values(model, given);
    let index = model.interface().parameters.iter().position(|p| p.variable.name == of).unwrap();
    let seed = (0..parameters.len()).map(|i| f64::from(u8::from(i == index))).collect();
    let inputs = inputs.iter().map(|(name, input)| ((*name).to_owned(), input.clone())).collect();
    let case = Case { inputs, ..Case::default() };
    let signals: Vec<usize> = (0..model.interface().states.len()).collect();
    let job = Job { case: &case, parameters: &parameters, signals: &signals, horizon: end };
    let (_, tangents) = model.tangents(&job, &[seed]).unwrap().unwrap();
    model.interface().states.iter().map(|state| tangents[0].trace(&state.name).last()).collect()
}

/// Returns `y` of `y' = -a y(t - T)`, `y = 1` up to time 0: `1 + sum over k >= 1 of (-a)^k (t - (k - 1) T)^k / k!`.
fn feedback(a: f64, delay: f64, t: f64) -> f64 {
    let mut factor = 1.0;
    let mut sum = 1.0;
    for k in 1..40 {
        let since = t - f64::from(k - 1) * delay;
        if since <= 0.0 {
            break;
        }
        factor *= -a / f64::from(k);
        sum += factor * math::powi(since, k);
    }
    sum
}

#[test]
fn a_delayed_feedback_is_its_polynomials_for_any_delay() {
    let text =
        "states = { y = '1' }\nparameters = { a = '1/s', T = 's' }\nder = { y = '-a*delay(y, T)' }\nstart = { y = 1 }";
    let model = tight(text);
    for (a, delay) in [(1.0, 1.0), (0.7, 1.3), (2.0, 0.37), (1.0, 5.0), (1.5, 0.05)] {
        let given = [("a", a), ("T", delay)];
        let response = respond(&model, &[], &given, 4.0);
        for t in [0.3, 1.0, 2.2, 3.7, 4.0] {
            let (found, exact) = (at(&response, "y", t), feedback(a, delay, t));
            assert!((found - exact).abs() < 1e-9, "{a} {delay} {t}: {found} {exact}");
        }
        let h = 1e-6;
        for (name, up, down) in [
            ("a", feedback(a + h, delay, 4.0), feedback(a - h, delay, 4.0)),
            ("T", feedback(a, delay + h, 4.0), feedback(a, delay - h, 4.0)),
        ] {
            let difference = (up - down) / (2.0 * h);
            let tangent = tangents_at_end(&model, &[], &given, name, 4.0)[0];
            assert!(
                (tangent - difference).abs() < 1e-7 * difference.abs().max(1.0),
                "{name} {a} {delay}: {tangent} {difference}"
            );
        }
    }
}

#[test]
fn a_delayed_step_moves_the_response_and_its_tangent() {
    // x' = -x + u(t - T), u a step of 2 at 0.3 s: x = 2 (1 - exp(-(t - 0.3 - T))).
    let text = "states = { x = '1' }\ninputs = { u = '1' }\nparameters = { T = 's' }\nder = { x = '(-x + delay(u, T))/1 [s]' }";
    let model = tight(text);
    for (step, delay) in [(0.3, 0.5), (0.0, 0.5), (0.3, 0.1), (0.1, 0.2), (0.1, 0.1), (0.2, 0.1)] {
        let input = [("u", Input::Step { time: step, before: 0.0, after: 2.0 })];
        let response = respond(&model, &input, &[("T", delay)], 2.0);
        let begin = step + delay;
        assert!(at(&response, "x", begin - 1e-3).abs() < 1e-14, "{step} {delay}");
        for t in [begin, begin + 0.2, 2.0] {
            let exact = -2.0 * math::exp_m1(begin - t);
            assert!((at(&response, "x", t) - exact).abs() < 1e-10, "{step} {delay} {t}");
        }
        let exact = -2.0 * math::exp(begin - 2.0);
        let found = tangents_at_end(&model, &input, &[("T", delay)], "T", 2.0)[0];
        assert!((found - exact).abs() < 1e-9, "{step} {delay}: {found} {exact}");
    }
}

#[test]
fn jumps_are_carried_on_through_an_echo() {
    // y = u + y(t - 1)/2, an algebraic recursion: 1, 3/2, 7/4, .. after a step; x is its integral.
    let text = "states = { x = '1' }\ninputs = { u = '1' }\nlet = { y = \"u + 0.5*delay(y, '1 s')\" }\nder = { x = 'y/1 [s]' }\noutputs = { echo = 'y' }";
    let input = [("u", Input::Step { time: 0.25, before: 0.0, after: 1.0 })];
    let response = respond(&tight(text), &input, &[], 4.0);
    for (t, expected) in [(0.2, 0.0), (0.3, 1.0), (1.2, 1.0), (1.3, 1.5), (2.3, 1.75), (3.3, 1.875)] {
        assert!((at(&response, "echo", t) - expected).abs() < 1e-12, "{t}: {}", at(&response, "echo", t));
    }
    let exact = 1.0 + 1.5 + 1.75 + 0.75 * 1.875;
    assert!((at(&response, "x", 4.0) - exact).abs() < 1e-11);
}

#[test]
fn the_tangent_of_an_echo_knows_that_its_jumps_move() {
    // x' = y = u + y(t - T)/2: x = sum over k of (t - s - k T)/2^k for a step at s.
    let text = "states = { x = '1' }\ninputs = { u = '1' }\nparameters = { T = 's' }\nlet = { y = 'u + 0.5*delay(y, T)' }\nder = { x = 'y/1 [s]' }";
    let input = [("u", Input::Step { time: 0.25, before: 0.0, after: 1.0 })];
    let tangent = tangents_at_end(&tight(text), &input, &[("T", 0.8)], "T", 3.0)[0];
    let exact = -(0.5 + 2.0 * 0.25 + 3.0 * 0.125);
    assert!((tangent - exact).abs() < 1e-10, "{tangent} {exact}");
}

#[test]
fn a_sampled_controller_beside_a_delay_agrees_with_the_exact_solution() {
    // x' = u(t - T), u = -k x sampled every period; with T a multiple of the period, x_(n+1) = x_n - period k x_(n-m).
    let text =
        "states = { x = '1' }\nparameters = { k = '1/s' }\nder = { x = 'delay(u, \"300 ms\")' }\nstart = { x = 1 }
        clocks.c = { every = '100 ms', memory = { u = '1/s' }, next = { u = '-k*x' } }";
    let response = respond(&tight(text), &[], &[("k", 2.0)], 2.0);
    let mut x = vec![1.0];
    for n in 0..20 {
        let past = if n >= 3 { x[n - 3] } else { 0.0 };
        x.push(x[n] - 0.1 * 2.0 * past);
    }
    for (n, exact) in x.iter().enumerate() {
        #[allow(clippy::cast_precision_loss)]
        let found = at(&response, "x", 0.1 * n as f64);
        assert!((found - exact).abs() < 1e-10, "{n}: {found} {exact}");
    }
}

#[test]
fn a_delay_in_a_condition_switches_exactly() {
    // y = sin(time) delayed by 1 s, 0 before: x' = 1 while it is above 1/2.
    let text = "states = { x = '1' }\nder = { x = 'if(delay(sin(time*1 [1/s]), 1 [s]) > 0.5, 1, 0)*1 [1/s]' }";
    let response = respond(&tight(text), &[], &[], 8.0);
    let sixth = std::f64::consts::PI / 6.0;
    let exact = 4.0 * sixth + (7.0 - (std::f64::consts::TAU + sixth)).max(0.0);
    assert!((at(&response, "x", 8.0) - exact).abs() < 1e-8, "{} {exact}", at(&response, "x", 8.0));
}

#[test]
fn wrong_delays_are_an_error_with_a_remedy() {
    let model = |of: &str| format!("states = {{ x = 'm' }}\nparameters = {{ T = 's' }}\nder = {{ x = '{of}' }}");
    for (of, fact) in [
        ("-delay(x, 2 [m])/1 [s]", "must be a time"),
        ("-delay(x, time)/1 [s]", "must not change"),
        ("-delay(x, 0 [s])/1 [s]", "positive time"),
        ("-delay(x)/1 [s]", "takes a quantity and a time, not 1"),
        ("-delay(x, \"50\")/1 [s]", "a unit"),
        ("-delay(x, \"50 ms)/1 [s]", "closing quotation mark"),
    ] {
        let mistake = read(&model(of)).err().unwrap_or_else(|| panic!("it was read: {of}"));
        assert!(mistake.to_string().contains(fact), "{of}: {mistake}");
    }
    let failure = attempt(&read(&model("-delay(x, T)/1 [s]")).unwrap(), &[], &[("T", 0.0)], 1.0).unwrap_err();
    assert!(failure.to_string().contains("expected a positive time"), "{failure}");
}

#[test]
fn the_past_is_that_of_the_start_through_kinks_and_delays_of_delays() {
    for (of, past) in [
        ("delay(abs(x), \"1 s\")", 2.0),
        ("delay(clip(x, -3, 1), \"1 s\")", 1.0),
        ("delay(if(x > 0, 5, 7), \"1 s\")", 5.0),
        ("delay(delay(x, \"1 s\"), \"2 s\")", 2.0),
        ("delay(y, \"1 s\")", 4.0),
    ] {
        let text = format!(
            "states = {{ x = '1' }}\nlet = {{ y = \"x + 0.5*delay(y, '1 s')\" }}\nder = {{ x = '{of}/1 [s]' }}\nstart = {{ x = 2 }}"
        );
        let found = at(&respond(&tight(&text), &[], &[], 0.5), "x", 0.5);
        assert!((found - (2.0 + 0.5 * past)).abs() < 1e-12, "{of}: {found}");
    }
}

#[test]
fn a_jump_that_moves_leaves_the_tangents_of_others_at_its_time_alone() {
    // x' = a u + delay(u, T), u a staircase whose samples are a divisor of T apart: only the delayed part moves.
    let text =
        "states = { x = '1' }\ninputs = { u = '1' }\nparameters = { T = 's' }\nder = { x = '(u + delay(u, T))/1 [s]' }";
    let times: Vec<f64> = (0..40).map(|k| 0.05 * f64::from(k)).collect();
    let values: Vec<f64> = (0..40).map(|k| f64::from(k * 7919 % 13) - 6.0).collect();
    let input = [("u", Input::Sampled { times, values: values.clone(), hold: mops_core::case::Hold::Zero })];
    // x depends on T through the integral of u from -T, where it is its first sample, to 1.02 s - T = 0.82 s.
    let tangent = tangents_at_end(&tight(text), &input, &[("T", 0.2)], "T", 1.02)[0];
    let exact = values[0] - values[16];
    assert!((tangent - exact).abs() < 1e-9, "{tangent} {exact}");
    // Two delays of the same length: each moves its own jump.
    let text = "states = { x = '1' }\ninputs = { u = '1' }\nparameters = { T1 = 's', T2 = 's' }\nder = { x = '(delay(u, T1) + 2*delay(u, T2))/1 [s]' }";
    let input = [("u", Input::Step { time: 0.1, before: 0.0, after: 1.0 })];
    for (of, exact) in [("T1", -1.0), ("T2", -2.0)] {
        let tangent = tangents_at_end(&tight(text), &input, &[("T1", 0.5), ("T2", 0.5)], of, 1.0)[0];
        assert!((tangent - exact).abs() < 1e-9, "{of}: {tangent}");
    }
}

#[test]
fn a_fast_clock_beside_a_delay_takes_few_steps() {
    let text = "states = { x = '1' }\nder = { x = '(u - delay(x, \"3.3 ms\"))/1 [s]' }\nstart = { x = 1 }
        clocks.c = { every = '1 ms', delay = '0.3 ms', memory = { u = '1' }, next = { u = 'if(x > 0.5, -x, 0)' } }";
    let response = respond(&read(text).unwrap_or_else(|e| panic!("{e}")), &[], &[], 3.0);
    assert!(response.work.steps < 30_000, "{:?}", response.work);
    assert!(response.events.is_empty(), "{:?}", response.events.len());
}

#[test]
fn an_output_may_be_a_delayed_quantity_alone() {
    let text = "states = { x = '1' }\nder = { x = '1/1 [s]' }\noutputs = { y = \"delay(x, '0.1 s')\", z = \"1*delay(x, '0.1 s')\" }";
    let model = model(text);
    let index = |name: &str| model.interface().signals.iter().position(|s| s.name == name).unwrap();
    let job = Job { case: &Case::default(), parameters: &[0.0], signals: &[index("y"), index("z")], horizon: 1.0 };
    let analysis = model.analyse(&job).unwrap();
    for name in ["y", "z"] {
        assert!((analysis.trace(name).last() - 0.9).abs() < 1e-9);
    }
}
