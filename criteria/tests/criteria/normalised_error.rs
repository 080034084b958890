//! Tests of the fit to a measurement, in units of its noise level.

use mops_core::criterion::Loss;
use mops_criteria::normalised_error::NormalisedError;

use crate::testing::{assert_near, assert_slope, bound, measured, quantity, simulated, undefined_in, value_in};

fn error(noise: Option<&str>) -> NormalisedError {
    NormalisedError { signal: "y".into(), noise: noise.map(quantity), ..NormalisedError::default() }
}

#[test]
fn differences_as_large_as_the_noise_give_one() {
    let case = measured(&[0.0, 1.0, 2.0, 3.0], &[0.1, 0.9, 2.1, 2.9], Some(0.1));
    let value = value_in(&case, &error(None), &simulated(3.0, |t| t));
    assert_near(value.number, 1.0, 1e-12);
    assert_near(value.residuals[1], 0.5, 1e-12);
    let samples = bound(&error(None)).samples(&case).unwrap();
    assert_eq!((samples.weights, samples.noise), (vec![5.0; 4], Some(0.1)));
    let option = value_in(&case, &error(Some("20 cm")), &simulated(3.0, |t| t));
    assert_near(option.number, 0.25, 1e-12);
}

#[test]
fn an_outlier_counts_less_with_a_robust_loss() {
    let case = measured(&[0.0, 1.0, 2.0, 3.0], &[0.1, 0.9, 2.1, 103.0], Some(0.1));
    let of = |loss: Loss| value_in(&case, &NormalisedError { loss, ..error(None) }, &simulated(3.0, |t| t)).number;
    assert!(of(Loss::Squares) > 2e5 && of(Loss::Huber) < 700.0 && of(Loss::Student) < 20.0);
}

#[test]
fn without_a_noise_there_is_no_value() {
    let why = undefined_in(&measured(&[0.0, 1.0], &[0.0, 1.0], None), &error(None), &simulated(1.0, |t| t));
    assert_eq!(why, "the noise level of `y` is unknown");
}

#[test]
fn slopes_of_all_losses_are_those_of_the_values() {
    // Differences of 0.2, 3 and 12 noises.
    let case = measured(&[0.5, 1.0, 2.0], &[0.39, 0.93, 2.06], Some(0.1));
    for loss in [Loss::Squares, Loss::Huber, Loss::Student] {
        assert_slope(&case, &NormalisedError { loss, ..error(None) }, 2.0);
    }
}

#[test]
fn a_residual_far_below_the_noise_is_noted() {
    let times: Vec<f64> = (0..20).map(f64::from).collect();
    let off = |by: f64| measured(&times, &times.iter().map(|t| t + by).collect::<Vec<_>>(), Some(1.0));
    let note = |case| value_in(&case, &error(None), &simulated(19.0, |t| t)).note;
    assert_eq!(note(off(0.09)), Some("far below the noise: check the unit of `noise`"));
    assert_eq!(note(off(0.11)), None);
    // Fewer samples may be that close by chance.
    assert_eq!(note(measured(&[0.0, 1.0], &[0.0, 1.0], Some(1.0))), None);
}
