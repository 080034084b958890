//! Coverage of 95 % intervals over simulated calibrations with the seeds 0, 1, 2, ...

use mops::{
    CriterionBuilder, TunerBuilder,
    core::{
        criterion::Loss,
        task::{Chosen, UncertaintyTask},
    },
    criteria::normalised_error::NormalisedError,
    statistics::share_interval,
};
use mops_math as math;

use super::models::{Calibration, Channel, Curve, fit, lines, normalised, parameters, words};

/// Simulated calibrations of each kind.
const CALIBRATIONS: u32 = 2000;

/// Returns true if every series is counted in full, also those that take minutes: `MOPS_COVERAGE=all`.
fn counts_all() -> bool {
    std::env::var("MOPS_COVERAGE").is_ok_and(|which| which == "all")
}

/// Shares that count as 95 %.
const RIGHT: [f64; 2] = [0.93, 0.97];

/// Returns the number of intervals of each parameter that contain the true value.
fn hits(calibration: &Calibration, truth: &[(&str, f64)], count: u32) -> Vec<usize> {
    let one = |seed: u32| -> Vec<bool> {
        let outcome = calibration.run(u64::from(seed));
        let holds = |(name, truth): &(&str, f64)| {
            let [low, high] = parameters(&outcome).iter().find(|p| p.name == *name).unwrap().interval95;
            low <= *truth && *truth <= high
        };
        truth.iter().map(holds).collect()
    };
    let all: Vec<Vec<bool>> = (0..count).map(one).collect();
    (0..truth.len()).map(|k| all.iter().filter(|one| one[k]).count()).collect()
}

/// Checks that the share of all calibrations is within [`RIGHT`]; for fewer, within the bounds of chance (one in a
/// thousand).
fn assert_covers(calibration: &Calibration, truth: &[(&str, f64)]) {
    assert_covers_in(mops_tiers::cases(CALIBRATIONS), calibration, truth);
}

fn assert_covers_in(count: u32, calibration: &Calibration, truth: &[(&str, f64)]) {
    for ((name, _), hits) in truth.iter().zip(hits(calibration, truth, count)) {
        let share = hits as f64 / f64::from(count);
        println!("{name}: {hits} of {count} intervals hold the truth");
        let [low, high] = match count {
            CALIBRATIONS => [share; 2],
            _ => share_interval(hits, count as usize, 0.999),
        };
        assert!(high >= RIGHT[0] && low <= RIGHT[1], "{name}: {hits} of {count}");
    }
}

/// A gain in both records, and a rate in each: 1000 samples and 10.
fn unequal_lengths(declared: bool) -> Calibration {
    let long = Channel::new("long", "y", 1000, 3.0, |t| math::exp(-t), 0.01);
    let short = Channel::new("short", "y", 10, 3.0, |t| math::exp(-0.5 * t), 0.01);
    let channels = vec![long, short];
    Calibration {
        model: Box::new(|| Curve::new(&["g", "k"], |p, t| p[0] * math::exp(-p[1] * t)).into()),
        tuners: vec![
            ("g", TunerBuilder::new(2.0, 0.1, 10.0)),
            ("k", TunerBuilder { per_case: true, ..TunerBuilder::new(2.0, 0.1, 10.0).log() }),
        ],
        channels: if declared { channels.into_iter().map(Channel::declared).collect() } else { channels },
        criteria: Box::new(move || vec![("y", if declared { normalised("y") } else { fit("y") })]),
        uncertainty: None,
    }
}

const RATES: [(&str, f64); 3] = [("g", 1.0), ("long/k", 1.0), ("short/k", 0.5)];

#[test]
fn intervals_cover_the_truth_for_records_of_1000_and_10_samples() {
    assert_covers(&unequal_lengths(true), &RATES);
}

#[test]
fn intervals_cover_the_truth_for_records_of_1000_and_10_samples_with_unknown_noise() {
    assert_covers(&unequal_lengths(false), &RATES);
}

/// Two lines with a common slope.
fn two_channels(noise: [f64; 2], criteria: fn() -> Vec<(&'static str, CriterionBuilder)>) -> Calibration {
    Calibration {
        model: Box::new(lines),
        tuners: ["a", "b", "slope"].map(|name| (name, TunerBuilder::new(1.0, -10.0, 10.0))).into(),
        channels: vec![
            Channel::new("rig", "y", 60, 2.0, |t| 0.3 + 0.7 * t, noise[0]),
            Channel::new("rig", "z", 25, 2.0, |t| -0.2 + 0.7 * t, noise[1]),
        ],
        criteria: Box::new(criteria),
        uncertainty: None,
    }
}

const LINES: [(&str, f64); 3] = [("a", 0.3), ("b", -0.2), ("slope", 0.7)];

#[test]
fn intervals_cover_the_truth_for_two_channels_of_different_noise() {
    assert_covers(&two_channels([0.002, 0.05], || vec![("y", fit("y")), ("z", fit("z"))]), &LINES);
}

#[test]
fn intervals_cover_the_truth_with_a_weight_of_ten_on_one_criterion() {
    let mut calibration = two_channels([0.02, 0.05], || {
        vec![("y", normalised("y")), ("z", CriterionBuilder { weight: 10.0, ..normalised("z") })]
    });
    calibration.channels = calibration.channels.into_iter().map(Channel::declared).collect();
    assert_covers(&calibration, &LINES);
}

/// Has no target: the sandwich estimator for correlated residuals is known to be too small on average.
#[test]
fn intervals_with_correlated_noise_are_reported_as_such() {
    let mut calibration = two_channels([0.02, 0.05], || vec![("y", normalised("y")), ("z", normalised("z"))]);
    for channel in &mut calibration.channels {
        channel.times = (0..200).map(|i| 0.01 * f64::from(i)).collect();
        (channel.declared, channel.correlation) = (Some(channel.noise), 0.8);
    }
    let count = mops_tiers::cases(CALIBRATIONS);
    for ((name, _), hits) in LINES.iter().zip(hits(&calibration, &LINES, count)) {
        println!("correlated noise, {name}: {hits} of {count} intervals hold the truth");
        // Intervals for white noise would cover 48 %, as errors are sqrt((1 + 0.8)/(1 - 0.8)) = 3 times as large.
        assert!(hits as f64 > 0.6 * f64::from(count), "{name}: {hits}");
    }
    let words = words(&calibration.run(0));
    assert!(words.contains("not white") && words.contains("cover the truth less often than stated"), "{words}");
}

/// A decay to an offset: 150 samples with spikes, of which `share` have one.
fn with_spikes(loss: Loss, share: f64, upwards: bool) -> Calibration {
    let channel = Channel::new("rig", "y", 150, 6.0, |t| 2.0 * math::exp(-0.9 * t) + 0.4, 0.05).declared();
    let criterion = move || NormalisedError { signal: "y".into(), loss, ..NormalisedError::default() };
    Calibration {
        model: Box::new(|| Curve::new(&["k", "o", "x0"], |p, t| p[2] * math::exp(-p[0] * t) + p[1]).into()),
        tuners: vec![
            ("k", TunerBuilder::new(1.0, 0.1, 10.0)),
            ("o", TunerBuilder::new(0.0, -5.0, 5.0)),
            ("x0", TunerBuilder::new(1.0, 0.0, 10.0)),
        ],
        channels: vec![Channel { spikes: (share, upwards), ..channel }],
        criteria: Box::new(move || vec![("y", CriterionBuilder::minimise(criterion(), 1.0))]),
        uncertainty: None,
    }
}

const DECAY: [(&str, f64); 3] = [("k", 0.9), ("o", 0.4), ("x0", 2.0)];

/// Returns the number of calibrations with a robust loss, whose searches take longer.
fn robust_calibrations() -> u32 {
    if counts_all() { CALIBRATIONS } else { mops_tiers::cases(CALIBRATIONS / 10) }
}

#[test]
fn intervals_of_hubers_loss_cover_the_truth_beside_outliers() {
    for share in [0.0, 0.03, 0.1] {
        assert_covers_in(robust_calibrations(), &with_spikes(Loss::Huber, share, false), &DECAY);
    }
}

#[test]
fn intervals_of_students_loss_cover_the_truth_beside_outliers() {
    for share in [0.03, 0.1] {
        assert_covers_in(robust_calibrations(), &with_spikes(Loss::Student, share, false), &DECAY);
    }
}

/// Has no target: a robust estimate is biased by outliers on one side.
#[test]
fn outliers_on_one_side_are_reported_with_what_they_shift() {
    for loss in [Loss::Huber, Loss::Student] {
        let calibration = with_spikes(loss, 0.1, true);
        let count = robust_calibrations();
        for ((name, _), hits) in DECAY.iter().zip(hits(&calibration, &DECAY, count)) {
            println!("{loss:?}, spikes upwards, {name}: {hits} of {count} intervals hold the truth");
        }
        let words = words(&calibration.run(0));
        assert!(words.contains("standard deviations of the noise off the model are above it"), "{words}");
        let (_, message) = words.split_once("to first order: ").unwrap();
        assert!((loss == Loss::Huber) == message.contains("`o` = "), "{words}");
    }
}

/// Sets of 200 replicates whose bootstrap intervals are counted.
const SETS: u32 = 200;

#[test]
fn bootstrap_intervals_beside_outliers_cover_the_truth() {
    let count = if counts_all() { SETS } else { mops_tiers::cases(SETS / 20) };
    for (loss, share) in [(Loss::Huber, 0.03), (Loss::Huber, 0.1), (Loss::Student, 0.1)] {
        let task = UncertaintyTask { profile: Chosen::None, bootstrap: 200, block: None, bands: false, level: 0.95 };
        let calibration = Calibration { uncertainty: Some(task), ..with_spikes(loss, share, false) };
        let mut hits = [0; 3];
        for seed in 0..count {
            let outcome = calibration.run(u64::from(seed));
            let found =
                outcome.found.get::<mops::tasks::calibration::UncertaintyReport>().cloned().unwrap().bootstrap.unwrap();
            for (((name, truth), hits), one) in DECAY.iter().zip(&mut hits).zip(&found.parameters) {
                assert!(one.parameter.ends_with(name), "{}", one.parameter);
                let [low, high] = one.interval;
                assert!(low < one.value && one.value < high, "{loss:?} {name}: {low} to {high}");
                *hits += usize::from(low <= *truth && *truth <= high);
            }
        }
        for ((name, _), hits) in DECAY.iter().zip(hits) {
            println!("bootstrap, {loss:?}, {share} spikes, {name}: {hits} of {count} intervals hold the truth");
            let share = hits as f64 / f64::from(count);
            let [low, high] = if counts_all() { [share; 2] } else { share_interval(hits, count as usize, 0.999) };
            assert!(high >= 0.9 && low <= 0.99, "{loss:?} {name}: {hits} of {count}");
        }
    }
}
