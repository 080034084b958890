//! The shipped recordings are what their generator makes.

#[path = "../furuta-calibration/generate.rs"]
mod furuta_calibration;

#[test]
fn the_recordings_of_furuta_calibration_are_what_the_generator_makes() {
    let studies = mops_studies::shipped();
    let study = studies.iter().find(|s| s.name == "furuta-calibration").expect("it is shipped");
    for (name, seed, start) in furuta_calibration::RECORDINGS {
        let shipped = study.file(&format!("data/{name}")).expect("it is shipped");
        assert!(shipped == furuta_calibration::recording(seed, start).as_bytes(), "{name} differs");
    }
}
