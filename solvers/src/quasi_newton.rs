//! The BFGS method with a line search, for one row that may have kinks.

use mops_core::{Halt, Linearisation, Objective, Oracle, Progress, Shape, Solver, Usage};
use nalgebra::{DMatrix, DVector};

use crate::rows::Rows;
use crate::start::usable_start;

/// BFGS for one number without constraints: `auto` takes it where that is all there is. Its line search meets the weak
/// conditions of Wolfe, which have a solution at kinks too; curvature across a kink grows without bound, and that is what
/// makes the steps follow it. Coordinates at a bound that the slope leads out of are held there.
///
/// Source: A. S. Lewis, M. L. Overton, Nonsmooth optimization via quasi-Newton methods, Mathematical Programming 141 (2013)
/// 135-163, algorithms 2.1 and 2.6.
///
/// N.B.: a first step, of which no length is known, must keep more of the decrease that its slope promises, and a step of
/// which next to nothing is promised need not meet the condition on slopes.
#[derive(Default)]
pub struct QuasiNewton {
    state: Option<State>,
    /// Whether it ends where little more is to be had.
    rough: bool,
}

impl QuasiNewton {
    /// One that ends where steps bring less than a millionth of the value; with [`QuasiNewton::refine`] it goes on.
    pub fn rough() -> Self {
        Self { rough: true, ..Self::default() }
    }

    /// Goes on to the end.
    pub fn refine(&mut self) {
        self.rough = false;
        if let Some(state) = &mut self.state {
            state.idle = 0;
        }
    }
}

struct State {
    at: Linearisation,
    value: f64,
    slope: DVector<f64>,
    /// The inverse of the Hessian.
    inverse: DMatrix<f64>,
    /// Whether the inverse has seen a step yet.
    learned: bool,
    /// Distance within which slopes are to describe the row.
    reach: f64,
    /// Value at which the inverse was last thrown away.
    fresh_at: f64,
    /// Iterations in a row that brought almost nothing.
    idle: usize,
    /// Steps in a row that have met a kink, by the look of their ends.
    kinks: usize,
}

/// Share of the promised decrease that a step must keep.
const ENOUGH: f64 = 1e-4;

/// The same of a step whose length nothing is known of: a longer one may lead over a valley to where all is flat, as on the
/// problem Osborne 1. The step to the minimum of a parabola keeps one half.
const AT_FIRST: f64 = 0.3;

/// Share of the slope that may be left after a step.
const LEFT: f64 = 0.9;

/// Length of the first step, in the unit box.
const FIRST: f64 = 0.05;

/// Values tried along a direction at most.
const TRIALS: usize = 40;

/// Distances within which slopes are to describe the row, in turn: wide, then as near as kinks ask for.
const REACH: [f64; 2] = [1.0, 1e-6];

/// Relative change of the value that is none; so many in a row are the end.
const IDLE: f64 = 1e-11;
const MOST_IDLE: usize = 4;

/// The same of a rough end: most studies ask for three or four figures.
const IDLE_ROUGHLY: f64 = 1e-6;
const MOST_IDLE_ROUGHLY: usize = 2;

/// Share of the change of the slope along a step by which the trapezoid rule is off beyond a kink; for smooth rows it is far
/// less. So many such steps in a row are left to those who look for kinks.
const OFF: f64 = 0.12;
const MOST_KINKS: usize = 3;

impl Solver for QuasiNewton {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        let minimised = shape.rows.iter().filter(|(usage, _)| *usage == Usage::Minimise).count();
        let one = minimised == 1 || (minimised > 1 && shape.objective == Objective::Sum);
        let smooth = shape.spacing.iter().all(|&spacing| spacing == 0.0);
        if one && smooth && !shape.has_constraints() {
            return Ok(());
        }
        Err("it minimises one number without constraints over real tuners; take `sqp`".into())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.state = None;
        let Some(start) = usable_start(oracle, start)? else { return Ok(()) };
        let Some(at) = oracle.linearise(&start, REACH[0])? else { return Ok(()) };
        let (value, slope) = row(oracle.shape(), &at);
        let n = start.len();
        let inverse = DMatrix::zeros(n, n);
        let mut state = State {
            at,
            value,
            slope,
            inverse,
            learned: false,
            reach: REACH[0],
            fresh_at: f64::INFINITY,
            idle: 0,
            kinks: 0,
        };
        state.forget();
        self.state = Some(state);
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(state) = &mut self.state else { return Ok(Progress::Stalled) };
        if state.at.at.point.is_empty() {
            return Ok(Progress::Converged);
        }
        let direction = state.direction();
        let steepness = -state.slope.dot(&direction);
        let is_level = steepness <= IDLE * IDLE * state.value.abs() || !steepness.is_finite();
        if !is_level && state.kinks >= MOST_KINKS {
            return Ok(Progress::Stalled);
        }
        let before = state.value;
        let (idle, most) = if self.rough { (IDLE_ROUGHLY, MOST_IDLE_ROUGHLY) } else { (IDLE, MOST_IDLE) };
        if !is_level && state.search(oracle, &direction, steepness)? {
            state.idle = if before - state.value <= idle * before.abs() { state.idle + 1 } else { 0 };
            if state.idle < most {
                return Ok(Progress::Continue);
            }
        }
        if self.rough { Ok(Progress::Converged) } else { state.renew(oracle) }
    }
}

/// The value and the slope of the one row.
fn row(shape: &Shape, at: &Linearisation) -> (f64, DVector<f64>) {
    let row = Rows::of(shape, at).objectives.swap_remove(0);
    (row.value, DVector::from_vec(row.slope))
}

impl State {
    /// Curvature before anything is known: a first step of a given length.
    fn forget(&mut self) {
        let n = self.slope.len();
        self.inverse = DMatrix::identity(n, n) * (FIRST / self.slope.amax().max(f64::MIN_POSITIVE));
        self.learned = false;
        self.idle = 0;
    }

    /// Whether a bound holds a coordinate.
    fn is_held(&self, j: usize) -> bool {
        let (u, s) = (self.at.at.point[j], self.slope[j]);
        (u <= 0.0 && s > 0.0) || (u >= 1.0 && s < 0.0)
    }

    /// The slope along the coordinates that no bound holds.
    fn free_slope(&self) -> DVector<f64> {
        DVector::from_fn(self.slope.len(), |j, _| if self.is_held(j) { 0.0 } else { self.slope[j] })
    }

    /// The quasi-Newton step along the same.
    fn direction(&self) -> DVector<f64> {
        let step = -(&self.inverse * self.free_slope());
        DVector::from_fn(step.len(), |j, _| if self.is_held(j) { 0.0 } else { step[j] })
    }

    /// The largest part of a direction inside the box.
    fn room(&self, direction: &DVector<f64>) -> f64 {
        let room = |(u, d): (&f64, &f64)| match d {
            d if *d > 0.0 => (1.0 - u) / d,
            d if *d < 0.0 => -u / d,
            _ => f64::INFINITY,
        };
        self.at.at.point.iter().zip(direction.iter()).map(room).fold(f64::INFINITY, f64::min)
    }

    /// Moves along a direction to where the weak conditions of Wolfe hold, or as far as the box goes; `false` where nothing
    /// along it is better.
    fn search(&mut self, oracle: &mut dyn Oracle, direction: &DVector<f64>, steepness: f64) -> Result<bool, Halt> {
        let room = self.room(direction);
        let (mut low, mut high) = (0.0, f64::INFINITY);
        let mut t = 1.0_f64.min(room);
        let mut reached: Option<(Linearisation, f64, DVector<f64>)> = None;
        for _ in 0..TRIALS {
            if t <= 0.0 {
                break;
            }
            let point: Vec<f64> =
                self.at.at.point.iter().zip(direction.iter()).map(|(u, d)| (u + t * d).clamp(0.0, 1.0)).collect();
            if point == self.at.at.point {
                break;
            }
            let answer = oracle.evaluate(std::slice::from_ref(&point))?.pop().expect("one point, one answer");
            let value = answer.scaled.as_ref().map_or(f64::INFINITY, |_| answer.merit.objective);
            let enough = if self.learned { ENOUGH } else { AT_FIRST };
            if !(value <= self.value - enough * t * steepness && value < self.value) {
                high = t;
                // Where the parabola through both values has its minimum; halfway where a step before was good.
                let parabola = 0.5 * t * t * steepness / (value - self.value + t * steepness);
                let inner = if parabola.is_finite() { parabola.clamp(0.1 * t, 0.5 * t) } else { 0.1 * t };
                t = if low > 0.0 { 0.5 * (low + high) } else { inner };
                continue;
            }
            let Some(at) = oracle.linearise(&point, self.reach)? else {
                high = t;
                t = 0.5 * (low + high);
                continue;
            };
            let (value, slope) = row(oracle.shape(), &at);
            let left = -slope.dot(direction);
            reached = Some((at, value, slope));
            // Of what is promised next to nothing, slopes by differences tell nothing either.
            if left <= LEFT * steepness || t >= room || t * steepness <= IDLE * value.abs() {
                break;
            }
            low = t;
            t = if high.is_finite() { 0.5 * (low + high) } else { (2.0 * t).min(room) };
        }
        let Some((at, value, slope)) = reached else { return Ok(false) };
        let s = DVector::from_fn(slope.len(), |j, _| at.at.point[j] - self.at.at.point[j]);
        let y = &slope - &self.slope;
        let off = value - self.value - 0.5 * (&slope + &self.slope).dot(&s);
        self.kinks = if off.abs() > OFF * y.dot(&s).abs() { self.kinks + 1 } else { 0 };
        (self.at, self.value, self.slope) = (at, value, slope);
        self.learn(&s, &y);
        Ok(true)
    }

    /// Takes in a step and the change of the slope along it.
    fn learn(&mut self, s: &DVector<f64>, y: &DVector<f64>) {
        let sy = s.dot(y);
        if sy <= 1e-14 * s.norm() * y.norm() {
            return;
        }
        let n = s.len();
        if !self.learned {
            self.inverse = DMatrix::identity(n, n) * (sy / y.norm_squared());
            self.learned = true;
        }
        let hy = &self.inverse * y;
        let factor = (1.0 + y.dot(&hy) / sy) / sy;
        self.inverse.ger(factor, s, s, 1.0);
        self.inverse.ger(-1.0 / sy, s, &hy, 1.0);
        self.inverse.ger(-1.0 / sy, &hy, s, 1.0);
        if self.inverse.iter().any(|h| !h.is_finite()) {
            self.forget();
        }
    }

    /// Nothing along the direction is better: once more from here with slopes of the neighbourhood and no memory, as long as
    /// that has brought something since the last time.
    fn renew(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let gained = self.fresh_at.is_infinite() || self.fresh_at - self.value > 1e-8 * self.value.abs();
        if !gained {
            // The memory of a kink makes short steps: only the slope tells.
            let stationary = self.free_slope().amax() <= 1e-4 * self.value.abs();
            return Ok(if stationary { Progress::Converged } else { Progress::Stalled });
        }
        self.fresh_at = self.value;
        self.reach = REACH[1];
        let point = self.at.at.point.clone();
        let Some(at) = oracle.linearise(&point, self.reach)? else { return Ok(Progress::Stalled) };
        (self.value, self.slope) = row(oracle.shape(), &at);
        self.at = at;
        self.forget();
        self.inverse *= 0.02;
        Ok(Progress::Continue)
    }
}
