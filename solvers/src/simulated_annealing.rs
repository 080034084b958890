//! Simulated annealing.

use mops_core::math;
use mops_core::{Halt, Oracle, Progress, Shape, Solver, SolverOptions, Stream};
use rand::Rng;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::penalty::penalised;
use crate::start::usable_start;

/// Simulated annealing: a walk that takes every better point, and a worse one the more seldom the cooler it is, with
/// probability `1/(1 + exp(rise/temperature))`. It sees one number per point, the penalised maximum. The temperature falls
/// from 1, in units of the objective at the start, to a millionth; steps are normally distributed, shrink with the root of
/// the temperature, and end on the face of the box they would cross. Ends after a number of iterations.
///
/// Source: S. Kirkpatrick, C. D. Gelatt, M. P. Vecchi, Science 220 (1983) 671-680; the probability by R. J. Glauber, Journal
/// of Mathematical Physics 4 (1963) 294-307.
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
        Box::new(Annealing { options: self.clone(), walk: None })
    }
}

/// The solver of the kind `simulated-annealing`.
struct Annealing {
    options: SimulatedAnnealingOptions,
    walk: Option<Walk>,
}

struct Walk {
    point: Vec<f64>,
    cost: f64,
    /// Unit of the temperature.
    unit: f64,
    iteration: u64,
    acceptance_stream: Stream,
    step_stream: Stream,
}

/// The last temperature.
const FINAL_TEMPERATURE: f64 = 1e-6;

impl Solver for Annealing {
    fn accepts(&self, _: &Shape) -> Result<(), String> {
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.walk = None;
        let Some(point) = usable_start(oracle, start)? else { return Ok(()) };
        let cost = penalised(&oracle.evaluate(std::slice::from_ref(&point))?[0]);
        let unit = if cost == 0.0 { 1.0 } else { cost.abs() };
        let [acceptance_stream, step_stream] =
            ["simulated-annealing", "simulated-annealing steps"].map(|label| oracle.stream(label));
        self.walk = Some(Walk { point, cost, unit, iteration: 0, acceptance_stream, step_stream });
        Ok(())
    }

    #[allow(clippy::cast_precision_loss)]
    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        // A walk has no test of an optimum.
        let Some(walk) = &mut self.walk else { return Ok(Progress::Stalled) };
        if walk.point.is_empty() {
            return Ok(Progress::Converged);
        }
        if walk.iteration >= self.options.max_iterations {
            return Ok(Progress::Stalled);
        }
        let temperature = math::powf(FINAL_TEMPERATURE, walk.iteration as f64 / self.options.max_iterations as f64);
        walk.iteration += 1;
        let next = walk.proposal(self.options.size * temperature.sqrt(), &oracle.shape().spacing);
        let cost = penalised(&oracle.evaluate(std::slice::from_ref(&next))?[0]);
        let acceptance = 1.0 / (1.0 + math::exp((cost - walk.cost) / (walk.unit * temperature)));
        if cost < walk.cost || walk.acceptance_stream.random::<f64>() < acceptance {
            (walk.point, walk.cost) = (next, cost);
        }
        Ok(Progress::Continue)
    }
}

impl Walk {
    /// The point after a step; on a grid it is not shorter than to the next value.
    fn proposal(&mut self, size: f64, spacing: &[f64]) -> Vec<f64> {
        let random = &mut self.step_stream;
        let along = |(u, spacing): (&f64, &f64)| (u + size.max(*spacing) * math::normal(random)).clamp(0.0, 1.0);
        self.point.iter().zip(spacing).map(along).collect()
    }
}
