//! Tuners that are local to a selection or validation experiment are estimated there.

use mops::{CriterionBuilder, Outcome, TunerBuilder, Usage, core::Role};
use mops_math as math;

use super::models::{Calibration, Channel, Curve, fit, normalised};

/// `y = exp(-k t) + 0.3 exp(-s t)`; `k` is 0.5 in the calibration record `a`, 1.5 in `b`.
fn records(role: Role, start: f64, criterion: fn(&str) -> CriterionBuilder) -> Calibration {
    let of = |name, truth| Channel::new(name, "y", 41, 4.0, truth, 0.01).declared();
    let b = of("b", |t| math::exp(-1.5 * t) + 0.3 * math::exp(-0.2 * t));
    Calibration {
        model: Box::new(|| Curve::new(&["k", "s"], |p, t| math::exp(-p[0] * t) + 0.3 * math::exp(-p[1] * t)).into()),
        tuners: vec![
            ("k", TunerBuilder { per_case: true, ..TunerBuilder::new(start, 0.1, 10.0).log() }),
            ("s", TunerBuilder::new(0.5, 0.01, 10.0).log()),
        ],
        channels: vec![of("a", |t| math::exp(-0.5 * t) + 0.3 * math::exp(-0.2 * t)), Channel { role, ..b }],
        criteria: Box::new(move || vec![("y", criterion("y"))]),
        uncertainty: None,
    }
}

fn tuner(outcome: &Outcome, name: &str) -> f64 {
    outcome.tuners.iter().find(|tuner| tuner.name == name).unwrap().value
}

fn error(outcome: &Outcome, experiment: &str) -> f64 {
    let experiments = &outcome.calibration.as_ref().unwrap().experiments;
    experiments.iter().find(|e| e.name == experiment).unwrap().channels[0].rmse
}

#[test]
fn a_local_tuner_is_estimated_from_its_own_record_for_any_initial_guess() {
    for criterion in [normalised, fit] {
        for role in [Role::Validation, Role::Selection] {
            let found: Vec<[f64; 2]> = [0.11, 0.7, 1.0, 5.0, 9.9]
                .map(|start| {
                    let outcome = records(role, start, criterion).run(0);
                    [tuner(&outcome, "b/k"), error(&outcome, "b")]
                })
                .into();
            for [k, error] in &found {
                // Five standard errors; tolerance of the noise estimated from 41 samples.
                assert!((k - 1.5).abs() < 0.1 && (error / 0.01 - 1.0).abs() < 0.4, "{role:?}: {found:?}");
                assert!((k - found[0][0]).abs() < 1e-4 && (error - found[0][1]).abs() < 1e-6, "{role:?}: {found:?}");
            }
        }
    }
}

/// Tuners that are local to a validation record change nothing else.
#[test]
fn calibrated_tuners_do_not_depend_on_validation_records() {
    let alone = {
        let mut alone = records(Role::Validation, 1.0, normalised);
        alone.channels.pop();
        alone.run(0)
    };
    let both = records(Role::Validation, 1.0, normalised).run(0);
    for name in ["a/k", "s"] {
        assert_eq!(tuner(&alone, name), tuner(&both, name));
    }
}

#[test]
fn a_local_tuner_without_effect_on_criteria_gives_no_validation_error() {
    let outcome = records(Role::Validation, 1.0, normalised).run(0);
    assert!(outcome.warnings.is_empty(), "{:?}", outcome.warnings);
    let of = |case: &str, usage: Usage| CriterionBuilder {
        cases: Some(vec![case.into()]),
        ..normalised("y").used_as(usage)
    };
    let mut calibration = records(Role::Validation, 1.0, normalised);
    calibration.criteria = Box::new(move || vec![("a", of("a", Usage::Minimise)), ("b", of("b", Usage::Monitor))]);
    let outcome = calibration.run(0);
    assert!(error(&outcome, "b").is_nan() && error(&outcome, "a").is_finite());
    let warned = outcome.warnings.iter().any(|w| w.contains("no criterion of `b` determines its local tuners `b/k`"));
    assert!(warned, "{:?}", outcome.warnings);
}
