//! Search of a design, and whether it is one against worst cases.

use mops_core::task::DesignTask;
use mops_core::{Study, Watch};

use crate::search::{Extras, Options, SolveError, Solved, search_for};

/// Returns true if a design is made against worst cases.
pub(super) fn is_robust(study: &Study) -> bool {
    study.options::<DesignTask>().is_some_and(|task| task.robust.is_some())
}

/// Searches the best design, with the sensitivities of its criteria.
pub(super) fn search_design(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    search_for(Extras { slopes: true, ..Extras::default() }, study, options, watch)
}
