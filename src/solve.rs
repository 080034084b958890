//! Entry point that performs the task of a study.

use mops_core::{Cancellation, Evaluation, Halt, Study, Watch, run::State as RunState};

use crate::search::{Options, SolveError, Solved};
use crate::tasks;

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
    let mut solved = threads.expect("threads can be started").install(|| tasks::perform(study, options, &watch))?;
    // Plots and reports of the result are evaluated even after a stop request.
    solved.problem = solved.problem.concluding();
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
