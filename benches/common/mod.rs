//! Problem whose scaled values are a closed form, for benchmarks of the solvers.

use mops::core::{Evaluation, Shape, problem::Evaluator};

/// Problem over the unit box, whose tuners are its coordinates.
pub struct ClosedForm {
    pub shape: Shape,
    /// Returns the scaled values at a point.
    pub scaled: fn(&[f64]) -> Vec<f64>,
}

impl Evaluator for ClosedForm {
    fn shape(&self) -> &Shape {
        &self.shape
    }

    fn evaluate(&self, point: &[f64]) -> Evaluation {
        let scaled = (self.scaled)(point);
        Evaluation {
            point: point.to_vec(),
            tuners: point.to_vec(),
            readings: Vec::new(),
            merit: self.shape.merit(&scaled),
            scaled: Some(scaled),
            residuals: Vec::new(),
            failures: Vec::new(),
        }
    }

    fn tuners_at(&self, point: &[f64]) -> Vec<f64> {
        point.to_vec()
    }

    fn seed(&self) -> u64 {
        1
    }
}
