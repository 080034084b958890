//! Pattern search: polls a pattern of points around the best one, and shrinks it where nothing is better.

mod barrier;
mod least;
mod models;
mod pattern;

use mops_core::{Evaluation, Halt, Oracle, Progress, Shape, Solver, SolverOptions, Stream};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::epigraph::Rows;
use crate::sqp::SqpOptions;
use crate::start::usable_start;
use crate::texture::{Texture, texture};
use barrier::{Barrier, Promise};
use least::Aim;
use models::Models;
use pattern::Pattern;

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
        Box::new(PatternSearch { options: self.clone(), state: None })
    }
}

/// The solver of the kind `pattern-search`.
struct PatternSearch {
    options: PatternSearchOptions,
    state: Option<State>,
}

struct State {
    best: Evaluation,
    /// Points with values: what the models go through.
    known: Vec<(Vec<f64>, Vec<f64>)>,
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
    /// Curvature of every row as the last models have it, per unit of the box.
    curvatures: Vec<DMatrix<f64>>,
    /// Whether the first pattern has been polled.
    polled: bool,
    /// What follows a kink inside a row, while it does.
    slopes: Option<Box<dyn Solver>>,
    /// What the best point was worth when slopes were last followed; infinite while they were not.
    followed_from: f64,
    /// What the rows are like; `None` while nobody wanted to know.
    texture: Option<Texture>,
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
        let scaled = best.scaled.clone().expect("the start is usable");
        let none = vec![vec![0.0; n]; scaled.len()];
        self.state = Some(State {
            unit: Rows::new(oracle.shape(), &scaled, &none).unit(),
            known: vec![(best.point.clone(), scaled)],
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
            curvatures: vec![DMatrix::zeros(n, n); none.len()],
            polled: false,
            slopes: None,
            followed_from: f64::INFINITY,
            texture: None,
            best,
        });
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(state) = &mut self.state else { return Ok(Progress::Stalled) };
        if state.best.point.is_empty() {
            return Ok(Progress::Converged);
        }
        if state.slopes.is_some() {
            state.follow(oracle)?;
            return Ok(Progress::Continue);
        }
        state.forget();
        if state.polled && state.search(oracle)? {
            return Ok(Progress::Continue);
        }
        let better = state.poll(oracle)?;
        state.polled = true;
        if better || state.meets_kink(oracle)? {
            return Ok(Progress::Continue);
        }
        if state.radius > self.options.tolerance && !state.is_on_finest_grid() {
            state.shrink(self.options.shrink);
            return Ok(Progress::Continue);
        }
        // The models still promise what the problem does not keep: a kink inside a row. Again, with more turns on the way.
        let worth = state.worth(oracle.shape(), &state.best);
        if state.promised > KEPT * worth.abs() && state.restarts < RESTARTS {
            state.restarts += 1;
            state.radius = self.options.shrink * self.options.size;
            return Ok(Progress::Continue);
        }
        // An infeasible end: on from the best feasible point, or with a wide pattern from here.
        if !state.best.merit.is_feasible() && state.returns < RETURNS {
            state.returns += 1;
            if let Some(best) = oracle.best().filter(|best| best.merit.is_feasible()) {
                state.adopt(best);
            }
            state.followed_from = f64::INFINITY;
            state.radius = self.options.size;
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
        if let Some(scaled) = &answer.scaled
            && !self.knows(&answer.point)
        {
            self.known.push((answer.point.clone(), scaled.clone()));
        }
    }

    /// Goes on from a point that others have found.
    fn adopt(&mut self, best: &Evaluation) {
        self.best = best.clone();
        self.barrier.saw(&best.merit);
        self.remember(best);
    }

    /// Forgets the oldest points where there are many: few of them are near.
    fn forget(&mut self) {
        let n = self.best.point.len();
        if self.known.len() > MEMORY + 2 * (n + 1) * (n + 2) {
            self.known.drain(..MEMORY);
            self.remember(&self.best.clone());
        }
    }

    /// Tries where the models are least, and beside it as much of the pattern as fills a batch; `true` while that is worth
    /// going on with, `false` when it is time to poll.
    fn search(&mut self, oracle: &mut dyn Oracle) -> Result<bool, Halt> {
        if self.spacing.iter().all(|&spacing| spacing > 0.0) {
            return Ok(false);
        }
        let near = self.near();
        let Some(models) = self.models(&near) else { return Ok(false) };
        let shape = oracle.shape();
        let (low, high) = self.room();
        let mut aim = self.aim(shape);
        let step = aim.least_violating(&models, &low, &high);
        if aim.penalty > self.penalty {
            self.penalty = aim.penalty;
            // Nothing is worth what it was.
            self.followed_from = f64::INFINITY;
        }
        let Some(y) = step else {
            self.promised = 0.0;
            return self.mend(oracle, &near, &models);
        };
        let promise = aim.promise(&models, &y);
        let weight = aim.weight();
        self.promised = aim.worth_of(&promise);
        let length = self.radius * y.amax();
        let floor = 1e-14 * self.worth(shape, &self.best).abs();
        let point = self.at(&y);
        if self.promised <= floor || point == self.best.point {
            return self.mend(oracle, &near, &models);
        }
        let points = self.filled(shape, Some(&models), vec![point]);
        let before = self.best.merit;
        let moved = self.visit(oracle, &points, Some(promise))?;
        let ratio = if moved { promise.kept(&before, &self.best.merit, weight) } else { 0.0 };
        if moved {
            self.failures = 0;
        } else if self.mend(oracle, &near, &models)? {
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

    /// Adds a point in the direction in which those around the best one tell least; `false` where they tell enough.
    fn mend(&mut self, oracle: &mut dyn Oracle, near: &[usize], models: &Models) -> Result<bool, Halt> {
        let Some(direction) = self.unknown_direction(near) else { return Ok(false) };
        let aim = self.aim(oracle.shape());
        let [up, down] = [1.0, -1.0].map(|side| &direction * side);
        let point = if aim.worth(&models.values(&up)) <= aim.worth(&models.values(&down)) { up } else { down };
        let point = self.at(&point);
        if self.knows(&point) {
            return Ok(false);
        }
        let count = self.known.len();
        let points = self.filled(oracle.shape(), Some(models), vec![point]);
        self.visit(oracle, &points, None)?;
        Ok(self.known.len() > count)
    }

    /// Polls the pattern, what looks best first; `true` when a point was better.
    fn poll(&mut self, oracle: &mut dyn Oracle) -> Result<bool, Halt> {
        self.failures = 0;
        let models = self.models(&self.near());
        let points = self.pattern(oracle.shape(), models.as_ref());
        // The first pattern is what the first models go through.
        let batch = if self.polled { self.batch } else { 0 };
        let batch = if batch == 0 { points.len().max(1) } else { batch };
        for points in points.chunks(batch) {
            let before = self.best.point.clone();
            if self.visit(oracle, points, None)? {
                self.run_on(oracle, before)?;
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Points, and as much of the pattern as fills a batch, what looks best first.
    fn filled(&self, shape: &Shape, models: Option<&Models>, mut points: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        if points.len() < self.batch {
            let room = self.batch - points.len();
            points.extend(self.pattern(shape, models).into_iter().take(room));
        }
        points
    }

    /// Unknown points of the pattern around the best one, what looks best to the models first.
    fn pattern(&self, shape: &Shape, models: Option<&Models>) -> Vec<Vec<f64>> {
        let mut points = self.pattern.points(&self.best.point, self.radius, &self.spacing);
        points.retain(|point| !self.knows(point));
        let Some(models) = models else { return points };
        let aim = self.aim(shape);
        let worth = |point: &Vec<f64>| {
            let y = DVector::from_fn(point.len(), |j, _| (point[j] - self.best.point[j]) / self.radius);
            aim.worth(&models.values(&y))
        };
        let mut ordered: Vec<(f64, Vec<f64>)> = points.into_iter().map(|point| (worth(&point), point)).collect();
        ordered.sort_by(|a, b| a.0.total_cmp(&b.0));
        ordered.into_iter().map(|(_, point)| point).collect()
    }

    fn knows(&self, point: &[f64]) -> bool {
        self.known.iter().any(|(known, _)| known == point)
    }

    /// Goes on in the direction of a success, twice as far each time, while that is better.
    fn run_on(&mut self, oracle: &mut dyn Oracle, mut before: Vec<f64>) -> Result<(), Halt> {
        loop {
            let here = self.best.point.clone();
            let mut step = DVector::from_fn(here.len(), |j, _| 2.0 * (here[j] - before[j]) / self.radius);
            let mut points: Vec<Vec<f64>> = Vec::new();
            for _ in 0..self.batch.max(1) {
                points.push(self.at(&step));
                step *= 2.0;
            }
            points.retain(|point| *point != here);
            points.dedup();
            if points.is_empty() {
                return Ok(());
            }
            // At the edge of the box few are left.
            let models = if points.len() < self.batch { self.models(&self.near()) } else { None };
            let points = self.filled(oracle.shape(), models.as_ref(), points);
            if !self.visit(oracle, &points, None)? {
                return Ok(());
            }
            before = here;
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
        self.radius *= factor.powf(0.5_f64.powi(self.restarts));
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
    fn at(&self, y: &DVector<f64>) -> Vec<f64> {
        let coordinate = |j: usize| {
            let u = (self.best.point[j] + self.radius * y[j]).clamp(0.0, 1.0);
            let spacing = self.spacing[j];
            if spacing > 0.0 { ((u / spacing).round() * spacing).min(1.0) } else { u }
        };
        (0..y.len()).map(coordinate).collect()
    }

    /// The trust region inside the box, in steps of the models.
    fn room(&self) -> (Vec<f64>, Vec<f64>) {
        let low = self.best.point.iter().map(|u| (-u / self.radius).max(-1.0)).collect();
        let high = self.best.point.iter().map(|u| ((1.0 - u) / self.radius).min(1.0)).collect();
        (low, high)
    }

    /// Known points around the best one, the nearest first: at most as many as determine a quadratic.
    fn near(&self) -> Vec<usize> {
        let n = self.best.point.len();
        let distance = |i: usize| {
            self.known[i].0.iter().zip(&self.best.point).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / self.radius
        };
        let mut near: Vec<(f64, usize)> = (0..self.known.len()).map(|i| (distance(i), i)).collect();
        near.retain(|(distance, _)| *distance <= REACH);
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.truncate((n + 1) * (n + 2) / 2);
        near.into_iter().map(|(_, i)| i).collect()
    }

    fn step_to(&self, i: usize) -> Vec<f64> {
        self.known[i].0.iter().zip(&self.best.point).map(|(a, b)| (a - b) / self.radius).collect()
    }

    /// Models through the given points, whose curvature changes as little as can be from the last ones.
    fn models(&mut self, near: &[usize]) -> Option<Models> {
        if near.len() <= self.best.point.len() {
            return None;
        }
        let steps: Vec<Vec<f64>> = near.iter().map(|&i| self.step_to(i)).collect();
        let values: Vec<&[f64]> = near.iter().map(|&i| self.known[i].1.as_slice()).collect();
        let models = Models::through(&steps, &values, &self.curvatures, self.radius)?;
        self.curvatures = models.curvatures(self.radius);
        Some(models)
    }

    /// The direction in which the points around the best one are least spread; `None` where they are spread in all.
    fn unknown_direction(&self, near: &[usize]) -> Option<DVector<f64>> {
        let n = self.best.point.len();
        let mut spread = DMatrix::zeros(n, n);
        for &i in near {
            let y = DVector::from_vec(self.step_to(i));
            let shortened = &y / y.amax().max(1.0);
            spread.ger(1.0, &shortened, &shortened, 1.0);
        }
        let eigen = SymmetricEigen::new(spread);
        let least = eigen.eigenvalues.imin();
        (eigen.eigenvalues[least] < SPREAD).then(|| eigen.eigenvectors.column(least).into_owned())
    }
}

/// Points that are forgotten at a time.
const MEMORY: usize = 200;

/// Points within this many radii take part in the models.
const REACH: f64 = 2.5;

/// A sum of squared steps along a direction below which that direction is unknown.
const SPREAD: f64 = 0.3;
