//! Combination of a quasi-Newton method and a pattern search from the same starting point.

use mops_core::{Evaluation, Halt, Oracle, Progress, Shape, Solver};
use mops_math as math;

use crate::chaining::Chain;
use crate::local_archive::LocalArchive;
use crate::pattern_search::PatternSearchOptions;
use crate::quasi_newton::QuasiNewton;
use crate::sqp::SqpOptions;

/// Multimethod solver for one smooth criterion.
///
/// BFGS first converges to a coarse tolerance. A pattern search then runs from the same starting point. Its models
/// cover a wider neighbourhood and may lead to another basin; it stops near the point that BFGS found. BFGS finally
/// continues from the better of both points.
pub struct Multimethod {
    quasi_newton: QuasiNewton,
    start: Vec<f64>,
    stage: Stage,
}

enum Stage {
    /// BFGS to a coarse tolerance.
    Coarse,
    /// Pattern search from the starting point.
    Alternative(Box<Alternative>),
    /// BFGS continued to full accuracy.
    Fine,
    /// Other solver, started at the best point.
    Final(Box<dyn Solver>),
}

/// Pattern search as an alternative to a known result.
struct Alternative {
    pattern: Box<dyn Solver>,
    /// Result of BFGS.
    end: Evaluation,
    /// Best point of the pattern search.
    local_best: Option<Evaluation>,
}

/// Distance from the BFGS result below which the pattern search approaches the same basin, relative to the distance
/// between the starting point and that result. Of the 53 problems of `mops-bench more-wild`, 0.05 solves as many.
const CLOSE: f64 = 0.3;

/// Shrink factor of the pattern: coarse, because the search has to explore rather than be accurate. Of the same 53
/// problems, 51 are solved to 1e-5; 0.5 solves 50 and misses a lower minimum.
const SHRINK: f64 = 0.25;

impl Default for Multimethod {
    fn default() -> Self {
        Self { quasi_newton: QuasiNewton::coarse(), start: Vec::new(), stage: Stage::Coarse }
    }
}

/// Builds the solver that continues at kinks.
fn nonsmooth_solver() -> Box<dyn Solver> {
    SqpOptions::default().local()
}

impl Multimethod {
    fn continue_with(&mut self, mut final_solver: Box<dyn Solver>, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(best) = oracle.best().map(|best| best.point.clone()) else { return Ok(Progress::Stalled) };
        final_solver.begin(oracle, &best)?;
        self.stage = Stage::Final(final_solver);
        Ok(Progress::Continue)
    }
}

impl Solver for Multimethod {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        self.quasi_newton.accepts(shape)
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        *self = Self { start: start.to_vec(), ..Self::default() };
        self.quasi_newton.begin(oracle, start)
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        match &mut self.stage {
            Stage::Coarse => match (self.quasi_newton.step(oracle)?, oracle.best().cloned()) {
                (Progress::Converged, Some(end)) => {
                    let mut pattern = PatternSearchOptions { shrink: SHRINK, ..Default::default() }.local();
                    let mut local_best = None;
                    pattern.begin(&mut LocalArchive { oracle, best: &mut local_best }, &self.start)?;
                    self.stage = Stage::Alternative(Box::new(Alternative { pattern, end, local_best }));
                    Ok(Progress::Continue)
                }
                (Progress::Stalled, _) => {
                    let pattern = PatternSearchOptions::default().local();
                    self.continue_with(Box::new(Chain::always(nonsmooth_solver(), pattern)), oracle)
                }
                (progress, _) => Ok(progress),
            },
            Stage::Alternative(alternative) => {
                let Alternative { pattern, end, local_best } = alternative.as_mut();
                let progress = pattern.step(&mut LocalArchive { oracle: &mut *oracle, best: local_best })?;
                let is_better =
                    local_best.as_ref().is_some_and(|local_best| local_best.merit.is_better_than(&end.merit));
                let distance_to_end = distance(&self.start, &end.point);
                let is_close = local_best
                    .as_ref()
                    .is_some_and(|local_best| distance(&local_best.point, &end.point) <= CLOSE * distance_to_end);
                if progress == Progress::Continue && !is_close {
                    return Ok(progress);
                }
                if is_better {
                    let final_solver = Chain::on_stall(Box::new(QuasiNewton::default()), nonsmooth_solver());
                    return self.continue_with(Box::new(final_solver), oracle);
                }
                self.quasi_newton.refine();
                self.stage = Stage::Fine;
                Ok(Progress::Continue)
            }
            Stage::Fine => match self.quasi_newton.step(oracle)? {
                Progress::Stalled => self.continue_with(nonsmooth_solver(), oracle),
                progress => Ok(progress),
            },
            Stage::Final(final_solver) => final_solver.step(oracle),
        }
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| math::powi(a - b, 2)).sum::<f64>().sqrt()
}
