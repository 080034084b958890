//! What a search starts from: the declared model, and the candidates that the records can tell.

use std::sync::Arc;

use mops_core::Effect;

use super::baseline::baseline;
use super::coverage::is_covered;
use super::fitted_set::FittedSet;
use super::refit::Refit;
use crate::estimation::nominal_rates;
use crate::meter::Meter;
use crate::subject::Subject;
use crate::trajectory::Trajectory;

/// Fits the declared model by least squares, and returns it with what fits sets of effects to the same records; `None` if it
/// cannot be simulated.
pub fn prepare<'a>(
    subject: &'a Subject,
    effects: &[Arc<dyn Effect>],
    simulations: &'a Meter<'a>,
) -> Option<(Refit<'a>, FittedSet<'a>)> {
    simulations.stage("fit of the declared model", 0.02);
    let start = baseline(subject, simulations)?;
    subject.take_pace(&start.tuners);
    let mut refit = Refit { subject, candidates: subject.candidates(effects), nominal: Vec::new(), simulations };
    let declared = refit.least_squares(&Vec::new(), &[start])?;
    let along =
        |piece| Trajectory::new(&declared.fit, &declared.variant.model, piece, &declared.least_squares.point).ok();
    let trajectories: Vec<Trajectory> = (0..declared.fit.pieces.len()).map(along).collect::<Option<_>>()?;
    refit.nominal = nominal_rates(&declared.variant, &trajectories);
    refit
        .candidates
        .retain(|candidate| is_covered(candidate, &declared.variant.model, &declared.fit.pieces, &trajectories));
    Some((refit, declared))
}
