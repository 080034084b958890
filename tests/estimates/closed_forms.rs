//! Standard errors, profiles and bootstrap replicates against closed forms of linear models and of an exponential
//! decay.

use mops::{
    CriterionBuilder, TunerBuilder,
    core::task::{Chosen, UncertaintyTask},
};
use mops_math as math;
use nalgebra::{DMatrix, DVector};

use super::models::{Calibration, Channel, Curve, fit, lines, normalised, parameters, words};

/// Samples of one record: derivatives with respect to the parameters, weights of squared residuals, and the standard
/// deviation of the noise.
pub struct Samples {
    pub slopes: Vec<Vec<f64>>,
    pub weights: Vec<f64>,
    pub noise: f64,
}

/// Standard deviation of the weighted least-squares estimate `theta = (sum w x x')^-1 sum w x y` of a linear model.
pub fn scatter(records: &[Samples]) -> Vec<f64> {
    let n = records[0].slopes[0].len();
    let (mut a, mut b) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    for record in records {
        for (slopes, weight) in record.slopes.iter().zip(&record.weights) {
            let x = DVector::from_column_slice(slopes);
            a += *weight * &x * x.transpose();
            b += math::powi(weight * record.noise, 2) * &x * x.transpose();
        }
    }
    let inverse = a.try_inverse().unwrap();
    (&inverse * b * &inverse).diagonal().iter().map(|v| v.sqrt()).collect()
}

/// Weights of a fit: half the interval from the previous to the next sample.
fn intervals(times: &[f64]) -> Vec<f64> {
    let last = times.len() - 1;
    (0..=last).map(|i| 0.5 * (times[(i + 1).min(last)] - times[i.saturating_sub(1)])).collect()
}

/// Weights of the squared deviations of a channel, given its times.
type Weights = Box<dyn Fn(&[f64]) -> Vec<f64>>;

/// Two lines with criteria, and the weights of the squared residuals of each channel.
struct Lines {
    what: &'static str,
    calibration: Calibration,
    weights: [Weights; 2],
}

fn channel(signal: &'static str, count: u32, noise: f64) -> Channel {
    Channel::new("rig", signal, count, 2.0, if signal == "y" { |t| 0.3 + 0.7 * t } else { |t| 0.7 * t - 0.2 }, noise)
}

/// `weight` over the number of samples and the square of a declared noise.
fn mean(weight: f64, declared: f64) -> Weights {
    Box::new(move |times| vec![weight / (declared * declared * times.len() as f64); times.len()])
}

fn weighted(signal: &str, weight: f64, demand: f64) -> CriterionBuilder {
    CriterionBuilder { weight, demand: Some(demand.into()), ..normalised(signal) }
}

fn neighbours() -> Vec<Lines> {
    let normal: fn() -> Vec<(&'static str, CriterionBuilder)> = || vec![("y", normalised("y")), ("z", normalised("z"))];
    let fits: fn() -> Vec<(&'static str, CriterionBuilder)> = || vec![("y", fit("y")), ("z", fit("z"))];
    let uneven = |signal| {
        let times: Vec<f64> = (0..60).map(|i| 2.0 * math::powi(f64::from(i) / 59.0, 2)).collect();
        Channel { times, ..channel(signal, 60, 0.02) }
    };
    vec![
        Lines {
            what: "equal lengths, noise as declared",
            calibration: calibration([channel("y", 60, 0.02).declared(), channel("z", 60, 0.05).declared()], normal),
            weights: [mean(1.0, 0.02), mean(1.0, 0.05)],
        },
        Lines {
            what: "1000 samples and 10",
            calibration: calibration([channel("y", 1000, 0.02).declared(), channel("z", 10, 0.02).declared()], normal),
            weights: [mean(1.0, 0.02), mean(1.0, 0.02)],
        },
        Lines {
            what: "10 samples and 990 gaps",
            calibration: calibration(
                [channel("y", 1000, 0.02).declared(), channel("z", 1000, 0.02).declared().kept(100)],
                normal,
            ),
            weights: [mean(1.0, 0.02), mean(1.0, 0.02)],
        },
        Lines {
            what: "fits of different noise that nobody declares",
            calibration: calibration([channel("y", 60, 0.002), channel("z", 60, 0.05)], fits),
            weights: [Box::new(intervals), Box::new(intervals)],
        },
        Lines {
            what: "a noise declared ten times too large",
            calibration: calibration(
                [channel("y", 60, 0.02).declared(), Channel { declared: Some(0.2), ..channel("z", 60, 0.02) }],
                normal,
            ),
            weights: [mean(1.0, 0.02), mean(1.0, 0.2)],
        },
        Lines {
            what: "a noise declared ten times too small",
            calibration: calibration(
                [Channel { declared: Some(0.002), ..channel("y", 60, 0.02) }, channel("z", 60, 0.02).declared()],
                normal,
            ),
            weights: [mean(1.0, 0.002), mean(1.0, 0.02)],
        },
        Lines {
            what: "a weight of 100",
            calibration: calibration([channel("y", 60, 0.02).declared(), channel("z", 60, 0.02).declared()], || {
                vec![("y", weighted("y", 100.0, 1.0)), ("z", normalised("z"))]
            }),
            weights: [mean(100.0, 0.02), mean(1.0, 0.02)],
        },
        Lines {
            what: "a small weight and a demand",
            calibration: calibration([channel("y", 60, 0.02).declared(), channel("z", 40, 0.02).declared()], || {
                vec![("y", weighted("y", 0.01, 1.0)), ("z", weighted("z", 1.0, 3.0))]
            }),
            weights: [mean(0.01, 0.02), mean(1.0 / 3.0, 0.02)],
        },
        Lines {
            what: "uneven times",
            calibration: calibration([uneven("y"), uneven("z")], fits),
            weights: [Box::new(intervals), Box::new(intervals)],
        },
        Lines {
            what: "two criteria on one channel",
            calibration: calibration([channel("y", 60, 0.02).declared(), channel("z", 60, 0.05).declared()], || {
                vec![("y", normalised("y")), ("again", fit("y")), ("z", normalised("z"))]
            }),
            weights: [
                Box::new(|times| intervals(times).iter().zip(mean(1.0, 0.02)(times)).map(|(a, b)| a + b).collect()),
                mean(1.0, 0.05),
            ],
        },
    ]
}

fn calibration(channels: [Channel; 2], criteria: fn() -> Vec<(&'static str, CriterionBuilder)>) -> Calibration {
    Calibration {
        model: Box::new(lines),
        tuners: ["a", "b", "slope"].map(|name| (name, TunerBuilder::new(1.0, -10.0, 10.0))).into(),
        channels: channels.into(),
        criteria: Box::new(criteria),
        uncertainty: None,
    }
}

/// Tolerance: four times the 2.5 % to which forty data sets of twenty samples determine the noise.
#[test]
fn standard_errors_equal_the_scatter_of_the_estimator_for_any_counts_and_weights() {
    const SETS: u32 = 40;
    for of in neighbours() {
        let samples = |k: usize| {
            let channel = &of.calibration.channels[k];
            let times: Vec<f64> = channel.times.iter().copied().step_by(channel.every).collect();
            let slope = |t: &f64| if k == 0 { vec![1.0, 0.0, *t] } else { vec![0.0, 1.0, *t] };
            Samples {
                slopes: times.iter().map(slope).collect(),
                weights: (of.weights[k])(&times),
                noise: channel.noise,
            }
        };
        let exact = scatter(&[samples(0), samples(1)]);
        let mut squares = [0.0; 3];
        let what = of.what;
        for seed in 0..SETS {
            let outcome = of.calibration.run(u64::from(seed));
            for (square, parameter) in squares.iter_mut().zip(parameters(&outcome)) {
                *square += math::powi(parameter.std_error, 2) / f64::from(SETS);
            }
        }
        for (square, exact) in squares.iter().zip(exact) {
            assert!((square.sqrt() / exact - 1.0).abs() < 0.1, "{what}: {} {exact}", square.sqrt());
        }
    }
}

/// The likelihood ratio of a linear model is a parabola: its interval equals that of the standard error.
#[test]
fn profiles_of_linear_models_equal_their_intervals_for_any_counts_and_weights() {
    for Lines { what, mut calibration, .. } in neighbours() {
        calibration.uncertainty = Some(UncertaintyTask { profile: Chosen::All, ..UncertaintyTask::default() });
        let outcome = calibration.run(1);
        let profiles = &outcome.found.get::<mops::tasks::calibration::UncertaintyReport>().unwrap().profiles;
        for (profile, parameter) in profiles.iter().zip(parameters(&outcome)) {
            let half = 0.5 * (parameter.interval95[1] - parameter.interval95[0]);
            let linear = profile.linear_interval.iter().zip(parameter.interval95);
            assert!(linear.into_iter().all(|(a, b)| (a - b).abs() < 1e-9), "{what}: {profile:?}");
            for (end, exact) in profile.interval.iter().zip(parameter.interval95) {
                assert!((end - exact).abs() < 5e-3 * half, "{what}: {profile:?} {parameter:?}");
            }
            assert_eq!(profile.ends, ["data", "data"]);
        }
    }
}

fn decays(count: [u32; 2], shared: bool, uncertainty: Option<UncertaintyTask>) -> Calibration {
    let short = if shared { |t: f64| math::exp(-t) } else { |t: f64| math::exp(-0.5 * t) };
    Calibration {
        model: Box::new(|| Curve::new(&["k"], |p, t| math::exp(-p[0] * t)).into()),
        tuners: vec![("k", TunerBuilder { per_case: !shared, ..TunerBuilder::new(2.0, 0.1, 10.0).log() })],
        channels: vec![
            Channel::new("long", "y", count[0], 3.0, |t| math::exp(-t), 0.01).declared(),
            Channel::new("short", "y", count[1], 2.7, short, 0.01).declared(),
        ],
        criteria: Box::new(|| vec![("y", normalised("y"))]),
        uncertainty,
    }
}

/// `0.01 / |t exp(-k t)|` over the samples of each record: 0.00113 and 0.0053.
#[test]
fn a_rate_of_a_short_record_has_the_error_of_its_own_samples() {
    let outcome = decays([1000, 10], false, None).run(0);
    let exact = |channel: &Channel, k: f64| {
        0.01 / channel.times.iter().map(|t| math::powi(t * math::exp(-k * t), 2)).sum::<f64>().sqrt()
    };
    let channels = decays([1000, 10], false, None).channels;
    for (parameter, channel) in parameters(&outcome).iter().zip(&channels) {
        let exact = exact(channel, parameter.value);
        assert!((parameter.std_error / exact - 1.0).abs() < 0.07, "{parameter:?} {exact}");
    }
}

/// The mean of two means weights each of ten samples a hundredfold: 0.0057. With equal weights of all samples: 0.0011.
#[test]
fn a_shared_rate_has_the_error_of_the_estimator_and_a_note_on_equal_weights() {
    let outcome = decays([1000, 10], true, None).run(0);
    let parameter = &parameters(&outcome)[0];
    assert!((parameter.std_error / 0.0057 - 1.0).abs() < 0.1, "{parameter:?}");
    let words = words(&outcome);
    assert!(words.contains("The records have 10 to 1000 samples. With equal weight for every sample"), "{words}");
    assert!(words.contains("+- 0.0011 instead of"), "{words}");
    let even = super::models::words(&decays([100, 60], true, None).run(0));
    assert!(!even.contains("equal weight"), "{even}");
}

#[test]
fn bootstrap_errors_equal_standard_errors_for_records_of_different_length() {
    let task = UncertaintyTask { bootstrap: 300, block: Some(1), ..UncertaintyTask::default() };
    let outcome = decays([300, 12], false, Some(task)).run(0);
    let found = outcome.found.get::<mops::tasks::calibration::UncertaintyReport>().unwrap().bootstrap.as_ref().unwrap();
    for (one, parameter) in found.parameters.iter().zip(parameters(&outcome)) {
        // 300 replicates determine a standard error to 4 %.
        assert!((one.std_error / parameter.std_error - 1.0).abs() < 0.15, "{one:?} {parameter:?}");
    }
}

#[test]
fn a_declared_noise_contradicted_by_residuals_is_reported_and_ignored() {
    let of = neighbours().into_iter().find(|of| of.what == "a noise declared ten times too large").unwrap();
    let words = words(&of.calibration.run(0));
    assert!(words.contains("The residuals of `z` in `rig` show a noise level of 0.0"), "{words}");
    assert!(words.contains("not 0.200 as declared"), "{words}");
}
