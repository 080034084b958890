//! Declared terms that the effects found replace, and their places: a term acts where an effect of the catalogue
//! changes the outputs as it does.

use mops_outcome::diagnosis::Removed;

use crate::candidates::Candidate;
use crate::fit::dot;
use crate::motion::{Trajectory, View, sizes};
use crate::selection::{FittedSet, FittedSets};

/// Cosine of the responses from which a declared term acts at the place of an effect. Basis: scaled to each other they
/// differ by `sqrt(1 - 0.999^2)`, 4.5 %, the size of what a response neglects.
const SAME_PLACE: f64 = 0.999;

/// Returns the declared terms, by their positions among the parameters of the study, with their places.
pub fn removed(sets: &FittedSets<'_, '_>, declared: &FittedSet<'_>, terms: &[usize]) -> Vec<Removed> {
    let subject = sets.refit.subject;
    let name = |k: usize| subject.study.tuners()[subject.globals[k]].parameter.clone();
    terms.iter().map(|&k| Removed { term: name(k), place: place(sets, declared, k).unwrap_or_default() }).collect()
}

/// Returns the place at which an effect has the response of a parameter of the declared model.
fn place(sets: &FittedSets<'_, '_>, declared: &FittedSet<'_>, term: usize) -> Option<String> {
    let (fit, model, point) = (&declared.fit, declared.variant.model.as_ref(), &declared.least_squares.point);
    let own: Vec<f64> = fit.slopes(point)?.iter().flat_map(|piece| piece.j[term].iter().copied()).collect();
    let along = |piece| Trajectory::new(fit, model, piece, point).ok();
    let trajectories: Vec<Trajectory> = (0..fit.pieces.len()).map(along).collect::<Option<_>>()?;
    let cosine = |candidate: &Candidate| {
        let sizes = sizes(&candidate.port, model, &fit.pieces, &trajectories, fit.subject.settings.coverage)?;
        let strengths = sizes.combinations(candidate.effect.as_ref()).into_iter().next()?;
        let mut trace = Vec::with_capacity(own.len());
        for (piece, along) in fit.pieces.iter().zip(&trajectories) {
            trace.extend(View::new(candidate, model, piece, along)?.trace(&strengths)?);
        }
        let size = dot(&own, &own) * dot(&trace, &trace);
        Some((dot(&own, &trace).abs() / size.sqrt(), candidate.place())).filter(|(cosine, _)| cosine.is_finite())
    };
    // One parameter, in proportion to which it acts: what a declared term is.
    let is_plain = |c: &&Candidate| c.effect.parameters().len() == 1 && c.only.is_none();
    let all = sets.refit.candidates.iter().filter(is_plain).filter_map(cosine);
    let best = all.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 > SAME_PLACE).then_some(best.1)
}
