//! Parameters and initial states under an error model, and the evidence of the model.

use mops_core::{Input, case::Hold, effect::Port, least_squares::LeastSquares};
use mops_math as math;
use mops_models::WithEffects;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::errors::{Channels, ErrorModel, Errors, Fitted, Motion, Observed};
use crate::error_models::ForceError;
use crate::fit::{Fit, Piece, Point, Residuals};
use crate::motion::Trajectory;

/// Standard errors by which an estimate differs clearly from another one. Basis: a normal error exceeds them in 0.3 %.
pub const CLEARLY: f64 = 3.0;

/// Largest expected ratio of an actual gain to that predicted to first order. Basis: the studies.
pub const ALLOWANCE: f64 = 1.5;

/// Iterations of a first look at a start. Basis: an assumption.
pub const LOOK: usize = 5;

/// Largest number of iterations of a fit; of a rough one half of it. Basis: an assumption.
pub const ITERATIONS: usize = 60;

/// Rounds of parameters and hyperparameters. Basis: an assumption.
const ROUNDS: usize = 8;

/// Iterations of the parameters in a round, and of a start of the declared model. Basis: an assumption.
pub const ROUND_ITERATIONS: usize = 10;

/// Predicted decrease of the sum of squares, relative to its mean per residual, below which a fit has converged. Basis:
/// the studies.
const CONVERGED: f64 = 0.01;

/// Predicted decrease of log-likelihood where a rough fit ends, nats. Basis: it changes odds by a tenth.
const ROUGHLY: f64 = 0.1;

/// Share of the sum of squares by which each of [`LOOK`] iterations in a row must decrease it, or a rough fit ends.
/// Basis: together they bring less than 5 %, a smaller gain than any effect that is claimed.
pub const STALLS: f64 = 0.01;

/// Gain in log-likelihood, or decrease of a penalty, below which rounds end, nats. Basis: the studies.
pub const SETTLED: f64 = 0.05;

/// Iterations of a smoothed motion. Basis: the studies.
const SMOOTHINGS: usize = 12;

/// Trials of a step of a smoothed motion. Basis: the last is 1 % of the step.
const SHORTENINGS: usize = 6;

/// Ratio of a trial to the one before. Basis: within 0.1 to 0.5, the range of step lengths after a quadratic model.
/// Source: J. E. Dennis, R. B. Schnabel, Numerical Methods for Unconstrained Optimization (1983), section 6.3.
const SHORTER: f64 = 0.4;

/// Prior of an unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Change of the unknown for a change of 1 in the coordinate of the prior.
    pub stretch: f64,
    /// Standard deviation in that coordinate.
    pub deviation: f64,
    /// Centre of a normal prior in the unit of the unknown; `None` if the density is that at the centre, wherever the
    /// unknown is.
    pub centre: Option<f64>,
    /// True if only one side of the centre is possible, which doubles the density.
    pub half: bool,
}

impl Prior {
    /// Returns the precision in the unit of the unknown.
    pub fn precision(&self) -> f64 {
        math::powi(self.stretch * self.deviation, -2)
    }

    /// Returns the logarithm of the density at a value.
    fn log(&self, value: f64) -> f64 {
        let distance = self.centre.map_or(0.0, |centre| (value - centre) / (self.stretch * self.deviation));
        let doubled = if self.half { math::ln(2.0) } else { 0.0 };
        -0.5 * distance * distance - math::ln(self.deviation) - 0.5 * math::ln(std::f64::consts::TAU) + doubled
    }
}

/// Unknowns of a fit under an error model.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// Parameters and initial states.
    pub point: Point,
    /// Error model with its hyperparameters.
    pub errors: Errors,
    /// Log-likelihood.
    pub log_likelihood: f64,
    /// Logarithm of the evidence; `None` if it is not finite.
    pub log_evidence: Option<f64>,
    /// Standard errors of the shared parameters, in their units; 0 for fixed ones.
    pub deviations: Vec<f64>,
    /// True if the decrease that the linear model still predicts is negligible.
    pub converged: bool,
}

/// Problem of estimating the unknowns of a fit.
pub struct Estimation<'a> {
    /// Fit of an augmented model to records.
    pub fit: &'a Fit<'a>,
    /// Augmented model of the fit.
    pub model: &'a WithEffects,
    /// Channels of the records.
    pub channels: Channels,
    /// Nominal rate of the balance of each force of the model.
    pub nominal: Vec<f64>,
    /// Priors of the shared parameters, then of the initial states of each record.
    pub priors: Vec<Prior>,
    /// Logarithm of the number of combinations of grid values of the parameters that no fit moves: each is as probable.
    pub log_choices: f64,
}

/// Parameters and hyperparameters are fitted in turns.
impl Estimation<'_> {
    /// Fits parameters and initial states by least squares.
    pub fn least_squares(&self, start: Point) -> Option<Estimate> {
        self.with(&Errors::White, start, ITERATIONS)
    }

    /// Fits parameters and initial states under an error model at the outputs whose hyperparameters are given, in at
    /// most so many iterations. The evidence is that for these hyperparameters.
    pub fn with(&self, errors: &Errors, start: Point, iterations: usize) -> Option<Estimate> {
        self.given(errors, self.descend(self.fit, errors, Begin::at(start), Effort::of(iterations))?)
    }

    /// Returns the log-likelihood at a point under an error model at the outputs whose hyperparameters are given;
    /// `None` if a simulation fails.
    pub fn log_likelihood(&self, errors: &Errors, point: &Point) -> Option<f64> {
        Some(errors.log_likelihood(&self.fit.pieces, &self.channels, self.fit.all(point)?))
    }

    /// Fits like [`Estimation::with`], but roughly, and gives up where the log-likelihood cannot become as large as
    /// `least`.
    pub fn roughly(&self, errors: &Errors, start: Point, least: f64) -> Option<Estimate> {
        let effort =
            Effort { iterations: ITERATIONS / 2, negligible: 2.0 * ROUGHLY, least, stalls: |sum| STALLS * sum };
        self.given(errors, self.descend(self.fit, errors, Begin::at(start), effort)?)
    }

    fn given(&self, errors: &Errors, found: Found) -> Option<Estimate> {
        let log_likelihood = found.log_likelihood();
        let given = Fitted { errors: errors.clone(), count: 0, log_prior: 0.0, log_determinant: 0.0 };
        Some(self.concluded(log_likelihood, found, given))
    }

    /// Fits parameters, initial states and hyperparameters of an error model; `before` is one of the kind to start
    /// from, and `known` are the residuals with their slopes at the start, which only the force error computes itself.
    pub fn under(
        &self,
        kind: ErrorModel,
        start: Point,
        before: Option<&Errors>,
        mut known: Option<Vec<Residuals>>,
    ) -> Option<Estimate> {
        if kind == ErrorModel::Force && self.nominal.is_empty() {
            return None;
        }
        let mut fit = self.fit.clone();
        let mut point = start;
        let mut damping = None;
        // Where the likelihood is largest so far. That of a force counts along the motion that it has smoothed, not
        // along the first one without it.
        let mut best: Option<(f64, Point, Fitted, Vec<Residuals>)> = None;
        let mut errors: Option<Errors> = None;
        let mut trials = 0;
        for round in 0..ROUNDS {
            let motions = match kind {
                ErrorModel::Force => self.motions(&mut fit, &point, errors.as_ref())?,
                _ => Vec::new(),
            };
            let mut all = match known.take().filter(|_| kind != ErrorModel::Force) {
                Some(all) => all,
                None => fit.slopes(&point)?,
            };
            all.iter_mut().zip(&motions).for_each(|(piece, motion)| piece.r = motion.without_force(&piece.r));
            let residuals: Vec<Vec<f64>> = all.iter().map(|piece| piece.r.clone()).collect();
            let thoroughly = round == 0;
            let last = errors.as_ref().or(before);
            let observed = Observed {
                pieces: &self.fit.pieces,
                channels: &self.channels,
                residuals: &residuals,
                settings: &self.fit.subject.settings,
            };
            let fitted = Errors::fit(kind, observed, motions, last, thoroughly)?;
            let begin = Begin { point: point.clone(), all: Some(all.clone()), damping };
            let found = self.descend(&fit, &fitted.errors, begin, Effort::round())?;
            damping = Some(found.iterate.damping());
            let is_first = round == usize::from(kind == ErrorModel::Force);
            let gain = best.as_ref().filter(|_| !is_first).map_or(f64::INFINITY, |best| found.first - best.0);
            if gain > 0.0 {
                errors = Some(fitted.errors.clone());
                best = Some((found.first, point, fitted, all));
                (point, trials, known) = (found.point, 0, Some(found.all));
            } else {
                // The linear model was left: back towards the best point.
                point = between(&best.as_ref()?.1, &point, SHORTER);
                trials += 1;
            }
            if gain.abs() < SETTLED && round > 1 || trials > SHORTENINGS {
                break;
            }
        }
        let (_, point, fitted, all) = best?;
        let begin = Begin { point, all: Some(all), damping };
        let found = self.descend(&self.along(&fitted.errors), &fitted.errors, begin, Effort::of(0))?;
        Some(self.concluded(found.log_likelihood(), found, fitted))
    }

    /// Returns the linearised motion of each record under the most probable force, found by Gauss-Newton iterations:
    /// simulate with the force, linearise there, smooth again. Writes the force to the records of the fit. Without an
    /// error model there is no force.
    ///
    /// Source: B. Bell, The iterated Kalman smoother as a Gauss-Newton method, SIAM J. Optim. 4 (1994) 626.
    fn motions(&self, fit: &mut Fit<'_>, point: &Point, errors: Option<&Errors>) -> Option<Vec<Motion>> {
        let (error, before) = match errors {
            Some(Errors::Force(error, motions)) => (Some(error), Some(motions)),
            _ => (None, None),
        };
        let of = |piece: usize| {
            let mut fit = fit.clone();
            let mut motion = self.linearised(&mut fit, piece, point, before.map(|motions| &motions[piece]))?;
            for _ in 0..error.map_or(0, |_| SMOOTHINGS) {
                let Some(next) = self.smoothed(&mut fit, piece, point, error?, &motion) else { break };
                motion = next.0;
                if next.1 < SETTLED {
                    break;
                }
            }
            Some(motion)
        };
        let motions: Vec<Motion> = (0..fit.pieces.len()).into_par_iter().map(of).collect::<Option<_>>()?;
        motions.iter().enumerate().for_each(|(piece, motion)| self.push(fit, piece, motion));
        Some(motions)
    }

    /// Returns a motion with a more probable force, and the decrease of the joint penalty of force and residuals;
    /// `None` if none is found.
    fn smoothed(
        &self,
        fit: &mut Fit<'_>,
        piece: usize,
        point: &Point,
        error: &ForceError,
        motion: &Motion,
    ) -> Option<(Motion, f64)> {
        self.push(fit, piece, motion);
        let residuals = fit.residuals(piece, point)?;
        // The force explains what the model lacks: measured minus simulated.
        let lacking: Vec<f64> = residuals.iter().zip(&motion.response).map(|(r, f)| f - r).collect();
        let wanted = error.smooth(&motion.linearised, &lacking);
        let noise = |residuals: &[f64]| -> f64 {
            let measured = motion.linearised.measured.iter().flatten();
            measured.map(|m| math::powi(residuals[m.residual] / error.noise[m.channel], 2)).sum()
        };
        let joint = |residuals: &[f64], forces: &[f64]| noise(residuals) + error.penalty(&motion.linearised, forces);
        let now = joint(&residuals, &motion.forces);
        let mut share = 1.0;
        for _ in 0..SHORTENINGS {
            let forces: Vec<f64> = motion.forces.iter().zip(&wanted).map(|(f, w)| f + share * (w - f)).collect();
            let trial = Motion { forces, ..motion.clone() };
            self.push(fit, piece, &trial);
            if let Some(there) = fit.residuals(piece, point) {
                let gain = now - joint(&there, &trial.forces);
                if gain > 0.0 {
                    return Some((self.linearised(fit, piece, point, Some(&trial))?, gain));
                }
            }
            share *= SHORTER;
        }
        None
    }

    /// Linearises the motion of a record under the force of a motion of this record; `None` means no force.
    fn linearised(&self, fit: &mut Fit<'_>, piece: usize, point: &Point, force: Option<&Motion>) -> Option<Motion> {
        match force {
            Some(motion) => self.push(fit, piece, motion),
            None => fit.pieces[piece].case.disturbances.clear(),
        }
        let along = Trajectory::new(fit, self.model, piece, point).ok()?;
        let series = fit.pieces[piece].series.len();
        let channels: Vec<usize> = (0..series).map(|k| self.channels.of(piece, k)).collect();
        let linearised = along.linearised(&self.nominal, &channels);
        let still = || vec![0.0; linearised.times.len() * self.nominal.len()];
        let forces = force.map_or_else(still, |motion| motion.forces.clone());
        let response = linearised.response(&forces);
        Some(Motion { linearised, forces, response })
    }

    /// Writes the force of a motion to its record, kept from sample to sample.
    fn push(&self, fit: &mut Fit<'_>, piece: usize, motion: &Motion) {
        let states = self.model.model().interface().ports.iter().filter_map(|port| match port {
            Port::Process { state, .. } => Some(state.clone()),
            _ => None,
        });
        let force = |(j, state): (usize, String)| {
            let values = motion.forces.iter().skip(j).step_by(self.nominal.len()).map(|f| f * self.nominal[j]);
            let times = motion.linearised.times.clone();
            (state, Input::Sampled { times, values: values.collect(), hold: Hold::Zero })
        };
        fit.pieces[piece].case.disturbances =
            if motion.is_still() { Vec::new() } else { states.enumerate().map(force).collect() };
    }

    /// Adds the evidence and the standard errors.
    #[allow(clippy::cast_precision_loss)]
    fn concluded(&self, log: f64, found: Found, fitted: Fitted) -> Estimate {
        let stretch: Vec<f64> = found.free.iter().zip(&found.scale).map(|(&k, s)| self.priors[k].stretch / s).collect();
        let (samples, count) = (found.samples, found.free.len());
        // By rows, as squares lose directions that only the priors determine.
        let rows = DMatrix::from_fn(samples + count, count, |row, a| match row.checked_sub(samples) {
            None => found.iterate.jacobian()[(row, a)] * stretch[a],
            Some(b) if a == b => 1.0 / self.priors[found.free[a]].deviation,
            Some(_) => 0.0,
        });
        let factor = rows.qr().r();
        let log_determinant: f64 = factor.diagonal().iter().map(|r| 2.0 * math::ln(r.abs())).sum();
        let values = self.values(&found.point);
        let log_prior: f64 = found.free.iter().map(|&k| self.priors[k].log(values[k])).sum();
        let unknowns = (count + fitted.count) as f64;
        let log_evidence =
            log + log_prior - self.log_choices + fitted.log_prior + 0.5 * unknowns * math::ln(std::f64::consts::TAU)
                - 0.5 * log_determinant
                - 0.5 * fitted.log_determinant;
        let mut deviations = vec![0.0; self.fit.globals.len()];
        if let Some(inverse) = factor.solve_upper_triangular(&DMatrix::identity(count, count)) {
            for (a, &k) in found.free.iter().enumerate().filter(|(_, k)| **k < self.fit.globals.len()) {
                deviations[k] = inverse.row(a).norm() * self.priors[k].stretch;
            }
        }
        Estimate {
            point: found.point,
            errors: fitted.errors,
            log_likelihood: log,
            log_evidence: Some(log_evidence).filter(|e| e.is_finite()),
            deviations,
            converged: found.converged,
        }
    }

    /// Returns the values of all unknowns: shared parameters, then initial states of each record.
    fn values(&self, point: &Point) -> Vec<f64> {
        point.globals.iter().chain(point.locals.iter().flatten()).copied().collect()
    }

    fn point(&self, values: &[f64]) -> Point {
        let mut rest = &values[self.fit.globals.len()..];
        let mut take = |count: usize| {
            let (first, others) = rest.split_at(count);
            rest = others;
            first.to_vec()
        };
        let locals = self.fit.pieces.iter().map(|p| take(p.locals.len())).collect();
        Point { globals: values[..self.fit.globals.len()].to_vec(), locals }
    }

    /// Returns bounds and scale of all unknowns, and whether each is fitted.
    fn unknowns(&self) -> Vec<([f64; 2], f64, bool)> {
        let of_globals = self.fit.globals.iter().map(|g| (g.bounds, g.scale, !g.is_pinned() && !g.is_stepped()));
        let locals = self.fit.pieces.iter().flat_map(|p| &p.locals);
        of_globals.chain(locals.map(|l| (l.bounds, l.scale, l.bounds[0] < l.bounds[1]))).collect()
    }

    /// Returns the indices of the unknowns that are fitted.
    pub fn free(&self) -> Vec<usize> {
        self.unknowns().iter().enumerate().filter(|(_, unknown)| unknown.2).map(|(k, _)| k).collect()
    }

    /// Returns for each of the unknowns that are fitted whether it stands at a bound at a point.
    pub fn at_bounds(&self, point: &Point) -> Vec<bool> {
        let (unknowns, values) = (self.unknowns(), self.values(point));
        self.free().iter().map(|&k| unknowns[k].0.contains(&values[k])).collect()
    }

    /// Returns the fit with the force of an error model in its records.
    pub fn along(&self, errors: &Errors) -> Fit<'_> {
        let mut fit = self.fit.clone();
        if let Errors::Force(_, motions) = errors {
            motions.iter().enumerate().for_each(|(piece, motion)| self.push(&mut fit, piece, motion));
        }
        fit
    }

    /// Returns the derivatives of the residuals of a record by the free unknowns that move it, each with its position
    /// among the free ones.
    pub fn moving<'f>(
        &self,
        free: &'f [usize],
        index: usize,
        found: &'f Residuals,
    ) -> impl Iterator<Item = (usize, Vec<f64>)> + 'f {
        let globals = self.fit.globals.len();
        let count = |piece: &Piece| piece.locals.len();
        let local = globals + self.fit.pieces[..index].iter().map(count).sum::<usize>();
        let next = local + count(&self.fit.pieces[index]);
        let column = move |&k: &usize| {
            let own = (local..next).contains(&k).then(|| globals + k - local);
            (k < globals).then_some(k).or(own)
        };
        let moves = move |(a, k): (usize, &usize)| Some((a, found.j[column(k)?].clone()));
        free.iter().enumerate().filter_map(moves)
    }

    /// Minimises the sum of squares of the whitened residuals in linear, scaled coordinates, with that of the distances
    /// of unknowns from the centres of their priors.
    fn descend(&self, fit: &Fit<'_>, errors: &Errors, begin: Begin, effort: Effort) -> Option<Found> {
        let unknowns = self.unknowns();
        let free = self.free();
        let mut values = self.values(&begin.point);
        // Scales of the size of the values keep steps and bounds in proportion.
        let scale: Vec<f64> = free.iter().map(|&k| positive(unknowns[k].1)).collect();
        let bounds: Vec<[f64; 2]> = free.iter().zip(&scale).map(|(&k, s)| unknowns[k].0.map(|b| b / s)).collect();
        let place = |values: &mut [f64], z: &[f64]| {
            for ((&k, z), s) in free.iter().zip(z).zip(&scale) {
                // Exactly at a bound, whatever the rounding of its scaled value.
                let bound = unknowns[k].0.into_iter().find(|bound| *z == bound / s);
                values[k] = bound.unwrap_or(z * s);
            }
        };
        let z: Vec<f64> =
            free.iter().zip(&scale).zip(&bounds).map(|((&k, s), b)| (values[k] / s).clamp(b[0], b[1])).collect();
        place(&mut values, &z);
        // Unknowns about whose value something is known; least squares is without priors.
        let centred: Vec<(usize, Prior)> = match errors {
            Errors::White => Vec::new(),
            _ => free.iter().map(|&k| self.priors[k]).enumerate().filter(|(_, p)| p.centre.is_some()).collect(),
        };
        let look = |values: &[f64]| {
            let mut all = fit.slopes(&self.point(values))?;
            errors.take_force_out_of(all.iter_mut().map(|piece| &mut piece.r));
            Some(all)
        };
        let whitened = |values: &[f64], all: &[Residuals]| {
            let (logarithms, mut residuals, mut jacobian) = self.whitened(errors, all, &free, &scale);
            let samples = residuals.len();
            residuals = residuals.resize_vertically(samples + centred.len(), 0.0);
            jacobian = jacobian.resize_vertically(samples + centred.len(), 0.0);
            for (row, (a, prior)) in centred.iter().enumerate() {
                let width = prior.stretch * prior.deviation;
                residuals[samples + row] = (values[free[*a]] - prior.centre.unwrap_or(0.0)) / width;
                jacobian[(samples + row, *a)] = scale[*a] / width;
            }
            (logarithms, residuals, jacobian)
        };
        let mut all = match begin.all.filter(|_| self.point(&values) == begin.point) {
            Some(all) => all,
            None => look(&values)?,
        };
        let (logarithms, residuals, jacobian) = whitened(&values, &all);
        let samples = residuals.len() - centred.len();
        let mut iterate = LeastSquares::new(bounds, z, residuals, jacobian);
        if let Some(damping) = begin.damping {
            iterate = iterate.damped(damping);
        }
        #[allow(clippy::cast_precision_loss)]
        let negligible = |iterate: &LeastSquares| {
            effort.negligible * (iterate.sum() / iterate.residuals().len().max(1) as f64).max(1.0)
        };
        let log = |iterate: &LeastSquares| -0.5 * (iterate.sum() + logarithms);
        let first = log(&iterate);
        let remaining = |iterate: &LeastSquares| iterate.full_step().map_or(f64::INFINITY, |full| full.predicted);
        let is_converged = |iterate: &LeastSquares| remaining(iterate) < negligible(iterate);
        let is_hopeless = |iterate: &LeastSquares| {
            effort.least > f64::NEG_INFINITY && log(iterate) + ALLOWANCE * 0.5 * remaining(iterate) < effort.least
        };
        let mut stalled = 0;
        for iteration in 0..effort.iterations {
            if iteration > 1 && is_hopeless(&iterate) || stalled >= LOOK {
                break;
            }
            let before = iterate.sum();
            let Some(step) = iterate.step() else { if iterate.reject(f64::NAN) { continue } else { break } };
            if step.predicted < negligible(&iterate) && is_converged(&iterate) {
                break;
            }
            let mut trial = values.clone();
            place(&mut trial, &step.to);
            let there = look(&trial).map(|all| (whitened(&trial, &all), all));
            let sum = there.as_ref().map_or(f64::INFINITY, |((_, residuals, _), _)| residuals.norm_squared());
            let ratio = (iterate.sum() - sum) / step.predicted;
            match there {
                Some(((_, residuals, jacobian), there)) if step.predicted > 0.0 && LeastSquares::accepts(ratio) => {
                    (values, all) = (trial, there);
                    iterate.accept(step.to, residuals, jacobian, ratio);
                }
                _ if iterate.reject(ratio) => {}
                _ => break,
            }
            stalled = if before - iterate.sum() > (effort.stalls)(before) { 0 } else { stalled + 1 };
        }
        let converged = is_converged(&iterate);
        Some(Found { point: self.point(&values), all, iterate, free, scale, logarithms, samples, first, converged })
    }

    /// Returns the sum of logarithms of variances, the whitened residuals of all records, and their derivatives by the
    /// free unknowns.
    fn whitened(
        &self,
        errors: &Errors,
        all: &[Residuals],
        free: &[usize],
        scale: &[f64],
    ) -> (f64, DVector<f64>, DMatrix<f64>) {
        let count: usize = all.iter().map(|piece| piece.r.len()).sum();
        let mut residuals = DVector::zeros(count);
        let mut jacobian = DMatrix::zeros(count, free.len());
        let (mut logarithms, mut from) = (0.0, 0);
        for (index, (piece, found)) in self.fit.pieces.iter().zip(all).enumerate() {
            let (moving, slopes): (Vec<usize>, Vec<Vec<f64>>) = self.moving(free, index, found).unzip();
            let mut columns = vec![found.r.clone()];
            columns.extend(slopes);
            logarithms += errors.whiten(piece, &self.channels, index, &mut columns);
            residuals.rows_mut(from, found.r.len()).copy_from_slice(&columns[0]);
            for (&a, column) in moving.iter().zip(&columns[1..]) {
                let scaled = DVector::from_column_slice(column) * scale[a];
                jacobian.view_mut((from, a), (column.len(), 1)).copy_from(&scaled);
            }
            from += found.r.len();
        }
        (logarithms, residuals, jacobian)
    }
}

/// Returns a point between two, at a share of the way.
fn between(from: &Point, to: &Point, share: f64) -> Point {
    let mix = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect::<Vec<f64>>();
    let locals = from.locals.iter().zip(&to.locals).map(|(a, b)| mix(a, b)).collect();
    Point { globals: mix(&from.globals, &to.globals), locals }
}

fn positive(scale: f64) -> f64 {
    if scale.is_finite() && scale > 0.0 { scale } else { 1.0 }
}

/// How far a descent goes.
#[derive(Clone, Copy)]
struct Effort {
    /// Largest number of iterations.
    iterations: usize,
    /// Predicted decrease of the sum of squares, relative to its mean per residual, below which it ends.
    negligible: f64,
    /// Log-likelihood that it must be able to reach.
    least: f64,
    /// Decrease of a sum of squares that is none: after several of these in a row it ends.
    stalls: fn(f64) -> f64,
}

impl Effort {
    /// To the end, in at most so many iterations.
    fn of(iterations: usize) -> Self {
        Self { iterations, negligible: CONVERGED, least: f64::NEG_INFINITY, stalls: |_| f64::NEG_INFINITY }
    }

    /// As far as rounds of parameters and hyperparameters go.
    fn round() -> Self {
        Self { stalls: |_| 2.0 * SETTLED, ..Self::of(ROUND_ITERATIONS) }
    }
}

/// Beginning of a descent.
struct Begin {
    point: Point,
    /// Residuals with their slopes there, without the force of the error model, where they are known.
    all: Option<Vec<Residuals>>,
    /// Damping at the end of an earlier descent.
    damping: Option<f64>,
}

impl Begin {
    fn at(point: Point) -> Self {
        Self { point, all: None, damping: None }
    }
}

/// End of a descent.
struct Found {
    point: Point,
    /// Residuals with their slopes there, without the force of the error model.
    all: Vec<Residuals>,
    iterate: LeastSquares,
    free: Vec<usize>,
    scale: Vec<f64>,
    logarithms: f64,
    /// Number of residuals, which the rows of the priors follow.
    samples: usize,
    /// Log-likelihood at the start, plus the logarithm of the density of the priors with a centre up to a constant.
    first: f64,
    converged: bool,
}

impl Found {
    fn log_likelihood(&self) -> f64 {
        -0.5 * (self.iterate.residuals().rows(0, self.samples).norm_squared() + self.logarithms)
    }
}

#[cfg(test)]
mod tests;
