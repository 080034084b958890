//! Entry point that performs the task of a study.

use std::time::Instant;

use mops_core::{Cancellation, Evaluation, Halt, Stop, Study, StudyError, Watch, run::State as RunState};

use crate::room::room;
use crate::search::{Options, SolveError, Solved};

/// Performs the task of a study; `watch` observes the run and may stop it.
///
/// # Errors
/// If the solver does not accept the problem.
///
/// # Panics
/// If the threads cannot be started.
pub fn solve(mut study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    study.cancelled_by(&options.cancellation);
    let watch = Cancellable { watch, cancellation: &options.cancellation };
    let threads = rayon::ThreadPoolBuilder::new().num_threads(options.jobs.unwrap_or(0)).build();
    let mut solved = threads.expect("threads can be started").install(|| perform(study, options, &watch))?;
    // Plots and reports of the result are evaluated even after a stop request.
    solved.problem = solved.problem.concluding();
    Ok(solved)
}

/// Doubt about a design for the given cases of a study with [robust].
const WORST_CASES_LEFT_OUT: &str = "This task leaves [robust] out: it rests on a design for the given cases. Run the study first (`mops run`), make \
     its design the initial guess, and set `at = \"start\"`, or remove [robust].";

/// Performs the task of the study.
fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    let started = Instant::now();
    let name = study.task().name();
    let Some(kind) = options.tasks.iter().find(|kind| kind.name == name) else {
        let why = format!("nothing performs the task `{name}`");
        let help = "add its kind to the tasks of the options";
        return Err(SolveError(StudyError::new("task", why).with_help(help).within("study")));
    };
    let mut solved = room(kind).perform(study, options, watch)?;
    if solved.problem.study().leaves_worst_cases_out() {
        solved.outcome.end = solved.outcome.end.map(|end| end.with_first_doubt(WORST_CASES_LEFT_OUT));
    }
    // The search may have finished before the interruption, but not the work that follows it.
    if watch.wants_stop() && watch.halt() == Halt::Interrupted {
        solved.outcome.stop = Stop::Interrupted;
    }
    solved.outcome.seconds = started.elapsed().as_secs_f64();
    Ok(solved)
}

/// Forwards to an observer, and requests a stop as soon as the cancellation is requested.
struct Cancellable<'a> {
    watch: &'a dyn Watch,
    cancellation: &'a Cancellation,
}

impl Watch for Cancellable<'_> {
    fn wants_stop(&self) -> bool {
        self.cancellation.requested().is_some() || self.watch.wants_stop()
    }

    fn halt(&self) -> Halt {
        self.cancellation.requested().unwrap_or_else(|| self.watch.halt())
    }

    fn evaluated(&self, state: &RunState) {
        self.watch.evaluated(state);
    }

    fn improved(&self, best: &Evaluation) {
        self.watch.improved(best);
    }

    fn stage(&self, what: &str, done: f64) {
        self.watch.stage(what, done);
    }

    fn keeping(&self, trouble: Option<&str>) {
        self.watch.keeping(trouble);
    }
}
