//! The block `diagnosis` of `result.json`.

use std::fs;
use std::path::Path;

use mops_core::catalogue::Shipped;
use mops_outcome::Findings;
use mops_outcome::diagnosis::{Diagnosis, Removed};
use serde_json::{Value, json};

use super::{Search, made_up, of};
use crate::{Options, Origin, OutputFile, Room, Solution, Solved};

/// Returns the block of a diagnosis.
fn block(diagnosis: &Diagnosis) -> Value {
    let mut findings = Findings::default();
    findings.add(diagnosis.clone());
    serde_json::to_value(findings).unwrap()["diagnosis"].take()
}

/// Guards the names of keys, which other programs read.
#[test]
fn the_block_has_the_documented_keys_and_values() {
    let found = block(&made_up::coulomb());
    assert_eq!((&found["verdict"], &found["probability"]), (&json!("effect"), &json!(0.95)));
    let effect = &found["found"][0];
    assert_eq!((&effect["effect"], &effect["place"]), (&json!("coulomb-friction"), &json!("joint:phi")));
    assert_eq!((&effect["strengths"], &effect["probability"]), (&json!({ "c": 0.0124 }), &json!(0.9)));
    assert_eq!((&effect["bic_gain"], effect["indistinguishable"].as_array().unwrap().len()), (&json!(2400.0), 2));
    assert_eq!((&found["removed"], &found["unexplained"]), (&json!([]), &Value::Null));
    assert_eq!(&found["ranked"][1]["effect"], "stribeck-friction");
    assert_eq!(
        found["before"]["push"],
        json!({ "role": "validation", "channels": { "phi": 0.046, "theta": 0.047 }, "normalised": 15.4 })
    );
    assert_eq!(found["after"]["swing"]["normalised"], 1.0);
    let unexplained = block(&made_up::unexplained());
    assert_eq!(
        (&unexplained["verdict"], &unexplained["unexplained"]["over"]),
        (&json!("unexplained"), &json!("position"))
    );
    assert_eq!(unexplained["probability"], Value::Null);
    assert_eq!(block(&made_up::nothing())["verdict"], "none");
    assert_eq!((&effect["claimed"], &effect["class_probability"]), (&json!(true), &json!(0.95)));
    assert_eq!(
        (&found["depends_on"]["coordinate"], &found["depends_on"]["place"]),
        (&json!("speed"), &json!("joint:phi"))
    );
    assert_eq!((&found["ranked"][1]["failed"], &found["sure"]), (&json!("probability"), &json!(true)));
}

#[test]
fn the_block_agrees_with_the_schema_of_results() {
    let mut schema = crate::result_schema(&crate::testing::catalogue());
    // Without the rest of the result.
    schema["required"] = json!([]);
    let validator = jsonschema::validator_for(&schema).unwrap();
    for diagnosis in [made_up::coulomb(), made_up::unexplained(), made_up::nothing()] {
        let mut block = block(&diagnosis);
        let wrong = |block: &Value| {
            let result = json!({ "diagnosis": block });
            validator.iter_errors(&result).map(|e| format!("{}: {e}", e.instance_path)).collect::<Vec<_>>()
        };
        assert_eq!(wrong(&block), [""; 0]);
        block["verdict"] = json!("perhaps");
        assert!(!wrong(&block).is_empty());
    }
}

#[test]
fn numbers_that_are_not_finite_are_null() {
    let mut diagnosis = made_up::coulomb();
    (diagnosis.p_value, diagnosis.after[0].normalised) = (f64::NAN, f64::INFINITY);
    diagnosis.found[0].strengths[0].interval95 = Some([f64::NEG_INFINITY, 1.0]);
    let found = block(&diagnosis);
    assert_eq!((&found["p_value"], &found["after"]["swing"]["normalised"]), (&Value::Null, &Value::Null));
    assert_eq!(found["found"][0]["details"][0]["interval95"], json!([null, 1.0]));
    assert_eq!(found["ranked"][4]["bic_gain"], Value::Null);
    assert!(!serde_json::to_string(&found).unwrap().contains("NaN"));
}

/// Returns the solution of the shipped study of the swinging pendulum with a diagnosis.
fn solved(diagnosis: &Diagnosis) -> Solved {
    let catalogue = crate::testing::catalogue();
    let file = mops_file::read_shipped(&catalogue, &swing(), &[]).unwrap();
    of(file.study, &Options::default(), diagnosis.clone())
}

fn swing() -> Shipped {
    mops_studies::shipped().into_iter().find(|shipped| shipped.name == "furuta-swing").unwrap()
}

/// Returns the files of a diagnosis of the shipped study of the swinging pendulum.
fn files(diagnosis: &Diagnosis, shipped: Option<&Shipped>, is_exported: bool) -> Vec<OutputFile> {
    let study = swing();
    let text = std::str::from_utf8(study.file("study.toml").unwrap()).unwrap();
    let locate = |path: &str| path.to_owned();
    let origin = Origin {
        text: Some(text),
        own: &[],
        settings: &[],
        shipped,
        locate: &locate,
        folder: Path::new("."),
        effects: &mops_effects::effects(),
        is_exported,
    };
    Search.files(&Solution::from(&solved(diagnosis)), &origin)
}

#[test]
fn a_diagnosis_is_read_back_as_it_was_written() {
    for mut diagnosis in [made_up::coulomb(), made_up::nothing(), made_up::unexplained()] {
        diagnosis.p_value = f64::NAN;
        let study = solved(&diagnosis).problem.study().as_ref().clone();
        let written = files(&diagnosis, None, false).into_iter().find(|file| file.path == "diagnosis.toml").unwrap();
        let read = Search.restored(&study, &Options::default(), Ok(written.bytes)).unwrap();
        let read = read.outcome.found.get::<Diagnosis>().unwrap();
        assert_eq!(format!("{read:?}"), format!("{diagnosis:?}"));
        let wrong = Search.restored(&study, &Options::default(), Ok(b"verdict = 3".to_vec())).map(|_| ());
        assert!(wrong.unwrap_err().message.contains("diagnosis.toml cannot be read"));
    }
}

#[test]
fn the_repaired_study_of_a_shipped_study_can_be_run_in_its_folder() {
    let mut diagnosis = made_up::coulomb();
    diagnosis.found = Vec::new();
    diagnosis.removed = vec![Removed { term: "bp".into(), place: "joint:theta".into() }];
    let folder = tempfile::tempdir().unwrap();
    let written = files(&diagnosis, Some(&swing()), true);
    for OutputFile { path, bytes } in &written {
        let path = folder.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    for name in ["predictions/swing.csv", "predictions/push.csv", "repaired.rs", "data/upright.csv"] {
        assert!(folder.path().join(name).is_file(), "{name}");
    }
    let catalogue = crate::testing::catalogue();
    let again = mops_file::read_study(&catalogue, folder.path().join("repaired.toml")).unwrap();
    let before = solved(&diagnosis).problem.study().tuners().len();
    assert_eq!((again.cases().len(), again.tuners().len()), (2, before - 1));
    // The data of a study in a file are not copied.
    let own = files(&diagnosis, None, false);
    assert!(own.iter().all(|file| !file.path.starts_with("data/") && file.path != "repaired.rs"));
}
