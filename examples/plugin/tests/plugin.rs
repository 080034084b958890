//! The program knows its additions in every command.

use assert_cmd::Command;
use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::Value;

fn plugin(arguments: &[&str]) -> Command {
    let mut command = cargo_bin_cmd!("mops-plugin");
    command.args(arguments);
    command
}

fn text(arguments: &[&str]) -> String {
    let done = plugin(arguments).output().unwrap();
    assert!(done.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).unwrap()
}

#[test]
fn the_program_has_its_own_name_and_version() {
    let version = env!("CARGO_PKG_VERSION");
    assert_eq!(text(&["--version"]), format!("mops-plugin {version} (mops {version})\n"));
    assert!(text(&["run", "--help"]).contains("Usage: mops-plugin run"));
    assert!(text(&["completions", "zsh"]).starts_with("#compdef mops-plugin"));
}

#[test]
fn the_additions_are_listed_and_described() {
    let list = text(&["list"]);
    for name in ["quarter-car", "ride-comfort", "shrinking-box", "eddy-brake", "suspension", "pid-design"] {
        assert!(list.contains(&format!("  {name}")), "{name}: {list}");
    }
    assert!(list.contains("Spring and damper of a wheel, built in Rust"));
    assert!(text(&["describe", "ride-comfort"]).contains("ISO 2631"));
    assert!(text(&["describe", "suspension"]).contains("Built in Rust"));
}

/// Runs a study into a folder; the result.
fn run(folder: &std::path::Path, arguments: &[&str]) -> Value {
    let out = folder.to_str().unwrap();
    let done = plugin(&[&["run"], arguments, &["--json", "--out", out]].concat()).output().unwrap();
    serde_json::from_slice(&done.stdout).unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&done.stderr)))
}

#[test]
fn a_study_built_in_rust_is_run_resumed_reported_and_changed_by_settings() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let first = run(&out, &["suspension", "--max-evaluations", "40"]);
    assert_eq!(
        (first["study"].as_str(), first["evaluations"].as_u64().is_some_and(|n| n <= 40)),
        (Some("suspension"), true)
    );
    // A larger budget extends the run, and simulates no known point again.
    let longer = run(&out, &["suspension", "--max-evaluations", "200", "--resume"]);
    assert!(longer["evaluations"].as_u64().unwrap() > 40);
    let whole = run(&folder.path().join("whole"), &["suspension", "--max-evaluations", "200"]);
    assert_eq!(longer["tuners"], whole["tuners"]);
    assert!(text(&["report", out.to_str().unwrap()]).contains("report.html"));
    // Settings replace start, bounds, seed and task.
    let settings = ["--set", "tuners.k.min=3e4", "--set", "tuners.k.start=4e4"];
    let changed = [&["suspension", "--max-evaluations", "40"], &settings[..]].concat();
    let other = run(&folder.path().join("other"), &changed);
    assert!(other["tuners"][0]["value"].as_f64().unwrap() >= 3e4, "{other}");
    let wrong = plugin(&["check", "suspension", "--set", "tuners.q.min=3"]).output().unwrap();
    assert_eq!(wrong.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("the study has no tuner `q`"));
    let wrong = plugin(&["check", "suspension", "--set", "criteria.shaking.demand=3"]).output().unwrap();
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("source code of the study"));
}

#[test]
fn a_study_in_the_program_uses_its_model_and_criterion_and_the_solver() {
    let folder = tempfile::tempdir().unwrap();
    let by_default = run(&folder.path().join("default"), &["quarter-car"]);
    let own = run(&folder.path().join("own"), &["quarter-car", "--solver", "shrinking-box"]);
    let of = |result: &Value| result["worst_scaled"].as_f64().unwrap();
    assert!(of(&by_default) < 1.0 && of(&own) <= 1.01 * of(&by_default), "{} {}", of(&by_default), of(&own));
}

#[test]
fn folders_of_studies_are_known_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let mine = folder.path().join("mine");
    std::fs::create_dir_all(&mine).unwrap();
    let shipped = include_str!("../studies/quarter-car/study.toml");
    let own = shipped.replacen("name = \"quarter-car\"", "name = \"half-car\"", 1);
    std::fs::write(mine.join("study.toml"), own).unwrap();
    std::fs::write(mine.join("README.md"), "# Mine\n").unwrap();
    let studies = folder.path().to_str().unwrap();
    // The name is that of the study, not of its folder; a folder that is given twice is read once.
    let list = text(&["list", "studies", "--studies", studies, "--studies", studies]);
    assert!(list.lines().any(|line| line.contains("half-car") && line.contains("Mine")), "{list}");
    assert!(text(&["check", "half-car", "--studies", studies]).contains("comfort"));
    let by_variable = plugin(&["check", "half-car"]).env("MOPS_STUDIES", studies).output().unwrap();
    assert!(by_variable.status.success());
    std::fs::write(mine.join("study.toml"), shipped).unwrap();
    let twice = plugin(&["list", "--studies", studies]).output().unwrap();
    let message = String::from_utf8_lossy(&twice.stderr).into_owned();
    assert_eq!(twice.status.code(), Some(2), "{message}");
    let fact = "two studies are named `quarter-car`: one shipped with the program, one in the folder";
    assert!(message.replace("\n  │ ", " ").contains(fact), "{message}");
    let nowhere = plugin(&["list", "--studies", "nowhere"]).output().unwrap();
    assert_eq!(nowhere.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&nowhere.stderr).contains("nowhere"));
}

/// The finding is in the block of the task; each limit is where the demand is just met.
#[test]
fn a_task_is_run_by_its_own_command() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let shown = text(&["tolerances", "suspension", "--max-evaluations", "200", "--out", out]);
    assert!(shown.contains("tuner") && shown.contains("design"), "{shown}");
    let result: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("result.json")).unwrap()).unwrap();
    assert_eq!(result["task"], "tolerances");
    for tuner in result["tolerances"]["tuners"].as_array().unwrap() {
        let ends = tuner["range"].as_array().unwrap();
        let [from, to] = [0, 1].map(|i| ends[i].as_f64().unwrap());
        assert!((from..=to).contains(&tuner["value"].as_f64().unwrap()), "{tuner}");
    }
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains(">Tolerances</h2>"));
    assert!(text(&["schema", "study"]).contains("\"tolerances\""));
    assert!(text(&["describe", "tolerances"]).contains("halvings"));
}
