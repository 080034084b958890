//! Events, compared with closed forms: each crossing once, at any position within a step, and accumulating events.

use std::f64::consts::{PI, TAU};

use mops_core::case::Hold;
use mops_math as math;
use proptest::prelude::*;

use super::*;

/// Returns the times of the events with this name.
fn times(response: &Response, name: &str) -> Vec<f64> {
    response.events.iter().filter(|event| event.what == name).map(|event| event.time).collect()
}

fn near(found: &[f64], expected: &[f64]) -> bool {
    let close = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-8 * b.abs().max(1e-3);
    found.len() == expected.len() && found.iter().zip(expected).all(close)
}

proptest! {
    #![proptest_config(mops_tiers::property(10_000))]

    #[test]
    fn a_ramp_passes_a_threshold_once(
        speed in 0.01..50.0_f64, threshold in 0.001..20.0_f64, falls in any::<bool>(), method in prop::sample::select(&["explicit", "stiff"]),
    ) {
        let (start, sign) = if falls { (30.0, -1.0) } else { (0.0, 1.0) };
        let guard = if falls { "x - (30 - c)" } else { "c - x" };
        let text = format!(
            "states = {{ x = 'm', n = '1' }}\nparameters = {{ v = 'm/s', c = 'm' }}\nder = {{ x = 'v', n = '0' }}\n\
             start = {{ x = {start} }}\nwhen.pass = {{ guard = '{guard}', reset = {{ n = 'n + 1' }} }}\n\
             tolerance = {{ method = '{method}' }}"
        );
        let response = respond(&read(&text).unwrap(), &[], &[("v", sign * speed), ("c", threshold)], 10.0);
        let expected: Vec<f64> = [threshold / speed].into_iter().filter(|t| *t < 10.0).collect();
        prop_assume!((threshold / speed - 10.0).abs() > 1e-9);
        let found = times(&response, "pass");
        prop_assert!(near(&found, &expected), "{found:?} {expected:?}");
        prop_assert_eq!(at(&response, "n", 10.0), expected.len() as f64);
    }

    #[test]
    fn a_time_passes_once(t in 0.0..10.0_f64, rate in 0.0..3.0_f64) {
        let text = "states = { v = 'm/s' }\nparameters = { c = 's', d = '1/s' }\nder = { v = '-d*v' }\n\
                    when.kick = { guard = 'c - time', reset = { v = 'v + 1' } }";
        let response = respond(&read(text).unwrap(), &[], &[("c", t), ("d", rate)], 10.0);
        let found = times(&response, "kick");
        prop_assert!(near(&found, &[t]), "{found:?} {t}");
        let end = math::exp(-rate * (10.0 - t));
        prop_assert!((at(&response, "v", 10.0) - end).abs() < 1e-6);
    }

    #[test]
    fn an_oscillator_passes_a_threshold_once_a_period(
        angular in 0.5..20.0_f64, level in -0.99..0.99_f64, phase in 0.0..6.0_f64,
    ) {
        let text = "states = { x = '1', v = '1/s', n = '1' }\nparameters = { w = '1/s', c = '1' }\n\
                    der = { x = 'v', v = '-w^2*x', n = '0' }\nwhen.pass = { guard = 'x - c', reset = { n = 'n + 1' } }";
        // x = cos(w t + phase) falls through the level at w t + phase = acos(level) + 2 pi k.
        let response = respond(
            &read(text).unwrap(), &[],
            &[("w", angular), ("c", level), ("x0", math::cos(phase)), ("v0", -angular * math::sin(phase))], 10.0,
        );
        let crossing = |k: i32| (math::acos(level) + TAU * f64::from(k) - phase) / angular;
        let expected: Vec<f64> = (-3..200).map(crossing).filter(|t| *t > 0.0 && *t < 10.0).collect();
        prop_assume!((-3..200).map(crossing).all(|t| t.abs() > 1e-6 && (t - 10.0).abs() > 1e-6));
        let found = times(&response, "pass");
        let close = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-4;
        prop_assert!(found.len() == expected.len() && found.iter().zip(&expected).all(close), "{found:?} {expected:?}");
    }

    #[test]
    fn guards_on_time_alone_are_found_while_no_state_moves(
        frequency in 0.05..8.0_f64, level in -0.98..0.98_f64, phase in 0.0..6.2_f64, states in 0..2_usize,
    ) {
        let decay = ["", ", y = '-1 [1/s]*y'"][states];
        let unit = ["", ", y = '1'"][states];
        let text = format!(
            "states = {{ n = '1', e = 's'{unit} }}\nparameters = {{ f = '1/s', c = '1', p = '1' }}\n\
             der = {{ n = '0', e = 'if(sin(2*pi*f*time + p) > c, 1, 0)'{decay} }}\n\
             when.pass = {{ guard = 'sin(2*pi*f*time + p) - c', reset = {{ n = 'n + 1' }} }}"
        );
        let response = respond(&read(&text).unwrap(), &[], &[("f", frequency), ("c", level), ("p", phase)], 20.0);
        let falls = |k: i32| (PI - math::asin(level) + TAU * f64::from(k) - phase) / (TAU * frequency);
        let rises = |k: i32| (math::asin(level) + TAU * f64::from(k) - phase) / (TAU * frequency);
        prop_assume!((-2..200).flat_map(|k| [falls(k), rises(k)]).all(|t| t.abs() > 1e-9 && (t - 20.0).abs() > 1e-9));
        let expected: Vec<f64> = (-2..200).map(falls).filter(|t| *t > 0.0 && *t < 20.0).collect();
        let found = times(&response, "pass");
        prop_assert!(near(&found, &expected), "{found:?} {expected:?}");
        // Above the level from a rising crossing to the next falling one.
        let on: f64 = (-2..200).map(|k| falls(k).clamp(0.0, 20.0) - rises(k).clamp(0.0, 20.0)).sum();
        prop_assert!((at(&response, "e", 20.0) - on).abs() < 1e-7, "{} {on}", at(&response, "e", 20.0));
    }

    #[test]
    fn a_window_of_a_state_is_found_however_short_relative_to_the_step(
        from in 1.0..98.0_f64, width in 1e-4..1.0_f64, rate in 0.5..2.0_f64,
    ) {
        let text = "states = { q = '1', n = '1' }\nparameters = { r = '1/s', m = '1', h = '1' }\nder = { q = 'r', n = '0' }\n\
                    when.inside = { guard = '(q - m)^2 - h^2', reset = { n = 'n + 1' } }";
        let (middle, half) = (rate * (from + 0.5 * width), 0.5 * rate * width);
        let response = respond(&read(text).unwrap(), &[], &[("r", rate), ("m", middle), ("h", half)], 100.0);
        let found = times(&response, "inside");
        prop_assert!(near(&found, &[from]), "{found:?} {from}");
    }

    #[test]
    fn a_tick_at_the_time_of_a_sample_sees_the_new_value(
        ticks in prop::sample::select(&[0.01, 0.02, 0.05, 0.1, 0.2, 0.25, 0.3, 0.5]),
        samples in prop::sample::select(&[0.01, 0.02, 0.025, 0.05, 0.1, 0.25, 0.3]),
        hold in prop::sample::select(&[Hold::Zero, Hold::First]),
    ) {
        let text = "states = { q = 's', s = '1', y = '1' }\ninputs = { u = '1' }\nparameters = { T = 's' }\n\
                    der = { q = '1', s = '0', y = '(s - y)/1 [s]' }\n\
                    when.tick = { guard = 'T - q', reset = { q = '0', s = 'u' } }";
        let times_of = |period: f64| (0..=(5.0 / period).round() as usize).map(move |k| k as f64 * period);
        // Zero-order samples are the numbers 0, 1, 2, ...; with linear interpolation the input is time divided by the
        // period.
        let input = Input::Sampled { times: times_of(samples).collect(), values: (0..times_of(samples).count()).map(|k| k as f64).collect(), hold };
        let response = respond(&read(text).unwrap(), &[("u", input)], &[("T", ticks)], 5.0);
        let found = times(&response, "tick");
        let expected: Vec<f64> = times_of(ticks).skip(1).collect();
        prop_assert!(found.len() >= expected.len() - 1 && near(&found[..expected.len() - 1], &expected[..expected.len() - 1]), "{found:?}");
        for k in 1..expected.len() - 1 {
            let exact = k as f64 * ticks / samples;
            let value = match hold {
                Hold::Zero => (exact + 1e-9).floor(),
                _ => exact,
            };
            let here = at(&response, "s", (k as f64 + 0.5) * ticks);
            prop_assert!((here - value).abs() < 1e-6, "tick {k}: {here} {value}");
        }
    }
}

/// Returns the model of a ball on a floor, with a force per mass that lifts the ball.
fn ball(at_rest: &str) -> String {
    format!(
        "states = {{ h = 'm', v = 'm/s' }}\ninputs = {{ a = 'm/s2' }}\nparameters = {{ e = '1' }}\n\
         der = {{ h = 'v', v = 'a - 9.81' }}\nwhen.bounce = {{ guard = 'h', reset = {{ v = '-e*v' }}{at_rest} }}"
    )
}

const AT_REST: &str = ", at-rest = { h = 0, v = 0 }";

proptest! {
    #![proptest_config(mops_tiers::property(1_000))]

    #[test]
    fn a_ball_whose_bounces_accumulate_rests_until_it_is_lifted(rebound in 0.05..0.9_f64, height in 0.01..20.0_f64, lift in 10.0..30.0_f64) {
        let model = read(&ball(AT_REST)).unwrap();
        // The bounces accumulate at sqrt(2 h/g) (1 + e)/(1 - e).
        let end = (2.0 * height / 9.81).sqrt() * (1.0 + rebound) / (1.0 - rebound);
        let lifted = 1.5 * end;
        let input = Input::Step { time: lifted, before: 0.0, after: lift };
        let response = respond(&model, &[("a", input)], &[("e", rebound), ("h0", height)], 2.0 * end);
        let rests = times(&response, "bounce: at rest");
        prop_assert!(rests.len() == 1 && (rests[0] - end).abs() < 1e-6 * end, "{rests:?} {end}");
        let expected = 0.5 * (lift - 9.81) * math::powi(0.5 * end, 2);
        prop_assert!((at(&response, "h", 1.2 * end)).abs() < 1e-12);
        prop_assert!((at(&response, "h", 2.0 * end) - expected).abs() < 1e-6 * expected, "{} {expected}", at(&response, "h", 2.0 * end));
    }
}

#[test]
fn bounces_that_accumulate_without_a_rest_are_a_failure() {
    let model = read(&ball("")).unwrap();
    for (rebound, height) in [(0.8, 10.0), (0.5, 1.0), (0.1, 3.0), (0.0, 1.0), (0.5, 0.0)] {
        let failure = attempt(&model, &[], &[("e", rebound), ("h0", height)], 30.0).unwrap_err();
        let Failure::EventsAccumulate(t, _) = failure else { panic!("{failure:?}") };
        let end = (2.0 * height / 9.81_f64).sqrt() * (1.0 + rebound) / (1.0 - rebound);
        assert!((t - end).abs() < 1e-6 * end.max(1e-3), "{rebound} {height}: {t} {end}");
    }
}

#[test]
fn a_ball_that_lies_on_the_floor_stays_there() {
    let model = read(&ball(AT_REST)).unwrap();
    for rebound in [0.0, 0.5, 1.0] {
        let response = respond(&model, &[], &[("e", rebound)], 10.0);
        assert_eq!((at(&response, "h", 10.0), at(&response, "v", 5.0)), (0.0, 0.0));
    }
}

#[test]
fn bounces_without_loss_continue() {
    let response = respond(&read(&ball(AT_REST)).unwrap(), &[], &[("e", 1.0), ("h0", 1.0)], 20.0);
    let fall = (2.0 / 9.81_f64).sqrt();
    let expected: Vec<f64> = (0..40).map(|k| fall * f64::from(2 * k + 1)).filter(|t| *t < 20.0).collect();
    let found = times(&response, "bounce");
    assert!(near(&found, &expected), "{found:?} {expected:?}");
}

#[test]
fn a_rest_that_is_elsewhere_is_a_failure() {
    let model = read(&ball(", at-rest = { h = 1, v = 0 }")).unwrap();
    let failure = attempt(&model, &[], &[("e", 0.5), ("h0", 1.0)], 30.0).unwrap_err();
    assert!(matches!(failure, Failure::EventsAccumulate(..)), "{failure:?}");
}

/// Two first-order systems that switch on at p and at q, which are equal: x(3) = 1 - exp(p - 3).
#[test]
fn events_at_one_instant_keep_their_own_derivatives() {
    let text = "states = { x = '1', z = '1' }
         parameters = { p = 's', q = 's' }
         der = { x = '(if(time > p, 1, 0) - x)/1 [s]', z = '(if(time > q, 1, 0) - z)/1 [s]' }";
    let model = model(text);
    let interface = model.interface();
    let signals: Vec<usize> = (0..interface.signals.len()).collect();
    let parameters: Vec<f64> = interface
        .parameters
        .iter()
        .map(|p| if ["p", "q"].contains(&p.variable.name.as_str()) { 0.5 } else { 0.0 })
        .collect();
    let case = Case::default();
    let job = Job { case: &case, parameters: &parameters, signals: &signals, horizon: 3.0 };
    let seed = |name: &str| -> Vec<f64> {
        interface.parameters.iter().map(|p| f64::from(u8::from(p.variable.name == name))).collect()
    };
    let (analysis, tangents) = model.tangents(&job, &[seed("p"), seed("q")]).unwrap().unwrap();
    let exact = -math::exp(0.5 - 3.0);
    for (tangent, own, other) in [(&tangents[0], "x", "z"), (&tangents[1], "z", "x")] {
        let last = |signal: &str| tangent.trace(signal).last();
        assert!((last(own) - exact).abs() < 1e-7 && last(other).abs() < 1e-7, "{} {}", last(own), last(other));
        // Which signal jumps or bends when is not known for the traces.
        assert!(analysis.room(tangent).is_nan());
    }
}

#[test]
fn tangents_jump_at_guards_on_time_as_the_closed_form_does() {
    // n counts the falling crossings of sin(w t) through c, and x grows by the time of each: dx/dw is that of the event
    // times.
    let text = "states = { x = 's' }\nparameters = { w = '1/s', c = '1' }\nder = { x = '0' }\n\
                when.pass = { guard = 'sin(w*time) - c', reset = { x = 'x + time' } }";
    let model = read(text).unwrap();
    let event = |w: f64, c: f64, k: i32| (PI - math::asin(c) + TAU * f64::from(k)) / w;
    let (w, c) = (5.0, 0.3);
    let sum = |w: f64, c: f64| (0..7).map(|k| event(w, c, k)).sum::<f64>();
    let given = values(&model, &[("w", w), ("c", c)]);
    let signals: Vec<usize> = vec![0];
    let job = Job { case: &Case::default(), parameters: &given, signals: &signals, horizon: event(w, c, 6) + 0.1 };
    let seed = |name: &str| {
        let here = |p: &mops_core::Parameter| f64::from(u8::from(p.variable.name == name));
        model.interface().parameters.iter().map(here).collect::<Vec<f64>>()
    };
    let (analysis, tangents) = model.tangents(&job, &[seed("w"), seed("c")]).unwrap().unwrap();
    assert!((analysis.trace("x").last() - sum(w, c)).abs() < 1e-9);
    let step = 1e-6;
    let slopes =
        [(sum(w + step, c) - sum(w - step, c)) / (2.0 * step), (sum(w, c + step) - sum(w, c - step)) / (2.0 * step)];
    for (tangent, slope) in tangents.iter().zip(slopes) {
        assert!(
            (tangent.trace("x").last() - slope).abs() < 1e-6 * slope.abs(),
            "{} {slope}",
            tangent.trace("x").last()
        );
    }
}

#[test]
fn an_output_sees_every_sample_of_an_input_the_last_one_too() {
    for hold in [Hold::Zero, Hold::First] {
        for period in [0.1, 0.25, 0.3, 1.0, 7.0] {
            let text = "states = { q = '1' }\ninputs = { u = '1' }\nparameters = { g = '1' }\nder = { q = 'u*1[1/s]' }\n\
                        outputs = { y = { value = 'g*u' } }";
            let sampled: Vec<f64> = (0..5).map(|k| f64::from(k) * period).collect();
            let values = vec![1.0, 2.0, 1.0, 3.0, 10.0];
            let input = Input::Sampled { times: sampled.clone(), values: values.clone(), hold };
            let end = sampled[4];
            let response = respond(&read(text).unwrap(), &[("u", input)], &[("g", 2.0)], end);
            for (t, u) in sampled.iter().zip(&values) {
                let y = at(&response, "y", *t);
                assert!((y - 2.0 * u).abs() < 1e-12, "{hold:?} {period}: y({t}) = {y}");
            }
        }
    }
}

#[test]
fn conditions_that_jump_or_have_poles_are_found_in_long_steps() {
    // Time for which a condition of period T is true, as its fraction of a period. The model rests, so that steps are
    // long.
    let atan2 = "atan2(sin(2*pi*time/T), cos(2*pi*time/T))";
    for (condition, share) in [
        (format!("{atan2} > 0"), 0.5),
        (format!("{atan2} > 3"), (PI - 3.0) / TAU),
        (format!("{atan2} < -1"), (PI - 1.0) / TAU),
        ("tan(pi*time/T) > 10".to_owned(), 0.5 - math::atan(10.0) / PI),
        ("tan(pi*time/T) < 0".to_owned(), 0.5),
        ("1/cos(2*pi*time/T) > 5".to_owned(), math::asin(0.2) / PI),
    ] {
        for period in [1.0, 0.37, 7.0] {
            let text =
                format!("states = {{ E = 's' }}\nparameters = {{ T = 's' }}\nder = {{ E = 'if({condition}, 1, 0)' }}");
            let periods = 40.0;
            let response = respond(&read(&text).unwrap(), &[], &[("T", period)], periods * period);
            let (found, exact) = (at(&response, "E", periods * period), share * periods * period);
            assert!((found - exact).abs() < 1e-6 * exact, "{condition}, {period}: {found} {exact}");
        }
    }
}

#[test]
fn an_event_whose_guard_jumps_with_an_input_happens_at_every_jump() {
    // The counter counts pulses of u, which jump and stay.
    let text = "states = { n = '1' }\ninputs = { u = '1' }\nder = { n = '0/1 [s]' }\nwhen.pulse = { guard = '0.9 - u', reset = { n = 'n + 1' } }";
    let model = model(text);
    let input = Input::pulse(1.0, 0.5, [0.0, 1.0], Some(1.0), 19.9).unwrap();
    let case = Case { inputs: vec![("u".to_owned(), input)], ..Case::default() };
    let job = Job { case: &case, parameters: &[0.0], signals: &[0], horizon: 20.0 };
    let analysis = model.analyse(&job).unwrap();
    assert_eq!(analysis.trace("n").last(), 19.0);
}

/// Returns the model of a level that falls at rate `q`, with an event at its guard.
fn tank(guard: &str, reset: &str, more: &str) -> String {
    format!(
        "states = {{ h = 'm', n = '1' }}\nparameters = {{ q = 'm/s' }}\nder = {{ h = '-q + 2*q*n', n = '0' }}\n\
         when.empty = {{ guard = '{guard}', reset = {{ {reset} }}{more} }}"
    )
}

#[test]
fn an_event_that_resets_a_state_onto_its_own_guard_does_not_let_it_through() {
    for (guard, reset, rate) in [
        ("h", "h = 0", 1.0),
        ("h - 0.3", "h = 0.3", 1.0),
        ("2 - h", "h = 2", -1.0),
        ("3*h - 0.3", "h = 0.1", 1.0),
        ("h", "h = '0.5*h'", 1.0),
    ] {
        let of = |more: &str| {
            let model = read(&tank(guard, reset, more)).unwrap();
            attempt(&model, &[], &[("q", rate), ("h0", 1.0)], 10.0)
        };
        let failure = of("").unwrap_err();
        assert!(matches!(failure, Failure::EventsAccumulate(t, _) if (0.5..1.1).contains(&t)), "{guard}: {failure:?}");
        let rest = if reset.contains('*') { "h = 0" } else { reset };
        let response = of(&format!(", at-rest = {{ {rest} }}")).unwrap();
        let end: f64 = rest.trim_start_matches("h = ").parse().unwrap();
        assert_eq!(at(&response, "h", 10.0), end, "{guard}");
    }
    // The reset reverses the rate: the level leaves its guard.
    let response = respond(&read(&tank("h", "h = 0, n = 1", "")).unwrap(), &[], &[("q", 1.0), ("h0", 1.0)], 3.0);
    assert!((at(&response, "h", 3.0) - 2.0).abs() < 1e-9);
    // The reset leaves the level alone: it passes its guard once.
    let response = respond(&read(&tank("h", "n = 0", "")).unwrap(), &[], &[("q", 1.0), ("h0", 1.0)], 3.0);
    assert!((at(&response, "h", 3.0) + 2.0).abs() < 1e-9 && times(&response, "empty").len() == 1);
}

#[test]
fn a_guard_with_a_bounded_function_of_a_delayed_quantity_is_found() {
    // x(t) = t; sin(x(t - 0.5)) falls through 0 at pi + 0.5 and 3 pi + 0.5.
    let text = "states = { x = '1', n = '1' }\nparameters = { T = 's' }\nder = { x = '1 [1/s]', n = '0' }\n\
                when.pass = { guard = 'sin(delay(x, T))', reset = { n = 'n + 1' } }";
    let response = respond(&read(text).unwrap(), &[], &[("T", 0.5)], 12.0);
    let found = times(&response, "pass");
    assert!(near(&found, &[PI + 0.5, 3.0 * PI + 0.5]), "{found:?}");
}

#[test]
fn a_pulse_over_a_moving_state_is_recorded() {
    // Widths of 1 ms to 1 s in a simulation of 10 s, whose steps are seconds long.
    for width in [1e-3, 1e-2, 0.1, 1.0] {
        for place in [0.5037, 3.71, 8.2] {
            let text = format!(
                "states = {{ x = '1' }}\nparameters = {{ v = '1/s' }}\nder = {{ x = 'v' }}\n\
                 outputs = {{ y = {{ value = 'exp(-((x - {place})/{width})^2)' }} }}"
            );
            let response = respond(&read(&text).unwrap(), &[], &[("v", 1.0)], 10.0);
            assert!((at(&response, "y", place) - 1.0).abs() < 1e-6, "{width} {place}");
            assert!(place + 5.0 * width > 10.0 || at(&response, "y", place + 5.0 * width) < 1e-6, "{width} {place}");
        }
    }
}
