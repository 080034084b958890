//! Intervals go by the sum of squares itself: where it is no parabola, multiples of a standard error do not hold the truth.

use crate::meter::Meter;
use crate::profile::interval95;
use crate::testing::{Record, fitted, subject, white};
use mops_core::math;

/// A decay.
const DECAY: &str = r#"
states     = { x = "m" }
parameters = { k = "1/s" }
der        = { x = "-k*x" }
"#;

const NOISE: f64 = 0.15;

/// The 95 % quantile of chi-squared with one degree of freedom.
const RISE: f64 = 3.841_459;

#[test]
fn an_interval_ends_where_the_profile_of_the_sum_of_squares_does() {
    let times: Vec<f64> = (0..12).map(|k| 0.2 * f64::from(k)).collect();
    let values: Vec<f64> = times.iter().zip(white("decay", NOISE, 12)).map(|(t, e)| math::exp(-2.0 * t) + e).collect();
    // For any decay the best start value is that of a linear regression.
    let least = |k: f64| {
        let e: Vec<f64> = times.iter().map(|t| math::exp(-k * t)).collect();
        let sum = |f: &dyn Fn(usize) -> f64| (0..e.len()).map(f).sum::<f64>();
        let start = sum(&|i| e[i] * values[i]) / sum(&|i| e[i] * e[i]);
        sum(&|i| math::powi((start * e[i] - values[i]) / NOISE, 2))
    };
    let record = Record { inputs: Vec::new(), times: times.clone(), signals: vec![("x", values.clone(), NOISE)] };
    let subject = subject(DECAY, &[2.0, 1.0], 1, vec![record]);
    let simulations = Meter::new(&());
    let (fit, _, fitted, _) = fitted(&subject, &simulations);
    let (best, error) = (fitted.point.globals[0], fit.covariance(&fitted, 1.0)[(0, 0)].sqrt());
    let end = |mut inside: f64, mut outside: f64| {
        for _ in 0..60 {
            let middle = 0.5 * (inside + outside);
            if least(middle) - least(best) < RISE { inside = middle } else { outside = middle }
        }
        inside
    };
    let expected = [end(best, 0.0), end(best, 20.0)];
    let found = interval95(&fit, &fitted, 0, error, 1.0);
    let parabola = [best - 1.96 * error, best + 1.96 * error];
    let expected = [expected[0].min(parabola[0]), expected[1].max(parabola[1])];
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 0.02 * (expected - best).abs(), "{found} {expected}");
    }
    assert!(found[1] - parabola[1] > 0.1 * error, "a parabola would do: {found:?} {parabola:?}");
}
