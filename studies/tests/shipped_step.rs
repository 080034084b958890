//! The shipped recordings of `step-identification` are what their generator makes.

#[path = "../step-identification/generate.rs"]
mod step_identification;

#[test]
fn the_recordings_of_step_identification_are_what_the_generator_makes() {
    let studies = mops_studies::shipped();
    let study = studies.iter().find(|s| s.name == "step-identification").expect("it is shipped");
    for (name, seed, torque) in step_identification::RECORDINGS {
        let shipped = study.file(&format!("data/{name}")).expect("it is shipped");
        assert!(shipped == step_identification::recording(seed, torque).as_bytes(), "{name} differs");
    }
}
