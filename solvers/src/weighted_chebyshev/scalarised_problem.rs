//! Scalarised problem: the oracle through which a local solver evaluates a scalarisation.

use mops_core::solver::Linearisation;
use mops_core::{Evaluation, Halt, Oracle, Shape};
use mops_math::Stream;

use super::archive::Archive;
use super::scalarisation::{ROUNDING, Scalarisation};

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
