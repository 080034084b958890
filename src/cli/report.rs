//! `mops report`: writes the page of a run again, from what the run left.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use mops_core::{Catalogue, Diagnostic, Stop, suggestion};

use super::past::Past;
use super::{Trouble, cannot_write, keep, print};
use crate::report::Report;
use crate::solve::{Options, Solved};
use crate::store::{Identity, Keeper, RunRow, RunState, Start};

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

pub(super) fn report(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, Trouble> {
    let folder = &arguments.folder;
    let Again { solved, text } = again(catalogue, folder)?;
    let Solved { outcome, problem, best, archive, front, .. } = &solved;
    let report = Report { outcome, problem, best, archive, front, diagnosis: None, text: &text };
    report.write(folder).map_err(cannot_write(folder))?;
    let count = outcome.evaluations;
    print(&format!("report.html and the plots of {count} evaluations are in {}\n", folder.display()));
    Ok(ExitCode::SUCCESS)
}

/// Goes through a run again: every point is answered from its database, and nothing is searched beyond them.
pub(super) fn again(catalogue: &Catalogue, folder: &Path) -> Result<Again, Trouble> {
    let past = Past::of(folder)?;
    let mut file = past.study(catalogue)?;
    let Some((run, goes_on)) = &past.run else { unreachable!("a study was found in it") };
    if *goes_on {
        return Err(Diagnostic::new(format!("the run in {} goes on", folder.display()))
            .with_help("it writes its report when it ends; `mops run --watch` shows one that goes")
            .into());
    }
    if cut_short(run) && keep::samples(&file.study) {
        return Err(Diagnostic::new(format!(
            "the run in {} came to no end, and what it found is not whole",
            folder.display()
        ))
        .with_help(format!(
            "`{} --resume` ends it, and simulates no known point again",
            run.command.replace(" --resume", "")
        ))
        .into());
    }
    file.study.seed = run.seed;
    let options = options(catalogue, &file.solver, run)?;
    let identity = Identity::of(&file, &file.study, options.solver.kind);
    let keeper = Keeper::open(folder, &Start::Look, &file.study, &identity, run)?;
    let (solved, _) = keep::solve_keeping(&file.study, &options, Some(keeper), &());
    let mut solved = solved.map_err(|why| Diagnostic::new(why.to_string()))?;
    if cut_short(run) {
        solved.outcome.stop = Stop::Interrupted;
    }
    if let Some(seconds) = past.ended().and_then(|result| result["seconds"].as_f64()) {
        solved.outcome.seconds = seconds;
    }
    Ok(Again { solved, text: file.source.text.clone() })
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
    Ok(Options { solver, max_evaluations, jobs: None, effects: catalogue.effects.clone(), keeping: None })
}
