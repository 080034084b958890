//! Weighing fitted models against each other: what correlated residuals are worth, and how likely chance is.

use rayon::prelude::*;

use crate::candidate::FARTHEST_SHAPE;
use crate::fit::{Fit, Fitted};
use crate::search::Trial;
use crate::variant::Added;
use mops_core::math;

/// How far apart criteria are where the data clearly prefer one model. Source: R. E. Kass, A. E. Raftery, Bayes Factors, JASA
/// 90 (1995), section 3.2: strong evidence.
pub const CLEARLY: f64 = 6.0;

/// What the residuals of the best model tell of the data: the error model that all candidates share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dispersion {
    /// Mean square of the residuals, at least 1.
    pub square: f64,
    /// Samples that are worth one: `(1 + r)/(1 - r)` with the correlation r of neighbours, at least 1.
    ///
    /// Source: G. Box, G. Jenkins, G. Reinsel, Time Series Analysis, 3rd edition (1994), section 2.1.5, for a first-order
    /// autoregression.
    pub repeats: f64,
}

impl Dispersion {
    /// White residuals of the size of the noise.
    pub const WHITE: Self = Self { square: 1.0, repeats: 1.0 };

    /// Of what a trial leaves.
    pub fn of(trial: &Trial<'_>) -> Self {
        Self::left(&trial.fit, &trial.fitted)
    }

    /// Of what a model leaves.
    #[allow(clippy::cast_precision_loss)]
    pub fn left(fit: &Fit<'_>, fitted: &Fitted) -> Self {
        let square = (fitted.chi2 / fitted.count.max(1) as f64).max(1.0);
        let (mut product, mut power, mut pairs) = (0.0, 0.0, 0.0);
        for (piece, residuals) in fit.pieces.iter().zip(&fitted.residuals) {
            let mut at = 0;
            for s in &piece.series {
                let r = &residuals[at..at + s.times.len()];
                at += s.times.len();
                product += r.windows(2).map(|w| w[0] * w[1]).sum::<f64>();
                power += r.iter().map(|r| r * r).sum::<f64>();
                pairs += r.len() as f64;
            }
        }
        let r = if power > 0.0 { product / power } else { 0.0 };
        // What noise alone would show does not count.
        let r = if r < 3.0 / pairs.max(1.0).sqrt() { 0.0 } else { r.min(0.99) };
        Self { square, repeats: (1.0 + r) / (1.0 - r) }
    }

    /// What an unknown costs that so many samples tell: the logarithm of as many as are independent.
    #[allow(clippy::cast_precision_loss)]
    pub fn worth(&self, samples: usize) -> f64 {
        math::ln((samples as f64 / self.repeats).max(2.0))
    }

    /// How many units of the sum of squares count as one.
    pub fn weight(&self) -> f64 {
        self.square * self.repeats
    }
}

/// Minus twice the logarithm of the evidence of a model, by the Bayesian information criterion; rarer effects pay a little
/// more, as physicists think of the common ones first.
///
/// Source: G. Schwarz, Estimating the dimension of a model, Annals of Statistics 6 (1978) 461.
#[allow(clippy::cast_precision_loss)]
pub fn criterion(trial: &Trial<'_>, dispersion: &Dispersion) -> f64 {
    let rarity: f64 = trial.added.iter().map(|a| f64::from(a.candidate.effect.rarity())).sum();
    // What each experiment has of its own is told by its samples alone.
    let own: f64 = trial.fitted.residuals.iter().map(|r| dispersion.worth(r.len())).sum();
    let unknowns = trial.unknowns() as f64 * dispersion.worth(trial.fitted.count) + trial.own_unknowns() as f64 * own;
    trial.fitted.chi2 / dispersion.weight() + unknowns + 2.0 * rarity
}

/// The criteria of models of which the first does best. What the newest effect of a rival brings in and the data hardly tell
/// costs accordingly less, down to where the rival is as good as the first: a break-away force is as likely as before where
/// nothing breaks away.
pub fn weighed(trials: &[Trial<'_>], dispersion: &Dispersion) -> Vec<f64> {
    /// Rivals behind by more than this are not looked at so closely.
    const FAR: f64 = 40.0;
    let Some(first) = trials.first().map(|first| criterion(first, dispersion)) else { return Vec::new() };
    let one = |trial: &Trial<'_>| {
        let whole = criterion(trial, dispersion);
        match (trial.added.last(), trial.variant.first.last()) {
            (Some(newest), Some(&own)) if whole > first && whole < first + FAR && is_plausible(newest) => {
                (whole - trial.fit.spared(&trial.fitted, own, dispersion)).max(first)
            }
            _ => whole,
        }
    };
    trials.par_iter().map(one).collect()
}

/// Whether shapes of an effect are within a decade of those that are tried first. What is far off tells nothing because the
/// effect has vanished there, and such shapes are few among all that are likely.
fn is_plausible(added: &Added) -> bool {
    let strengths = added.candidate.effect.parameters().iter().zip(&added.strengths).skip(1);
    strengths.filter(|(strength, _)| strength.bounds[0] >= 0.0).all(|(strength, &value)| {
        let tried = added.sizes.values(strength.dimension, strength.grid, strength.bounds);
        let low = tried.iter().copied().fold(f64::INFINITY, f64::min);
        let high = tried.iter().copied().fold(0.0, f64::max);
        // Where nothing but 0 was tried, nothing says how far off a value is. One at its limit has run away.
        high == 0.0 || (0.1 * low..0.99 * FARTHEST_SHAPE * high).contains(&value)
    })
}

/// Probabilities of models from their criteria, lower being better.
pub fn probabilities(criteria: &[f64]) -> Vec<f64> {
    let best = criteria.iter().copied().fold(f64::INFINITY, f64::min);
    let weights: Vec<f64> = criteria.iter().map(|c| math::exp(-0.5 * (c - best))).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|w| if sum > 0.0 { w / sum } else { 0.0 }).collect()
}

/// Probability that the best of a screening of so many directions gains as much by chance: `1 - (1 - exp(-gain/2))^n`.
///
/// The gain of one direction is chi-squared of one degree of freedom, of which half the mass is cut off by the sign of the
/// strength; `exp(-gain/2)` bounds its tail.
pub fn by_chance(gain: f64, directions: f64) -> f64 {
    if gain <= 0.0 {
        return 1.0;
    }
    -(math::exp_m1(directions * math::ln_1p(-math::exp(-0.5 * gain))))
}

/// The gain of which [`by_chance`] gives this probability.
pub fn needed_gain(level: f64, directions: f64) -> f64 {
    -2.0 * math::ln(-math::exp_m1(math::ln_1p(-level) / directions))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_that_do_as_well_share_the_probability_and_six_points_leave_a_twentieth() {
        let p = probabilities(&[10.0, 10.0, 16.0]);
        assert_eq!(p[0], p[1]);
        assert!((p[2] / p[0] - math::exp(-3.0)).abs() < 1e-12 && (p.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_best_of_many_directions_gains_by_chance() {
        assert!((by_chance(2.0 * math::ln(100.0), 1.0) - 0.01).abs() < 1e-12);
        assert!((by_chance(2.0 * math::ln(10_000.0), 100.0) - 0.01).abs() < 1e-4);
        assert_eq!(by_chance(0.0, 10.0), 1.0);
        for (level, directions) in [(0.01, 1.0), (1e-6, 500.0), (0.5, 40.0)] {
            assert!((by_chance(needed_gain(level, directions), directions) / level - 1.0).abs() < 1e-9);
        }
    }
}
