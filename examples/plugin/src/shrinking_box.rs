//! The solver `shrinking-box`.

use mops::solvers::prelude::*;
use rand::Rng;
use schemars::JsonSchema;
use serde::Deserialize;

/// Random search in a shrinking box: each iteration draws points from a box around the best one, evaluates all of them
/// in one batch, and moves to the best. If none is better, the box shrinks. Uses no gradients, and accepts criteria of
/// any kind.
///
/// Source: R. Luus, T. H. I. Jaakola, AIChE Journal 19 (1973) 760-766.
/// N.B.: there the box shrinks after every iteration; here only after one without improvement.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct ShrinkingBoxOptions {
    /// Number of points per iteration and tuner.
    pub points: usize,
    /// Factor on the sides of the box after an iteration without improvement.
    pub shrink: f64,
    /// Length of the sides, in the unit box, below which the search ends.
    pub tolerance: f64,
}

impl Default for ShrinkingBoxOptions {
    fn default() -> Self {
        Self { points: 10, shrink: 0.7, tolerance: 1e-7 }
    }
}

impl SolverOptions for ShrinkingBoxOptions {
    const KIND: &'static str = "shrinking-box";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(ShrinkingBox { options: self.clone(), state: None })
    }
}

/// The solver.
struct ShrinkingBox {
    options: ShrinkingBoxOptions,
    state: Option<State>,
}

/// State of the search; the run keeps the best point.
struct State {
    random: Stream,
    side: f64,
}

impl Solver for ShrinkingBox {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        match shape.objective {
            Objective::Each => Err("`shrinking-box` finds one point; use `nsga2` for a front".into()),
            Objective::Max | Objective::Sum => Ok(()),
        }
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        // The run has already evaluated the start: it is the best point so far.
        self.state = (!start.is_empty()).then(|| State { random: oracle.stream("shrinking-box"), side: 1.0 });
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let (Some(state), Some(best)) = (&mut self.state, oracle.best().cloned()) else { return Ok(Progress::Stalled) };
        let mut draw = || -> Vec<f64> {
            let mut near = |c: &f64| (c + state.side * (state.random.random::<f64>() - 0.5)).clamp(0.0, 1.0);
            best.point.iter().map(&mut near).collect()
        };
        let drawn: Vec<Vec<f64>> = (0..self.options.points * best.point.len()).map(|_| draw()).collect();
        let answers = oracle.evaluate(&drawn)?;
        // A failed point ranks below every other: no check is needed.
        if !answers.iter().any(|answer| answer.merit.is_better_than(&best.merit)) {
            state.side *= self.options.shrink;
        }
        // A random search cannot prove an optimum.
        Ok(if state.side < self.options.tolerance { Progress::Stalled } else { Progress::Continue })
    }
}
