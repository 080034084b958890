use mops_math as math;
use mops_math::complex;

use crate::search::maximise;
use crate::testing::assert_near;
use crate::{TransferFunction, bandwidth};

use super::*;

fn loop_of(numerator: &[f64], denominator: &[f64], delay: f64) -> Loop {
    let g = TransferFunction { numerator: numerator.to_vec(), denominator: denominator.to_vec(), delay };
    Loop::new(g.state_space().unwrap()).unwrap()
}

/// Returns the phase crossovers with a gain above -60 dB.
fn phase_crossovers(l: &Loop) -> Vec<Crossing> {
    let mut found = Vec::new();
    l.phase_crossovers_in(|span| span.gain()[1] > math::ln(1e-3), |crossing| found.push(crossing)).unwrap();
    found
}

#[test]
fn the_third_order_lag_has_its_closed_form() {
    // 4/(s + 1)^3: real at w = sqrt 3, where it is -1/2; |L| = 1 at w^2 = 4^(2/3) - 1.
    let l = loop_of(&[4.0], &[1.0, 3.0, 3.0, 1.0], 0.0);
    assert!(l.is_stable());
    let crossing = phase_crossovers(&l);
    assert_eq!(crossing.len(), 1, "{crossing:?}");
    assert_near(crossing[0].frequency, 3.0f64.sqrt(), 1e-12);
    assert_near(crossing[0].response.re, -0.5, 1e-12);
    let w = (math::powf(4.0, 2.0 / 3.0) - 1.0).sqrt();
    assert_near(l.gain_crossovers[0].frequency, w, 1e-12);
    assert_near(l.gain_margin(false).unwrap(), 20.0 * math::log10(2.0), 1e-11);
    assert_near(l.phase_margin().unwrap(), PI - 3.0 * math::atan(w), 1e-12);
    assert_near(l.delay_margin().unwrap(), (PI - 3.0 * math::atan(w)) / w, 1e-12);
    let [of_phase, of_gain] = l.critical().unwrap().map(|crossing| crossing.unwrap().frequency);
    assert_near(of_phase, w, 1e-12);
    assert_near(of_gain, 3.0f64.sqrt(), 1e-12);
}

#[test]
fn the_critical_crossovers_are_those_of_the_margins() {
    // Several crossings of both kinds: a resonance and a delay.
    let l = loop_of(&[0.6, 0.9], &[1.0, 0.3, 4.2, 0.1], 0.05);
    assert!(l.is_stable() && l.gain_crossovers.len() > 2, "{l:?}");
    let [of_phase, of_gain] = l.critical().unwrap().map(Option::unwrap);
    assert_near(complex::arg(-of_phase.response).abs(), l.phase_margin().unwrap(), 1e-12);
    assert_near(-20.0 * math::log10(complex::norm(of_gain.response)), l.gain_margin(false).unwrap(), 1e-9);
    // A first-order lag never crosses the negative real axis.
    assert_eq!(loop_of(&[0.5], &[1.0, 1.0], 0.0).critical().unwrap(), [None, None]);
}

#[test]
fn an_unstable_loop_has_negative_margins_that_pass_zero_at_the_limit() {
    // k/(s + 1)^3 is stable up to k = 8.
    let at = |k: f64| loop_of(&[k], &[1.0, 3.0, 3.0, 1.0], 0.0);
    assert!(at(7.999).is_stable() && !at(8.001).is_stable());
    assert!(at(7.999).phase_margin().unwrap() > 0.0 && at(7.999).phase_margin().unwrap() < 1e-3);
    assert!(at(8.001).phase_margin().unwrap() < 0.0 && at(8.001).phase_margin().unwrap() > -1e-3);
    assert!(at(8.001).delay_margin().unwrap() < 0.0 && at(8.001).delay_margin().unwrap() > -1e-3);
}

#[test]
fn the_delayed_integrator_is_stable_up_to_a_quarter_turn() {
    // exp(-s T)/s: stable for T < pi/2; phase margin and delay margin are both pi/2 - T, as |L| = 1 at 1 rad/s.
    for delay in [0.1, 1.0, 1.57] {
        let l = loop_of(&[1.0], &[1.0, 0.0], delay);
        assert!(l.is_stable(), "{delay}");
        assert_near(l.phase_margin().unwrap(), 0.5 * PI - delay, 1e-12);
        assert_near(l.delay_margin().unwrap(), 0.5 * PI - delay, 1e-12);
        let first = phase_crossovers(&l)[0];
        assert_near(first.frequency, 0.5 * PI / delay, 1e-10);
        assert_near(first.response.re, -delay / (0.5 * PI), 1e-10);
    }
    assert!(!loop_of(&[1.0], &[1.0, 0.0], 1.58).is_stable());
}

#[test]
fn a_loop_may_become_stable_by_a_delay() {
    // 0.2/(s^2 - 0.1 s + 1), unstable: a delay of a few seconds shifts the phase so that the feedback damps.
    let at = |delay: f64| loop_of(&[0.2], &[1.0, -0.1, 1.0], delay).is_stable();
    let found: Vec<bool> = [0.0, 2.0, 4.5, 7.0].iter().map(|&d| at(d)).collect();
    // Count of encirclements on a fine grid.
    let counted: Vec<bool> = [0.0, 2.0, 4.5, 7.0].iter().map(|&d| encirclements(d) == -2).collect();
    assert_eq!(found, counted);
    assert!(found.contains(&true) && found.contains(&false), "{found:?}");
}

/// Returns the clockwise encirclements of -1 by `0.2 exp(-s T)/(s^2 - 0.1 s + 1)`, whose two poles are unstable.
fn encirclements(delay: f64) -> i32 {
    let l = |w: f64| {
        let s = Complex::new(0.0, w);
        complex::exp(-s * delay) * 0.2 / (s * s - s * 0.1 + 1.0)
    };
    let points = (-400_000..400_000).map(|i| l(f64::from(i) * 1e-3) + 1.0);
    let mut turn = 0.0;
    let mut last: Option<Complex> = None;
    for p in points {
        turn -= last.map_or(0.0, |last| complex::arg(p / last));
        last = Some(p);
    }
    (turn / TAU).round() as i32
}

#[test]
fn peaks_have_their_closed_form() {
    // L = w^2/(s (s + 2 z w)): T is the second-order system, Mt = 1/(2 z sqrt(1 - z^2)).
    let (z, w) = (0.3, 2.0);
    let l = loop_of(&[w * w], &[1.0, 2.0 * z * w, 0.0], 0.0);
    assert_near(l.peak_complementary().unwrap(), 1.0 / (2.0 * z * f64::sqrt(1.0 - z * z)), 1e-9);
    // |S|^2 = x (x + 4 z^2)/((1 - x)^2 + 4 z^2 x) with x = (w/w0)^2.
    let s2 = |x: f64| x * (x + 4.0 * z * z) / ((1.0 - x) * (1.0 - x) + 4.0 * z * z * x);
    assert_near(l.peak_sensitivity().unwrap(), s2(maximise(s2, 0.5, 3.0)).sqrt(), 1e-9);
}

#[test]
fn an_unstable_plant_may_lose_less_gain_than_it_may_gain() {
    // 2 (s + 3)/((s - 1)(s + 10)): -0.6 at frequency 0, so unstable; with the gain 4 it is -1.2 and stable.
    let at = |k: f64| loop_of(&[k, 3.0 * k], &[1.0, 9.0, -10.0], 0.0);
    assert!(!at(2.0).is_stable() && at(4.0).is_stable());
    assert_near(at(4.0).gain_margin(true).unwrap(), 20.0 * math::log10(1.2), 1e-11);
    assert_eq!(at(4.0).gain_margin(false).unwrap(), f64::INFINITY);
    assert_near(at(2.0).gain_margin(false).unwrap(), 20.0 * math::log10(0.6), 1e-11);
}

#[test]
fn the_bandwidth_has_its_closed_form_with_and_without_delay() {
    // 1/(T s + 1): 1/T. The closed loop of an integrator k/s: k.
    let lag = TransferFunction::new(vec![3.0], vec![0.5, 1.0]).state_space().unwrap();
    assert_near(bandwidth(&lag).unwrap(), 2.0, 1e-12);
    assert_near(loop_of(&[7.0], &[1.0, 0.0], 0.0).closed_loop_bandwidth().unwrap(), 7.0, 1e-11);
    // k exp(-s T)/s: |j w exp(j w T) + k|^2 = 2 k^2, that is w^2 - 2 k w sin(w T) = k^2.
    let w = loop_of(&[1.0], &[1.0, 0.0], 0.3).closed_loop_bandwidth().unwrap();
    assert_near(w * w - 2.0 * w * math::sin(0.3 * w), 1.0, 1e-9);
    let lead = TransferFunction::new(vec![2.0, 1.0], vec![1.0, 1.0]).state_space().unwrap();
    assert!(bandwidth(&lead).unwrap_err().contains("never"));
}

#[test]
fn a_vanishing_delay_changes_no_peak() {
    let with = |delay| loop_of(&[4.0], &[1.0, 3.0, 3.0, 1.0], delay);
    for of in [Loop::peak_sensitivity, Loop::peak_complementary] {
        let (exact, late) = (of(&with(0.0)).unwrap(), of(&with(1e-9)).unwrap());
        assert_near(late, exact, 1e-6);
    }
    assert!(loop_of(&[9.0], &[1.0, 3.0, 3.0, 1.0], 0.0).peak_sensitivity().is_err());
}

#[test]
fn a_loop_that_never_reaches_gain_one_has_no_finite_margin() {
    let l = loop_of(&[0.5], &[1.0, 1.0], 0.2);
    assert_eq!((l.phase_margin().unwrap(), l.delay_margin().unwrap()), (f64::INFINITY, f64::INFINITY));
}

/// Returns the lowest gain at which `k exp(-s T)/(s + 1)` is unstable, where `w T + atan w = pi`, by bisection.
fn limit_of_lag(delay: f64) -> f64 {
    let (mut low, mut high) = (0.0, PI / delay);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle * delay + math::atan(middle) < PI { low = middle } else { high = middle }
    }
    math::hypot(1.0, low)
}

#[test]
fn the_margins_of_an_unstable_loop_restore_stability_whatever_lies_between() {
    // A lag with ten different delays, up to gains with many crossings. From the limit on, the gain margin is minus the
    // distance in dB, and the phase margin falls too.
    for delay in [0.05, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 30.0, 100.0] {
        let limit = limit_of_lag(delay);
        let mut last = (0.0, 0.0);
        for i in 1..40 {
            let excess = math::powi(1.12, i);
            let l = loop_of(&[limit * excess], &[1.0, 1.0], delay);
            let (gain, phase) = (l.gain_margin(false).unwrap(), l.phase_margin().unwrap());
            assert_near(gain, -20.0 * math::log10(excess), 1e-9);
            assert!(gain < last.0 && phase < last.1, "{delay} {excess}: {phase} after {}", last.1);
            // The lead that turns the crossover from its delayed angle back to -1.
            let w = math::powi(limit * excess, 2) - 1.0;
            let w = w.sqrt();
            assert_near(phase, PI - w * delay - math::atan(w), 1e-8 * (1.0 + w * delay));
            last = (gain, phase);
        }
    }
}

#[test]
fn a_conditionally_stable_loop_has_the_margin_to_the_nearer_of_its_limits() {
    // k (s + 1)^2/s^3 is stable for k > 1/2. A further lag (0.01 s + 1)^2 adds an upper limit.
    let above = |k: f64| loop_of(&[k, 2.0 * k, k], &[1.0, 0.0, 0.0, 0.0], 0.0);
    for k in [0.499, 0.3, 0.1, 0.01, 1e-4] {
        assert_near(above(k).gain_margin(false).unwrap(), 20.0 * math::log10(k / 0.5), 1e-9);
    }
    for k in [0.501, 1.0, 50.0] {
        assert_near(above(k).gain_margin(true).unwrap(), 20.0 * math::log10(k / 0.5), 1e-9);
    }
    let between = |k: f64| loop_of(&[k, 2.0 * k, k], &[1e-4, 0.02, 1.0, 0.0, 0.0, 0.0], 0.0);
    let (least, most) = (0.520_781_340_206_577, 192.019_168_659_793);
    assert!(between(least * 1.000_01).is_stable() && !between(least * 0.999_99).is_stable());
    assert!(between(most * 0.999_99).is_stable() && !between(most * 1.000_01).is_stable());
    assert_near(between(0.1).gain_margin(false).unwrap(), 20.0 * math::log10(0.1 / least), 1e-9);
    assert_near(between(1e3).gain_margin(false).unwrap(), -20.0 * math::log10(1e3 / most), 1e-9);
}

#[test]
fn margins_of_loops_that_cannot_be_stabilised_are_refused() {
    // Two unstable poles and no zero: k/(s - 1)^2. A real unstable pole: no phase shift removes it.
    let never = loop_of(&[3.0], &[1.0, -2.0, 1.0], 0.0);
    assert!(never.gain_margin(false).unwrap_err().contains("no gain change"));
    let slow = loop_of(&[0.5], &[1.0, -1.0], 0.1);
    assert!(slow.phase_margin().unwrap_err().contains("no phase shift"));
    assert!(slow.delay_margin().unwrap_err().contains("no delay"));
    assert_near(slow.gain_margin(false).unwrap(), -20.0 * math::log10(2.0), 1e-9);
}

#[test]
fn with_a_delay_the_complementary_sensitivity_is_one_at_frequency_zero_whatever_the_gain() {
    // k exp(-s T)/(s (s + 1)): T is 1 at frequency 0. The gain margin has a closed form for an integrator with delay.
    for (k, delay) in [(1e-1, 1.0), (1e-2, 1.0), (1e-3, 0.1), (1e-4, 10.0), (1e-6, 1.0), (1e-9, 1.0), (1e-3, 1e-3)] {
        let l = loop_of(&[k], &[1.0, 1.0, 0.0], delay);
        assert_near(l.peak_complementary().unwrap(), 1.0, 1e-12);
        let integrator = loop_of(&[k], &[1.0, 0.0], delay);
        assert_near(integrator.peak_complementary().unwrap(), 1.0, 1e-12);
        assert_near(integrator.gain_margin(false).unwrap(), 20.0 * math::log10(0.5 * PI / (k * delay)), 1e-8);
    }
    // Without an integrator T is k/(1 + k) at frequency 0.
    for k in [0.5, 1e-2, 1e-5] {
        assert_near(loop_of(&[k], &[1.0, 1.0], 0.3).peak_complementary().unwrap(), k / (1.0 + k), 1e-12);
    }
}

#[test]
fn a_loop_of_gain_alone_and_one_of_nothing_have_margins() {
    let l = |k: f64, delay: f64| loop_of(&[k], &[1.0], delay);
    assert_near(l(0.5, 1.0).gain_margin(false).unwrap(), 20.0 * math::log10(2.0), 1e-12);
    assert_near(l(0.5, 1.0).peak_sensitivity().unwrap(), 2.0, 1e-12);
    assert_eq!(l(0.5, 0.0).gain_margin(false).unwrap(), f64::INFINITY);
    assert!(!l(2.0, 1.0).is_stable());
    assert_near(l(2.0, 1.0).gain_margin(false).unwrap(), -20.0 * math::log10(2.0), 1e-12);
    let none = loop_of(&[0.0], &[1.0, 1.0], 0.1);
    assert_eq!((none.gain_margin(true).unwrap(), none.phase_margin().unwrap()), (f64::INFINITY, f64::INFINITY));
    assert_eq!((none.peak_sensitivity().unwrap(), none.peak_complementary().unwrap()), (1.0, 0.0));
}

#[test]
fn undamped_and_lightly_damped_loops_are_searched_in_little_time() {
    // A double integrator, a resonance of damping 1e-7 with a delay, all-pass gain: none of them exhausts the search.
    let double = loop_of(&[1.0], &[1.0, 0.0, 0.0], 0.1);
    assert!(!double.is_stable() && double.gain_margin(false).is_err());
    let sharp = loop_of(&[1e-9], &[1.0, 2e-7, 1.0, 0.0], 0.3);
    assert!(sharp.is_stable() && sharp.peak_sensitivity().unwrap() >= 1.0);
    let all_pass = loop_of(&[-0.5, 0.5], &[1.0, 1.0], 0.5);
    assert!(all_pass.is_stable() && all_pass.gain_margin(false).unwrap() > 0.0);
}

/// Checks the frequencies at which the search splits the axis: corners, and powers of ten relative to them.
#[test]
fn what_happens_at_a_corner_is_found() {
    let mut stream = mops_math::stream(7, "corners");
    let mut corners = vec![0.1, 0.5, 1.0, 2.0, 10.0, 1.0 / 3.0, 51.0, 2_127.659_574_468_085];
    corners.extend((0..200).map(|_| math::powf(10.0, rand::Rng::random_range(&mut stream, -3.0..4.0))));
    for a in corners {
        let system = |numerator: &[f64], denominator: &[f64]| loop_of(numerator, denominator, 0.0).system;
        let crossover = |l: &Loop| l.gain_crossovers.iter().map(|c| c.frequency).collect::<Vec<_>>();
        assert_near(bandwidth(&system(&[a], &[1.0, a])).unwrap(), a, 1e-12 * a);
        assert_near(bandwidth(&system(&[1.0], &[1.0 / a, 1.0])).unwrap(), a, 1e-12 * a);
        let butterworth = [1.0, 2.0f64.sqrt() * a, a * a];
        assert_near(bandwidth(&system(&[a * a], &butterworth)).unwrap(), a, 1e-10 * a);
        assert_near(loop_of(&[a], &[1.0, 0.0], 0.0).closed_loop_bandwidth().unwrap(), a, 1e-12 * a);
        // sqrt(2) a/(s + a) and sqrt(2) a^2/(s (s + a)) have gain 1 at a, and a phase of -45 and -135 degrees.
        let lag = loop_of(&[2.0f64.sqrt() * a], &[1.0, a], 0.0);
        assert_near(crossover(&lag)[0], a, 1e-12 * a);
        assert_near(lag.phase_margin().unwrap(), 0.75 * PI, 1e-12);
        let servo = loop_of(&[2.0f64.sqrt() * a * a], &[1.0, a, 0.0], 0.0);
        assert_near(crossover(&servo)[0], a, 1e-12 * a);
        assert_near(servo.phase_margin().unwrap(), 0.25 * PI, 1e-12);
        assert_near(servo.delay_margin().unwrap(), 0.25 * PI / a, 1e-12 / a);
        assert_near(crossover(&loop_of(&[a * a], &[1.0, 0.0, 0.0], 0.0))[0], a, 1e-12 * a);
        // K/(s (s^2 + 0.8 a s + a^2)) is real at a, with the value -K/(0.8 a^3).
        let resonant = loop_of(&[0.4 * a * a * a], &[1.0, 0.8 * a, a * a, 0.0], 0.0);
        assert_near(resonant.gain_margin(false).unwrap(), 20.0 * math::log10(2.0), 1e-9);
    }
}

/// Checks two free masses coupled by a spring and a damper, driven and measured (position and speed) at the first.
#[test]
fn loops_around_free_masses_have_the_margins_of_their_transfer_function() {
    let mut stream = mops_math::stream(11, "masses");
    for _ in 0..100 {
        let mut of = |low: f64, high: f64| math::powf(10.0, rand::Rng::random_range(&mut stream, low..high));
        let ([m, n], [k, d], [gain, lead]) =
            ([of(-1.0, 1.0), of(-1.0, 1.0)], [of(1.0, 5.0), of(-2.0, 1.0)], [of(-1.0, 1.0), of(-1.0, 1.0)]);
        let a = nalgebra::DMatrix::from_row_slice(
            4,
            4,
            &[0.0, 1.0, 0.0, 0.0, -k / m, -d / m, k / m, d / m, 0.0, 0.0, 0.0, 1.0, k / n, d / n, -k / n, -d / n],
        );
        let b = nalgebra::DMatrix::from_row_slice(4, 1, &[0.0, gain / m, 0.0, 0.0]);
        let c = nalgebra::DMatrix::from_row_slice(1, 4, &[1.0, lead, 0.0, 0.0]);
        let free = Loop::new(StateSpace::new(a, b, c, nalgebra::DMatrix::zeros(1, 1))).unwrap();
        // gain (1 + lead s)(n s^2 + d s + k)/(s^2 (m n s^2 + (m + n)(d s + k))).
        let numerator = [lead * n, n + lead * d, d + lead * k, k].map(|x| gain * x);
        let same = loop_of(&numerator, &[m * n, (m + n) * d, (m + n) * k, 0.0, 0.0], 0.0);
        assert_eq!(free.is_stable(), same.is_stable());
        let margins =
            |l: &Loop| [l.phase_margin().unwrap(), l.delay_margin().unwrap(), l.peak_sensitivity().unwrap_or(0.0)];
        for (found, expected) in margins(&free).into_iter().zip(margins(&same)) {
            assert_near(found, expected, 1e-6 * expected.abs());
        }
    }
}
