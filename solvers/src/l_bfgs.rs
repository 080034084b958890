//! Limited-memory BFGS of argmin, on a smooth approximation of the largest criterion.

mod smooth_maximum;

use argmin::core::Executor;
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::LBFGS;
use mops_core::{Halt, Oracle, Progress, Shape, Solver, SolverOptions};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::start::usable_start;
use smooth_maximum::SmoothProblem;

/// Limited-memory BFGS (argmin), for many tuners and smooth criteria.
///
/// The largest criterion and the largest violation are not differentiable. They are replaced by the smooth
/// Kreisselmeier-Steinhauser function, which approximates them more closely in each stage. A stage starts from the
/// result of the previous one.
///
/// The change of variables `u = (1 - cos(pi v)) / 2` keeps the tuners in the box. Constraints enter through a penalty
/// of ten times the violation.
///
/// Source: D. C. Liu, J. Nocedal, Mathematical Programming 45 (1989) 503-528; J. J. More, D. J. Thuente, ACM
/// Transactions on Mathematical Software 20 (1994) 286-307 (line search); G. Kreisselmeier, R. Steinhauser, IFAC
/// Symposium on Computer Aided Design of Control Systems (1979) 113-117 (smooth maximum).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct LBfgsOptions {
    /// Number of stored steps for the Hessian approximation.
    #[schemars(range(min = 1, max = 1000))]
    pub memory: usize,
    /// Maximum number of iterations per stage.
    #[schemars(range(min = 1))]
    pub max_iterations: u64,
}

impl Default for LBfgsOptions {
    fn default() -> Self {
        Self { memory: 10, max_iterations: 100 }
    }
}

impl SolverOptions for LBfgsOptions {
    const KIND: &'static str = "l-bfgs";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(LBfgs { options: self.clone(), start: None, stage: 0 })
    }
}

struct LBfgs {
    options: LBfgsOptions,
    start: Option<Vec<f64>>,
    stage: usize,
}

/// Sharpness of the smooth maximum in each stage. The smooth maximum of `m` criteria exceeds the largest criterion by
/// at most `ln m / sharpness`, in units of the objective at the start.
const SHARPNESS: [f64; 5] = [10.0, 100.0, 1e3, 1e4, 1e5];

impl Solver for LBfgs {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        if shape.spacing.iter().any(|&spacing| spacing > 0.0) {
            return Err(
                "`l-bfgs` needs gradients, but a tuner has whole numbers or a list of values; use `pattern-search`"
                    .into(),
            );
        }
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.start = usable_start(oracle, start)?;
        self.stage = 0;
        Ok(())
    }

    /// Runs one stage: argmin runs to its end.
    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(start) = &self.start else { return Ok(Progress::Stalled) };
        if start.is_empty() {
            return Ok(Progress::Converged);
        }
        let Some(&sharpness) = SHARPNESS.get(self.stage) else { return Ok(Progress::Stalled) };
        self.stage += 1;
        let Some(problem) = SmoothProblem::new(oracle, start, sharpness)? else { return Ok(Progress::Stalled) };
        let method = LBFGS::new(MoreThuenteLineSearch::new(), self.options.memory.max(1));
        let variables = problem.variables_of(start);
        let iterations = self.options.max_iterations;
        let run = Executor::new(&problem, method).configure(|state| state.param(variables).max_iters(iterations)).run();
        if let Some(halt) = problem.halt() {
            return Err(halt);
        }
        // The line search returns an error where gradients give no further descent.
        let end = run.ok().and_then(|done| done.state.best_param);
        let moved = end.map(|v| smooth_maximum::point_of(&v));
        self.start = moved.or_else(|| self.start.take());
        Ok(Progress::Continue)
    }
}
