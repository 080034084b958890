//! The seam between problem and solver: what a solver is told, and what it may ask.

use serde::Serialize;

use crate::cancellation::Halt;
use crate::criterion::Usage;
use crate::evaluation::{Evaluation, Merit, Objective};
use crate::random::Stream;

/// What a solver knows of the problem: sizes and kinds, no names.
///
/// The problem lives in the unit box: every point is in `[0, 1]^n`. Rows are criteria in cases; a row's scaled value
/// `s` enters the objective as `weight s` (minimise), must satisfy `s - 1 <= 0` (inequality) or `s - 1 = 0` (equality).
#[derive(Debug, Clone, Default)]
pub struct Shape {
    /// Distance between neighbouring values of every tuner; 0 where it is continuous. Its length is the dimension.
    pub spacing: Vec<f64>,
    /// Usage and weight of every row.
    pub rows: Vec<(Usage, f64)>,
    /// How the rows to be minimised become one number.
    pub objective: Objective,
    /// Number of points that a front is to have, about; 0 where nothing is said.
    pub points: usize,
    /// Length of the residual vector whose sum of squares is the objective; 0 if it is no sum of squares.
    pub residuals: usize,
}

impl Shape {
    /// Number of tuners.
    pub fn dimension(&self) -> usize {
        self.spacing.len()
    }

    /// Weighted scaled values of the rows to be minimised.
    pub fn objectives(&self, scaled: &[f64]) -> Vec<f64> {
        self.pick(Usage::Minimise, scaled, |s, weight| weight * s)
    }

    /// Inequality constraints, satisfied where at most 0.
    pub fn inequalities(&self, scaled: &[f64]) -> Vec<f64> {
        self.pick(Usage::Inequality, scaled, |s, _| s - 1.0)
    }

    /// Equality constraints, satisfied where 0.
    pub fn equalities(&self, scaled: &[f64]) -> Vec<f64> {
        self.pick(Usage::Equality, scaled, |s, _| s - 1.0)
    }

    fn pick(&self, usage: Usage, scaled: &[f64], f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        self.rows.iter().zip(scaled).filter(|((u, _), _)| *u == usage).map(|((_, w), &s)| f(s, *w)).collect()
    }

    /// What scaled values are worth.
    pub fn merit(&self, scaled: &[f64]) -> Merit {
        let (mut violation, mut objective) = (0.0_f64, None);
        for ((usage, weight), s) in self.rows.iter().zip(scaled) {
            match (usage, self.objective) {
                (Usage::Minimise, Objective::Max | Objective::Each) => {
                    objective = Some(objective.map_or(weight * s, |worst: f64| worst.max(weight * s)));
                }
                (Usage::Minimise, Objective::Sum) => objective = Some(objective.unwrap_or(0.0) + weight * s),
                (Usage::Inequality, _) => violation = violation.max(s - 1.0),
                (Usage::Equality, _) => violation = violation.max((s - 1.0).abs()),
                (Usage::Monitor, _) => {}
            }
        }
        // A study with constraints alone asks for any feasible point.
        Merit { violation, objective: objective.unwrap_or(0.0) }
    }

    /// Whether any row is a constraint.
    pub fn has_constraints(&self) -> bool {
        self.rows.iter().any(|(usage, _)| matches!(usage, Usage::Inequality | Usage::Equality))
    }
}

/// Values and slopes at a point.
#[derive(Debug, Clone)]
pub struct Linearisation {
    /// The evaluation at the point itself.
    pub at: Evaluation,
    /// Derivative of the scaled value of row `i` along coordinate `j`: `rows[i][j]`.
    pub rows: Vec<Vec<f64>>,
    /// Derivative of residual `i` along coordinate `j`: `residuals[j][i]`, one column per coordinate.
    pub residuals: Vec<Vec<f64>>,
}

/// What a solver may ask of a problem. Every question is counted against the budget.
pub trait Oracle {
    /// Sizes and kinds.
    fn shape(&self) -> &Shape;

    /// Evaluates points of the unit box, in parallel; answers come in the order of the points.
    ///
    /// # Errors
    /// The run is over. What was evaluated until then is kept by the run; the solver must return at once.
    fn evaluate(&mut self, points: &[Vec<f64>]) -> Result<Vec<Evaluation>, Halt>;

    /// Values and slopes at a point; `None` where a simulation near it fails. `reach` is the distance within which the
    /// slopes are to describe the problem: those that come from differences must not step over a kink farther away.
    ///
    /// # Errors
    /// As [`Oracle::evaluate`].
    fn linearise(&mut self, point: &[f64], reach: f64) -> Result<Option<Linearisation>, Halt>;

    /// The best point so far, of this solver or of what ran before it in the same run.
    fn best(&self) -> Option<&Evaluation>;

    /// The random stream of that label; always the same one under the same seed.
    fn stream(&self, label: &str) -> Stream;
}

/// Why a run stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Stop {
    /// The solver met its own test of an optimum.
    Converged,
    /// The budget is spent.
    Budget,
    /// The solver could not improve any more, and met no test of an optimum.
    Stalled,
    /// The user ended it.
    Interrupted,
}

impl From<Halt> for Stop {
    fn from(halt: Halt) -> Self {
        match halt {
            Halt::Budget => Self::Budget,
            Halt::Interrupted => Self::Interrupted,
        }
    }
}

/// Where a solver stands after an iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// There is more to do.
    Continue,
    /// An optimum, by the solver's own test.
    Converged,
    /// No improvement any more, and no optimum shown.
    Stalled,
}

/// A solver: asks the oracle for evaluations, one iteration at a time.
///
/// Mandatory: both methods, points inside the unit box, and to return as soon as the oracle says [`Halt`]. Free: how
/// many points an iteration takes. The best point is kept by the run, never by the solver. Failed evaluations are
/// answers ([`Evaluation::scaled`] is `None`), worse than every finite one.
pub trait Solver: Send {
    /// Whether the solver can treat such a problem.
    ///
    /// # Errors
    /// One sentence why not, and what would.
    fn accepts(&self, shape: &Shape) -> Result<(), String>;

    /// Begins at `start`, a point of the unit box.
    ///
    /// # Errors
    /// The run is over.
    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt>;

    /// Does one iteration.
    ///
    /// # Errors
    /// The run is over.
    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt>;

    /// The points it holds at present, where it is one that has members; else none.
    fn members(&self) -> &[Vec<f64>] {
        &[]
    }

    /// Kinds of the solvers that a composite one has run so far, in the order in which they began; else none.
    fn methods(&self) -> &[&'static str] {
        &[]
    }

    /// Points of the front, each of which solves a problem of its own; empty where the solver knows no more of them than
    /// that they were evaluated.
    fn front(&self) -> Vec<Vec<f64>> {
        Vec::new()
    }
}
