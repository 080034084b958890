//! Implicit Runge-Kutta method ARK4(3)6L\[2\]SA-ESDIRK: order 4(3), L-stable, stiffly accurate.
//!
//! The first stage is explicit. The last stage is the new state, so that its derivative is the first stage of the next
//! step. Each of the other five stages solves `z - h/4 f(z) = r` by Newton's method. All use one matrix `I - h/4 J`,
//! which is kept while the iteration converges. Dense output is the cubic Hermite polynomial through both ends.
//!
//! Tangents are computed from the same equations. Once the value of a stage has converged it is frozen. The tangents
//! obey linear equations with the same matrix and are iterated to convergence, so they do not change any value.
//!
//! Source: C. Kennedy, M. Carpenter, Applied Numerical Mathematics 44 (2003) 139-181, appendix C (coefficients); E.
//! Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd edition (1996), section IV.8 (Newton's method,
//! error).

use mops_core::model::Work;
use mops_language::Scalar;
use mops_linear::{Banded, column_groups};
use mops_math as math;

use super::Driven;
use super::attempt::Attempt;
use super::integrable::Integrable;
use super::method::Method;
use super::weights::Weights;

/// Diagonal coefficient of every implicit stage.
const GAMMA: f64 = 0.25;

/// Times of the stages, as fractions of the step.
const C: [f64; 6] = [0.0, 1.0 / 2.0, 83.0 / 250.0, 31.0 / 50.0, 17.0 / 20.0, 1.0];

/// Coefficients of the preceding stages in each stage.
const A: [[f64; 5]; 6] = [
    [0.0; 5],
    [1.0 / 4.0, 0.0, 0.0, 0.0, 0.0],
    [8611.0 / 62500.0, -1743.0 / 31250.0, 0.0, 0.0, 0.0],
    [5_012_029.0 / 34_652_500.0, -654_441.0 / 2_922_500.0, 174_375.0 / 388_108.0, 0.0, 0.0],
    [
        15_267_082_809.0 / 155_376_265_600.0,
        -71_443_401.0 / 120_774_400.0,
        730_878_875.0 / 902_184_768.0,
        2_285_395.0 / 8_070_912.0,
        0.0,
    ],
    [82_889.0 / 524_892.0, 0.0, 15_625.0 / 83_664.0, 69_875.0 / 102_672.0, -2260.0 / 8211.0],
];

/// Weights of the embedded method of order 3, for the error estimate.
const EMBEDDED: [f64; 6] = [
    4_586_570_599.0 / 29_645_900_160.0,
    0.0,
    178_811_875.0 / 945_068_544.0,
    814_220_225.0 / 1_159_782_912.0,
    -3_700_637.0 / 11_593_932.0,
    61_727.0 / 225_920.0,
];

/// Termination threshold of Newton's method: its remaining error as a fraction of the tolerance.
const NEWTON: f64 = 0.02;

/// Maximum number of Newton iterations per stage.
const ITERATIONS: usize = 8;

/// Stages of a step, and the matrix of their linear systems.
pub(super) struct Esdirk<S> {
    k: [Vec<S>; 6],
    base: Vec<S>,
    update: Vec<S>,
    jacobian: Banded,
    /// Columns that can be perturbed together for finite differences: no two of them share a row.
    groups: Vec<Vec<usize>>,
    /// Rows of the nonzero entries of every column.
    rows: Vec<Vec<usize>>,
    factors: Banded,
    /// Step size for which the factors were computed; 0 if there are none.
    factors_for: f64,
    /// True if the Jacobian was evaluated at the start of the current step.
    fresh: bool,
    /// Convergence of Newton's method per iteration, as `rate / (1 - rate)`.
    contraction: f64,
    column: Vec<f64>,
}

impl<S: Scalar> Method<S> for Esdirk<S> {
    const ERROR_ORDER: f64 = 4.0;
    const IS_EXPLICIT: bool = false;

    fn new<P: Integrable<S> + ?Sized>(f: &Driven<'_, S, P>, x: &[S]) -> Self {
        let n = x.len();
        let rows = match f.jacobian_pattern() {
            Some(pattern) => {
                let mut rows = vec![Vec::new(); n];
                pattern.into_iter().for_each(|(row, column)| rows[column].push(row));
                rows
            }
            None => vec![(0..n).collect(); n],
        };
        let places = || rows.iter().enumerate().flat_map(|(column, rows)| rows.iter().map(move |&row| (row, column)));
        let lower = places().map(|(row, column)| row.saturating_sub(column)).max().unwrap_or(0);
        let upper = places().map(|(row, column)| column.saturating_sub(row)).max().unwrap_or(0);
        let groups = column_groups(&rows);
        Self {
            k: std::array::from_fn(|_| x.to_vec()),
            base: x.to_vec(),
            update: x.to_vec(),
            jacobian: Banded::zeros(n, lower, upper),
            groups,
            rows,
            factors: Banded::zeros(n, lower, upper),
            factors_for: 0.0,
            fresh: false,
            contraction: 1.0,
            column: vec![0.0; n],
        }
    }

    fn restart<P: Integrable<S> + ?Sized>(&mut self, f: &Driven<'_, S, P>, t: f64, x: &[S], work: &mut Work) {
        f.derivative(t, x, &mut self.k[0]);
        work.derivatives += 1;
        self.factors_for = 0.0;
        self.fresh = false;
    }

    fn slope(&self) -> &[S] {
        &self.k[0]
    }

    fn attempt<P: Integrable<S> + ?Sized>(
        &mut self,
        f: &Driven<'_, S, P>,
        at: Attempt<'_, S>,
        next: &mut [S],
        work: &mut Work,
    ) -> f64 {
        // Factors for a similar step size are reused: Newton's method corrects the difference.
        if self.factors_for == 0.0 || !(0.8..=1.25).contains(&(at.h / self.factors_for)) {
            self.factorise(f, &at, work);
        }
        loop {
            if (1..6).all(|stage| self.stage(f, &at, stage, next, work)) {
                return self.error(&at, next);
            }
            // Retries with a Jacobian evaluated here; if a fresh one does not converge, the step size must be reduced.
            if self.fresh && self.factors_for == at.h {
                self.factors_for = 0.0;
                return f64::NAN;
            }
            self.fresh = false;
            self.factorise(f, &at, work);
        }
    }

    fn advance(&mut self) {
        self.k.swap(0, 5);
        self.fresh = false;
    }

    fn dense(&self, h: f64, x: &[S], next: &[S], dense: &mut [Vec<S>; 5]) {
        for j in 0..x.len() {
            let (x0, x1) = (x[j], next[j]);
            let (slope0, slope1) = (self.k[0][j] * h, self.k[5][j] * h);
            let difference = x1 - x0;
            let bend = slope0 - difference;
            let coefficients = [x0, difference, bend, difference - slope1 - bend, S::from(0.0)];
            for (dense, coefficient) in dense.iter_mut().zip(coefficients) {
                dense[j] = coefficient;
            }
        }
    }
}

impl<S: Scalar> Esdirk<S> {
    /// Computes the factors for a step, with a new Jacobian unless it was evaluated in the current step.
    fn factorise<P: Integrable<S> + ?Sized>(&mut self, f: &Driven<'_, S, P>, at: &Attempt<'_, S>, work: &mut Work) {
        if !self.fresh {
            self.take_jacobian(f, at, work);
            self.fresh = true;
        }
        self.factors.set_shifted(&self.jacobian, GAMMA * at.h);
        // A singular matrix gives a solution that is not finite, and so a smaller step.
        self.factors.factorise();
        self.factors_for = at.h;
        self.contraction = 1.0;
    }

    fn take_jacobian<P: Integrable<S> + ?Sized>(&mut self, f: &Driven<'_, S, P>, at: &Attempt<'_, S>, work: &mut Work) {
        let Attempt { t, h, x, weights } = *at;
        self.jacobian.clear();
        let jacobian = &mut self.jacobian;
        if f.jacobian(t, x, &mut |row, column, value| jacobian.set(row, column, value)) {
            work.derivatives += 1;
            return;
        }
        let (moved, slopes) = (&mut self.base, &mut self.update);
        // The derivative stored in `k` is accurate to the tolerance only, an error that differences would magnify.
        f.derivative(t, x, slopes);
        work.derivatives += 1;
        self.column.iter_mut().zip(slopes.iter()).for_each(|(c, s)| *c = s.value());
        for group in &self.groups {
            moved.copy_from_slice(x);
            // Steps of the square root of the machine precision, relative to the state or to the size at which its
            // relative error counts. A state that has always been 0 has the size that it reaches in the step.
            let step = |j: usize| {
                let size = x[j].value().abs().max(weights.small(j)).max(h * self.column[j].abs());
                f64::EPSILON.sqrt() * if size > 1e-300 { size } else { 1.0 }
            };
            group.iter().for_each(|&j| moved[j] = x[j] + step(j));
            f.derivative(t, moved, slopes);
            work.derivatives += 1;
            for &j in group {
                for &i in &self.rows[j] {
                    let slope = (slopes[i].value() - self.column[i]) / step(j);
                    self.jacobian.set(i, j, slope);
                }
            }
        }
    }

    /// Solves one stage and writes it to `z`; returns false if Newton's method does not converge.
    fn stage<P: Integrable<S> + ?Sized>(
        &mut self,
        f: &Driven<'_, S, P>,
        at: &Attempt<'_, S>,
        stage: usize,
        z: &mut [S],
        work: &mut Work,
    ) -> bool {
        let Attempt { t, h, x, weights } = *at;
        let n = x.len();
        for j in 0..n {
            let mut sum = x[j];
            for (k, a) in self.k[..stage].iter().zip(A[stage]) {
                sum += k[j] * (h * a);
            }
            self.base[j] = sum;
            // Initial guess: the derivative of the preceding stage in time.
            z[j] = sum + self.k[if stage == 2 { 0 } else { stage - 1 }][j] * (h * GAMMA);
        }
        let time = t + C[stage] * h;
        let mut last = f64::NAN;
        let mut converged = false;
        // The contraction is estimated from earlier steps. Factors of another step size limit it to the relative
        // difference of the step sizes.
        let mismatch = (h / self.factors_for - 1.0).abs();
        self.contraction = math::powf(self.contraction.max(1e-16), 0.8).max(mismatch);
        for iteration in 0..ITERATIONS {
            self.newton_step(f, time, h, z, work);
            let mut norm = weights.norm(h, n);
            for j in 0..n {
                // A state that leaves 0 has the size that the iteration gives it.
                let (update, z) = (self.update[j].value(), z[j].value());
                norm.add(j, update, [x[j].value(), z.abs().max((z + update).abs()), 0.0]);
            }
            let size = norm.of_errors();
            if !size.is_finite() {
                return false;
            }
            if iteration > 0 {
                let rate = size / last;
                if rate >= 1.0 {
                    return false;
                }
                self.contraction = rate / (1.0 - rate);
                // Too slow to converge in the remaining iterations.
                #[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)]
                let left = math::powi(rate, (ITERATIONS - 1 - iteration) as i32);
                if left * self.contraction * size > NEWTON {
                    return false;
                }
            }
            for (z, d) in z.iter_mut().zip(&self.update) {
                *z += *d;
            }
            last = size;
            if self.contraction * size <= NEWTON || size == 0.0 {
                converged = true;
                break;
            }
        }
        if converged && S::DIRECTIONS > 0 {
            self.finish_tangents(f, time, h, z, weights, work);
        }
        let k = &mut self.k[stage];
        for j in 0..n {
            k[j] = (z[j] - self.base[j]) / (h * GAMMA);
        }
        converged
    }

    /// Computes the Newton step from `z`, value and tangents, into `update`.
    fn newton_step<P: Integrable<S> + ?Sized>(
        &mut self,
        f: &Driven<'_, S, P>,
        t: f64,
        h: f64,
        z: &[S],
        work: &mut Work,
    ) {
        f.derivative(t, z, &mut self.update);
        work.derivatives += 1;
        for (j, update) in self.update.iter_mut().enumerate() {
            *update = self.base[j] + *update * (h * GAMMA) - z[j];
        }
        solve(&self.factors, &mut self.update, &mut self.column);
    }

    /// Iterates the tangents of a stage whose value is frozen.
    fn finish_tangents<P: Integrable<S> + ?Sized>(
        &mut self,
        f: &Driven<'_, S, P>,
        t: f64,
        h: f64,
        z: &mut [S],
        weights: &Weights,
        work: &mut Work,
    ) {
        for _ in 0..ITERATIONS {
            self.newton_step(f, t, h, z, work);
            for (z, d) in z.iter_mut().zip(&self.update) {
                *z += *d - d.value();
            }
            let largest =
                |x: &[S], direction: usize| x.iter().fold(0.0, |m: f64, x| m.max(x.tangents()[direction].abs()));
            let arrived = |d: usize| largest(&self.update, d) <= NEWTON * weights.relative() * largest(z, d);
            if (0..S::DIRECTIONS).all(arrived) {
                return;
            }
        }
        // Tangents that did not converge are set to NaN; the caller falls back on finite differences.
        for z in z {
            (0..S::DIRECTIONS).for_each(|direction| z.set_tangent(direction, f64::NAN));
        }
    }

    /// Returns the error norm divided by the tolerance; the matrix damps the contribution of stiff components.
    fn error(&mut self, at: &Attempt<'_, S>, next: &[S]) -> f64 {
        let Attempt { h, x, weights, .. } = *at;
        for (j, error) in self.column.iter_mut().enumerate() {
            let weight = |i: usize| if i < 5 { A[5][i] } else { GAMMA };
            *error = h * (0..6).map(|i| (weight(i) - EMBEDDED[i]) * self.k[i][j].value()).sum::<f64>();
        }
        self.factors.solve(&mut self.column);
        let mut norm = weights.norm(h, self.column.len());
        for (j, error) in self.column.iter().enumerate() {
            norm.add(j, *error, [x[j].value(), next[j].value(), self.k[5][j].value()]);
        }
        norm.of_errors()
    }
}

/// Solves for every tangent and for the value.
fn solve<S: Scalar>(factors: &Banded, b: &mut [S], column: &mut [f64]) {
    for direction in 0..S::DIRECTIONS {
        column.iter_mut().zip(b.iter()).for_each(|(c, b)| *c = b.tangents()[direction]);
        factors.solve(column);
        b.iter_mut().zip(column.iter()).for_each(|(b, &c)| b.set_tangent(direction, c));
    }
    column.iter_mut().zip(b.iter()).for_each(|(c, b)| *c = b.value());
    factors.solve(column);
    b.iter_mut().zip(column.iter()).for_each(|(b, &c)| *b = b.chain(c, 1.0));
}
