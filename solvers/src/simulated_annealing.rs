//! The simulated annealing of argmin.

use std::sync::Mutex;

use argmin::core::{CostFunction, Error, Executor};
use argmin::solver::simulatedannealing::{Anneal, SATempFunc, SimulatedAnnealing};
use mops_core::math;
use mops_core::{Halt, Oracle, Progress, Shape, Solver, SolverOptions, Stream};
use rand_distr::{Distribution, Normal};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::argmin_adapter::Cost;
use crate::start::usable_start;

/// Simulated annealing, by argmin: a walk that takes every better point, and a worse one the more seldom the cooler it is. It
/// sees one number per point, the penalised maximum. The temperature falls from 1, in units of the objective at the start,
/// to a millionth; steps are normally distributed, shrink with the root of the temperature, and end on the face of the box
/// they would cross. Ends after a number of iterations.
///
/// Source: S. Kirkpatrick, C. D. Gelatt, M. P. Vecchi, Science 220 (1983) 671-680.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct SimulatedAnnealingOptions {
    /// Standard deviation of the first steps along every coordinate, in the unit box.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub size: f64,
    /// Number of iterations, each of which evaluates a point.
    #[schemars(range(min = 1))]
    pub max_iterations: u64,
}

impl Default for SimulatedAnnealingOptions {
    fn default() -> Self {
        Self { size: 0.3, max_iterations: 3000 }
    }
}

impl SolverOptions for SimulatedAnnealingOptions {
    const KIND: &'static str = "simulated-annealing";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(Annealing { options: self.clone(), start: None })
    }
}

struct Annealing {
    options: SimulatedAnnealingOptions,
    start: Option<Vec<f64>>,
}

/// The last temperature.
const COLD: f64 = 1e-6;

impl Solver for Annealing {
    fn accepts(&self, _: &Shape) -> Result<(), String> {
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.start = usable_start(oracle, start)?;
        Ok(())
    }

    /// argmin runs to its end in one step.
    #[allow(clippy::cast_precision_loss)]
    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(start) = &self.start else { return Ok(Progress::Stalled) };
        if start.is_empty() {
            return Ok(Progress::Converged);
        }
        let cooling = math::powf(COLD, 1.0 / self.options.max_iterations.max(1) as f64);
        let spacing = oracle.shape().spacing.clone();
        let [accepting, moving] =
            ["simulated-annealing", "simulated-annealing steps"].map(|label| oracle.stream(label));
        let Ok(method) = SimulatedAnnealing::new_with_rng(1.0, accepting) else { return Ok(Progress::Stalled) };
        let method = method.with_temp_func(SATempFunc::Exponential(cooling));
        let cost = Cost::new(oracle, None);
        let walk = Walk { cost: &cost, size: self.options.size, spacing, random: Mutex::new(moving) };
        let iterations = self.options.max_iterations;
        let run = Executor::new(walk, method).configure(|state| state.param(start.clone()).max_iters(iterations)).run();
        match (cost.halt(), run) {
            (Some(halt), _) => Err(halt),
            // A walk has no test of an optimum.
            _ => Ok(Progress::Stalled),
        }
    }
}

/// A problem with its steps.
struct Walk<'a> {
    cost: &'a Cost<'a>,
    size: f64,
    spacing: Vec<f64>,
    random: Mutex<Stream>,
}

impl CostFunction for Walk<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, point: &Vec<f64>) -> Result<f64, Error> {
        self.cost.cost(point)
    }
}

impl Anneal for Walk<'_> {
    type Param = Vec<f64>;
    type Output = Vec<f64>;
    type Float = f64;

    /// On a grid a step is not shorter than to the next value.
    fn anneal(&self, point: &Vec<f64>, temperature: f64) -> Result<Vec<f64>, Error> {
        let mut random = self.random.lock().expect("nobody panics holding the lock");
        let size = self.size * temperature.sqrt();
        let moved = point.iter().zip(&self.spacing).map(|(u, spacing)| {
            let steps = Normal::new(0.0, size.max(*spacing)).expect("a deviation that is not negative");
            (u + steps.sample(&mut *random)).clamp(0.0, 1.0)
        });
        Ok(moved.collect())
    }
}
