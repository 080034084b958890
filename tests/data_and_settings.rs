//! Numbers without units in channels, and settings of the command line that are not TOML.

use assert_cmd::cargo::cargo_bin_cmd;
use mops_math as math;
use serde_json::Value;

const STUDY: &str = r#"
    [study]
    name = "swing"
    task = "calibration"
    [models.m.equations]
    states     = { th = "rad" }
    parameters = { a = "1/s" }
    der        = { th = "-a*th" }
    start      = { th = "0.5 rad" }
    [tuners]
    a = { start = 1.0, min = 0.1, max = 5.0 }
    [experiments.e]
    file     = "e.csv"
    channels = { th = { column = "th", NOISE } }
    [criteria]
    th = { normalised-error = { signal = "th" } }
"#;

/// Runs a calibration from a recording in degrees with these settings; returns the result.
fn run(noise: &str, settings: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let row = |i: i32| {
        let t = 0.05 * f64::from(i);
        format!("{t},{}\n", (0.5 * math::exp(-0.8 * t)).to_degrees() + if i % 2 == 0 { 0.2 } else { -0.2 })
    };
    let table = format!("t,th[deg]\n{}", (0..=60).map(row).collect::<String>());
    std::fs::write(folder.path().join("e.csv"), table).unwrap();
    let study = folder.path().join("study.toml");
    std::fs::write(&study, STUDY.replace("NOISE", noise)).unwrap();
    let out = folder.path().join("out");
    let mut arguments = vec!["run", study.to_str().unwrap(), "--json", "--out", out.to_str().unwrap()];
    arguments.extend(settings.iter().flat_map(|setting| ["--set", setting]));
    let output = cargo_bin_cmd!("mops").args(arguments).output().unwrap();
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)))
}

#[test]
fn a_noise_without_a_unit_is_in_the_unit_of_its_column() {
    let error = |noise: &str| run(noise, &[])["criteria"][0]["value"].as_f64().unwrap();
    let bare = error("noise = 0.2");
    assert!((bare - 1.0).abs() < 0.1, "{bare}");
    assert_eq!(bare, error("noise = \"0.2 deg\""));
    // The same holds for `offset`.
    assert_eq!(error("noise = 0.2, offset = 1"), error("noise = 0.2, offset = \"1 deg\""));
}

#[test]
fn a_channel_without_noise_has_that_of_its_sensor() {
    let error = |noise: &str, settings: &[&str]| run(noise, settings)["criteria"][0]["value"].as_f64();
    let own = error("noise = 0.2", &[]);
    assert_eq!(own, error("", &["sensors.th.noise=\"0.2 deg\""]));
    assert_eq!(own, error("noise = 0.2", &["sensors.th.noise=7"]));
    let in_radians = format!("sensors.th.noise={}", 0.2_f64.to_radians());
    assert!((error("", &[&in_radians]).unwrap() / own.unwrap() - 1.0).abs() < 1e-12);
}

#[test]
fn a_setting_that_is_not_toml_is_a_string() {
    let sensitivity = run("noise = 0.2", &["study.task=sensitivity"]);
    assert_eq!(sensitivity["task"], "sensitivity");
    for (setting, start) in [
        ("tuners.a.start=2", 2.0),
        ("tuners.a.start=2 1/s", 2.0),
        ("tuners.a.start=\"2 1/s\"", 2.0),
        ("tuners.a={ start = 120, min = 6, max = 300, unit = \"1/min\" }", 120.0),
        ("tuners.a.start = 3 1/s", 3.0),
    ] {
        let result = run("noise = 0.2", &["study.task=sensitivity", setting]);
        assert_eq!(result["tuners"][0]["start"].as_f64(), Some(start), "{setting}");
    }
}

#[test]
fn an_invalid_setting_is_refused_with_the_reason() {
    let refused = |setting: &str| {
        let output = cargo_bin_cmd!("mops").args(["check", "pid-design", "--set", setting]).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{setting}");
        String::from_utf8(output.stderr).unwrap()
    };
    for (setting, part) in [
        ("tuners.k.start=", "value"),
        ("tuners.k.start=0,5", "decimal comma"),
        ("tuners.k.start={ a = ", "}"),
        ("tuners.k.start=five", "five"),
        ("criteria.settling.demand=12 m", "m"),
    ] {
        assert!(refused(setting).contains(part), "{setting}: {}", refused(setting));
    }
}

#[test]
fn initial_states_are_not_taken_from_later_samples() {
    let text = |free: &str| {
        format!(
            "[study]\nname = 'late'\ntask = 'calibration'\n[models.m.equations]\nstates = {{ x = '1' }}\nparameters = {{ k = '1/s' }}\n\
             der = {{ x = 'k' }}\n[tuners]\nk = {{ start = 1, min = 0.1, max = 5 }}\n[experiments.e]\nfile = 'data.csv'\n\
             reset-time = false\nfrom = '3 s'\nchannels = {{ x = {{ column = 'x', noise = 0.01 }} }}\nfree = {free}\n\
             [criteria]\nx = {{ normalised-error = {{ signal = 'x' }} }}\n"
        )
    };
    // x = 0.5 + 2 t.
    let rows: String = (0..=20).map(|k| format!("{},{}\n", 0.5 * f64::from(k), 0.5 + f64::from(k))).collect();
    let run = |free: &str| {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("study.toml"), text(free)).unwrap();
        std::fs::write(folder.path().join("data.csv"), format!("t,x\n{rows}")).unwrap();
        let mut command = assert_cmd::Command::cargo_bin("mops").unwrap();
        let output =
            command.current_dir(folder.path()).args(["run", "study.toml", "--json", "--out", "out"]).output().unwrap();
        (output.status.code().unwrap(), [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap()))
    };
    let (code, [_, refused]) = run("['x']");
    assert!(
        code == 2 && refused.contains("the first sample of `x` is at 3 s and does not determine its value at 0 s"),
        "{refused}"
    );
    let (code, [json, errors]) = run("{ x = { start = 0, min = -5, max = 5 } }");
    assert!(code <= 1, "{errors}");
    let result: Value = serde_json::from_str(&json).unwrap();
    let tuner = |k: usize| result["tuners"][k]["value"].as_f64().unwrap();
    assert!((tuner(0) - 2.0).abs() < 1e-4 && (tuner(1) - 0.5).abs() < 1e-3, "{json}");
}

/// `mops data` and `mops check` both give the source of a file that is not included.
#[test]
fn the_message_on_a_missing_third_party_recording_gives_source_and_digest() {
    let study = "examples/recordings/furuta-lund.toml";
    for arguments in [["data", "examples/recordings/FurutaData.mat"], ["check", study]] {
        let done = cargo_bin_cmd!("mops").args(arguments).output().unwrap();
        let text = String::from_utf8(done.stderr).unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(done.status.code(), Some(2), "{text}");
        assert!(text.contains("github.com/JModelica/JModelica") && text.contains("06d8c63565851187"), "{text}");
    }
}
