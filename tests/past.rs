//! Finished runs: history, comparison, and reports written again.

use std::path::Path;

use assert_cmd::Command;
use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::Value;

fn mops(arguments: &[&str]) -> Command {
    let mut command = cargo_bin_cmd!("mops");
    command.args(arguments);
    command
}

/// Returns the output of a command that succeeds.
fn message(arguments: &[&str]) -> String {
    let output = mops(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Returns the message of a command that is refused.
fn refusal(arguments: &[&str]) -> String {
    let output = mops(arguments).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8(output.stderr).unwrap()
}

fn run(study: &str, out: &Path, more: &[&str]) -> Value {
    let arguments = [&["run", study, "--quiet", "--out", out.to_str().unwrap()], more].concat();
    mops(&arguments).assert().code(0);
    serde_json::from_slice(&std::fs::read(out.join("result.json")).unwrap()).unwrap()
}

#[test]
fn the_history_lists_runs_with_state_and_result() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().to_str().unwrap();
    let first = run("pid-design", &folder.path().join("a"), &["--seed", "3"]);
    run("pid-design-constrained", &folder.path().join("deep/er/b"), &["--max-evaluations", "300"]);
    std::fs::create_dir(folder.path().join("empty")).unwrap();
    std::fs::write(folder.path().join("empty/result.json"), "{ \"not\": \"ours\" }").unwrap();
    let runs: Value = serde_json::from_str(&message(&["history", root, "--json"])).unwrap();
    let studies: Vec<&str> = runs.as_array().unwrap().iter().map(|run| run["study"].as_str().unwrap()).collect();
    assert_eq!(studies, ["pid-design", "pid-design-constrained"]);
    for key in ["worst_scaled", "feasible", "evaluations", "seconds", "mops", "seed", "solver", "task"] {
        assert_eq!(runs[0][key], first[key], "{key}");
    }
    assert_eq!(runs[0]["state"], first["stop"]);
    let table = message(&["history", root]);
    assert_eq!(table.lines().count(), 3, "{table}");
    assert!(table.contains("pid-design-constrained") && table.contains("worst scaled"), "{table}");
    // A killed run has no result, even if an older run left one.
    let database = rusqlite::Connection::open(folder.path().join("a/evaluations.sqlite")).unwrap();
    database.execute("UPDATE runs SET state = 'running'", []).unwrap();
    let runs: Value = serde_json::from_str(&message(&["history", root, "--json"])).unwrap();
    assert_eq!((runs[0]["state"].as_str(), &runs[0]["worst_scaled"]), (Some("unfinished"), &Value::Null));
    let message = refusal(&["history", "/nowhere/at/all"]);
    assert!(message.contains("there is no folder"), "{message}");
}

#[test]
fn a_report_is_rewritten_identically_without_the_study_file() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study.toml");
    std::fs::copy("studies/pid-design/study.toml", &study).unwrap();
    let out = folder.path().join("out");
    for more in
        [&[][..], &["--solver", "genetic", "--max-evaluations", "500", "--seed", "5", "--set", "tuners.k.start=3"]]
    {
        run(study.to_str().unwrap(), &out, more);
        let page = std::fs::read_to_string(out.join("report.html")).unwrap();
        std::fs::remove_file(out.join("report.html")).unwrap();
        std::fs::remove_dir_all(out.join("plots")).unwrap();
        let result = std::fs::read(out.join("result.json")).unwrap();
        message(&["report", out.to_str().unwrap()]);
        assert!(std::fs::read_to_string(out.join("report.html")).unwrap() == page, "the page is unchanged: {more:?}");
        assert_eq!(std::fs::read(out.join("result.json")).unwrap(), result, "the result is unchanged");
    }
    let message = refusal(&["report", folder.path().to_str().unwrap()]);
    assert!(message.contains("is not the folder of a run"), "{message}");
}

#[test]
fn a_report_of_a_diagnosis_is_rewritten_identically() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let few = "diagnosis.effects=['coulomb-friction','viscous-friction']";
    message(&["diagnose", "furuta-discrepancy", "--quiet", "--out", out, "--set", few]);
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("coulomb-friction"));
    std::fs::remove_file(folder.path().join("report.html")).unwrap();
    assert!(message(&["report", out]).contains("from the diagnosis"));
    assert!(std::fs::read_to_string(folder.path().join("report.html")).unwrap() == page, "the page is unchanged");
    std::fs::remove_file(folder.path().join("diagnosis.toml")).unwrap();
    assert!(refusal(&["report", out]).contains("diagnosis.toml cannot be read"));
}

#[test]
fn a_comparison_shows_differences_in_percent_and_responses() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
    let first = run("pid-design", &a, &[]);
    let second = run("pid-design", &b, &["--set", "criteria.settling.demand=\"30 s\""]);
    let (of_a, of_b) = (a.to_str().unwrap(), b.to_str().unwrap());
    let all: Value = serde_json::from_str(&message(&["compare", of_a, of_b, "--json"])).unwrap();
    for (i, name) in ["k", "Ti", "Td"].into_iter().enumerate() {
        let [x, y] = [&first, &second].map(|result| result["tuners"][i]["value"].as_f64().unwrap());
        let line = &all["tuners"][i];
        assert_eq!((line["name"].as_str(), &line["values"]), (Some(name), &serde_json::json!([x, y])));
        let percent = line["differences_percent"][0].as_f64().unwrap();
        assert!((percent - 100.0 * (y / x - 1.0)).abs() < 1e-9, "{name}: {percent}");
    }
    assert_eq!(all["criteria"][1]["name"], "nominal/settling");
    let page = folder.path().join("both.html");
    let text = message(&["compare", of_a, of_b, "--out", page.to_str().unwrap()]);
    assert!(text.contains("B vs A, %") && text.contains("nominal/overshoot"), "{text}");
    let page = std::fs::read_to_string(page).unwrap();
    assert!(page.contains("y in case nominal") && page.contains("series0") && page.contains("series1"), "{page}");
    assert!(page.contains("<th scope=\"row\">nominal/overshoot</th>") && page.contains("B vs A, %"), "{page}");
    let message = refusal(&["compare", of_a, folder.path().join("c").to_str().unwrap()]);
    assert!(message.contains("is not a folder"), "{message}");
}
