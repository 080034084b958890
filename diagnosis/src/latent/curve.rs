//! The free curve: on which coordinate, and at which place, a missing force or a change of an input depends, without a
//! catalogue.
//!
//! Over each coordinate a force is a sum of bumps with free weights, over a delayed input a sum of delayed copies. The
//! weights are small and normal beforehand and are integrated out; so is what parameters and initial states can take
//! up.

use std::f64::consts::TAU;

use mops_math as math;
use mops_models::Moment;
use mops_outcome::diagnosis::Dependence;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::coordinates::{Coordinate, Value, coordinates};
use crate::estimation::{Errors, Estimate, Estimation, log_determinant};
use crate::fit::{Fit, Piece};
use crate::motion::Trajectory;

/// Share of the visited values below the first and above the last centre. Basis: the studies.
const OUTSIDE: f64 = 0.005;

/// Standard deviations of the weights that are tried, nominal forces. Basis: the studies.
const WEIGHTS: [f64; 4] = [0.005, 0.02, 0.06, 0.2];

/// Logarithms by which the deviation of the error model is tried smaller. Basis: the studies.
const SHRINKS: [f64; 6] = [0.0, -0.5, -1.0, -1.6, -2.3, -3.2];

/// Nats taken off every gain for the choice of the deviations. Basis: the logarithm of their number, about.
const CHOICE: f64 = 2.3;

/// Bumps over a coordinate, and copies of a delayed input.
const BUMPS: usize = 6;

/// Columns of a coordinate: the bumps, then the input itself at an input, else 0.
const COLUMNS: usize = BUMPS + 1;

/// Distance of neighbouring centres, relative to the values, up to which a coordinate does not move: rounding.
const STILL: f64 = 1e-12;

/// Points of a curve that is returned.
const POINTS: usize = 41;

impl Estimation<'_> {
    /// Returns the free curves on top of an estimate, the one with the largest gain first; `None` if a simulation
    /// fails.
    pub fn curves(&self, estimate: &Estimate) -> Option<Vec<Dependence>> {
        let fit = self.along(&estimate.errors);
        let mut slopes = fit.slopes(&estimate.point)?;
        estimate.errors.take_force_out_of(slopes.iter_mut().map(|piece| &mut piece.r));
        let trajectories = self.trajectories(&fit, estimate)?;
        let coordinates = coordinates(self, &trajectories);
        let free = self.free();
        let unknowns = slopes.iter().enumerate().map(|(index, piece)| self.moving(&free, index, piece).collect());
        let unknowns = Unknowns {
            columns: unknowns.collect(),
            precision: free.iter().map(|&k| self.priors[k].precision()).collect(),
        };
        let residuals = slopes.into_iter().map(|piece| piece.r).collect();
        Some(self.over(&coordinates, &estimate.errors, &trajectories, residuals, &unknowns))
    }

    /// Returns the free curves at a place on top of an estimate without what effects add to the residuals of each
    /// record, everything else fixed, from its fit and motions; `None` if a simulation fails.
    pub(super) fn curves_without(
        &self,
        estimate: &Estimate,
        (fit, trajectories): (&Fit<'_>, &[Trajectory]),
        place: &str,
        added: &[Vec<f64>],
    ) -> Option<Vec<Dependence>> {
        let mut coordinates = coordinates(self, trajectories);
        coordinates.retain(|coordinate| coordinate.names.place == place);
        let mut residuals = fit.all(&estimate.point)?;
        estimate.errors.take_force_out_of(residuals.iter_mut());
        for (residuals, added) in residuals.iter_mut().zip(added) {
            residuals.iter_mut().zip(added).for_each(|(r, added)| *r -= added);
        }
        let fixed = Unknowns { columns: vec![Vec::new(); residuals.len()], precision: Vec::new() };
        Some(self.over(&coordinates, &estimate.errors, trajectories, residuals, &fixed))
    }

    /// Returns the motion in each record of a fit at an estimate; `None` if a simulation fails.
    pub(super) fn trajectories(&self, fit: &Fit<'_>, estimate: &Estimate) -> Option<Vec<Trajectory>> {
        let trajectory = |piece: usize| Trajectory::new(fit, self.model, piece, &estimate.point).ok();
        (0..fit.pieces.len()).map(trajectory).collect()
    }

    /// Returns the free curves over coordinates for residuals beside unknowns, the one with the largest gain first.
    fn over(
        &self,
        coordinates: &[Coordinate],
        errors: &Errors,
        trajectories: &[Trajectory],
        residuals: Vec<Vec<f64>>,
        unknowns: &Unknowns,
    ) -> Vec<Dependence> {
        let (pieces, settings) = (&self.fit.pieces, &self.fit.subject.settings);
        let shape = |coordinate| Shape::new(coordinate, trajectories, settings.coverage.periods);
        let shapes: Vec<Shape> = coordinates.iter().filter_map(shape).collect();
        let free = unknowns.precision.len();
        let columns = free + COLUMNS * shapes.len();
        let record = |(index, residuals): (usize, Vec<f64>)| {
            let mut record = vec![(columns, residuals)];
            record.extend(unknowns.columns[index].iter().cloned());
            for (s, shape) in shapes.iter().enumerate() {
                let of = |b: usize| shape.response(b, &trajectories[index], &pieces[index]);
                record.extend((0..COLUMNS).map(|b| (free + COLUMNS * s + b, of(b))));
            }
            record
        };
        let records: Vec<Vec<(usize, Vec<f64>)>> = residuals.into_iter().enumerate().map(record).collect();
        let grid: Vec<Option<Reduced>> = SHRINKS
            .par_iter()
            .map(|&shrink| self.reduced(pieces, &errors.scaled(shrink), &records, columns, &unknowns.precision))
            .collect();
        let grid: Vec<Reduced> = grid.into_iter().flatten().collect();
        let least = |a: &(f64, Vec<f64>), b: &(f64, Vec<f64>)| a.0.total_cmp(&b.0);
        let gain = |(s, shape): (usize, &Shape)| {
            let (without, _) = grid.iter().filter_map(|reduced| reduced.with_curve(s, None)).min_by(least)?;
            let tried = grid.iter().flat_map(|reduced| WEIGHTS.map(|d| reduced.with_curve(s, Some(d))));
            let (penalty, mut weights) = tried.flatten().min_by(least)?;
            weights.truncate(BUMPS);
            let gain = 0.5 * (without - penalty) - CHOICE;
            Some(Dependence { gain, curve: shape.curve(&weights), ..shape.coordinate.names.clone() })
        };
        let mut curves: Vec<Dependence> = shapes.iter().enumerate().filter_map(gain).collect();
        curves.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        curves
    }

    /// Returns the normal equations of all columns under an error model, with the unknowns projected out.
    fn reduced(
        &self,
        pieces: &[Piece],
        errors: &Errors,
        records: &[Vec<(usize, Vec<f64>)>],
        columns: usize,
        precision: &[f64],
    ) -> Option<Reduced> {
        let mut gram = DMatrix::zeros(columns + 1, columns + 1);
        let mut logarithms = 0.0;
        for (index, (piece, record)) in pieces.iter().zip(records).enumerate() {
            let mut white: Vec<Vec<f64>> = record.iter().map(|(_, column)| column.clone()).collect();
            logarithms += errors.whiten(piece, &self.channels, index, &mut white);
            let matrix =
                DMatrix::from_columns(&white.iter().map(|c| DVector::from_column_slice(c)).collect::<Vec<_>>());
            let part = matrix.transpose() * &matrix;
            for (a, (at, _)) in record.iter().enumerate() {
                for (b, (to, _)) in record.iter().enumerate() {
                    gram[(*at, *to)] += part[(a, b)];
                }
            }
        }
        let free = precision.len();
        let mut unknowns = gram.view((0, 0), (free, free)).into_owned();
        for (k, precision) in precision.iter().enumerate() {
            unknowns[(k, k)] += precision;
        }
        let determinant = log_determinant(&unknowns);
        let across = gram.view((0, free), (free, columns + 1 - free)).into_owned();
        let rest = gram.view((free, free), (columns + 1 - free, columns + 1 - free)).into_owned();
        let rest = if free == 0 { rest } else { rest - across.transpose() * unknowns.cholesky()?.solve(&across) };
        let penalty = logarithms + rest[(rest.nrows() - 1, rest.ncols() - 1)] + determinant;
        Some(Reduced { rest, penalty, input_gain: self.fit.subject.settings.input_gain })
    }
}

/// Bumps over a coordinate.
struct Shape<'c> {
    coordinate: &'c Coordinate,
    centres: Vec<f64>,
    /// Standard deviation of a bump.
    width: f64,
}

impl<'c> Shape<'c> {
    /// Places the bumps over the visited values; `None` if the coordinate does not move, or does not cover so many
    /// turns.
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    fn new(coordinate: &'c Coordinate, trajectories: &[Trajectory], turns: f64) -> Option<Self> {
        let moments = || trajectories.iter().flat_map(|t| &t.moments);
        let count = BUMPS as f64;
        let (centres, width) = match &coordinate.value {
            Value::Delayed(_, step) => ((0..BUMPS).map(|b| b as f64 * step).collect(), *step),
            Value::Angle(state) => {
                let range = |[low, high]: [f64; 2], m: &Moment| [low.min(m.x[*state]), high.max(m.x[*state])];
                let [low, high] = moments().fold([f64::INFINITY, f64::NEG_INFINITY], range);
                if high - low < turns * TAU {
                    return None;
                }
                ((0..BUMPS).map(|b| b as f64 * TAU / count).collect(), TAU / count)
            }
            value => {
                let mut values: Vec<f64> = moments().map(|m| value.at(m)).collect();
                values.sort_by(f64::total_cmp);
                let quantile = |share: f64| values.get((share * (values.len() - 1) as f64).round() as usize).copied();
                let (low, high) = (quantile(OUTSIDE)?, quantile(1.0 - OUTSIDE)?);
                let step = (high - low) / (count - 1.0);
                if step.is_nan() || step <= STILL * low.abs().max(high.abs()) {
                    return None;
                }
                ((0..BUMPS).map(|b| low + b as f64 * step).collect(), step)
            }
        };
        Some(Self { coordinate, centres, width })
    }

    /// Returns the bump around a centre at a value.
    fn bump(&self, value: f64, centre: f64) -> f64 {
        let mut distance = (value - centre).abs();
        if matches!(self.coordinate.value, Value::Angle(_)) {
            distance = distance.min(TAU - distance);
        }
        math::exp(-0.5 * math::powi(distance / self.width, 2))
    }

    /// Returns points of the curve with these weights: over the visited values, or the gains of the delayed copies.
    #[allow(clippy::cast_precision_loss)]
    fn curve(&self, weights: &[f64]) -> Vec<[f64; 2]> {
        let size = self.coordinate.sign * self.coordinate.acts.last().map_or(1.0, |(_, size)| *size);
        let (first, last) = match self.coordinate.value {
            Value::Delayed(..) => {
                return self.centres.iter().zip(weights).map(|(delay, weight)| [*delay, weight * size]).collect();
            }
            Value::Angle(_) => (0.0, TAU),
            _ => (self.centres[0], self.centres[BUMPS - 1]),
        };
        let place = |k: usize| first + (last - first) * k as f64 / (POINTS - 1) as f64;
        let value = |x: f64| self.centres.iter().zip(weights).map(|(c, w)| w * self.bump(x, *c)).sum::<f64>() * size;
        (0..POINTS).map(place).map(|x| [x, value(x)]).collect()
    }

    /// Returns what a weight of 1 of a column adds to the residuals of a record.
    fn response(&self, column: usize, trajectory: &Trajectory, piece: &Piece) -> Vec<f64> {
        let Some(&centre) = self.centres.get(column) else {
            let input = match &self.coordinate.value {
                Value::Input(_) | Value::Delayed(..) => self.coordinate.acts[0].0,
                _ => return vec![0.0; piece.series.iter().map(|s| s.times.len()).sum()],
            };
            let signal: Vec<f64> = trajectory.moments.iter().map(|m| m.u[input]).collect();
            return trajectory.response(input, &signal);
        };
        let value = |m: &Moment| match &self.coordinate.value {
            Value::Delayed(input, _) => piece.case.input(input).map_or(0.0, |input| input.at(m.t - centre)),
            value => self.bump(value.at(m), centre),
        };
        let shape: Vec<f64> = trajectory.moments.iter().map(value).collect();
        let mut sum: Option<Vec<f64>> = None;
        for (column, size) in &self.coordinate.acts {
            let signal: Vec<f64> = shape.iter().map(|s| s * size).collect();
            let response = trajectory.response(*column, &signal);
            match &mut sum {
                None => sum = Some(response),
                Some(sum) => sum.iter_mut().zip(response).for_each(|(s, r)| *s += r),
            }
        }
        sum.unwrap_or_default()
    }
}

/// What parameters and initial states can absorb: columns of each record by their positions, and precisions of their
/// priors.
struct Unknowns {
    columns: Vec<Vec<(usize, Vec<f64>)>>,
    precision: Vec<f64>,
}

/// Normal equations of the curves and the residuals, with the unknowns projected out.
struct Reduced {
    rest: DMatrix<f64>,
    /// Minus twice the log-evidence without a curve, up to a constant.
    penalty: f64,
    /// Prior standard deviation of the gain of an input.
    input_gain: f64,
}

impl Reduced {
    /// Returns minus twice the log-evidence with a curve whose weights have this deviation, none if `None`, and the
    /// most probable weights. The gain of an input is free in both.
    fn with_curve(&self, curve: usize, deviation: Option<f64>) -> Option<(f64, Vec<f64>)> {
        let (at, last) = (COLUMNS * curve, self.rest.nrows() - 1);
        let deviation = |b: usize| if b == BUMPS { self.input_gain } else { deviation.unwrap_or(0.0) };
        let matrix = DMatrix::from_fn(COLUMNS, COLUMNS, |a, b| {
            let unit = if a == b { 1.0 } else { 0.0 };
            unit + self.rest[(at + a, at + b)] * deviation(a) * deviation(b)
        });
        let pull = DVector::from_fn(COLUMNS, |b, _| self.rest[(at + b, last)] * deviation(b));
        let determinant = log_determinant(&matrix);
        let weights = matrix.cholesky()?.solve(&pull);
        let penalty = self.penalty - pull.dot(&weights) + determinant;
        penalty.is_finite().then(|| (penalty, weights.iter().enumerate().map(|(b, w)| -w * deviation(b)).collect()))
    }
}
