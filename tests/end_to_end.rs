//! The command line as users see it: commands, files, exit statuses.

#[path = "common/result.rs"]
mod result;

use std::path::Path;

use assert_cmd::Command;
use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::Value;

fn mops(arguments: &[&str]) -> Command {
    let mut command = cargo_bin_cmd!("mops");
    command.args(arguments);
    command
}

/// Runs a study into `folder`; returns the result.
fn run(study: &str, folder: &Path, more: &[&str]) -> Value {
    let out = folder.join("out");
    let mut arguments = vec!["run", study, "--json", "--out", out.to_str().unwrap()];
    arguments.extend(more);
    let output = mops(&arguments).output().unwrap();
    let result: Value =
        result::read(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)));
    assert_eq!(std::fs::read(out.join("result.json")).unwrap(), output.stdout, "the printed result equals the file");
    result
}

fn worst(result: &Value) -> f64 {
    result["worst_scaled"].as_f64().unwrap()
}

/// Known optima, found by an independent program (SciPy): 0.8630704, 0.7359265, 3.8955098.
#[test]
fn the_pid_studies_reach_their_known_optima() {
    for (study, optimum, slack) in [
        ("pid-design", 0.863_070_4, 2e-4),
        ("pid-design-constrained", 0.735_926_5, 2e-4),
        ("pid-design-multi-case", 3.895_509_8, 0.02),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let result = run(study, folder.path(), &[]);
        assert_eq!(result["feasible"], true, "{study}");
        let found = worst(&result);
        assert!(found <= optimum + slack && found >= optimum - 1e-5, "{study}: {found}");
    }
}

#[test]
fn a_run_writes_result_report_plots_and_evaluations() {
    let folder = tempfile::tempdir().unwrap();
    let result = run("pid-design", folder.path(), &["--max-evaluations", "60", "--seed", "7"]);
    let keys = [
        "format",
        "mops",
        "study",
        "task",
        "seed",
        "solver",
        "stop",
        "evaluations",
        "simulations",
        "seconds",
        "feasible",
        "worst_scaled",
        "violation",
        "pareto",
        "tuners",
        "criteria",
        "start",
        "front",
        "failures",
    ];
    for key in keys {
        assert!(result.get(key).is_some(), "{key} is missing");
    }
    assert_eq!((&result["seed"], &result["stop"], &result["evaluations"]), (&7.into(), &"budget".into(), &60.into()));
    let out = folder.path().join("out");
    let rows = std::fs::read_to_string(out.join("evaluations.csv")).unwrap().lines().count();
    assert_eq!(rows, 55, "a header, and one line per point of the search: a tenth of the budget is for its result");
    for file in ["report.html", "plots/convergence.svg", "plots/response-nominal-y.png"] {
        assert!(out.join(file).metadata().unwrap().len() > 1000, "{file}");
    }
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(!page.contains("src=\"http") && !page.contains("href=\"http"), "the page opens without a network");
}

#[test]
fn thread_count_does_not_change_a_single_bit() {
    for study in ["pid-design-multi-case", "furuta-swing"] {
        let results: Vec<Value> = ["1", "2", "3"]
            .iter()
            .map(|jobs| {
                let folder = tempfile::tempdir().unwrap();
                let mut result = run(study, folder.path(), &["--jobs", jobs, "--max-evaluations", "700"]);
                result["seconds"] = Value::Null;
                result
            })
            .collect();
        assert!(results.windows(2).all(|pair| pair[0] == pair[1]), "{study}");
    }
}

#[test]
fn a_calibration_recovers_the_true_parameters_within_its_intervals() {
    let folder = tempfile::tempdir().unwrap();
    let result = run("furuta-swing", folder.path(), &[]);
    // True values of the generator, studies/furuta-swing/generate.rs.
    let truth = [
        ("b", 1.133e-3),
        ("c", 6.31e-4),
        ("d", 2.5267e-2),
        ("ba", 1.2e-4),
        ("bp", 2.5e-5),
        ("ca", 9e-4),
        ("cp", 1.8e-4),
    ];
    for (name, value) in truth {
        let parameters = result["calibration"]["parameters"].as_array().unwrap();
        let found = parameters.iter().find(|p| p["name"] == name).unwrap();
        let (estimate, error) = (found["value"].as_f64().unwrap(), found["std_error"].as_f64().unwrap());
        assert!((estimate - value).abs() < 4.0 * error, "{name}: {estimate} +- {error}, generated with {value}");
    }
    let experiments = result["calibration"]["experiments"].as_array().unwrap();
    for (experiment, channel, limit) in [(0, 0, 0.0033), (0, 1, 0.0033), (1, 0, 0.006), (1, 1, 0.012)] {
        let rmse = experiments[experiment]["channels"][channel]["rmse"].as_f64().unwrap();
        assert!(rmse < limit, "{} {channel}: {rmse}", experiments[experiment]["name"]);
    }
}

/// Sum of the scaled criteria of a calibration or validation.
fn objective(result: &Value, case: &str) -> f64 {
    let criteria = result["criteria"].as_array().unwrap().iter().filter(|c| c["case"] == case);
    criteria.map(|c| c["scaled"].as_f64().unwrap()).sum()
}

#[test]
fn a_third_joint_explains_the_residual_of_the_two_joint_model() {
    // Data simulated by an independent derivation and integrator; table 4.6 of the thesis, noise of 0.003 rad: residual
    // 0.0945.
    let device = [
        "tuners.J.start=1.082e-3",
        "tuners.Ja.start=1.656e-3",
        "tuners.tau11.start=5.055e-3",
        "tuners.tau01.start=0.01022",
        "tuners.tau05.start=0.020867",
        "tuners.tau12.start=0.034065",
        "tuners.point0.start=0.130807",
        "tuners.point1.start=0.468552",
        "tuners.tau21.start=4.626e-3",
        "tuners.tau22.start=3.449e-3",
        "tuners.c.start=3.81909",
        "tuners.d.start=0.010007",
    ];
    let mut arguments: Vec<&str> = device.iter().flat_map(|value| ["--set", *value]).collect();
    arguments.extend(["--max-evaluations", "60"]);
    let folder = tempfile::tempdir().unwrap();
    let three = run("furuta-calibration", folder.path(), &arguments);
    assert!(objective(&three, "horizontal") < 0.1, "{}", objective(&three, "horizontal"));
    assert!(objective(&three, "upright") < 0.2, "{}", objective(&three, "upright"));
    let two = run("furuta-calibration-2-joint", folder.path(), &["--max-evaluations", "150"]);
    assert!((3.3..3.7).contains(&objective(&two, "horizontal")), "{}", objective(&two, "horizontal"));
    assert!(objective(&two, "upright") > 100.0, "{}", objective(&two, "upright"));
}

#[test]
fn retuned_gains_are_within_a_thousandth_of_the_best_known_optimum() {
    let folder = tempfile::tempdir().unwrap();
    let result = run("pole-placement-retuning", folder.path(), &[]);
    // 1.11584, found by an independent program (SciPy); the published gains score 1.3283.
    assert_eq!(result["feasible"], true);
    assert!(worst(&result) < 1.11584 * 1.001, "{}", worst(&result));
}

#[test]
fn both_inertias_are_identified_from_one_step() {
    let folder = tempfile::tempdir().unwrap();
    let result = run("step-identification", folder.path(), &[]);
    // True values of the generator; for noise of 0.01 rad the standard deviations are 1.66 % and 0.026 %.
    let parameters = result["calibration"]["parameters"].as_array().unwrap();
    for (name, truth, part) in [("J", 0.0008, 0.0166), ("Ja", 0.02, 0.000_26)] {
        let found = parameters.iter().find(|p| p["name"] == name).unwrap();
        let (estimate, error) = (found["value"].as_f64().unwrap(), found["std_error"].as_f64().unwrap());
        assert!((estimate - truth).abs() < 4.0 * error, "{name}: {estimate} +- {error}");
        assert!((0.5..2.0).contains(&(error / truth / part)), "{name}: {error}");
    }
}

#[test]
fn a_violated_constraint_gives_status_1_and_a_result() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let impossible = "criteria.settling.demand=0.1";
    let arguments =
        ["run", "pid-design-constrained", "--set", impossible, "--max-evaluations", "300", "--quiet", "--out"];
    let mut command = mops(&arguments);
    command.arg(&out).assert().code(1).stdout("");
    let result: Value = serde_json::from_slice(&std::fs::read(out.join("result.json")).unwrap()).unwrap();
    assert_eq!(result["feasible"], false);
    assert!(result["violation"].as_f64().unwrap() > 1.0);
}

#[test]
fn every_solver_improves_the_shipped_design() {
    let others = [
        "cma-es",
        "differential-evolution",
        "genetic",
        "l-bfgs",
        "nelder-mead",
        "particle-swarm",
        "simulated-annealing",
    ];
    for solver in ["auto", "sqp", "pattern-search"].into_iter().chain(others) {
        let folder = tempfile::tempdir().unwrap();
        let found = worst(&run("pid-design", folder.path(), &["--solver", solver, "--max-evaluations", "2500"]));
        assert!(found < 0.9, "{solver}: {found}");
    }
}

#[test]
fn simulate_shows_the_published_criteria_at_the_published_parameters() {
    // Table 5.2 of the thesis in two of its cases, with the digits of an independent integration.
    let folder = tempfile::tempdir().unwrap();
    let values = ["--at", "k=5.52434", "--at", "Ti=5.93807 s", "--at", "Td=1.34739"];
    let mut command = mops(&["simulate", "pid-design-multi-case", "--out"]);
    let output = command.arg(folder.path()).args(values).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    for number in ["0.0736136", "15.0001", "0.274299", "23.3761", "0.394611", "13.2206"] {
        assert!(text.contains(number), "{number} is not in\n{text}");
    }
    let csv = std::fs::read_to_string(folder.path().join("loop-nominal.csv")).unwrap();
    assert!(csv.starts_with("t[s],r[1],y[1],e[1],u[1],d[1]\n"));
    assert_eq!(csv.lines().count(), 1002);
    assert!(folder.path().join("loop-nominal-y.svg").exists() && folder.path().join("loop-nominal-y.png").exists());
}

#[test]
fn check_list_and_describe_show_the_whole_catalogue() {
    for study in mops::catalogue().studies {
        mops(&["check", study.name()]).assert().code(0);
        mops(&["describe", study.name()]).assert().code(0);
    }
    let list = String::from_utf8(mops(&["list"]).output().unwrap().stdout).unwrap();
    let catalogue = mops::catalogue();
    let names = catalogue.models.iter().map(|k| k.name).chain(catalogue.criteria.iter().map(|k| k.name));
    for name in names.chain(catalogue.solvers.iter().map(|k| k.name)) {
        assert!(list.contains(name), "{name}");
        let page = String::from_utf8(mops(&["describe", name]).output().unwrap().stdout).unwrap();
        assert!(page.contains("Source:") || name == "auto", "the page of {name} gives its source");
    }
}

#[test]
fn check_lists_channels_of_experiments_and_fixed_parameters() {
    let shown = |arguments: &[&str]| {
        let output = mops(&[&["check", "furuta-discrepancy"], arguments].concat()).output().unwrap();
        let lines = String::from_utf8(output.stdout).unwrap();
        lines.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect::<Vec<String>>()
    };
    let has = |lines: &[String], row: &str| lines.iter().any(|line| line == row);
    let alike = shown(&[]);
    for row in ["pushed selection phi 401 4 s 0.003 rad", "theta 401 4 s 0.003 rad", "all a 0.0009035 kg m2"] {
        assert!(has(&alike, row), "{row}: {alike:?}");
    }
    let apart = shown(&["--set", "experiments.pushed.parameters.cp=1e-5"]);
    for row in ["all a 0.0009035 kg m2", "horizontal cp 0 N m", "pushed cp 1e-5 N m", "upright cp 0 N m"] {
        assert!(has(&apart, row), "{row}: {apart:?}");
    }
}

#[test]
fn every_effect_is_listed_and_described_with_its_parameters() {
    let list = String::from_utf8(mops(&["list", "effects"]).output().unwrap().stdout).unwrap();
    assert!(!list.contains("settling-time"), "{list}");
    for effect in mops::catalogue().effects {
        assert!(list.contains(effect.name()), "{}", effect.name());
    }
    let page = String::from_utf8(mops(&["describe", "stribeck-friction"]).output().unwrap().stdout).unwrap();
    for part in ["-c (1 + rise exp(-(v/vs)^2)) sgn(v)", "joint", "dissipative", "null value 0", "Source: B. Armstrong"]
    {
        assert!(page.contains(part), "{part}: {page}");
    }
}

#[test]
fn a_study_from_the_template_can_be_checked_and_run() {
    let folder = tempfile::tempdir().unwrap();
    mops(&["new", "mine"]).current_dir(&folder).assert().code(0);
    mops(&["check", "mine/study.toml"]).current_dir(&folder).assert().code(0);
    mops(&["new", "copy", "--from", "furuta-swing"]).current_dir(&folder).assert().code(0);
    mops(&["run", "copy", "--quiet", "--max-evaluations", "40"]).current_dir(&folder).assert().code(0);
    assert!(folder.path().join("results/copy/report.html").exists());
}

#[test]
fn the_schema_accepts_every_shipped_study_and_refuses_a_misspelt_one() {
    let schema: Value = serde_json::from_slice(&mops(&["schema"]).output().unwrap().stdout).unwrap();
    let validator = jsonschema::validator_for(&schema).unwrap();
    let template = include_str!("../crates/cli/src/new/pid.toml").as_bytes();
    let shipped = mops::studies::shipped();
    let shipped = shipped.iter().map(|study| study.file("study.toml").unwrap());
    for text in shipped.chain([template]) {
        let text = std::str::from_utf8(text).unwrap();
        let study: Value = toml::from_str(text).unwrap();
        let wrong: Vec<String> = validator.iter_errors(&study).map(|e| format!("{}: {e}", e.instance_path)).collect();
        assert!(wrong.is_empty(), "{wrong:?}\n{text}");
        for (from, to) in [("start", "strat"), ("demand", "demnad"), ("signal", "singal"), ("[models.", "[modles.")] {
            if text.contains(from) {
                let misspelt: Value = toml::from_str(&text.replace(from, to)).unwrap();
                assert!(!validator.is_valid(&misspelt), "{to}");
            }
        }
    }
}

#[test]
fn the_data_command_shows_columns_units_gaps_and_sample_time() {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..50)
        .map(|i| format!("{},{}\n", f64::from(i) * 0.1, if i == 7 { "".into() } else { i.to_string() }))
        .collect();
    std::fs::write(folder.path().join("d.csv"), format!("t[s],phi[rad]\n{rows}")).unwrap();
    let text = String::from_utf8(mops(&["data", "d.csv"]).current_dir(&folder).output().unwrap().stdout).unwrap();
    let phi: Vec<&str> = text.lines().find(|l| l.contains("phi")).unwrap().split_whitespace().collect();
    assert_eq!(&phi[..6], ["phi", "rad", "50", "1", "0", "49"]);
    assert!(text.contains("from 0 to 4.9, step 0.1 (median)"), "{text}");
}

#[test]
fn completions_are_written_for_every_shell() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = mops(&["completions", shell]).output().unwrap().stdout;
        assert!(String::from_utf8(script).unwrap().contains("simulate"), "{shell}");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_writes_the_best_point() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    // A swarm far too large to finish.
    let program = assert_cmd::cargo::cargo_bin!("mops");
    let mut child = std::process::Command::new(program)
        .args(["run", "pid-design-multi-case", "--max-evaluations", "100000000"])
        .args(["--set", "solver.particle-swarm.max-iterations=100000000", "--out"])
        .arg(&out)
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    // The first line is printed once the program listens.
    let mut line = String::new();
    let mut stdout = std::io::BufReader::new(child.stdout.take().unwrap());
    std::io::BufRead::read_line(&mut stdout, &mut line).unwrap();
    assert!(line.starts_with("pid-design-multi-case"), "{line}");
    assert!(std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let mut rest = String::new();
    std::io::Read::read_to_string(&mut stdout, &mut rest).unwrap();
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(4), "{status:?}");
    let result: Value = serde_json::from_slice(&std::fs::read(out.join("result.json")).unwrap()).unwrap();
    assert_eq!(result["stop"], "interrupted");
    assert!(result["evaluations"].as_u64().unwrap() >= 1);
}

/// Rate `k` of `x' = k u` from 0.5 at 0 s, calibrated with further keys of the experiment. The input is 3 until 1.5 s,
/// then -1, and is recorded so many steps of 0.1 s late; `k` is 0.7.
fn rate(keys: &str, input: &str, late: i32) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    let study = format!(
        r#"
        [study]
        name = "tank"
        task = "calibration"
        [models.tank.equations]
        states     = {{ x = "1" }}
        inputs     = {{ u = "1" }}
        parameters = {{ k = "1/s" }}
        der        = {{ x = "k*u" }}
        start      = {{ x = 0.5 }}
        [tuners]
        k = {{ start = 1.0, min = 0.1, max = 5.0 }}
        [experiments.e]
        file     = "e.csv"
        channels = {{ x = {{ column = "x", noise = 0.01 }} }}
        inputs   = {{ u = {{ column = "u", {input} }} }}
        {keys}
        [criteria]
        x = {{ normalised-error = {{ signal = "x" }} }}
    "#
    );
    let row = |i: i32| {
        let t = 0.1 * f64::from(i);
        let x = 0.5 + 0.7 * (3.0 * t.min(1.5) - (t - 1.5).max(0.0));
        format!("{t},{},{x}\n", if i < 15 + late { 3.0 } else { -1.0 })
    };
    let table = format!("t,u,x\n{}", (0..=60).map(row).collect::<String>());
    std::fs::write(folder.path().join("e.csv"), table).unwrap();
    let path = folder.path().join("study.toml");
    std::fs::write(&path, study).unwrap();
    run(path.to_str().unwrap(), folder.path(), &[])["tuners"][0]["value"].as_f64().unwrap()
}

/// Samples of the sensor are used from 2 s on; the recorded input also acts before.
#[test]
fn recorded_inputs_act_before_the_first_sample_used() {
    let k = rate("reset-time = false\nfrom = \"2 s\"", "hold = \"zero\"", 0);
    assert!((k - 0.7).abs() < 1e-7, "{k}");
}

#[test]
fn an_input_with_a_shift_acts_before_its_time_stamps() {
    let k = rate("", "hold = \"zero\", shift = \"-200 ms\"", 2);
    assert!((k - 0.7).abs() < 1e-7, "{k}");
}
