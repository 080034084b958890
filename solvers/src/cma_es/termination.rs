//! Termination of a run of CMA-ES.

use std::collections::VecDeque;

use mops_math as math;

use super::distribution::Distribution;

/// Objective values of the generations of a run.
#[derive(Debug, Clone)]
pub struct History {
    /// Best and median value of every generation.
    best: Vec<f64>,
    median: Vec<f64>,
    /// Best values of the last generations.
    recent: VecDeque<f64>,
    initial_sigma: f64,
    tolerance: f64,
}

/// Spread of the values, relative to the deficit to the best known point, below which a run ends.
const WORSE_BASIN: f64 = 1e-2;

/// Reason for the end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// Values or points no longer differ.
    Converged,
    /// No improvement, or a degenerate distribution.
    Stagnated,
}

impl History {
    /// Creates the empty history of a run; `tolerance` is relative to the objective.
    pub fn new(initial_sigma: f64, tolerance: f64) -> Self {
        Self { best: Vec::new(), median: Vec::new(), recent: VecDeque::new(), initial_sigma, tolerance }
    }

    /// Records the values of a generation, best first, and returns the reason if the run has ended.
    ///
    /// `unit` is the order of magnitude of the objective; below it, differences count absolutely. `deficit` is the
    /// distance of the generation's best value to the best known value.
    ///
    /// N.B.: a run whose values differ by less than a hundredth of the deficit has found a worse basin and ends. The
    /// paper lets such a run converge.
    ///
    /// Source: N. Hansen, Benchmarking a BI-population CMA-ES on the BBOB-2009 function testbed, GECCO (2009)
    /// 2389-2396.
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

    /// Returns true if the best values of the last generations are identical.
    fn is_constant(&self, window: usize) -> bool {
        self.recent.len() == window && self.recent.iter().all(|value| *value == self.recent[0])
    }

    /// Returns true if, over a long window, the medians of the newest 30 % are no better than those of the oldest 30 %.
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
