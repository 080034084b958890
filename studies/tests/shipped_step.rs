//! Shipped recordings of `step-identification` equal the output of their generator.

#[path = "../step-identification/generate.rs"]
mod step_identification;

#[test]
fn the_recordings_of_step_identification_equal_the_output_of_the_generator() {
    let studies = mops_studies::shipped();
    let study = studies.iter().find(|s| s.name == "step-identification").expect("the study is shipped");
    for (name, seed, torque) in step_identification::RECORDINGS {
        let shipped = study.file(&format!("data/{name}")).expect("the study is shipped");
        assert!(shipped == step_identification::recording(seed, torque).as_bytes(), "{name} differs");
    }
}
