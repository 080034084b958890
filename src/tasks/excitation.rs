//! `task = "excitation"`: how rich the inputs are, without a simulation.

use mops_core::identification::{excitations, regressions};
use mops_core::{ExcitationFindings, Study, Watch};

use crate::search::{Options, Solved, look};

pub(super) fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Solved {
    let inputs = excitations(&study, &study.tasks().excitation.question);
    let regressions = regressions(&study);
    // Criteria have no say in this: nothing is simulated.
    let mut solved = look(study.without_criteria(), options, watch);
    solved.outcome.calibration = None;
    solved.outcome.found.excitation = Some(ExcitationFindings { inputs, regressions });
    solved
}
