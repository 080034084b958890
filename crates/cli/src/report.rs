//! `mops report`: rewrites the report of a run from its stored evaluations.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use mops_core::{Catalogue, Stop};
use mops_language::{Diagnostic, files::read_regular, suggestion};
use mops_output::{Inputs, Outputs};
use mops_report::Report;
use mops_store::{Identity, Recorder, RunRow, RunState};
use mops_tasks::{Options, Solved, room_of};

use super::past_run::PastRun;
use super::resume;
use super::run_files::{REPORT, check_outputs};
use crate::terminal::{CommandError, print};

/// Arguments of `mops report`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Output folder (--out) of a run.
    folder: PathBuf,
}

/// Run restored from its database, with the text of its study.
pub(super) struct Restored {
    pub solved: Solved,
    pub text: String,
}

pub(super) fn report(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let folder = &arguments.folder;
    let past = PastRun::open(folder)?;
    let mut inputs = Inputs::default();
    past.add_to(catalogue, &mut inputs);
    past.add_data_to(&mut inputs, &past.study(catalogue)?);
    let outputs = Outputs::besides(inputs);
    check_outputs(&outputs, folder, REPORT)?;
    let Restored { solved, text } = replay(catalogue, &past)?;
    let _lock = mops_store::lock_folder(folder)?;
    let room = room_of(&catalogue.tasks, solved.outcome.task).expect("the file names a task of the catalogue");
    Report::new(&solved, room, &text).write_by(folder, &outputs).map_err(CommandError::cannot_write(folder))?;
    let from = if room.has_point() {
        format!("{} evaluations", solved.outcome.evaluations)
    } else {
        format!("the {}", room.title().to_lowercase())
    };
    print(&format!("report.html and plots from {from} are in {}\n", folder.display()))?;
    Ok(ExitCode::SUCCESS)
}

/// Replays a run: every point is answered from its database, and the search ends at the first point that is not stored.
fn replay(catalogue: &Catalogue, past: &PastRun) -> Result<Restored, CommandError> {
    let folder = &past.folder;
    let mut file = past.study(catalogue)?;
    let Some((run, is_running)) = &past.run else { unreachable!("a study was found in it") };
    if *is_running {
        return Err(Diagnostic::new(format!("the run in {} is still in progress", folder.display()))
            .with_help("it writes its report at the end; `mops run --watch` shows a run in progress")
            .into());
    }
    let room = room_of(&catalogue.tasks, file.study.task().name()).expect("the file names a task of the catalogue");
    if let Some(name) = room.restored_from() {
        let mut study = file.study.clone();
        study.set_seed(run.seed);
        let options = options(catalogue, &file.solver, run)?;
        let mut solved = room.restored(&study, &options, read_regular(&folder.join(name)))?;
        (solved.outcome.stop, solved.outcome.seconds) = (stop(run.state), past.seconds().unwrap_or(0.0));
        return Ok(Restored { solved, text: file.source.text.clone() });
    }
    if !room.stores_points(&file.study) {
        let task = &run.task;
        return Err(Diagnostic::new(format!(
            "the run in {} is a {task}, which stores no evaluations",
            folder.display()
        ))
        .with_help(format!("run it again: `{}`", run.command))
        .into());
    }
    if ended_early(run) && room.samples_uncertain(&file.study) {
        return Err(Diagnostic::new(format!(
            "the run in {} did not finish, and its findings are incomplete",
            folder.display()
        ))
        .with_help(format!(
            "finish it with `{} --resume`, which simulates no stored point again",
            command_without_resume(run)
        ))
        .into());
    }
    file.study.set_seed(run.seed);
    let options = options(catalogue, &file.solver, run)?;
    let identity = Identity::of(&file, &file.study, options.solver.kind);
    let recorder = Recorder::replay(folder, &file.study, &identity, &options.cancellation)?;
    let (solved, _) = resume::solve_recorded(&file.study, &options, recorder, &());
    let mut solved = solved.map_err(|why| Diagnostic::new(why.to_string()))?;
    let outcome = &mut solved.outcome;
    let ended_with = if past.finished_result().is_some() { run.evaluations } else { 0 };
    if outcome.evaluations < ended_with {
        let (there, folder) = (outcome.evaluations, folder.display());
        return Err(Diagnostic::new(format!(
            "the database in {folder} has {there} of the run's {ended_with} evaluations"
        ))
        .with_help(format!(
            "`{} --resume` simulates the others again and writes the report",
            command_without_resume(run)
        ))
        .into());
    }
    outcome.stop = stop(run.state);
    outcome.seconds = past.seconds().unwrap_or(outcome.seconds);
    Ok(Restored { solved, text: file.source.text.clone() })
}

/// Returns why a run stopped.
fn stop(state: RunState) -> Stop {
    match state {
        RunState::Converged => Stop::Converged,
        RunState::Budget => Stop::Budget,
        RunState::TimeLimit => Stop::TimeLimit,
        RunState::Stalled => Stop::Stalled,
        RunState::Interrupted | RunState::Running => Stop::Interrupted,
    }
}

/// Returns the command line of a run without `--resume`.
fn command_without_resume(run: &RunRow) -> String {
    run.command.replace(" --resume", "")
}

/// Returns true if the run ended before its solver or its budget did.
fn ended_early(run: &RunRow) -> bool {
    matches!(run.state, RunState::Running | RunState::Interrupted)
}

/// Returns the options of the run. An unfinished run is replayed as far as it came.
fn options(
    catalogue: &Catalogue,
    of_file: &mops_core::catalogue::SolverChoice,
    run: &RunRow,
) -> Result<Options, Diagnostic> {
    let solver = if of_file.kind == run.solver {
        of_file.clone()
    } else {
        let names = catalogue.solvers.iter().map(|kind| kind.name);
        let kind = catalogue.solvers.iter().find(|kind| kind.name == run.solver);
        let unknown =
            || Diagnostic::new(format!("no solver `{}`", run.solver)).with_help(suggestion(&run.solver, names));
        kind.ok_or_else(unknown)?.default_choice()
    };
    let replayed = ended_early(run).then_some(run.evaluations);
    Ok(Options {
        solver,
        max_evaluations: run.max_evaluations,
        replayed,
        tasks: catalogue.tasks.clone(),
        effects: catalogue.effects.clone(),
        ..Options::default()
    })
}
