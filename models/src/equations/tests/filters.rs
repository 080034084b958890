//! Filters of clocks, compared with difference equations and with continuous systems.

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
        hold: mops_core::Hold::Zero,
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
