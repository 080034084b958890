//! `mops report`: writes the page of a run again, from what the run left.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use mops_core::{Catalogue, Diagnostic, Stop, suggestion};

use super::keep;
use super::past::Past;
use crate::report::Report;
use crate::search::{Options, Solved};
use crate::store::{self, Identity, Keeper, RunRow, RunState};
use crate::terminal::{CommandError, print};

/// Which page is written.
#[derive(Args)]
pub(super) struct Arguments {
    /// Folder of a run, as --out had it.
    folder: PathBuf,
}

/// A run as it was, and the study it was for.
pub(super) struct Again {
    pub solved: Solved,
    pub text: String,
}

pub(super) fn report(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let folder = &arguments.folder;
    let past = Past::of(folder)?;
    let Again { solved, text } = again(catalogue, &past)?;
    let _claim = store::claim(folder)?;
    let Solved { outcome, problem, best, archive, front, .. } = &solved;
    let report = Report { outcome, problem, best, archive, front, diagnosis: None, text: &text };
    report.write(folder).map_err(CommandError::cannot_write(folder))?;
    let count = outcome.evaluations;
    print(&format!("report.html and the plots of {count} evaluations are in {}\n", folder.display()))?;
    Ok(ExitCode::SUCCESS)
}

/// Goes through a run again: every point is answered from its database, and nothing is searched beyond them.
fn again(catalogue: &Catalogue, past: &Past) -> Result<Again, CommandError> {
    let folder = &past.folder;
    let mut file = past.study(catalogue)?;
    let Some((run, goes_on)) = &past.run else { unreachable!("a study was found in it") };
    if *goes_on {
        return Err(Diagnostic::new(format!("the run in {} goes on", folder.display()))
            .with_help("it writes its report when it ends; `mops run --watch` shows one that goes")
            .into());
    }
    if !keep::keeps(&file.study) {
        let task = &run.task;
        return Err(Diagnostic::new(format!(
            "the run in {} is a {task}, which keeps no evaluations",
            folder.display()
        ))
        .with_help(format!("`{}` does it again", run.command))
        .into());
    }
    if cut_short(run) && keep::samples(&file.study) {
        return Err(Diagnostic::new(format!(
            "the run in {} came to no end, and what it found is not whole",
            folder.display()
        ))
        .with_help(format!("`{} --resume` ends it, and simulates no known point again", plainly(run)))
        .into());
    }
    file.study.set_seed(run.seed);
    let options = options(catalogue, &file.solver, run)?;
    let identity = Identity::of(&file, &file.study, options.solver.kind);
    let keeper = Keeper::look(folder, &file.study, &identity, &options.cancellation)?;
    let (solved, _) = keep::solve_keeping(&file.study, &options, keeper, &());
    let mut solved = solved.map_err(|why| Diagnostic::new(why.to_string()))?;
    let (outcome, result) = (&mut solved.outcome, past.ended());
    let ended_with = result.and_then(|result| result["evaluations"].as_u64()).unwrap_or(0);
    if (outcome.evaluations as u64) < ended_with {
        let (there, folder) = (outcome.evaluations, folder.display());
        return Err(Diagnostic::new(format!(
            "the database in {folder} has {there} of the run's {ended_with} evaluations"
        ))
        .with_help(format!("`{} --resume` simulates the others again, and writes the report", plainly(run)))
        .into());
    }
    outcome.stop = match run.state {
        RunState::Converged => Stop::Converged,
        RunState::Budget => Stop::Budget,
        RunState::Stalled => Stop::Stalled,
        RunState::Interrupted | RunState::Running => Stop::Interrupted,
    };
    if let Some(seconds) = result.and_then(|result| result["seconds"].as_f64()) {
        outcome.seconds = seconds;
    }
    Ok(Again { solved, text: file.source.text.clone() })
}

/// The command line of a run, without `--resume`.
fn plainly(run: &RunRow) -> String {
    run.command.replace(" --resume", "")
}

/// Whether a run ended before its solver or its budget did.
fn cut_short(run: &RunRow) -> bool {
    matches!(run.state, RunState::Running | RunState::Interrupted)
}

/// The options the run had; of one that was cut short, with a budget of the points it has.
fn options(catalogue: &Catalogue, of_file: &mops_core::SolverChoice, run: &RunRow) -> Result<Options, Diagnostic> {
    let solver = if of_file.kind == run.solver {
        of_file.clone()
    } else {
        let names = catalogue.solvers.iter().map(|kind| kind.name);
        let kind = catalogue.solvers.iter().find(|kind| kind.name == run.solver);
        let unknown =
            || Diagnostic::new(format!("no solver `{}`", run.solver)).with_help(suggestion(&run.solver, names));
        kind.ok_or_else(unknown)?.default_choice()
    };
    let max_evaluations = if cut_short(run) { run.evaluations.max(1) } else { run.max_evaluations };
    Ok(Options { solver, max_evaluations, effects: catalogue.effects.clone(), ..Options::default() })
}
