//! Two solvers of different kinds from one start, the first to rough accuracy until the other has been heard.

use mops_core::math;
use mops_core::{Evaluation, Halt, Oracle, Progress, Shape, Solver, SolverOptions};

use crate::own::Own;
use crate::pattern_search::PatternSearchOptions;
use crate::quasi_newton::QuasiNewton;
use crate::relay::Relay;
use crate::sqp::SqpOptions;

/// For one smooth row: BFGS to rough accuracy; then a pattern search from the same start, whose models of a wider neighbourhood
/// may lead to another basin, until it comes near to where slopes have led; then BFGS again, from the better end.
pub struct SecondOpinion {
    slopes: QuasiNewton,
    start: Vec<f64>,
    stage: Stage,
}

enum Stage {
    /// Slopes, to rough accuracy.
    Rough,
    /// The other from the start.
    Other(Box<Other>),
    /// Slopes on from where they ended.
    Fine,
    /// Another solver from the best point on.
    Last(Box<dyn Solver>),
}

/// A pattern search beside an end that is known.
struct Other {
    pattern: Box<dyn Solver>,
    /// Where slopes ended.
    end: Evaluation,
    /// The best that it has seen itself.
    own: Option<Evaluation>,
}

/// Share of the way from the start to an end within which another point is on the way to the same. Of the 53 problems of
/// `mops-bench more-wild` as many are solved with 0.05.
const NEAR: f64 = 0.3;

/// Factor of the pattern's size where nothing in it is better: coarse, since the search is to look elsewhere, not to be
/// accurate. Of the same 53 problems 51 are solved to 1e-5 with it, 50 with 0.5, which misses a lower minimum.
const SHRINK: f64 = 0.25;

impl Default for SecondOpinion {
    fn default() -> Self {
        Self { slopes: QuasiNewton::rough(), start: Vec::new(), stage: Stage::Rough }
    }
}

/// What goes on where slopes meet kinks.
fn at_kinks() -> Box<dyn Solver> {
    SqpOptions::default().build()
}

impl SecondOpinion {
    fn go_on_with(&mut self, mut last: Box<dyn Solver>, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(best) = oracle.best().map(|best| best.point.clone()) else { return Ok(Progress::Stalled) };
        last.begin(oracle, &best)?;
        self.stage = Stage::Last(last);
        Ok(Progress::Continue)
    }
}

impl Solver for SecondOpinion {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        self.slopes.accepts(shape)
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        *self = Self { start: start.to_vec(), ..Self::default() };
        self.slopes.begin(oracle, start)
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        match &mut self.stage {
            Stage::Rough => match (self.slopes.step(oracle)?, oracle.best().cloned()) {
                (Progress::Converged, Some(end)) => {
                    let mut pattern = PatternSearchOptions { shrink: SHRINK, ..Default::default() }.build();
                    let mut own = None;
                    pattern.begin(&mut Own { oracle, best: &mut own }, &self.start)?;
                    self.stage = Stage::Other(Box::new(Other { pattern, end, own }));
                    Ok(Progress::Continue)
                }
                (Progress::Stalled, _) => {
                    let pattern = PatternSearchOptions::default().build();
                    self.go_on_with(Box::new(Relay::to_the_end(at_kinks(), pattern)), oracle)
                }
                (progress, _) => Ok(progress),
            },
            Stage::Other(other) => {
                let Other { pattern, end, own } = other.as_mut();
                let progress = pattern.step(&mut Own { oracle: &mut *oracle, best: own })?;
                let is_better = own.as_ref().is_some_and(|own| own.merit.is_better_than(&end.merit));
                let way = distance(&self.start, &end.point);
                let is_near = own.as_ref().is_some_and(|own| distance(&own.point, &end.point) <= NEAR * way);
                if progress == Progress::Continue && !is_near {
                    return Ok(progress);
                }
                if is_better {
                    let last = Relay::new(Box::new(QuasiNewton::default()), at_kinks());
                    return self.go_on_with(Box::new(last), oracle);
                }
                self.slopes.refine();
                self.stage = Stage::Fine;
                Ok(Progress::Continue)
            }
            Stage::Fine => match self.slopes.step(oracle)? {
                Progress::Stalled => self.go_on_with(at_kinks(), oracle),
                progress => Ok(progress),
            },
            Stage::Last(last) => last.step(oracle),
        }
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| math::powi(a - b, 2)).sum::<f64>().sqrt()
}
