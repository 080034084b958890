//! Tests of the fit to a measured frequency response.

use mops_core::case::{Experiment, ResponseData};
use mops_core::{Case, CriterionSpec};
use mops_criteria::frequency_fit::FrequencyFit;
use mops_language::Unit;
use mops_linear::Complex;
use mops_math::complex;

use crate::testing::{assert_near, channel, linear, mistake, undefined_in, value_in};

fn measured(response: impl Fn(f64) -> Complex) -> Case {
    let frequencies: Vec<f64> = (1..=20).map(|i| 0.3 * f64::from(i)).collect();
    let values = frequencies.iter().map(|&w| response(w)).map(|g| [g.re, g.im]).collect();
    let data = ResponseData { signal: "y".into(), frequencies, values, unit: None };
    Case { experiment: Some(Experiment { responses: vec![data], ..Experiment::default() }), ..Case::default() }
}

fn lag(w: f64) -> Complex {
    Complex::new(3.0, 0.0) / Complex::new(2.0, w)
}

fn fit() -> FrequencyFit {
    FrequencyFit { signal: "y".into(), ..FrequencyFit::default() }
}

#[test]
fn the_right_system_fits_exactly_and_a_gain_error_is_its_square() {
    let case = measured(lag);
    assert_near(value_in(&case, &fit(), &linear(&[3.0], &[1.0, 2.0])).number, 0.0, 1e-28);
    let off = value_in(&case, &fit(), &linear(&[3.3], &[1.0, 2.0]));
    assert_near(off.number, 0.01, 1e-14);
    assert_eq!((off.residuals.len(), off.number), (40, off.residuals.iter().map(|r| r * r).sum::<f64>()));
}

#[test]
fn a_phase_error_counts_as_much_as_one_of_the_magnitude() {
    let turned = measured(|w| lag(w) * complex::from_polar(1.0, 1e-3));
    let larger = measured(|w| lag(w) * (1.0 + 1e-3));
    let at = |case: &Case| value_in(case, &fit(), &linear(&[3.0], &[1.0, 2.0])).number;
    assert_near(at(&turned) / at(&larger), 1.0, 3e-3);
}

#[test]
fn an_absolute_deviation_has_the_unit_of_the_response_squared() {
    let absolute = FrequencyFit { absolute: true, ..fit() };
    let off = value_in(&measured(|w| lag(w) + 0.2), &absolute, &linear(&[3.0], &[1.0, 2.0]));
    assert_near(off.number, 0.04, 1e-14);
    assert_eq!(absolute.bind(&channel("V", "m")).unwrap().unit(), Unit::known("m2/V2"));
    assert_eq!(
        undefined_in(&Case::default(), &fit(), &linear(&[3.0], &[1.0, 2.0])),
        "`` does not measure the response of `y`"
    );
    assert!(mistake(&FrequencyFit { signal: "z".into(), ..fit() }).starts_with("signal: the model has no output `z`"));
}
