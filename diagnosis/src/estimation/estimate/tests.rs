//! Estimates under error models, on data that the tests compute themselves.

use mops_math as math;

use super::*;
use crate::estimation::priors::{nominal_rates, priors};
use crate::fit::pieces::{first_locals, pieces};
use crate::fit::{Meter, Point, Variant, problem};
use crate::motion::Trajectory;
use crate::records::Subject;
use crate::testing::{Record, integrated, subject};

const OSCILLATOR: &str = r#"
states     = { x = "m", v = "m/s" }
parameters = { d = "N s/m", k = "N/m" }
der        = { x = "v", v = "1 [kg]*v' = -d*v - k*x" }
"#;

const PENDULUM: &str = r#"
states     = { x = "rad", v = "rad/s" }
parameters = { d = "N m s/rad", k = "N m" }
der        = { x = "v", v = "1 [kg m2]*v' = -d*v - k*sin(x)" }
"#;

/// Parameters `d`, `k`, then the initial state.
const TRUTH: [f64; 4] = [0.3, 4.0, 1.0, 0.0];

const NOISE: f64 = 1e-3;

/// Oscillator or pendulum under a force, measured with white noise.
fn measured(text: &str, spring: fn(f64) -> f64, force: impl Fn(f64) -> f64) -> Subject {
    let [d, k, x, v] = TRUTH;
    let rates = |t: f64, s: &[f64; 2]| [s[1], force(t) - d * s[1] - k * spring(s[0])];
    let states = integrated(rates, [x, v], 0.05, 400);
    subject(text, &TRUTH, 2, vec![Record::of_first("x", &states, 0.05, NOISE, "estimates")])
}

/// Calls `test` with the estimation of a subject and the least-squares point.
fn estimate(subject: &Subject, test: impl Fn(&Estimation<'_>, &Point)) {
    let simulations = Meter::new(&());
    let pieces = pieces(subject, |_| true);
    let locals = first_locals(&pieces);
    let (fit, point, variant): (Fit<'_>, Point, Variant) =
        problem(subject, &[], pieces, &subject.start(), locals, &[], &simulations);
    let along = |piece: usize| Trajectory::new(&fit, &variant.model, piece, &point).expect("it simulates");
    let trajectories: Vec<Trajectory> = (0..fit.pieces.len()).map(along).collect();
    let estimation = Estimation {
        fit: &fit,
        model: &variant.model,
        channels: Channels::new(&fit.pieces),
        nominal: nominal_rates(&variant, &trajectories),
        priors: priors(subject, &fit, &variant, &[], &point),
        log_choices: 0.0,
    };
    test(&estimation, &estimation.least_squares(point).expect("it simulates").point);
}

#[test]
fn under_white_noise_all_error_models_agree_with_least_squares() {
    let subject = measured(OSCILLATOR, |x| x, |_| 0.0);
    estimate(&subject, |estimation, point| {
        let slopes = estimation.fit.slopes(point).expect("it simulates");
        let columns: Vec<DVector<f64>> = slopes[0].j.iter().map(|c| DVector::from_column_slice(c)).collect();
        let jacobian = DMatrix::from_columns(&columns);
        let covariance = (jacobian.transpose() * &jacobian).try_inverse().expect("identifiable");
        for kind in ErrorModel::ALL {
            let found = estimation.under(kind, point.clone(), None, None).expect("it simulates");
            assert!(found.converged, "{kind:?}");
            for k in 0..2 {
                let deviation = covariance[(k, k)].sqrt();
                let (value, least_squares) = (found.point.globals[k], point.globals[k]);
                assert!((value - least_squares).abs() < deviation, "{kind:?} {k}: {value} {least_squares}");
                assert!((value - TRUTH[k]).abs() < 4.0 * found.deviations[k], "{kind:?} {k}: {value}");
                let ratio = found.deviations[k] / deviation;
                assert!((0.8..1.5).contains(&ratio), "{kind:?} {k}: {ratio}");
            }
        }
    });
}

#[test]
fn an_unknown_force_is_found_and_parameters_keep_their_intervals() {
    let force = |t: f64| 0.3 * math::sin(1.3 * t);
    let subject = measured(OSCILLATOR, |x| x, force);
    estimate(&subject, |estimation, point| {
        let found = estimation.under(ErrorModel::Force, point.clone(), None, None).expect("it simulates");
        let output = estimation.under(ErrorModel::SmoothOutput, point.clone(), None, None).expect("it simulates");
        assert!(found.log_evidence > output.log_evidence, "{:?} {:?}", found.log_evidence, output.log_evidence);
        for k in 0..2 {
            let (value, deviation) = (found.point.globals[k], found.deviations[k]);
            assert!((value - TRUTH[k]).abs() < 4.0 * deviation, "{k}: {value} +- {deviation}");
        }
    });
}

#[test]
fn the_smoothed_force_is_the_force_that_acted() {
    let force = |t: f64| 0.3 * math::sin(1.3 * t);
    let subject = measured(OSCILLATOR, |x| x, force);
    estimate(&subject, |estimation, _| {
        let point = Point { globals: TRUTH[..2].to_vec(), locals: vec![TRUTH[2..].to_vec()] };
        let mut fit = estimation.fit.clone();
        let free = estimation.motions(&mut fit, &point, None).expect("it simulates");
        let error = ForceError { deviation: 0.2 / estimation.nominal[0], length: 2.0, noise: vec![1.0] };
        let motions = estimation.motions(&mut fit, &point, Some(&Errors::Force(error, free))).expect("it simulates");
        let (mut missed, mut size) = (0.0, 0.0);
        for (k, &t) in motions[0].linearised.times.iter().enumerate() {
            // The force is kept from sample to sample: on average its value half a step later.
            let (estimated, exact) = (motions[0].forces[k] * estimation.nominal[0], force(t + 0.025));
            missed += math::powi(estimated - exact, 2);
            size += exact * exact;
        }
        assert!(missed < 0.01 * size, "{missed} {size}");
    });
}

#[test]
fn a_linear_plant_needs_no_second_linearisation() {
    let subject = measured(OSCILLATOR, |x| x, |t| 0.3 * math::sin(1.3 * t));
    estimate(&subject, |estimation, point| {
        let found = estimation.under(ErrorModel::Force, point.clone(), None, None).expect("it simulates");
        let mut fit = estimation.fit.clone();
        let without = fit.all(&found.point).expect("it simulates");
        let motions = estimation.motions(&mut fit, &found.point, Some(&found.errors)).expect("it simulates");
        let with = fit.all(&found.point).expect("it simulates");
        let size = motions[0].response.iter().fold(0.0_f64, |most, r| most.max(r.abs()));
        assert!(size > 30.0, "{size}");
        for ((with, without), response) in with[0].iter().zip(&without[0]).zip(&motions[0].response) {
            assert!((with - without - response).abs() < 1e-3 * size, "{with} {without} {response}");
        }
    });
}

#[test]
fn the_smoothed_motion_of_a_nonlinear_plant_follows_the_measurement() {
    let subject = measured(PENDULUM, math::sin, |t| 0.8 * math::sin(1.3 * t));
    estimate(&subject, |estimation, _| {
        let point = Point { globals: TRUTH[..2].to_vec(), locals: vec![TRUTH[2..].to_vec()] };
        let error = ForceError { deviation: 2.0 / estimation.nominal[0], length: 2.0, noise: vec![1.0] };
        let mut fit = estimation.fit.clone();
        let rms = |fit: &Fit<'_>| {
            let residuals = fit.all(&point).expect("it simulates");
            (residuals[0].iter().map(|r| r * r).sum::<f64>() / 400.0).sqrt()
        };
        let free = estimation.motions(&mut fit, &point, None).expect("it simulates");
        assert!(rms(&fit) > 200.0, "{}", rms(&fit));
        estimation.motions(&mut fit, &point, Some(&Errors::Force(error, free))).expect("it simulates");
        assert!(rms(&fit) < 1.5, "{}", rms(&fit));
    });
}

#[test]
fn the_evidence_does_not_depend_on_the_scales_of_the_search() {
    let subject = measured(OSCILLATOR, |x| x, |_| 0.0);
    estimate(&subject, |estimation, point| {
        let found = estimation.under(ErrorModel::SmoothOutput, point.clone(), None, None).expect("it simulates");
        let mut fit = estimation.fit.clone();
        fit.globals.iter_mut().for_each(|global| global.scale *= 7.0);
        let scaled = Estimation {
            fit: &fit,
            model: estimation.model,
            channels: estimation.channels.clone(),
            nominal: estimation.nominal.clone(),
            priors: estimation.priors.clone(),
            log_choices: 0.0,
        };
        let again = scaled.under(ErrorModel::SmoothOutput, point.clone(), None, None).expect("it simulates");
        let (a, b) = (found.log_evidence.expect("finite"), again.log_evidence.expect("finite"));
        assert!((a - b).abs() < 1e-2, "{a} {b}");
    });
}

/// Returns the coordinate of the largest free curve on the declared model, with its gain, under each error model.
fn largest_curves(subject: &Subject) -> Vec<(String, f64)> {
    let found = std::cell::RefCell::new(Vec::new());
    estimate(subject, |estimation, point| {
        for kind in ErrorModel::ALL {
            let estimate = estimation.under(kind, point.clone(), None, None).expect("it simulates");
            let curves = estimation.curves(&estimate).expect("it simulates");
            found.borrow_mut().push((curves[0].to_string(), curves[0].gain));
        }
    });
    found.into_inner()
}

/// Gain in nats from which a curve counts.
const FIRES: f64 = 6.0;

#[test]
fn no_free_curve_gains_where_nothing_is_missing() {
    for (coordinate, gain) in largest_curves(&measured(OSCILLATOR, |x| x, |_| 0.0)) {
        assert!(gain < FIRES, "{coordinate} {gain}");
    }
}

#[test]
fn the_free_curve_of_a_hardening_spring_is_over_the_position() {
    for (coordinate, gain) in largest_curves(&measured(OSCILLATOR, |x| x + 0.3 * x * x * x, |_| 0.0)) {
        assert!(coordinate == "position at joint:x" && gain > FIRES, "{coordinate} {gain}");
    }
}

#[test]
fn the_free_curve_of_a_drag_is_over_the_speed() {
    let [d, k, x, v] = TRUTH;
    let rates = |_: f64, s: &[f64; 2]| [s[1], -d * s[1] - 0.2 * s[1] * s[1].abs() - k * s[0]];
    let states = integrated(rates, [x, v], 0.05, 400);
    let subject = subject(OSCILLATOR, &TRUTH, 2, vec![Record::of_first("x", &states, 0.05, NOISE, "estimates")]);
    for (coordinate, gain) in largest_curves(&subject) {
        assert!(coordinate == "speed at joint:x" && gain > FIRES, "{coordinate} {gain}");
    }
}

#[test]
fn a_gain_of_the_input_does_not_stand_for_a_missing_force() {
    // With all parameters free, the whole plant can be scaled with its input: a carriage with a drag that the model
    // lacks.
    const CARRIAGE: &str = r#"
    states     = { x = "m", v = "m/s" }
    inputs     = { u = "N" }
    parameters = { m = "kg", d = "N s/m" }
    der        = { x = "v", v = "m*v' = u - d*v" }
    "#;
    let times: Vec<f64> = (0..400).map(|k| f64::from(k) * 0.05).collect();
    let force = |t: f64| 3.0 * math::sin(0.9 * t) + 2.0 * math::sin(2.3 * t);
    let values: Vec<f64> = times.iter().map(|&t| force(t + 0.025)).collect();
    let fixed = values.clone();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let rates =
        move |t: f64, s: &[f64; 2]| [s[1], (fixed[(t / 0.05) as usize] - 0.5 * s[1] - 0.4 * s[1] * s[1].abs()) / 2.0];
    let states = integrated(rates, [0.0, 0.0], 0.05, 400);
    let input = Input::Sampled { times, values, hold: Hold::Zero };
    let record = Record { inputs: vec![("u", input)], ..Record::of_first("x", &states, 0.05, NOISE, "carriage") };
    let subject = subject(CARRIAGE, &[2.0, 0.5, 0.0, 0.0], 2, vec![record]);
    for (coordinate, gain) in largest_curves(&subject) {
        assert!(coordinate == "speed at joint:x" && gain > FIRES, "{coordinate} {gain}");
    }
}
