//! Filters of clocks, compared with difference equations and with continuous systems.

use mops_linear::Complex;
use mops_math::complex;

use super::*;

fn simulated(text: &str, parameters: &[f64], signal: &str, horizon: f64, input: Input) -> mops_core::Trace {
    let model = read(text).unwrap_or_else(|e| panic!("{e}"));
    let case = Case { inputs: vec![("e".to_owned(), input)], ..Case::default() };
    let interface = model.interface();
    let mut all = parameters.to_vec();
    all.resize(interface.parameters.len(), 0.0);
    let index = interface.signals.iter().position(|s| s.name == signal).unwrap();
    let job = Job { case: &case, parameters: &all, signals: &[index], horizon };
    model.analyse(&job).unwrap().trace(signal).clone()
}

fn sampled(filter: &str, parameters: &str) -> String {
    format!(
        "states = {{ x = '1' }}\ninputs = {{ e = '1' }}\nparameters = {{ {parameters} }}\nder = {{ x = '-x/1 [s]' }}\n\
         clocks.c = {{ every = '100 ms', memory = {{ u = '1' }}, filter = {{ u = {{ of = 'e', {filter} }} }} }}"
    )
}

const WAVE: fn() -> Input = || Input::Sine { amplitude: 1.0, frequency: 0.7, phase: 0.3, offset: 0.2 };

#[test]
fn a_filter_in_z_is_its_difference_equation() {
    let text =
        sampled("z = { numerator = ['b0', 0.5], denominator = ['a0', -1.2, 'a2'] }", "b0 = '1', a0 = '1', a2 = '1'");
    let (b0, a0, a2) = (0.7, 2.0, 0.5);
    let u = simulated(&text, &[b0, a0, a2], "u", 2.05, WAVE());
    let e = |k: i32| if k < 0 { 0.0 } else { WAVE().at(0.1 * f64::from(k)) };
    let mut y = vec![0.0, 0.0];
    for k in 0..=20 {
        let n = y.len();
        y.push((b0 * e(k - 1) + 0.5 * e(k - 2) + 1.2 * y[n - 1] - a2 * y[n - 2]) / a0);
    }
    for k in 0..=20 {
        let found = u.at(0.1 * f64::from(k) + 0.05);
        assert!((found - y[k as usize + 2]).abs() < 1e-12, "{k}: {found} {}", y[k as usize + 2]);
    }
}

#[test]
fn tustin_has_the_gain_of_the_continuous_filter_at_the_prewarped_frequency() {
    // A lead filter; after its transient the amplitude of the response is |G| at the frequency of the prewarping.
    let w = 2.0 * std::f64::consts::TAU;
    let gain = ((1.0 + math::powi(0.3 * w, 2)) / (1.0 + math::powi(0.05 * w, 2))).sqrt();
    let amplitude = |more: &str| {
        let filter = format!("continuous = {{ numerator = [0.3, 1], denominator = ['T', 1] }}{more}");
        let sine = Input::Sine { amplitude: 1.0, frequency: 2.0, phase: 0.1, offset: 0.0 };
        let u = simulated(&sampled(&filter, "T = 's'"), &[0.05], "u", 8.0, sine);
        // Least squares over whole periods of both the sine and the sampling.
        let (mut sine, mut cosine) = (0.0, 0.0);
        for k in 0..20 {
            let t = 5.0 + 0.1 * f64::from(k);
            sine += u.at(t + 0.05) * math::sin(w * t) / 10.0;
            cosine += u.at(t + 0.05) * math::cos(w * t) / 10.0;
        }
        (sine * sine + cosine * cosine).sqrt()
    };
    assert!((amplitude(", prewarp = '2 Hz'") - gain).abs() < 1e-9, "{} {gain}", amplitude(", prewarp = '2 Hz'"));
    assert!((amplitude(", prewarp = 2, method = 'tustin'") - gain).abs() < 1e-9);
    assert!((amplitude("") - gain).abs() > 0.05 * gain);
}

#[test]
fn a_pi_controller_by_tustin_is_the_trapezoidal_rule() {
    let filter = "continuous = { numerator = ['k*Ti', 'k'], denominator = ['Ti', 0] }";
    let u = simulated(&sampled(filter, "k = '1', Ti = 's'"), &[1.5, 0.4], "u", 1.05, WAVE());
    let e = |k: i32| WAVE().at(0.1 * f64::from(k));
    let mut sum = 0.05 * e(0);
    for k in 0..=10 {
        if k > 0 {
            sum += 0.05 * (e(k) + e(k - 1));
        }
        let exact = 1.5 * (e(k) + sum / 0.4);
        assert!((u.at(0.1 * f64::from(k) + 0.05) - exact).abs() < 1e-12, "{k}");
    }
}

#[test]
fn a_zero_order_hold_is_exact_for_stairs() {
    // The same oscillator in continuous time, driven by the stairs that the filter reads.
    let stairs = || Input::Sampled {
        times: (0..20).map(|k| 0.1 * f64::from(k)).collect(),
        values: (0..20).map(|k| math::sin(1.7 * f64::from(k))).collect(),
        hold: mops_core::case::Hold::Zero,
    };
    let filter = "continuous = { numerator = [2, 3], denominator = [1, 0.8, 25] }, method = 'zero-order-hold'";
    let u = simulated(&sampled(filter, ""), &[], "u", 1.95, stairs());
    let continuous = "states = { a = '1', b = '1' }\ninputs = { e = '1' }\nder = { a = 'b/1 [s]', b = '(e - 25*a - 0.8*b)/1 [s]' }\n\
                      outputs = { y = '3*a + 2*b' }\n[tolerance]\nrelative = 1e-12\nabsolute = 1e-13";
    let y = simulated(continuous, &[], "y", 1.95, stairs());
    for k in 0..20 {
        let t = 0.1 * f64::from(k);
        assert!((u.at(t + 0.05) - y.at(t)).abs() < 1e-9, "{k}: {} {}", u.at(t + 0.05), y.at(t));
    }
}

#[test]
fn a_filter_that_does_not_exist_is_refused() {
    for (filter, fact) in [
        ("z = { numerator = [1, 2], denominator = [1] }", "expected a proper transfer function"),
        ("z = { numerator = [1], denominator = [0, 1] }", "the leading coefficient of the denominator is 0"),
        ("z = { numerator = [1], denominator = [1] }, method = 'tustin'", "discrete already"),
        ("method = 'tustin'", "given in `z` or as `continuous`"),
        ("continuous = { numerator = ['k'], denominator = [1, 1] }, method = 'zero-order-hold'", "needs numbers"),
        ("continuous = { numerator = [1], denominator = [1, 1] }, prewarp = '-1 Hz'", "above 0 Hz"),
        ("continuous = { numerator = [1], denominator = [1, 1] }, prewarp = '1 MHz'", "half of the sampling frequency"),
        ("continuous = { numerator = [1], denominator = [1, 1] }, prewarp = '1 s'", "expected a quantity in"),
    ] {
        let mistake = read(&sampled(filter, "k = '1'")).err().unwrap().to_string();
        assert!(mistake.contains(fact) && mistake.starts_with("clocks.c.filter.u"), "{filter}: {mistake}");
    }
}

#[test]
fn a_number_beside_coefficients_of_another_convention_is_named() {
    let parameters = "w = { unit = 'rad/s', default = 5 }, z = { unit = '1', default = 0.7 }";
    let low_pass = |one: &str| format!("continuous = {{ numerator = ['w^2'], denominator = [{one}, '2*z*w', 'w^2'] }}");
    let mistake = read(&sampled(&low_pass("1"), parameters)).err().unwrap().to_string();
    assert!(
        mistake.starts_with("clocks.c.filter.u.continuous.denominator: ") && mistake.contains("write \"1 [1]\""),
        "{mistake}"
    );
    assert!(read(&sampled(&low_pass("'1 [1]'"), parameters)).is_ok());
    assert!(read(&sampled("continuous = { numerator = [1], denominator = ['1/w', 1] }", parameters)).is_ok());
}

/// Coefficients, in descending powers, of the denominator of a Butterworth low pass with gain 1.
fn butterworth(order: usize, w: f64) -> Vec<f64> {
    let times = |a: &[f64], b: &[f64]| {
        let mut product = vec![0.0; a.len() + b.len() - 1];
        a.iter().enumerate().for_each(|(i, x)| b.iter().enumerate().for_each(|(j, y)| product[i + j] += x * y));
        product
    };
    let mut all = if order % 2 == 1 { vec![1.0 / w, 1.0] } else { vec![1.0] };
    for damping in dampings(order) {
        all = times(&all, &[1.0 / (w * w), 2.0 * damping / w, 1.0]);
    }
    all
}

/// Damping ratios of the sections of a Butterworth filter.
fn dampings(order: usize) -> Vec<f64> {
    (0..order / 2).map(|i| math::sin(std::f64::consts::PI * (2 * i + 1) as f64 / (2 * order) as f64)).collect()
}

#[test]
fn a_filter_in_s_keeps_its_digits_at_fast_sampling() {
    // Against sections of order 1 and 2 of the bilinear image, whose errors are those of 1e-16/(w T)^2.
    for (order, hertz, period) in
        [(3, 0.05, 2e-3), (4, 1.0, 2e-4), (5, 1.0, 2e-4), (6, 1.0, 1e-3), (6, 1.0, 1e-4), (8, 1.0, 1e-3)]
    {
        let (w, rate) = (std::f64::consts::TAU * hertz, 2.0 / period);
        let filter = format!("continuous = {{ numerator = [1], denominator = {:?} }}", butterworth(order, w));
        let text = sampled(&filter, "").replace("100 ms", &format!("{period:?} s"));
        let steps = (2.5 / hertz / period).min(25_000.0) as usize;
        let u = simulated(&text, &[], "u", period * steps as f64, Input::Constant(1.0));
        let mut sections: Vec<([f64; 3], [f64; 3], [f64; 2])> = dampings(order)
            .into_iter()
            .map(|damping| {
                let (square, cross) = (rate * rate, 2.0 * damping * w * rate);
                let leading = square + cross + w * w;
                let below = [1.0, 2.0 * (w * w - square) / leading, (square - cross + w * w) / leading];
                ([1.0, 2.0, 1.0].map(|b| b * w * w / leading), below, [0.0; 2])
            })
            .collect();
        if order % 2 == 1 {
            let above = [w / (rate + w), w / (rate + w), 0.0];
            sections.push((above, [1.0, (w - rate) / (w + rate), 0.0], [0.0; 2]));
        }
        for k in 0..steps {
            let exact = sections.iter_mut().fold(1.0, |e, (above, below, m)| {
                let y = above[0] * e + m[0];
                *m = [above[1] * e - below[1] * y + m[1], above[2] * e - below[2] * y];
                y
            });
            if k % 97 == 0 {
                let found = u.at(period * (k as f64 + 0.5));
                assert!((found - exact).abs() < 1e-8, "order {order} at {hertz} Hz, {k}: {found} {exact}");
            }
        }
    }
}

#[test]
fn a_zero_order_hold_keeps_its_digits_at_fast_sampling() {
    // The response to a step is that of the continuous filter, 1 + sum of r exp(p t) over its poles p with the residues
    // r.
    for (order, hertz, period) in [(4, 1.0, 2e-4), (6, 1.0, 1e-3), (7, 0.2, 1e-3)] {
        let w = std::f64::consts::TAU * hertz;
        let mut poles: Vec<Complex> = dampings(order)
            .into_iter()
            .flat_map(|damping| {
                let pole = Complex::new(-damping, (1.0 - damping * damping).sqrt()) * w;
                [pole, pole.conj()]
            })
            .collect();
        poles.extend((order % 2 == 1).then_some(Complex::new(-w, 0.0)));
        let exact = |t: f64| {
            let residue = |i: usize| {
                let others = (0..order).filter(|&j| j != i).map(|j| -poles[j] / (poles[i] - poles[j]));
                others.product::<Complex>()
            };
            1.0 - (0..order).map(|i| (residue(i) * complex::exp(poles[i] * t)).re).sum::<f64>()
        };
        let filter = format!(
            "continuous = {{ numerator = [1], denominator = {:?} }}, method = 'zero-order-hold'",
            butterworth(order, w)
        );
        let text = sampled(&filter, "").replace("100 ms", &format!("{period:?} s"));
        let u = simulated(&text, &[], "u", 2.0 / hertz, Input::Constant(1.0));
        for k in (0..(1.9 / hertz / period) as usize).step_by(61) {
            let t = period * k as f64;
            let found = u.at(t + 0.5 * period);
            assert!((found - exact(t)).abs() < 1e-8, "order {order}, {t}: {found} {}", exact(t));
        }
    }
}

#[test]
fn a_filter_in_z_that_loses_its_digits_has_a_note() {
    let notes = |filter: &str| read(&sampled(filter, "")).unwrap().notes();
    assert!(notes("z = { numerator = [1], denominator = [1, -0.9] }").iter().all(|note| !note.contains("digits")));
    // (z - 0.999)^4.
    let fourth = "z = { numerator = [1], denominator = [1, -3.996, 5.988006, -3.988011996, 0.996005996001] }";
    let found = notes(fourth);
    assert!(found.iter().any(|note| note.starts_with("filter `u`") && note.contains("to 2 digits")), "{found:?}");
}
