//! A problem with a known answer.

use crate::bounds::REACH;
use crate::formula::Functions;

/// A problem with a known answer, in its own variables.
///
/// Its functions give, in this order: what is to be minimised (for [`Sense::Squares`] the residuals), the inequalities,
/// satisfied where at most 0, and the equalities, satisfied where 0. What is to be minimised is one row or many: a solver
/// sees every row on its own ([`mops_core::Evaluation::scaled`]), whatever [`Sense`] makes of them.
#[derive(Debug)]
pub struct Problem {
    /// Name in the literature.
    pub name: String,
    /// Source of this one, where it is not that of the suite.
    pub source: &'static str,
    /// Where solvers start.
    pub start: Vec<f64>,
    /// Smallest and largest value of every variable, infinite where there is none; empty where no variable has bounds.
    pub bounds: Vec<[f64; 2]>,
    /// Half the width of the box around the start for variables without bounds, in units of max(1, |start|).
    pub reach: f64,
    /// What the rows to be minimised are together.
    pub sense: Sense,
    /// Number of inequalities.
    pub inequalities: usize,
    /// Number of equalities.
    pub equalities: usize,
    /// What is known of the solution.
    pub answer: Answer,
    /// Accuracy that counts as solved, where it is not that of the suite.
    pub accuracy: Option<f64>,
    /// The functions.
    pub functions: Functions,
}

/// What the rows to be minimised are together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sense {
    /// The largest of them counts.
    #[default]
    Max,
    /// The largest absolute value counts: every row and its negative is minimised.
    MaxAbs,
    /// Their sum of squares counts: one row, and a residual vector.
    Squares,
    /// Each counts for itself. A run orders its points by the largest; solvers for many objectives look at all rows.
    Each,
}

/// What is known of the solution.
#[derive(Debug, Clone, Default)]
pub enum Answer {
    /// Nothing.
    #[default]
    Unknown,
    /// Values of local minima; the first is the smallest known. A solver that ends in any of them has solved the problem.
    Minima(Vec<f64>),
    /// The Pareto front: a point that no front point is worse than in any objective, and the volume between it and the front.
    Front {
        /// The reference point.
        reference: Vec<f64>,
        /// The hypervolume of the true front.
        hypervolume: f64,
        /// That many points spread over the front.
        points: fn(usize) -> Vec<Vec<f64>>,
    },
}

impl Answer {
    /// The known minimum that an objective belongs to: a local one where it is that to 1e-4, relative to the larger of 1 and
    /// its size; else the smallest. `None` where none is known.
    pub fn nearest_minimum(&self, objective: f64) -> Option<f64> {
        let Self::Minima(minima) = self else { return None };
        let is = |minimum: &&f64| (objective - **minimum).abs() <= 1e-4 * minimum.abs().max(1.0);
        minima.iter().find(is).or(minima.first()).copied()
    }
}

impl From<f64> for Answer {
    fn from(minimum: f64) -> Self {
        Self::Minima(vec![minimum])
    }
}

impl<const N: usize> From<[f64; N]> for Answer {
    fn from(minima: [f64; N]) -> Self {
        Self::Minima(minima.to_vec())
    }
}

impl Problem {
    /// A problem without constraints or bounds, whose largest row counts.
    pub fn new(name: &str, start: &[f64], answer: impl Into<Answer>, functions: Functions) -> Self {
        Self {
            name: name.to_owned(),
            source: "",
            start: start.to_vec(),
            bounds: Vec::new(),
            reach: REACH,
            sense: Sense::Max,
            inequalities: 0,
            equalities: 0,
            answer: answer.into(),
            accuracy: None,
            functions,
        }
    }

    /// Number of variables.
    pub fn dimension(&self) -> usize {
        self.start.len()
    }

    /// The known minimum that an objective belongs to ([`Answer::nearest_minimum`]).
    pub fn nearest_minimum(&self, objective: f64) -> Option<f64> {
        self.answer.nearest_minimum(objective)
    }

    /// How far an objective lies above the minimum it belongs to, relative to the larger of 1 and its size; negative below.
    pub fn gap(&self, objective: f64) -> Option<f64> {
        self.nearest_minimum(objective).map(|minimum| (objective - minimum) / minimum.abs().max(1.0))
    }
}
