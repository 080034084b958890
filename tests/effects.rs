//! Effects declared at places of a model.

use std::f64::consts::PI;
use std::fmt::Write;
use std::path::Path;

use assert_cmd::cargo::cargo_bin_cmd;
use mops::{EffectBuilder, ModelBuilder};
use mops_math as math;
use serde_json::Value;

/// Torsion pendulum `th'' = -4 th`; the tests insert effects and tuners.
const STUDY: &str = r#"[study]
name = "torsion"
task = "calibration"

[models.rig.equations]
states     = { th = "rad", w = "rad/s" }
inputs     = { u = "N m" }
parameters = { J = "kg m2", k = "N m/rad" }
start      = { th = "0.5 rad" }
der        = { th = "w", w = "J*w' = u - k*th" }

[models.rig]
parameters.J = 1.0
EFFECTS

[tuners]
TUNERS

[experiments.swing]
file     = "swing.csv"
channels = { th = { column = "th", noise = 1e-3 } }

[criteria]
th = { fit = { signal = "th" }, demand = 1e-3 }
"#;

/// Angle of the torsion pendulum with dry friction `c` (N m): half swings about `c/k` and `-c/k` in turn (J. P. Den
/// Hartog, Mechanical Vibrations, section 8.6).
fn swing(c: f64, t: f64) -> f64 {
    let (angular, offset) = (2.0, c / 4.0);
    let half = (t * angular / PI).floor();
    let sign = if half % 2.0 == 0.0 { 1.0 } else { -1.0 };
    let amplitude = 0.5 - (2.0 * half + 1.0) * offset;
    sign * offset + amplitude * math::cos(angular * t)
}

/// Runs the study with a recording with dry friction of 0.15 N m; returns the result.
fn run(effects: &str, tuners: &str) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let mut csv = String::from("t[s],th[rad]\n");
    for k in 0..=100 {
        let t = 0.05 * f64::from(k);
        writeln!(csv, "{t},{:.12}", swing(0.15, t)).unwrap();
    }
    std::fs::write(folder.path().join("swing.csv"), csv).unwrap();
    let study = STUDY.replace("EFFECTS", effects).replace("TUNERS", tuners);
    std::fs::write(folder.path().join("study.toml"), study).unwrap();
    result(folder.path())
}

fn result(folder: &Path) -> Value {
    let mut command = cargo_bin_cmd!("mops");
    let output = command.args(["run", "study.toml", "--json", "--out", "out"]).current_dir(folder).output().unwrap();
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)))
}

#[test]
fn the_parameter_of_a_declared_effect_can_be_a_tuner() {
    let found = run(
        "effects.bearing = { coulomb-friction = { place = \"joint:th\" } }",
        "k = { start = 3.7, min = 1.0, max = 9.0 }\n\"bearing.c\" = { start = 0.05, min = 0.0, max = 1.0 }",
    );
    let value = |name: &str| {
        let tuners = found["tuners"].as_array().unwrap();
        tuners.iter().find(|tuner| tuner["name"] == name).unwrap()["value"].as_f64().unwrap()
    };
    assert!((value("bearing.c") - 0.15).abs() < 1e-6, "{found:#}");
    assert!((value("k") - 4.0).abs() < 1e-5, "{found:#}");
}

#[test]
fn an_effect_at_its_null_value_changes_no_bit() {
    let tuners = "k = { start = 3.7, min = 1.0, max = 9.0 }";
    let without = run("", tuners);
    let with = run(
        "effects = { bearing = { coulomb-friction = { place = \"joint:th\" } }, air = { viscous-friction = { place = \"joint:th\" } } }",
        tuners,
    );
    assert_eq!(with["tuners"], without["tuners"]);
    assert_eq!(with["criteria"], without["criteria"]);
    assert_eq!(with["evaluations"], without["evaluations"]);
}

#[test]
fn model_parameters_and_cases_set_parameters_of_effects() {
    let effects =
        "effects.bearing = { coulomb-friction = { place = \"joint:th\" } }\nparameters.\"bearing.c\" = \"0.15 N m\"";
    let found = run(effects, "k = { start = 4.0, min = 1.0, max = 9.0 }");
    assert!(found["worst_scaled"].as_f64().unwrap() < 1e-3, "{found:#}");
}

#[test]
fn effects_added_in_rust_have_the_same_parameter_names() {
    let catalogue = mops::catalogue();
    let plain = || {
        let kind = catalogue.models.iter().find(|kind| kind.name == "furuta").unwrap();
        ModelBuilder { model: kind.default_model().unwrap(), parameters: Vec::new() }
    };
    let friction = |name: &str, place: &str| [EffectBuilder::new(name, "coulomb-friction", place)];
    let draft = plain().with_effects(&catalogue, &friction("arm", "joint:phi")).unwrap();
    // Further effects are added to those of the model.
    let draft = draft.with_effects(&catalogue, &friction("swing", "joint:theta")).unwrap();
    let names: Vec<&str> = draft.model.interface().parameters.iter().map(|p| &*p.variable.name).collect();
    assert_eq!(names[names.len() - 2..], ["arm.c", "swing.c"]);
    let taken = draft.with_effects(&catalogue, &friction("arm", "joint:theta")).err().unwrap();
    assert_eq!(taken.to_string(), "arm: the model already has a parameter `arm.c`; give the effect another name");
}

#[test]
fn check_and_describe_list_the_places_of_effects() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("swing.csv"), "t[s],th[rad]\n0,0.5\n1,0.4\n2,0.3\n3,0.2\n").unwrap();
    let study = STUDY.replace("EFFECTS", "").replace("TUNERS", "k = { start = 4.0, min = 1.0, max = 9.0 }");
    std::fs::write(folder.path().join("study.toml"), study).unwrap();
    let print = |arguments: &[&str]| {
        let output = cargo_bin_cmd!("mops").args(arguments).current_dir(folder.path()).output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    };
    let checked = print(&["check", "study.toml"]);
    for place in ["joint:th", "actuator:u", "sensor:th", "sensor:w"] {
        assert!(checked.contains(place), "{place} in\n{checked}");
    }
    assert!(!checked.contains("process:"), "the place of the equation of the speed is the joint\n{checked}");
    assert!(print(&["describe", "furuta"]).contains("joint:theta"));
    assert!(!print(&["describe", "pid-loop"]).contains("laces for effects"));
}

#[test]
fn the_schema_lists_the_effects_and_their_required_keys() {
    let output = cargo_bin_cmd!("mops").arg("schema").output().unwrap();
    let schema: Value = serde_json::from_slice(&output.stdout).unwrap();
    let named = &schema["properties"]["models"]["additionalProperties"]["properties"]["effects"];
    assert!(named["description"].as_str().unwrap().contains("arm.c"), "{named:#}");
    let effect = &named["additionalProperties"];
    assert_eq!(effect["additionalProperties"], false);
    let friction = &effect["properties"]["coulomb-friction"];
    assert_eq!(friction["required"], serde_json::json!(["place"]), "{friction:#}");
    assert!(friction["description"].as_str().unwrap().contains("sgn(v)"), "{friction:#}");
}

/// A tank whose level is `t - t^2/2`, with effects at its sensor.
const TANK: &str = r#"[study]
name = "tank"

[models.tank.equations]
states = { T = "1", s = "1" }
parameters = { k = "1" }
der = { T = "1 [s]*T' = k - s", s = "1 [s]*s' = 1" }
horizon = "1.9 s"

[models.tank]
EFFECTS

[tuners]
k = { start = 1.0, min = 0.5, max = 2.0 }

[criteria]
peak = { peak = { signal = "T" }, demand = 1 }
end = { final-value = { signal = "T" }, demand = 1 }
"#;

#[test]
fn a_quantised_signal_shows_its_levels_only() {
    let folder = tempfile::tempdir().unwrap();
    let study = TANK.replace(
        "EFFECTS",
        "parameters.\"a.step\" = 0.22\neffects.a = { sensor-quantisation = { place = \"sensor:T\" } }",
    );
    std::fs::write(folder.path().join("study.toml"), study).unwrap();
    let path = folder.path().join("study.toml");
    let output = cargo_bin_cmd!("mops")
        .args(["run", path.to_str().unwrap(), "--json", "--max-evaluations", "1", "--out"])
        .arg(folder.path().join("out"))
        .output()
        .unwrap();
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    // The largest level is 0.5, which the sensor shows as two steps, and the last one 0.095, which it shows as none.
    let [peak, end] = [0, 1].map(|index| result["criteria"][index]["value"].as_f64().unwrap());
    assert!((peak - 0.44).abs() < 1e-12 && end == 0.0, "{peak} {end}");
}

#[test]
fn a_play_behind_a_quantisation_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let study = TANK.replace(
        "EFFECTS",
        "parameters.\"a.step\" = 0.2\nparameters.\"b.gap\" = 0.1\neffects.a = { sensor-quantisation = { place = \"sensor:T\" } }\n\
         effects.b = { backlash = { place = \"sensor:T\" } }",
    );
    std::fs::write(folder.path().join("study.toml"), study).unwrap();
    let path = folder.path().join("study.toml");
    let output = cargo_bin_cmd!("mops").args(["check", path.to_str().unwrap()]).output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && message.contains("cannot follow the staircase"), "{message}");
}

#[test]
fn the_readme_says_how_many_effects_there_are() {
    let readme = std::fs::read_to_string("README.md").unwrap();
    let count = mops::effects::effects().len();
    assert!(readme.contains(&format!("screens {count} effects")), "there are {count} effects");
}
