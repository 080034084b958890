//! Tests of the fit to a measurement: the integral of the squared residual.

use mops_core::CriterionSpec;
use mops_criteria::fit::Fit;
use mops_language::Unit;
use mops_math as math;

use crate::testing::{assert_near, assert_slope, bound, measured, mistake, simulated, undefined_in, value_in};

#[test]
fn the_fit_is_the_trapezoid_sum_and_that_of_its_residuals() {
    // Simulated minus measured: 1, -2, 3, 0.5 at 0, 1, 3, 4 s: weights 0.5, 1.5, 1.5, 0.5.
    let case = measured(&[0.0, 1.0, 3.0, 4.0], &[-1.0, 3.0, 0.0, 3.5], None);
    let fit = Fit { signal: "y".into(), weight: 2.5 };
    let value = value_in(
        &case,
        &fit,
        &simulated(4.0, |t| {
            if t < 2.0 {
                t
            } else if t < 3.5 {
                3.0
            } else {
                t
            }
        }),
    );
    assert_near(value.number, 2.5 * (0.5 + 1.5 * 4.0 + 1.5 * 9.0 + 0.5 * 0.25), 1e-12);
    assert_eq!(value.number, value.residuals.iter().map(|r| r * r).sum::<f64>());
    assert_near(value.residuals[1], -2.0 * f64::sqrt(2.5 * 1.5), 1e-12);
    let weights = bound(&fit).samples(&case).unwrap().weights;
    let differences = [1.0, -2.0, 3.0, 0.5];
    for ((residual, weight), difference) in value.residuals.iter().zip(&weights).zip(differences) {
        assert_near(*residual, weight * difference, 1e-12);
    }
    assert_eq!((bound(&fit).unit(), fit.needs_measurement()), (Unit::known("m2 s"), Some("y")));
}

#[test]
fn a_constant_offset_integrates_to_its_square_times_the_measured_time() {
    let times: Vec<f64> = (0..=300).map(|i| 0.01 * f64::from(i)).collect();
    let values: Vec<f64> = times.iter().map(|t| math::sin(*t) + 0.2).collect();
    let fit = Fit { signal: "y".into(), ..Fit::default() };
    assert_near(value_in(&measured(&times, &values, None), &fit, &simulated(3.0, math::sin)).number, 0.12, 1e-12);
}

#[test]
fn a_single_sample_and_a_weight_of_zero_are_refused() {
    let fit = Fit { signal: "y".into(), weight: 1.0 };
    let alone = undefined_in(&measured(&[1.0], &[1.0], None), &fit, &simulated(2.0, |t| t));
    assert_eq!(alone, "the measurement of `y` has a single sample, so that the integral is undefined");
    assert_eq!(mistake(&Fit { weight: 0.0, ..fit }), "weight: `weight` must be positive, not 0");
}

#[test]
fn the_slope_is_that_of_the_values() {
    let case = measured(&[0.5, 1.0, 2.0], &[0.2, 0.9, 0.7], None);
    assert_slope(&case, &Fit { signal: "y".into(), weight: 2.5 }, 2.0);
}
