//! BIPOP restarts: runs with ever larger populations alternate with runs with small populations and random step sizes.

use mops_math as math;
use mops_math::Stream;
use rand::Rng;

/// Settings of a run.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Population size.
    pub population: usize,
    /// Initial standard deviation.
    pub sigma: f64,
    /// Number of evaluations after which the run is stopped.
    pub evaluations: usize,
    is_large: bool,
}

/// Evaluation counts of both restart regimes.
///
/// Source: N. Hansen, Benchmarking a BI-population CMA-ES on the BBOB-2009 function testbed, GECCO (2009) 2389-2396.
#[derive(Debug, Clone)]
pub struct Bipop {
    population: usize,
    sigma: f64,
    /// Number of runs with a doubled population.
    doublings: usize,
    evaluations_large: usize,
    evaluations_small: usize,
    /// Number of evaluations of the last run with a large population.
    last_large_evaluations: usize,
}

impl Bipop {
    /// Creates the schedule from the default population size and initial standard deviation.
    pub fn new(population: usize, sigma: f64) -> Self {
        Self { population, sigma, doublings: 0, evaluations_large: 0, evaluations_small: 0, last_large_evaluations: 0 }
    }

    /// Returns the settings of the first run.
    pub fn first_run(&self) -> Plan {
        Plan { population: self.population, sigma: self.sigma, evaluations: usize::MAX, is_large: true }
    }

    /// Returns the settings of a run with the default population and a small initial step, near a good point.
    pub fn small_run(&self, sigma: f64) -> Plan {
        Plan { sigma, ..self.first_run() }
    }

    /// Adds the evaluations used by the last run and returns the settings of the next; `None` after `restarts`
    /// doublings.
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    pub fn next(&mut self, last: &Plan, used: usize, restarts: usize, random: &mut Stream) -> Option<Plan> {
        // The first run counts towards neither regime.
        match (last.is_large, self.doublings) {
            (true, 0) => self.last_large_evaluations = used,
            (true, _) => (self.evaluations_large, self.last_large_evaluations) = (self.evaluations_large + used, used),
            (false, _) => self.evaluations_small += used,
        }
        if self.doublings > 0 && self.evaluations_small < self.evaluations_large {
            let u: f64 = random.random();
            let ratio = 0.5 * (1usize << self.doublings) as f64;
            let population = (self.population as f64 * math::powf(ratio, u * u)) as usize;
            let sigma = self.sigma * math::powf(10.0, -2.0 * random.random::<f64>());
            return Some(Plan { population, sigma, evaluations: self.last_large_evaluations / 2, is_large: false });
        }
        if self.doublings >= restarts {
            return None;
        }
        self.doublings += 1;
        let population = self.population << self.doublings;
        Some(Plan { population, sigma: self.sigma, evaluations: usize::MAX, is_large: true })
    }
}
