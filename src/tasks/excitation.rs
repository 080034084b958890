//! `task = "excitation"`: order of persistent excitation of the inputs, without a simulation.

use mops_core::{Study, Watch};
use mops_outcome::{
    ExcitationFindings,
    identification::{excitations, regressions},
};

use crate::search::{Options, Solved, evaluate_start};

pub(super) fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Solved {
    let inputs = excitations(&study, &study.tasks().excitation.question);
    let regressions = regressions(&study);
    // No criterion is evaluated, as nothing is simulated.
    let mut solved = evaluate_start(study.without_criteria(), options, watch);
    solved.outcome.calibration = None;
    solved.outcome.found.excitation = Some(ExcitationFindings { inputs, regressions });
    solved
}
