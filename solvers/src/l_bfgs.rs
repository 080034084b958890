//! The limited-memory BFGS method of argmin, on a smooth stand-in for the largest of the rows.

mod smooth_maximum;

use argmin::core::Executor;
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::LBFGS;
use mops_core::{Halt, Oracle, Progress, Shape, Solver, SolverOptions};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::start::usable_start;
use smooth_maximum::SmoothProblem;

/// Limited-memory BFGS, by argmin, for many tuners and smooth criteria. It follows slopes of one number per point: in place
/// of the largest row and the largest violation, which have kinks, the smooth function of Kreisselmeier and Steinhauser,
/// which comes closer to them from round to round; each round begins at the end of the one before. The box is met by a
/// change of variables, `u = (1 - cos(pi v)) / 2`. Constraints enter by a penalty of ten times the violation.
///
/// Source: D. C. Liu, J. Nocedal, Mathematical Programming 45 (1989) 503-528; J. J. More, D. J. Thuente, ACM Transactions on
/// Mathematical Software 20 (1994) 286-307 (line search); G. Kreisselmeier, R. Steinhauser, IFAC Symposium on Computer Aided
/// Design of Control Systems (1979) 113-117 (smooth maximum).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct LBfgsOptions {
    /// Steps that the curvature is remembered of.
    #[schemars(range(min = 1, max = 1000))]
    pub memory: usize,
    /// Largest number of iterations of a round.
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

/// Sharpness of the smooth function, round by round: it exceeds the largest of `m` rows by at most `ln m / sharpness`, in
/// units of the objective at the start.
const SHARPNESS: [f64; 5] = [10.0, 100.0, 1e3, 1e4, 1e5];

impl Solver for LBfgs {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        if shape.spacing.iter().any(|&spacing| spacing > 0.0) {
            return Err(
                "`l-bfgs` follows slopes and cannot treat tuners with whole numbers or lists; take `pattern-search`"
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

    /// A round is one step: argmin runs to its end.
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
        // The line search gives up with an error where the slopes lead no further.
        let end = run.ok().and_then(|done| done.state.best_param);
        let moved = end.map(|v| smooth_maximum::point_of(&v));
        self.start = moved.or_else(|| self.start.take());
        Ok(Progress::Continue)
    }
}
