//! Scalarisation of the criteria in a subproblem.

use mops_core::{Merit, Objective, Shape, Usage};

/// Role of an objective `f` (weighted scaled value) in a subproblem.
#[derive(Debug, Clone, Copy)]
pub enum Role {
    /// `(f - reference) / scale` is minimised.
    Minimised { reference: f64, scale: f64 },
    /// `(f - limit) / scale` is at most 0.
    Limited { limit: f64, scale: f64 },
    /// The objective has no influence.
    Ignored,
}

impl Role {
    /// Returns factor and offset that map the objective to its scaled value in the subproblem.
    fn coefficients(self) -> (f64, f64) {
        match self {
            Self::Minimised { reference, scale } => (1.0 / scale, -reference / scale),
            Self::Limited { limit, scale } => (1.0 / scale, 1.0 - limit / scale),
            Self::Ignored => (0.0, 0.0),
        }
    }

    fn usage(self) -> Usage {
        match self {
            Self::Minimised { .. } => Usage::Minimise,
            Self::Limited { .. } => Usage::Inequality,
            Self::Ignored => Usage::Monitor,
        }
    }
}

/// Scalarisation of a subproblem: a role for every objective, in their order. The largest of the minimised ones counts.
/// Constraints remain unchanged.
#[derive(Debug, Clone)]
pub struct Scalarisation {
    /// Roles of the objectives.
    pub roles: Vec<Role>,
}

impl Scalarisation {
    /// Creates the weighted Chebyshev distance: the largest objective, relative to `low` and in units of `range`.
    pub fn chebyshev(low: &[f64], range: &[f64]) -> Self {
        let role = |(&reference, &scale): (&f64, &f64)| Role::Minimised { reference, scale };
        Self { roles: low.iter().zip(range).map(role).collect() }
    }

    /// Returns the scaled value of every objective in the subproblem.
    pub fn scalarised_values(&self, objectives: &[f64]) -> Vec<f64> {
        let scalarised_value = |(role, f): (&Role, &f64)| {
            let (factor, offset) = role.coefficients();
            factor * f + offset
        };
        self.roles.iter().zip(objectives).map(scalarised_value).collect()
    }

    /// Returns the merit of the objectives; its violation is that of the limited ones alone.
    pub fn merit(&self, objectives: &[f64]) -> Merit {
        let mut merit = Merit { violation: 0.0, objective: f64::NEG_INFINITY };
        for (role, value) in self.roles.iter().zip(self.scalarised_values(objectives)) {
            match role {
                Role::Minimised { .. } => merit.objective = merit.objective.max(value),
                Role::Limited { .. } => merit.violation = merit.violation.max(value - 1.0),
                Role::Ignored => {}
            }
        }
        merit
    }

    /// Returns the shape of the subproblem, with factor and offset of every row.
    pub(super) fn rows(&self, of: &Shape) -> (Shape, Vec<(f64, f64)>) {
        let objective_of = of.objective_of_rows();
        let mut minimised = objective_of.iter();
        let mut groups = Vec::new();
        let mut row = |(usage, weight): &(Usage, f64)| match usage {
            Usage::Minimise => {
                let &k = minimised.next().expect("an objective for every minimised row");
                let (factor, offset) = self.roles[k].coefficients();
                if let Role::Minimised { .. } = self.roles[k] {
                    groups.push(k);
                }
                ((self.roles[k].usage(), 1.0), (factor * weight, offset))
            }
            other => ((*other, *weight), (1.0, 0.0)),
        };
        let (rows, coefficients) = of.rows.iter().map(&mut row).unzip();
        // Without the objectives that are not minimised, the others are counted anew.
        let mut minimised = groups.clone();
        minimised.sort_unstable();
        minimised.dedup();
        let groups = groups.iter().map(|group| minimised.partition_point(|other| other < group)).collect();
        (Shape { rows, objective: Objective::Max, groups, residuals: 0, ..of.clone() }, coefficients)
    }
}

/// Tolerance for the rounding error of a step that leads to a bound.
pub(super) const ROUNDING: f64 = 1e-14;
