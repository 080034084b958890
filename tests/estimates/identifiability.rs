//! Identifiability: directions are compared with the noise, not with the stiffest direction.

use mops::{
    Outcome, TunerBuilder,
    core::task::{Chosen, UncertaintyTask},
};
use mops_math as math;

use super::closed_forms::{Samples, scatter};
use super::models::{Calibration, Channel, Polynomials, normalised, parameters, words};

/// `y = stiff (a + b) t + soft (a - b)`, with the noise 0.01 and 101 samples up to 1 s; `a = b = 0.5`.
fn sum_and_difference(stiff: f64, soft: f64) -> Calibration {
    let of = move |sign: f64| [sign * soft, stiff, 0.0, 0.0, 0.0];
    let mut channel = Channel::new("e", "y", 101, 1.0, |_| 0.0, 0.01).declared();
    // The true values scale with the stiffness, which a function pointer cannot capture.
    channel.gain = stiff;
    channel.truth = |t| t;
    Calibration {
        model: Box::new(move || Polynomials::new(&["a", "b"], &[("y", vec![of(1.0), of(-1.0)])]).into()),
        tuners: vec![("a", TunerBuilder::new(0.4, -10.0, 10.0)), ("b", TunerBuilder::new(0.4, -30.0, 30.0))],
        channels: vec![channel],
        criteria: Box::new(|| vec![("y", normalised("y"))]),
        uncertainty: Some(UncertaintyTask { profile: Chosen::All, ..UncertaintyTask::default() }),
    }
}

fn rank(outcome: &Outcome) -> usize {
    outcome.calibration.as_ref().unwrap().sensitivity.as_ref().unwrap().rank
}

/// The difference is known to `0.01 / (soft |1 - t mean(t)/mean(t^2)|)`, however stiff the sum; `a` and `b` to about
/// half of it. Tolerance: three times the 7 % to which 101 samples determine the noise.
#[test]
fn a_direction_above_the_noise_is_determined_next_to_any_stiffer_one() {
    for power in 0..=6 {
        let stiff = math::powi(10.0, power);
        let outcome = sum_and_difference(stiff, 1.0).run(0);
        assert_eq!(rank(&outcome), 2, "{stiff}: {}", words(&outcome));
        assert!(words(&outcome).contains("locally identifiable"), "{}", words(&outcome));
        let slopes: Vec<Vec<f64>> =
            (0..101).map(|i| f64::from(i) / 100.0).map(|t| vec![stiff * t + 1.0, stiff * t - 1.0]).collect();
        let exact = scatter(&[Samples { weights: vec![1.0; 101], slopes, noise: 0.01 }]);
        for (parameter, exact) in parameters(&outcome).iter().zip(exact) {
            assert!((parameter.std_error / exact - 1.0).abs() < 0.25, "{stiff}: {parameter:?} {exact}");
        }
    }
}

/// Below the noise, one standard error of the difference covers the whole range of `a`.
#[test]
fn a_direction_below_the_noise_is_not_determined_and_has_no_interval() {
    for soft in [0.0, 1e-9, 3e-6, 1e-5] {
        let outcome = sum_and_difference(1e2, soft).run(0);
        let words = words(&outcome);
        assert_eq!(rank(&outcome), 1, "{soft}: {words}");
        assert!(words.contains("nly `a` + 1.00 `b` can be estimated"), "{soft}: {words}");
        let why =
            if soft < 1e-6 { "no effect along 1 direction" } else { "a change below the noise along 1 direction" };
        assert!(words.contains(why), "{soft}: {words}");
        for parameter in parameters(&outcome) {
            assert!(
                parameter.std_error.is_nan() && parameter.interval95.iter().all(|end| end.is_nan()),
                "{parameter:?}"
            );
        }
        let profiles = &outcome.found.get::<mops::tasks::calibration::UncertaintyReport>().unwrap().profiles;
        assert!(profiles.iter().flat_map(|profile| profile.linear_interval).all(|end| end.is_nan()), "{profiles:?}");
        assert_eq!(profiles[0].ends, ["bound", "bound"], "{profiles:?}");
    }
}

/// Standard errors of two to fourteen times the value.
#[test]
fn a_standard_error_above_the_value_is_called_practically_not_identifiable() {
    for soft in [1.5e-4, 5e-4, 1e-3] {
        let words = words(&sum_and_difference(1e2, soft).run(0));
        let named = words.contains("Practically not identifiable: `a` and `b` (the standard error exceeds the value");
        assert!(named && words.contains("in theory"), "{soft}: {words}");
    }
    let words = words(&sum_and_difference(1e2, 0.1).run(0));
    assert!(!words.contains("ractically"), "{words}");
}

#[test]
fn tuners_without_effect_are_not_determined() {
    let outcome = sum_and_difference(0.0, 0.0).run(0);
    assert_eq!(rank(&outcome), 0);
    let words = words(&outcome);
    assert!(words.contains("`a` has no effect") && words.contains("`b` has no effect"), "{words}");
    assert!(parameters(&outcome).iter().all(|p| p.std_error.is_nan()));
}
