//! Brute force, to compare with: the declared model refitted with every effect of the catalogue in turn.

use std::sync::Arc;

use mops_core::math;
use mops_core::{Effect, Role, Study, StudyError};
use rayon::prelude::*;

use crate::base;
use crate::fit::Point;
use crate::meter::Meter;
use crate::screen::{Scene, screen};
use crate::subject::Subject;
use crate::variant::{Added, problem};

/// Iterations of each refit.
const ITERATIONS: usize = 40;

/// What brute force gives.
#[derive(Debug, Clone, PartialEq)]
pub struct BruteForce {
    /// The effect with the least BIC and its place, as `kind:name`; none where the declared model has it.
    pub best: Option<(String, String)>,
    /// BIC of that, less the declared model's.
    pub bic: f64,
    /// Refits.
    pub refits: usize,
    /// Simulations.
    pub simulations: usize,
}

/// Refits the declared model to the calibration data with every effect in turn, from the strengths that explain most of the
/// residual to first order, and believes the least BIC: no other data, no correlation of residuals, no second effect.
///
/// Source: G. Schwarz, Estimating the dimension of a model, Annals of Statistics 6 (1978).
///
/// # Errors
/// The study is no diagnosis, or its model cannot be simulated.
#[allow(clippy::cast_precision_loss)]
pub fn brute_force(study: &Study, effects: &[Arc<dyn Effect>]) -> Result<BruteForce, StudyError> {
    let subject = Subject::new(study)?;
    let simulations = Meter::new(&());
    let failed = || StudyError::here("the model cannot be simulated near its start values");
    let declared = base::fit(&subject, study.seed(), &simulations).ok_or_else(failed)?;
    subject.take_pace(&declared.point.globals);
    let point = &declared.point;
    let of = |added: &[Added]| {
        let pieces = base::pieces(&subject, |role| role == Role::Calibration);
        problem(&subject, added, pieces, &point.globals, point.locals.clone(), &[], &simulations)
    };
    let (fit, _, variant) = of(&[]);
    let scene = Scene::new(&fit, &variant.model, &declared).ok_or_else(failed)?;

    let screened = screen(&subject.candidates(effects), &fit, &variant.model, &scene, &[]).screened;
    let refitted: Vec<Option<f64>> = screened
        .par_iter()
        .map(|candidate| {
            let (fit, start, _) = of(std::slice::from_ref(&candidate.added));
            let fitted = fit.solve(start, ITERATIONS)?;
            let unknowns = |point: &Point| point.globals.len() + point.locals.iter().map(Vec::len).sum::<usize>();
            let more = unknowns(&fitted.point) - unknowns(&declared.point);
            Some(fitted.chi2 - declared.chi2 + more as f64 * math::ln(fitted.count as f64))
        })
        .collect();
    let mut best = BruteForce { best: None, bic: 0.0, refits: refitted.iter().flatten().count(), simulations: 0 };
    for (candidate, bic) in screened.iter().zip(refitted) {
        let Some(bic) = bic.filter(|&bic| bic < best.bic) else { continue };
        let candidate = &candidate.added.candidate;
        best = BruteForce { best: Some((candidate.effect.name().to_owned(), candidate.place())), bic, ..best };
    }
    best.simulations = simulations.count();
    Ok(best)
}
