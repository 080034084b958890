//! What a run evaluates: a study's problem, or a problem with a known answer.

use crate::evaluation::Evaluation;
use crate::known::{Kept, KeptSlopes, Known, RowSlopes};
use crate::problem::{Problem, Slopes};
use crate::solver::Shape;

/// Rows of scaled values over the unit box. A pure function: the same point gives the same bits on every thread.
///
/// Mandatory: shape, evaluate, tuners_at and seed. Who can tell what holds under every demand offers the two methods that
/// keep as well; their evaluations and slopes have the same bits as the others'.
pub trait Evaluator: Sync {
    /// Sizes and kinds.
    fn shape(&self) -> &Shape;

    /// What a point of the unit box is worth.
    fn evaluate(&self, point: &[f64]) -> Evaluation;

    /// Values of all tuners at a point of the unit box; points with the same ones are evaluated once.
    fn tuners_at(&self, point: &[f64]) -> Vec<f64>;

    /// Exact slopes at an evaluated point; `None` where there are none. `reach` is the distance within which they are to
    /// describe the problem.
    fn slopes(&self, _at: &Evaluation, _reach: f64) -> Option<Slopes> {
        None
    }

    /// The evaluation of a point of which something is known already.
    fn evaluate_keeping(&self, point: &[f64], _known: Option<Known>) -> Kept {
        Kept { evaluation: self.evaluate(point), learned: None }
    }

    /// The slopes at a point of which they may be known already.
    fn slopes_keeping(&self, at: &Evaluation, reach: f64, _known: Option<Option<RowSlopes>>) -> KeptSlopes<Slopes> {
        KeptSlopes { slopes: self.slopes(at, reach), learned: None }
    }

    /// How far values of neighbouring points are off, relative to their size. Simulations at a relative tolerance of 1e-8
    /// repeat to about 1e-9.
    fn noise(&self) -> f64 {
        1e-9
    }

    /// The seed of the random streams.
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

    fn evaluate_keeping(&self, point: &[f64], known: Option<Known>) -> Kept {
        self.evaluate_keeping(point, known)
    }

    fn slopes_keeping(&self, at: &Evaluation, reach: f64, known: Option<Option<RowSlopes>>) -> KeptSlopes<Slopes> {
        self.slopes_keeping(at, reach, known)
    }

    fn seed(&self) -> u64 {
        self.study().seed
    }
}
