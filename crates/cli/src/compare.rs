//! `mops compare`: compares runs side by side.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use mops_content::numbers::significant;
use mops_core::{Catalogue, Problem};
use mops_language::Diagnostic;
use mops_output::{Inputs, Outputs};
use mops_report::{Responses, Rows, comparison_page};
use serde_json::{Value, json};

use super::past_run::PastRun;
use super::run_files::of_any_run;
use crate::terminal::{CommandError, number, print, print_json, table};

/// Arguments of `mops compare`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Output folders (--out) of the runs; differences are relative to the first.
    #[arg(required = true, num_args = 2..)]
    folders: Vec<PathBuf>,
    /// Write an HTML page with the responses of all runs overlaid.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print a JSON object instead of tables.
    #[arg(long)]
    json: bool,
}

/// Quantity with its value in each run.
struct Line {
    name: String,
    unit: String,
    values: Vec<Option<f64>>,
}

pub(super) fn compare(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let runs = arguments.folders.iter().map(|folder| PastRun::open(folder)).collect::<Result<Vec<_>, _>>()?;
    let results: Vec<&Value> = runs.iter().map(|run| run.finished_result().unwrap_or(&Value::Null)).collect();
    if results.iter().all(|result| result.is_null()) {
        return Err(Diagnostic::new("none of these runs has a result")
            .with_help("finish a run with `mops run --resume`")
            .into());
    }
    let names: Vec<String> = runs.iter().map(|run| run.folder.display().to_string()).collect();
    let tuners = lines(&results, "tuners", |tuner| tuner["name"].as_str().unwrap_or_default().to_owned());
    let of_case =
        |criterion: &Value| [&criterion["case"], &criterion["name"]].map(|v| v.as_str().unwrap_or_default()).join("/");
    let criteria = lines(&results, "criteria", of_case);
    let summary = summary(&results);
    let states: Vec<&str> = runs.iter().map(PastRun::state).collect();
    if arguments.json {
        let of = |lines: &[Line]| -> Vec<Value> { lines.iter().map(json_of).collect() };
        let all = json!({ "runs": names, "states": states, "outcome": of(&summary), "tuners": of(&tuners), "criteria": of(&criteria) });
        print_json(&all)?;
    }
    let tables = [(["Results", "run"], summary), (["Tuners", "tuner"], tuners), (["Criteria", "criterion"], criteria)];
    let tables = tables.map(|(title, lines)| rows(title, names.len(), &lines));
    if !arguments.json {
        print(&tables.iter().fold(legend(&names, &states, &results), |text, rows| text + "\n" + &text_table(rows)))?;
    }
    if let Some(path) = &arguments.out {
        let mut inputs = Inputs::default();
        for run in &runs {
            run.add_to(catalogue, &mut inputs);
            let what = format!("an output of the run in {}", run.folder.display());
            of_any_run(catalogue, &run.folder).iter().for_each(|path| inputs.add(path, &what));
        }
        let (responses, missing_responses) = responses(catalogue, &runs, &results, &mut inputs);
        let names: Vec<(String, String)> = names.into_iter().enumerate().map(|(i, name)| (letter(i), name)).collect();
        let page = comparison_page(&names, &tables, &responses, &missing_responses);
        Outputs::besides(inputs).write(path, page).map_err(CommandError::cannot_write(path))?;
        if !arguments.json {
            print(&format!("\nthe responses are plotted in {}\n", path.display()))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Collects the entries under `key` of all results, by name, in the order of first appearance.
fn lines(results: &[&Value], key: &str, name: impl Fn(&Value) -> String) -> Vec<Line> {
    let of = |result: &&Value| result[key].as_array().cloned().unwrap_or_default();
    let all: Vec<Vec<Value>> = results.iter().map(of).collect();
    let mut found: Vec<Line> = Vec::new();
    for entry in all.iter().flatten() {
        let name_of = name(entry);
        if found.iter().all(|line| line.name != name_of) {
            let value =
                |entries: &Vec<Value>| entries.iter().find(|e| name(e) == name_of).and_then(|e| e["value"].as_f64());
            let values = all.iter().map(value).collect();
            let unit = entry["unit"].as_str().unwrap_or_default().to_owned();
            found.push(Line { name: name_of, unit, values });
        }
    }
    found
}

/// Collects the overall figures of the runs: worst scaled value, objective, violation, evaluations, time.
fn summary(results: &[&Value]) -> Vec<Line> {
    let keys = [("worst_scaled", "1"), ("objective", "1"), ("violation", "1"), ("evaluations", "1"), ("seconds", "s")];
    let line = |(key, unit): (&str, &str)| Line {
        name: key.replace('_', " "),
        unit: unit.to_owned(),
        values: results.iter().map(|result| result[key].as_f64()).collect(),
    };
    keys.map(line).into()
}

/// Returns the difference of each value to the first, in percent of the first.
fn differences(line: &Line) -> Vec<Option<f64>> {
    let first = line.values[0].filter(|first| *first != 0.0);
    line.values.iter().skip(1).map(|value| Some(100.0 * ((*value)? - first?) / first?.abs())).collect()
}

fn json_of(line: &Line) -> Value {
    json!({ "name": line.name, "unit": line.unit, "values": line.values, "differences_percent": differences(line) })
}

/// Formats the legend: letter and folder of each run, with the state of runs without a result.
fn legend(names: &[String], states: &[&str], results: &[&Value]) -> String {
    let line = |(i, name): (usize, &String)| {
        let state = if results[i].is_null() { format!(": {}, no result yet", states[i]) } else { String::new() };
        format!("{}  {name}{state}\n", letter(i))
    };
    names.iter().enumerate().map(line).collect()
}

/// Returns the label of a run: A, B, ... Z, then numbers.
fn letter(index: usize) -> String {
    let of_alphabet = u8::try_from(index).ok().filter(|index| *index < 26).map(|index| char::from(b'A' + index));
    of_alphabet.map_or_else(|| format!("{}", index + 1), String::from)
}

fn rows([title, what]: [&'static str; 2], runs: usize, lines: &[Line]) -> Rows {
    let mut header = vec![what.to_owned(), "unit".to_owned()];
    header.extend((0..runs).map(letter));
    header.extend((1..runs).map(|i| format!("{} vs A, %", letter(i))));
    let percent = |difference: Option<f64>| match difference {
        Some(0.0) => "0".to_owned(),
        Some(difference) => format!("{}{}", if difference > 0.0 { "+" } else { "" }, significant(difference, 3)),
        None => String::new(),
    };
    let row = |line: &Line| {
        let values = line.values.iter().map(|value| value.map(number).unwrap_or_default());
        let differences = differences(line).into_iter().map(percent);
        [line.name.clone(), line.unit.clone()].into_iter().chain(values).chain(differences).collect()
    };
    Rows { title, header, lines: lines.iter().map(row).collect() }
}

fn text_table(rows: &Rows) -> String {
    let header: Vec<&str> = rows.header.iter().map(String::as_str).collect();
    let numeric: Vec<usize> = (2..header.len()).collect();
    table(&header, &numeric, rows.lines.clone())
}

/// Returns the responses of the runs at their results, and one sentence for each run without responses; adds the data
/// of the runs to the inputs.
fn responses(
    catalogue: &Catalogue,
    runs: &[PastRun],
    results: &[&Value],
    inputs: &mut Inputs,
) -> (Vec<Responses>, Vec<String>) {
    let (mut found, mut missing_responses) = (Vec::new(), Vec::new());
    for (i, (run, result)) in runs.iter().zip(results).enumerate() {
        match problem_at_result(catalogue, run, result, inputs) {
            Ok((problem, tuners)) => found.push(Responses { name: letter(i), problem, tuners }),
            Err(why) => missing_responses.push(format!("No responses for {}: {}.", letter(i), why.message)),
        }
    }
    (found, missing_responses)
}

/// Returns the problem of a run and the tuners of its result; adds its data to the inputs.
fn problem_at_result(
    catalogue: &Catalogue,
    run: &PastRun,
    result: &Value,
    inputs: &mut Inputs,
) -> Result<(Problem, Vec<f64>), Diagnostic> {
    if result.is_null() {
        return Err(Diagnostic::new(format!("the run in {} is {}", run.folder.display(), run.state())));
    }
    let file = run.study(catalogue)?;
    run.add_data_to(inputs, &file);
    let study = file.study;
    let of = |name: &str| {
        let tuner = result["tuners"].as_array()?.iter().find(|tuner| tuner["name"] == name)?;
        tuner["value"].as_f64()
    };
    let missing = |folder: &Path| Diagnostic::new(format!("the result in {} lacks a tuner", folder.display()));
    let tuners = study.tuners().iter().map(|tuner| of(&tuner.name)).collect::<Option<Vec<f64>>>();
    let tuners = tuners.ok_or_else(|| missing(&run.folder))?;
    Ok((Problem::new(Arc::new(study)), tuners))
}
