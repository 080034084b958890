//! Polishing: the best points of a global search are the starting points of local ones.

use mops_core::{Evaluation, Halt, Merit, Oracle, Progress, Shape, Solver, SolverOptions, solver::Linearisation};
use mops_math::Stream;

use crate::levenberg_marquardt::LevenbergMarquardtOptions;
use crate::multistart::Multistart;
use crate::pattern_search::PatternSearchOptions;
use crate::sqp::SqpOptions;

/// Share of the budget that is kept for the local searches: one in this many evaluations.
const KEPT: usize = 5;

/// Number of points that local searches start from.
const STARTS: usize = 6;

/// Distance between starting points of local searches, in the unit box along a coordinate. Closer ones mostly share a
/// basin.
const APART: f64 = 0.1;

/// Number of points that are remembered during the global search.
const REMEMBERED: usize = 30;

/// Initial size of the pattern of the last search, in the unit box.
const LAST_SIZE: f64 = 0.02;

/// Global search, followed by local searches from its best points and a pattern search from the best of all.
///
/// The local searches are those of `levenberg-marquardt` for a sum of squares and of `sqp` otherwise. The pattern
/// search reaches optima at a discontinuity; it is left out for a sum of squares. The global search ends early enough
/// to leave a fifth of the budget.
pub struct Polished {
    search: Box<dyn Solver>,
    stage: Stage,
    /// Remaining evaluations at which the global search ends.
    kept: usize,
    /// Best points of the global search, the best first, at least [`APART`].
    sites: Vec<(Vec<f64>, Merit)>,
    methods: Vec<&'static str>,
    ends: Vec<Merit>,
}

enum Stage {
    Global,
    Local(Box<Multistart>),
    Last(Box<dyn Solver>),
}

/// Starts a pattern search of small size at the best point; `None` if there is no such point.
///
/// # Errors
/// When the run ends: budget exhausted, or interrupted by the user.
pub fn pattern_at_best(oracle: &mut dyn Oracle) -> Result<Option<Box<dyn Solver>>, Halt> {
    let Some(best) = oracle.best().map(|best| best.point.clone()) else { return Ok(None) };
    let mut pattern = PatternSearchOptions { size: LAST_SIZE, ..PatternSearchOptions::default() }.local();
    pattern.begin(oracle, &best)?;
    Ok(Some(pattern))
}

impl Polished {
    /// Polishes the result of `search`, a solver of the given kind.
    pub fn new(kind: &'static str, search: Box<dyn Solver>) -> Self {
        Self { search, stage: Stage::Global, kept: 0, sites: Vec::new(), methods: vec![kind], ends: Vec::new() }
    }

    /// Starts the local searches; without a method for them, the last search.
    fn polish(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let points: Vec<Vec<f64>> = self.sites.drain(..).take(STARTS).map(|(point, _)| point).collect();
        let least_squares = LevenbergMarquardtOptions::default().local();
        let sqp = SqpOptions::default().local();
        let (kind, local) = if least_squares.accepts(oracle.shape()).is_ok() {
            (LevenbergMarquardtOptions::KIND, least_squares)
        } else if sqp.accepts(oracle.shape()).is_ok() {
            (SqpOptions::KIND, sqp)
        } else {
            return self.search_last(oracle);
        };
        let local = Multistart::new(local, 1);
        let mut local = if kind == LevenbergMarquardtOptions::KIND { local.with_local_restarts() } else { local };
        if !local.begin_at(oracle, points)? {
            return Ok(Progress::Stalled);
        }
        self.methods.push(kind);
        self.stage = Stage::Local(Box::new(local));
        Ok(Progress::Continue)
    }

    fn search_last(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(pattern) = pattern_at_best(oracle)? else { return Ok(Progress::Stalled) };
        self.methods.push(PatternSearchOptions::KIND);
        self.stage = Stage::Last(pattern);
        Ok(Progress::Continue)
    }
}

impl Solver for Polished {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        self.search.accepts(shape)
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.stage = Stage::Global;
        self.sites.clear();
        self.ends.clear();
        self.methods.truncate(1);
        self.kept = oracle.remaining() / KEPT;
        self.search.begin(&mut Remembering { oracle, sites: &mut self.sites }, start)
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        match &mut self.stage {
            Stage::Global => {
                let is_over = oracle.remaining() <= self.kept;
                let mut remembering = Remembering { oracle: &mut *oracle, sites: &mut self.sites };
                if !is_over && self.search.step(&mut remembering)? == Progress::Continue {
                    return Ok(Progress::Continue);
                }
                self.polish(oracle)
            }
            Stage::Local(local) => {
                let progress = local.step(oracle)?;
                if progress == Progress::Continue {
                    return Ok(progress);
                }
                self.ends = local.ends().to_vec();
                if self.methods.contains(&LevenbergMarquardtOptions::KIND) {
                    Ok(progress)
                } else {
                    self.search_last(oracle)
                }
            }
            Stage::Last(pattern) => pattern.step(oracle),
        }
    }

    fn members(&self) -> &[Vec<f64>] {
        self.search.members()
    }

    fn methods(&self) -> &[&'static str] {
        &self.methods
    }

    fn ends(&self) -> &[Merit] {
        match &self.stage {
            Stage::Local(local) => local.ends(),
            _ => &self.ends,
        }
    }
}

/// Oracle that remembers the best points apart.
struct Remembering<'a> {
    oracle: &'a mut dyn Oracle,
    sites: &'a mut Vec<(Vec<f64>, Merit)>,
}

impl Remembering<'_> {
    fn remember(&mut self, answer: &Evaluation) {
        let is_full = self.sites.len() >= REMEMBERED;
        let is_worse = |(_, merit): &(Vec<f64>, Merit)| !answer.merit.is_better_than(merit);
        if answer.scaled.is_none() || is_full && self.sites.last().is_some_and(is_worse) {
            return;
        }
        let is_near =
            |(point, _): &(Vec<f64>, Merit)| point.iter().zip(&answer.point).all(|(a, b)| (a - b).abs() < APART);
        if self.sites.iter().any(|site| is_near(site) && is_worse(site)) {
            return;
        }
        self.sites.retain(|site| !is_near(site));
        let place = self.sites.partition_point(is_worse);
        self.sites.insert(place, (answer.point.clone(), answer.merit));
        self.sites.truncate(REMEMBERED);
    }
}

impl Oracle for Remembering<'_> {
    fn shape(&self) -> &Shape {
        self.oracle.shape()
    }

    fn evaluate(&mut self, points: &[Vec<f64>]) -> Result<Vec<Evaluation>, Halt> {
        let answers = self.oracle.evaluate(points)?;
        answers.iter().for_each(|answer| self.remember(answer));
        Ok(answers)
    }

    fn linearise(&mut self, point: &[f64], reach: f64) -> Result<Option<Linearisation>, Halt> {
        self.oracle.linearise(point, reach)
    }

    fn best(&self) -> Option<&Evaluation> {
        self.oracle.best()
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
