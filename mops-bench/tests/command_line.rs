//! Tests of the command line of `mops-bench`.

use assert_cmd::Command;
use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::Value;

fn bench(arguments: &[&str]) -> Command {
    let mut command = cargo_bin_cmd!("mops-bench");
    command.args(arguments);
    command
}

#[test]
fn a_benchmark_of_solvers_writes_results_that_can_be_compared() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("bench");
    let results = out.join("results.json");
    let arguments = [
        "minimax",
        "--solver",
        "sqp",
        "--problems",
        "CB2,Bard",
        "--gradients",
        "--quiet",
        "--out",
        out.to_str().unwrap(),
    ];
    let first = bench(&arguments).output().unwrap();
    let text = String::from_utf8(first.stdout).unwrap();
    assert!(first.status.success() && text.contains("sqp: 2 of 2 solved"), "{text}");
    let written: Value = serde_json::from_slice(&std::fs::read(&results).unwrap()).unwrap();
    assert_eq!((written["suite"].as_str(), written["rows"].as_array().map(Vec::len)), (Some("minimax"), Some(2)));
    assert!(std::fs::read_to_string(out.join("index.html")).unwrap().contains("Data profile"));
    let again = bench(&arguments).args(["--against", results.to_str().unwrap()]).output().unwrap();
    let text = String::from_utf8(again.stdout).unwrap();
    assert!(text.contains("before: sqp: 2 of 2 solved"), "{text}");
    bench(&["minimax", "--problems", "CB22"]).assert().code(2);
}

/// Returns the output of `mops-bench` for the given arguments.
fn benched(arguments: &[&str]) -> String {
    let done = bench(arguments).arg("--quiet").output().unwrap();
    let text = String::from_utf8(done.stdout).unwrap();
    assert!(done.status.success(), "{text}");
    text
}

#[test]
fn a_benchmark_that_cannot_be_written_is_not_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "kept").unwrap();
    let done = bench(&["minimax", "--problems", "CB2", "--quiet", "--out", file.to_str().unwrap()]).output();
    let done = done.unwrap();
    assert_eq!((done.status.code(), done.stdout.len()), (Some(3), 0));
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "kept");
}

#[test]
fn the_default_solver_finds_known_optima_of_control_design_and_calibration() {
    let problems =
        "lq-double-integrator,itae-third-order,settling-second-order,minimum-time,absorber-h2,tank,misra1a,boxbod";
    let text = benched(&["control", "--seeds", "2", "--problems", problems]);
    assert!(text.contains("auto: 16 of 16 solved"), "{text}");
}

#[test]
fn a_benchmark_of_fronts_has_mean_hypervolume_and_distance_over_seeds() {
    let text = benched(&["zdt", "--problems", "ZDT6", "--seeds", "2"]);
    let row = text.lines().find(|line| line.contains("ZDT6")).unwrap();
    let cells: Vec<&str> = row.split_whitespace().collect();
    let of = |i: usize| cells[i].parse::<f64>().unwrap();
    // problem, solver, seeds, evaluations, volume, sd, of front, all points, distance, sd
    let (volume, front, all) = (of(4), of(6), of(7));
    assert!((0.45..=front).contains(&volume) && all >= volume && all <= front && of(8) < 0.05, "{row}");
}

#[test]
fn problems_without_known_minima_are_compared_with_the_best_of_all_solvers() {
    let text = benched(&["more-wild", "--problems", "1 n9 m45,4 n2 m2", "--solver", "auto"]);
    assert!(text.contains("simplex gradients: ") && text.contains("auto: 2 of 2 solved"), "{text}");
}

/// Exit status 2, with the error and its remedy on standard error.
#[test]
fn a_wrong_command_line_gets_one_error_and_its_remedy() {
    for (arguments, expected) in [
        (&["minimax", "--budget", "0"][..], "--budget"),
        (&["minimax", "--problems", "CB22"], "`minimax` has no problem `CB22`"),
        (&["control", "--gradients"], "remove `--gradients` and `--noise`"),
        (&["zdt", "--noise", "0.1"], "remove `--noise`"),
        (&["minimax", "--noise", "2"], "between 0 and 1, found 2"),
        (&["minimax", "--solver", "nsga2", "--problems", "CB2"], "`nsga2` accepts none of these problems"),
        (&["minimax", "--solver", "squp"], "there is no solver `squp`"),
        (&["diagnosis", "--plants", "servos"], "`servos`"),
        (&["diagnosis", "--sizes", "0.5"], "found 0.5"),
        (&["diagnosis", "--kinds", "E"], "'E'"),
        (&["diagnosis", "--kinds", "A", "--none", "3"], "--none"),
        (&["diagnosis", "--kinds", "A", "--plants", "servo"], "`servo`"),
    ] {
        let done = bench(arguments).output().unwrap();
        let text = String::from_utf8(done.stderr).unwrap();
        assert_eq!((done.status.code(), done.stdout.len()), (Some(2), 0), "{arguments:?}: {text}");
        assert!(text.contains(expected), "{arguments:?}: {text}");
    }
}
