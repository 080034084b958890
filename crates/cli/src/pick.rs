//! `mops pick`: selects the point of a Pareto front for other demands.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use mops_core::{Catalogue, Evaluation, Oracle, Problem, Run, Stop, Study, Usage, run::Budget};
use mops_file::{
    StudyFile, edit as toml_text,
    edit::{TomlText, key, quoted},
};
use mops_language::{Diagnostic, files::read_regular, suggestion};
use mops_outcome::criterion_reports;
use mops_output::Outputs;
use serde_json::Value;

use super::home::Home;
use super::reading;
use super::run_files::relative_path;
use super::study::{StudyArguments, inputs, open_as};
use super::tables::met_text;
use crate::terminal::{CommandError, Limit, cancel_after, number, print, table};

/// Options of `mops pick`.
#[derive(Args)]
#[command(after_help = "\
Other demands stay as in the study. The selected point has the smallest worst scaled value under the new demands. From \
there the min-max problem with these demands is solved in a few hundred simulations, and a study that starts at the solution \
is written to picked.toml.

Examples:
  mops pareto pid-design
  mops pick results/pid-design --demand settling=12
  mops pick results/pid-design --demand settling='8 s' --demand overshoot=0.2 --no-refine")]
pub(super) struct Arguments {
    /// Output folder of `mops pareto`.
    folder: PathBuf,
    /// New demand on a criterion, in its unit or with a unit: settling=12, settling='12 s'.
    #[arg(long = "demand", value_name = "CRITERION=VALUE", required = true, value_parser = demand)]
    demands: Vec<(String, String)>,
    #[command(flatten)]
    limit: Limit,
    /// Keep the point of the front instead of solving from there.
    #[arg(long)]
    no_refine: bool,
    /// Study of the front [default: study.toml in the folder].
    #[arg(long, value_name = "FILE")]
    study: Option<PathBuf>,
    /// New study file, which must not exist [default: picked.toml in the folder, or picked-2.toml and so on].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Budget of the optimisation from the point of the front, in evaluations.
const REFINEMENT_BUDGET: usize = 1000;

fn demand(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => {
            Ok((name.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("expected a criterion and a value, such as settling=12".to_owned()),
    }
}

pub(super) fn pick(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let front = front(&arguments.folder)?;
    let path = arguments.study.clone().unwrap_or_else(|| arguments.folder.join("study.toml"));
    if arguments.study.is_none() && !path.is_file() {
        let fact = format!("there is no study.toml in `{}`", arguments.folder.display());
        return Err(Diagnostic::new(fact)
            .with_help(
                "pass the study file with --study; change the demands of a study built in Rust in its source code",
            )
            .into());
    }
    let out = output_path(arguments)?;
    let open = |settings: Vec<String>| {
        let study = StudyArguments { study: path.display().to_string(), settings };
        open_as(catalogue, &study, &["study.task=\"design\"".to_owned(), "study.objective=\"max\"".to_owned()])
    };
    let before = open(Vec::new())?.study;
    for (name, _) in &arguments.demands {
        check_criterion(&before, name)?;
    }
    let demands = in_units(&before, &arguments.demands);
    let setting = |(name, value): &(String, String)| format!("criteria.{}.demand={}", key(name), written(value));
    let mut file = open(demands.iter().map(setting).collect())?;
    file.study.cancelled_by(&cancel_after(arguments.limit));
    let problem = Problem::new(Arc::new(file.study.clone()));
    let (index, at) = nearest(&problem, &front, &path)?;
    let (refined, stop) = if arguments.no_refine { (None, None) } else { refined(catalogue, &problem, &at) };
    print(&comparison(&file.study, (index, front.len()), &at, refined.as_ref()))?;
    if let Some(why) = stop.and_then(cut_off) {
        print(&format!("\n{why}\n"))?;
    }
    let chosen = refined.as_ref().unwrap_or(&at);
    let text =
        fs::read_to_string(&path).map_err(|error| CommandError::Failure(format!("{}: {error}", path.display())))?;
    let home = Home::File(path.clone());
    let mut inputs = inputs(&home, &file);
    inputs.add(&arguments.folder.join("result.json"), "the front");
    let outputs = Outputs::besides(inputs);
    let folder = match out.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let text = toml_text::settled(&text, &[], &|data| relative_path(folder, &path, data)).into_text();
    outputs.write(&out, picked(&text, &file, chosen, &demands)).map_err(CommandError::cannot_write(&out))?;
    print(&format!("\na study that starts there is in {}\n", out.display()))?;
    if let Some(note) = reading::note(catalogue, &home, &file, &out) {
        print(&note)?;
    }
    Ok(if chosen.merit.is_feasible() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// Returns the path of the new study file, which must not exist.
fn output_path(arguments: &Arguments) -> Result<PathBuf, Diagnostic> {
    match &arguments.out {
        Some(out) if out.symlink_metadata().is_ok() => {
            Err(Diagnostic::new(format!("`{}` already exists", out.display()))
                .with_help("remove it, or choose another file with --out; nothing was written"))
        }
        Some(out) => Ok(out.clone()),
        None => {
            let names = std::iter::once("picked.toml".to_owned()).chain((2..).map(|i| format!("picked-{i}.toml")));
            let free = names.map(|name| arguments.folder.join(name)).find(|path| path.symlink_metadata().is_err());
            Ok(free.expect("some number is free"))
        }
    }
}

/// Reads the points of a Pareto front.
fn front(folder: &Path) -> Result<Vec<Value>, Diagnostic> {
    let path = folder.join("result.json");
    let help = "name the output folder of `mops pareto`, such as results/pid-pareto";
    let text = read_regular(&path)
        .map_err(|_| Diagnostic::new(format!("there is no result in `{}`", folder.display())).with_help(help))?;
    let result: Value = serde_json::from_slice(&text)
        .map_err(|error| Diagnostic::new(format!("cannot parse `{}`: {error}", path.display())).with_help(help))?;
    match result["front"].as_array() {
        Some(points) if !points.is_empty() && result.get("trade_offs").is_some() => Ok(points.clone()),
        _ => {
            let study = result["study"].as_str().unwrap_or("STUDY");
            Err(Diagnostic::new(format!("the result in `{}` is a single design, not a Pareto front", folder.display()))
                .with_help(format!("compute the front first: mops pareto {study}")))
        }
    }
}

/// Checks that a criterion is an objective of the front.
fn check_criterion(study: &Study, name: &str) -> Result<(), Diagnostic> {
    let minimised = || study.rows().iter().filter(|row| row.usage == Usage::Minimise).map(|row| row.name.as_str());
    if minimised().any(|known| known == name) {
        return Ok(());
    }
    if study.rows().iter().any(|row| row.name == name) {
        return Err(Diagnostic::new(format!("`{name}` is not an objective of the front: its usage is not minimise"))
            .with_help("change its demand in the study, and compute the front again"));
    }
    let mut names: Vec<&str> = minimised().collect();
    names.dedup();
    Err(Diagnostic::new(format!("the front has no criterion `{name}`")).with_help(suggestion(name, names)))
}

/// Formats a value as TOML: a number as it is, a quantity with a unit in quotes.
fn written(value: &str) -> String {
    if value.parse::<f64>().is_ok() { value.to_owned() } else { quoted(value) }
}

/// Returns the index and the evaluation of the point with the smallest worst scaled value under the demands of the
/// problem.
fn nearest(problem: &Problem, front: &[Value], study: &Path) -> Result<(usize, Evaluation), Diagnostic> {
    let tuners = problem.study().tuners();
    let mut best: Option<(usize, Evaluation)> = None;
    for (i, point) in front.iter().enumerate() {
        let values: Option<Vec<f64>> = tuners.iter().map(|tuner| point["tuners"][&tuner.name].as_f64()).collect();
        let values = values.ok_or_else(|| {
            Diagnostic::new(format!("the front does not belong to the study `{}`: the tuners differ", study.display()))
                .with_help("name the study of the front with --study")
        })?;
        let at = problem.evaluate_at(&values);
        if at.is_cancelled() {
            return Err(Diagnostic::new("the points of the front were not evaluated within the time limit")
                .with_help("increase --time-limit"));
        }
        if best.as_ref().is_none_or(|(_, best)| at.merit.is_better_than(&best.merit)) {
            best = Some((i, at));
        }
    }
    Ok(best.expect("a front has points"))
}

/// Solves the min-max problem from a point. Returns the better point, if one was found, and how the search stopped, if
/// there was one.
fn refined(catalogue: &Catalogue, problem: &Problem, from: &Evaluation) -> (Option<Evaluation>, Option<Stop>) {
    let Some(sqp) = catalogue.solvers.iter().find(|kind| kind.name == "sqp") else { return (None, None) };
    let mut solver = sqp.default_choice().make();
    if solver.accepts(problem.shape()).is_err() {
        return (None, None);
    }
    let mut run = Run::new(problem, Budget { evaluations: REFINEMENT_BUDGET }, &());
    let stop = run.solve(solver.as_mut(), &from.point);
    let better = run.best().filter(|best| best.merit.is_better_than(&from.merit));
    (better.map(|best| problem.concluding().evaluate_at(&best.tuners)), Some(stop))
}

/// Returns the sentence for a search that ended before its optimum.
fn cut_off(stop: Stop) -> Option<String> {
    let (cause, way) = match stop {
        Stop::Converged | Stop::Stalled => return None,
        Stop::Budget => (format!("after {REFINEMENT_BUDGET} evaluations"), "run the new study to go on"),
        // Nothing but the time limit interrupts the search here.
        Stop::TimeLimit | Stop::Interrupted => {
            ("at the time limit".to_owned(), "increase --time-limit, or run the new study to go on")
        }
    };
    Some(format!("the refinement ended {cause}, before it found an optimum; {way}"))
}

/// Formats the point of the front and its refinement side by side.
fn comparison(study: &Study, (index, of): (usize, usize), at: &Evaluation, refined: Option<&Evaluation>) -> String {
    let with = |header: &[&str], numeric: &[usize], rows: Vec<Vec<String>>| table(header, numeric, rows);
    let now = refined.map(|refined| criterion_reports(study, refined));
    let rows = criterion_reports(study, at).into_iter().enumerate().map(|(k, report)| {
        let last = now.as_ref().map_or(&report, |now| &now[k]);
        let demand = report.demand.or(report.bad).map_or_else(String::new, number);
        let refined = now.as_ref().map_or_else(String::new, |_| number(last.value));
        vec![
            report.case.clone(),
            report.name.clone(),
            demand,
            number(report.value),
            refined,
            report.unit.clone(),
            number(last.scaled),
            met_text(last).to_owned(),
        ]
    });
    let second = if refined.is_some() { "refined" } else { "" };
    let criteria =
        with(&["case", "criterion", "demand", "point", second, "unit", "scaled", "met"], &[2, 3, 4, 6], rows.collect());
    let active = study.tuners().iter().enumerate().filter(|(_, tuner)| tuner.active);
    let rows = active.map(|(i, tuner)| {
        let refined = refined.map_or_else(String::new, |refined| number(refined.tuners[i]));
        vec![tuner.name.clone(), number(at.tuners[i]), refined, tuner.unit.to_string()]
    });
    let tuners = with(&["tuner", "point", second, "unit"], &[1, 2], rows.collect());
    let worst = number(at.merit.objective);
    let then = match refined {
        Some(refined) => {
            format!(", {} after refinement (min-max problem solved from this point)", number(refined.merit.objective))
        }
        None => String::new(),
    };
    format!(
        "point {} of {of} is nearest to these demands: worst scaled value {worst}{then}\n\n{criteria}\n{tuners}",
        index + 1
    )
}

/// Adds to numbers the unit in which the front lists the criterion.
fn in_units(study: &Study, demands: &[(String, String)]) -> Vec<(String, String)> {
    let unit = |name: &str| study.rows().iter().find(|row| row.name == name).map(|row| row.unit.to_string());
    let with_unit = |(name, value): &(String, String)| {
        let bare = value.trim().parse::<f64>().is_ok();
        let value = match unit(name).filter(|unit| bare && unit != "1") {
            Some(unit) => format!("{} {unit}", value.trim()),
            None => value.clone(),
        };
        (name.clone(), value)
    };
    demands.iter().map(with_unit).collect()
}

/// Returns the text of a study that starts at the point, with the new demands.
fn picked(text: &str, file: &StudyFile, at: &Evaluation, demands: &[(String, String)]) -> String {
    let mut text = TomlText::new(text);
    for (name, value) in demands {
        text.set(&["criteria", name, "demand"], &written(value));
    }
    for (tuner, value) in file.study.tuners().iter().zip(&at.tuners) {
        let place = ["tuners", tuner.name.as_str(), "start"];
        if tuner.active && tuner.tie.is_none() && text.has(&place[..2]) {
            text.set(&place, &toml_text::number(*value));
        }
    }
    text.set(&["study", "name"], &quoted(&format!("{}-picked", file.study.name())));
    text.set(&["study", "task"], "\"design\"");
    if text.has(&["study", "objective"]) {
        text.set(&["study", "objective"], "\"max\"");
    }
    let demands: Vec<String> = demands.iter().map(|(name, value)| format!("{name} = {value}")).collect();
    text.head(&format!("Point of the Pareto front of {}, for {}.", file.study.name(), demands.join(", ")));
    text.into_text()
}
