//! Stored evaluations: killed runs resume, stored points are not simulated again.

use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};
use std::time::Duration;

use assert_cmd::Command;
use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::Value;

fn mops(arguments: &[&str]) -> Command {
    let mut command = cargo_bin_cmd!("mops");
    command.args(arguments);
    command
}

/// Runs a study into a folder; returns the output on the terminal.
fn run(study: &str, out: &Path, more: &[&str]) -> String {
    let arguments = [&["run", study, "--out", out.to_str().unwrap()], more].concat();
    let output = mops(&arguments).output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(matches!(output.status.code(), Some(0 | 1)), "{error}");
    String::from_utf8(output.stdout).unwrap() + &error
}

/// Returns the result of a run without times.
fn result(out: &Path) -> Value {
    let mut result: Value = serde_json::from_slice(&std::fs::read(out.join("result.json")).unwrap()).unwrap();
    result.as_object_mut().unwrap().remove("seconds");
    result
}

/// Stored points, evaluations answered by one of them, and simulated evaluations, as printed by the terminal.
fn counts(message: &str) -> [usize; 3] {
    let line = message.lines().find(|line| line.starts_with("cache: ")).unwrap_or_else(|| panic!("{message}"));
    let numbers: Vec<usize> = line.split(|c: char| !c.is_ascii_digit()).filter_map(|word| word.parse().ok()).collect();
    numbers.try_into().unwrap()
}

/// Creates a folder with the study `pid-design` in which `from` is replaced by `to`.
fn changed(folder: &Path, from: &str, to: &str) -> PathBuf {
    let text = std::fs::read_to_string("studies/pid-design/study.toml").unwrap();
    assert!(text.contains(from), "{text}");
    let path = folder.join("changed.toml");
    std::fs::write(&path, text.replace(from, to)).unwrap();
    path
}

const SEARCH: [&str; 4] = ["--solver", "genetic", "--max-evaluations", "600"];

#[test]
fn resuming_a_finished_run_simulates_nothing_and_gives_the_same_result() {
    let folder = tempfile::tempdir().unwrap();
    let runs = [
        ("pid-design", &SEARCH[..]),
        ("pid-design", &[]),
        // Residuals and derivatives of a least-squares solver.
        ("furuta-calibration", &["--max-evaluations", "40"]),
        // Points at values of uncertain parameters.
        ("pid-robust", &["--set", "robust.samples=16", "--set", "robust.starts=1", "--max-evaluations", "400"]),
        ("pid-worst-case", &["--set", "worst-case.samples=16", "--set", "worst-case.starts=1"]),
        ("pid-robust", &["--set", "study.task=\"monte-carlo\"", "--set", "monte-carlo.samples=40"]),
        ("pid-worst-case", &["--set", "study.task=\"sensitivity\"", "--set", "sensitivity.method=\"morris\""]),
    ];
    for (index, (study, more)) in runs.into_iter().enumerate() {
        let out = folder.path().join(index.to_string());
        run(study, &out, more);
        let first = result(&out);
        std::fs::remove_file(out.join("result.json")).unwrap();
        let message = run(study, &out, &[more, &["--resume"]].concat());
        let [known, met, simulated] = counts(&message);
        assert!(known > 0 && met > 0, "{message}");
        assert_eq!(simulated, 0, "{study}: {message}");
        assert_eq!(result(&out), first, "{study}");
    }
}

/// Kills a run repeatedly at times from a seeded generator, and resumes it each time.
fn killed_again_and_again(kills: usize, seed: u64) {
    let folder = tempfile::tempdir().unwrap();
    let (whole, torn) = (folder.path().join("whole"), folder.path().join("torn"));
    let search = ["--solver", "genetic", "--max-evaluations", "2500", "--jobs", "2"];
    run("pid-design-multi-case", &whole, &search);
    let mut state = seed;
    let (mut died, mut most) = (0, 0);
    while died < kills {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let program = assert_cmd::cargo::cargo_bin!("mops");
        let mut process = Process::new(program)
            .args(["run", "pid-design-multi-case", "--out", torn.to_str().unwrap(), "--resume"])
            .args(search)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(50 + (state >> 33) % 900));
        process.kill().unwrap();
        if process.wait().unwrap().code().is_some() {
            // The run ended first: start a new one.
            assert_eq!(result(&torn), result(&whole));
            std::fs::remove_dir_all(&torn).unwrap();
            most = 0;
            continue;
        }
        died += 1;
        let points = points(&torn);
        assert!(points >= most, "what was written stays: {points} after {most}");
        most = points;
    }
    let message = run("pid-design-multi-case", &torn, &[&search[..], &["--resume"]].concat());
    assert_eq!(result(&torn), result(&whole));
    if most > 0 {
        let [known, met, simulated] = counts(&message);
        assert_eq!(known, most);
        assert!(met + simulated >= 2250 && simulated <= 2600 - known.min(2250), "{message}");
    }
}

/// Returns the number of points in the database of a folder.
fn points(folder: &Path) -> usize {
    let path = folder.join("evaluations.sqlite");
    if !path.exists() {
        return 0;
    }
    let connection = rusqlite::Connection::open(path).unwrap();
    connection.query_row("SELECT count(*) FROM points", [], |row| row.get::<_, i64>(0)).map_or(0, |n| n as usize)
}

/// Five kills, or as many as `MOPS_KILLS` states.
#[test]
fn a_run_killed_at_random_moments_resumes_to_the_result_of_an_uninterrupted_one() {
    let kills = std::env::var("MOPS_KILLS").ok().and_then(|kills| kills.parse().ok()).unwrap_or(5);
    killed_again_and_again(kills, 1);
}

#[test]
fn after_a_change_of_a_demand_no_stored_point_is_simulated_again() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (folder.path().join("first"), folder.path().join("second"));
    run("pid-design", &first, &["--solver", "genetic", "--max-evaluations", "5000"]);
    let known = points(&first);
    // The search may converge before its budget; points that it repeats are stored once.
    assert!(known > 4000, "{known} points");

    // The best of these points under the new demand, computed independently.
    let study = changed(folder.path(), "demand = \"15 s\"", "demand = \"9 s\"");
    let table = std::fs::read_to_string(first.join("evaluations.csv")).unwrap();
    let demand = |text: &str| text.parse::<f64>().ok();
    let best = table.lines().skip(1).filter_map(|line| {
        let numbers: Vec<Option<f64>> = line.split(',').map(demand).collect();
        let [overshoot, settling] = [numbers[3]?, numbers[4]?];
        (!overshoot.is_nan() && !settling.is_nan()).then(|| (overshoot / 0.1).max(settling / 9.0))
    });
    let best = best.fold(f64::INFINITY, f64::min);

    // With a budget of one evaluation the run evaluates its initial point only: the best stored point.
    let reuse = ["--reuse", first.to_str().unwrap()];
    let message = run(study.to_str().unwrap(), &second, &[&reuse[..], &["--max-evaluations", "1"]].concat());
    assert_eq!(counts(&message)[0], known);
    let found = result(&second);
    assert_eq!((found["evaluations"].as_u64(), found["reused"].as_u64()), (Some(1), Some(1)));
    assert_eq!(found["worst_scaled"].as_f64(), Some(best));

    // A whole search: stored points are not simulated again, and no point is written twice.
    let message = run(study.to_str().unwrap(), &second, &[&reuse[..], &["--max-evaluations", "200"]].concat());
    let [_, met, simulated] = counts(&message);
    let found = result(&second);
    assert!(met >= 1 && simulated >= 1, "{message}");
    // Points evaluated twice (by the search, then by the certificate) are written once.
    assert!(points(&second) <= met + simulated && points(&second) > simulated, "every point once: {message}");
    assert_eq!(found["reused"].as_u64().map(|reused| 180 - reused as usize <= simulated), Some(true), "{message}");
    assert!(found["worst_scaled"].as_f64().unwrap() <= best);
}

#[test]
fn a_run_that_reuses_its_own_folder_adds_its_points_to_the_database() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    run("pid-design", &out, &SEARCH);
    let solver = [&SEARCH[..], &["--reuse", out.to_str().unwrap()]].concat();
    let before = points(&out);
    let message = run("pid-design", &out, &solver);
    let [known, _, simulated] = counts(&message);
    assert_eq!((known, points(&out)), (before, before + simulated));
}

/// Returns the message of a run that is refused.
fn refusal(arguments: &[&str]) -> String {
    let output = mops(arguments).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn evaluations_of_another_study_are_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let place = out.to_str().unwrap();
    run("pid-design", &out, &SEARCH);
    let base = [&["run", "pid-design", "--out", place], &SEARCH[..]].concat();
    let with = |more: &[&'static str]| refusal(&[&base[..], more].concat());
    let message = with(&["--resume", "--seed", "2"]);
    assert!(message.contains("`seed` was 1 and is 2") && message.contains("--reuse DIR"), "{message}");
    let message = with(&["--resume", "--set", "criteria.settling.demand=\"9 s\""]);
    assert!(message.contains("`criteria.settling.demand` was \"15 s\" and is \"9 s\""), "{message}");
    let message = with(&["--resume", "--set", "solver.genetic.population=50"]);
    assert!(message.contains("population"), "{message}");

    let reuse = ["run", "pid-design", "--out", place, "--reuse", place, "--set"];
    let message = refusal(&[&reuse[..], &["cases.nominal.b=-4.5"]].concat());
    assert!(message.contains("`cases.nominal.b` was") && message.contains("-4.5"), "{message}");
    let nowhere = folder.path().join("nowhere");
    let message = refusal(&["run", "pid-design", "--out", place, "--reuse", nowhere.to_str().unwrap()]);
    assert!(message.contains("contains no evaluations.sqlite"), "{message}");
    std::fs::write(out.join("evaluations.sqlite"), "not a database").unwrap();
    let output = mops(&["run", "pid-design", "--out", place, "--resume"]).output().unwrap();
    assert!(matches!(output.status.code(), Some(2 | 3)), "{output:?}");
}

#[test]
fn a_larger_budget_extends_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let (short, long) = (folder.path().join("short"), folder.path().join("long"));
    run("pid-design", &short, &["--solver", "genetic", "--max-evaluations", "300"]);
    let message = run("pid-design", &short, &[&SEARCH[..], &["--resume"]].concat());
    run("pid-design", &long, &SEARCH);
    // Of the shorter run, the last fifth was spent on local searches.
    assert!(counts(&message)[1] >= 240, "{message}");
    assert_eq!(result(&short), result(&long));
}

#[test]
fn a_new_run_keeps_the_points_of_an_unfinished_one() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    run("pid-design", &out, &SEARCH);
    rusqlite::Connection::open(out.join("evaluations.sqlite"))
        .unwrap()
        .execute("UPDATE runs SET state = 'running', ended = NULL", [])
        .unwrap();
    let message = run("pid-design", &out, &SEARCH);
    assert!(message.contains("evaluations of an unfinished run were moved to"), "{message}");
    assert!(out.join("evaluations.previous.sqlite").exists());
}
