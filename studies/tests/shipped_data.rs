//! Shipped recordings equal the output of their generators.

#[path = "../furuta-calibration/generate.rs"]
mod furuta_calibration;
#[path = "../furuta-discrepancy/generate.rs"]
mod furuta_discrepancy;
#[path = "../furuta-swing/generate.rs"]
mod furuta_swing;

fn check(study: &str, file: &str, generated: &str) {
    let studies = mops_studies::shipped();
    let study = studies.iter().find(|s| s.name == study).expect("the file is shipped");
    let shipped = study.file(&format!("data/{file}")).expect("the file is shipped");
    assert!(shipped == generated.as_bytes(), "{file} of {} differs", study.name);
}

#[test]
fn the_recordings_of_the_calibrations_equal_the_output_of_the_generator() {
    for (name, seed, start) in furuta_calibration::RECORDINGS {
        let generated = furuta_calibration::recording(seed, start);
        check("furuta-calibration", name, &generated);
        check("furuta-calibration-2-joint", name, &generated);
    }
}

#[test]
fn the_recordings_of_furuta_swing_equal_the_output_of_the_generator() {
    for (name, seed, start) in furuta_swing::RECORDINGS {
        check("furuta-swing", name, &furuta_swing::recording(seed, start));
    }
}

#[test]
fn the_recordings_of_furuta_discrepancy_equal_the_output_of_the_test_bed() {
    for (name, seed, duration, start) in furuta_discrepancy::RECORDINGS {
        check("furuta-discrepancy", name, &furuta_discrepancy::recording(seed, duration, start));
    }
}
