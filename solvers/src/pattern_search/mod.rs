//! Pattern search: polls a pattern of points around the best one, and shrinks it where nothing is better.

mod barrier;
mod known;
mod least;
mod models;
mod pattern;
mod points;

use mops_core::math;
use mops_core::{Evaluation, Halt, Oracle, Progress, Shape, Solver, SolverOptions, Stream};
use nalgebra::{DMatrix, DVector, DVectorView, DVectorViewMut};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::definite::factored;
use crate::rows::Rows;
use crate::sqp::SqpOptions;
use crate::start::usable_start;
use crate::texture::{Texture, texture};
use barrier::{Barrier, Promise};
use known::Known;
use least::{Aim, Least};
use models::Models;
use pattern::Pattern;
use points::Points;

/// Mesh-adaptive direct search on the unit box: points of a pattern are polled around the best one, those first that look
/// best; a better one is taken, else the pattern shrinks and turns. Ends at a mesh size. Needs no slopes: for criteria that
/// jump, for noise, and for tuners with whole numbers or lists.
///
/// Before it polls, it searches: every row has a quadratic model of its own through the points around the best one, and the
/// point where the largest of the models is least is tried, inside a trust region. So the kink where two criteria meet is
/// seen. Constraints are kept by a progressive barrier: objective and violation are judged apart, and what may be violated
/// falls as the search goes on.
///
/// Where neither models nor pattern lead on although the models promise much, a row has kinks of its own: unless its values
/// are noise, slopes by differences are followed from there (as `sqp` does), as long as they lead on.
///
/// Source: C. Audet, J. E. Dennis, SIAM J. Optimization 17 (2006) 188-217 (MADS); turned patterns: M. A. Abramson, C. Audet,
/// J. E. Dennis, S. Le Digabel, SIAM J. Optimization 20 (2009) 948-966; models: A. R. Conn, K. Scheinberg, L. N. Vicente,
/// Introduction to Derivative-Free Optimization (SIAM 2009), chapters 5 and 10; one for every row: J. Larson, M. Menickelly,
/// S. M. Wild, SIAM J. Optimization 26 (2016) 2540-2563; barrier: C. Audet, J. E. Dennis, SIAM J. Optimization 20 (2009)
/// 445-472.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct PatternSearchOptions {
    /// First distance of the pattern's points, in the unit box.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub size: f64,
    /// Distance at which the search ends.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance: f64,
    /// Factor of the pattern's size where nothing in it is better. Less leads to the end sooner; more polls more often.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub shrink: f64,
    /// Points that are evaluated at once: of a pattern, and beside a step of the models; 0 for whole patterns.
    #[schemars(range(max = 10_000))]
    pub batch: usize,
}

impl Default for PatternSearchOptions {
    fn default() -> Self {
        Self { size: 0.1, tolerance: 1e-7, shrink: 0.5, batch: 2 }
    }
}

impl SolverOptions for PatternSearchOptions {
    const KIND: &'static str = "pattern-search";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(PatternSearch { options: self.clone(), state: None, room: Room::default() })
    }
}

/// The solver of the kind `pattern-search`.
struct PatternSearch {
    options: PatternSearchOptions,
    state: Option<State>,
    room: Room,
}

/// Models of the rows, and memory that is used again from step to step.
#[derive(Default)]
struct Room {
    models: Models,
    least: Least,
    /// The known points around the best one, with their distances.
    near: Vec<(f64, usize)>,
    /// The trust region inside the box, in steps of the models.
    low: Vec<f64>,
    high: Vec<f64>,
    /// Unknown points of the pattern, and their order: what looks best first.
    pattern: Points,
    order: Vec<(f64, usize)>,
    /// Points to ask for.
    asked: Points,
    step: Vec<f64>,
    values: Vec<f64>,
    /// Where the search stood.
    before: Vec<f64>,
    spread: Vec<f64>,
}

struct State {
    best: Evaluation,
    known: Known,
    /// Size of the pattern and of the trust region.
    radius: f64,
    /// What the models promised at last.
    promised: f64,
    /// Times that the search began again because of a kink.
    restarts: i32,
    /// Times that the search went back from an infeasible end.
    returns: usize,
    /// Steps of the models in a row that led nowhere.
    failures: usize,
    /// The best point at the last turn of the pattern.
    turned_at: Option<Vec<f64>>,
    /// Weight of the violation in the models' objective.
    penalty: f64,
    /// What may be moved to.
    barrier: Barrier,
    unit: f64,
    pattern: Pattern,
    /// Points that are evaluated at once; 0 for whole patterns.
    batch: usize,
    random: Stream,
    spacing: Vec<f64>,
    /// Whether the first pattern has been polled.
    polled: bool,
    /// What follows a kink inside a row, while it does.
    slopes: Option<Box<dyn Solver>>,
    /// What the best point was worth when slopes were last followed; infinite while they were not.
    followed_from: f64,
    /// What the rows are like; `None` while nobody wanted to know.
    texture: Option<Texture>,
}

impl Room {
    /// Adds up to `count` points of the pattern to what is asked, in their order, from the one at `first` on.
    fn ask(&mut self, first: usize, count: usize) {
        for &(_, i) in self.order.iter().skip(first).take(count) {
            self.asked.push(self.pattern.as_slice()[i].iter().copied());
        }
    }
}

impl Solver for PatternSearch {
    fn accepts(&self, _: &Shape) -> Result<(), String> {
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.state = None;
        let Some(start) = usable_start(oracle, start)? else { return Ok(()) };
        let best = oracle.evaluate(&[start])?.pop().expect("one point, one answer");
        let n = best.point.len();
        let scaled = best.scaled.as_ref().expect("the start is usable");
        let mut known = Known::new(n, scaled.len());
        known.remember(&best.point, scaled);
        self.room = Room { models: Models::new(n, scaled.len()), ..Room::default() };
        self.state = Some(State {
            unit: Rows::of_values(oracle.shape(), scaled).unit(),
            known,
            turned_at: None,
            radius: self.options.size,
            failures: 0,
            promised: 0.0,
            restarts: 0,
            returns: 0,
            penalty: 10.0,
            barrier: Barrier::at(&best.merit),
            pattern: Pattern::straight(n),
            batch: self.options.batch,
            random: oracle.stream("pattern-search"),
            spacing: oracle.shape().spacing.clone(),
            polled: false,
            slopes: None,
            followed_from: f64::INFINITY,
            texture: None,
            best,
        });
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Self { options, state, room } = self;
        let Some(state) = state else { return Ok(Progress::Stalled) };
        if state.best.point.is_empty() {
            return Ok(Progress::Converged);
        }
        if state.slopes.is_some() {
            state.follow(oracle)?;
            return Ok(Progress::Continue);
        }
        state.forget();
        if state.polled && state.search(oracle, room)? {
            return Ok(Progress::Continue);
        }
        let better = state.poll(oracle, room)?;
        state.polled = true;
        if better || state.meets_kink(oracle)? {
            return Ok(Progress::Continue);
        }
        if state.radius > options.tolerance && !state.is_on_finest_grid() {
            state.shrink(options.shrink);
            return Ok(Progress::Continue);
        }
        // The models still promise what the problem does not keep: a kink inside a row. Again, with more turns on the way.
        let worth = state.worth(oracle.shape(), &state.best);
        if state.promised > KEPT * worth.abs() && state.restarts < RESTARTS {
            state.restarts += 1;
            state.radius = options.shrink * options.size;
            return Ok(Progress::Continue);
        }
        // An infeasible end: on from the best feasible point, or with a wide pattern from here.
        if !state.best.merit.is_feasible() && state.returns < RETURNS {
            state.returns += 1;
            if let Some(best) = oracle.best().filter(|best| best.merit.is_feasible()) {
                state.adopt(best);
            }
            state.followed_from = f64::INFINITY;
            state.radius = options.size;
            return Ok(Progress::Continue);
        }
        Ok(if state.best.merit.is_feasible() { Progress::Converged } else { Progress::Stalled })
    }
}

/// A promise at the end, relative to what the best point is worth, that tells of a kink.
const KEPT: f64 = 1e-10;

/// The same while the search goes on.
const BROKEN: f64 = 1e-4;

/// First radius of the steps along slopes, in those of the pattern.
const FOLLOWED: f64 = 3.0;

/// Times that the search begins again because of a kink.
const RESTARTS: i32 = 4;

/// Times that the search goes back from an infeasible end.
const RETURNS: usize = 3;

/// Steps of the models in a row that lead nowhere before the pattern is polled.
const FAILURES: usize = 2;

impl State {
    fn aim<'a>(&self, shape: &'a Shape) -> Aim<'a> {
        Aim { shape, unit: self.unit, penalty: self.penalty }
    }

    fn worth(&self, shape: &Shape, evaluation: &Evaluation) -> f64 {
        evaluation.scaled.as_ref().map_or(f64::INFINITY, |scaled| self.aim(shape).worth(scaled))
    }

    /// Evaluates points, keeps their values, and moves to the best if the barrier admits it; `true` when it moved. What is
    /// promised is promised of the first point.
    fn visit(&mut self, oracle: &mut dyn Oracle, points: &[Vec<f64>], promise: Option<Promise>) -> Result<bool, Halt> {
        let before = self.best.merit;
        let mut moved = false;
        for (index, answer) in oracle.evaluate(points)?.into_iter().enumerate() {
            self.remember(&answer);
            if self.barrier.admits(&self.best.merit, &answer.merit, promise.filter(|_| index == 0)) {
                self.barrier.saw(&answer.merit);
                self.best = answer;
                moved = true;
            }
        }
        if moved {
            self.barrier.lower(&before, &self.best.merit);
        }
        Ok(moved)
    }

    fn remember(&mut self, answer: &Evaluation) {
        if let Some(scaled) = &answer.scaled {
            self.known.remember(&answer.point, scaled);
        }
    }

    /// Goes on from a point that others have found.
    fn adopt(&mut self, best: &Evaluation) {
        self.best = best.clone();
        self.barrier.saw(&best.merit);
        self.remember(best);
    }

    /// Forgets the oldest points where there are many.
    fn forget(&mut self) {
        if self.known.forget()
            && let Some(scaled) = &self.best.scaled
        {
            self.known.remember(&self.best.point, scaled);
        }
    }

    /// Tries where the models are least, and beside it as much of the pattern as fills a batch; `true` while that is worth
    /// going on with, `false` when it is time to poll.
    fn search(&mut self, oracle: &mut dyn Oracle, room: &mut Room) -> Result<bool, Halt> {
        if self.spacing.iter().all(|&spacing| spacing > 0.0) || !self.fit(room) {
            return Ok(false);
        }
        let shape = oracle.shape();
        let mut aim = self.aim(shape);
        let found = self.least(&mut aim, room);
        if aim.penalty > self.penalty {
            self.penalty = aim.penalty;
            // Nothing is worth what it was.
            self.followed_from = f64::INFINITY;
        }
        if !found {
            self.promised = 0.0;
            return self.mend(oracle, room);
        }
        let promise = aim.promise(room.models.constants(), room.least.values());
        let weight = aim.weight();
        self.promised = aim.worth_of(&promise);
        let y = room.least.step();
        let length = self.radius * y.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
        let floor = 1e-14 * self.worth(shape, &self.best).abs();
        room.asked.clear();
        room.asked.push(self.at(y));
        if self.promised <= floor || room.asked.as_slice()[0] == self.best.point {
            return self.mend(oracle, room);
        }
        self.fill(shape, room);
        let before = self.best.merit;
        let moved = self.visit(oracle, room.asked.as_slice(), Some(promise))?;
        let ratio = if moved { promise.kept(&before, &self.best.merit, weight) } else { 0.0 };
        if moved {
            self.failures = 0;
        } else if self.mend(oracle, room)? {
            // The models were wrong for want of points.
            return Ok(true);
        } else {
            self.failures += 1;
        }
        if ratio >= 0.7 {
            self.radius = self.radius.max((2.0 * length).min(0.5));
        } else if ratio < 0.1 {
            self.radius = self.radius.min(length).max(0.1 * self.radius);
        }
        Ok(self.failures < FAILURES)
    }

    /// Lays models through the known points around the best one; `false` where these do not determine them.
    fn fit(&self, room: &mut Room) -> bool {
        self.known.near(&self.best.point, self.radius, &mut room.near);
        room.models.fit(&self.known, &room.near, &self.best.point, self.radius)
    }

    /// Finds where the models are least, in the trust region and inside the box.
    fn least(&self, aim: &mut Aim, room: &mut Room) -> bool {
        room.low.clear();
        room.low.extend(self.best.point.iter().map(|u| (-u / self.radius).max(-1.0)));
        room.high.clear();
        room.high.extend(self.best.point.iter().map(|u| ((1.0 - u) / self.radius).min(1.0)));
        room.least.find(aim, &room.models, &room.low, &room.high)
    }

    /// Adds a point in the direction in which those that the models go through tell least; `false` where they tell enough.
    fn mend(&mut self, oracle: &mut dyn Oracle, room: &mut Room) -> Result<bool, Halt> {
        let Room { models, step, values, spread, .. } = &mut *room;
        if !find_unknown(models, self.best.point.len(), spread, step) {
            return Ok(false);
        }
        let aim = self.aim(oracle.shape());
        let mut worth = |step: &[f64]| {
            models.values(step, values);
            aim.worth(values)
        };
        let there = worth(step);
        step.iter_mut().for_each(|d| *d = -*d);
        if there <= worth(step) {
            step.iter_mut().for_each(|d| *d = -*d);
        }
        room.asked.clear();
        room.asked.push(self.at(&room.step));
        if self.known.contains(&room.asked.as_slice()[0]) {
            return Ok(false);
        }
        let count = self.known.len();
        self.fill(oracle.shape(), room);
        self.visit(oracle, room.asked.as_slice(), None)?;
        Ok(self.known.len() > count)
    }

    /// Polls the pattern, what looks best first; `true` when a point was better.
    fn poll(&mut self, oracle: &mut dyn Oracle, room: &mut Room) -> Result<bool, Halt> {
        self.failures = 0;
        self.fit(room);
        self.lay_pattern(oracle.shape(), room);
        let count = room.order.len();
        // The first pattern is what the first models go through.
        let batch = if self.polled && self.batch > 0 { self.batch } else { count.max(1) };
        for first in (0..count).step_by(batch) {
            room.asked.clear();
            room.ask(first, batch);
            room.before.clone_from(&self.best.point);
            if self.visit(oracle, room.asked.as_slice(), None)? {
                self.run_on(oracle, room)?;
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Adds as much of the pattern to what is asked as fills a batch, what looks best first.
    fn fill(&self, shape: &Shape, room: &mut Room) {
        if room.asked.len() < self.batch {
            self.lay_pattern(shape, room);
            room.ask(0, self.batch - room.asked.len());
        }
    }

    /// Collects the unknown points of the pattern around the best one, in the order in which they look best to the models, if
    /// these were fitted.
    fn lay_pattern(&self, shape: &Shape, room: &mut Room) {
        let Room { models, pattern, order, step, values, .. } = room;
        self.pattern.points(&self.best.point, self.radius, &self.spacing, pattern);
        let aim = self.aim(shape);
        order.clear();
        for (i, point) in pattern.as_slice().iter().enumerate() {
            if self.known.contains(point) {
                continue;
            }
            if models.are_fitted() {
                step.clear();
                step.extend(point.iter().zip(&self.best.point).map(|(a, b)| (a - b) / self.radius));
                models.values(step, values);
                order.push((aim.worth(values), i));
            } else {
                order.push((0.0, i));
            }
        }
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }

    /// Goes on in the direction of a success, twice as far each time, while that is better.
    fn run_on(&mut self, oracle: &mut dyn Oracle, room: &mut Room) -> Result<(), Halt> {
        loop {
            let here = &self.best.point;
            room.step.clear();
            room.step.extend(here.iter().zip(&room.before).map(|(here, before)| 2.0 * (here - before) / self.radius));
            room.asked.clear();
            for _ in 0..self.batch.max(1) {
                let is_new = |point: &[f64], before: &[Vec<f64>]| {
                    point != here && before.last().is_none_or(|last| point != last)
                };
                room.asked.push_if(self.at(&room.step), is_new);
                room.step.iter_mut().for_each(|step| *step *= 2.0);
            }
            if room.asked.len() == 0 {
                return Ok(());
            }
            room.before.clone_from(here);
            // At the edge of the box few are left.
            if room.asked.len() < self.batch {
                self.fit(room);
                self.fill(oracle.shape(), room);
            }
            if !self.visit(oracle, room.asked.as_slice(), None)? {
                return Ok(());
            }
        }
    }

    /// Begins to follow slopes where the models promise what the problem does not keep; `false` where that is not so, where
    /// slopes led nowhere the last time, and where they would tell of noise.
    fn meets_kink(&mut self, oracle: &mut dyn Oracle) -> Result<bool, Halt> {
        let worth = self.worth(oracle.shape(), &self.best);
        let promising = self.promised > BROKEN * worth.abs();
        let led_on = self.followed_from - worth > BROKEN * worth.abs();
        if !promising || !led_on || self.spacing.iter().any(|&spacing| spacing > 0.0) {
            return Ok(false);
        }
        if self.texture.is_none() {
            self.texture = Some(texture(oracle, &self.best.point)?);
        }
        if self.texture == Some(Texture::Noisy) {
            return Ok(false);
        }
        let mut slopes = SqpOptions { radius: FOLLOWED * self.radius, ..Default::default() }.build();
        slopes.begin(oracle, &self.best.point)?;
        self.slopes = Some(slopes);
        self.followed_from = worth;
        Ok(true)
    }

    /// A step along slopes.
    fn follow(&mut self, oracle: &mut dyn Oracle) -> Result<(), Halt> {
        let Some(slopes) = &mut self.slopes else { return Ok(()) };
        if slopes.step(oracle)? != Progress::Continue {
            self.slopes = None;
        }
        let shape = oracle.shape();
        if let Some(best) = oracle.best()
            && self.worth(shape, best) < self.worth(shape, &self.best)
        {
            self.adopt(best);
        }
        Ok(())
    }

    /// Shrinks and turns the pattern; by less after every restart.
    fn shrink(&mut self, factor: f64) {
        self.radius *= math::powf(factor, math::powi(0.5, self.restarts));
        // Where the search went tells where it may go on.
        match self.turned_at.replace(self.best.point.clone()) {
            Some(before) if before != self.best.point => {
                let went = DVector::from_fn(before.len(), |j, _| self.best.point[j] - before[j]);
                self.pattern.align(&went);
            }
            _ => self.pattern.turn(&mut self.random),
        }
    }

    fn is_on_finest_grid(&self) -> bool {
        self.spacing.iter().all(|&spacing| spacing > 0.0 && self.radius < 0.5 * spacing)
    }

    /// The point after a step of the models, inside the box and on the grids.
    fn at(&self, y: &[f64]) -> impl Iterator<Item = f64> {
        let coordinate = |j: usize| {
            let u = (self.best.point[j] + self.radius * y[j]).clamp(0.0, 1.0);
            let spacing = self.spacing[j];
            if spacing > 0.0 { ((u / spacing).round() * spacing).min(1.0) } else { u }
        };
        (0..y.len()).map(coordinate)
    }
}

/// Finds the direction in which the points that the models go through are least spread, by inverse iteration; `false` where
/// they are spread in all. It begins along no coordinate, and where two directions are spread about as little finds one between
/// them.
///
/// Source: G. H. Golub, C. F. Van Loan, Matrix Computations, 4th edition (2013), section 7.6.1.
fn find_unknown(models: &Models, n: usize, memory: &mut Vec<f64>, direction: &mut Vec<f64>) -> bool {
    let spread = |spread: &mut DMatrix<f64>| {
        spread.fill_diagonal(REGULARISED);
        for y in models.steps() {
            let length = y.iter().fold(1.0_f64, |most, y| most.max(y.abs()));
            let y = DVectorView::from_slice(y, n);
            spread.ger(1.0 / (length * length), &y, &y, 1.0);
        }
    };
    direction.clear();
    direction.extend((0..n).map(|j| 1.0 / (1.0 + j as f64)));
    let mut direction = DVectorViewMut::from_slice(direction, n);
    let least = factored(memory, n, spread, |factor| {
        let mut least = f64::INFINITY;
        for _ in 0..INVERSE_ITERATIONS {
            factor.solve_mut(&mut direction);
            least = 1.0 / direction.norm();
            direction *= least;
        }
        least
    });
    least.is_some_and(|least| least < SPREAD)
}

/// Inverse iterations for an unknown direction: enough where the next spread is twice as large, for six figures.
const INVERSE_ITERATIONS: usize = 20;

/// What is added to all sums of squared steps, so that their matrix has an inverse.
const REGULARISED: f64 = 1e-9;

/// A sum of squared steps along a direction below which that direction is unknown.
const SPREAD: f64 = 0.3;

#[cfg(test)]
mod tests {
    use super::models::tests::through;
    use super::*;

    #[test]
    fn the_direction_across_points_near_a_line_is_unknown() {
        let flat = |_: &[f64; 2]| vec![1.0];
        let along = through(&[[0.0, 0.0], [1.0, 0.5], [-1.0, -0.5], [0.5, 0.3]], flat);
        let (mut memory, mut direction) = (Vec::new(), Vec::new());
        assert!(find_unknown(&along, 2, &mut memory, &mut direction));
        assert!(
            (2.0 * direction[0] + direction[1]).abs() < 0.1 && math::hypot(direction[0], direction[1]) > 0.999,
            "{direction:?}"
        );
        let around = through(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], flat);
        assert!(!find_unknown(&around, 2, &mut memory, &mut direction));
    }
}
