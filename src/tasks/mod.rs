//! What a study can be for: a line for every task, and a file for each that is more than a search.

pub(crate) mod diagnosis;
mod excitation;
mod pareto;
mod sensitivity;
mod sweep;

use mops_core::{Place, Study, Task, Watch};

use crate::solve::{Options, Solved, Unsuitable, look, search};

/// Does the task of the study.
///
/// # Errors
/// The solver cannot treat the problem.
pub(crate) fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, Unsuitable> {
    match study.task {
        Task::Design | Task::Calibration => search(study, options, watch),
        Task::Excitation => Ok(excitation::perform(study, options, watch)),
        Task::Sensitivity => sensitivity::perform(study, options, watch),
        Task::Sweep => sweep::perform(study, options, watch),
        Task::Pareto => pareto::perform(study, options, watch),
        Task::Diagnosis => diagnosis::perform(study, options, watch),
    }
}

/// The point that a task asks for.
fn at(place: Place, study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, Unsuitable> {
    match place {
        Place::Start => Ok(look(study, options, watch)),
        Place::Optimum => search(study, options, watch),
    }
}
