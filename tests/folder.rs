//! The folder of a run: no data are lost, whichever process has a file open and however a run ends.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use assert_cmd::cargo::cargo_bin;
use rusqlite::{Connection, OpenFlags};
use serde_json::Value;

const SEARCH: [&str; 6] = ["--solver", "cma-es", "--jobs", "1", "--max-evaluations", "1000000"];

/// A task that stores no points.
const LOCAL: [&str; 9] = [
    "run",
    "tank-level",
    "--quiet",
    "--set",
    "study.task=\"sensitivity\"",
    "--set",
    "sensitivity.at=\"start\"",
    "--set",
    "sensitivity.method=\"local\"",
];

fn command(arguments: &[&str], out: &Path) -> Command {
    let mut command = Command::new(cargo_bin!("mops"));
    command.args(arguments).arg("--out").arg(out);
    command
}

fn mops(arguments: &[&str], out: &Path) -> Output {
    command(arguments, out).output().unwrap()
}

fn message(output: &Output) -> String {
    [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text).into_owned()).concat()
}

/// Runs a command on the folder of a run.
fn look(what: &str, folder: &Path) -> Output {
    Command::new(cargo_bin!("mops")).arg(what).arg(folder).output().unwrap()
}

fn history(folder: &Path) -> Value {
    let output = Command::new(cargo_bin!("mops")).arg("history").arg(folder).arg("--json").output().unwrap();
    serde_json::from_slice(&output.stdout).unwrap()
}

fn result(out: &Path) -> Value {
    serde_json::from_slice(&fs::read(out.join("result.json")).unwrap()).unwrap()
}

/// Starts a search in a new folder; returns once some points are written.
fn going(out: &Path) -> Child {
    let mut child = command(&[&["run", "pid-design", "--quiet"], &SEARCH[..]].concat(), out)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while points(&out.join("evaluations.sqlite")) < 300 {
        assert!(child.try_wait().unwrap().is_none(), "the search is still running");
        std::thread::yield_now();
    }
    child
}

/// Kills a search after some points; returns their number.
fn unfinished(out: &Path) -> usize {
    let _ = fs::remove_file(out.join("evaluations.sqlite"));
    let mut child = going(out);
    child.kill().unwrap();
    child.wait().unwrap();
    points(&out.join("evaluations.sqlite"))
}

/// Returns the number of points in a database; 0 if it does not exist.
fn points(database: &Path) -> usize {
    if !database.exists() {
        return 0;
    }
    let connection = Connection::open_with_flags(database, OpenFlags::SQLITE_OPEN_READ_ONLY).unwrap();
    let count = connection.query_row("SELECT count(*) FROM points", [], |row| row.get::<_, i64>(0));
    usize::try_from(count.unwrap()).unwrap()
}

const SHORT: [&str; 7] = ["run", "pid-design", "--quiet", "--solver", "genetic", "--max-evaluations", "60"];

#[test]
fn an_unreadable_database_is_renamed_by_a_new_run_and_never_deleted() {
    let root = tempfile::tempdir().unwrap();
    type Put = fn(&Path);
    let puts: [(&str, Put); 6] = [
        ("no database", |path| fs::write(path, "notes of mine").unwrap()),
        ("a folder", |path| {
            fs::create_dir(path).unwrap();
            fs::write(path.join("a"), "mine").unwrap();
        }),
        ("a database of others", |path| {
            Connection::open(path)
                .unwrap()
                .execute_batch("CREATE TABLE mine (x); INSERT INTO mine VALUES (7);")
                .unwrap();
        }),
        ("one of others with its log", |path| {
            let connection = Connection::open(path).unwrap();
            connection
                .execute_batch("PRAGMA journal_mode=WAL; CREATE TABLE mine (x); INSERT INTO mine VALUES (7);")
                .unwrap();
        }),
        ("another version of the tables", |path| {
            assert!(mops(&SHORT, path.parent().unwrap()).status.success());
            Connection::open(path).unwrap().pragma_update(None, "user_version", 77).unwrap();
        }),
        ("a damaged one", |path| {
            assert!(mops(&SHORT, path.parent().unwrap()).status.success());
            let mut bytes = fs::read(path).unwrap();
            bytes[20..1000].fill(0xee);
            fs::write(path, bytes).unwrap();
        }),
    ];
    for (what, put) in puts {
        let out = root.path().join(what.replace(' ', "-"));
        fs::create_dir(&out).unwrap();
        let database = out.join("evaluations.sqlite");
        put(&database);
        let before = fs::read(&database).ok();
        let output = mops(&["run", "pid-design", "--solver", "genetic", "--max-evaluations", "60"], &out);
        assert!(
            output.status.success() && message(&output).contains("evaluations.previous.sqlite"),
            "{what}: {}",
            message(&output)
        );
        let aside = out.join("evaluations.previous.sqlite");
        match before {
            Some(_) if what.starts_with("one of others") => {
                let mine =
                    Connection::open(&aside).unwrap().query_row("SELECT x FROM mine", [], |row| row.get::<_, i64>(0));
                assert_eq!(mine, Ok(7));
            }
            Some(bytes) => assert!(fs::read(&aside).unwrap() == bytes, "{what}"),
            None => assert_eq!(fs::read_to_string(aside.join("a")).unwrap(), "mine"),
        }
        assert!(points(&database) >= 60, "{what}");
    }
}

#[test]
fn every_unfinished_run_keeps_its_points_under_its_own_file_name() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let mut counts = Vec::new();
    for name in ["evaluations.previous.sqlite", "evaluations.previous-2.sqlite", "evaluations.previous-3.sqlite"] {
        counts.push((name, unfinished(&out)));
        let output = mops(&["run", "pid-design", "--solver", "genetic", "--max-evaluations", "1"], &out);
        assert!(message(&output).contains(name), "{}", message(&output));
        // The short run finished: the next run replaces it.
    }
    for (name, count) in counts {
        assert!(count >= 300);
        assert_eq!(points(&out.join(name)), count, "{name}");
    }
}

#[test]
fn a_database_open_in_another_program_is_not_moved_and_the_run_is_refused() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let count = unfinished(&out);
    let database = out.join("evaluations.sqlite");
    let reader = Connection::open_with_flags(&database, OpenFlags::SQLITE_OPEN_READ_ONLY).unwrap();
    reader.execute_batch("BEGIN").unwrap();
    assert_eq!(
        reader.query_row("SELECT count(*) FROM points", [], |row| row.get::<_, i64>(0)).unwrap() as usize,
        count
    );
    let output = mops(&SHORT, &out);
    assert_eq!(output.status.code(), Some(2));
    assert!(message(&output).contains("is open in another program"), "{}", message(&output));
    drop(reader);
    assert_eq!(points(&database), count);
    assert!(mops(&SHORT, &out).status.success());
    assert_eq!(points(&out.join("evaluations.previous.sqlite")), count);
}

#[test]
fn evaluations_wait_for_a_locked_database_and_are_written_after_its_release() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let mut child = going(&out);
    let database = out.join("evaluations.sqlite");
    let other = Connection::open(&database).unwrap();
    other.busy_timeout(Duration::from_secs(10)).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    let committed = points(&database);
    // The first message reports that it cannot write.
    let mut stderr = std::io::BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    std::io::BufRead::read_line(&mut stderr, &mut line).unwrap();
    assert!(line.contains("evaluations cannot be written (database is locked)"), "{line}");
    assert_eq!(points(&database), committed);
    other.execute_batch("ROLLBACK").unwrap();
    line.clear();
    std::io::BufRead::read_line(&mut stderr, &mut line).unwrap();
    assert!(line.contains("evaluations are written again"), "{line}");
    let until = Instant::now() + Duration::from_secs(10);
    while points(&database) <= committed {
        assert!(Instant::now() < until, "no evaluation is written within ten seconds");
        std::thread::yield_now();
    }
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    std::io::Read::read_to_string(&mut stderr, &mut line).unwrap();
    assert!(!line.contains("incomplete"), "{line}");
    assert_eq!(child.wait().unwrap().code(), Some(4));
    let (result, kept) = (result(&out), points(&database));
    assert!(kept as u64 >= result["evaluations"].as_u64().unwrap(), "{kept}: {result}");
}

#[test]
fn a_run_with_a_permanently_locked_database_still_writes_its_result_and_ends() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let child = going(&out);
    let database = out.join("evaluations.sqlite");
    let other = Connection::open(&database).unwrap();
    other.busy_timeout(Duration::from_secs(10)).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(4), "{}", message(&output));
    assert!(message(&output).contains("evaluations could not be stored: database is locked"), "{}", message(&output));
    let result = result(&out);
    assert_eq!(result["stop"], "interrupted");
    // The history does not list it as unfinished, and no report is written from part of its points.
    let listed = history(&out);
    assert_eq!((&listed[0]["state"], &listed[0]["evaluations"]), (&"interrupted".into(), &result["evaluations"]));
    let page = fs::read(out.join("report.html")).unwrap();
    other.execute_batch("ROLLBACK").unwrap();
    drop(other);
    let report = look("report", &out);
    assert_eq!(report.status.code(), Some(2), "{}", message(&report));
    assert!(message(&report).contains("of the run's"), "{}", message(&report));
    assert!(fs::read(out.join("report.html")).unwrap() == page);
    // Missing points are simulated again.
    let search = [&["run", "pid-design"], &SEARCH[..4], &["--max-evaluations", "400", "--resume"]].concat();
    assert!(mops(&search, &out).status.success());
    assert!(look("report", &out).status.success());
    assert!(!out.join("evaluations.ended.json").exists());
}

#[test]
fn every_task_replaces_the_files_of_an_earlier_run_in_its_folder() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    assert!(mops(&SHORT, &out).status.success());
    assert!(out.join("plots/response-nominal-y.svg").is_file());
    fs::write(out.join("plots/mine.svg"), "").unwrap();
    assert!(mops(&LOCAL, &out).status.success());
    // Result, database and page belong to the new run; plots of the old run are removed, other files are not.
    let listed = history(&out);
    assert_eq!(
        [&listed[0]["study"], &listed[0]["task"], &listed[0]["state"]],
        [&Value::from("tank-level"), &"sensitivity".into(), &"converged".into()]
    );
    assert!(!out.join("plots/response-nominal-y.svg").exists() && out.join("plots/mine.svg").exists());
    assert_eq!(result(&out)["study"], "tank-level");
    let page = fs::read(out.join("report.html")).unwrap();
    let report = look("report", &out);
    assert_eq!(report.status.code(), Some(2), "{}", message(&report));
    assert!(fs::read(out.join("report.html")).unwrap() == page);
    // A run is refused while another one is in progress.
    let busy = root.path().join("busy");
    let mut child = going(&busy);
    for task in [&LOCAL[..], &SHORT[..], &["diagnose", "furuta-swing", "--quiet"]] {
        let refused = mops(task, &busy);
        assert_eq!(refused.status.code(), Some(2));
        assert!(message(&refused).contains("is in use by another run"), "{}", message(&refused));
    }
    assert_eq!(history(&busy)[0]["state"], "running");
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(history(&busy)[0]["state"], "unfinished");
}

#[test]
fn a_diagnosis_has_no_scaled_values_in_the_history() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    assert!(mops(&["diagnose", "furuta-swing", "--quiet", "--time-limit", "0.001"], &out).status.success());
    assert_eq!((&result(&out)["stop"], &result(&out)["diagnosis"]), (&"time-limit".into(), &Value::Null));
    let listed = &history(&out)[0];
    for key in ["worst_scaled", "feasible", "evaluations"] {
        assert_eq!(listed[key], Value::Null, "{key}");
    }
    assert_eq!([&listed["task"], &listed["state"]], ["diagnosis", "time-limit"]);
}

#[test]
fn runs_without_a_result_are_skipped_in_a_comparison() {
    let root = tempfile::tempdir().unwrap();
    let [a, b] = ["a", "b"].map(|name| root.path().join(name));
    assert!(mops(&SHORT, &a).status.success());
    unfinished(&b);
    let compared = Command::new(cargo_bin!("mops")).arg("compare").args([&a, &b]).output().unwrap();
    assert!(compared.status.success(), "{}", message(&compared));
    let text = message(&compared);
    assert!(text.contains("unfinished, no result yet") && text.contains("nominal/overshoot"), "{text}");
    let none = Command::new(cargo_bin!("mops")).arg("compare").args([&b, &b]).output().unwrap();
    assert_eq!(none.status.code(), Some(2));
}

#[test]
fn a_report_evaluates_no_points_beyond_the_stored_ones() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    assert!(mops(&SHORT, &out).status.success());
    let database = out.join("evaluations.sqlite");
    let change = |sql: &str| Connection::open(&database).unwrap().execute(sql, []).unwrap();
    let kept = points(&database);
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    for state in ["budget", "time-limit", "converged", "stalled", "interrupted", "running"] {
        change(&format!("UPDATE runs SET max_evaluations = 100000000, state = '{state}'"));
        let report = look("report", &out);
        // The search has 54 evaluations; what a tenth of another budget would examine is not stored.
        let counted = ["54 evaluations", "60 evaluations"].iter().any(|count| message(&report).contains(count));
        assert!(report.status.success() && counted, "{state}: {}", message(&report));
        assert_eq!(points(&database), kept);
    }
    change("UPDATE runs SET max_evaluations = 60, state = 'budget'");
    assert!(look("report", &out).status.success());
    assert!(fs::read_to_string(out.join("report.html")).unwrap() == page);
    // No report is written from part of the points.
    change("DELETE FROM points WHERE id > 30");
    let report = look("report", &out);
    assert_eq!(report.status.code(), Some(2), "{}", message(&report));
    assert!(fs::read_to_string(out.join("report.html")).unwrap() == page);
}

#[cfg(unix)]
#[test]
fn a_folder_removed_during_the_run_is_restored_with_all_points() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let child = going(&out);
    fs::remove_dir_all(&out).unwrap();
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(4), "{}", message(&output));
    assert!(message(&output).contains("was removed during the run and has been restored"), "{}", message(&output));
    assert!(points(&out.join("evaluations.sqlite")) as u64 >= result(&out)["evaluations"].as_u64().unwrap());
    let report = look("report", &out);
    assert!(report.status.success(), "{}", message(&report));
    // Files of another run that uses the folder by then are not changed.
    let out = root.path().join("taken");
    let child = going(&out);
    fs::remove_dir_all(&out).unwrap();
    let mut other = going(&out);
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", message(&output));
    assert!(message(&output).contains("is now used by another run"), "{}", message(&output));
    assert!(!out.join("result.json").exists());
    other.kill().unwrap();
    other.wait().unwrap();
}

#[cfg(unix)]
#[test]
fn symbolic_links_are_replaced_and_their_targets_stay_unchanged() {
    use std::os::unix::fs::symlink;
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    fs::create_dir(&out).unwrap();
    let precious = root.path().join("precious");
    fs::write(&precious, "mine").unwrap();
    for name in ["result.json", "report.html", "evaluations.csv", ".new-result.json", ".new-evaluations.sqlite"] {
        symlink(&precious, out.join(name)).unwrap();
    }
    assert!(mops(&SHORT, &out).status.success());
    assert_eq!(fs::read_to_string(&precious).unwrap(), "mine");
    assert_eq!(result(&out)["study"], "pid-design");
}

#[cfg(unix)]
#[test]
fn a_folder_name_that_is_not_utf8_is_accepted() {
    use std::os::unix::ffi::OsStrExt;
    let root = tempfile::tempdir().unwrap();
    let odd = root.path().join(std::ffi::OsStr::from_bytes(b"out\xff"));
    assert!(mops(&SHORT, &odd).status.success());
    assert!(mops(&[&SHORT[..], &["--resume"]].concat(), &odd).status.success());
    assert!(look("report", &odd).status.success());
    // A study with data in such a folder.
    let study = odd.join("study");
    fs::create_dir(&study).unwrap();
    for (name, bytes) in mops::studies::shipped().iter().find(|s| s.name == "step-identification").unwrap().files {
        fs::create_dir_all(study.join(name).parent().unwrap()).unwrap();
        fs::write(study.join(name), bytes).unwrap();
    }
    let run = Command::new(cargo_bin!("mops"))
        .args(["run", "study.toml", "--quiet", "--max-evaluations", "5", "--out", "out"])
        .current_dir(&study)
        .output()
        .unwrap();
    assert!(matches!(run.status.code(), Some(0 | 1)), "{}", message(&run));
    let report = Command::new(cargo_bin!("mops")).args(["report", "out"]).current_dir(&study).output().unwrap();
    assert!(report.status.success(), "{}", message(&report));
}

#[test]
fn a_locked_database_is_reported_before_the_first_simulation() {
    let root = tempfile::tempdir().unwrap();
    let [out, other] = ["out", "other"].map(|name| root.path().join(name));
    assert!(mops(&SHORT, &out).status.success());
    let database = out.join("evaluations.sqlite");
    let count = points(&database);
    let lock = Connection::open(&database).unwrap();
    lock.execute_batch("BEGIN EXCLUSIVE").unwrap();
    let resumed = [&SHORT[..], &["--resume"]].concat();
    let reused = [&SHORT[..], &["--reuse", out.to_str().unwrap()]].concat();
    std::thread::scope(|scope| {
        for (arguments, folder) in [(&resumed, &out), (&reused, &other)] {
            scope.spawn(move || {
                let output = mops(arguments, folder);
                assert_eq!(output.status.code(), Some(2), "{}", message(&output));
                let fact = format!("{} is locked by another program", out_of(folder, arguments).display());
                assert!(message(&output).contains(&fact), "{}", message(&output));
            });
        }
    });
    lock.execute_batch("ROLLBACK").unwrap();
    assert!(points(&database) == count && !other.join("result.json").exists());
    assert!(mops(&resumed, &out).status.success() && mops(&reused, &other).status.success());
}

/// Returns the database that a run reads.
fn out_of(folder: &Path, arguments: &[&str]) -> std::path::PathBuf {
    let from =
        arguments.iter().position(|argument| *argument == "--reuse").map(|place| Path::new(arguments[place + 1]));
    from.unwrap_or(folder).join("evaluations.sqlite")
}
