//! `mops run`: solves a study and leaves the result behind.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, ValueEnum};
use mops_core::file::StudyFile;
use mops_core::{Catalogue, Diagnostic, Halt, Mistake, Stop, Study, Task, Watch, suggestion};

use super::remains::{PATIENCE, Remains};
use super::study::{StudyArguments, home, open_as, without_settings};
use super::{diagnosis, findings, keep, tables};
use crate::numbers::file_name;
use crate::search::{DEFAULT_EVALUATIONS, Options, Solved, solves, suits};
use crate::store::Start;
use crate::terminal::{CommandError, Limit, Progress, cancel_on_signal, eprint_line, print, print_json};
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
    /// Number of threads; all cores where absent. The result is the same, bit for bit, with any number and on any processor.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    #[command(flatten)]
    limit: Limit,
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

pub(super) fn run(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    go(catalogue, &arguments.common, &Search::Task(&arguments.effort))
}

/// Runs the study and leaves the result behind.
pub(super) fn go(catalogue: &Catalogue, arguments: &Common, search: &Search<'_>) -> Result<ExitCode, CommandError> {
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
        cancellation: cancel_on_signal(
            arguments.limit,
            "interrupted: saving the best point; press Ctrl-C again to quit now",
        ),
    };
    // Before anything of an earlier run is touched.
    suits(&file.study, &options.solver).map_err(|why| refused(&why.0, &file, options.solver.kind))?;
    let talks = !arguments.quiet && !arguments.json;
    // N.B.: the name of a study is no path, wherever the study comes from.
    let folder = arguments.out.clone().unwrap_or_else(|| Path::new("results").join(file_name(&file.study.name)));
    let mut progress = Progress::new(talks, options.max_evaluations, &options.cancellation);
    if arguments.dashboard {
        progress = progress.with_criteria_of(&file.study);
    }
    if talks {
        for warning in &file.study.warnings {
            eprint_line(&format!("warning: {warning}"));
        }
    }
    let mut said = Said::default();
    said.of(if talks { print(&introduction(&file.study, &options)) } else { Ok(()) });
    let home = home(catalogue, &arguments.study);
    let settings: Vec<String> = arguments.study.settings.iter().cloned().chain(search.settings()).collect();
    // What the command sets is part of what was said: a report that is written again needs it.
    let asked = StudyArguments { study: arguments.study.study.clone(), settings: settings.clone() };
    let keeper = keep::open((&folder, &start), (&file, &asked), &home, &options)?;
    if let Some(note) = keeper.note.as_ref().filter(|_| talks) {
        eprint_line(&format!("note: {note}"));
    }
    let (known, id) = (keeper.known(), keeper.id.clone());
    let page = arguments.watch.then(|| watch(&file.study, &options)).transpose()?;
    let both = page.as_ref().map(|page| Both { page, other: &progress });
    let watch: &dyn Watch = both.as_ref().map_or(&progress, |both| both);
    let (solved, mut opened) = keep::solve_keeping(&file.study, &options, keeper, watch);
    progress.finish();
    let mut solved = match solved {
        Ok(solved) => solved,
        Err(why) => {
            opened.withdraw();
            return Err(refused(&why.0, &file, options.solver.kind).into());
        }
    };
    solved.outcome.run = Some(id);
    let ended_early = options.cancellation.requested();
    if let (Stop::Budget, Some(limit), Some(Halt::Budget)) =
        (solved.outcome.stop, arguments.limit.time_limit, ended_early)
    {
        let way_out = if keep::keeps(&file.study) { "; --resume continues it where it was" } else { "" };
        let warning = format!("the time limit of {} s ended the run{way_out}", limit.as_secs_f64());
        solved.outcome.warnings.push(warning);
    }
    let told = keep::told(&start, known, &opened);
    let remains = Remains {
        folder: &folder,
        solved: &solved,
        text: &file.source.text,
        plain: without_settings(&file.source.text, &settings),
        own: &arguments.study.settings,
        settings: &settings,
        home: &home,
        effects: &catalogue.effects,
        export: arguments.export.is_some(),
    };

    // What was found is shown whatever becomes of the files.
    let held = opened.hold();
    let result = match &held {
        // A full disk was waited for already, where evaluations had to go.
        Ok(_) => remains.write_result(if opened.is_whole() { PATIENCE } else { Duration::ZERO }),
        Err(why) => Err(CommandError::Failure(why.clone())),
    };
    if arguments.json {
        said.of(print_json(&solved.outcome));
    } else if talks {
        said.of(print(&(shown(&solved) + &told)));
    }
    if let Ok(Some(note)) = &held {
        eprint_line(&format!("warning: {note}"));
    }
    let written = result.and_then(|()| remains.write_others());
    if let Some(page) = page {
        page.finish(&folder);
    }
    if let Some(trouble) = opened.end(keep::state(solved.outcome.stop), solved.outcome.evaluations) {
        eprint_line(&format!("warning: not all of the run is in the database: {trouble}"));
    }
    if talks && written.is_ok() {
        said.of(print(&format!("\nresult, report and plots are in {}\n", folder.display())));
    }
    written?;
    said.0?;
    status(&solved, &folder, ended_early.is_some())
}

/// The exit status of a run whose result is written.
fn status(solved: &Solved, folder: &Path, ended_early: bool) -> Result<ExitCode, CommandError> {
    if solved.outcome.stop == Stop::Interrupted {
        return Ok(ExitCode::from(4));
    }
    if solved.best.scaled.is_none() {
        let failed = solved.best.failures.first().map(|(_, failure)| format!(": {failure}"));
        let early = || if ended_early { " in time" } else { "" }.to_owned();
        let (why, folder) = (failed.unwrap_or_else(early), folder.display());
        return Err(CommandError::Failure(format!("no point could be simulated{why}; the result is in {folder}")));
    }
    Ok(if solved.outcome.feasible { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// The first thing that could not be printed: a run goes on all the same.
struct Said(Result<(), CommandError>);

impl Default for Said {
    fn default() -> Self {
        Self(Ok(()))
    }
}

impl Said {
    fn of(&mut self, printed: Result<(), CommandError>) {
        if self.0.is_ok() {
            self.0 = printed;
        }
    }
}

/// A result in tables and sentences.
fn shown(solved: &Solved) -> String {
    let tables = match &solved.diagnosis {
        Some(found) => diagnosis::text(found, solved.outcome.seconds),
        // Without a verdict, or of inputs alone, there are no criteria to show.
        None if matches!(solved.outcome.task, Task::Diagnosis | Task::Excitation) => {
            solved.outcome.warnings.iter().map(|warning| format!("warning: {warning}\n")).collect()
        }
        None => tables::outcome(&solved.outcome),
    };
    tables + &findings::text(&solved.outcome)
}

/// The live page of a run; its address is all that is said of it.
fn watch(study: &Study, options: &Options) -> Result<Page, CommandError> {
    let cannot = |error| CommandError::Failure(format!("no page can be served for --watch: {error}"));
    let page = Page::open(study, options.solver.kind, options.max_evaluations).map_err(cannot)?;
    eprint_line(&format!("watch the run at {}", page.address()));
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
