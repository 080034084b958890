//! Properties that trials guarantee.

use mops_math as math;

use mops_testbed::{Missing, SIZES, Trial, effects, generate, outside, plants};

/// Returns the first trial that can be generated, over a few seeds.
fn first(plant: &str, missing: Missing<'_>, size: f64) -> Trial {
    (1..20).find_map(|seed| generate(plant, missing, size, seed)).expect("a seed that gives a trial")
}

/// Returns a column of a data file, by name.
fn column(trial: &Trial, file: usize, name: &str) -> Vec<f64> {
    let mut lines = trial.files[file].1.lines();
    let at = lines.next().unwrap().split(',').position(|column| column == name).expect("the file has the column");
    lines.map(|line| line.split(',').nth(at).unwrap().parse().unwrap()).collect()
}

#[test]
fn there_are_ten_plants_and_thirty_effects_and_all_fit_somewhere() {
    let mut names: Vec<&str> = effects().iter().map(|effect| effect.name).collect();
    names.sort_unstable();
    names.dedup();
    assert!(plants().len() >= 10 && names.len() >= 30, "{} plants, {} effects", plants().len(), names.len());
    for effect in effects().into_iter().chain(outside()) {
        assert!(plants().iter().any(|plant| !(effect.fits)(plant).is_empty()), "{} fits nowhere", effect.name);
    }
}

#[test]
fn the_requested_size_is_met_to_five_percent() {
    for (plant, effect) in [
        ("servo", "coulomb-friction"),
        ("pendulum", "cogging"),
        ("tanks", "leak"),
        ("room", "sensor-drift"),
        ("ball", "wind-gust"),
    ] {
        for size in SIZES {
            let trial = first(plant, Missing::Effects(&[effect]), size);
            assert!((trial.truth.size / size - 1.0).abs() < 0.05, "{}: {}", trial.name, trial.truth.size);
        }
    }
}

#[test]
fn the_same_request_gives_the_same_bits_and_another_seed_other_ones() {
    let ask = |seed| generate("spring", Missing::Effects(&["cubic-stiffness"]), 5.0, seed);
    let seeds: Vec<u64> = (1..20).filter(|&seed| ask(seed).is_some()).take(2).collect();
    assert_eq!(ask(seeds[0]), ask(seeds[0]));
    assert_ne!(ask(seeds[0]).unwrap().files, ask(seeds[1]).unwrap().files);
}

#[test]
fn without_missing_effects_the_refitted_baseline_model_reaches_the_noise_level_in_every_plant() {
    for plant in plants() {
        let trial = first(plant.name, Missing::Nothing, 0.0);
        assert_eq!((trial.truth.verdict, trial.truth.effects.len()), ("none", 0));
        // A standard deviation over N values has a relative error of sqrt(1/(2 N)); four of them.
        let close = 4.0 / (2.0 * plant.outputs.len() as f64 * (trial.files[0].1.lines().count() - 1) as f64).sqrt();
        let floor = trial.truth.noise_floor[0].1;
        assert!((floor - 1.0).abs() < close, "{}: noise of {floor}", trial.name);
        // The fit removes only the part that its few parameters can follow.
        assert!(
            trial.truth.size <= floor + 1e-6 && trial.truth.size > floor - 0.02,
            "{}: {}",
            trial.name,
            trial.truth.size
        );
    }
}

#[test]
fn the_noise_between_neighbours_in_the_file_is_the_one_declared() {
    // Third differences of a slow level have 20 times the variance of white noise.
    let trial = first("tanks", Missing::Nothing, 0.0);
    let line = trial.study.lines().find(|line| line.starts_with("channels")).unwrap();
    let declared: f64 = line.split("noise = ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    let h = column(&trial, 0, "h1_m");
    let squares: f64 = h.windows(4).map(|w| math::powi(w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0], 2)).sum();
    let seen = (squares / (20.0 * (h.len() - 3) as f64)).sqrt();
    assert!((seen / declared - 1.0).abs() < 0.12, "{seen}, declared {declared}");
    assert!(
        h.iter().all(|h| (h / 0.02 - (h / 0.02).round()).abs() < 1e-6),
        "values are multiples of the quantisation step"
    );
}

#[test]
fn files_have_as_many_columns_as_the_study_names_and_400_to_2000_samples() {
    for plant in plants() {
        let trial = first(plant.name, Missing::Nothing, 0.0);
        assert_eq!(trial.files.len(), 3);
        for (file, (name, content)) in trial.files.iter().enumerate() {
            assert!(trial.study.contains(&format!("\"{name}\"")));
            let rows = content.lines().count() - 1;
            assert!((400..=2000).contains(&rows), "{name} of {} has {rows}", trial.name);
            for (input, _) in plant.inputs {
                assert_eq!(column(&trial, file, input).len(), rows);
            }
            for output in plant.outputs {
                assert_eq!(column(&trial, file, &format!("{}_m", plant.states[output.state].0)).len(), rows);
            }
        }
    }
}

#[test]
fn guesses_are_20_to_60_percent_off_and_the_truth_is_within_the_bounds() {
    for plant in plants() {
        let trial = first(plant.name, Missing::Nothing, 0.0);
        for (name, value) in &trial.truth.base_parameters {
            let line = trial.study.lines().find(|line| line.starts_with(&format!("{name} = {{ start"))).unwrap();
            let number = |key: &str| -> f64 {
                line.split(&format!("{key} = ")).nth(1).unwrap().split([',', ' ']).next().unwrap().parse().unwrap()
            };
            let off = (number("start") / value - 1.0).abs();
            assert!((0.19..0.61).contains(&off), "{name} of {} is {off} off", plant.name);
            assert!(number("min") < *value && *value < number("max"));
        }
    }
}

#[test]
fn two_effects_are_both_reported_and_distinguishable() {
    let trial = first("axis", Missing::Effects(&["coulomb-friction", "input-delay"]), 5.0);
    let classes: Vec<&str> = trial.truth.effects.iter().map(|effect| effect.class.as_str()).collect();
    assert_eq!(classes, ["coulomb-friction", "input-delay"]);
    // A constant force and an input bias are indistinguishable: such a trial does not exist.
    let alike = Missing::Effects(&["constant-force", "input-bias"]);
    assert!((1..6).all(|seed| generate("axis", alike, 5.0, seed).is_none()));
}

#[test]
fn an_effect_outside_the_catalogue_is_unknown_and_its_place_is_reported() {
    let trial = first("pendulum", Missing::Outside("short-range-magnet"), 2.0);
    assert_eq!((trial.truth.verdict, trial.truth.effects[0].class.as_str()), ("unexplained", "unknown"));
    assert!(trial.truth.effects[0].accepted_places.contains(&"process:th".to_owned()));
}

#[test]
fn effects_absorbed_by_the_baseline_model_give_no_trial() {
    // A shift of an angle without influence, a delay of a free swing, a gain of a length whose mass is unknown.
    for (plant, effect) in [("servo", "sensor-bias"), ("pendulum", "sensor-delay"), ("axis", "sensor-gain")] {
        assert!((1..5).all(|seed| generate(plant, Missing::Effects(&[effect]), 2.0, seed).is_none()), "{effect}");
    }
}

#[test]
fn an_effect_can_be_put_at_a_place() {
    let trial = first("furuta-free", Missing::Effects(&["coulomb-friction@joint:ph"]), 2.0);
    assert_eq!(trial.truth.effects[0].place, "joint:ph");
    assert!(generate("furuta-free", Missing::Effects(&["coulomb-friction@joint:nowhere"]), 2.0, 1).is_none());
}
