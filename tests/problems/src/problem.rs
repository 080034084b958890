//! Problem with a known answer.

use crate::bounds::REACH;
use crate::formula::Functions;

/// Problem with a known answer, in its own variables.
///
/// Its functions give, in this order: the functions to be minimised (for [`Sense::Squares`] the residuals); the
/// inequalities, satisfied if at most 0; and the equalities, satisfied if 0. There are one or more functions to be
/// minimised. A solver sees each of them on its own ([`mops_core::Evaluation::scaled`]), for any [`Sense`].
#[derive(Debug)]
pub struct Problem {
    /// Name in the literature.
    pub name: String,
    /// Source of this problem, if different from that of the suite.
    pub source: &'static str,
    /// Initial guess.
    pub start: Vec<f64>,
    /// Lower and upper bound of every variable, infinite if there is none; empty if no variable has bounds.
    pub bounds: Vec<[f64; 2]>,
    /// Half-width of the box around the initial guess for unbounded variables, in units of max(1, |initial guess|).
    pub reach: f64,
    /// Combination of the functions to be minimised.
    pub sense: Sense,
    /// Number of inequalities.
    pub inequalities: usize,
    /// Number of equalities.
    pub equalities: usize,
    /// Known solution.
    pub answer: Answer,
    /// Accuracy that counts as solved, if different from that of the suite.
    pub accuracy: Option<f64>,
    /// Functions of the problem.
    pub functions: Functions,
}

/// Combination of the functions to be minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sense {
    /// Maximum.
    #[default]
    Max,
    /// Largest absolute value: every function and its negative is minimised.
    MaxAbs,
    /// Sum of squares: one criterion, and a residual vector.
    Squares,
    /// Separate objectives. A run orders its points by the largest; multi-objective solvers use all of them.
    Each,
}

/// Known solution of a problem.
#[derive(Debug, Clone, Default)]
pub enum Answer {
    /// No known solution.
    #[default]
    Unknown,
    /// Values of local minima; the first is the smallest known. A solver that ends in any of them has solved the
    /// problem.
    Minima(Vec<f64>),
    /// Pareto front, with the hypervolume between the front and a reference point that no front point is worse than.
    Front {
        /// Reference point.
        reference: Vec<f64>,
        /// Hypervolume of the true front.
        hypervolume: f64,
        /// Returns the given number of points spread over the front.
        points: fn(usize) -> Vec<Vec<f64>>,
    },
}

impl Answer {
    /// Returns the known minimum for an objective: a local one if it agrees to 1e-4, relative to the larger of 1 and
    /// its magnitude; otherwise the smallest. `None` if no minimum is known.
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
    /// Creates a problem without constraints or bounds whose largest function counts.
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

    /// Returns the number of variables.
    pub fn dimension(&self) -> usize {
        self.start.len()
    }

    /// Returns the known minimum for an objective ([`Answer::nearest_minimum`]).
    pub fn nearest_minimum(&self, objective: f64) -> Option<f64> {
        self.answer.nearest_minimum(objective)
    }

    /// Returns the distance of an objective to its known minimum, relative to the larger of 1 and the magnitude of that
    /// minimum; negative below.
    pub fn gap(&self, objective: f64) -> Option<f64> {
        self.nearest_minimum(objective).map(|minimum| (objective - minimum) / minimum.abs().max(1.0))
    }
}
