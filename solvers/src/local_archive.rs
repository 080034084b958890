//! Archive of the best point of one run among several.

use mops_core::{Evaluation, Halt, Oracle, Shape, solver::Linearisation};
use mops_math::Stream;

/// Oracle of one run, whose best point is the best of that run only.
pub struct LocalArchive<'a> {
    /// Oracle shared by all runs.
    pub oracle: &'a mut dyn Oracle,
    /// Best point of this run.
    pub best: &'a mut Option<Evaluation>,
}

impl Oracle for LocalArchive<'_> {
    fn shape(&self) -> &Shape {
        self.oracle.shape()
    }

    fn evaluate(&mut self, points: &[Vec<f64>]) -> Result<Vec<Evaluation>, Halt> {
        let answers = self.oracle.evaluate(points)?;
        for answer in &answers {
            if self.best.as_ref().is_none_or(|best| answer.merit.is_better_than(&best.merit)) {
                *self.best = Some(answer.clone());
            }
        }
        Ok(answers)
    }

    fn linearise(&mut self, point: &[f64], reach: f64) -> Result<Option<Linearisation>, Halt> {
        self.oracle.linearise(point, reach)
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
