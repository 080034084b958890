//! `mops bench`: compares solvers on a study, over several seeds.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use maud::{PreEscaped, html};
use mops_content::{
    numbers::{number, significant},
    plot::{Color, Curve, Plot},
};
use mops_core::{Catalogue, Halt, Objective, Stop, Study, Usage, solver::SMALL_OBJECTIVE};
use mops_language::Diagnostic;
use mops_output::Outputs;
use mops_report::{Draw, page};
use mops_tasks::{DEFAULT_EVALUATIONS, Options, Solved, solve, suits};
use serde::Serialize;

use super::default_folder;
use super::run::{refused, solver_named};
use super::study::{StudyArguments, home, open, outputs};
use crate::terminal::{CommandError, Limit, Progress, cancel_on_signal, eprint_line, print, print_json, table};

/// Arguments of `mops bench`.
#[derive(Args)]
#[command(after_help = "\
Every solver runs from the start values of the study, once per seed, with the same budget. A run succeeds if it comes within \
the tolerance of the best known value: the smallest objective of all runs, or --known.

Written to the output folder: runs.csv (one line per run), profile.svg and profile.png (share of successful runs over the \
number of evaluations), bench.html (both).

Examples:
  mops bench pid-design --solver auto,sqp,pattern-search
  mops bench my-study --solver cma-es,genetic --seeds 10 --max-evaluations 5000")]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    /// Solvers, separated by commas.
    #[arg(long, value_name = "SOLVERS", value_delimiter = ',', required = true)]
    solver: Vec<String>,
    /// Number of seeds: 1, 2, and so on.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=1000))]
    seeds: u16,
    /// Budget of every run: largest number of evaluated points [default: that of the study, or 20000].
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..))]
    max_evaluations: Option<u64>,
    /// Best known value of the objective [default: the smallest objective of all runs].
    #[arg(long, value_name = "OBJECTIVE", allow_negative_numbers = true)]
    known: Option<f64>,
    /// Relative distance from the best known value within which a run succeeds.
    #[arg(long, value_name = "TOLERANCE", default_value_t = 1e-3)]
    within: f64,
    /// Number of threads [default: all cores].
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    #[command(flatten)]
    limit: Limit,
    /// Output folder [default: results/<study>-bench].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print a JSON object instead of the table.
    #[arg(long)]
    json: bool,
}

/// One run of a solver.
#[derive(Debug, Clone, Serialize)]
struct BenchRun {
    solver: &'static str,
    seed: u64,
    /// Objective of the reported point; null if it violates a constraint or no simulation succeeded.
    objective: Option<f64>,
    /// True if the objective is within the tolerance of the best known value.
    success: bool,
    /// Number of evaluations after which it was so for the first time.
    arrived: Option<usize>,
    evaluations: usize,
    simulations: usize,
    seconds: f64,
    stop: Stop,
    /// Objectives that improved on all before, with the number of evaluations.
    #[serde(skip)]
    history: Vec<(usize, f64)>,
}

/// Result of the comparison.
#[derive(Serialize)]
struct Bench {
    study: String,
    /// Best known value of the objective.
    known: f64,
    /// Relative distance from it within which a run succeeds.
    within: f64,
    max_evaluations: usize,
    /// Number of runs asked for.
    planned: usize,
    /// Cause for which fewer runs finished: the time limit or an interruption.
    cut_off: Option<&'static str>,
    /// Solvers without a finished run.
    unfinished: Vec<&'static str>,
    runs: Vec<BenchRun>,
}

pub(super) fn bench(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let file = open(catalogue, &arguments.study)?;
    if !file.study.task().chooses_tuners() || file.study.objective() == Objective::Each {
        return Err(Diagnostic::new("solvers are compared on a design or a calibration, but the task is another one")
            .with_help("add --set study.task=\"design\", or use `mops run` with each solver")
            .into());
    }
    let most = arguments.max_evaluations.map(|n| usize::try_from(n).unwrap_or(usize::MAX));
    let max_evaluations = most.or(file.max_evaluations).unwrap_or(DEFAULT_EVALUATIONS);
    let outputs = outputs(&home(catalogue, &arguments.study), &file);
    let folder = match &arguments.out {
        Some(folder) => folder.clone(),
        None => default_folder::named(&format!("{}-bench", file.study.name()))?,
    };
    for name in FILES {
        let path = folder.join(name);
        outputs.check(&path).map_err(CommandError::cannot_write(&path))?;
    }
    let cancellation = cancel_on_signal(arguments.limit, "interrupted: writing the finished runs");
    let mut runs = Vec::new();
    let solvers =
        arguments.solver.iter().map(|name| solver_named(catalogue, &file, name)).collect::<Result<Vec<_>, _>>()?;
    for solver in &solvers {
        suits(&file.study, solver).map_err(|why| refused(&why.0, &file, solver.kind))?;
    }
    for solver in &solvers {
        for seed in 1..=u64::from(arguments.seeds) {
            if cancellation.requested().is_some() {
                break;
            }
            let mut study = file.study.clone();
            study.set_seed(seed);
            let options = Options {
                solver: solver.clone(),
                max_evaluations,
                jobs: arguments.jobs.map(usize::from),
                effects: catalogue.effects.clone(),
                cancellation: cancellation.clone(),
                ..Options::default()
            };
            let progress = Progress::new(!arguments.json, max_evaluations, &cancellation);
            let solved = solve(study, &options, &progress);
            progress.finish();
            let solved = solved.map_err(|why| refused(&why.0, &file, solver.kind))?;
            // An interrupted run says nothing of its solver.
            if cancellation.requested().is_none() {
                runs.push(of_run(solver.kind, seed, &solved));
            }
        }
    }
    let planned = solvers.len() * usize::from(arguments.seeds);
    let cut_off = match cancellation.requested() {
        _ if runs.len() == planned => None,
        Some(Halt::TimeLimit) => Some("time limit"),
        _ => Some(INTERRUPTION),
    };
    let found = runs.iter().filter_map(|run| run.objective).reduce(f64::min);
    let known = match arguments.known.or(found) {
        Some(known) if !(runs.is_empty() && cut_off.is_some()) => known,
        _ => return without_value(&file.study, cut_off.map(|cause| (cause, runs.len(), planned))),
    };
    let limit = known + arguments.within * known.abs().max(SMALL_OBJECTIVE);
    for run in &mut runs {
        run.success = run.objective.is_some_and(|objective| objective <= limit);
        let first = run.history.iter().find(|(_, objective)| *objective <= limit);
        run.arrived = first.map(|(evaluations, _)| *evaluations).filter(|_| run.success);
    }
    let (study, within) = (file.study.name().to_owned(), arguments.within);
    let kinds = solvers.iter().map(|solver| solver.kind);
    let unfinished = kinds.filter(|kind| runs.iter().all(|run| run.solver != *kind)).collect();
    let bench = Bench { study, known, within, max_evaluations, planned, cut_off, unfinished, runs };
    bench.write(&folder, &outputs)?;
    if arguments.json {
        print_json(&bench)?;
    } else {
        print(&format!("{}\nruns, profile and page are in {}\n", bench.text(), folder.display()))?;
    }
    let interrupted = cancellation.requested() == Some(Halt::Interrupted);
    Ok(if interrupted { ExitCode::from(4) } else { ExitCode::SUCCESS })
}

/// Returns the end of a bench whose runs give no best known value.
fn without_value(study: &Study, cut_off: Option<(&str, usize, usize)>) -> Result<ExitCode, CommandError> {
    if let Some((cause, finished, planned)) = cut_off {
        let fact = format!("the {cause} ended the bench after {finished} of {planned} runs, without an objective");
        eprint_line(&format!("error: {fact}; raise --time-limit, or lower --seeds"));
        return Ok(ExitCode::from(if cause == INTERRUPTION { 4 } else { 3 }));
    }
    let is_constrained = study.rows().iter().any(|row| matches!(row.usage, Usage::Inequality | Usage::Equality));
    let (fact, way_out) = match is_constrained {
        true => {
            ("no run found a point that satisfies the constraints", "raise --max-evaluations, or try other solvers")
        }
        false => ("no run found a point whose simulations succeed", "`mops simulate` shows why they fail"),
    };
    Err(Diagnostic::new(fact).with_help(way_out).into())
}

fn of_run(solver: &'static str, seed: u64, solved: &Solved) -> BenchRun {
    let outcome = &solved.outcome;
    let mut history: Vec<(usize, f64)> = Vec::new();
    for (evaluations, record) in (1..).zip(&solved.archive) {
        let objective = record.merit.objective;
        if record.merit.is_feasible() && history.last().is_none_or(|(_, best)| objective < *best) {
            history.push((evaluations, objective));
        }
    }
    BenchRun {
        solver,
        seed,
        objective: Some(outcome.objective).filter(|value| outcome.feasible && value.is_finite()),
        success: false,
        arrived: None,
        evaluations: outcome.evaluations,
        simulations: outcome.simulations,
        seconds: outcome.seconds,
        stop: outcome.stop,
        history,
    }
}

impl Bench {
    /// Returns the solvers in the order of the command line, each with its runs.
    fn solvers(&self) -> Vec<(&'static str, Vec<&BenchRun>)> {
        let mut solvers: Vec<(&'static str, Vec<&BenchRun>)> = Vec::new();
        for run in &self.runs {
            match solvers.iter_mut().find(|(solver, _)| *solver == run.solver) {
                Some((_, runs)) => runs.push(run),
                None => solvers.push((run.solver, vec![run])),
            }
        }
        solvers
    }

    /// Returns one line per solver: successes, objectives, medians of the evaluations and of the time.
    #[allow(clippy::cast_precision_loss)]
    fn rows(&self) -> Vec<Vec<String>> {
        let row = |(solver, runs): (&'static str, Vec<&BenchRun>)| {
            let objectives: Vec<f64> = runs.iter().map(|run| run.objective.unwrap_or(f64::INFINITY)).collect();
            let shown = |value: Option<f64>| match value {
                Some(value) if value.is_finite() => significant(value, 6),
                _ => String::new(),
            };
            let arrived: Vec<f64> = runs.iter().filter_map(|run| run.arrived).map(|n| n as f64).collect();
            vec![
                solver.to_owned(),
                format!("{} of {}", runs.iter().filter(|run| run.success).count(), runs.len()),
                shown(quantile(&objectives, 0.0)),
                shown(quantile(&objectives, 0.5)),
                shown(quantile(&objectives, 1.0)),
                shown(quantile(&arrived, 0.5)),
                shown(quantile(&runs.iter().map(|run| run.evaluations as f64).collect::<Vec<_>>(), 0.5)),
                quantile(&runs.iter().map(|run| run.seconds).collect::<Vec<_>>(), 0.5).map_or_else(String::new, number),
            ]
        };
        self.solvers().into_iter().map(row).collect()
    }

    fn introduction(&self) -> String {
        let finished = self.runs.len();
        let cut_off = self.cut_off.map_or_else(String::new, |cause| {
            let none = match self.unfinished.join(", ") {
                none if none.is_empty() => none,
                none => format!(", none of {none}"),
            };
            format!("cut off by the {cause}: {finished} of {} runs finished{none}; ", self.planned)
        });
        format!(
            "{}: {cut_off}best known objective {}; a run succeeds within {} of it; budget {} evaluations",
            self.study,
            significant(self.known, 6),
            significant(100.0 * self.within, 3) + " %",
            self.max_evaluations
        )
    }

    fn text(&self) -> String {
        let numeric: Vec<usize> = (1..HEADER.len()).collect();
        format!("{}\n\n{}", self.introduction(), table(&HEADER, &numeric, self.rows()))
    }

    /// Returns the data profile: the share of successful runs over the number of evaluations.
    ///
    /// Source: J. J. More, S. M. Wild, SIAM Journal on Optimization 20 (2009) 172-191.
    #[allow(clippy::cast_precision_loss)]
    fn profile(&self) -> Plot {
        let curve = |(i, (solver, runs)): (usize, (&'static str, Vec<&BenchRun>))| {
            let mut arrived: Vec<usize> = runs.iter().filter_map(|run| run.arrived).collect();
            arrived.sort_unstable();
            let share = |count: usize| 100.0 * count as f64 / runs.len() as f64;
            let mut points = vec![(1.0, 0.0)];
            for (count, &evaluations) in arrived.iter().enumerate() {
                points.extend([(evaluations as f64, share(count)), (evaluations as f64, share(count + 1))]);
            }
            points.push((self.max_evaluations as f64, share(arrived.len())));
            Curve { name: solver.to_owned(), points, color: Color::Series(i), ..Curve::default() }
        };
        Plot {
            title: format!("{}: successful runs", self.study),
            x_label: "evaluations (1)".into(),
            y_label: "runs (%)".into(),
            log_x: true,
            curves: self.solvers().into_iter().enumerate().map(curve).collect(),
            ..Plot::default()
        }
    }

    fn write(&self, folder: &Path, outputs: &Outputs) -> Result<(), CommandError> {
        std::fs::create_dir_all(folder).map_err(CommandError::cannot_write(folder))?;
        let csv = folder.join("runs.csv");
        outputs
            .write_csv(&csv, |writer| self.runs.iter().try_for_each(|run| writer.serialize(run)))
            .map_err(CommandError::cannot_write(&csv))?;
        let write = |name: &str, content: String| {
            let path = folder.join(name);
            outputs.write(&path, content).map_err(CommandError::cannot_write(&path))
        };
        let profile = self.profile();
        write("profile.svg", profile.svg())?;
        let png = folder.join("profile.png");
        profile.png().and_then(|bytes| outputs.write(&png, bytes)).map_err(CommandError::cannot_write(&png))?;
        let body = html! {
            h1 { (self.study) }
            p { (self.introduction()) }
            div class="wide" {
                table {
                    thead { tr { @for title in HEADER { th scope="col" { (title) } } } }
                    tbody { @for row in self.rows() { tr { @for cell in row { td { (cell) } } } } }
                }
            }
            figure { (PreEscaped(profile.svg())) }
        };
        write("bench.html", page(&format!("{}: solvers", self.study), &body.into_string()))
    }
}

/// Cause of an end by a signal.
const INTERRUPTION: &str = "interruption";

/// Output files.
const FILES: [&str; 4] = ["runs.csv", "profile.svg", "profile.png", "bench.html"];

/// Columns of the table.
const HEADER: [&str; 8] =
    ["solver", "success", "best", "median", "worst", "evaluations to success", "evaluations", "time, s"];

/// Returns a quantile of values, the nearest one; `None` without values.
#[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get((share * sorted.len().saturating_sub(1) as f64).round() as usize).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_the_nearest_values() {
        let values = [3.0, 1.0, f64::INFINITY];
        assert_eq!([0.0, 0.5, 1.0].map(|share| quantile(&values, share)), [Some(1.0), Some(3.0), Some(f64::INFINITY)]);
        assert_eq!(quantile(&[], 0.5), None);
    }
}
