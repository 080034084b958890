//! A solver of one's own: the command line of mops with one more kind, `shrinking-box`, that studies and `--solver` can name.
//!
//!     cargo run --release --example own_solver -- run pid-design --solver shrinking-box

use std::process::ExitCode;

use mops::{Catalogue, Halt, Objective, Oracle, Progress, Shape, Solver, SolverKind, SolverOptions, Stream};
use rand::Rng;
use schemars::JsonSchema;
use serde::Deserialize;

/// Draws points from a box around the best one, all at once, and goes to the best of them; where none is better, the box
/// shrinks. It reads no slopes, and takes criteria as they come.
///
/// Source: R. Luus, T. H. I. Jaakola, AIChE Journal 19 (1973) 760-766.
/// N.B.: there the box shrinks after every draw; here only after one that brought nothing.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct ShrinkingBoxOptions {
    /// Points of a draw, per tuner.
    pub points: usize,
    /// What is left of the box's sides after a draw that brought nothing.
    pub shrink: f64,
    /// It ends when the sides are shorter than this, in the unit box.
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

struct ShrinkingBox {
    options: ShrinkingBoxOptions,
    state: Option<State>,
}

/// Where it stands; the best point is kept by the run.
struct State {
    random: Stream,
    side: f64,
}

impl Solver for ShrinkingBox {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        match shape.objective {
            Objective::Each => Err("`shrinking-box` looks for one point; take `nsga2` for a front".into()),
            Objective::Max | Objective::Sum => Ok(()),
        }
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        // The run has evaluated the start already: it is the best point so far.
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
        // A point that could not be simulated is worse than every other: nothing needs to be asked.
        if !answers.iter().any(|answer| answer.merit.is_better_than(&best.merit)) {
            state.side *= self.options.shrink;
        }
        // Chance shows no optimum.
        Ok(if state.side < self.options.tolerance { Progress::Stalled } else { Progress::Continue })
    }
}

/// Everything that comes with mops, and this solver.
pub fn catalogue() -> Catalogue {
    mops::catalogue().with_solver(SolverKind::of::<ShrinkingBoxOptions>())
}

#[allow(dead_code)]
fn main() -> ExitCode {
    mops::main(catalogue())
}
