//! Accepted step and its dense output.

use mops_language::{
    Scalar,
    enclosure::{Enclosure, Interval},
};

use super::by_size::by_size;

/// Accepted step from `start` to `start + taken`, with its dense output.
pub struct Step<S> {
    /// Start time of the step, s.
    pub start: f64,
    /// Length of the step for which the dense output was computed, s.
    pub length: f64,
    /// Length of the valid part of the step, s: less than `length` if an event ended the step.
    pub taken: f64,
    /// Valid part of the step as a fraction of `length`.
    pub(super) share: f64,
    /// Coefficients `r0 .. r4` of [`Step::at`], each for all states.
    pub(super) dense: [Vec<S>; 5],
    /// True if inputs may jump at the start of a step before the simulation.
    pub(super) restarts: bool,
}

impl<S: Scalar> Step<S> {
    pub(super) fn new(x: &[S]) -> Self {
        Self {
            start: 0.0,
            length: 0.0,
            taken: 0.0,
            share: 1.0,
            dense: std::array::from_fn(|_| x.to_vec()),
            restarts: false,
        }
    }

    /// Creates a step before the simulation, at whose start inputs may jump: the state rests.
    pub(super) fn resting(x: &[S], [start, end]: [f64; 2]) -> Self {
        let mut step = Self::new(x);
        step.dense[1..].iter_mut().flatten().for_each(|coefficient| *coefficient = S::from(0.0));
        step.begin(start, end - start);
        Self { restarts: true, ..step }
    }

    /// Starts a new step, valid over its full length.
    #[inline]
    pub(super) fn begin(&mut self, start: f64, length: f64) {
        (self.start, self.length, self.taken, self.share) = (start, length, length, 1.0);
    }

    /// Ends the step by an event at the fraction `share` of its length.
    pub(super) fn end_at(&mut self, share: f64) {
        (self.taken, self.share) = (share * self.length, share);
    }

    /// Returns the time at the fraction `theta` of the step length, s.
    #[inline]
    pub(super) fn time(&self, theta: f64) -> f64 {
        self.start + theta * self.length
    }

    /// Returns the state at `start + s taken`, `s` in [0, 1].
    pub fn state_at(&self, s: f64) -> Vec<S> {
        let mut x = self.dense[0].clone();
        self.state(s, &mut x);
        x
    }

    /// Writes the state at `start + s taken`, `s` in [0, 1], to `x`.
    #[inline]
    pub fn state(&self, s: f64, x: &mut [S]) {
        self.at(s * self.share, x);
    }

    /// Writes the states at the fractions `nodes` of the valid part of the step.
    pub(super) fn states<const K: usize>(&self, nodes: &[f64; K], states: &mut [Vec<S>; K]) {
        self.states_at(&nodes.map(|s| s * self.share), states);
    }

    /// Writes the states at the fractions `thetas` of the step length.
    pub(super) fn states_at<const K: usize>(&self, thetas: &[f64; K], states: &mut [Vec<S>; K]) {
        by_size!(self.dense[0].len(), S, N => states_of::<S, N>(&self.dense, thetas, states));
    }

    /// Returns one component of [`Step::state`].
    #[inline(always)]
    pub(super) fn component(&self, s: f64, i: usize) -> S {
        let [r0, r1, r2, r3, r4] = &self.dense;
        value([r0[i], r1[i], r2[i], r3[i], r4[i]], s * self.share)
    }

    /// Writes the state at `start + theta length` to `x`:
    /// `r0 + theta (r1 + (1 - theta)(r2 + theta (r3 + (1 - theta) r4)))`.
    #[inline]
    pub(super) fn at(&self, theta: f64, x: &mut [S]) {
        by_size!(x.len(), S, N => state_of::<S, N>(&self.dense, theta, x));
    }

    /// Computes bounds of all components and of their rates between the fractions `from` and `to` of the step length.
    pub fn enclose(&self, from: f64, to: f64, bounds: &mut Vec<Enclosure>) {
        let (m, radius) = (0.5 * (from + to), 0.5 * (to - from));
        let per_second = Interval::point(1.0 / self.length);
        bounds.clear();
        bounds.extend((0..self.dense[0].len()).map(|i| {
            let [r0, r1, r2, r3, r4] = &self.dense;
            let dense = [r0[i], r1[i], r2[i], r3[i], r4[i]];
            let Enclosure { value, rate } = Enclosure::of_polynomial(&taylor(dense.map(|r| r.value()), m), radius);
            Enclosure { value, rate: rate * per_second }
        }));
    }
}

#[inline(always)]
fn states_of<S: Scalar, const N: usize>(dense: &[Vec<S>; 5], thetas: &[f64], states: &mut [Vec<S>]) {
    for (state, &theta) in states.iter_mut().zip(thetas) {
        state_of::<S, N>(dense, theta, state);
    }
}

/// Evaluates the dense output of `N` states; `N = 0` means any number.
#[inline(always)]
fn state_of<S: Scalar, const N: usize>([r0, r1, r2, r3, r4]: &[Vec<S>; 5], theta: f64, x: &mut [S]) {
    let n = if N == 0 { x.len() } else { N };
    let (x, r0, r1, r2, r3, r4) = (&mut x[..n], &r0[..n], &r1[..n], &r2[..n], &r3[..n], &r4[..n]);
    if theta == 0.0 {
        return x.copy_from_slice(r0);
    }
    for j in 0..n {
        x[j] = value([r0[j], r1[j], r2[j], r3[j], r4[j]], theta);
    }
}

/// Evaluates the dense output of one state at the fraction `theta` of the step length.
#[inline(always)]
fn value<S: Scalar>([r0, r1, r2, r3, r4]: [S; 5], theta: f64) -> S {
    let back = 1.0 - theta;
    r0 + (r1 + (r2 + (r3 + r4 * back) * theta) * back) * theta
}

/// Returns the coefficients of the dense output in powers of `theta - m`.
fn taylor([r0, r1, r2, r3, r4]: [f64; 5], m: f64) -> [f64; 5] {
    // In powers of theta: theta (1 - theta) = theta - theta^2, etc.
    let c = [r0, r1 + r2, r3 + r4 - r2, -(r3 + 2.0 * r4), r4];
    let value = c[0] + m * (c[1] + m * (c[2] + m * (c[3] + m * c[4])));
    let first = c[1] + m * (2.0 * c[2] + m * (3.0 * c[3] + m * 4.0 * c[4]));
    let second = c[2] + m * (3.0 * c[3] + m * 6.0 * c[4]);
    [value, first, second, c[3] + 4.0 * m * c[4], c[4]]
}
