//! Scalarisation of the criteria in a subproblem, and the oracle through which a local solver evaluates it.

use mops_core::{Evaluation, Halt, Merit, Objective, Oracle, Shape, Usage, solver::Linearisation};
use mops_math::Stream;

use super::archive::Archive;

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
    fn rows(&self, of: &Shape) -> (Shape, Vec<(f64, f64)>) {
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
const ROUNDING: f64 = 1e-14;

/// Scalarised problem of a subproblem; every evaluation is recorded in the archive.
pub struct ScalarisedProblem<'a> {
    oracle: &'a mut dyn Oracle,
    archive: &'a mut Archive,
    shape: Shape,
    coefficients: Vec<(f64, f64)>,
    best: Option<Evaluation>,
}

impl<'a> ScalarisedProblem<'a> {
    pub fn new(oracle: &'a mut dyn Oracle, archive: &'a mut Archive, scalarisation: &Scalarisation) -> Self {
        let (shape, coefficients) = scalarisation.rows(oracle.shape());
        Self { oracle, archive, shape, coefficients, best: None }
    }

    fn scalarise(&self, mut evaluation: Evaluation) -> Evaluation {
        if let Some(scaled) = &mut evaluation.scaled {
            scaled.iter_mut().zip(&self.coefficients).for_each(|(s, (factor, offset))| *s = factor * *s + offset);
            evaluation.merit = self.shape.merit(scaled);
        }
        evaluation.residuals.clear();
        evaluation
    }

    /// Moves coordinates within rounding error of a bound to the bound. A criterion with infinite derivative at the
    /// bound (a root, for example) has meaningless gradients next to it.
    fn on_bounds(point: &[f64]) -> Vec<f64> {
        let snap = |&u: &f64| {
            if u < ROUNDING {
                0.0
            } else if u > 1.0 - ROUNDING {
                1.0
            } else {
                u
            }
        };
        point.iter().map(snap).collect()
    }

    fn record_best(&mut self, evaluation: &Evaluation) {
        if self.best.as_ref().is_none_or(|best| evaluation.merit.is_better_than(&best.merit)) {
            self.best = Some(evaluation.clone());
        }
    }
}

impl Oracle for ScalarisedProblem<'_> {
    fn shape(&self) -> &Shape {
        &self.shape
    }

    fn evaluate(&mut self, points: &[Vec<f64>]) -> Result<Vec<Evaluation>, Halt> {
        let answers = self.oracle.evaluate(&points.iter().map(|point| Self::on_bounds(point)).collect::<Vec<_>>())?;
        self.archive.record(self.oracle.shape(), &answers);
        let answers: Vec<Evaluation> = answers.into_iter().map(|answer| self.scalarise(answer)).collect();
        answers.iter().for_each(|answer| self.record_best(answer));
        Ok(answers)
    }

    fn linearise(&mut self, point: &[f64], reach: f64) -> Result<Option<Linearisation>, Halt> {
        let Some(Linearisation { at, mut rows, .. }) = self.oracle.linearise(&Self::on_bounds(point), reach)? else {
            return Ok(None);
        };
        self.archive.record(self.oracle.shape(), std::slice::from_ref(&at));
        for (row, (factor, _)) in rows.iter_mut().zip(&self.coefficients) {
            row.iter_mut().for_each(|gradient| *gradient *= factor);
        }
        let at = self.scalarise(at);
        self.record_best(&at);
        Ok(Some(Linearisation { at, rows, residuals: vec![Vec::new(); point.len()] }))
    }

    fn best(&self) -> Option<&Evaluation> {
        self.best.as_ref()
    }

    fn is_over(&self) -> bool {
        self.oracle.is_over()
    }

    fn remaining(&self) -> usize {
        self.oracle.remaining()
    }

    fn stream(&self, label: &str) -> Stream {
        self.oracle.stream(label)
    }
}
