//! The Nelder-Mead simplex method of argmin.

use argmin::core::Executor;
use argmin::solver::neldermead::NelderMead;
use mops_core::{Halt, Oracle, Progress, Shape, Solver, SolverOptions};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::argmin_adapter::Cost;
use crate::start::usable_start;

/// The simplex method of Nelder and Mead, by argmin. It sees one number per point, the penalised maximum, so that it may
/// stop at a kink; for comparison, and for rough criteria of two or three tuners.
///
/// Source: J. A. Nelder, R. Mead, Computer Journal 7 (1965) 308-313.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct NelderMeadOptions {
    /// Length of the first simplex's edges, in the unit box.
    pub size: f64,
    /// Ends when the standard deviation of the values at the corners is below this.
    pub tolerance: f64,
    /// Largest number of iterations.
    pub max_iterations: u64,
}

impl Default for NelderMeadOptions {
    fn default() -> Self {
        Self { size: 0.1, tolerance: 1e-9, max_iterations: 1000 }
    }
}

impl SolverOptions for NelderMeadOptions {
    const KIND: &'static str = "nelder-mead";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(Simplex { options: self.clone(), start: None })
    }
}

struct Simplex {
    options: NelderMeadOptions,
    start: Option<Vec<f64>>,
}

impl Solver for Simplex {
    fn accepts(&self, _: &Shape) -> Result<(), String> {
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.start = usable_start(oracle, start)?;
        Ok(())
    }

    /// argmin runs to its end in one step.
    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(start) = self.start.take() else { return Ok(Progress::Stalled) };
        if start.is_empty() {
            return Ok(Progress::Converged);
        }
        let mut corners = vec![start.clone()];
        for (j, u) in start.iter().enumerate() {
            let mut corner = start.clone();
            corner[j] = if u + self.options.size <= 1.0 { u + self.options.size } else { u - self.options.size };
            corners.push(corner);
        }
        let Ok(method) = NelderMead::new(corners).with_sd_tolerance(self.options.tolerance) else {
            return Ok(Progress::Stalled);
        };
        let cost = Cost::new(oracle);
        let run = Executor::new(&cost, method).configure(|state| state.max_iters(self.options.max_iterations)).run();
        match (cost.halt(), run) {
            (Some(halt), _) => Err(halt),
            (None, Ok(done)) if done.state.iter < self.options.max_iterations => Ok(Progress::Converged),
            _ => Ok(Progress::Stalled),
        }
    }
}
