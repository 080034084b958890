//! Ends of profile likelihoods that are flat up to a steep rise, compared with a fine grid.

use mops::{
    Outcome, TunerBuilder,
    core::task::{Chosen, UncertaintyTask},
    statistics::t_quantile,
    tasks::calibration::ProfileReport,
};
use mops_math as math;
use nalgebra::{DMatrix, DVector};

use super::models::{Calibration, Channel, Curve, normalised, words};

/// Number of samples, at times where the curve is exact.
const SAMPLES: u32 = 161;

fn calibration(model: Curve2, channel: Channel, tuners: Vec<(&'static str, TunerBuilder)>, of: &str) -> Calibration {
    let profile = Chosen::Some(vec![of.to_owned()]);
    Calibration {
        model: Box::new(move || Curve::new(model.0, model.1).into()),
        tuners,
        channels: vec![channel.declared()],
        criteria: Box::new(|| vec![("y", normalised("y"))]),
        uncertainty: Some(UncertaintyTask { profile, ..UncertaintyTask::default() }),
    }
}

/// Names of the parameters, and the curve.
#[derive(Clone, Copy)]
struct Curve2(&'static [&'static str], fn(&[f64], f64) -> f64);

fn profile(outcome: &Outcome) -> &ProfileReport {
    &outcome.found.get::<mops::tasks::calibration::UncertaintyReport>().unwrap().profiles[0]
}

/// Returns the range of grid values within the limit, given the smallest sum of squares for each.
fn grid(least: impl Fn(f64) -> f64, between: [f64; 2], freedom: f64) -> [f64; 2] {
    let values: Vec<f64> =
        (0..=4000).map(|i| between[0] * math::powf(between[1] / between[0], f64::from(i) / 4000.0)).collect();
    let sums: Vec<f64> = values.iter().map(|&v| least(v)).collect();
    let smallest = sums.iter().copied().fold(f64::INFINITY, f64::min);
    let limit = math::powi(t_quantile(0.975, freedom), 2) * smallest / freedom;
    let within = || values.iter().zip(&sums).filter(|(_, sum)| **sum - smallest <= limit).map(|(v, _)| *v);
    [within().next().unwrap(), within().next_back().unwrap()]
}

/// Least squares of measured values on columns.
fn least(columns: &[Vec<f64>], values: &[f64]) -> f64 {
    let x = DMatrix::from_columns(&columns.iter().map(|c| DVector::from_column_slice(c)).collect::<Vec<_>>());
    let y = DVector::from_column_slice(values);
    let solution = x.clone().svd(true, true).solve(&y, 1e-12).unwrap();
    (x * solution - y).norm_squared()
}

/// Friction of a joint, `y = scale (c tanh(k w) + v w + o)`, at speeds `w` of both signs.
struct Joint {
    what: &'static str,
    f: fn(&[f64], f64) -> f64,
    speed: fn(f64) -> f64,
    truth: fn(f64) -> f64,
    noise: f64,
    tuner: TunerBuilder,
    scale: f64,
}

/// From -2 to -1, then from 1 to 2.
fn fast(t: f64) -> f64 {
    if t < 1.0 { t - 2.0 } else { t }
}

/// From -1.05 to -0.05, then from 0.05 to 1.05.
fn slow(t: f64) -> f64 {
    if t < 1.0 { t - 1.05 } else { t - 0.95 }
}

fn joints() -> Vec<Joint> {
    let log = |start: f64, max: f64| TunerBuilder::new(start, 0.1, max).log();
    let usual = Joint {
        what: "a bound at 1e9",
        f: |p, t| p[0] * math::tanh(p[3] * fast(t)) + p[1] * fast(t) + p[2],
        speed: fast,
        truth: |t| 0.5 * math::tanh(20.0 * fast(t)) + 0.5 * fast(t),
        noise: 0.02,
        tuner: log(10.0, 1e9),
        scale: 1.0,
    };
    let with = |what, tuner| Joint { what, tuner, ..joint(&usual) };
    vec![
        joint(&usual),
        with("a bound at 1e3", log(10.0, 1e3)),
        with("started far out", log(1e5, 1e9)),
        with("started at the foot of the cliff", log(2.0, 1e6)),
        with("a linear scale", TunerBuilder::new(10.0, 0.1, 200.0)),
        Joint { what: "half the noise", noise: 0.01, ..joint(&usual) },
        Joint { what: "a tenth of the noise", noise: 0.002, ..joint(&usual) },
        Joint {
            what: "small units",
            f: |p, t| 1e-3 * (p[0] * math::tanh(p[3] * fast(t)) + p[1] * fast(t) + p[2]),
            truth: |t| 1e-3 * (0.5 * math::tanh(20.0 * fast(t)) + 0.5 * fast(t)),
            noise: 2e-5,
            scale: 1e-3,
            ..joint(&usual)
        },
        Joint { what: "a falling curve", truth: |t| 0.5 * fast(t) - 0.5 * math::tanh(20.0 * fast(t)), ..joint(&usual) },
        Joint {
            what: "low speeds, which show the slope",
            f: |p, t| p[0] * math::tanh(p[3] * slow(t)) + p[1] * slow(t) + p[2],
            speed: slow,
            truth: |t| 0.5 * math::tanh(7.0 * slow(t)) + 0.5 * slow(t),
            noise: 0.01,
            tuner: log(3.0, 1e6),
            scale: 1.0,
        },
    ]
}

fn joint(of: &Joint) -> Joint {
    let Joint { what, f, speed, truth, noise, tuner, scale } = of;
    Joint { what, f: *f, speed: *speed, truth: *truth, noise: *noise, tuner: tuner.clone(), scale: *scale }
}

/// For fixed `k` the model is linear in the other parameters.
#[test]
fn the_interval_of_the_slope_of_a_friction_curve_agrees_with_a_fine_grid() {
    for joint in joints() {
        let channel = Channel::new("e", "y", SAMPLES, 2.0, joint.truth, joint.noise);
        let tuners = vec![
            ("c", TunerBuilder::new(0.1, -5.0, 5.0)),
            ("v", TunerBuilder::new(0.1, -5.0, 5.0)),
            ("o", TunerBuilder::new(0.0, -5.0, 5.0)),
            ("k", joint.tuner.clone()),
        ];
        let values = channel.values(4);
        let bounds = [0.1, joint.tuner.max.as_ref().unwrap().number];
        let calibration = calibration(Curve2(&["c", "v", "o", "k"], joint.f), channel, tuners, "k");
        let outcome = calibration.run(4);
        let found = profile(&outcome);
        let of = |k: f64| {
            let speeds: Vec<f64> = calibration.channels[0].times.iter().map(|&t| (joint.speed)(t)).collect();
            let column = |f: &dyn Fn(f64) -> f64| -> Vec<f64> { speeds.iter().map(|&w| joint.scale * f(w)).collect() };
            least(&[column(&|w| math::tanh(k * w)), column(&|w| w), column(&|_| 1.0)], &values)
        };
        let undetermined = found.linear_interval[0].is_nan();
        let freedom = f64::from(SAMPLES) - if undetermined { 3.0 } else { 4.0 };
        let [low, high] = grid(of, bounds, freedom);
        let what = joint.what;
        assert!((found.interval[0] / low - 1.0).abs() < 0.02, "{what}: {found:?} {low} {high} {}", words(&outcome));
        assert!((found.interval[1] / high - 1.0).abs() < 0.02, "{what}: {found:?} {low} {high}");
        let ends = if high > 0.999 * bounds[1] { ["data", "bound"] } else { ["data", "data"] };
        assert_eq!(found.ends, ends, "{what}: {found:?} {low} {high}");
        assert!(low > 2.0 * bounds[0], "{what}: {low}");
    }
}

/// Only `a/b` is identifiable: `a` can decrease until `b` reaches its lower bound, and increase to its own upper bound.
#[test]
fn the_profile_of_a_factor_of_a_ratio_ends_at_the_bound_of_the_other_factor() {
    for (bounds, start) in [([0.01, 100.0], 1.0), ([0.1, 10.0], 3.0), ([1e-4, 1e4], 0.5), ([0.5, 2.0], 1.0)] {
        let channel = Channel::new("e", "y", SAMPLES, 2.0, |t| math::exp(-1.1 * t), 0.01);
        let tuner = || TunerBuilder::new(start, bounds[0], bounds[1]).log();
        let values = channel.values(1);
        let times = channel.times.clone();
        let model = Curve2(&["a", "b"], |p, t| math::exp(-p[0] / p[1] * t));
        let outcome = calibration(model, channel, vec![("a", tuner()), ("b", tuner())], "a").run(1);
        let found = profile(&outcome);
        let of = |r: f64| times.iter().zip(&values).map(|(t, y)| math::powi(math::exp(-r * t) - y, 2)).sum::<f64>();
        let [low, _] = grid(of, [0.9, 1.3], f64::from(SAMPLES) - 1.0);
        let exact = low * bounds[0];
        assert!((found.interval[0] / exact - 1.0).abs() < 0.01, "{found:?} {exact}");
        assert_eq!((found.interval[1], found.ends), (bounds[1], ["data", "bound"]));
        assert!(found.linear_interval.iter().all(|end| end.is_nan()));
    }
}

/// A stop that the motion does not reach: the sum of squares is flat above 1 and rises steeply below.
#[test]
fn a_stop_that_is_not_reached_is_bounded_from_below_only() {
    for (max, start) in [(100.0, 5.0), (1e6, 5.0), (100.0, 80.0), (3.0, 1.5)] {
        let channel = Channel::new("e", "y", SAMPLES, 3.0, |t| 0.9 * math::sin(t), 0.01);
        let tuners = vec![("stop", TunerBuilder::new(start, 0.5, max).log()), ("g", TunerBuilder::new(1.0, 0.5, 2.0))];
        let (values, times) = (channel.values(2), channel.times.clone());
        let model = Curve2(&["stop", "g"], |p, t| p[1] * math::sin(t).min(p[0]));
        let outcome = calibration(model, channel, tuners, "stop").run(2);
        let found = profile(&outcome);
        let of = |stop: f64| least(&[times.iter().map(|t| math::sin(*t).min(stop)).collect()], &values);
        let [low, _] = grid(of, [0.5, 2.0], f64::from(SAMPLES) - 1.0);
        assert!((found.interval[0] / low - 1.0).abs() < 5e-3, "{found:?} {low}");
        assert_eq!((found.interval[1], found.ends), (max, ["data", "bound"]));
    }
}
