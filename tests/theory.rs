//! Excitation, identifiability and sweeps, as users see them.

#[path = "common/result.rs"]
mod result;

use std::path::Path;

use assert_cmd::Command;
use assert_cmd::cargo::cargo_bin_cmd;
use mops_math as math;
use serde_json::Value;

fn mops(arguments: &[&str]) -> Command {
    let mut command = cargo_bin_cmd!("mops");
    command.args(arguments);
    command
}

/// Runs a study into `folder/out`; returns the result.
fn run(study: &str, folder: &Path, settings: &[&str]) -> Value {
    let out = folder.join("out");
    let mut arguments = vec!["run", study, "--json", "--out", out.to_str().unwrap()];
    arguments.extend(settings.iter().flat_map(|setting| ["--set", *setting]));
    let output = mops(&arguments).output().unwrap();
    result::read(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)))
}

/// Path of the study of a free swing in `tests/swing`.
fn swing() -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/swing/study.toml").to_str().unwrap().to_owned()
}

fn page(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("out/report.html")).unwrap()
}

/// Recording, every 0.01 s, of inputs of known excitation order, and of the response
/// `y(t) = 1.5 y(t-1) - 0.7 y(t-2) + u(t-1) + 0.5 u(t-2)` to the last one, a maximum-length sequence of seven bits.
fn recording() -> String {
    let (mut register, mut before, mut y) = (1u8, [0.0; 2], [0.0; 2]);
    let mut text = "t[s],pulse,step,sine,five,bits[N m],y[rad]\n".to_owned();
    for i in 0..1000u32 {
        let bit = ((register >> 6) ^ (register >> 5)) & 1;
        register = (register << 1) | bit;
        let t = f64::from(i) / 100.0;
        let (u, now) = (f64::from(2 * bit) - 1.0, 1.5 * y[0] - 0.7 * y[1] + before[0] + 0.5 * before[1]);
        let pulse = u8::from(i == 200);
        let (step, sine, five) = (u8::from(i >= 300), math::sin(t), [1.0, -0.3, 0.7, 2.0, 0.1][i as usize % 5]);
        text += &format!("{t},{pulse},{step},{sine},{five},{u},{now}\n");
        (before, y) = ([u, before[0]], [now, y[0]]);
    }
    text
}

const INPUTS: &str = r#"
[study]
name = "inputs"
task = "excitation"

[models.rig.furuta]
[tuners]
b = { start = 2e-3, min = 1e-3, max = 1e-2 }
c = { start = 4e-4, min = 1e-4, max = 1e-3 }

[experiments]
pulse = { file = "data.csv", channels = { phi = "y" }, inputs = { u = "pulse" } }
step  = { file = "data.csv", channels = { phi = "y" }, inputs = { u = "step" } }
sine  = { file = "data.csv", channels = { phi = "y" }, inputs = { u = "sine" } }
five  = { file = "data.csv", channels = { phi = "y" }, inputs = { u = "five" } }
bits  = { file = "data.csv", channels = { phi = "y" }, inputs = { u = "bits" } }

[excitation.regressions]
arx = { experiment = "bits", input = "u", output = "phi", a = 2, b = 2 }
fir = { experiment = "step", input = "u", output = "phi", b = 3, forgetting = 0.99 }
"#;

fn inputs(folder: &Path, text: &str) -> String {
    std::fs::write(folder.join("data.csv"), recording()).unwrap();
    let study = folder.join("study.toml");
    std::fs::write(&study, text).unwrap();
    study.to_str().unwrap().to_owned()
}

#[test]
fn excitation_orders_of_known_inputs_are_found_without_a_simulation() {
    let folder = tempfile::tempdir().unwrap();
    let result = run(&inputs(folder.path(), INPUTS), folder.path(), &[]);
    let found = result["excitation"]["inputs"].as_array().unwrap();
    let orders: Vec<(&str, u64, bool)> = found
        .iter()
        .map(|i| (i["case"].as_str().unwrap(), i["order"].as_u64().unwrap(), i["suffices"].as_bool().unwrap()))
        .collect();
    let expected = [("pulse", 0, false), ("step", 1, false), ("sine", 2, true), ("five", 5, true), ("bits", 127, true)];
    assert_eq!(orders, expected);
    assert_eq!(result["simulations"], 0);
    assert!(found[1]["words"].as_str().unwrap().contains("Transients such as an edge excite more"));
    let page = page(folder.path());
    assert!(page.contains("persistently exciting of order 127") && page.contains("Excitation by u in bits"));
    assert!(folder.path().join("out/plots/excitation-bits-u.png").exists());
}

#[test]
fn regressions_identify_the_system_or_report_insufficient_excitation() {
    let folder = tempfile::tempdir().unwrap();
    let result = run(&inputs(folder.path(), INPUTS), folder.path(), &[]);
    let [arx, fir] = &result["excitation"]["regressions"].as_array().unwrap()[..] else { panic!("two of them") };
    for (parameter, exact) in arx["parameters"].as_array().unwrap().iter().zip([-1.5, 0.7, 1.0, 0.5]) {
        let [batch, recursive] = [&parameter[1], &parameter[3]].map(|v| v.as_f64().unwrap());
        assert!((batch - exact).abs() < 1e-9 && (recursive - exact).abs() < 1e-4, "{parameter}");
    }
    // The edge of the step is within the record and alone determines all three.
    assert_eq!((&fir["rank"], &fir["forgetting"]), (&3.into(), &0.99.into()));
}

#[test]
fn the_data_command_computes_the_excitation_order_of_a_column() {
    let folder = tempfile::tempdir().unwrap();
    inputs(folder.path(), INPUTS);
    let data = folder.path().join("data.csv");
    let output = mops(&["data", data.to_str().unwrap(), "--excitation", "sine"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        text.contains("persistently exciting of order 2")
            && text.contains("with 2 parameters")
            && !text.contains("sufficient, if"),
        "{text}"
    );
    let output = mops(&["data", data.to_str().unwrap(), "--excitation", "sinus"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn a_free_swing_does_not_determine_a_common_factor_and_the_result_reports_it() {
    let folder = tempfile::tempdir().unwrap();
    let settings = ["study.task='sensitivity'", "sensitivity.at='start'", "tuners.a.active=true"];
    let result = run(&swing(), folder.path(), &settings);
    let found = &result["sensitivity"];
    let tuners = found["tuners"].as_array().unwrap().len();
    assert_eq!((&result["solver"], &result["evaluations"]), (&"none".into(), &1.into()));
    assert_eq!((found["rank"].as_u64().unwrap() as usize, tuners), (11, 12));
    let direction = &found["directions"][0];
    let expected = "a common factor of `b`, `c`, `d`, `ba`, `bp`, `ca`, `cp` and `a` has no effect: only their ratios can \
                    be estimated";
    assert_eq!(direction["words"], expected);
    // Residuals are constant along this direction, also at large distances.
    assert!(direction["remaining"].as_f64().unwrap() < 1e-6, "{direction}");
    assert_eq!(found["tuners"][0]["std_error"], Value::Null);
    assert!(page(folder.path()).contains("has no effect: only their ratios can be estimated"));
}

/// The inertia of the arm about its axis is that about its centre of mass plus its mass times (0.1225 m)^2.
#[test]
fn only_one_combination_of_arm_inertia_and_mass_is_identifiable() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(swing().replace("study.toml", "swing.csv"), folder.path().join("swing.csv")).unwrap();
    let text = std::fs::read_to_string(swing()).unwrap();
    let arm = "Jc = { start = 1.4e-3, min = 1e-4, max = 1e-2, unit = \"kg m2\" }\n\
               m  = { start = 0.165, min = 0.05, max = 0.5, unit = \"kg\" }\n\
               b  = { tie = \"Jc + 0.01500625 [m2]*m - 2.5e-3 [kg m2]\" }\n";
    let tied: Vec<&str> = text.lines().map(|line| if line.starts_with("b  =") { arm } else { line }).collect();
    let study = folder.path().join("study.toml");
    std::fs::write(&study, tied.join("\n")).unwrap();
    let settings = ["study.task='sensitivity'", "sensitivity.at='start'"];
    let result = run(study.to_str().unwrap(), folder.path(), &settings);
    let found = &result["sensitivity"];
    assert_eq!(found["directions"][0]["words"], "only `Jc` + 0.0150 `m` can be estimated");
    assert!(found["directions"][0]["remaining"].as_f64().unwrap() < 1e-6);
    // The block of the matrix has the eigenvectors (1, 0.015) and (-0.015, 1); one eigenvalue is zero.
    let block = |i: usize, j: usize| found["matrix"][i][j].as_f64().unwrap();
    let [a, b, d] = [block(0, 0), block(0, 1), block(1, 1)];
    assert!((b / a - 0.01500625).abs() < 1e-9 && ((a * d - b * b) / (a * d)).abs() < 1e-9, "{a} {b} {d}");
}

#[test]
fn a_calibration_reports_the_identifiability_of_its_tuners() {
    let folder = tempfile::tempdir().unwrap();
    let result = run(&swing(), folder.path(), &[]);
    let found = &result["calibration"]["sensitivity"];
    assert_eq!((found["rank"].as_u64(), found["slopes"].as_str()), (Some(11), Some("tangents")));
    let pairs =
        found["words"].as_array().unwrap().iter().any(|w| w.as_str().unwrap().contains("`b` and `c` are correlated"));
    assert!(pairs, "{}", found["words"]);
    // Standard errors in the section equal those of the parameters.
    let parameters = result["calibration"]["parameters"].as_array().unwrap();
    for (parameter, tuner) in parameters.iter().zip(found["tuners"].as_array().unwrap()) {
        assert_eq!((&parameter["name"], &parameter["std_error"]), (&tuner["name"], &tuner["std_error"]));
    }
    let page = page(folder.path());
    assert!(page.contains("Identifiability") && page.contains("No experiment is driven by an input"));
}

#[test]
fn a_sweep_over_two_tuners_draws_a_surface_with_its_minimum() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = "sweep={x={tuner='k',min=2,max=10,points=9},y={tuner='Ti',min=3,max=8,points=6},at='start'}";
    let result = run("pid-design", folder.path(), &["study.task='sweep'", sweep]);
    let found = &result["sweep"];
    let heights: Vec<Vec<f64>> = serde_json::from_value(found["objective"].clone()).unwrap();
    assert!(heights.len() == 6 && heights.iter().all(|row| row.len() == 9));
    let lowest = heights.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    assert_eq!(found["best"][2].as_f64(), Some(lowest));
    // The initial guess is one of 55 points; its neighbour on the grid has another value.
    assert_eq!((&result["evaluations"], &found["y"]["tuner"]), (&55.into(), &"Ti".into()));
    let rows = std::fs::read_to_string(folder.path().join("out/evaluations.csv")).unwrap().lines().count();
    assert_eq!(rows, 56);
    assert!(
        folder.path().join("out/plots/sweep.svg").exists() && page(folder.path()).contains("Objective over k and Ti")
    );
}

#[test]
fn a_sweep_over_one_tuner_is_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let result = run("pid-design", folder.path(), &["study.task='sweep'", "sweep={x='Td',at='start'}"]);
    assert_eq!((result["sweep"]["objective"][0].as_array().unwrap().len(), &result["sweep"]["y"]), (201, &Value::Null));
}

#[test]
fn errors_in_the_tables_of_tasks_have_a_position_and_a_fix() {
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        ("sweep={x='q'}", "the study has no tuner `q`", "known: b, c"),
        ("sweep={x='b',y='b'}", "x and y are the same tuner `b`", "omit `y`"),
        ("sweep={x={tuner='b',max=9}}", "9 is outside the bounds of `b`", "widen"),
        ("sweep={x={tuner='b',points=1}}", "expected 2 to 1000 points, found 1", "41"),
        ("sensitivity.zero=2.0", "between 0 and 1, found 2", "omit `zero`"),
        ("excitation.inputs=['v']", "no case and no experiment has an input `v`", "known: u"),
        ("excitation.noise.u='3 kg'", "kg", "is in `N m`"),
        ("excitation.sample-time=0", "must be positive", "omit it"),
        ("excitation.regressions.arx.output='theta'", "`bits` does not measure `theta`", "known: phi"),
        ("excitation.regressions.arx.experiment='bit'", "no experiment `bit`", "did you mean `bits`?"),
        ("excitation.regressions.arx.forgetting=2", "above 0 and at most 1, found 2", "0.98"),
        ("excitation.regressions.arx.b=0", "at least 1 coefficient of the input", "`b` is"),
        ("excitation.regresions.arx.b=0", "unknown key `regresions`", "did you mean `regressions`?"),
    ];
    let study = inputs(folder.path(), INPUTS);
    for (setting, fact, way_out) in cases {
        let output = mops(&["check", &study, "--set", setting]).output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr).replace("\n", " ");
        assert_eq!(output.status.code(), Some(2), "{setting}: {text}");
        assert!(text.contains(fact) && text.contains(way_out) && text.contains("--set:1:"), "{setting}: {text}");
    }
    for (setting, fact) in [
        ("study.task='sweep'", "the study has no table [sweep]"),
        ("study.task='excitation'", "no case and no experiment has an input signal"),
    ] {
        let output = mops(&["check", &swing(), "--set", setting]).output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && text.contains(fact) && text.contains("--set:1:12"), "{text}");
    }
}
