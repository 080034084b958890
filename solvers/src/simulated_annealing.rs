//! Simulated annealing.

use mops_core::{Halt, Oracle, Progress, Shape, Solver, SolverOptions};
use mops_math as math;
use mops_math::Stream;
use rand::Rng;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::penalty::penalised;
use crate::start::usable_start;

/// Simulated annealing: a random walk that accepts every better point, and a worse one with probability `1/(1 +
/// exp(rise/temperature))`. It minimises one number per point, the penalised objective.
///
/// The temperature falls from 1, in units of the objective at the start, to a millionth. Steps are normally distributed
/// and shrink with the square root of the temperature. A step beyond the box ends on its face. The walk ends after a
/// number of iterations.
///
/// Source: S. Kirkpatrick, C. D. Gelatt, M. P. Vecchi, Science 220 (1983) 671-680; acceptance probability: R. J.
/// Glauber, Journal of Mathematical Physics 4 (1963) 294-307.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct SimulatedAnnealingOptions {
    /// Initial standard deviation of the steps along every coordinate, in the unit box.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub size: f64,
    /// Number of iterations, each of which evaluates one point.
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

/// Solver of the kind `simulated-annealing`.
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

/// Final temperature.
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
        // A random walk has no optimality test.
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
    /// Returns the proposed point; on a grid, the standard deviation is at least the spacing.
    fn proposal(&mut self, size: f64, spacing: &[f64]) -> Vec<f64> {
        let random = &mut self.step_stream;
        let along = |(u, spacing): (&f64, &f64)| (u + size.max(*spacing) * math::normal(random)).clamp(0.0, 1.0);
        self.point.iter().zip(spacing).map(along).collect()
    }
}
