//! Runs that last: what is known before a run begins, and what is kept of it.

use std::path::{Path, PathBuf};

use clap::Args;
use mops_core::file::StudyFile;
use mops_core::{Diagnostic, SensitivityMethod, Stop, Study, Task, Watch};

use super::study::{Home, StudyArguments};
use crate::search::{EvaluationStore, Options, SolveError, Solved, solves};
use crate::solve::solve;
use crate::store::{Identity, Keeper, Opened, Refusal, RunRow, RunState, Start, row};
use crate::terminal::CommandError;

/// What a run begins with.
#[derive(Args)]
pub(super) struct Beginning {
    /// Continue the run of this study in the folder that was interrupted or killed, to the result it would have had.
    ///
    /// The search begins anew and is answered from evaluations.sqlite wherever a point is known there, so that nothing is
    /// simulated twice. A larger --max-evaluations makes a run that is over longer. Where nothing is there the run begins.
    #[arg(long, conflicts_with = "reuse")]
    resume: bool,
    /// Use the evaluations of the run in this folder again: its study may have had other demands, usages, weights, bounds
    /// or start values, or another solver.
    ///
    /// The search begins at the known point that is best under the demands of this study, and simulates no known point
    /// again; result.json says in `reused` how many it met.
    #[arg(long, value_name = "DIR")]
    reuse: Option<PathBuf>,
}

impl Beginning {
    pub fn start(&self) -> Start {
        match &self.reuse {
            Some(folder) => Start::Reuse(folder.clone()),
            None if self.resume => Start::Resume,
            None => Start::Fresh,
        }
    }
}

impl From<Refusal> for CommandError {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Mistake(diagnostic) => diagnostic.into(),
            Refusal::Failure(message) => Self::Failure(message),
        }
    }
}

/// Whether a study asks for points that can be kept: those of a search, a sweep, or samples of uncertain parameters.
pub(super) fn keeps(study: &Study) -> bool {
    solves(study) || study.task() == Task::Sweep || samples(study)
}

/// Whether the task asks for points at values of the uncertain parameters.
pub(super) fn samples(study: &Study) -> bool {
    match study.task() {
        Task::Design => study.tasks().robust.is_some(),
        Task::Sensitivity => study.tasks().sensitivity.method != SensitivityMethod::Local,
        task => matches!(task, Task::WorstCase | Task::MonteCarlo),
    }
}

/// Claims the folder of a run that is about to begin, and opens its database; a task that evaluates no points enters there that
/// it ran.
pub(super) fn open(
    (folder, start): (&Path, &Start),
    (file, study): (&StudyFile, &StudyArguments),
    home: &Home,
    options: &Options,
) -> Result<Keeper, CommandError> {
    if !keeps(&file.study) && *start != Start::Fresh {
        return Err(Diagnostic::new("this task keeps no evaluations that a later run could use")
            .with_help("leave --resume and --reuse out: the same seed gives the same result")
            .into());
    }
    let identity = Identity::of(file, &file.study, options.solver.kind);
    let home = match home {
        Home::Shipped(shipped) => PathBuf::from(shipped.name),
        Home::Built(built) => PathBuf::from(built.name()),
        Home::File(path) => std::path::absolute(path).unwrap_or_else(|_| path.clone()),
    };
    let task = serde_json::to_value(file.study.task()).expect("a task is a word");
    let run = RunRow {
        home,
        settings: study.settings.clone(),
        name: file.study.name().to_owned(),
        task: task.as_str().unwrap_or_default().to_owned(),
        text: file.source.text.clone(),
        seed: file.study.seed(),
        solver: options.solver.kind.to_owned(),
        max_evaluations: options.max_evaluations,
        ..row(&identity)
    };
    Ok(Keeper::open(folder, start, &file.study, &identity, &run)?)
}

/// A solved study, and the database in which its points are.
pub(super) type Done = (Result<Solved, SolveError>, Opened);

/// Solves the study; its points are kept.
pub(super) fn solve_keeping(study: &Study, options: &Options, keeper: Keeper, watch: &dyn Watch) -> Done {
    let begin = keeper.begin.clone();
    let keeping = Some(EvaluationStore { study: study.clone(), store: keeper.store(), begin });
    let options = Options { keeping, ..options.clone() };
    keeper.run(watch, |watch| solve(study.clone(), &options, watch))
}

/// How the table of runs names the end of a run.
pub(super) fn state(stop: Stop) -> RunState {
    match stop {
        Stop::Converged => RunState::Converged,
        Stop::Budget => RunState::Budget,
        Stop::Stalled => RunState::Stalled,
        Stop::Interrupted => RunState::Interrupted,
    }
}

/// What is said of points that were known.
pub(super) fn told(start: &Start, known: usize, opened: &Opened) -> String {
    match start {
        Start::Fresh => String::new(),
        Start::Resume | Start::Reuse(_) => format!(
            "\n{known} known points; {} evaluations met one of them and were not simulated, {} were simulated\n",
            opened.reused, opened.simulated
        ),
    }
}
