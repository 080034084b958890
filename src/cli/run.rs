//! `mops run`: solves a study and leaves the result behind.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use mops_core::file::StudyFile;
use mops_core::{Catalogue, Diagnostic, Place, Study, Task, suggestion};

use super::progress::Progress;
use super::study::{StudyArguments, open};
use super::{Trouble, cannot_write, findings, print, tables};
use crate::report::Report;
use crate::solve::{DEFAULT_EVALUATIONS, Options, Solved, solve};

/// What can be said to a run.
#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    /// Folder for the result; results/<study> where absent.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Seed of all random numbers.
    #[arg(long)]
    seed: Option<u64>,
    /// Number of threads; all cores where absent. The result is the same, bit for bit.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Kind of solver, with its default options, instead of the study's.
    #[arg(long)]
    solver: Option<String>,
    /// Largest number of points evaluated.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..))]
    max_evaluations: Option<u64>,
    /// Say nothing but errors.
    #[arg(long)]
    quiet: bool,
    /// Print result.json on standard output, and nothing else.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, Trouble> {
    let StudyFile { mut study, solver, max_evaluations, source } = open(catalogue, &arguments.study)?;
    if let Some(seed) = arguments.seed {
        study.seed = seed;
    }
    let solver = match &arguments.solver {
        None => solver,
        Some(name) => {
            let names = catalogue.solvers.iter().map(|kind| kind.name);
            let kind = catalogue
                .solvers
                .iter()
                .find(|kind| kind.name == name)
                .ok_or_else(|| Diagnostic::new(format!("no solver `{name}`")).with_help(suggestion(name, names)))?;
            kind.default_choice()
        }
    };
    let limit = arguments.max_evaluations.map(|n| usize::try_from(n).unwrap_or(usize::MAX));
    let options = Options {
        solver,
        max_evaluations: limit.or(max_evaluations).unwrap_or(DEFAULT_EVALUATIONS),
        jobs: arguments.jobs.map(usize::from),
    };
    let talks = !arguments.quiet && !arguments.json;
    let folder = arguments.out.clone().unwrap_or_else(|| Path::new("results").join(&study.name));
    let progress = Progress::new(talks, options.max_evaluations);
    if talks {
        for warning in &study.warnings {
            let _ = writeln!(std::io::stderr(), "warning: {warning}");
        }
        print(&introduction(&study, &options));
    }
    let solved = solve(study, &options, &progress).map_err(|why| Diagnostic::new(why.0))?;
    progress.finish();

    let json = serde_json::to_string_pretty(&solved.outcome).expect("a result is JSON") + "\n";
    write(&folder, &json, &solved, &source.text)?;
    if arguments.json {
        print(&json);
    } else if talks {
        // Of inputs alone there are no criteria to show.
        if solved.outcome.task != Task::Excitation {
            print(&tables::outcome(&solved.outcome));
        }
        print(&findings::text(&solved.outcome));
        print(&format!("\nresult, report and plots are in {}\n", folder.display()));
    }
    if solved.best.scaled.is_none() {
        let why = solved.best.failures.first().map_or_else(String::new, |(_, failure)| format!(": {failure}"));
        return Err(Trouble::Failure(format!(
            "no point could be simulated{why}; the result is in {}",
            folder.display()
        )));
    }
    Ok(if solved.outcome.feasible { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

fn introduction(study: &Study, options: &Options) -> String {
    let active = study.tuners.iter().filter(|t| t.active).count();
    format!(
        "{}: {} tuners, {} criteria over {} cases, solver {}\n",
        study.name,
        active,
        study.rows.len(),
        study.cases.len(),
        if solves(study) { options.solver.kind } else { "none (nothing is solved)" }
    )
}

/// Whether the task of a study needs a solver.
fn solves(study: &Study) -> bool {
    match study.task {
        Task::Design | Task::Calibration => true,
        Task::Excitation => false,
        Task::Sensitivity => study.tasks.sensitivity.at == Place::Optimum,
        Task::Sweep => study.tasks.sweep.as_ref().is_none_or(|sweep| sweep.at == Place::Optimum),
    }
}

/// Everything a run leaves behind; result.json comes first, so that it is there whatever happens to the rest.
fn write(folder: &Path, json: &str, solved: &Solved, text: &str) -> Result<(), Trouble> {
    std::fs::create_dir_all(folder).map_err(cannot_write(folder))?;
    let result = folder.join("result.json");
    std::fs::write(&result, json).map_err(cannot_write(&result))?;
    let evaluations = folder.join("evaluations.csv");
    write_evaluations(&evaluations, solved).map_err(|e| cannot_write(&evaluations)(std::io::Error::other(e)))?;
    let Solved { outcome, problem, best, archive } = solved;
    Report { outcome, problem, best, archive, text }.write(folder).map_err(cannot_write(folder))
}

/// One line per point: tuners, criteria, objective, violation.
fn write_evaluations(path: &Path, solved: &Solved) -> Result<(), csv::Error> {
    let study = solved.problem.study();
    let mut writer = csv::Writer::from_path(path)?;
    let tuners = study.tuners.iter().map(|t| format!("{}[{}]", t.name, t.unit));
    let rows = study.rows.iter().map(|row| format!("{}[{}]", study.key(row), row.unit));
    writer.write_record(tuners.chain(rows).chain(["objective".into(), "violation".into()]))?;
    for record in &solved.archive {
        let numbers =
            record.tuners.iter().chain(&record.values).chain([&record.merit.objective, &record.merit.violation]);
        writer.write_record(numbers.map(f64::to_string))?;
    }
    writer.flush()?;
    Ok(())
}
