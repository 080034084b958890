//! Limits: signals, time limits, devices as files, long lines, control characters, numbers that are not finite.

use std::collections::HashSet;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use assert_cmd::cargo::cargo_bin;
use serde_json::Value;

fn mops(arguments: &[&str], folder: &Path) -> Output {
    Command::new(cargo_bin!("mops")).args(arguments).current_dir(folder).output().unwrap()
}

fn message(output: &Output) -> String {
    [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text).into_owned()).concat()
}

fn result(out: &Path) -> Value {
    serde_json::from_slice(&fs::read(out.join("result.json")).unwrap()).unwrap()
}

/// Study whose only state oscillates `turns` times in 1 s; one period takes about 30 steps.
fn turning(turns: f64) -> String {
    let rate = turns * std::f64::consts::TAU;
    format!(
        "[study]\nname = \"turning\"\n[models.m.equations]\nstates = {{ x = \"1\", v = \"1\" }}\nparameters = {{ k = \"1\" }}\n\
         der = {{ x = \"{rate:e}*v\", v = \"-{rate:e}*x\" }}\nstart = {{ x = 1 }}\nhorizon = \"1 s\"\n\
         tolerance = {{ max-steps = 1000000000000 }}\n[tuners]\nk = {{ start = 1.0, min = 0.1, max = 10.0 }}\n\
         [criteria]\nc = {{ final-value = {{ signal = \"x\" }}, demand = 1.0 }}\n"
    )
}

#[cfg(unix)]
#[test]
fn every_terminating_signal_interrupts_a_simulation_and_gives_status_4() {
    let root = tempfile::tempdir().unwrap();
    // One simulation takes hours.
    fs::write(root.path().join("long.toml"), turning(1e9)).unwrap();
    let long = ["run", "long.toml"];
    let search = ["run", "pid-design", "--solver", "genetic", "--max-evaluations", "100000000"];
    for (signal, arguments) in
        [("INT", &long[..]), ("TERM", &long), ("HUP", &long), ("TERM", &search), ("HUP", &search)]
    {
        let out = root.path().join(format!("{signal}-{}", arguments.len()));
        let mut child = Command::new(cargo_bin!("mops"))
            .args(arguments)
            .arg("--out")
            .arg(&out)
            .current_dir(root.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // The first line is printed once the program listens.
        let (mut stdout, mut line) = (BufReader::new(child.stdout.take().unwrap()), String::new());
        stdout.read_line(&mut line).unwrap();
        assert!(
            Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status().unwrap().success()
        );
        let mut rest = String::new();
        stdout.read_to_string(&mut rest).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(4), "{signal}: {rest}");
        let result = result(&out);
        assert_eq!(result["stop"], "interrupted");
        // The interrupted simulation counts neither as an evaluation nor as a failure.
        assert_eq!(result["failures"], Value::Array(Vec::new()));
        assert_eq!(result["evaluations"] == 0, arguments.len() == long.len(), "{result}");
        assert!(out.join("report.html").is_file());
        let kept = rusqlite::Connection::open(out.join("evaluations.sqlite")).unwrap();
        let count = |sql: &str| kept.query_row(sql, [], |row| row.get::<_, i64>(0)).unwrap();
        assert!(count("SELECT count(*) FROM points") >= result["evaluations"].as_i64().unwrap());
        assert_eq!(count("SELECT count(*) FROM points WHERE failures IS NOT NULL"), 0);
    }
}

#[test]
fn a_time_limit_ends_every_task_like_a_spent_budget() {
    let root = tempfile::tempdir().unwrap();
    fs::write(root.path().join("long.toml"), turning(1e9)).unwrap();
    // Task, and true if it has a result after a short time.
    let tasks: [(&[&str], bool); 9] = [
        (&["run", "long.toml"], false),
        (&["run", "pid-design", "--solver", "genetic", "--max-evaluations", "100000000"], true),
        (&["pareto", "pid-design", "--max-evaluations", "100000000", "--solver", "nsga2"], true),
        (
            &[
                "run",
                "pid-design",
                "--set",
                "study.task=\"sweep\"",
                "--set",
                "sweep.x={tuner=\"k\",points=1000}",
                "--set",
                "sweep.y={tuner=\"Ti\",points=1000}",
                "--set",
                "sweep.at=\"start\"",
            ],
            true,
        ),
        (&["run", "pid-robust", "--set", "study.task=\"monte-carlo\"", "--set", "monte-carlo.samples=1000000"], true),
        (
            &[
                "run",
                "pid-worst-case",
                "--set",
                "study.task=\"sensitivity\"",
                "--set",
                "sensitivity.method=\"sobol\"",
                "--set",
                "sensitivity.samples=100000",
            ],
            true,
        ),
        (&["run", "pid-worst-case", "--set", "worst-case.starts=1000", "--set", "worst-case.samples=4096"], true),
        (&["run", "furuta-calibration", "--solver", "genetic", "--max-evaluations", "100000000"], true),
        (&["diagnose", "furuta-discrepancy"], false),
    ];
    for (i, (task, known)) in tasks.into_iter().enumerate() {
        let out = format!("out{i}");
        let output = mops(&[task, &["--quiet", "--out", &out, "--time-limit", "0.5 s"]].concat(), root.path());
        assert!(matches!(output.status.code(), Some(0 | 1 | 3)), "{task:?}: {}", message(&output));
        let result = result(&root.path().join(&out));
        assert_eq!(result["stop"], "time-limit", "{task:?}");
        assert_eq!(result["evaluations"].as_u64().unwrap() > 0, known, "{task:?}");
        let warnings = result["warnings"].to_string();
        assert!(warnings.contains("stopped at the time limit of 0.5 s"), "{task:?}: {warnings}");
        let page = fs::read_to_string(root.path().join(out).join("report.html")).unwrap();
        assert!(!page.contains("verdict good"), "{task:?}");
    }
    for wrong in ["0", "-1 s", "3 m", "soon"] {
        let limit = format!("--time-limit={wrong}");
        assert_eq!(mops(&["run", "pid-design", &limit], root.path()).status.code(), Some(2), "{wrong}");
    }
}

#[test]
fn a_run_stopped_by_its_time_limit_resumes_to_the_result_of_an_unlimited_run() {
    let root = tempfile::tempdir().unwrap();
    let search =
        ["run", "pid-design-multi-case", "--quiet", "--solver", "genetic", "--max-evaluations", "1500", "--out"];
    mops(&[&search[..], &["whole"]].concat(), root.path());
    mops(&[&search[..], &["parts", "--time-limit", "0.05"]].concat(), root.path());
    assert!(result(&root.path().join("parts"))["evaluations"].as_u64().unwrap() < 1500);
    let report = mops(&["report", "parts"], root.path());
    assert!(report.status.success(), "{}", message(&report));
    mops(&[&search[..], &["parts", "--resume"]].concat(), root.path());
    let [mut whole, mut parts] = ["whole", "parts"].map(|out| result(&root.path().join(out)));
    for result in [&mut whole, &mut parts] {
        result.as_object_mut().unwrap().remove("seconds");
    }
    assert_eq!(parts, whole);
}

#[test]
fn without_an_output_folder_every_study_name_gives_one_folder_below_results() {
    let root = tempfile::tempdir().unwrap();
    let text = fs::read_to_string("studies/pid-design/study.toml").unwrap();
    let below = root.path().join("a/b/c");
    fs::create_dir_all(&below).unwrap();
    let absolute = root.path().join("absolute").display().to_string();
    let names =
        ["../../../escaped", "..", ".", "", "/", "a/../../b", "x/y", "~", "con\\\\..\\\\d", "..\\u0000", &absolute];
    for name in names {
        let named = text.replacen("name = \"pid-design\"", &format!("name = \"{name}\""), 1);
        fs::write(below.join("study.toml"), named).unwrap();
        let output = mops(&["run", "study.toml", "--quiet", "--max-evaluations", "1"], &below);
        assert!(output.status.success(), "{name}: {}", message(&output));
        let results = below.join("results");
        let folders: Vec<_> = fs::read_dir(&results).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert!(folders.len() == 1 && folders[0].join("result.json").is_file(), "{name}: {folders:?}");
        fs::remove_dir_all(&results).unwrap();
        // No other files were created.
        for (folder, expected) in
            [(root.path(), 1), (&root.path().join("a"), 1), (&root.path().join("a/b"), 1), (&below, 1)]
        {
            assert_eq!(fs::read_dir(folder).unwrap().count(), expected, "{name}: {}", folder.display());
        }
    }
}

#[test]
fn an_error_in_a_long_line_is_shown_with_its_surroundings_only() {
    let root = tempfile::tempdir().unwrap();
    let at = |name: &str| root.path().join(name);
    let study = |blanks: usize| {
        let der = format!("-x{}+$", " ".repeat(blanks));
        format!("[study]\nname = \"x\"\n[models.m.equations]\nstates = {{ x = \"1\" }}\nder = {{ x = \"{der}\" }}\n")
    };
    for blanks in [10, 199, 201, 1000, 65_000, 65_535, 66_000, 200_000, 900_000] {
        fs::write(at("study.toml"), study(blanks)).unwrap();
        let text = message(&mops(&["check", "study.toml"], root.path()));
        assert!(
            text.contains(&format!("study.toml:5:{}", 17 + blanks)) && text.contains("+$"),
            "{blanks}: {text:.500}"
        );
        assert!(text.len() < 5000, "{blanks}: {}", text.len());
    }
    let row = |last: &str| vec!["1.0000000"; 8999].join(",") + "," + last + "\n";
    let header: Vec<String> = (0..9000).map(|i| format!("c{i}")).collect();
    fs::write(at("wide.csv"), header.join(",") + "\n" + &row("1") + &row("1e999")).unwrap();
    let output = mops(&["data", "wide.csv"], root.path());
    assert!(output.status.code() == Some(2) && message(&output).contains("1e999"), "{}", message(&output));
    // Characters of several bytes, and an error at the end.
    fs::write(at("study.toml"), format!("[study]\nname = \"{}\" é", "é".repeat(70_000))).unwrap();
    assert!(message(&mops(&["check", "study.toml"], root.path())).contains("study.toml:2:"));
}

#[test]
fn no_control_character_reaches_the_terminal() {
    let root = tempfile::tempdir().unwrap();
    let text = fs::read_to_string("studies/pid-design/study.toml").unwrap();
    let evil = "\\u001b]0;pwned\\u0007\\u001b[2J\\u009b31m\\u202e";
    let named = text
        .replacen("name = \"pid-design\"", &format!("name = \"{evil}\""), 1)
        .replace("nominal", &format!("\"{evil}\""))
        .replace("[cases]\n", "[cases]\n# \u{1b}[2J\n");
    let named = named.replace("# \u{1b}[2J\n", "");
    fs::write(root.path().join("study.toml"), &named).unwrap();
    fs::write(root.path().join("wrong.toml"), "[study]\nname = \"a\"\nnmae = \"\u{1b}[2J\"\n\u{1b}\n").unwrap();
    fs::write(root.path().join("a.csv"), "t,\u{1b}[2Jb\n0,1\n1,2\n").unwrap();
    let runs: [&[&str]; 10] = [
        &["check", "study.toml"],
        &["run", "study.toml", "--out", "out", "--max-evaluations", "20"],
        &["run", "study.toml", "--out", "out", "--max-evaluations", "20", "--resume"],
        &["simulate", "study.toml"],
        &["history", "."],
        &["history", ".", "--json"],
        &["compare", "out", "out"],
        &["report", "out"],
        &["check", "wrong.toml"],
        &["data", "a.csv"],
    ];
    for arguments in runs {
        let output = mops(arguments, root.path());
        let text = message(&output);
        let acts = |c: char| (c.is_control() && c != '\n' && c != '\t') || c == '\u{202e}';
        assert!(!text.contains(acts), "{arguments:?}: {text:?}");
        assert!(!text.is_empty(), "{arguments:?}");
    }
    let listed: Value = serde_json::from_slice(&mops(&["history", ".", "--json"], root.path()).stdout).unwrap();
    assert_eq!(listed[0]["study"], "\u{1b}]0;pwned\u{7}\u{1b}[2J\u{9b}31m\u{202e}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_failed_print_is_an_error_and_the_result_is_kept() {
    let root = tempfile::tempdir().unwrap();
    let full = |arguments: &[&str]| {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        Command::new(cargo_bin!("mops")).args(arguments).current_dir(root.path()).stdout(full).output().unwrap()
    };
    let run = ["run", "pid-design", "--max-evaluations", "20", "--out", "out"];
    for arguments in [
        &[&run[..], &["--json"]].concat()[..],
        &run,
        &["schema"],
        &["list"],
        &["describe", "pid-loop"],
        &["check", "pid-design"],
        &["history", "."],
        &["completions", "bash"],
    ] {
        let output = full(arguments);
        assert_eq!(output.status.code(), Some(3), "{arguments:?}");
        assert!(message(&output).contains("cannot write to standard output"), "{arguments:?}: {}", message(&output));
    }
    assert_eq!(result(&root.path().join("out"))["evaluations"], 20);
    // A reader that closes the pipe is not an error.
    let mut child = Command::new(cargo_bin!("mops")).arg("schema").stdout(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

#[cfg(unix)]
#[test]
fn devices_and_pipes_are_refused_as_data_files() {
    let root = tempfile::tempdir().unwrap();
    let at = |name: &str| root.path().join(name);
    assert!(Command::new("mkfifo").arg(at("pipe.csv")).status().unwrap().success());
    std::os::unix::fs::symlink("/dev/zero", at("zero.csv")).unwrap();
    let text = fs::read_to_string("studies/step-identification/study.toml").unwrap();
    let place = text.find("file").unwrap();
    let line = &text[place..place + text[place..].find('\n').unwrap()];
    for file in ["pipe.csv", "zero.csv", "/dev/zero", "/dev/tty", "."] {
        if file != "." {
            let output = mops(&["data", file], root.path());
            assert_eq!(output.status.code(), Some(2), "{file}");
        }
        fs::write(at("study.toml"), text.replacen(line, &format!("file = \"{file}\""), 1)).unwrap();
        let output = mops(&["check", "study.toml"], root.path());
        assert_eq!(output.status.code(), Some(2), "{file}: {}", message(&output));
        assert!(message(&output).contains("study.toml:"), "{file}: {}", message(&output));
    }
    let output = mops(&["check", "/dev/zero"], root.path());
    assert!(output.status.code() == Some(2) && message(&output).contains("not a study"), "{}", message(&output));
}

#[test]
fn numbers_that_are_not_finite_are_refused_with_their_position() {
    let root = tempfile::tempdir().unwrap();
    let text = fs::read_to_string("studies/tank-level/study.toml").unwrap();
    fs::write(root.path().join("study.toml"), &text).unwrap();
    for setting in [
        "models.plant.equations.start={h1=\"1e400\"}",
        "tuners.k.start=inf",
        "tuners.k.max=1e999",
        "criteria.level.demand=nan",
    ] {
        let output = mops(&["check", "study.toml", "--set", setting], root.path());
        assert_eq!(output.status.code(), Some(2), "{setting}: {}", message(&output));
    }
    let own = turning(1.0)
        .replace("parameters = { k = \"1\" }", "parameters = { k = \"1\", j = \"1\" }\ninputs = { u = \"1\" }");
    for (case, fits) in [
        ("j = 2.0", true),
        ("j = inf", false),
        ("j = -inf", false),
        ("j = nan", false),
        ("j = \"1e400\"", false),
        ("j = 1e400", false),
        ("j = 1, inputs = { u = { step = { after = 1.0 } } }", true),
        ("j = 1, inputs = { u = { step = { after = nan } } }", false),
        ("j = 1, inputs = { u = { step = { after = -inf } } }", false),
        ("j = 1, inputs = { u = { step = { time = inf, after = 1.0 } } }", false),
        ("j = 1, inputs = { u = { constant = inf } }", false),
        ("j = 1, inputs = { u = { sine = { amplitude = 1.0, frequency = \"1e999 Hz\" } } }", false),
    ] {
        fs::write(root.path().join("own.toml"), format!("{own}[cases]\nc = {{ {case} }}\n")).unwrap();
        let output = mops(&["check", "own.toml"], root.path());
        assert_eq!(output.status.success(), fits, "{case}: {}", message(&output));
    }
    // An integral time may be infinite: there is then no integral action.
    assert!(mops(&["check", "pid-design", "--set", "tuners.Ti.start=2.0"], root.path()).status.success());
}

#[test]
fn a_picked_study_overwrites_no_existing_file() {
    let root = tempfile::tempdir().unwrap();
    let found = mops(&["pareto", "pid-design", "--points", "3", "--out", "out", "--quiet"], root.path());
    assert!(matches!(found.status.code(), Some(0 | 1)), "{}", message(&found));
    let pick = ["pick", "out", "--no-refine", "--demand", "settling=14"];
    let name = |output: &Output| message(output).lines().last().unwrap().to_owned();
    assert!(name(&mops(&pick, root.path())).ends_with("picked.toml"));
    fs::write(root.path().join("out/picked.toml"), "worked on").unwrap();
    assert!(name(&mops(&pick, root.path())).ends_with("picked-2.toml"));
    assert_eq!(fs::read_to_string(root.path().join("out/picked.toml")).unwrap(), "worked on");
    let refused = mops(&[&pick[..], &["--out", "out/picked.toml"]].concat(), root.path());
    assert!(refused.status.code() == Some(2) && message(&refused).contains("already exists"), "{}", message(&refused));
}

#[test]
fn an_empty_table_on_the_command_line_replaces_the_table_of_the_study() {
    let root = tempfile::tempdir().unwrap();
    for (command, study) in
        [("run", "pid-design"), ("pareto", "multi-model"), ("pareto", "pid-design"), ("check", "tank-level")]
    {
        for table in ["criteria={}", "tuners={}", "models={}"] {
            let output = mops(&[command, study, "--set", table], root.path());
            // A study without criteria is right, but there is nothing to solve.
            let expected = if command == "check" && table == "criteria={}" { 0 } else { 2 };
            assert_eq!(output.status.code(), Some(expected), "{command} {study} {table}: {}", message(&output));
            assert!(!message(&output).contains("panicked"), "{}", message(&output));
        }
    }
    // `solver` may be empty: the front is computed, and the study written for `pick` is valid.
    let output =
        mops(&["pareto", "pid-design", "--set", "solver={}", "--points", "3", "--out", "out", "--quiet"], root.path());
    assert!(output.status.success(), "{}", message(&output));
    let output = mops(&["check", "out/study.toml"], root.path());
    assert!(output.status.success(), "{}", message(&output));
}

#[test]
fn a_linearisation_ends_at_its_time_limit() {
    let root = tempfile::tempdir().unwrap();
    // A rod of 400 nodes: computing its poles takes longer than the limit.
    let text = "[study]\nname = \"rod\"\n[models.rod.equations]\nstates = { \"T[1..400]\" = \"1\" }\ninputs = { u = \"1\" }\n\
                parameters = { k = \"1/s\" }\nhorizon = \"1 s\"\n[models.rod.equations.der]\n\"T[1]\" = \"k*(u - 2*T[1] + T[2])\"\n\
                \"T[i]\" = \"k*(T[i-1] - 2*T[i] + T[i+1])\"\n\"T[400]\" = \"k*(T[399] - 2*T[400])\"\n\
                [tuners]\nk = { start = 1.0, min = 0.1, max = 10.0 }\n[criteria]\nend = { final-value = { signal = \"T[400]\" }, demand = 1.0 }\n";
    fs::write(root.path().join("study.toml"), text).unwrap();
    let output = mops(&["linearise", "study.toml", "--out", "out", "--time-limit", "0.02"], root.path());
    assert_eq!(output.status.code(), Some(3), "{}", message(&output));
    assert!(message(&output).contains("not finished within the time limit of 0.02 s"), "{}", message(&output));
    assert!(!root.path().join("out").exists());
    assert_eq!(mops(&["check", "study.toml"], root.path()).status.code(), Some(0));
}

#[test]
fn cases_with_colliding_file_names_have_separate_files() {
    let root = tempfile::tempdir().unwrap();
    let names = ["load 0.5", "load 0.6", "load-0.5", "LOAD 0.5", "a/b", "a-b"];
    let cases: String = names.iter().map(|name| format!("\"{name}\" = {{ a = 0.0, b = -4.0, c = -1.0 }}\n")).collect();
    let text = fs::read_to_string("studies/pid-design/study.toml").unwrap();
    let case = text.lines().find(|line| line.starts_with("nominal")).unwrap();
    fs::write(root.path().join("study.toml"), text.replacen(case, &cases, 1)).unwrap();
    let output = mops(&["simulate", "study.toml", "--out", "out", "--samples", "3"], root.path());
    assert!(output.status.success(), "{}", message(&output));
    // One table for each of the six cases, one plot for each of the five signals in each.
    for (end, count) in [(".csv", 6), (".svg", 30), (".png", 30)] {
        let files = fs::read_dir(root.path().join("out")).unwrap();
        let names: HashSet<String> = files
            .map(|entry| entry.unwrap().file_name().to_string_lossy().to_lowercase())
            .filter(|file| file.ends_with(end))
            .collect();
        assert_eq!(names.len(), count, "{end}: {names:?}");
    }
}

#[test]
fn a_refused_run_creates_no_folder() {
    let root = tempfile::tempdir().unwrap();
    for more in
        [&["--reuse", "nowhere"][..], &["--solver", "nonsense"], &["--set", "study.task=excitation", "--resume"]]
    {
        let output = mops(&[&["run", "tank-level", "--out", "out"], more].concat(), root.path());
        assert_eq!(output.status.code(), Some(2), "{more:?}: {}", message(&output));
        assert!(!root.path().join("out").exists(), "{more:?}");
    }
}
