//! `mops run`: solves a study and leaves the result behind.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use mops_core::file::StudyFile;
use mops_core::{Catalogue, Diagnostic, Mistake, MonteCarloReport, Study, Task, Watch, suggestion};

use super::progress::Progress;
use super::remains::{leave, leave_study};
use super::study::{StudyArguments, home, open_as, without_settings};
use super::{Trouble, cannot_write, diagnosis, findings, keep, print, tables};
use crate::diagnosis::Original;
use crate::report::Report;
use crate::solve::{DEFAULT_EVALUATIONS, Options, Solved, solves};
use crate::store::{Keeper, Opened, Start};
use crate::watch::{Both, Page};

/// What `mops diagnose` sets.
const DIAGNOSIS: &str = "study.task=\"diagnosis\"";

/// What `mops pareto` sets.
const PARETO: &str = "study.task=\"pareto\"";

/// What can be said to every run.
#[derive(Args)]
pub(super) struct Common {
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
    /// Say nothing but errors.
    #[arg(long)]
    quiet: bool,
    /// Serve a live page of the run to this machine: best point against the demands, convergence, failures, time left.
    ///
    /// The address is printed; it holds a secret, and nobody else on the machine or in the network finds it.
    #[arg(long)]
    watch: bool,
    /// Show convergence, and the best criteria against their demands, in the terminal while the run goes.
    #[arg(long, conflicts_with_all = ["quiet", "json"])]
    dashboard: bool,
    /// Print result.json on standard output, and nothing else.
    #[arg(long)]
    json: bool,
    /// Of a diagnosis: write the repaired model as source too, repaired.rs.
    #[arg(long, value_name = "LANGUAGE")]
    export: Option<Language>,
}

/// A language that a repaired model is written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Language {
    /// A program that builds and solves the repaired study.
    Rust,
}

/// What can be said to a run.
#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    effort: Effort,
}

/// By which solver, and how long.
#[derive(Args)]
pub(super) struct Effort {
    #[command(flatten)]
    keep: keep::Beginning,
    /// Kind of solver, with its default options, instead of the study's.
    #[arg(long)]
    solver: Option<String>,
    /// Largest number of points evaluated.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..))]
    max_evaluations: Option<u64>,
}

/// What is done with the study.
pub(super) enum Search<'a> {
    /// What it is for, with this solver and budget where they are given.
    Task(&'a Effort),
    /// What its model lacks.
    Diagnosis,
    /// Its front, of so many points where that is said.
    Pareto { effort: &'a Effort, points: Option<u16> },
}

impl Search<'_> {
    /// What it sets in the study.
    fn settings(&self) -> Vec<String> {
        match self {
            Self::Task(_) => Vec::new(),
            Self::Diagnosis => vec![DIAGNOSIS.to_owned()],
            Self::Pareto { points, .. } => {
                let points = points.map(|points| format!("pareto.points={points}"));
                std::iter::once(PARETO.to_owned()).chain(points).collect()
            }
        }
    }

    fn effort(&self) -> Option<&Effort> {
        match self {
            Self::Task(effort) | Self::Pareto { effort, .. } => Some(effort),
            Self::Diagnosis => None,
        }
    }
}

pub(super) fn run(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, Trouble> {
    go(catalogue, &arguments.common, &Search::Task(&arguments.effort))
}

/// Runs the study and leaves the result behind.
pub(super) fn go(catalogue: &Catalogue, arguments: &Common, search: &Search<'_>) -> Result<ExitCode, Trouble> {
    let mut file = open_as(catalogue, &arguments.study, &search.settings())?;
    if arguments.export.is_some() && file.study.task != Task::Diagnosis {
        return Err(Diagnostic::new(
            "`--export` writes the repaired model of a diagnosis, and this study is for something else",
        )
        .with_help("call `mops diagnose`, or leave `--export` out")
        .into());
    }
    if let Some(seed) = arguments.seed {
        file.study.seed = seed;
    }
    let (chosen, limit) = search.effort().map_or((None, None), |e| (e.solver.as_deref(), e.max_evaluations));
    let start = search.effort().map_or(Start::Fresh, |effort| effort.keep.start());
    let solver = match chosen {
        None => file.solver.clone(),
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
    let limit = limit.map(|n| usize::try_from(n).unwrap_or(usize::MAX));
    let options = Options {
        solver,
        max_evaluations: limit.or(file.max_evaluations).unwrap_or(DEFAULT_EVALUATIONS),
        jobs: arguments.jobs.map(usize::from),
        effects: catalogue.effects.clone(),
        keeping: None,
    };
    let talks = !arguments.quiet && !arguments.json;
    let folder = arguments.out.clone().unwrap_or_else(|| Path::new("results").join(&file.study.name));
    let mut progress = Progress::new(talks, options.max_evaluations);
    if arguments.dashboard {
        progress = progress.with_criteria_of(&file.study);
    }
    if talks {
        for warning in &file.study.warnings {
            let _ = writeln!(std::io::stderr(), "warning: {warning}");
        }
        print(&introduction(&file.study, &options));
    }
    let home = home(catalogue, &arguments.study);
    let settings: Vec<String> = arguments.study.settings.iter().cloned().chain(search.settings()).collect();
    // What the command sets is part of what was said: a report that is written again needs it.
    let said = StudyArguments { study: arguments.study.study.clone(), settings: settings.clone() };
    let keeper = keep::open((&folder, &start), (&file, &said), &home, &options)?;
    if let Some(note) = keeper.as_ref().and_then(|keeper| keeper.note.as_ref()).filter(|_| talks) {
        let _ = writeln!(std::io::stderr(), "note: {note}");
    }
    let known = keeper.as_ref().map_or(0, Keeper::known);
    let page = arguments.watch.then(|| watch(&file.study, &options)).transpose()?;
    let both = page.as_ref().map(|page| Both { page, other: &progress });
    let watch: &dyn Watch = both.as_ref().map_or(&progress, |both| both);
    let (solved, opened) = keep::solve_keeping(&file.study, &options, keeper, watch);
    progress.finish();
    let solved = match solved {
        Ok(solved) => solved,
        Err(why) => {
            opened.into_iter().for_each(Opened::withdraw);
            return Err(refused(&why.0, &file, options.solver.kind).into());
        }
    };
    let told = opened.as_ref().map(|opened| keep::told(&start, known, opened)).unwrap_or_default();

    let json = serde_json::to_string_pretty(&solved.outcome).expect("a result is JSON") + "\n";
    write(&folder, &json, &solved, &file.source.text)?;
    if let Some(page) = page {
        page.finish(&folder);
    }
    if let Some(trouble) =
        opened.and_then(|opened| opened.end(keep::state(solved.outcome.stop), solved.outcome.evaluations))
    {
        let _ = writeln!(std::io::stderr(), "warning: not every evaluation could be kept: {trouble}");
    }
    let plain = without_settings(&file.source.text, &settings);
    if let Some(diagnosis) = &solved.diagnosis {
        let (settings, study) = (&arguments.study.settings, solved.problem.study());
        let original = Original { text: plain, settings, study, effects: &catalogue.effects };
        leave(&folder, diagnosis, &original, &home, arguments.export.is_some())?;
    }
    if solved.outcome.task == Task::Pareto {
        leave_study(&folder, plain, &settings, &home)?;
    }
    if arguments.json {
        print(&json);
    } else if talks {
        match &solved.diagnosis {
            Some(found) => print(&diagnosis::text(found, solved.outcome.seconds)),
            // Of inputs alone there are no criteria to show.
            None if solved.outcome.task == Task::Excitation => {}
            None => print(&tables::outcome(&solved.outcome)),
        }
        print(&findings::text(&solved.outcome));
        print(&told);
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

/// The live page of a run; its address is all that is said of it.
fn watch(study: &Study, options: &Options) -> Result<Page, Trouble> {
    let cannot = |error| Trouble::Failure(format!("no page can be served for --watch: {error}"));
    let page = Page::open(study, options.solver.kind, options.max_evaluations).map_err(cannot)?;
    let _ = writeln!(std::io::stderr(), "watch the run at {}", page.address());
    Ok(page)
}

/// A study that cannot be treated; the place is shown where there is one: the file does not name a solver of the command line.
fn refused(why: &Mistake, file: &StudyFile, solver: &str) -> Diagnostic {
    let of_command_line = solver != file.solver.kind && why.path.first().is_some_and(|key| key == "solver");
    if why.path.is_empty() || of_command_line {
        Diagnostic { help: why.help.clone(), ..Diagnostic::new(why.message.clone()) }
    } else {
        file.locate(why)
    }
}

fn introduction(study: &Study, options: &Options) -> String {
    let active = study.tuners.iter().filter(|t| t.active).count();
    if study.task == Task::Diagnosis {
        let experiments = study.cases.iter().filter_map(|case| case.experiment.as_ref());
        let (count, channels) = experiments.fold((0, 0), |(n, m), e| (n + 1, m + e.channels.len()));
        let model = &study.name;
        return format!(
            "{model}: {active} tuners, {count} experiments with {channels} channels; looking for what the model lacks\n"
        );
    }
    format!(
        "{}: {} tuners, {} criteria over {} cases, solver {}\n",
        study.name,
        active,
        study.rows.len(),
        study.cases.len(),
        if solves(study) { options.solver.kind } else { "none (nothing is solved)" }
    )
}

/// Everything a run leaves behind; result.json comes first, so that it is there whatever happens to the rest.
fn write(folder: &Path, json: &str, solved: &Solved, text: &str) -> Result<(), Trouble> {
    std::fs::create_dir_all(folder).map_err(cannot_write(folder))?;
    let result = folder.join("result.json");
    std::fs::write(&result, json).map_err(cannot_write(&result))?;
    let evaluations = folder.join("evaluations.csv");
    write_evaluations(&evaluations, solved).map_err(|e| cannot_write(&evaluations)(std::io::Error::other(e)))?;
    if let Some(found) = &solved.outcome.found.monte_carlo {
        let samples = folder.join("samples.csv");
        write_samples(&samples, found).map_err(|e| cannot_write(&samples)(std::io::Error::other(e)))?;
    }
    let Solved { outcome, problem, best, archive, front, diagnosis } = solved;
    Report { outcome, problem, best, archive, front, diagnosis: diagnosis.as_ref(), text }
        .write(folder)
        .map_err(cannot_write(folder))
}

/// One line per sample: uncertain parameters, criteria.
fn write_samples(path: &Path, found: &MonteCarloReport) -> Result<(), csv::Error> {
    let mut writer = csv::Writer::from_path(path)?;
    let parameters = found.parameters.iter().map(|p| format!("{}[{}]", p.name, p.unit));
    let criteria = found.criteria.iter().map(|c| format!("{}/{}[{}]", c.of.case, c.of.criterion, c.of.unit));
    writer.write_record(parameters.chain(criteria))?;
    for (parameters, values) in &found.table {
        writer.write_record(parameters.iter().chain(values).map(f64::to_string))?;
    }
    writer.flush()?;
    Ok(())
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
