//! The block `diagnosis` of `result.json`.

use mops_outcome::{Findings, diagnosis::Diagnosis};
use serde_json::{Value, json};

use super::made_up;

/// Returns the block of a diagnosis.
fn block(diagnosis: &Diagnosis) -> Value {
    let findings = Findings { diagnosis: Some(diagnosis.clone()), ..Findings::default() };
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
    assert_eq!((&unexplained["verdict"], &unexplained["unexplained"]["share"]), (&json!("unexplained"), &json!(0.8)));
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
    let mut schema = mops_outcome::result_schema();
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
