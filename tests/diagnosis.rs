//! Cases of the benchmark of the diagnosis: simulated experiments with a known missing effect.

use mops::{
    Catalogue, Options, catalogue,
    language::files::Files,
    outcome::diagnosis::{Diagnosis, Verdict},
};
use mops_testbed::{Missing, Trial, generate};

/// Data files of a case.
struct Data<'a>(&'a Trial);

impl Files for Data<'_> {
    fn read(&self, path: &str) -> std::io::Result<Vec<u8>> {
        let file = self.0.files.iter().find(|(name, _)| name == path);
        Ok(file.expect("the case has this file").1.as_bytes().to_vec())
    }

    fn show(&self, path: &str) -> String {
        path.to_owned()
    }
}

/// Generates a case with the first suitable seed.
fn case(plant: &str, missing: Missing<'_>, size: f64) -> Trial {
    (1..20).find_map(|seed| generate(plant, missing, size, seed)).expect("some seed gives a case")
}

/// Diagnoses a case; if `shuffled`, with another order of the catalogue and another seed.
fn diagnosis(case: &Trial, shuffled: bool) -> Diagnosis {
    let mut catalogue = catalogue();
    if shuffled {
        catalogue.effects.reverse();
        catalogue.effects.rotate_left(17);
    }
    diagnosis_among(case, catalogue, if shuffled { 4711 } else { 1 })
}

/// Diagnoses a case with a catalogue and a seed.
fn diagnosis_among(case: &Trial, catalogue: Catalogue, seed: u64) -> Diagnosis {
    let file = mops::file::read(&catalogue, "study.toml", &case.study, &[], &Data(case));
    let mut study = file.unwrap_or_else(|mistake| panic!("{}: {mistake}", case.name)).study;
    study.set_seed(seed);
    let options = Options { effects: catalogue.effects, ..Options::default() };
    let solved = mops::solve(study, &options, &()).unwrap_or_else(|why| panic!("{}: {why}", case.name));
    solved.outcome.found.get::<Diagnosis>().cloned().expect("the task is a diagnosis")
}

/// Effects and places found.
fn found(diagnosis: &Diagnosis) -> Vec<(&str, &str)> {
    diagnosis.found.iter().map(|found| (found.effect.as_str(), found.place.as_str())).collect()
}

#[test]
#[ignore = "full tier"]
fn a_missing_effect_is_found_with_its_place_and_its_parameter() {
    for (plant, effect, [name, parameter]) in [
        ("servo", "coulomb-friction", ["c", "torque"]),
        ("spring", "cubic-stiffness", ["k", "stiffness"]),
        ("tanks", "leak", ["k", "flow"]),
    ] {
        let case = case(plant, Missing::Effects(&[effect]), 5.0);
        let truth = &case.truth.effects[0];
        let diagnosis = diagnosis(&case, false);
        assert_eq!(diagnosis.verdict, Verdict::Effect, "{}", case.name);
        assert_eq!(found(&diagnosis), [(effect, truth.place.as_str())], "{}", case.name);
        let value = &diagnosis.found[0].strengths[0];
        let expected = truth.strengths.iter().find(|(n, _)| n == parameter).expect("the truth has this parameter").1;
        // Forces in the equations are in SI units, flows of the testbed's tanks in cm3/s.
        let expected = if plant == "tanks" { 1e-6 } else { 1.0 } * expected;
        assert!(value.name == name && (value.value / expected - 1.0).abs() < 0.2, "{}: {value:?}", case.name);
        for error in &diagnosis.after {
            assert!(error.normalised < 1.15, "{}: {} has the error {}", case.name, error.name, error.normalised);
        }
    }
}

#[test]
#[ignore = "full tier"]
fn a_simple_friction_is_refitted_from_the_optimum_of_a_more_general_one() {
    // The pendulum comes to rest. A fit of Coulomb friction alone ends in a local minimum with 25 times the sum of
    // squares.
    let missing = Missing::Effects(&["coulomb-friction"]);
    let case = generate("pendulum", missing, 20.0, 403_726_925_825).expect("the case can be generated");
    let diagnosis = diagnosis(&case, false);
    assert_eq!(found(&diagnosis), [("coulomb-friction", "joint:th")]);
    assert!(diagnosis.after.iter().all(|error| error.normalised < 1.1), "{:?}", diagnosis.after);
}

#[test]
#[ignore = "full tier"]
fn a_constant_heat_gain_is_not_mistaken_for_another_loss() {
    // `k (around - T)` with the declared loss at zero explains the data equally well.
    let missing = Missing::Effects(&["constant-heat-gain"]);
    let case = generate("jacket", missing, 20.0, 2_151_778_617_756).expect("the case can be generated");
    let diagnosis = diagnosis(&case, false);
    assert_eq!(found(&diagnosis), [("constant-force", "process:Tj")]);
    assert!(diagnosis.removed.is_empty(), "{:?}", diagnosis.removed);
}

#[test]
#[ignore = "full tier"]
fn a_friction_fit_in_a_local_minimum_near_zero_is_restarted() {
    // In windows the residual of the baseline model is 10 times the noise. From zero the fit ended at a quarter of the
    // friction, with 9 times the noise.
    let missing = Missing::Effects(&["coulomb-friction"]);
    let case = generate("furuta-free", missing, 20.0, 519_691_042_816).expect("the case can be generated");
    let mut few = catalogue();
    few.effects.retain(|effect| effect.name() == "coulomb-friction");
    let diagnosis = diagnosis_among(&case, few, 1);
    assert_eq!(diagnosis.steps.len(), 1, "{:?}", diagnosis.steps);
    assert_eq!(found(&diagnosis), [("coulomb-friction", "joint:th")]);
    assert!(diagnosis.after.iter().all(|error| error.normalised < 1.1), "{:?}", diagnosis.after);
}

#[test]
#[ignore = "full tier"]
fn a_break_away_force_is_found_although_the_residuals_are_discontinuous_in_it() {
    // The mass sticks and slips. A fit by gradients alone ended at 2.1 times the noise, with a third too much friction.
    let case =
        generate("spring", Missing::Effects(&["stiction"]), 5.0, 3_337_189_589_112).expect("the case can be generated");
    let mut few = catalogue();
    few.effects.retain(|effect| effect.name() == "stiction");
    let diagnosis = diagnosis_among(&case, few, 1);
    assert_eq!(found(&diagnosis), [("stiction", "joint:x")]);
    let truth = |name: &str| {
        case.truth.effects[0].strengths.iter().find(|s| s.0 == name).expect("the truth has this parameter").1
    };
    let truths = [truth("coulomb"), truth("static") / truth("coulomb") - 1.0];
    for (strength, truth) in diagnosis.found[0].strengths.iter().zip(truths) {
        let [low, high] = strength.interval95.expect("the parameter has an interval");
        // The calibration data exclude a larger rise; below that they cannot show one.
        assert!(low < truth && truth < high && high < 1.25 * truth, "{strength:?} {truth}");
    }
}

#[test]
#[ignore = "full tier"]
fn no_effect_is_found_in_data_of_a_complete_model() {
    for plant in ["pendulum", "servo"] {
        let case = case(plant, Missing::Nothing, 0.0);
        let diagnosis = diagnosis(&case, false);
        assert_eq!((diagnosis.verdict, found(&diagnosis)), (Verdict::None, Vec::new()), "{}", case.name);
        assert!(diagnosis.p_value > 0.01, "{}: {}", case.name, diagnosis.p_value);
    }
}

#[test]
#[ignore = "full tier"]
fn neither_the_order_of_the_catalogue_nor_the_seed_changes_the_verdict() {
    let friction = case("servo", Missing::Effects(&["coulomb-friction"]), 5.0);
    assert_eq!(found(&diagnosis(&friction, true)), [("coulomb-friction", "joint:q")]);
    let nothing = case("pendulum", Missing::Nothing, 0.0);
    assert_eq!(diagnosis(&nothing, true).verdict, Verdict::None);
}
