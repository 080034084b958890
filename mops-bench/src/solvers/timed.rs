//! Timing of the evaluations of a problem.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use mops::core::{
    Evaluation, Shape,
    problem::{Evaluator, Slopes},
};

/// Evaluator that measures the time spent in it; the rest of a run is the overhead of solver and engine.
pub(super) struct Timed<'a, E> {
    inner: &'a E,
    nanoseconds: AtomicU64,
}

impl<'a, E: Evaluator> Timed<'a, E> {
    pub fn new(inner: &'a E) -> Self {
        Self { inner, nanoseconds: AtomicU64::new(0) }
    }

    /// Returns the time spent in evaluations, in s.
    #[allow(clippy::cast_precision_loss)]
    pub fn seconds(&self) -> f64 {
        self.nanoseconds.load(Ordering::Relaxed) as f64 * 1e-9
    }

    #[allow(clippy::cast_possible_truncation)]
    fn clocked<T>(&self, work: impl FnOnce() -> T) -> T {
        let started = Instant::now();
        let result = work();
        self.nanoseconds.fetch_add(started.elapsed().as_nanos() as u64, Ordering::Relaxed);
        result
    }
}

impl<E: Evaluator> Evaluator for Timed<'_, E> {
    fn shape(&self) -> &Shape {
        self.inner.shape()
    }

    fn evaluate(&self, point: &[f64]) -> Evaluation {
        self.clocked(|| self.inner.evaluate(point))
    }

    fn tuners_at(&self, point: &[f64]) -> Vec<f64> {
        self.inner.tuners_at(point)
    }

    fn slopes(&self, at: &Evaluation, reach: f64) -> Option<Slopes> {
        self.clocked(|| self.inner.slopes(at, reach))
    }

    fn noise(&self) -> f64 {
        self.inner.noise()
    }

    fn seed(&self) -> u64 {
        self.inner.seed()
    }
}
