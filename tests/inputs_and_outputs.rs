//! Files of a command: no output replaces an input, no link leads an output elsewhere, two studies never share a
//! folder, and a study reads files of its own folder only.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use assert_cmd::cargo::cargo_bin;
use tempfile::TempDir;

/// Calibration of `dx/dt = k u` from a recording of one experiment.
const CALIBRATION: &str = r#"
[study]
name = "rig"
task = "calibration"
[models.rig.equations]
states = { x = "1" }
inputs = { u = "1" }
parameters = { k = "1/s" }
der = { x = "k*u" }
[tuners]
k = { start = 0.5, min = 0.1, max = 2 }
[experiments.step]
file = "FILE"
channels = { x = "x" }
inputs = { u = "u" }
[criteria]
x = { fit = { signal = "x" }, demand = 1 }
"#;

const RECORDING: &str = "t[s],u[1],x[1]\n0,1,0\n0.1,1,0.1\n0.2,1,0.2\n0.3,1,0.3\n0.4,1,0.4\n0.5,1,0.5\n";

/// Design of two tuners.
const DESIGN: &str = r#"
[study]
name = "NAME"
[models.m.equations]
states = { x = "1" }
parameters = { k = "1/s", l = "1/s" }
der = { x = "-k*x + l" }
start = { x = 1 }
horizon = "1 s"
[tuners]
k = { start = 1, min = 0.1, max = 2 }
l = { start = 1, min = 0.1, max = 2 }
[criteria]
a = { final-value = { signal = "x" }, demand = 1 }
b = { maximum-rate = { signal = "x" }, demand = 1 }
"#;

const FEW: [&str; 3] = ["--max-evaluations", "30", "--quiet"];

struct Place(TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::create_dir_all(self.at(name).parent().unwrap()).unwrap();
        fs::write(self.at(name), text).unwrap();
    }

    fn text(&self, name: &str) -> String {
        fs::read_to_string(self.at(name)).unwrap()
    }

    /// Writes a calibration whose recording has this name.
    fn calibration(&self, file: &str) {
        self.write("study.toml", &CALIBRATION.replace("FILE", file));
        self.write(file, RECORDING);
    }

    fn mops(&self, arguments: &[&str]) -> Run {
        Run::of(Command::new(cargo_bin!("mops")).args(arguments).current_dir(self.0.path()).output().unwrap())
    }
}

struct Run {
    status: i32,
    message: String,
}

impl Run {
    fn of(output: Output) -> Self {
        let message = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned()).concat();
        Self { status: output.status.code().unwrap_or(-1), message }
    }

    #[track_caller]
    fn ends_with(self, status: i32) -> String {
        assert_eq!(self.status, status, "{}", self.message);
        self.message
    }

    #[track_caller]
    fn refused_for(self, word: &str) {
        let message = self.ends_with(2);
        assert!(message.contains(word), "{message}");
    }
}

#[test]
fn no_command_overwrites_the_study_that_it_reads() {
    for (file, command) in [
        ("study.toml", &["pareto", "--set", "criteria.late={fit={signal=\"x\"},demand=2}"][..]),
        ("repaired.toml", &["diagnose"]),
        ("result.json", &["run"]),
        ("report.html", &["calibrate"]),
        ("evaluations.csv", &["run"]),
        ("samples.csv", &["monte-carlo", "--set", "uncertain.k={min=0.4,max=0.6}"]),
        ("evaluations.lock", &["run"]),
        ("evaluations.sqlite", &["run"]),
        (".new-evaluations.sqlite", &["run"]),
        ("linearised.json", &["linearise"]),
        ("rig-step.csv", &["simulate"]),
        ("bench.html", &["bench", "--solver", "sqp"]),
    ] {
        let place = Place::new();
        place.calibration("data.csv");
        let text = place.text("study.toml");
        fs::rename(place.at("study.toml"), place.at(file)).unwrap();
        place.mops(&[command, &[file, "--out", "."]].concat()).refused_for("would overwrite the study");
        assert_eq!(place.text(file), text, "{file}");
        // In another folder nothing is in the way.
        let again = place.mops(&["check", file]);
        again.ends_with(0);
    }
}

#[test]
fn no_command_overwrites_the_data_of_its_study() {
    for (file, command) in [
        ("evaluations.csv", "run"),
        ("result.json", "sensitivity"),
        ("plots/a.svg", "run"),
        ("plots/a.png", "calibrate"),
        ("predictions/step.csv", "diagnose"),
        ("diagnosis.toml", "diagnose"),
        ("evaluations.sqlite-wal", "run"),
        ("evaluations.ended.json", "run"),
        ("rig-step.csv", "simulate"),
        ("rig-step-x.svg", "simulate"),
        ("bode-phase-x-u.svg", "linearise"),
        ("runs.csv", "bench --solver sqp"),
    ] {
        let place = Place::new();
        place.calibration(file);
        let command = command.split(' ').chain(["study.toml", "--out", "."]).collect::<Vec<_>>();
        place.mops(&command).refused_for(&format!("the data file `{file}`"));
        assert_eq!(place.text(file), RECORDING, "{file}");
        assert!(!place.at("evaluations.sqlite").exists() || file == "evaluations.sqlite", "{file}");
    }
    // Names that a task does not write are free.
    let place = Place::new();
    place.calibration("predictions/step.csv");
    place.mops(&[&["run", "study.toml", "--out", "."], &FEW[..]].concat()).ends_with(0);
    assert_eq!(place.text("predictions/step.csv"), RECORDING);
}

#[test]
fn reports_comparisons_and_plots_of_data_overwrite_no_input() {
    let place = Place::new();
    place.calibration("plots/a.svg");
    place.mops(&[&["run", "study.toml", "--out", "r"], &FEW[..]].concat()).ends_with(0);
    fs::rename(place.at("r/evaluations.sqlite"), place.at("evaluations.sqlite")).unwrap();
    fs::rename(place.at("r/result.json"), place.at("result.json")).unwrap();
    place.mops(&["report", "."]).refused_for("the data file `plots/a.svg`");
    for out in ["result.json", "evaluations.sqlite", "study.toml", "plots/a.svg"] {
        let before = fs::read(place.at(out)).unwrap();
        place.mops(&["compare", ".", ".", "--out", out]).refused_for("would overwrite");
        assert!(fs::read(place.at(out)).unwrap() == before, "{out}");
    }
    place.mops(&[&["run", "study.toml", "--out", "r"], &FEW[..]].concat()).ends_with(0);
    let plot = fs::read_dir(place.at("r/plots"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .find(|name| Path::new(name).extension().is_some_and(|end| end == "svg"));
    let plot = format!("r/plots/{}", plot.unwrap().to_string_lossy());
    for out in ["r/report.html", "r/evaluations.csv", "./r/../r/report.html", &plot] {
        let before = fs::read(place.at(out)).unwrap();
        place.mops(&["compare", "r", "r", "--out", out]).refused_for("would overwrite an output of the run in r");
        assert!(fs::read(place.at(out)).unwrap() == before, "{out}");
    }
    // A page of its own may be written again.
    for _ in 0..2 {
        place.mops(&["compare", "r", "r", "--out", "r/comparison.html"]).ends_with(0);
    }
    place.mops(&["data", "plots/a.svg", "--plot", "plots/a.svg"]).ends_with(0);
    place.write("columns-x.svg", RECORDING);
    place.mops(&["data", "columns-x.svg", "--plot", "columns.svg"]).refused_for("would overwrite the data file");
    assert_eq!(place.text("columns-x.svg"), RECORDING);
}

#[cfg(unix)]
mod links {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn an_input_is_known_through_links() {
        for (link, target, out) in [
            // The recording is a link, and its target has the name of an output, or the link has.
            ("data.csv", "evaluations.csv", "."),
            ("evaluations.csv", "real/data.csv", "."),
            // The folder of the outputs is reached through a link.
            ("here", ".", "here"),
        ] {
            let place = Place::new();
            place.calibration(if link == "here" { "evaluations.csv" } else { link });
            if link != "here" {
                fs::create_dir_all(place.at(target).parent().unwrap()).unwrap();
                fs::rename(place.at(link), place.at(target)).unwrap();
            }
            symlink(target, place.at(link)).unwrap();
            place.mops(&[&["run", "study.toml", "--out", out], &FEW[..]].concat()).refused_for("would overwrite");
            assert!(place.at(link).is_symlink());
        }
        let place = Place::new();
        place.calibration("plots/data.csv");
        fs::rename(place.at("plots"), place.at("real")).unwrap();
        symlink("real", place.at("plots")).unwrap();
        place.mops(&[&["run", "study.toml", "--out", "."], &FEW[..]].concat()).refused_for("would overwrite");
    }

    #[test]
    fn links_to_folders_are_replaced_and_what_they_lead_to_stays() {
        let place = Place::new();
        place.calibration("data.csv");
        place.write("elsewhere/convergence.svg", "mine");
        fs::create_dir(place.at("r")).unwrap();
        symlink("../elsewhere", place.at("r/plots")).unwrap();
        place.mops(&[&["run", "study.toml", "--out", "r"], &FEW[..]].concat()).ends_with(0);
        assert!(!place.at("r/plots").is_symlink() && place.at("r/plots/convergence.svg").exists());
        assert_eq!(fs::read_dir(place.at("elsewhere")).unwrap().count(), 1);
        assert_eq!(place.text("elsewhere/convergence.svg"), "mine");
        // The shipped study brings its data in a folder of their own.
        place.write("elsewhere/upright.csv", "mine");
        fs::create_dir(place.at("front")).unwrap();
        symlink("../elsewhere", place.at("front/data")).unwrap();
        let shipped = ["pareto", "furuta-calibration", "--points", "3", "--max-evaluations", "30", "--out", "front"];
        let run = place.mops(&shipped);
        assert!(!place.at("front/data").is_symlink() && place.at("front/data/upright.csv").exists(), "{}", run.message);
        assert_eq!(place.text("elsewhere/upright.csv"), "mine");
    }

    #[test]
    fn without_out_no_link_is_followed() {
        for link in ["results", "results/rig"] {
            let place = Place::new();
            place.calibration("data.csv");
            fs::create_dir(place.at("elsewhere")).unwrap();
            fs::create_dir_all(place.at(link).parent().unwrap()).unwrap();
            symlink(place.at("elsewhere"), place.at(link)).unwrap();
            let command = [&["run", "study.toml"], &FEW[..]].concat();
            place.mops(&command).refused_for("--out results/rig");
            assert_eq!(fs::read_dir(place.at("elsewhere")).unwrap().count(), 0);
            place.mops(&[&command[..], &["--out", "results/rig"]].concat()).ends_with(0);
        }
    }
}

#[test]
fn two_studies_never_share_the_default_folder() {
    let place = Place::new();
    let run = |name: &str, file: &str| {
        place.write(file, &DESIGN.replace("NAME", name));
        place.mops(&[&["run", file], &FEW[..]].concat())
    };
    for name in ["日本", "中国", "Übung", "bung", "Δx", "x", "a b"] {
        assert_ne!(run(name, "s.toml").status, 2, "{name}");
    }
    run("a-b", "s.toml").refused_for("has a run of another study, `a b`");
    run("a b", "t.toml").refused_for("another study of this name");
    // The same study runs again, also where its file was moved.
    assert_ne!(run("a b", "s.toml").status, 2);
    fs::remove_file(place.at("s.toml")).unwrap();
    assert_ne!(run("a b", "moved.toml").status, 2);
    let mut names: Vec<String> = fs::read_dir(place.at("results"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["a-b", "bung", "x", "Übung", "Δx", "中国", "日本"]);
    // Who names the folder decides.
    place.write("s.toml", &DESIGN.replace("NAME", "a-b"));
    assert_ne!(place.mops(&[&["run", "s.toml", "--out", "results/a-b"], &FEW[..]].concat()).status, 2);
}

#[test]
fn a_study_reads_files_outside_of_its_folder_only_where_the_command_line_allows_it() {
    let place = Place::new();
    place.write("secret.csv", "root:x:0\nnot,a,table of SECRETS\n");
    place.write("shared/data.csv", RECORDING);
    place.write("study/data/own.csv", RECORDING);
    let absolute = place.at("secret.csv").display().to_string();
    for path in ["../secret.csv", "../nothing.csv", "data/../../secret.csv", absolute.as_str(), "/etc/passwd"] {
        place.write("study/study.toml", &CALIBRATION.replace("FILE", path));
        let message = place.mops(&["check", "study/study.toml"]).ends_with(2);
        assert!(
            message.contains("outside of the folder of the study") && message.contains("--allow-read DIR"),
            "{message}"
        );
        assert!(!message.contains("SECRETS") && !message.contains("root:"), "{message}");
    }
    // Every place of a study that names files.
    let files = CALIBRATION.replace("file = \"FILE\"", "files = \"../*.csv\"");
    let channel = CALIBRATION
        .replace("FILE", "own.csv")
        .replace("{ x = \"x\" }", "{ x = { file = \"../secret.csv\", column = \"a\" } }");
    let table = CALIBRATION.replace("FILE", "own.csv").replace("\"k*u\"", "\"k*u*T(x)\"")
        + "[models.rig.equations.tables.T]\nfile = \"../secret.csv\"\nx = \"a\"\ny = \"b\"\n";
    let input = DESIGN.replace("-k*x + l", "-k*x + l*u").replace("start = { x", "inputs = { u = \"1\" }\nstart = { x")
        + "[cases.c]\ninputs = { u = { file = { path = \"../secret.csv\", column = \"a\" } } }\n";
    place.write("study/own.csv", RECORDING);
    for text in [files, channel, table, input] {
        place.write("study/study.toml", &text);
        let message = place.mops(&["check", "study/study.toml"]).ends_with(2);
        assert!(message.contains("outside of the folder of the study") && !message.contains("SECRETS"), "{message}");
    }
    place.write("study/study.toml", &CALIBRATION.replace("FILE", "../shared/data.csv"));
    place.mops(&["check", "study/study.toml", "--allow-read", "other"]).ends_with(2);
    place.mops(&["--allow-read", "other", "check", "study/study.toml", "--allow-read", "shared"]).ends_with(0);
    let command = ["run", "study/study.toml", "--out", "r", "--allow-read", "shared"];
    place.mops(&[&command, &FEW[..]].concat()).ends_with(0);
    place.mops(&["report", "r"]).refused_for("--allow-read");
    place.mops(&["report", "r", "--allow-read", "shared"]).ends_with(0);
}

/// A project with a calibration, its data, a front and the study picked from it, below the folder of the study.
fn project(place: &Place, out: &str) -> String {
    place.write("project/data/step.csv", RECORDING);
    let second = "[criteria.late]\nfit = { signal = \"x\" }\nfrom = 0.2\ndemand = 2\n";
    place.write("project/rig.toml", &(CALIBRATION.replace("FILE", "data/step.csv") + second));
    let front = ["pareto", "project/rig.toml", "--points", "3", "--max-evaluations", "60", "--out", out];
    let message = place.mops(&front).ends_with(0);
    let pick = place.mops(&["pick", out, "--demand", "late=1", "--no-refine", "--allow-read", "project"]);
    assert_eq!(pick.message.contains("use it with --allow-read"), message.contains("use it with --allow-read"));
    assert!(place.at(out).join("picked.toml").exists());
    message
}

#[test]
fn a_study_that_mops_wrote_below_its_study_reads_the_data_of_that_study() {
    let place = Place::new();
    let message = project(&place, "project/results/rig");
    assert!(!message.contains("--allow-read"), "{message}");
    place.mops(&["check", "project/results/rig/picked.toml"]).ends_with(0);
    // A study written from the written one, beside it.
    let second = ["pareto", "project/results/rig/picked.toml", "--points", "3", "--max-evaluations", "40", "--out"];
    let second = place.mops(&[&second[..], &["project/results/second"]].concat());
    assert!(second.status < 2, "{}", second.message);
    place.mops(&["check", "project/results/second/study.toml"]).ends_with(0);
    // The project is moved.
    fs::rename(place.at("project"), place.at("moved")).unwrap();
    place.mops(&["check", "moved/results/rig/picked.toml"]).ends_with(0);
    // Files above the study stay closed.
    place.write("secret.csv", RECORDING);
    let text = place.text("moved/results/rig/picked.toml").replace("../../data/step.csv", "../../../secret.csv");
    place.write("moved/results/rig/picked.toml", &text);
    place.mops(&["check", "moved/results/rig/picked.toml"]).refused_for("--allow-read");
}

#[test]
fn a_study_that_mops_wrote_elsewhere_needs_the_option_that_the_run_prints() {
    let place = Place::new();
    let message = project(&place, "elsewhere/rig");
    let folder = place.at("project").canonicalize().unwrap().display().to_string();
    assert!(message.contains(&format!("use it with --allow-read {folder}")), "{message}");
    for study in ["elsewhere/rig/study.toml", "elsewhere/rig/picked.toml"] {
        place.mops(&["check", study]).refused_for("--allow-read");
        place.mops(&["check", study, "--allow-read", &folder]).ends_with(0);
    }
    // A picked study in another folder finds the data, too.
    let pick = ["pick", "elsewhere/rig", "--demand", "late=1", "--no-refine", "--allow-read", &folder, "--out"];
    place.mops(&[&pick[..], &["project/mine.toml"]].concat());
    place.mops(&["check", "project/mine.toml"]).ends_with(0);
}

#[test]
fn no_file_of_a_study_opens_the_folders_above_it() {
    let place = Place::new();
    project(&place, "project/results/rig");
    // A copy of the folder of the run, below the folder of another study.
    place.write("home/study.toml", &DESIGN.replace("NAME", "home"));
    place.write("home/data/step.csv", RECORDING);
    fs::create_dir_all(place.at("home/results")).unwrap();
    fs::rename(place.at("project/results/rig"), place.at("home/results/rig")).unwrap();
    fs::remove_dir_all(place.at("project")).unwrap();
    place.mops(&["check", "home/results/rig/picked.toml"]).refused_for("--allow-read");
    // A name alone does not make it the study of the run.
    place.write("home/rig.toml", "# no study\n");
    place.mops(&["check", "home/results/rig/picked.toml"]).refused_for("--allow-read");
    let named = CALIBRATION.replace("FILE", "data/step.csv");
    place.write("home/rig.toml", &named.replace("\"rig\"", "\"other\""));
    place.mops(&["check", "home/results/rig/picked.toml"]).refused_for("--allow-read");
    place.write("home/rig.toml", &named);
    place.mops(&["check", "home/results/rig/picked.toml"]).ends_with(0);
}

#[cfg(unix)]
#[test]
fn a_link_out_of_the_folder_of_a_study_is_not_read() {
    let place = Place::new();
    place.write("secret.csv", "not,a,table of SECRETS\n");
    place.write("study/study.toml", &CALIBRATION.replace("FILE", "data.csv"));
    std::os::unix::fs::symlink("../secret.csv", place.at("study/data.csv")).unwrap();
    let message = place.mops(&["check", "study"]).ends_with(2);
    assert!(message.contains("outside of the folder of the study") && !message.contains("SECRETS"), "{message}");
    fs::remove_file(place.at("study/data.csv")).unwrap();
    std::os::unix::fs::symlink(Path::new("other/real.csv"), place.at("study/data.csv")).unwrap();
    place.write("study/other/real.csv", RECORDING);
    place.mops(&["check", "study"]).ends_with(0);
}

#[test]
fn a_damaged_database_is_renamed_by_a_fresh_run_and_named_by_a_resumed_one() {
    let place = Place::new();
    place.calibration("data.csv");
    let run = [&["run", "study.toml", "--out", "r"], &FEW[..]].concat();
    place.mops(&run).ends_with(0);
    let whole = fs::read(place.at("r/evaluations.sqlite")).unwrap();
    let schema = whole.windows(19).position(|text| text == b"CREATE TABLE points").unwrap();
    type Damage<'a> = &'a dyn Fn(&mut Vec<u8>);
    let damages: [Damage; 5] = [
        &|bytes| bytes[schema..schema + 6].fill(0),
        &|bytes| bytes[100] ^= 0xff,
        &|bytes| bytes[101..108].fill(0xff),
        &|bytes| bytes[schema..schema + 19].copy_from_slice(b"CREATE TABLE pointz"),
        &|bytes| bytes[16..100].fill(0x5a),
    ];
    for (i, damage) in damages.into_iter().enumerate() {
        let mut bytes = whole.clone();
        damage(&mut bytes);
        fs::write(place.at("r/evaluations.sqlite"), &bytes).unwrap();
        let resumed = place.mops(&[&run[..], &["--resume"]].concat());
        assert!(resumed.status == 2 || resumed.status == 0, "{i}: {}", resumed.message);
        fs::write(place.at("r/evaluations.sqlite"), &bytes).unwrap();
        place.mops(&run).ends_with(0);
        place.mops(&["report", "r"]).ends_with(0);
    }
    fs::write(place.at("r/evaluations.sqlite"), {
        let mut bytes = whole.clone();
        bytes[schema..schema + 6].fill(0);
        bytes
    })
    .unwrap();
    place.mops(&[&run[..], &["--resume"]].concat()).refused_for("is damaged");
    place.mops(&["run", "study.toml", "--out", "other", "--reuse", "r", "--quiet"]).refused_for("is damaged");
}

#[cfg(unix)]
#[test]
fn pipes_are_neither_databases_nor_locks() {
    let pipe = |path: &Path| assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
    let place = Place::new();
    place.calibration("data.csv");
    fs::create_dir(place.at("r")).unwrap();
    pipe(&place.at("r/evaluations.sqlite"));
    let run = [&["run", "study.toml", "--out", "r"], &FEW[..]].concat();
    place.mops(&[&run[..], &["--resume"]].concat()).refused_for("not a database");
    place.mops(&["report", "r"]).ends_with(2);
    place.mops(&["history", "r"]);
    place.mops(&["run", "study.toml", "--out", "other", "--reuse", "r", "--quiet"]).ends_with(2);
    place.mops(&run).ends_with(0);
    assert!(place.at("r/evaluations.previous.sqlite").exists() && place.at("r/evaluations.sqlite").is_file());
    pipe(&place.at("r/evaluations.lock"));
    assert!(place.mops(&run).ends_with(3).contains("evaluations.lock is not a file"));
    place.mops(&["history", "r"]).ends_with(0);
}

#[cfg(unix)]
#[test]
fn a_database_beside_a_pipe_of_sqlite_is_not_opened() {
    let place = Place::new();
    place.calibration("data.csv");
    let run = [&["run", "study.toml", "--out", "r"], &FEW[..]].concat();
    for end in ["journal", "wal", "shm"] {
        place.mops(&run).ends_with(0);
        let companion = format!("r/evaluations.sqlite-{end}");
        assert!(Command::new("mkfifo").arg(place.at(&companion)).status().unwrap().success());
        place.mops(&[&run[..], &["--resume"]].concat()).refused_for(&format!("{companion} is not a file"));
        place.mops(&["report", "r"]).ends_with(2);
        place.mops(&["history", "r"]).ends_with(0);
        place.mops(&["compare", "r", "r"]).ends_with(0);
        place.mops(&["run", "study.toml", "--out", "other", "--reuse", "r", "--quiet"]).ends_with(2);
        place.mops(&run).ends_with(0);
        assert!(place.at("r/evaluations.previous.sqlite").is_file());
        assert!(!place.at(&companion).exists());
        // Without a database, too.
        fs::remove_file(place.at("r/evaluations.sqlite")).unwrap();
        assert!(Command::new("mkfifo").arg(place.at(&companion)).status().unwrap().success());
        place.mops(&[&run[..], &["--resume"]].concat()).ends_with(0);
    }
    let front = place.at("front");
    fs::create_dir(&front).unwrap();
    assert!(Command::new("mkfifo").arg(front.join("result.json")).status().unwrap().success());
    place.mops(&["pick", "front", "--demand", "a=1"]).refused_for("there is no result");
}

#[cfg(unix)]
#[test]
fn a_run_writes_through_no_link_to_a_database() {
    let place = Place::new();
    place.calibration("data.csv");
    let run = [&["run", "study.toml", "--out", "r"], &FEW[..]].concat();
    place.mops(&run).ends_with(0);
    fs::rename(place.at("r/evaluations.sqlite"), place.at("mine.sqlite")).unwrap();
    std::os::unix::fs::symlink("../mine.sqlite", place.at("r/evaluations.sqlite")).unwrap();
    let before = fs::read(place.at("mine.sqlite")).unwrap();
    place.mops(&[&run[..], &["--resume"]].concat()).refused_for("is a symbolic link");
    place.mops(&["report", "r"]).ends_with(0);
    place.mops(&run).ends_with(0);
    assert!(fs::read(place.at("mine.sqlite")).unwrap() == before);
    assert!(!place.at("r/evaluations.sqlite").is_symlink());
}

#[test]
fn a_constant_that_is_no_finite_number_is_a_mistake_of_the_study() {
    let place = Place::new();
    for (expression, word) in [
        ("sqrt(-9.81)", "not a number"),
        ("-k*x + l*sqrt(-9.81)", "not a number"),
        ("l/0", "infinite"),
        ("1/0", "infinite"),
        ("l + ln(0)", "infinite"),
        ("asin(2)*l", "not a number"),
        ("1e200*1e200*l", "infinite"),
        ("1e200*l*1e200", "infinite"),
    ] {
        place.write("study.toml", &DESIGN.replace("NAME", "n").replace("-k*x + l", expression));
        let run = place.mops(&["check", "study.toml"]);
        let is_of_parameter = expression == "l/0";
        assert!(is_of_parameter || run.status == 2 && run.message.contains(word), "{expression}: {}", run.message);
    }
}

#[test]
fn control_characters_of_names_are_escaped_in_every_output() {
    let place = Place::new();
    let study = DESIGN.replace("NAME", "n\\u001b[31m").replace("\na = {", "\n\"a\\u202e\\u0007\" = {");
    place.write("study.toml", &study);
    place.mops(&[&["run", "study.toml", "--out", "r"], &FEW[..]].concat()).ends_with(0);
    place.mops(&["compare", "r", "r", "--out", "c.html"]).ends_with(0);
    for file in ["r/report.html", "r/evaluations.csv", "c.html"] {
        let text = place.text(file);
        let raw = text.chars().find(|c| "\u{1b}\u{7}\u{202e}".contains(*c));
        assert!(raw.is_none() && text.contains("a\\u{202e}\\u{7}"), "{file}: {raw:?}");
    }
    // The data of plots in the page are JSON, still.
    let page = place.text("r/report.html");
    let blocks: Vec<&str> = page.split("<script type=\"application/json\">").skip(1).collect();
    assert!(!blocks.is_empty());
    for block in blocks {
        let json = block.split("</script>").next().unwrap();
        assert!(serde_json::from_str::<serde_json::Value>(json).is_ok(), "{json}");
    }
}

#[test]
fn a_study_that_is_made_from_names_of_any_kind_is_valid() {
    let place = Place::new();
    let rows: String = (0..12).map(|k| format!("{k},{}\n", k * k)).collect();
    for (file, header) in [
        ("plain.csv", "\"a\n[experiments.evil]\nb\""),
        ("plain.csv", "\"a\n[experiments.evil]\nfile=\"\"x.csv\"\"\n\""),
        ("plain.csv", "\"a\r[x]b\""),
        ("plain.csv", "a\u{1b}[31mred\u{7}"),
        ("plain.csv", "\u{202e}a\u{7f}\u{85}"),
        ("a\nb = 1\n.csv", "y"),
        ("a\"\\'\u{1b}.csv", "y"),
    ] {
        for folder in ["study", "st\nudy = 1", "st\u{1b}\"\\udy"] {
            let _ = fs::remove_dir_all(place.at(folder));
            place.write(file, &format!("t [s],{header}\n{rows}"));
            place.mops(&["new", folder, "--from-data", file]).ends_with(0);
            let text = place.text(&format!("{folder}/study.toml"));
            let table: toml::Table = text.parse().unwrap_or_else(|why| panic!("{file:?} {header:?}: {why}\n{text}"));
            let experiments: Vec<&String> = table["experiments"].as_table().unwrap().keys().collect();
            assert_eq!(experiments, ["calibration", "validation"]);
            assert!(!text.contains('\u{202e}') || header.contains('\u{202e}'), "{text}");
            place.mops(&["check", &format!("{folder}/study.toml")]).ends_with(0);
            let _ = fs::remove_dir_all(place.at(folder));
            place.mops(&["new", folder, "--template", "equations"]).ends_with(0);
            place.mops(&["check", &format!("{folder}/study.toml")]).ends_with(0);
        }
    }
}

#[test]
fn a_calibration_needs_an_experiment_that_is_not_for_validation() {
    let place = Place::new();
    place.write("data.csv", RECORDING);
    let study = CALIBRATION.replace("FILE", "data.csv");
    let validating = study.replace("[experiments.step]", "[experiments.step]\nrole = \"validation\"");
    for text in [
        validating.clone(),
        validating.replace("demand = 1 }", "demand = 1, usage = \"inequality\" }"),
        format!("{validating}y = {{ fit = {{ signal = \"x\" }}, usage = \"monitor\" }}\n"),
    ] {
        place.write("study.toml", &text);
        for command in ["check", "run"] {
            place.mops(&[command, "study.toml"]).refused_for("belong to experiments for validation only");
        }
    }
    let both = validating.replace(
        "[criteria]",
        "[experiments.other]\nfile = \"data.csv\"\nchannels = { x = \"x\" }\n\
                                   inputs = { u = \"u\" }\n[criteria]",
    );
    place.write("study.toml", &both);
    place.mops(&["check", "study.toml"]).ends_with(0);
    for scale in ["0", "0.0", "inf", "nan"] {
        let scaled = format!("channels = {{ x = {{ column = \"x\", scale = {scale} }} }}");
        place.write("study.toml", &study.replace("channels = { x = \"x\" }", &scaled));
        place.mops(&["check", "study.toml"]).refused_for("`scale` must be finite and not 0");
    }
}

#[test]
fn names_like_formulas_are_text_in_csv_files_and_are_read_back_unchanged() {
    let place = Place::new();
    let study = DESIGN.replace("NAME", "n").replace("\na = {", "\n\"=a\" = {").replace("\nb = {", "\n\"'-b\" = {");
    place.write("study.toml", &(study + "[cases.\"@c\"]\n[cases.\"+d\"]\n"));
    let run = place.mops(&[&["run", "study.toml", "--out", "r"], &FEW[..]].concat());
    assert!(run.status < 2, "{}", run.message);
    let header = place.text("r/evaluations.csv").lines().next().unwrap().to_owned();
    assert!(header.contains("'@c/=a") && header.contains("'+d/=a") && !header.contains(",@"), "{header}");
    let message = place.mops(&["data", "r/evaluations.csv"]).ends_with(0);
    assert!(message.contains(" @c/=a ") && message.contains(" +d/'-b "), "{message}");
}
