//! Properties of trials with a model error in the background.

use mops_math as math;

use mops_testbed::{NOMINAL, Setting, Trial, disturbed, disturbed_plants};

/// Returns the first trial that can be generated, over a few seeds.
fn first(setting: Setting, plant: &str, effect: &str) -> Trial {
    (1..20).find_map(|seed| disturbed(setting, plant, effect, seed)).expect("a seed that gives a trial")
}

/// Returns trials of a setting, one per seed, on the plants in turn.
fn several(setting: Setting, count: u64) -> Vec<Trial> {
    let effects = ["constant-force@joint:q", "coulomb-friction@joint:q1", "linear-loss@process:h2"];
    let plants = disturbed_plants().iter().zip(effects).cycle();
    plants.zip(1..=count).filter_map(|((plant, effect), seed)| disturbed(setting, plant.name, effect, seed)).collect()
}

#[test]
fn the_same_request_gives_the_same_bits_and_another_seed_other_ones() {
    for setting in Setting::ALL {
        let ask = |seed| disturbed(setting, "driven-pendulum", "coulomb-friction@joint:q", seed);
        let seeds: Vec<u64> = (1..20).filter(|&seed| ask(seed).is_some()).take(2).collect();
        assert_eq!(ask(seeds[0]), ask(seeds[0]));
        assert_ne!(ask(seeds[0]).unwrap().files, ask(seeds[1]).unwrap().files);
    }
}

#[test]
fn every_nominal_effect_can_be_generated() {
    for nominal in NOMINAL {
        let trial = first(Setting::Effect, nominal.plant, nominal.effect);
        let effect = &trial.truth.effects[0];
        assert_eq!(format!("{}@{}", effect.class, effect.place), nominal.effect);
        assert!(trial.truth.background.is_none() && trial.truth.size > 0.9, "{}: {}", trial.name, trial.truth.size);
    }
}

#[test]
fn one_record_is_for_calibration_one_for_selection_and_one_for_validation() {
    let trial = first(Setting::EffectAndBackground, "two-masses", "coulomb-friction@joint:q2");
    let names: Vec<&str> = trial.files.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["calibration.csv", "selection.csv", "validation.csv"]);
    let lines = |key: &str| trial.study.lines().filter(|line| line.starts_with(key)).collect::<Vec<_>>();
    assert_eq!(lines("role"), ["calibration", "selection", "validation"].map(|role| format!("role     = \"{role}\"")));
    let rows: Vec<usize> = trial.files.iter().map(|(_, content)| content.lines().count() - 1).collect();
    assert_eq!(rows, [500, 250, 250]);
}

#[test]
fn without_a_background_the_refitted_model_reaches_the_noise_level() {
    for trial in several(Setting::Exact, 6) {
        let floor = trial.truth.noise_floor[0].1;
        assert!(trial.truth.size <= floor + 1e-6 && trial.truth.size > floor - 0.02, "{}", trial.name);
        assert_eq!((trial.truth.verdict, trial.truth.effects.len()), ("none", 0));
    }
}

#[test]
fn a_background_has_the_size_that_the_truth_reports() {
    let mut sources = Vec::new();
    for trial in several(Setting::Background, 24) {
        let background = trial.truth.background.as_ref().expect("there is a background");
        assert!((0.05..=0.2 * 1.02).contains(&background.share) && (10.0..=300.0).contains(&background.ratio));
        // The true parameters leave background and noise; the fit leaves less, but parameters do not follow correlated
        // noise of a sensor.
        let left = math::hypot(background.ratio, trial.truth.noise_floor[0].1);
        let least = if background.source == "coloured" { 0.6 } else { 0.01 };
        let share = trial.truth.size / left;
        assert!((least..1.05).contains(&share) && trial.truth.size > 1.05, "{}: {share}", trial.name);
        sources.push(background.source);
    }
    assert!(["force", "drift", "coloured"].iter().all(|source| sources.contains(source)), "{sources:?}");
}

#[test]
fn a_repeating_background_is_at_a_place_and_has_no_correlation_time() {
    let trial = first(Setting::RepeatingBackground, "cascade", "linear-loss@process:h2");
    let background = trial.truth.background.expect("there is a background");
    assert!(background.source == "state" && background.at.starts_with("process:h") && background.time.is_none());
    assert_eq!(trial.truth.verdict, "none or unexplained");
}
