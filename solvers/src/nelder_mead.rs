//! Nelder-Mead simplex method of argmin.

use argmin::core::Executor;
use argmin::solver::neldermead::NelderMead;
use mops_core::{Halt, Oracle, Progress, Shape, Solver, SolverOptions};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::argmin_cost::Cost;
use crate::start::usable_start;

/// Nelder-Mead simplex method (argmin), restarted at its result until a restart brings no improvement.
///
/// Minimises one number per point, the penalised objective, and may stall at a kink (non-differentiable point). For
/// comparison, and for rough criteria with two or three tuners.
///
/// Source: J. A. Nelder, R. Mead, Computer Journal 7 (1965) 308-313.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct NelderMeadOptions {
    /// Edge length of the first simplex, in the unit box.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub size: f64,
    /// Standard deviation of the values at the vertices below which a simplex ends.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub tolerance: f64,
    /// Maximum number of iterations per simplex.
    #[schemars(range(min = 1))]
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
        Box::new(Simplex {
            options: self.clone(),
            start: None,
            size: self.size,
            last_value: f64::INFINITY,
            objective_scale: None,
        })
    }
}

struct Simplex {
    options: NelderMeadOptions,
    start: Option<Vec<f64>>,
    /// Edge length of the next simplex; it decreases each time.
    size: f64,
    /// Value at the end of the last simplex.
    last_value: f64,
    /// Scale factor of the objective.
    objective_scale: Option<f64>,
}

impl Solver for Simplex {
    fn accepts(&self, _: &Shape) -> Result<(), String> {
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.start = usable_start(oracle, start)?;
        self.size = self.options.size;
        self.last_value = f64::INFINITY;
        self.objective_scale = None;
        Ok(())
    }

    /// Runs one simplex: argmin runs to its end.
    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(start) = &self.start else { return Ok(Progress::Stalled) };
        if start.is_empty() {
            return Ok(Progress::Converged);
        }
        let mut corners = vec![start.clone()];
        for (j, u) in start.iter().enumerate() {
            // On a grid, a shorter edge would not reach the next value.
            let edge = self.size.max(oracle.shape().spacing[j]);
            let mut corner = start.clone();
            corner[j] = if u + edge <= 1.0 { u + edge } else { u - edge };
            corners.push(corner);
        }
        let Ok(method) = NelderMead::new(corners).with_sd_tolerance(self.options.tolerance) else {
            return Ok(Progress::Stalled);
        };
        let cost = Cost::new(oracle, self.objective_scale);
        let run = Executor::new(&cost, method).configure(|state| state.max_iters(self.options.max_iterations)).run();
        if let Some(halt) = cost.halt() {
            return Err(halt);
        }
        self.objective_scale = cost.objective_scale();
        let Ok(done) = run else { return Ok(Progress::Stalled) };
        let value = done.state.best_cost;
        let improvement = self.last_value - value;
        if improvement <= self.options.tolerance.max(1e-6 * value.abs()) {
            return Ok(Progress::Converged);
        }
        self.last_value = value;
        self.size *= 0.3;
        if let Some(end) = done.state.best_param {
            self.start = Some(end.iter().map(|u| u.clamp(0.0, 1.0)).collect());
        }
        Ok(Progress::Continue)
    }
}
