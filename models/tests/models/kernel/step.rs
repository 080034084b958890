//! Tests of the accepted step and its dense output.

use mops_core::{Instant, Plant};
use mops_language::enclosure::Interval;
use mops_models::kernel::{Driven, Sink, Step, Tolerance, integrate};

/// Quartic polynomial of the time from 2 s to 2.5 s, which the dense output contains exactly:
/// `r0 + s (r1 + (1 - s)(r2 + s (r3 + (1 - s) r4)))` with `s = (t - 2)/0.5`.
struct Quartic;

impl Plant<f64> for Quartic {
    fn start(&self) -> Vec<f64> {
        vec![1.0]
    }
    fn rates(&self, at: &Instant<'_, f64>, dx: &mut [f64]) {
        // In powers of s, with the coefficients 1, -2, 3, 0.5, -4: 1 + s - 6.5 s^2 + 7.5 s^3 - 4 s^4.
        let s = (at.t - 2.0) / 0.5;
        dx[0] = (1.0 + s * (-13.0 + s * (22.5 - s * 16.0))) / 0.5;
    }
}

/// Compares the bounds over parts of each step with values there, and keeps the longest step.
#[derive(Default)]
struct Enclosed {
    longest: f64,
}

impl<P: ?Sized> Sink<f64, P> for Enclosed {
    fn step(&mut self, step: &Step<f64>, _: &Driven<'_, f64, P>) {
        self.longest = self.longest.max(step.taken);
        let mut bounds = Vec::new();
        let at = |theta: f64| step.state_at(theta)[0];
        for (from, to) in [(0.0, 1.0), (0.2, 0.3), (0.7, 1.0)] {
            step.enclose(from, to, &mut bounds);
            for k in 0..=20 {
                let theta = from + (to - from) * f64::from(k) / 20.0;
                let slope = (at(theta + 1e-6) - at(theta - 1e-6)) / (2e-6 * step.length);
                let wider = |i: Interval| (i.low - 1e-7, i.high + 1e-7);
                let (value, rate) = (wider(bounds[0].value), wider(bounds[0].rate));
                assert!(value.0 <= at(theta) && at(theta) <= value.1, "{bounds:?} {theta}");
                assert!(rate.0 <= slope && slope <= rate.1, "{bounds:?} {theta} {slope}");
            }
        }
    }
}

#[test]
fn bounds_enclose_the_dense_output_and_its_derivative() {
    let mut enclosed = Enclosed::default();
    let (x, _) = integrate(&mut Driven::alone(Quartic), 2.0, 2.5, &[1.0], &Tolerance::DEFAULT, &mut enclosed).unwrap();
    assert!((x[0] + 1.0).abs() < 1e-12 && enclosed.longest > 0.25, "{x:?} {}", enclosed.longest);
}
