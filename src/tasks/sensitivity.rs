//! `task = "sensitivity"`: local sensitivity (tuners and combinations of tuners that the data or the criteria determine), or
//! global sensitivity to the uncertain parameters.

use mops_core::{
    Study, Watch,
    study::{Place, SensitivityMethod},
};
use mops_outcome::identification::{Point, sensitivity_at};

use super::{at, global_sensitivity};
use crate::search::{Options, SolveError, Solved};

pub(super) fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    let task = study.tasks().sensitivity;
    let mut solved = at(task.at, study, options, watch)?;
    if task.method != SensitivityMethod::Local {
        global_sensitivity::add(&mut solved, options, watch);
        return Ok(solved);
    }
    // A calibration has already computed the sensitivities.
    let known = solved.outcome.calibration.as_mut().and_then(|calibration| calibration.sensitivity.take());
    let point = if task.at == Place::Optimum { Point::Minimum } else { Point::Elsewhere };
    let found = known.or_else(|| sensitivity_at(&solved.problem, &solved.best.tuners, point, task.zero));
    if found.is_none() && watch.wants_stop() {
        solved.outcome.stop = watch.halt().into();
    } else if found.is_none() {
        let why = "the sensitivities could not be computed: a simulation failed, or no criterion depends on a tuner";
        solved.outcome.warnings.push(why.to_owned());
    }
    solved.outcome.found.sensitivity = found;
    Ok(solved)
}
