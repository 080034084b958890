//! Tests of the whole report, with made-up diagnoses.

use mops_core::{
    StudyBuilder,
    study::{CaseBuilder, ChannelBuilder, Measured, TunerBuilder},
    task::DiagnosisTask,
};
use mops_outcome::diagnosis::Diagnosis;
use mops_tasks::{
    Options,
    diagnosis::{Search, made_up, of},
};

use super::Report;
use super::tests::Lag;

/// Writes the report; returns its temporary folder and the page.
fn written(diagnosis: Diagnosis) -> (tempfile::TempDir, String) {
    let times: Vec<f64> = (0..100).map(|i| 0.05 * f64::from(i)).collect();
    let channel = ChannelBuilder { signal: "y".into(), values: times.clone(), times, ..ChannelBuilder::default() };
    let measured = Measured { channels: vec![channel], ..Measured::default() };
    let draft = StudyBuilder {
        name: "swing".into(),
        task: DiagnosisTask::default().into(),
        models: vec![("lag".into(), Lag::new().into())],
        tuners: vec![("T".into(), TunerBuilder::new(2.0, 0.1, 20.0))],
        cases: vec![CaseBuilder { name: "step".into(), measured: Some(measured), ..CaseBuilder::default() }],
        ..StudyBuilder::default()
    };
    let solved = of(draft.build().unwrap(), &Options::default(), diagnosis);
    let folder = tempfile::tempdir().unwrap();
    let report = Report::new(&solved, &Search, "");
    report.write(folder.path()).unwrap();
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    (folder, page)
}

/// Returns the titles of the sections, in their order.
fn titles(page: &str) -> Vec<&str> {
    page.split("<h2").skip(1).map(|after| after.split(['>', '<']).nth(1).unwrap()).collect()
}

#[test]
fn an_effect_found_is_reported_from_the_verdict_to_the_next_experiment() {
    let (folder, page) = written(made_up::coulomb());
    assert_eq!(
        titles(&page),
        [
            "What is missing",
            "Missing effects",
            "Errors before and after",
            "Residuals of the nominal model",
            "Evidence by place",
            "Candidate effects",
            "Steps of the search",
            "Parameter shifts",
            "Next experiment",
            "Measured and predicted",
            "Notes",
            "Study"
        ]
    );
    for text in [
        "The model lacks a dissipative effect in the joint <code>phi</code> (probability 95 %), best described by \
         <code>coulomb-friction</code>",
        "c = 0.0124 (0.0118 to 0.013) N m",
        "indistinguishable",
        "not excluded",
        "15.40",
    ] {
        assert!(page.contains(text), "{text}");
    }
    for plot in [
        "missing",
        "left-swing-phi",
        "left-push-theta",
        "spectrum-swing-theta",
        "autocorrelation-swing-theta",
        "missing-joint-phi-speed",
        "predicted-push-phi",
    ] {
        assert!(folder.path().join(format!("plots/{plot}.svg")).exists(), "{plot}");
    }
    assert!(
        !folder.path().join("plots/missing-sensor-phi-speed.svg").exists(),
        "places without an effect have no plot"
    );
}

#[test]
fn the_verdict_none_is_reported_with_detection_limits() {
    let (_folder, page) = written(made_up::nothing());
    assert!(page.contains("No missing effect detected."));
    assert!(titles(&page).contains(&"Detection limits") && !titles(&page).contains(&"Parameter shifts"));
    assert!(!page.contains("recalibrated model</text>") && !page.contains("RMS before"), "there is only one model");
}

#[test]
fn what_no_effect_explains_has_a_coordinate_and_a_curve() {
    let mut diagnosis = made_up::unexplained();
    diagnosis.latent[0].place = "process:x".into();
    diagnosis.next_experiment = None;
    let (folder, page) = written(diagnosis);
    assert!(page.contains(
        "The model lacks something that depends on the position in the equation of <code>x</code>, and no effect is named"
    ));
    assert!(page.contains("verdict mixed"));
    assert!(!titles(&page).contains(&"Missing effects") && !titles(&page).contains(&"Next experiment"));
    let plot = std::fs::read_to_string(folder.path().join("plots/missing.svg")).unwrap();
    assert!(plot.contains("free curve") && plot.contains("estimated input"));
}

#[test]
fn an_effect_that_is_not_claimed_is_proposed() {
    let mut diagnosis = made_up::unexplained();
    diagnosis.found = made_up::coulomb().found;
    diagnosis.found[0].claimed = false;
    let (_, page) = written(diagnosis);
    assert!(page.contains("Not claimed, but the best description: <code>coulomb-friction</code> in the joint"));
    assert!(page.contains("Proposed, not claimed: probability of a dissipative effect here"));
}

#[test]
fn a_diagnosis_without_numbers_still_has_a_page() {
    let mut diagnosis = made_up::coulomb();
    for prediction in &mut diagnosis.predictions {
        prediction.before.fill(f64::NAN);
        prediction.noise = f64::NAN;
    }
    diagnosis.places.iter_mut().for_each(|place| place.gain = f64::NAN);
    for list in [&mut diagnosis.before, &mut diagnosis.after] {
        list.iter_mut().for_each(|e| e.normalised = f64::NAN);
    }
    let (_folder, page) = written(diagnosis);
    assert!(page.contains("n/a") && !page.contains("NaN"));
}
