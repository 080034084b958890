//! `mops run`: solves a study and writes the result.

use mops_store::Start;
use mops_tasks::{Room, calibration, room_of};
use mops_watch::{Both, Page};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, ValueEnum};
use mops_content::numbers::counted;
use mops_core::{Catalogue, Stop, Study, StudyError, Watch, catalogue::SolverChoice};
use mops_file::StudyFile;
use mops_language::{Diagnostic, suggestion};
use mops_tasks::{DEFAULT_EVALUATIONS, Options, Solved, solves, suits};

use super::home::Home;
use super::run_files::{DISK_TIMEOUT, RunFiles, check_run, relative_path};
use super::study::{StudyArguments, home, open_as, outputs, without_settings};
use super::{blocks, default_folder, reading, resume, tables};
use crate::terminal::{CommandError, Limit, Progress, cancel_on_signal, eprint_line, print, print_json};

/// Options of every command that runs a study.
#[derive(Args)]
pub(super) struct CommonOptions {
    #[command(flatten)]
    study: StudyArguments,
    /// Folder for the result [default: results/<study>].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Seed of all random numbers.
    #[arg(long)]
    seed: Option<u64>,
    /// Number of threads [default: all cores]. The result is identical, bit for bit, for any number and on any
    /// processor.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    #[command(flatten)]
    limit: Limit,
    /// Print errors only.
    #[arg(long)]
    quiet: bool,
    /// Serve a live page of the run: best point and demands, convergence, failures, time left.
    ///
    /// Prints the URL. It contains a random token, and the server listens on localhost only.
    #[arg(long)]
    watch: bool,
    /// Show convergence, and the best criteria with their demands, in the terminal during the run.
    #[arg(long, conflicts_with_all = ["quiet", "json"])]
    dashboard: bool,
    /// Print result.json to standard output, and nothing else.
    #[arg(long)]
    json: bool,
    /// Diagnosis only: also write the repaired model as source code, repaired.rs.
    #[arg(long, value_name = "LANGUAGE")]
    export: Option<Language>,
}

/// Language of the exported model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Language {
    /// Rust program that builds and solves the repaired study.
    Rust,
}

/// Options of `mops run`.
#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    common: CommonOptions,
    #[command(flatten)]
    solver_options: SolverOptions,
}

/// Solver, budget and stored evaluations of a run.
#[derive(Args)]
pub(super) struct SolverOptions {
    #[command(flatten)]
    start: resume::StartOptions,
    /// Kind of solver, with its default options, instead of the solver of the study.
    #[arg(long)]
    solver: Option<String>,
    /// Budget: largest number of evaluated points.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..))]
    max_evaluations: Option<u64>,
}

/// What a command asks of a study.
pub(super) struct Search<'a> {
    /// Settings that the command makes in the study.
    pub settings: &'a [String],
    /// Solver and budget of the command line, if the command takes them.
    pub solver_options: Option<&'a SolverOptions>,
}

pub(super) fn run(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let search = Search { settings: &[], solver_options: Some(&arguments.solver_options) };
    execute(catalogue, &arguments.common, &search)
}

/// Returns the solver of the study if it has this name, or the one of the catalogue with its default options.
pub(super) fn solver_named(catalogue: &Catalogue, file: &StudyFile, name: &str) -> Result<SolverChoice, Diagnostic> {
    if name == file.solver.kind {
        return Ok(file.solver.clone());
    }
    let names = catalogue.solvers.iter().map(|kind| kind.name);
    let kind = catalogue.solvers.iter().find(|kind| kind.name == name);
    let kind = kind.ok_or_else(|| Diagnostic::new(format!("no solver `{name}`")).with_help(suggestion(name, names)))?;
    Ok(kind.default_choice())
}

/// Runs the study and writes the result.
pub(super) fn execute(
    catalogue: &Catalogue,
    arguments: &CommonOptions,
    search: &Search<'_>,
) -> Result<ExitCode, CommandError> {
    let mut file = open_as(catalogue, &arguments.study, search.settings)?;
    let word = file.study.task().name();
    let room = room_of(&catalogue.tasks, word).expect("the file names a task of the catalogue");
    if arguments.export.is_some() && !room.can_export() {
        return Err(Diagnostic::new(
            "`--export` writes the repaired model of a diagnosis, but the task of this study is another one",
        )
        .with_help("use `mops diagnose`, or remove `--export`")
        .into());
    }
    if let Some(seed) = arguments.seed {
        file.study.set_seed(seed);
    }
    let (chosen, limit) = search.solver_options.map_or((None, None), |e| (e.solver.as_deref(), e.max_evaluations));
    let start = search.solver_options.map_or(Start::Fresh, |solver_options| solver_options.start.start());
    let solver = match chosen {
        None => file.solver.clone(),
        Some(name) => solver_named(catalogue, &file, name)?,
    };
    let limit = limit.map(|n| usize::try_from(n).unwrap_or(usize::MAX));
    let options = Options {
        solver,
        max_evaluations: limit.or(file.max_evaluations).unwrap_or(DEFAULT_EVALUATIONS),
        patience: None,
        replayed: None,
        jobs: arguments.jobs.map(usize::from),
        tasks: catalogue.tasks.clone(),
        effects: catalogue.effects.clone(),
        keeping: None,
        cancellation: cancel_on_signal(
            arguments.limit,
            "interrupted: saving the best point; press Ctrl-C again to quit now",
        ),
    };
    // Before any file of an earlier run is changed.
    suits(&file.study, &options.solver).map_err(|why| refused(&why.0, &file, options.solver.kind))?;
    let talks = !arguments.quiet && !arguments.json;
    let home = home(catalogue, &arguments.study);
    let folder = match &arguments.out {
        Some(folder) => folder.clone(),
        None => default_folder::of_study(catalogue, &home, file.study.name())?,
    };
    let outputs = outputs(&home, &file);
    check_run(&outputs, &folder, room)?;
    let mut progress = Progress::new(talks, options.max_evaluations, &options.cancellation);
    if arguments.dashboard && !std::io::stderr().is_terminal() {
        eprint_line("note: --dashboard needs a terminal: progress is printed as lines");
    } else if arguments.dashboard {
        progress = progress.with_criteria_of(&file.study);
    }
    if talks {
        for warning in file.study.warnings() {
            eprint_line(&format!("warning: {warning}"));
        }
    }
    let mut first_error = FirstError::default();
    first_error.record(if talks { print(&introduction(&file.study, room, &options)) } else { Ok(()) });
    let settings: Vec<String> =
        arguments.study.settings.iter().cloned().chain(search.settings.iter().cloned()).collect();
    // `mops report` needs the settings of the command, too.
    let asked = StudyArguments { study: arguments.study.study.clone(), settings: settings.clone() };
    let recorder = resume::open((&folder, &start), (&file, &asked), &home, &options, room)?;
    if let Some(note) = recorder.note.as_ref().filter(|_| talks) {
        eprint_line(&format!("note: {note}"));
    }
    let (known, id) = (recorder.known(), recorder.id.clone());
    let page = arguments.watch.then(|| watch(&file.study, &options)).transpose()?;
    let both = page.as_ref().map(|page| Both { page, other: &progress });
    let watch: &dyn Watch = both.as_ref().map_or(&progress, |both| both);
    let (solved, mut finished) = resume::solve_recorded(&file.study, &options, recorder, watch);
    progress.finish();
    let mut solved = match solved {
        Ok(solved) => solved,
        Err(why) => {
            finished.discard();
            return Err(refused(&why.0, &file, options.solver.kind).into());
        }
    };
    solved.outcome.run = Some(id);
    let stopped_early = options.cancellation.requested();
    if let (Stop::TimeLimit, Some(limit)) = (solved.outcome.stop, arguments.limit.time_limit) {
        let help = if room.stores_points(&file.study) { "; --resume continues the run" } else { "" };
        let warning = format!("stopped at the time limit of {} s{help}", limit.as_secs_f64());
        solved.outcome.warnings.push(warning);
    }
    let cache_summary = resume::cache_summary(&start, known, &finished);
    let locate = |path: &str| match &home {
        Home::File(study) => relative_path(&folder, study, path),
        Home::Shipped(_) | Home::Built(_) => path.to_owned(),
    };
    let files = RunFiles {
        folder: &folder,
        outputs: &outputs,
        solved: &solved,
        room,
        text: &file.source.text,
        plain: without_settings(&file.source.text, &settings),
        own: &arguments.study.settings,
        settings: &settings,
        home: &home,
        locate: &locate,
        effects: &catalogue.effects,
        export: arguments.export.is_some(),
    };

    // The result is printed even if the files cannot be written.
    let in_place = finished.ensure_in_place();
    let result = match &in_place {
        // If evaluations are missing, the writer has already waited for a full disk.
        Ok(_) => files.write_result(if finished.is_whole() { DISK_TIMEOUT } else { Duration::ZERO }),
        Err(why) => Err(CommandError::Failure(why.clone())),
    };
    if arguments.json {
        first_error.record(print_json(&solved.outcome));
    } else if talks {
        first_error.record(print(&(result_text(&solved, room) + &cache_summary)));
    }
    if let Ok(Some(note)) = &in_place {
        eprint_line(&format!("warning: {note}"));
    }
    let written = result.and_then(|()| files.write_others());
    if let Some(page) = page {
        page.finish(&folder);
    }
    if let Some(error) = finished.end(resume::state(solved.outcome.stop), solved.outcome.evaluations) {
        eprint_line(&format!("warning: the database of the run is incomplete: {error}"));
    }
    if talks && written.is_ok() {
        first_error.record(print(&format!("\nresult, report and plots are in {}\n", folder.display())));
    }
    if let Some(note) = written?.and_then(|study| reading::note(catalogue, &home, &file, &study)).filter(|_| talks) {
        first_error.record(print(&note));
    }
    first_error.0?;
    status(&solved, &folder, stopped_early.is_some())
}

/// Returns the exit status of a run whose result is written.
fn status(solved: &Solved, folder: &Path, stopped_early: bool) -> Result<ExitCode, CommandError> {
    if solved.outcome.stop == Stop::Interrupted {
        return Ok(ExitCode::from(4));
    }
    if solved.best.scaled.is_none() {
        let failed = solved.best.failures.first().map(|(_, failure)| format!(": {failure}"));
        let early = || if stopped_early { " in time" } else { "" }.to_owned();
        let (why, folder) = (failed.unwrap_or_else(early), folder.display());
        return Err(CommandError::Failure(format!("no point could be simulated{why}; the result is in {folder}")));
    }
    Ok(if solved.outcome.feasible { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// First error in printing; the run continues in spite of it.
struct FirstError(Result<(), CommandError>);

impl Default for FirstError {
    fn default() -> Self {
        Self(Ok(()))
    }
}

impl FirstError {
    fn record(&mut self, printed: Result<(), CommandError>) {
        if self.0.is_ok() {
            self.0 = printed;
        }
    }
}

/// Formats a result as tables and sentences.
fn result_text(solved: &Solved, room: &dyn Room) -> String {
    let outcome = &solved.outcome;
    let lines = room.lines(outcome);
    let study = solved.problem.study();
    let is_nominal = room.samples_uncertain(study) && !study.task().chooses_tuners();
    let of_point = match (room.has_point(), lines.is_empty()) {
        (true, _) => tables::outcome(outcome, room, is_nominal),
        (false, false) => String::new(),
        // No criteria exist without a verdict.
        (false, true) => outcome.warnings.iter().map(|warning| format!("warning: {warning}\n")).collect(),
    };
    let of_data = if room.has_point() { calibration::lines(outcome) } else { Vec::new() };
    of_point + &blocks::text(&of_data) + &blocks::text(&lines)
}

/// Opens the live page of a run and prints its URL.
fn watch(study: &Study, options: &Options) -> Result<Page, CommandError> {
    let cannot = |error| CommandError::Failure(format!("cannot serve the page of --watch: {error}"));
    let page = Page::open(study, options.solver.kind, options.max_evaluations).map_err(cannot)?;
    eprint_line(&format!("watch the run at {}", page.address()));
    Ok(page)
}

/// Returns the error for a study that the solver or task refuses. The position in the file is given if there is one; a
/// solver from the command line has none.
pub(super) fn refused(why: &StudyError, file: &StudyFile, solver: &str) -> Diagnostic {
    let of_command_line = solver != file.solver.kind && why.path.first().is_some_and(|key| key == "solver");
    if why.path.is_empty() || of_command_line {
        Diagnostic { help: why.help.clone(), ..Diagnostic::new(why.message.clone()) }
    } else {
        file.locate(why)
    }
}

fn introduction(study: &Study, room: &dyn Room, options: &Options) -> String {
    if let Some(text) = room.introduction(study) {
        return text + "\n";
    }
    let active = study.tuners().iter().filter(|t| t.active).count();
    format!(
        "{}: {}, {} over {}, solver {}\n",
        study.name(),
        counted(active, "tuner"),
        counted(study.rows().len(), "criterion"),
        counted(study.cases().len(), "case"),
        if solves(study) { options.solver.kind } else { "none (no optimisation)" }
    )
}
