//! Brute force, to compare with: the declared model refitted with every effect of the catalogue in turn.

use std::sync::Arc;

use mops_core::{Effect, Study, StudyError};
use mops_math as math;
use rayon::prelude::*;

use crate::estimation::Errors;
use crate::fit::Meter;
use crate::records::Subject;
use crate::selection::{FittedSet, Screening, prepare};
use crate::settings::Settings;

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

/// Refits the declared model to the calibration data with every effect in turn, from the strengths that explain most of
/// the residual to first order, and believes the least BIC: no other data, no correlation of residuals, no second
/// effect.
///
/// Source: G. Schwarz, Estimating the dimension of a model, Annals of Statistics 6 (1978).
///
/// # Errors
/// The study is no diagnosis, or its model cannot be simulated.
#[allow(clippy::cast_precision_loss)]
pub fn brute_force(study: &Study, effects: &[Arc<dyn Effect>]) -> Result<BruteForce, StudyError> {
    let subject = Subject::new(study, &Settings::default())?;
    let simulations = Meter::new(&());
    let failed = || StudyError::here("the model cannot be simulated near its start values");
    let (refit, declared) = prepare(&subject, effects, &simulations)?;
    let white = [Errors::White];
    let screening = Screening::new(&declared, &white).ok_or_else(failed)?;
    let all: Vec<usize> = (0..refit.candidates.len()).collect();
    let screened = screening.screen(&refit.candidates, &all);
    let unknowns = |set: &FittedSet<'_>| set.estimation(&[]).free().len();
    let count: usize = declared.fit.pieces.iter().flat_map(|p| &p.series).map(|s| s.times.len()).sum();
    let refitted: Vec<Option<f64>> = screened
        .par_iter()
        .map(|candidate| {
            let start = declared.start_at(&declared.least_squares.point).with(&candidate.guesses[0]);
            let set = refit.least_squares(&vec![candidate.index], &[start])?;
            let more = unknowns(&set) as f64 - unknowns(&declared) as f64;
            let gain = set.least_squares.log_likelihood - declared.least_squares.log_likelihood;
            Some(more * math::ln(count as f64) - 2.0 * gain)
        })
        .collect();
    let mut best = BruteForce { best: None, bic: 0.0, refits: refitted.iter().flatten().count(), simulations: 0 };
    for (candidate, bic) in screened.iter().zip(refitted) {
        let Some(bic) = bic.filter(|&bic| bic < best.bic) else { continue };
        let candidate = &refit.candidates[candidate.index];
        best = BruteForce { best: Some((candidate.effect.name().to_owned(), candidate.place())), bic, ..best };
    }
    best.simulations = simulations.count();
    Ok(best)
}
