//! A run killed at a system call resumes to the result of an uninterrupted run.
//!
//! The quick tier kills at a few calls, the full tier at a tenth of them, `MOPS_KILLS=all` at all. The tests need
//! strace, and are skipped without it.

#![cfg(target_os = "linux")]

use std::collections::HashMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use assert_cmd::cargo::cargo_bin;
use serde_json::Value;

/// System calls that write, create, rename, remove or synchronise files.
const CALLS: [&str; 12] = [
    "openat",
    "pwrite64",
    "write",
    "ftruncate",
    "rename",
    "unlink",
    "rmdir",
    "fdatasync",
    "fsync",
    "mkdir",
    "flock",
    "fcntl",
];

const STUDY: [&str; 9] = ["run", "pid-design", "--solver", "sqp", "--max-evaluations", "40", "--jobs", "1", "--quiet"];

/// Finished run of another study in the same folder.
const OTHER: [&str; 6] = ["run", "tank-level", "--max-evaluations", "20", "--jobs", "1"];

fn mops(arguments: &[&str], out: &Path) -> Command {
    let mut command = Command::new(cargo_bin!("mops"));
    command.args(arguments).arg("--out").arg(out);
    command
}

fn under_strace(options: &[&str], arguments: &[&str], out: &Path) -> Output {
    let mut command = Command::new("strace");
    command.arg("-f").args(options).arg(cargo_bin!("mops")).args(arguments).arg("--out").arg(out);
    command.output().expect("strace is installed")
}

/// Returns the result without times; `None` if it is absent or damaged.
fn result(out: &Path) -> Option<Value> {
    let mut result: Value = serde_json::from_slice(&fs::read(out.join("result.json")).ok()?).ok()?;
    result.as_object_mut()?.remove("seconds");
    Some(result)
}

/// Returns the files that exist only during a run.
fn passing(folder: &Path) -> Vec<String> {
    let names = |folder: &Path| fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.file_name());
    let all = names(folder).chain(names(&folder.join("plots"))).map(|name| name.to_string_lossy().into_owned());
    let ends = [".lock", "-wal", "-shm", "-journal"];
    all.filter(|name| name.starts_with(".new-") || ends.iter().any(|end| name.ends_with(end))).collect()
}

/// Returns the largest number of calls by one thread, for each system call: strace counts per thread.
fn counted(arguments: &[&str], root: &Path, prepare: &dyn Fn(&Path)) -> Vec<(&'static str, usize)> {
    let (out, log) = (root.join("counted"), root.join("log"));
    prepare(&out);
    let trace = format!("trace={}", CALLS.join(","));
    under_strace(&["-o", log.to_str().unwrap(), "-e", &trace], arguments, &out);
    let text = fs::read_to_string(&log).unwrap();
    let mut counts: HashMap<(&str, &str), usize> = HashMap::new();
    for line in text.lines() {
        if let Some((thread, rest)) = line.split_once(' ')
            && let Some((call, _)) = rest.trim_start().split_once('(')
        {
            *counts.entry((thread, call)).or_default() += 1;
        }
    }
    let most = |call: &str| counts.iter().filter(|((_, of), _)| *of == call).map(|(_, n)| *n).max().unwrap_or(0);
    CALLS.iter().map(|&call| (call, most(call))).collect()
}

/// Kills a run at `some` of its system calls, each in a folder set up by `prepare`, and resumes it; `keeps` then checks
/// the folder. Returns the number of kills.
fn killed(arguments: &[&str], root: &Path, [prepare, keeps]: [&dyn Fn(&Path); 2], some: usize) -> usize {
    let whole = root.join("whole");
    assert!(mops(&STUDY, &whole).status().unwrap().success());
    let expected = result(&whole).unwrap();
    let places: Vec<(&str, usize)> = (counted(arguments, root, prepare).into_iter())
        .flat_map(|(call, count)| (1..=count).map(move |k| (call, k)))
        .collect();
    let all = std::env::var("MOPS_KILLS").is_ok_and(|kills| kills == "all");
    let every = match mops_tiers::is_full() {
        _ if all => 1,
        true => 10,
        false => places.len().div_ceil(some),
    };
    let (mut kills, mut wrong) = (0, Vec::new());
    for (call, k) in places.into_iter().skip(every / 2).step_by(every) {
        let out = root.join("out");
        let _ = fs::remove_dir_all(&out);
        prepare(&out);
        let inject = format!("inject={call}:signal=KILL:when={k}");
        let first = under_strace(&["-o", "/dev/null", "-e", &inject], arguments, &out);
        if first.status.code().is_some_and(|code| code < 128) {
            continue;
        }
        kills += 1;
        // Other commands see an absent or unfinished run.
        for look in ["history", "report"] {
            let looked = Command::new(cargo_bin!("mops")).arg(look).arg(&out).output().unwrap();
            if !matches!(looked.status.code(), Some(0 | 2 | 3)) {
                wrong.push(format!("{call} {k}: {look} {:?}", looked.status));
            }
        }
        // The result is complete, or that of the earlier run.
        if out.join("result.json").exists() && result(&out).is_none() {
            wrong.push(format!("{call} {k}: the result is damaged"));
        }
        let mut again = mops(&STUDY, &out).arg("--resume").output().unwrap();
        let message = String::from_utf8_lossy(&again.stderr).into_owned();
        // If killed before it changed the earlier run, it has not started.
        if message.contains("contains another run") {
            again = mops(&STUDY, &out).output().unwrap();
        }
        if result(&out).as_ref() != Some(&expected) || !passing(&out).is_empty() {
            wrong.push(format!("{call} {k}: {:?} {message} {:?}", again.status.code(), passing(&out)));
        }
        keeps(&out);
    }
    assert!(wrong.is_empty(), "{} of {kills}: {wrong:#?}", wrong.len());
    kills
}

fn has_strace() -> bool {
    let there = Command::new("strace").arg("-V").output().is_ok();
    if !there {
        eprintln!("skipped: strace is not installed");
    }
    there
}

#[test]
fn a_run_killed_at_any_system_call_in_an_empty_folder_resumes() {
    if has_strace() {
        let root = tempfile::tempdir().unwrap();
        let kills = killed(&STUDY, root.path(), [&|_| (), &|_| ()], 8);
        eprintln!("{kills} kills in an empty folder");
        assert!(kills >= 5);
    }
}

#[test]
fn a_run_killed_at_any_system_call_in_the_folder_of_another_run_resumes() {
    if has_strace() {
        let root = tempfile::tempdir().unwrap();
        let other = root.path().join("other");
        assert!(mops(&OTHER, &other).output().unwrap().status.code().is_some_and(|code| code < 2));
        let prepare = |out: &Path| {
            fs::create_dir_all(out).unwrap();
            for file in ["evaluations.sqlite", "evaluations.csv", "result.json", "report.html"] {
                fs::copy(other.join(file), out.join(file)).unwrap();
            }
        };
        let kills = killed(&STUDY, root.path(), [&prepare, &|_| ()], 6);
        eprintln!("{kills} kills in the folder of another run");
        assert!(kills >= 3);

        // The database of an unfinished run is renamed, with all its points.
        let database = |out: &Path, name: &str| rusqlite::Connection::open(out.join(name)).unwrap();
        let unfinished = |out: &Path| {
            prepare(out);
            database(out, "evaluations.sqlite").execute("UPDATE runs SET state = 'running'", []).unwrap();
        };
        let count = |database: rusqlite::Connection| {
            database.query_row("SELECT count(*) FROM points", [], |row| row.get::<_, i64>(0)).unwrap()
        };
        let points = count(database(&other, "evaluations.sqlite"));
        let kept = |out: &Path| {
            assert!(out.join("evaluations.previous.sqlite").exists());
            assert_eq!(count(database(out, "evaluations.previous.sqlite")), points);
        };
        let kills = killed(&STUDY, root.path(), [&unfinished, &kept], 6);
        eprintln!("{kills} kills in the folder of an unfinished run");
        assert!(points >= 18 && kills >= 3);
    }
}

#[test]
fn a_resumed_run_killed_at_any_system_call_resumes_again() {
    if has_strace() {
        let root = tempfile::tempdir().unwrap();
        let short = root.path().join("short");
        let first = [&STUDY[..4], &["--max-evaluations", "15"], &STUDY[6..]].concat();
        assert!(mops(&first, &short).status().unwrap().success());
        let prepare = |out: &Path| {
            fs::create_dir_all(out).unwrap();
            for file in ["evaluations.sqlite", "evaluations.csv", "result.json", "report.html"] {
                fs::copy(short.join(file), out.join(file)).unwrap();
            }
        };
        let kills = killed(&[&STUDY[..], &["--resume"]].concat(), root.path(), [&prepare, &|_| ()], 6);
        eprintln!("{kills} kills while it resumes");
        assert!(kills >= 3);
    }
}
