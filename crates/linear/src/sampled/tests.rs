use std::f64::consts::PI;

use std::ops::Range;

use super::*;
use crate::testing::{assert_near, assert_same_set, c};
use crate::{Loop, Mask, Masked, bandwidth, disk_margin, eigenvalues, h2_norm, hinf_norm};

/// Lag `x' = (v - x)/1 s`, sampled by `u = -k x`: input v, output -u.
fn lag(gain: f64, clock: Clock) -> Result<StateSpace, String> {
    let system = StateSpace::new(
        DMatrix::from_row_slice(2, 2, &[-1.0, 0.0, -gain, -1.0]),
        DMatrix::from_row_slice(2, 1, &[1.0, 0.0]),
        DMatrix::from_row_slice(1, 2, &[0.0, -1.0]),
        DMatrix::zeros(1, 1),
    );
    system.sampled(&[clock], &[], true)
}

fn clock(period: f64, offset: f64, delay: f64) -> Clock {
    Clock { memory: 1..2, period, offset, delay }
}

/// Loop of an integrator and a gain, `L(z) = k T/(z - 1)`.
fn integrator(gain: f64, period: f64) -> StateSpace {
    let system = StateSpace::new(
        DMatrix::from_row_slice(2, 2, &[0.0, 0.0, -gain, -1.0]),
        DMatrix::from_row_slice(2, 1, &[1.0, 0.0]),
        DMatrix::from_row_slice(1, 2, &[0.0, -1.0]),
        DMatrix::zeros(1, 1),
    );
    system.sampled(&[clock(period, 0.0, 0.0)], &[], true).unwrap()
}

#[test]
fn a_sampled_lag_has_the_response_of_its_difference_equation() {
    for (gain, period, part) in [(3.0, 0.2, 0.0), (3.0, 0.2, 0.25), (0.7, 1.3, 0.5), (5.0, 0.01, 0.9), (2.0, 0.3, 1.0)]
    {
        let delay = part * period;
        for offset in [0.0, 0.3 * period, 7.9 * period] {
            let sampled = lag(gain, clock(period, offset, delay)).unwrap();
            let response = sampled.response().unwrap();
            let decay = |time: f64| math::exp(-time);
            for omega in [1e-3, 0.5, 1.0, 2.0 * PI / period / 3.0, 0.99 * PI / period] {
                let z = complex::exp(c(0.0, omega * period));
                // From the change of v to the next one, of which the sample sees the first part.
                let state = (1.0 - decay(period)) / (z - decay(period));
                let left = period - delay;
                let exact =
                    if delay == 0.0 { state * gain } else { (state * decay(left) + (1.0 - decay(left))) * gain / z };
                let found = response.scalar(omega);
                assert!(
                    complex::norm(found - exact) < 1e-12 * complex::norm(exact),
                    "{period} {delay} {omega}: {found} {exact}"
                );
            }
        }
    }
}

#[test]
fn the_difference_equation_is_that_of_the_zero_order_hold() {
    let sampled = lag(3.0, clock(0.2, 0.0, 0.0)).unwrap();
    let StateSpace { a, b, c: output, d, .. } = sampled.difference_equation().unwrap();
    let decay = math::exp(-0.2);
    // x, and u after the instant, which is -k times the next x.
    let exact = [decay, 0.0, -3.0 * decay, 0.0];
    assert!((a - DMatrix::from_row_slice(2, 2, &exact)).amax() < 1e-14);
    assert!((b - DMatrix::from_row_slice(2, 1, &[1.0 - decay, -3.0 * (1.0 - decay)])).amax() < 1e-14);
    assert!((output - DMatrix::from_row_slice(1, 2, &[0.0, -1.0])).amax() < 1e-14 && d.amax() < 1e-14);
}

#[test]
fn margins_of_a_sampled_integrator_have_their_closed_forms() {
    // |L| = k T/(2 sin(w T/2)) and arg L = -pi/2 - w T/2; at half of the sampling frequency L = -k T/2.
    for (gain, period) in [(1.0, 0.5), (3.0, 0.1), (0.2, 4.0), (150.0, 0.01)] {
        let system = integrator(gain, period);
        let of = Loop::new(system.clone()).unwrap();
        assert!(of.is_stable());
        let crossover = 2.0 / period * math::asin(0.5 * gain * period);
        assert_near(of.gain_crossovers[0].frequency / crossover, 1.0, 1e-11);
        let margin = 0.5 * PI - 0.5 * crossover * period;
        assert_near(of.phase_margin().unwrap() / margin, 1.0, 1e-10);
        assert_near(of.delay_margin().unwrap() / (margin / crossover), 1.0, 1e-10);
        assert_near(of.gain_margin(false).unwrap(), 20.0 * math::log10(2.0 / (gain * period)), 1e-10);
        let [_, of_gain] = of.critical().unwrap();
        assert_near(of_gain.unwrap().frequency * period, PI, 1e-12);
        // S = (z - 1)/(z - 1 + k T), largest at z = -1.
        let peak = 2.0 / (2.0 - gain * period);
        assert_near(of.peak_sensitivity().unwrap() / peak, 1.0, 1e-9);
        assert_near(disk_margin(&system, 1.0).unwrap() * peak, 1.0, 1e-9);
        let closed = system.complementary_sensitivity().unwrap();
        assert_same_set(
            &closed
                .poles()
                .unwrap()
                .iter()
                .map(|s| complex::exp(s * period))
                .filter(|z| z.norm_sqr() > 1e-9)
                .collect::<Vec<_>>(),
            &[c(1.0 - gain * period, 0.0)],
            1e-10,
        );
    }
    assert!(!Loop::new(integrator(2.1, 1.0)).unwrap().is_stable());
    let gain = Loop::new(integrator(4.0, 1.0)).unwrap().gain_margin(false).unwrap();
    assert_near(gain, -20.0 * math::log10(2.0), 1e-9);
}

#[test]
fn gains_and_bandwidths_are_those_at_the_frequencies_of_the_sampled_system() {
    // G = g/(z - a): |G(0)| = g/(1 - a); 3 dB below at (1 - a)^2 = 1/2 |z - a|^2.
    let period = 0.2f64;
    let system = lag(3.0, clock(period, 0.0, 0.0)).unwrap();
    let a = math::exp(-period);
    let cosine = (1.0 + a * a - 2.0 * (1.0 - a) * (1.0 - a)) / (2.0 * a);
    assert_near(bandwidth(&system).unwrap() / (math::acos(cosine) / period), 1.0, 1e-10);
    let peak = hinf_norm(&system).unwrap();
    assert_near(peak.gain, 3.0, 1e-9);
    // y[k+1] = a y[k] + 3 (1 - a) u[k].
    let exact = 3.0 * (1.0 - a) / (1.0 - a * a).sqrt();
    assert_near(h2_norm(&system).unwrap() / exact, 1.0, 1e-10);
    // A bound of 1 from 0.5 rad/s on is exceeded there most; above half of the sampling frequency nothing is compared.
    let mask = Mask::new(&[[0.5, 1.0], [100.0, 1.0]], true).unwrap();
    let (ratio, omega) = mask.largest_ratio(&system, Masked::System).unwrap();
    let z = complex::exp(c(0.0, 0.5 * period));
    assert_near(ratio / complex::norm((z - a).inv() * 3.0 * (1.0 - a)), 1.0, 1e-9);
    assert_near(omega, 0.5, 1e-9);
}

#[test]
fn poles_of_integrators_stay_at_one_whatever_the_period() {
    // Triple integrator.
    let mut a = DMatrix::zeros(4, 4);
    (a[(0, 1)], a[(1, 2)], a[(3, 0)], a[(3, 3)]) = (1.0, 1.0, -1.0, -1.0);
    let b = DMatrix::from_row_slice(4, 1, &[0.0, 0.0, 1.0, 0.0]);
    let system = StateSpace::new(a, b, DMatrix::from_row_slice(1, 4, &[0.0, 0.0, 0.0, -1.0]), DMatrix::zeros(1, 1));
    for period in [1e-5, 1e-3, 1.0] {
        let clock = Clock { memory: 3..4, period, offset: 0.0, delay: 0.5 * period };
        let sampled = system.sampled(&[clock], &[], true).unwrap();
        let slow = eigenvalues(&sampled.a).unwrap().iter().filter(|pole| complex::norm(**pole) == 0.0).count();
        assert_eq!(slow, 3, "{period}: {:?}", eigenvalues(&sampled.a).unwrap());
    }
}

#[test]
fn what_has_no_equivalent_is_refused() {
    let own = |a: &[f64], output: &[f64], clocks: &[Clock], is_cut: bool| {
        let n = output.len();
        let b = DMatrix::from_fn(n, 1, |i, _| if i == 0 { 1.0 } else { 0.0 });
        let system = StateSpace::new(
            DMatrix::from_row_slice(n, n, a),
            b,
            DMatrix::from_row_slice(1, n, output),
            DMatrix::zeros(1, 1),
        );
        system.sampled(clocks, &[], is_cut).unwrap_err()
    };
    let fast = |memory: Range<usize>| Clock { memory, period: 0.1, offset: 0.0, delay: 0.0 };
    let slow = |memory: Range<usize>| Clock { memory, period: 0.4, offset: 0.0, delay: 0.0 };
    let at = [-1.0, 0.0, 0.0, -2.0, -1.0, 0.0, -1.0, 0.0, -1.0];
    let found = own(&at, &[-1.0, 0.0, 0.0], &[fast(1..2), slow(2..3)], true);
    assert!(found.contains("between the instants"), "{found}");
    let found = own(&at, &[0.0, -1.0, 0.0], &[fast(1..2), slow(2..3)], true);
    assert!(found.contains("slowest clock"), "{found}");
    let found = own(&at, &[0.0, -1.0, -1.0], &[fast(1..2), slow(2..3)], true);
    assert!(found.contains("several clocks"), "{found}");
    let odd = Clock { period: 0.1 * 2f64.sqrt(), ..fast(2..3) };
    let found = own(&at, &[0.0, -1.0, -1.0], &[fast(1..2), odd], false);
    assert!(found.contains("do not meet again"), "{found}");
    // m next = -m.
    let found = own(&[-1.0, 0.0, 0.0, -2.0], &[1.0, 0.0], &[fast(1..2)], false);
    assert!(found.contains("z = -1"), "{found}");
}
