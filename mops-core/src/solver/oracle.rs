//! Oracle: what a solver may ask of a problem.

use mops_math::Stream;

use super::shape::Shape;
use crate::cancellation::Halt;
use crate::evaluation::Evaluation;

/// Values and derivatives at a point.
#[derive(Debug, Clone)]
pub struct Linearisation {
    /// Evaluation at the point itself.
    pub at: Evaluation,
    /// Derivative of the scaled value of row `i` along coordinate `j`: `rows[i][j]`.
    pub rows: Vec<Vec<f64>>,
    /// Derivative of residual `i` along coordinate `j`: `residuals[j][i]`, one column per coordinate.
    pub residuals: Vec<Vec<f64>>,
}

/// Interface through which a solver queries a problem. Every query is counted against the budget.
pub trait Oracle {
    /// Returns the dimensions and kinds of the problem.
    fn shape(&self) -> &Shape;

    /// Evaluates points of the unit box in parallel; the results have the order of the points.
    ///
    /// # Errors
    /// Returns [`Halt`] if the run is over. The run keeps the evaluations made so far; the solver must return at once.
    fn evaluate(&mut self, points: &[Vec<f64>]) -> Result<Vec<Evaluation>, Halt>;

    /// Returns values and derivatives at a point; `None` if a simulation near it fails. `reach` is the distance within
    /// which the derivatives are to describe the problem. Finite differences must not step over a kink farther away.
    ///
    /// # Errors
    /// Returns [`Halt`] as [`Oracle::evaluate`] does.
    fn linearise(&mut self, point: &[f64], reach: f64) -> Result<Option<Linearisation>, Halt>;

    /// Returns the best point so far, of this solver or of an earlier one in the same run.
    fn best(&self) -> Option<&Evaluation>;

    /// Returns true if the run was asked to stop. Long computations without evaluations ask between their steps, and
    /// end.
    fn is_over(&self) -> bool {
        false
    }

    /// Returns the number of points that may still be evaluated.
    fn remaining(&self) -> usize;

    /// Returns the random stream with this label, identical for the same seed.
    fn stream(&self, label: &str) -> Stream;
}
