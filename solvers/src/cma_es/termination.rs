//! When a run of CMA-ES ends and the next begins.

use std::collections::VecDeque;

use super::distribution::Distribution;
use mops_core::math;

/// Objective values of the generations of a run.
#[derive(Debug, Clone)]
pub struct History {
    /// Best and median of every generation.
    best: Vec<f64>,
    median: Vec<f64>,
    /// Best of the last generations.
    recent: VecDeque<f64>,
    initial_sigma: f64,
    tolerance: f64,
}

/// A run ends when its values differ by less than this share of what it lies behind the best known point.
const WORSE_BASIN: f64 = 1e-2;

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// Values or points no longer differ.
    Converged,
    /// Nothing improves, or the distribution is degenerate.
    Stagnated,
}

impl History {
    /// Of a run that has not begun; `tolerance` is relative to the objective.
    pub fn new(initial_sigma: f64, tolerance: f64) -> Self {
        Self { best: Vec::new(), median: Vec::new(), recent: VecDeque::new(), initial_sigma, tolerance }
    }

    /// Takes a generation's values, the best first, and says whether the run is over. `unit` is the order of magnitude of
    /// the objective below which differences count absolutely, `behind` how far the generation lies above the best point of
    /// the runs before.
    ///
    /// N.B.: a run whose values no longer differ by a hundredth of what it lies behind has found a worse basin, and ends;
    /// the paper lets it converge.
    ///
    /// Source: N. Hansen, Benchmarking a BI-population CMA-ES on the BBOB-2009 function testbed, GECCO (2009) 2389-2396.
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    pub fn record(&mut self, values: &[f64], unit: f64, deficit: f64, distribution: &Distribution) -> Option<End> {
        let (n, population) = (distribution.mean.len() as f64, values.len() as f64);
        let (best, median) = (values[0], values[values.len() / 2]);
        self.best.push(best);
        self.median.push(median);
        self.recent.push_back(best);
        let window = (10.0 + 30.0 * n / population).ceil() as usize;
        if self.recent.len() > window {
            self.recent.pop_front();
        }
        let range = |values: &mut dyn Iterator<Item = f64>| {
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
            high - low
        };
        let threshold = self.tolerance * best.abs().max(unit);
        if self.recent.len() == window {
            let spread = range(&mut self.recent.iter().copied());
            let spread = spread.max(range(&mut values.iter().copied()));
            if spread <= threshold || self.is_constant(window) {
                return Some(End::Converged);
            }
            if spread <= WORSE_BASIN * deficit {
                return Some(End::Stagnated);
            }
        }
        if distribution.largest_extent() < 1e-11 * self.initial_sigma {
            return Some(End::Converged);
        }
        let longest = 100.0 + 50.0 * math::powi(n + 3.0, 2) / population.sqrt();
        let degenerate = distribution.condition() > 1e14
            || distribution.largest_extent() > 1e4 * self.initial_sigma
            || distribution.is_below_rounding();
        let is_finished = degenerate || self.is_stagnating(n, population) || distribution.generation as f64 > longest;
        is_finished.then_some(End::Stagnated)
    }

    /// Whether the best values of the last generations are all the same.
    fn is_constant(&self, window: usize) -> bool {
        self.recent.len() == window && self.recent.iter().all(|value| *value == self.recent[0])
    }

    /// Whether the medians of the newest third of a long window are no better than those of the oldest.
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    fn is_stagnating(&self, n: f64, population: f64) -> bool {
        let generations = self.best.len();
        let window = ((120.0 + 30.0 * n / population) as usize).max(generations / 5).min(20_000);
        if generations < window + 1 {
            return false;
        }
        let median_of = |values: &[f64]| {
            let mut sorted = values.to_vec();
            sorted.sort_by(f64::total_cmp);
            sorted[sorted.len() / 2]
        };
        let part_length = (window * 3 / 10).max(1);
        let has_no_improvement = |values: &[f64]| {
            let window = &values[generations - window..];
            median_of(&window[window.len() - part_length..]) >= median_of(&window[..part_length])
        };
        has_no_improvement(&self.best) && has_no_improvement(&self.median)
    }
}
