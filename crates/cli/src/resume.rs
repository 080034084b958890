//! Stored evaluations of a run: `--resume` and `--reuse`.

use std::path::{Path, PathBuf};

use clap::Args;
use mops_core::{Stop, Study, Watch};
use mops_file::StudyFile;
use mops_language::Diagnostic;
use mops_store::{FinishedRun, Identity, OpenError, Recorder, RunRow, RunState, Start};
use mops_tasks::{EvaluationStore, Options, Room, SolveError, Solved, solve};

use super::home::Home;
use super::study::StudyArguments;
use crate::terminal::CommandError;

/// Options for the use of stored evaluations.
#[derive(Args)]
pub(super) struct StartOptions {
    /// Continue the interrupted or killed run of this study in the output folder, to the result of an uninterrupted
    /// run.
    ///
    /// The search is repeated, but points stored in evaluations.sqlite are not simulated again. A larger
    /// --max-evaluations extends a finished run. If the folder has no run yet, a new run is started.
    #[arg(long, conflicts_with = "reuse")]
    resume: bool,
    /// Reuse the evaluations stored in DIR. Demands, usages, weights, bounds, start values and the solver of that run
    /// may differ.
    ///
    /// The search starts at the stored point that is best under the demands of this study, and simulates no stored
    /// point again. `reused` in result.json is the number of stored points that the run used.
    #[arg(long, value_name = "DIR")]
    reuse: Option<PathBuf>,
}

impl StartOptions {
    pub fn start(&self) -> Start {
        match &self.reuse {
            Some(folder) => Start::Reuse(folder.clone()),
            None if self.resume => Start::Resume,
            None => Start::Fresh,
        }
    }
}

impl From<OpenError> for CommandError {
    fn from(refusal: OpenError) -> Self {
        match refusal {
            OpenError::Mistake(diagnostic) => diagnostic.into(),
            OpenError::Failure(message) => Self::Failure(message),
        }
    }
}

/// Locks the folder of a new run and opens its database. A task that evaluates no points only adds a row to the table
/// of runs.
pub(super) fn open(
    (folder, start): (&Path, &Start),
    (file, study): (&StudyFile, &StudyArguments),
    home: &Home,
    options: &Options,
    room: &dyn Room,
) -> Result<Recorder, CommandError> {
    if !room.stores_points(&file.study) && *start != Start::Fresh {
        return Err(Diagnostic::new("this task stores no evaluations that a later run could reuse")
            .with_help("remove --resume or --reuse; the same seed gives the same result")
            .into());
    }
    let identity = Identity::of(file, &file.study, options.solver.kind);
    let run = RunRow {
        home: home.recorded(),
        settings: study.settings.clone(),
        name: file.study.name().to_owned(),
        task: file.study.task().name().to_owned(),
        text: file.source.text.clone(),
        seed: file.study.seed(),
        solver: options.solver.kind.to_owned(),
        max_evaluations: options.max_evaluations,
        ..RunRow::of(&identity)
    };
    Ok(Recorder::open(folder, start, &file.study, &identity, &run)?)
}

/// Solved study, and the database of its points.
pub(super) type RecordedSolution = (Result<Solved, SolveError>, FinishedRun);

/// Solves the study and stores its points.
pub(super) fn solve_recorded(
    study: &Study,
    options: &Options,
    recorder: Recorder,
    watch: &dyn Watch,
) -> RecordedSolution {
    let start_point = recorder.start_point.clone();
    let keeping = Some(EvaluationStore { study: study.clone(), store: recorder.store(), begin: start_point });
    let options = Options { keeping, ..options.clone() };
    recorder.run(watch, |watch| solve(study.clone(), &options, watch))
}

/// Returns the state of a finished run in the table of runs.
pub(super) fn state(stop: Stop) -> RunState {
    match stop {
        Stop::Converged => RunState::Converged,
        Stop::Budget => RunState::Budget,
        Stop::TimeLimit => RunState::TimeLimit,
        Stop::Stalled => RunState::Stalled,
        Stop::Interrupted => RunState::Interrupted,
    }
}

/// Formats the numbers of stored, reused and simulated points; empty for a fresh run.
pub(super) fn cache_summary(start: &Start, known: usize, opened: &FinishedRun) -> String {
    match start {
        Start::Fresh => String::new(),
        Start::Resume | Start::Reuse(_) => {
            format!("\ncache: {known} points, {} hits, {} simulated\n", opened.reused, opened.simulated)
        }
    }
}
