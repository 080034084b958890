//! Clocks, compared with the exact solution: a matrix exponential between any two changes.

use std::sync::Arc;

use mops_core::model::{Linearise, Linearised};
use mops_linear::{Complex, Loop, StateSpace};
use mops_math::complex;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::*;

/// Period of the current controller, its delay, period and offset of the speed controller, all in microseconds.
const RATES: [[u32; 4]; 10] = [
    [1000, 0, 5000, 0],
    [1000, 300, 5000, 0],
    [1000, 1000, 2000, 0],
    [700, 150, 1900, 0],
    [3000, 0, 1000, 0],
    [500, 20, 500, 0],
    [100, 0, 10_000, 50],
    [1300, 800, 3100, 700],
    [10_000, 5000, 10_000, 10_000],
    [333, 111, 999, 0],
];

const SPEED: f64 = 20.0;
const GAINS: [f64; 3] = [0.35, 12.0, 2.5];
const END: u32 = 50_000;

/// DC motor with a sampled current controller within a sampled speed controller.
fn motor([period, delay, outer, offset]: [u32; 4]) -> String {
    format!(
        "states = {{ i = 'A', w = 'rad/s' }}
         inputs = {{ r = 'rad/s' }}
         parameters = {{ kp = 'A s/rad', ki = 'A/rad', kc = 'V/A' }}
         constants = {{ R = '0.6 ohm', L = '2 mH', K = '0.06 N m/A', J = '1e-3 kg m2', b = '1e-3 N m s', T = '{outer} us' }}
         der = {{ i = \"L*i' = u - R*i - K*w\", w = \"J*w' = K*i - b*w\" }}
         outputs = {{ e = 'r - w' }}
         let = {{ next_sum = 'sum + ki*T*(r - w)' }}
         clocks.current = {{ every = '{period} us', delay = '{delay} us', memory = {{ u = 'V' }}, next = {{ u = 'clip(kc*(ref - i), -12, 12)' }} }}
         clocks.speed = {{ every = 'T', offset = '{offset} us', memory = {{ sum = 'A', ref = 'A' }}, next = {{ sum = 'next_sum', ref = 'kp*(r - w) + next_sum' }} }}"
    )
}

fn tight(text: &str) -> Equations {
    read(&format!("{text}\n[tolerance]\nrelative = 1e-13\nabsolute = 1e-14\n")).unwrap_or_else(|e| panic!("{e}"))
}

/// Returns the matrix exponential: the Taylor series of a 1024th part, squared ten times.
fn exponential(of: Matrix3<f64>) -> Matrix3<f64> {
    let part = of / 1024.0;
    let mut term = Matrix3::identity();
    let mut sum = term;
    for k in 1..=12 {
        term = term * part / f64::from(k);
        sum += term;
    }
    (0..10).fold(sum, |power, _| power * power)
}

/// Returns current, speed, voltage, integral and reference at the end.
fn exact([period, delay, outer, offset]: [u32; 4], gains: [f64; 3]) -> [f64; 5] {
    let [kp, ki, kc] = gains;
    let (resistance, inductance, constant, inertia, friction) = (0.6, 2e-3, 0.06, 1e-3, 1e-3);
    #[rustfmt::skip]
    let system = Matrix3::new(
        -resistance / inductance, -constant / inductance, 1.0 / inductance,
        constant / inertia, -friction / inertia, 0.0,
        0.0, 0.0, 0.0,
    );
    let seconds = |time: u32| f64::from(time) * 1e-6;
    // Current, speed and voltage.
    let (mut x, mut sum, mut reference) = (Vector3::zeros(), 0.0, 0.0);
    let mut pending: Option<(u32, f64)> = None;
    let mut now = 0;
    loop {
        if let Some((_, voltage)) = pending.take_if(|(at, _)| *at == now) {
            x[2] = voltage;
        }
        let before = (x, sum, reference);
        if now % period == 0 {
            let voltage = (kc * (before.2 - before.0[0])).clamp(-12.0, 12.0);
            if delay == 0 { x[2] = voltage } else { pending = Some((now + delay, voltage)) }
        }
        if now >= offset && (now - offset) % outer == 0 {
            let error = SPEED - before.0[1];
            sum = before.1 + ki * seconds(outer) * error;
            reference = kp * error + sum;
        }
        if now == END {
            return [x[0], x[1], x[2], sum, reference];
        }
        let ticks = [
            (now / period + 1) * period,
            if now < offset { offset } else { ((now - offset) / outer + 1) * outer + offset },
        ];
        let next = ticks.into_iter().chain(pending.map(|(at, _)| at)).chain([END]).min().unwrap();
        x = exponential(system * seconds(next - now)) * x;
        now = next;
    }
}

#[test]
fn sampled_loops_of_ten_pairs_of_rates_agree_with_the_exact_solution() {
    for rates in RATES {
        let response = respond(
            &tight(&motor(rates)),
            &[("r", Input::Constant(SPEED))],
            &[("kp", GAINS[0]), ("ki", GAINS[1]), ("kc", GAINS[2])],
            f64::from(END) * 1e-6,
        );
        let size = exact(rates, GAINS);
        for (signal, exact) in ["i", "w", "u", "sum", "ref"].into_iter().zip(size) {
            let found = response.trace(signal).unwrap().last();
            assert!((found - exact).abs() <= 1e-10 * exact.abs().max(1.0), "{signal} {rates:?}: {found} {exact}");
        }
    }
}

#[test]
fn tangents_of_sampled_loops_agree_with_differences_of_the_exact_solution() {
    for rates in RATES {
        let model = tight(&motor(rates));
        let parameters = values(&model, &[("kp", GAINS[0]), ("ki", GAINS[1]), ("kc", GAINS[2])]);
        let case = Case { inputs: vec![("r".into(), Input::Constant(SPEED))], ..Case::default() };
        let job =
            Job { case: &case, parameters: &parameters, signals: &[0, 1, 2, 3, 4], horizon: f64::from(END) * 1e-6 };
        let seed = |i: usize| (0..parameters.len()).map(|j| f64::from(u8::from(i == j))).collect();
        let (_, tangents) = model.tangents(&job, &(0..3).map(seed).collect::<Vec<_>>()).unwrap().unwrap();
        for (i, tangent) in tangents.iter().enumerate() {
            let step = 1e-6 * GAINS[i];
            let moved = |sign: f64| {
                let mut gains = GAINS;
                gains[i] += sign * step;
                exact(rates, gains)
            };
            let (up, down) = (moved(1.0), moved(-1.0));
            for (k, signal) in ["i", "w", "u", "sum", "ref"].into_iter().enumerate() {
                let difference = (up[k] - down[k]) / (2.0 * step);
                let found = tangent.trace(signal).last();
                assert!(
                    (found - difference).abs() <= 1e-6 * difference.abs().max(1.0),
                    "{signal} {i} {rates:?}: {found} {difference}"
                );
            }
        }
    }
}

#[test]
fn a_sample_sees_an_input_that_jumps_at_its_instant_despite_rounding() {
    // 3 times 0.1 s is above 0.3 s, 29 times 0.01 s is 0.29 s, 7 times 0.1 s is above 0.7 s.
    for (period, jump) in [(0.1, 0.3), (0.01, 0.29), (0.1, 0.7), (0.01, 0.57), (0.02, 1.14)] {
        let text = format!(
            "inputs = {{ u = '1' }}\nstates = {{ x = '1' }}\nder = {{ x = '0 [1/s]*x' }}
             clocks.c = {{ every = '{period} s', memory = {{ y = '1' }}, next = {{ y = 'u' }} }}"
        );
        let input = Input::Step { time: jump, before: 0.0, after: 1.0 };
        let response = respond(&model(&text), &[("u", input)], &[], jump + 3.0 * period);
        assert_eq!(at(&response, "y", jump + 0.25 * period), 1.0, "{period} {jump}");
        assert_eq!(at(&response, "y", jump - 0.25 * period), 0.0, "{period} {jump}");
    }
}

#[test]
fn memory_shifts_and_counts_from_its_initial_value() {
    let text = "states = { x = '1' }\nder = { x = '1 [1/s]' }
        clocks.c = { every = '1 s', memory = { n = '1', 'z[1..3]' = '1' }, next = { n = 'n + 1', 'z[1]' = 'x', 'z[k=2..3]' = 'z[k-1]' } }
        start = { n = 10 }";
    let response = respond(&model(text), &[], &[], 5.5);
    assert_eq!(at(&response, "n", 0.0), 11.0);
    assert_eq!(at(&response, "n", 5.2), 16.0);
    for (k, expected) in [(1, 5.0), (2, 4.0), (3, 3.0)] {
        assert!((at(&response, &format!("z[{k}]"), 5.2) - expected).abs() < 1e-9);
    }
}

#[test]
fn wrong_clocks_are_an_error_with_a_remedy() {
    let clock = |text: &str| {
        format!(
            "inputs = {{ u = 'V' }}\nparameters = {{ p = 's' }}\nstates = {{ x = 'V' }}\nder = {{ x = '0 [1/s]*x' }}\nclocks.c = {{ {text} }}"
        )
    };
    for (text, key, fact) in [
        (
            "every = '0 s', memory = { m = 'V' }, next = { m = 'u' }",
            "clocks.c.every",
            "expected a positive period, found 0 s",
        ),
        ("every = '10 V', memory = { m = 'V' }, next = { m = 'u' }", "clocks.c.every", ""),
        ("every = 'p', memory = { m = 'V' }, next = { m = 'u' }", "clocks.c.every", "not constant"),
        (
            "every = '1 s', delay = '2 s', memory = { m = 'V' }, next = { m = 'u' }",
            "clocks.c.delay",
            "between 0 and the period of 1 s",
        ),
        ("every = '1 s', offset = '-1 s', memory = { m = 'V' }, next = { m = 'u' }", "clocks.c.offset", "at least 0"),
        ("every = '1 s', memory = { m = 'V', n = 'V' }, next = { m = 'u' }", "clocks.c.next", "`n` has no new value"),
        ("every = '1 s', memory = {}, next = {}", "clocks.c.memory", "no memory"),
        ("every = '1 s', memory = { m = 'A' }, next = { m = 'u' }", "clocks.c.next.m", ""),
        ("every = '1 s', memory = { m = 'V' }, next = { k = 'u' }", "clocks.c.next.k", "no state `k`"),
        ("every = '1 s', memory = { x = 'V' }, next = { x = 'u' }", "clocks.c.memory.x", "declared twice"),
    ] {
        let mistake = read(&clock(text)).err().unwrap_or_else(|| panic!("it was read: {text}"));
        assert!(mistake.to_string().contains(fact), "{text}: {mistake}");
        assert!(mistake.help.is_some(), "{text}: {mistake}");
        assert_eq!(mistake.path.join("."), key, "{text}: {mistake}");
    }
}

/// Returns the linearised system of a model at rest, with its loop cut at a variable, if any.
fn linearised(text: &str, cut: Option<&str>, given: &[(&str, f64)]) -> Result<StateSpace, String> {
    let model = tight(text);
    let parameters = values(&model, given);
    let linearised = match cut {
        Some(variable) => Linearised::opened(&model, &[variable.to_owned()], Linearise::default()),
        None => Linearised::new(Arc::new(model), &Linearise::default()),
    };
    let found = linearised.map_err(|mistake| mistake.to_string())?.at(&Case::default(), &parameters);
    found.map(|found| found.system).map_err(|failure| failure.to_string())
}

fn gains() -> [(&'static str, f64); 3] {
    [("kp", GAINS[0]), ("ki", GAINS[1]), ("kc", GAINS[2])]
}

#[test]
fn the_discrete_equivalent_follows_the_simulation_of_ten_pairs_of_rates() {
    for rates in RATES {
        let text = motor(rates);
        let sampled = linearised(&text, None, &gains()).unwrap();
        let difference = sampled.difference_equation().unwrap();
        let period = sampled.period.unwrap();
        let slowest = f64::from(rates[0].max(rates[2])) * 1e-6;
        assert!((period / slowest - (period / slowest).round()).abs() < 1e-12, "{rates:?}: {period}");
        // The current reference is 0 up to the first instant of the speed controller.
        let first = if rates[2] >= rates[0] { f64::from(rates[3]) * 1e-6 } else { 0.0 };
        let response = respond(&tight(&text), &[("r", Input::Constant(0.01))], &gains(), 6.0 * period + first);
        let mut x = DVector::zeros(difference.order());
        let r = DVector::from_element(1, 0.01);
        for k in 0..6 {
            let t = first + f64::from(k) * period;
            let outputs = &difference.c * &x + &difference.d * &r;
            for signal in ["i", "w", "e"] {
                let row = difference.outputs.iter().position(|output| output == signal).unwrap();
                let (found, exact) = (outputs[row], at(&response, signal, t));
                assert!(
                    (found - exact).abs() < 1e-9 * exact.abs().max(0.01),
                    "{rates:?} {signal} {t}: {found} {exact}"
                );
            }
            x = &difference.a * x + &difference.b * &r;
        }
    }
}

/// Delays of a motor with a sampled current controller and a sampled speed controller: a part of the voltage, of the
/// measured current and of the reference arrives later.
fn delayed(rates: [u32; 4], actuator: u32, sensor: u32, reference: u32) -> String {
    motor(rates)
        .replace("= u - R*i", &format!("= 0.4*u + 0.6*delay(u, {actuator} [us]) - R*i"))
        .replace("kc*(ref - i)", &format!("kc*(ref - 0.7*i - 0.3*delay(i, {sensor} [us]))"))
        .replace("kp*(r - w)", &format!("kp*(delay(r, {reference} [us]) - w)"))
}

const DELAYS: [[u32; 3]; 5] =
    [[300, 400, 5000], [1000, 1000, 10_000], [2500, 3100, 12_500], [12_345, 999, 600], [5000, 20_000, 7000]];

#[test]
fn the_discrete_equivalent_of_a_model_with_delays_follows_its_simulation() {
    for rates in [RATES[0], RATES[1], RATES[2], RATES[5], RATES[9], [1000, 250, 1000, 0]] {
        for [actuator, sensor, reference] in DELAYS {
            let text = delayed(rates, actuator, sensor, reference);
            let sampled = linearised(&text, None, &gains()).unwrap();
            let difference = sampled.difference_equation().unwrap();
            let period = sampled.period.unwrap();
            // The reference steps after the start, since the past has its value at the start.
            let input = Input::Step { time: 0.0, before: 0.0, after: 0.01 };
            let response = respond(&tight(&text), &[("r", input)], &gains(), 12.0 * period);
            let mut x = DVector::zeros(difference.order());
            let r = DVector::from_element(1, 0.01);
            for k in 0..12 {
                let t = f64::from(k) * period;
                let outputs = &difference.c * &x + &difference.d * &r;
                for signal in ["i", "w"] {
                    let row = difference.outputs.iter().position(|output| output == signal).unwrap();
                    let (found, exact) = (outputs[row], at(&response, signal, t));
                    assert!(
                        (found - exact).abs() < 1e-9 * exact.abs().max(0.01),
                        "{rates:?} {actuator} {sensor} {reference} {signal} {t}: {found} {exact}"
                    );
                }
                x = &difference.a * x + &difference.b * &r;
            }
        }
    }
}

#[test]
fn the_return_difference_of_a_cut_loop_is_that_of_the_closed_one() {
    let characteristic = |system: &StateSpace, z: Complex| {
        let a = system.difference_equation().unwrap().a;
        let one = DMatrix::<Complex>::identity(a.nrows(), a.nrows());
        (one * z - a.map(|x| Complex::new(x, 0.0))).determinant()
    };
    // Values of the last two arrive when the other clock computes.
    let arriving = [[1000, 1000, 1000, 0], [1000, 500, 250, 0]];
    let speed = [0, 1, 2, 5, 6, 8, 9].map(|k| ("ref", RATES[k]));
    let current = [RATES[4], RATES[5], RATES[8], arriving[0], arriving[1]].map(|rates| ("u", rates));
    for (variable, rates) in speed.into_iter().chain(current) {
        let late = DELAYS.map(|[actuator, sensor, reference]| delayed(rates, actuator, sensor, reference));
        for text in late.iter().chain([&motor(rates)]) {
            let (closed, open) =
                (linearised(text, None, &gains()).unwrap(), linearised(text, Some(variable), &gains()).unwrap());
            assert_eq!(closed.period, open.period);
            let period = open.period.unwrap();
            let response = open.response().unwrap();
            for angle in [0.1, 0.7, 1.9, 3.0] {
                let z = complex::exp(Complex::new(0.0, angle));
                let found = response.scalar(angle / period) + 1.0;
                // Each value more or less that waits for its delay is a pole at z = 0.
                let order = open.order() as i32 - closed.order() as i32;
                let exact = characteristic(&closed, z) / characteristic(&open, z) * z.powi(order);
                let error = complex::norm(found - exact) / complex::norm(exact);
                assert!(error < 1e-8, "{variable} {rates:?}: {found} {exact}\n{text}");
            }
        }
    }
}

#[test]
fn a_cut_keeps_what_a_clock_remembers_of_its_own_output() {
    // Speed form of a controller, u[k] = u[k-1] - g (x[k] - a x[k-1]), at an integrator.
    let (gain, zero, period) = (0.6, 0.8, 0.5);
    let text = format!(
        "states = {{ x = 'm' }}
         parameters = {{ g = '1/s' }}
         der = {{ x = 'u' }}
         start = {{ u = '0.1 [m/s]' }}
         clocks.c = {{ every = '{period} s', memory = {{ u = 'm/s', last = 'm' }}, next = {{ u = 'u - g*(x - {zero}*last)', last = 'x' }} }}"
    );
    let open = linearised(&text, Some("u"), &[("g", gain)]).unwrap();
    assert_eq!((open.inputs.join(" "), open.outputs.join(" ")), ("u".to_owned(), "-u".to_owned()));
    let response = open.response().unwrap();
    for omega in [0.1, 1.0, 5.0] {
        let z = complex::exp(Complex::new(0.0, omega * period));
        let exact = (-z.inv() * zero + 1.0) / (-z.inv() + 1.0) * gain * period / (z - 1.0);
        let found = response.scalar(omega);
        assert!(complex::norm(found - exact) < 1e-12 * complex::norm(exact), "{omega}: {found} {exact}");
    }
}

#[test]
fn memory_that_delays_a_cut_variable_by_periods_is_in_the_loop() {
    // u = g x at the integrator x' = -u two periods later.
    let (gain, period) = (0.2, 0.5);
    let text = format!(
        "states = {{ x = 'm' }}
         parameters = {{ g = '1/s' }}
         der = {{ x = '-second' }}
         clocks.c = {{ every = '{period} s', memory = {{ u = 'm/s', first = 'm/s', second = 'm/s' }}, next = {{ u = 'clip(g*x, -1, 1)', first = 'u', second = 'first' }} }}"
    );
    for variable in ["u", "first", "second"] {
        let open = linearised(&text, Some(variable), &[("g", gain)]).unwrap();
        let response = open.response().unwrap();
        for omega in [0.1, 1.0, 5.0] {
            let z = complex::exp(Complex::new(0.0, omega * period));
            let exact = z.powi(-2) * gain * period / (z - 1.0);
            let found = response.scalar(omega);
            assert!(complex::norm(found - exact) < 1e-12 * complex::norm(exact), "{variable} {omega}: {found} {exact}");
        }
    }
    // Beyond a limit, nothing acts on the controller.
    let limited = text.replace("g*x", "g*x + 3 [m/s]");
    let refused = linearised(&limited, Some("u"), &[("g", gain)]).unwrap_err();
    assert!(refused.contains("no loop through `u`"), "{refused}");
}

#[test]
fn a_loop_that_is_cut_between_the_instants_is_refused() {
    let text = motor(RATES[0]);
    let text =
        text.replace("next_sum = 'sum + ki*T*(r - w)'", "next_sum = 'sum + ki*T*(r - w)', v = '2*u', back = 'K*w'");
    let text = text.replace("u - R*i - K*w", "v/2 - R*i - back");
    // `v` follows the memory `u`, whose clock is the faster one; `back` is continuous.
    let fast = linearised(&text, Some("v"), &gains()).unwrap_err();
    assert!(fast.contains("slowest clock"), "{fast}");
    let continuous = linearised(&text, Some("back"), &gains()).unwrap_err();
    assert!(continuous.contains("`back` follows the state `w` between the instants"), "{continuous}");
    let unknown = linearised(&text, Some("i"), &gains()).unwrap_err();
    assert!(unknown.contains("or at the memory of a clock, not at `i`"), "{unknown}");
    let delayed = text.replace("back = 'K*w'", "back = \"K*delay(w, '1 ms')\"");
    let between = linearised(&delayed, None, &gains()).unwrap_err();
    assert!(between.contains("acts between them"), "{between}");
}

#[test]
fn a_condition_on_the_time_is_met_at_the_instant_itself() {
    // Decimal times of instants that are sums of rounded numbers.
    for (every, offset, first) in [(100, 50, 0), (10, 5, 0), (70, 0, 0), (1, 0, 0), (3, 1, 2)] {
        for k in (first..400).step_by(7) {
            let time = f64::from(offset + k * every) * 1e-3;
            let text = format!(
                "states = {{ y = '1' }}\nder = {{ y = '0' }}\n\
                 clocks.c = {{ every = '{every} ms', offset = '{offset} ms', memory = {{ from = '1', after = '1' }}, \
                 next = {{ from = 'if(time >= {time}, from + 1, from)', after = 'if(time < {time}, after + 1, after)' }} }}"
            );
            let response = respond(&read(&text).unwrap(), &[], &[], f64::from(offset + 400 * every) * 1e-3 + 1e-4);
            let end = f64::from(offset + 400 * every) * 1e-3 + 1e-4;
            let counts = [at(&response, "from", end), at(&response, "after", end)];
            assert_eq!(counts, [f64::from(401 - k), f64::from(k)], "{every} ms, {offset} ms, {time} s");
        }
    }
}

#[test]
fn margins_do_not_depend_on_the_unit_of_memory() {
    // A double integrator with a lag, PD by the last sample. From its frequency response, by the matrix exponential and
    // bisection of
    // |L| = 1: crossover 0.320_978_712_9 rad/s, phase margin 16.642_429_756 deg; on a grid: maximum sensitivity
    // 3.454_886.
    for unit in ["1", "1000", "1e6", "1e-3"] {
        let text = format!(
            "states = {{ x1 = '1', x2 = '1', x3 = '1' }}\ninputs = {{ r = '1' }}\nparameters = {{ k = '1' }}\n\
             der = {{ x1 = 'u/1 [s]', x2 = '(x1 + 0.7*u)/1 [s]', x3 = '(x2 - x3)/0.05747126436781609 [s]' }}\n\
             clocks.c = {{ every = '0.05 s', memory = {{ u = '1', last = '1' }}, \
             next = {{ last = '{unit}*x3', u = 'k*(r - x3) - k*6.0*(x3 - last/{unit})' }} }}"
        );
        let found = Loop::new(linearised(&text, Some("u"), &[("k", 0.1)]).unwrap()).unwrap();
        let peak = found.peak_sensitivity().unwrap();
        assert!((peak - 3.454_886).abs() < 2e-6, "{unit}: {peak}");
        let phase = found.phase_margin().unwrap().to_degrees();
        assert!((phase - 16.642_429_756).abs() < 1e-6, "{unit}: {phase}");
        let crossover = found.gain_crossovers[0].frequency;
        assert!((crossover - 0.320_978_712_9).abs() < 1e-8, "{unit}: {crossover}");
    }
}

#[test]
fn margins_of_a_cascade_have_a_value_wherever_its_gains_are() {
    let text = "states = { i = 'A', th = 'rad', w = 'rad/s' }\ninputs = { r = 'rad' }\n\
                parameters = { kp = '1/s', kv = 'V s/rad', Ti = 's' }\n\
                constants = { R = '1.2 ohm', L = '1 mH', K = '0.05 N m/A', J = '2.8e-5 kg m2', N = '50', b = '1e-5 N m s/rad', T = '1 ms' }\n\
                der = { i = \"L*i' = u - R*i - K*w\", th = 'w', w = \"J*w' = K*i - b*w\" }\n\
                let = { y = 'th/N', wm = 'N*(y - last)/T', e = 'N*kp*(r - y) - wm', v = 'kv*e + sum', vs = 'clip(v, -24 [V], 24 [V])' }\n\
                clocks.c = { every = 'T', delay = '1 ms', memory = { u = 'V', last = 'rad', sum = 'V' }, \
                next = { u = 'vs', last = 'y', sum = 'sum + T/Ti*(kv*e) + vs - v' } }";
    for kp in [2.0, 10.0, 40.0, 100.0] {
        for kv in [0.02, 0.06, 0.2] {
            for integral in [0.01, 0.03, 0.1, 0.3] {
                let open = linearised(text, Some("u"), &[("kp", kp), ("kv", kv), ("Ti", integral)]).unwrap();
                assert!(Loop::new(open).is_ok(), "{kp} {kv} {integral}");
            }
        }
    }
}

#[test]
fn a_limit_opens_the_loop_whatever_acts_beside_it() {
    // v is 3 at the start, beyond its limit; the anti-windup closes another loop.
    let text = "states = { x = 'm' }\nparameters = { g = '1/s' }\nstart = { v = 3 }\nder = { x = '-clip(v, -1, 1)' }\n\
                clocks.c = { every = '0.1 s', memory = { v = 'm/s', sum = 'm/s' }, \
                next = { v = 'g*x + sum', sum = 'sum + 0.2*(clip(v, -1, 1) - v)' } }";
    let refused = linearised(text, Some("v"), &[("g", 1.0)]).unwrap_err();
    assert!(refused.contains("a limit is active at the operating point (`clip` in"), "{refused}");
    let limits = [
        ("min", "min(max(v, -1), 1)"),
        ("if", "if(v > 1, 1, v < -1, -1, v)"),
        ("table", "table(v, -9, -1, -2, -1, -1, -1, 1, 1, 2, 1, 9, 1)"),
        ("min", "sign(v)*min(abs(v), 1)"),
    ];
    let within = |text: &str| text.replace("v = 3 }", "v = 0.5 }");
    for (function, limit) in limits {
        let text = text.replace("clip(v, -1, 1)", limit);
        let open = linearised(&within(&text), Some("v"), &[("g", 1.0)]);
        assert!(open.is_ok(), "{limit}: {}", open.unwrap_err());
        let refused = linearised(&text, Some("v"), &[("g", 1.0)]).unwrap_err();
        let place = format!("a limit is active at the operating point (`{function}` in");
        assert!(refused.contains(&place), "{limit}: {refused}");
    }
    // What the cut variable reaches beside the selected value is no open loop.
    let root = text.replace("-clip(v, -1, 1)'", "-v/max(abs(v), 5)*1 [m/s]'").replace("v = 3 }", "v = 0 }");
    assert!(linearised(&root, Some("v"), &[("g", 1.0)]).is_ok());
    // A limit of the plant that does not follow the cut variable at once, such as dry friction at a speed.
    let moving = "states = { w = '1/s' }\nparameters = { g = '1' }\nstart = { w = 5 }\n\
                  der = { w = '(u - clip(w/0.1, -1, 1))/1 [s]' }\n\
                  clocks.c = { every = '0.1 s', memory = { u = '1/s' }, next = { u = '-g*w' } }";
    assert!(linearised(moving, Some("u"), &[("g", 1.0)]).is_ok());
}
