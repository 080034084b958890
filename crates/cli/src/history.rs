//! `mops history`: lists the runs below a folder.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use mops_core::Catalogue;
use mops_language::Diagnostic;
use serde_json::{Value, json};

use super::past_run::PastRun;
use crate::terminal::{CommandError, date, number, print, print_json, table};

/// Largest depth of searched folders.
const DEPTH: usize = 8;

/// Arguments of `mops history`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Folder that is searched for runs, with its subfolders.
    #[arg(default_value = "results")]
    folder: PathBuf,
    /// Print a JSON array instead of a table.
    #[arg(long)]
    json: bool,
}

pub(super) fn history(_catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let folder = &arguments.folder;
    if !folder.is_dir() {
        return Err(Diagnostic::new(format!("there is no folder `{}`", folder.display()))
            .with_help("name an output folder (--out) or a parent folder; without --out, runs are in results")
            .into());
    }
    let mut runs = Vec::new();
    collect(folder, DEPTH, &mut runs);
    runs.sort_by(|a, b| (a.date, &a.folder).cmp(&(b.date, &b.folder)));
    if arguments.json {
        let all: Vec<Value> = runs.iter().map(json_of).collect();
        print_json(&all)?;
    } else if runs.is_empty() {
        print(&format!("no runs below {}\n", folder.display()))?;
    } else {
        let header = [
            "date (UTC)",
            "study",
            "task",
            "state",
            "worst scaled",
            "feasible",
            "evaluations",
            "seconds",
            "mops",
            "folder",
        ];
        print(&table(&header, &[4, 6, 7], runs.iter().map(row).collect()))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Collects the runs in a folder and its subfolders; symbolic links are not followed.
fn collect(folder: &Path, depth: usize, runs: &mut Vec<PastRun>) {
    runs.extend(PastRun::read(folder));
    if depth == 0 {
        return;
    }
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let folders = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()));
    for entry in folders.filter(|entry| !entry.file_name().to_string_lossy().starts_with('.')) {
        collect(&entry.path(), depth - 1, runs);
    }
}

/// Converts a run to a JSON object.
fn json_of(past: &PastRun) -> Value {
    let of = |key: &str| past.finished_result().map_or(Value::Null, |result| result[key].clone());
    let run = past.run.as_ref().map(|(run, _)| run);
    // A diagnosis has a verdict and no scaled values.
    let counts = |value: Value| if has_criteria(past) { value } else { Value::Null };
    let or = |key: &str, kept: Option<Value>| {
        kept.unwrap_or_else(|| past.result.as_ref().map_or(Value::Null, |r| r[key].clone()))
    };
    json!({
        "folder": past.folder.display().to_string(), "date": date(past.date),
        "study": or("study", run.map(|run| json!(run.name))), "task": or("task", run.map(|run| json!(run.task))),
        "state": past.state(), "worst_scaled": counts(of("worst_scaled")), "feasible": counts(of("feasible")),
        "evaluations": counts(
            past.finished_result().map_or_else(|| json!(run.map(|run| run.evaluations)), |_| of("evaluations"))
        ),
        "seconds": of("seconds"), "mops": or("mops", run.map(|run| json!(run.mops))),
        "seed": or("seed", run.map(|run| json!(run.seed))), "solver": or("solver", run.map(|run| json!(run.solver))),
        "command": run.map(|run| &run.command), "reused": of("reused"),
    })
}

/// Returns true if the task of a run evaluates criteria.
fn has_criteria(past: &PastRun) -> bool {
    let of_result = || past.result.as_ref().and_then(|result| result["task"].as_str());
    let task = past.run.as_ref().map(|(run, _)| run.task.as_str()).or_else(of_result);
    !matches!(task, Some("diagnosis" | "excitation"))
}

/// Converts a run to a row of the table.
fn row(past: &PastRun) -> Vec<String> {
    let report = json_of(past);
    let cell = |key: &str| match &report[key] {
        Value::Null => String::new(),
        Value::Bool(yes) => if *yes { "yes" } else { "no" }.to_owned(),
        Value::String(text) => text.clone(),
        Value::Number(value) if key == "seconds" => {
            mops_content::numbers::significant(value.as_f64().unwrap_or(f64::NAN), 3)
        }
        value => value.as_f64().map(number).unwrap_or_default(),
    };
    let keys =
        ["date", "study", "task", "state", "worst_scaled", "feasible", "evaluations", "seconds", "mops", "folder"];
    keys.map(cell).to_vec()
}
