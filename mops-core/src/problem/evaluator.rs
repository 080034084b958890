//! Problems that a run evaluates: the problem of a study, or one with a known solution.

use crate::evaluation::Evaluation;
use crate::problem::{CachedGradients, CachedPoint, Known, RowSlopes};
use crate::problem::{Problem, Slopes};
use crate::solver::Shape;

/// Rows of scaled values over the unit box, as a pure function: equal points give equal bits on every thread.
///
/// Mandatory: shape, evaluate, tuners_at and seed. Implementations whose results can be cached under every demand also
/// provide the two `_keeping` methods. Their evaluations and derivatives have the same bits as those of the plain
/// methods.
pub trait Evaluator: Sync {
    /// Returns the dimensions and kinds of the problem.
    fn shape(&self) -> &Shape;

    /// Evaluates a point of the unit box.
    fn evaluate(&self, point: &[f64]) -> Evaluation;

    /// Returns the values of all tuners at a point of the unit box; points with equal values are evaluated once.
    fn tuners_at(&self, point: &[f64]) -> Vec<f64>;

    /// Returns exact derivatives at an evaluated point; `None` if there are none. `reach` is the distance within which
    /// they are to describe the problem.
    fn slopes(&self, _at: &Evaluation, _reach: f64) -> Option<Slopes> {
        None
    }

    /// Evaluates a point with a cache entry.
    fn evaluate_keeping(&self, point: &[f64], _known: Option<Known>) -> CachedPoint {
        CachedPoint { evaluation: self.evaluate(point), learned: None }
    }

    /// Returns the derivatives at a point with a cache entry.
    fn slopes_keeping(
        &self,
        at: &Evaluation,
        reach: f64,
        _known: Option<Option<RowSlopes>>,
    ) -> CachedGradients<Slopes> {
        CachedGradients { slopes: self.slopes(at, reach), learned: None }
    }

    /// Returns the relative noise of values at neighbouring points. Simulations at a relative tolerance of 1e-8 repeat
    /// to about 1e-9.
    fn noise(&self) -> f64 {
        1e-9
    }

    /// Returns the seed of the random streams.
    fn seed(&self) -> u64;
}

impl Evaluator for Problem {
    fn shape(&self) -> &Shape {
        self.shape()
    }

    fn evaluate(&self, point: &[f64]) -> Evaluation {
        self.evaluate(point)
    }

    fn tuners_at(&self, point: &[f64]) -> Vec<f64> {
        self.tuners_at(point)
    }

    fn slopes(&self, at: &Evaluation, reach: f64) -> Option<Slopes> {
        self.slopes(at, reach)
    }

    fn evaluate_keeping(&self, point: &[f64], known: Option<Known>) -> CachedPoint {
        self.evaluate_keeping(point, known)
    }

    fn slopes_keeping(&self, at: &Evaluation, reach: f64, known: Option<Option<RowSlopes>>) -> CachedGradients<Slopes> {
        self.slopes_keeping(at, reach, known)
    }

    fn seed(&self) -> u64 {
        self.study().seed
    }
}
