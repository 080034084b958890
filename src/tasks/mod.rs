//! Tasks of a study: one line for each, and one file for each that is more than a search.

mod batches;
mod copies;
pub(crate) mod diagnosis;
mod excitation;
mod global_sensitivity;
mod jumps;
mod monte_carlo;
mod pareto;
mod robust;
mod sensitivity;
mod sweep;
mod uncertainty;
mod worst_case;

use std::time::Instant;

use mops_core::{Halt, Stop, Study, Task, Watch, study::Place};

use crate::search::{Options, SolveError, Solved, evaluate_start, search};

/// Doubt about a design for the given cases of a study with [robust].
const WORST_CASES_LEFT_OUT: &str = "This task leaves [robust] out: it rests on a design for the given cases. Run the study first (`mops run`), make \
     its design the initial guess, and set `at = \"start\"`, or remove [robust].";

/// Performs the task of the study.
///
/// # Errors
/// If the solver does not accept the problem.
pub(crate) fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    let started = Instant::now();
    let mut solved = match study.task() {
        Task::Design => {
            let perform = if study.tasks().robust.is_some() { robust::perform } else { search };
            let mut solved = perform(study.clone(), options, watch)?;
            jumps::add(&mut solved, study, options, watch);
            solved
        }
        Task::Calibration => {
            let mut solved = search(study, options, watch)?;
            uncertainty::add(&mut solved, watch);
            solved
        }
        Task::Excitation => excitation::perform(study, options, watch),
        Task::Sensitivity => sensitivity::perform(study, options, watch)?,
        Task::Sweep => sweep::perform(study, options, watch)?,
        Task::Diagnosis => diagnosis::perform(study, options, watch)?,
        Task::Pareto => pareto::perform(study, options, watch)?,
        Task::WorstCase => worst_case::perform(study, options, watch)?,
        Task::MonteCarlo => monte_carlo::perform(study, options, watch)?,
    };
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

/// Returns the point at which a task is performed: the start values or the optimum.
fn at(place: Place, study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    match place {
        Place::Start => Ok(evaluate_start(study, options, watch)),
        Place::Optimum => search(study, options, watch),
    }
}
