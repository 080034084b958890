//! Levenberg and Marquardt's method for a fit: normal equations with exact slopes, steps within bounds, the covariance.

use std::sync::{Arc, OnceLock};

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::fit::{Fit, Fitted, Global, Known, Point, Residuals, Sets, Slopes, dot};
use crate::subject::Local;
use crate::weigh::Dispersion;
use mops_core::math;

/// How far, in units of its scale, a start value may be expected from where it begins: what the data say nothing of, such as a
/// speed while the sensor is saturated, stays there.
const WIDE: f64 = 30.0;

/// How far beyond a bound, in standard errors, the data must want an unknown for the bound to hold it.
const BEYOND: f64 = 2.0;

/// Normal equations at a point.
#[derive(Debug)]
pub struct Normal {
    chi2: f64,
    residuals: Vec<Vec<f64>>,
    matrix: DMatrix<f64>,
    /// Half the gradient of the sum of squares.
    pub(crate) gradient: DVector<f64>,
}

impl Normal {
    /// Whether no slope tells anything of an unknown of a piece, by its index among all unknowns: only what is expected of it
    /// stands on the diagonal.
    pub(crate) fn tells_nothing_of(&self, local: usize) -> bool {
        self.matrix[(local, local)] == math::powi(WIDE, -2)
    }
}

impl Fit<'_> {
    /// Sum of the squares of what something is expected of, in units of that.
    fn unexpected(&self, point: &Point) -> f64 {
        let globals: f64 = self.expected.iter().map(|expected| expected.at(point).norm_squared()).sum();
        let locals = self.pieces.iter().zip(&point.locals);
        let locals = locals.flat_map(|(piece, values)| piece.locals.iter().zip(values));
        globals + locals.map(|(local, &value)| math::powi(far(local, value), 2)).sum::<f64>()
    }

    /// What a fit makes least: the sum of the squares of the residuals, and of what something is expected of.
    pub(crate) fn total(&self, fitted: &Fitted) -> f64 {
        fitted.chi2 + self.unexpected(&fitted.point)
    }

    fn unknowns(&self) -> usize {
        self.globals.len() + self.pieces.iter().map(|p| p.locals.len()).sum::<usize>()
    }

    /// Normal equations in the coordinates of the search.
    pub(crate) fn normal(&self, point: &Point) -> Option<Normal> {
        Some(self.equations(point, self.looks(point, Slopes::Free)?))
    }

    /// The same where the first unknowns stand as in another fit, and the others change nothing but slopes.
    fn normal_beside(&self, point: &Point, known: &Known) -> Option<Normal> {
        let (first, before) = (known.point.globals.len(), &known.point.locals);
        let stays = |(now, then): (&Vec<f64>, &Vec<f64>)| now.starts_with(then);
        let same = point.globals.starts_with(&known.point.globals)
            && point.locals.len() == before.len()
            && point.locals.iter().zip(before).all(stays);
        if !same {
            return self.normal(point);
        }
        let beside = |(piece, known): (usize, &Residuals)| {
            let own = before[piece].len();
            let found = self.look(piece, point, Slopes::From(first, own))?;
            let (globals, locals) = found.j.split_at(self.globals.len() - first);
            let j = [&known.j[..first], globals, &known.j[first..], locals].concat();
            Some(Residuals { r: known.r.clone(), j })
        };
        let all: Option<Vec<Residuals>> = known.all.par_iter().enumerate().map(beside).collect();
        Some(self.equations(point, all?))
    }

    /// The same for residuals and slopes that are known.
    pub(crate) fn equations(&self, point: &Point, all: Vec<Residuals>) -> Normal {
        let (n, g) = (self.unknowns(), self.globals.len());
        let mut matrix = DMatrix::zeros(n, n);
        let mut gradient = DVector::zeros(n);
        let (mut chi2, mut offset) = (0.0, g);
        for (piece, residuals) in all.iter().enumerate() {
            let locals = self.pieces[piece].locals.len();
            let at: Vec<usize> = (0..g).chain(offset..offset + locals).collect();
            let factor = |k: usize| {
                if k < g { self.stretch(k, point.globals[k]) } else { self.pieces[piece].locals[k - g].scale }
            };
            chi2 += residuals.r.iter().map(|r| r * r).sum::<f64>();
            for a in 0..at.len() {
                let (ja, fa) = (&residuals.j[a], factor(a));
                gradient[at[a]] += fa * dot(ja, &residuals.r);
                for b in a..at.len() {
                    let value = fa * factor(b) * dot(ja, &residuals.j[b]);
                    matrix[(at[a], at[b])] += value;
                    if a != b {
                        matrix[(at[b], at[a])] += value;
                    }
                }
            }
            for (k, local) in self.pieces[piece].locals.iter().enumerate() {
                gradient[offset + k] += far(local, point.locals[piece][k]) / WIDE;
                matrix[(offset + k, offset + k)] += math::powi(WIDE, -2);
            }
            offset += locals;
        }
        for expected in &self.expected {
            let at = expected.at(point);
            let turn = DMatrix::from_fn(at.len(), expected.whitening.ncols(), |i, k| {
                expected.whitening[(i, k)] * self.stretch(expected.first + k, point.globals[expected.first + k])
            });
            let (first, n) = (expected.first, turn.ncols());
            let mut part = gradient.rows_mut(first, n);
            part += turn.tr_mul(&at);
            let mut part = matrix.view_mut((first, first), (n, n));
            part += turn.tr_mul(&turn);
        }
        Normal { chi2, residuals: all.into_iter().map(|piece| piece.r).collect(), matrix, gradient }
    }

    /// Change of a global per unit of its coordinate.
    fn stretch(&self, k: usize, value: f64) -> f64 {
        if self.globals[k].log { value } else { self.globals[k].scale }
    }

    /// The point moved by a step in the coordinates of the search, within bounds.
    pub(crate) fn moved(&self, point: &Point, step: &DVector<f64>) -> Point {
        let mut moved = point.clone();
        for (k, global) in self.globals.iter().enumerate() {
            let value = point.globals[k];
            let to =
                if global.log { value * math::exp(step[k].clamp(-3.0, 3.0)) } else { value + step[k] * global.scale };
            moved.globals[k] = to.clamp(global.bounds[0], global.bounds[1]);
        }
        let mut offset = self.globals.len();
        for (piece, locals) in self.pieces.iter().zip(&mut moved.locals) {
            for (local, value) in piece.locals.iter().zip(locals) {
                *value = (*value + step[offset] * local.scale).clamp(local.bounds[0], local.bounds[1]);
                offset += 1;
            }
        }
        moved
    }

    /// Which unknowns stand at a bound towards which the sum of squares falls.
    fn held(&self, point: &Point, gradient: &DVector<f64>) -> Vec<bool> {
        let at = |value: f64, bounds: [f64; 2], slope: f64| {
            (value <= bounds[0] && slope > 0.0) || (value >= bounds[1] && slope < 0.0)
        };
        let g = self.globals.len();
        let global =
            |k: usize| self.globals[k].is_pinned() || at(point.globals[k], self.globals[k].bounds, gradient[k]);
        let mut held: Vec<bool> = (0..g).map(global).collect();
        for (piece, locals) in self.pieces.iter().zip(&point.locals) {
            for (local, &value) in piece.locals.iter().zip(locals) {
                held.push(at(value, local.bounds, gradient[held.len()]));
            }
        }
        held
    }

    /// The same with what slopes tell nothing of.
    pub(crate) fn held_by_slopes(&self, point: &Point, gradient: &DVector<f64>) -> Vec<bool> {
        let mut held = self.held(point, gradient);
        self.globals.iter().zip(&mut held).for_each(|(global, held)| *held |= global.is_stepped());
        held
    }

    /// Levenberg and Marquardt's method within bounds, from a point; `None` where that cannot be simulated.
    ///
    /// Source: J. More, The Levenberg-Marquardt algorithm: implementation and theory, Lecture Notes in Mathematics 630
    /// (1978); unknowns at a bound that the gradient presses against are left out of a step (D. Bertsekas, Projected Newton
    /// methods, SIAM J. Control Optim. 20 (1982)).
    pub fn solve(&self, start: Point, iterations: usize) -> Option<Fitted> {
        let normal = Arc::new(self.normal(&start)?);
        Some(self.descend(start, normal, iterations, 0))
    }

    /// The same where much of the start is known.
    pub fn solve_beside(&self, start: Point, known: &Known, iterations: usize) -> Option<Fitted> {
        let normal = Arc::new(self.normal_beside(&start, known)?);
        Some(self.descend(start, normal, iterations, known.point.globals.len()))
    }

    /// The same from where a fit of this problem ended.
    pub fn resume(&self, from: &Fitted, iterations: usize) -> Option<Fitted> {
        let normal = self.normal_at(from)?;
        Some(self.descend(from.point.clone(), normal, iterations, self.globals.len()))
    }

    /// The normal equations at a solution, computed once.
    pub(crate) fn normal_at(&self, fitted: &Fitted) -> Option<Arc<Normal>> {
        if let Some(known) = fitted.normal.get() {
            return Some(Arc::clone(known));
        }
        let normal = Arc::new(self.normal(&fitted.point)?);
        Some(Arc::clone(fitted.normal.get_or_init(|| normal)))
    }

    /// Where the fit is a short one, sizes of steps before the global `first` stay as they are.
    fn descend(&self, start: Point, normal: Arc<Normal>, iterations: usize, first: usize) -> Fitted {
        let fitted = self.levenberg_marquardt(start, normal, iterations);
        let fitted = self.with_starts(fitted, iterations);
        self.with_steps(fitted, iterations, first)
    }

    /// The method from a point with its normal equations; sizes of steps stay as they are.
    pub(crate) fn levenberg_marquardt(&self, start: Point, normal: Arc<Normal>, iterations: usize) -> Fitted {
        let count = self.pieces.iter().flat_map(|p| &p.series).map(|s| s.times.len()).sum();
        let residuals = normal.residuals.clone();
        let mut fitted = Fitted { chi2: normal.chi2, count, point: start, residuals, normal: OnceLock::new() };
        let mut normal = normal;
        let mut damping = 1e-3;
        let mut total = self.total(&fitted);
        for iteration in 1..=iterations {
            let held = self.held_by_slopes(&fitted.point, &normal.gradient);
            let mut improved = None;
            for _ in 0..8 {
                let Some(step) = damped_step(&normal, &held, damping) else {
                    damping *= 10.0;
                    continue;
                };
                let trial = self.moved(&fitted.point, &step);
                let residuals = self.all(&trial);
                let chi2 = residuals.as_ref().map_or(f64::INFINITY, |all| sum_of_squares(all));
                let sum = chi2 + self.unexpected(&trial);
                if let Some(residuals) = residuals.filter(|_| sum < total) {
                    improved = Some((trial, chi2, residuals));
                    break;
                }
                if step.amax() < 1e-9 {
                    break;
                }
                damping *= if chi2.is_finite() { 6.0 } else { 20.0 };
            }
            let Some((trial, chi2, residuals)) = improved else { break };
            let now = chi2 + self.unexpected(&trial);
            let gain = std::mem::replace(&mut total, now) - now;
            damping = (damping * 0.15).max(1e-9);
            if iteration == iterations || gain < 1e-3 + 1e-6 * total {
                // Nobody may ask for the slopes here.
                return Fitted { point: trial, chi2, residuals, ..fitted };
            }
            let Some(next) = self.normal(&trial) else { break };
            (fitted.point, fitted.chi2) = (trial, next.chi2);
            fitted.residuals.clone_from(&next.residuals);
            normal = Arc::new(next);
        }
        Fitted { normal: OnceLock::from(normal), ..fitted }
    }

    /// How much the unknowns that set parameters from `first` on cost less than [`Dispersion::worth`] each, as the data hardly
    /// narrow them: the logarithm of how many times smaller they make the variance. Beforehand a global lies anywhere between
    /// its bounds; what physics gives no upper one within a decade either way where it is looked for in its logarithm, and within
    /// 20 of its scales where no slope tells it; a start value within ten of its scales. What has no bounds at all costs the
    /// whole, as does the strength itself, at `first`, where no slope tells it.
    ///
    /// Source: D. J. C. MacKay, Bayesian interpolation, Neural Computation 4 (1992) 415, section 2.3: the Occam factor.
    pub fn spared(&self, fitted: &Fitted, first: usize, dispersion: &Dispersion) -> f64 {
        const START: f64 = 10.0;
        /// The typical size of a break-away that begins at 0, in its scales.
        const STEPPED: f64 = 20.0;
        let Some(normal) = self.normal_at(fitted) else { return 0.0 };
        let uniform = |width: f64| if width.is_finite() { 12.0 / (width * width) } else { 0.0 };
        let global = |(k, global): (usize, &Global)| match global.sets {
            Sets::Parameter(parameter) if parameter > first || parameter == first && !global.is_stepped() => {
                let width = (global.bounds[1] - global.bounds[0]) / self.stretch(k, fitted.point.globals[k]);
                uniform(match (width.is_finite(), global.log, global.is_stepped()) {
                    (_, true, _) if global.open => 2.0 * math::ln(10.0),
                    (false, false, true) => STEPPED,
                    _ => width,
                })
            }
            _ => 0.0,
        };
        // Of each unknown the precision beforehand, and what it costs where the data tell it.
        let all = dispersion.worth(fitted.count);
        let mut unknowns: Vec<(f64, f64)> = self.globals.iter().enumerate().map(|g| (global(g), all)).collect();
        for (piece, r) in self.pieces.iter().zip(&fitted.residuals) {
            let local = |local: &Local| if local.parameter >= first { math::powi(START, -2) } else { 0.0 };
            unknowns.extend(piece.locals.iter().map(|l| (local(l), dispersion.worth(r.len()))));
        }
        let held = self.held(&fitted.point, &normal.gradient);
        let free: Vec<usize> = (0..held.len()).filter(|&k| !held[k]).collect();
        let matrix = DMatrix::from_fn(free.len(), free.len(), |i, j| {
            normal.matrix[(free[i], free[j])] / dispersion.weight() + if i == j { unknowns[free[i]].0 } else { 0.0 }
        });
        let after = pseudo_inverse(&matrix);
        let spared = |(i, &k): (usize, &usize)| {
            let (before, whole) = unknowns[k];
            let stepped = before > 0.0 && self.globals.get(k).is_some_and(Global::is_stepped);
            let variance = if stepped { self.stepped_variance(fitted, k, dispersion) } else { after[(i, i)] };
            let narrowed = -math::ln(before * variance);
            if before > 0.0 { whole - narrowed.clamp(0.0, whole) } else { 0.0 }
        };
        free.iter().enumerate().map(spared).sum()
    }

    /// Variance of the global `k`, which no slope tells, in the coordinate of the search: of the interval beyond which the sum of
    /// squares is larger by one unit, as one standard error to both sides.
    fn stepped_variance(&self, fitted: &Fitted, k: usize, dispersion: &Dispersion) -> f64 {
        let Some([low, high]) = self.stepped_interval(fitted, k, dispersion.weight()) else { return 0.0 };
        let width = if self.globals[k].log { math::ln(high / low) } else { (high - low) / self.globals[k].scale };
        math::powi(0.5 * width, 2)
    }

    /// Covariance of the globals, the locals eliminated, where `weight` units of the sum of squares count as one: the inverse of
    /// the normal matrix over that, with what the bounds say; 0 for what stands at a bound against which the data press it, and
    /// where the slopes cannot be had.
    pub fn covariance(&self, fitted: &Fitted, weight: f64) -> DMatrix<f64> {
        let g = self.globals.len();
        let mut covariance = DMatrix::zeros(g, g);
        let Some(normal) = self.normal_at(fitted) else { return covariance };
        let stretch = |k: usize| self.stretch(k, fitted.point.globals[k]);
        let inverse = |free: &[usize]| {
            let mut matrix =
                DMatrix::from_fn(free.len(), free.len(), |i, j| normal.matrix[(free[i], free[j])] / weight);
            // What the data do not tell is still known to lie between the bounds: uniform there.
            for (i, &k) in free.iter().enumerate().filter(|(_, k)| **k < g) {
                let [low, high] = self.globals[k].bounds;
                if (high - low).is_finite() {
                    matrix[(i, i)] += 12.0 * math::powi(stretch(k) / (high - low), 2);
                }
            }
            wide_inverse(&matrix)
        };
        let mut held = self.held(&fitted.point, &normal.gradient);
        let pinned = |k: usize| k < g && self.globals[k].is_pinned();
        let all: Vec<usize> = (0..held.len()).filter(|&k| !pinned(k)).collect();
        let whole = inverse(&all);
        let wanted = -(&whole * DVector::from_fn(all.len(), |i, _| normal.gradient[all[i]] / weight));
        // What would move beyond its bound by less than the data tell is not held by it, nor is what goes with it.
        for (i, &k) in all.iter().enumerate() {
            held[k] &= wanted[i].abs() > BEYOND * whole[(i, i)].sqrt();
        }
        let free: Vec<usize> = (0..held.len()).filter(|&k| !held[k]).collect();
        let inverse = inverse(&free);
        for (i, &a) in free.iter().enumerate().filter(|(_, a)| **a < g) {
            for (j, &b) in free.iter().enumerate().filter(|(_, b)| **b < g) {
                covariance[(a, b)] = inverse[(i, j)] * stretch(a) * stretch(b);
            }
        }
        covariance
    }
}

/// How far a start value is from where it begins, as shares of what is expected.
fn far(local: &Local, value: f64) -> f64 {
    (value - local.start) / (WIDE * local.scale)
}

/// `-(M + damping diag M)^-1 g` over the unknowns that are not held.
pub(crate) fn damped_step(normal: &Normal, held: &[bool], damping: f64) -> Option<DVector<f64>> {
    let free: Vec<usize> = (0..held.len()).filter(|&k| !held[k] && normal.matrix[(k, k)] > 0.0).collect();
    let mut step = DVector::zeros(held.len());
    if free.is_empty() {
        return Some(step);
    }
    let scale: Vec<f64> = free.iter().map(|&k| normal.matrix[(k, k)].sqrt()).collect();
    let matrix = DMatrix::from_fn(free.len(), free.len(), |i, j| {
        let value = normal.matrix[(free[i], free[j])] / (scale[i] * scale[j]);
        if i == j { value + damping } else { value }
    });
    let right = DVector::from_fn(free.len(), |i, _| -normal.gradient[free[i]] / scale[i]);
    let solved = matrix.cholesky()?.solve(&right);
    for (i, &k) in free.iter().enumerate() {
        step[k] = solved[i] / scale[i];
    }
    Some(step)
}

/// Inverse of a symmetric matrix without the directions whose eigenvalue, scaled to a unit diagonal, is below [`NONE`].
pub fn pseudo_inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    inverted(matrix, |value, least| if value > least { 1.0 / value } else { 0.0 })
}

/// The same with these directions as wide as numbers tell: what nothing tells is uncertain, not certain.
fn wide_inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    inverted(matrix, |value, least| 1.0 / value.max(least))
}

/// Share of the largest eigenvalue that counts as none.
const NONE: f64 = 1e-12;

fn inverted(matrix: &DMatrix<f64>, invert: impl Fn(f64, f64) -> f64) -> DMatrix<f64> {
    let n = matrix.nrows();
    if n == 0 {
        return DMatrix::zeros(0, 0);
    }
    let scale: Vec<f64> = (0..n).map(|k| matrix[(k, k)].max(f64::MIN_POSITIVE).sqrt()).collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] / (scale[i] * scale[j]));
    let eigen = scaled.symmetric_eigen();
    let least = NONE * eigen.eigenvalues.amax();
    let mut inverse = DMatrix::zeros(n, n);
    for (k, &value) in eigen.eigenvalues.iter().enumerate() {
        let v = eigen.eigenvectors.column(k);
        inverse += (v * v.transpose()) * invert(value, least);
    }
    DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] / (scale[i] * scale[j]))
}

/// Sum of the squares of all residuals.
pub(crate) fn sum_of_squares(all: &[Vec<f64>]) -> f64 {
    all.iter().map(|r| r.iter().map(|r| r * r).sum::<f64>()).sum()
}
