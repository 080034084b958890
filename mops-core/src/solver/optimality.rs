//! What the tests of optimality find of a point.

use schemars::JsonSchema;
use serde::Serialize;

/// Objective whose relative changes do not matter: changes count relative to the objective plus this. A scaled value of
/// 1 is the demand.
pub const SMALL_OBJECTIVE: f64 = 1e-3;

/// Decrease within a step of a thousandth of the box, relative to the value plus [`SMALL_OBJECTIVE`], that the tests of
/// optimality neglect: 0.005 %, far below what a demand is known to.
pub const NEGLIGIBLE_DECREASE: f64 = 5e-5;

/// First-order classification of a point, for the objective under the constraints and the bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Optimality {
    /// Stationary: by the derivatives at the point, no direction lowers the objective.
    Stationary,
    /// Stationary at a kink of a criterion: by the derivatives sampled around the point, no direction lowers the
    /// objective.
    Kink,
    /// The objective is constant around the point, so that derivatives show nothing.
    Plateau,
    /// A criterion is discontinuous beside the point, so that derivatives show nothing.
    Jump,
    /// A small step lowers the objective: the point is not an optimum.
    Descent,
    /// Not shown: there are no derivatives, or the decrease that they predict does not happen.
    NotShown,
}

impl Optimality {
    /// Returns true if no direction lowers the objective to first order.
    #[must_use]
    pub fn is_stationary(self) -> bool {
        matches!(self, Self::Stationary | Self::Kink)
    }
}

/// Pareto optimality of a result: certified, not shown or refuted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Pareto {
    /// Locally Pareto-optimal to first order: no direction improves one criterion without worsening another.
    CertifiedLocal,
    /// Not certified as Pareto-optimal.
    NotShown,
    /// Not Pareto-optimal: an improving direction is known.
    No,
}
