//! The free curve: on which coordinate, and at which place, a missing force or a change of an input depends, without a catalogue.
//!
//! Over each coordinate a force is a sum of bumps with free weights, over a delayed input a sum of delayed copies. The weights are
//! small and normal beforehand and are integrated out; so is what parameters and initial states can take up.

use std::f64::consts::TAU;

use mops_core::effect::Port;
use mops_language::Unit;
use mops_math as math;
use mops_models::Moment;
use mops_outcome::diagnosis::Dependence;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::errors::Errors;
use super::estimate::{Estimate, Estimation};
use super::scoring::log_determinant;
use crate::fit::{Fit, Piece};
use crate::settings::settings;
use crate::trace_of::{Spot, spot};
use crate::trajectory::Trajectory;

/// Bumps over a coordinate, and copies of a delayed input.
const BUMPS: usize = 6;

/// Columns of a coordinate: the bumps, then the input itself at an input, else 0.
const COLUMNS: usize = BUMPS + 1;

/// Distance of neighbouring centres, relative to the values, up to which a coordinate does not move: rounding.
const STILL: f64 = 1e-12;

/// Points of a curve that is returned.
const POINTS: usize = 41;

/// Coordinate with the places at which the force over it acts.
struct Coordinate {
    /// What is returned of it, without gain and curve.
    names: Dependence,
    value: Value,
    /// Columns of the linear system with the size of a weight of 1; a force between two places acts on the second last.
    acts: Vec<(usize, f64)>,
    /// Sign that a positive force has in its column.
    sign: f64,
}

/// Value of a coordinate at an instant.
enum Value {
    State(usize),
    Difference(usize, usize),
    Angle(usize),
    Input(usize),
    /// Delayed input, by its index and its name, with the delay from one copy to the next, s.
    Delayed(String, f64),
}

impl Value {
    fn at(&self, moment: &Moment) -> f64 {
        match *self {
            Self::State(k) => moment.x[k],
            Self::Difference(a, b) => moment.x[a] - moment.x[b],
            Self::Angle(k) => moment.x[k].rem_euclid(TAU),
            Self::Input(k) => moment.u[k],
            Self::Delayed(..) => 0.0,
        }
    }
}

impl Estimation<'_> {
    /// Returns the free curves on top of an estimate, the one with the largest gain first; `None` if a simulation fails.
    pub fn curves(&self, estimate: &Estimate) -> Option<Vec<Dependence>> {
        let fit = self.along(&estimate.errors);
        let mut slopes = fit.slopes(&estimate.point)?;
        estimate.errors.take_force_out_of(&mut slopes);
        let trajectory = |piece: usize| Trajectory::new(&fit, self.model, piece, &estimate.point).ok();
        let trajectories: Vec<Trajectory> = (0..fit.pieces.len()).map(trajectory).collect::<Option<_>>()?;
        let coordinates = self.coordinates(&fit, &trajectories);
        let shapes: Vec<Shape> = coordinates.iter().filter_map(|c| Shape::new(c, &trajectories)).collect();
        let free = self.free();
        let columns = free.len() + COLUMNS * shapes.len();
        let records: Vec<Vec<(usize, Vec<f64>)>> = (0..fit.pieces.len())
            .map(|index| {
                let mut record = vec![(columns, slopes[index].r.clone())];
                record.extend(self.moving(&free, index, &slopes[index]));
                for (s, shape) in shapes.iter().enumerate() {
                    let of = |b: usize| shape.response(b, &trajectories[index], &fit.pieces[index]);
                    record.extend((0..COLUMNS).map(|b| (free.len() + COLUMNS * s + b, of(b))));
                }
                record
            })
            .collect();
        let precision: Vec<f64> = free.iter().map(|&k| self.priors[k].precision()).collect();
        let grid: Vec<Option<Reduced>> = settings()
            .shrinks
            .par_iter()
            .map(|&shrink| self.reduced(&fit.pieces, &estimate.errors.scaled(shrink), &records, columns, &precision))
            .collect();
        let grid: Vec<Reduced> = grid.into_iter().flatten().collect();
        let least = |a: &(f64, Vec<f64>), b: &(f64, Vec<f64>)| a.0.total_cmp(&b.0);
        let gain = |(s, shape): (usize, &Shape)| {
            let (without, _) = grid.iter().filter_map(|reduced| reduced.with_curve(s, None)).min_by(least)?;
            let tried = grid.iter().flat_map(|reduced| settings().weights.map(|d| reduced.with_curve(s, Some(d))));
            let (penalty, mut weights) = tried.flatten().min_by(least)?;
            weights.truncate(BUMPS);
            let gain = 0.5 * (without - penalty) - settings().choice;
            Some(Dependence { gain, curve: shape.curve(&weights), ..shape.coordinate.names.clone() })
        };
        let mut curves: Vec<Dependence> = shapes.iter().enumerate().filter_map(gain).collect();
        curves.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        Some(curves)
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
        let rest = rest - across.transpose() * unknowns.cholesky()?.solve(&across);
        let penalty = logarithms + rest[(rest.nrows() - 1, rest.ncols() - 1)] + determinant;
        Some(Reduced { rest, penalty })
    }

    /// Returns all coordinates of the model.
    fn coordinates(&self, fit: &Fit<'_>, trajectories: &[Trajectory]) -> Vec<Coordinate> {
        let interface = self.model.model().interface();
        let states = self.model.model().equation_states();
        let (inputs, Some(piece)) = (interface.inputs.len(), fit.pieces.first()) else { return Vec::new() };
        let mut all = Vec::new();
        // Joints and stores: place, force, and the states over which it acts.
        let (mut joints, mut stores) = (Vec::new(), Vec::new());
        for port in &interface.ports {
            match spot(port, self.model, piece) {
                Some(Spot::Joint(force, position, speed)) => joints.push((port, force, position, speed)),
                Some(Spot::Process(force, state)) => stores.push((port, force, state)),
                Some(Spot::Actuator(input)) => {
                    let values = || trajectories.iter().flat_map(|t| &t.moments).map(|m| m.u[input]);
                    let amplitude = deviation(values());
                    if amplitude > 0.0 {
                        let unit = &interface.inputs[input].unit;
                        let own = names("input", port, None, unit, Some(unit));
                        all.push(Coordinate {
                            names: own,
                            value: Value::Input(input),
                            acts: vec![(input, amplitude)],
                            sign: 1.0,
                        });
                        let delayed = names("delayed input", port, None, &Unit::known("s"), Some(&Unit::one()));
                        let value = Value::Delayed(interface.inputs[input].name.clone(), self.channels.shortest_step());
                        all.push(Coordinate { names: delayed, value, acts: vec![(input, 1.0)], sign: 1.0 });
                    }
                }
                _ => {}
            }
        }
        let mobilities = trajectories.first().map_or(&[][..], |t| &t.mobilities);
        let nominal = |force: usize| (self.nominal[force] / mobilities[force]).abs();
        let own = |force: usize| vec![(inputs + force, nominal(force))];
        let sign = |force: usize| trajectories.first().map_or(1.0, |t| t.forward[force]);
        let is_angle = |state: usize| states[state].unit == Unit::known("rad");
        for (port, force, position, speed) in &joints {
            let mut add = |what: &str, state: usize, value| {
                let names = names(what, port, None, &states[state].unit, force_unit(port));
                all.push(Coordinate { names, value, acts: own(*force), sign: sign(*force) });
            };
            add("speed", *speed, Value::State(*speed));
            add("position", *position, Value::State(*position));
            if is_angle(*position) {
                add("position modulo one turn", *position, Value::Angle(*position));
            }
        }
        let is_joint = |force: usize| joints.iter().any(|joint| joint.1 == force);
        for (port, force, state) in stores.iter().filter(|store| !is_joint(store.1)) {
            let names = names("level", port, None, &states[*state].unit, force_unit(port));
            all.push(Coordinate { names, value: Value::State(*state), acts: own(*force), sign: sign(*force) });
        }
        // Between two places of a kind the force acts on one and back on the other.
        let between = |a: usize, b: usize| {
            let nominal = nominal(a).min(nominal(b));
            vec![(inputs + a, -nominal), (inputs + b, nominal)]
        };
        for (k, (port, force, position, speed)) in joints.iter().enumerate() {
            for (other, other_force, other_position, other_speed) in &joints[k + 1..] {
                if states[*position].unit != states[*other_position].unit || same_unit(port, other) == Some(false) {
                    continue;
                }
                let mut add = |what: &str, state: usize, value| {
                    let names = names(what, port, Some(other), &states[state].unit, force_unit(port));
                    all.push(Coordinate {
                        names,
                        value,
                        acts: between(*force, *other_force),
                        sign: sign(*other_force),
                    });
                };
                add("deflection", *position, Value::Difference(*position, *other_position));
                add("rate of deflection", *speed, Value::Difference(*speed, *other_speed));
            }
        }
        let stores: Vec<_> = stores.iter().filter(|store| !is_joint(store.1)).collect();
        for (port, force, state) in &stores {
            for (other, other_force, other_state) in stores.iter().filter(|other| other.1 != *force) {
                if states[*state].unit == states[*other_state].unit && same_unit(port, other) != Some(false) {
                    let names = names("level", port, Some(other), &states[*state].unit, force_unit(port));
                    all.push(Coordinate {
                        names,
                        value: Value::State(*state),
                        acts: between(*force, *other_force),
                        sign: sign(*other_force),
                    });
                }
            }
        }
        all
    }
}

/// Returns the names and units of a coordinate.
fn names(what: &str, place: &Port, other: Option<&Port>, unit: &Unit, signal_unit: Option<&Unit>) -> Dependence {
    Dependence {
        coordinate: what.to_owned(),
        place: place.to_string(),
        other: other.map(ToString::to_string),
        gain: 0.0,
        unit: unit.to_string(),
        signal_unit: signal_unit.map(ToString::to_string).unwrap_or_default(),
        curve: Vec::new(),
    }
}

/// Returns the unit of the force at a place, if the model determines it.
fn force_unit(port: &Port) -> Option<&Unit> {
    match port {
        Port::Joint { unit, .. } | Port::Process { unit, .. } => unit.as_ref(),
        _ => None,
    }
}

/// Returns whether the forces at two places have one unit, if both are known.
fn same_unit(a: &Port, b: &Port) -> Option<bool> {
    Some(force_unit(a)? == force_unit(b)?)
}

#[allow(clippy::cast_precision_loss)]
fn deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / count;
    (values.map(|v| math::powi(v - mean, 2)).sum::<f64>() / count).sqrt()
}

/// Bumps over a coordinate.
struct Shape<'c> {
    coordinate: &'c Coordinate,
    centres: Vec<f64>,
    /// Standard deviation of a bump.
    width: f64,
}

impl<'c> Shape<'c> {
    /// Places the bumps over the visited values; `None` if the coordinate does not move, or does not cover enough turns.
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    fn new(coordinate: &'c Coordinate, trajectories: &[Trajectory]) -> Option<Self> {
        let moments = || trajectories.iter().flat_map(|t| &t.moments);
        let count = BUMPS as f64;
        let (centres, width) = match &coordinate.value {
            Value::Delayed(_, step) => ((0..BUMPS).map(|b| b as f64 * step).collect(), *step),
            Value::Angle(state) => {
                let range = |[low, high]: [f64; 2], m: &Moment| [low.min(m.x[*state]), high.max(m.x[*state])];
                let [low, high] = moments().fold([f64::INFINITY, f64::NEG_INFINITY], range);
                if high - low < settings().periods_seen * TAU {
                    return None;
                }
                ((0..BUMPS).map(|b| b as f64 * TAU / count).collect(), TAU / count)
            }
            value => {
                let mut values: Vec<f64> = moments().map(|m| value.at(m)).collect();
                values.sort_by(f64::total_cmp);
                let quantile = |share: f64| values.get((share * (values.len() - 1) as f64).round() as usize).copied();
                let (low, high) = (quantile(settings().outside)?, quantile(1.0 - settings().outside)?);
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

/// Normal equations of the curves and the residuals, with the unknowns projected out.
struct Reduced {
    rest: DMatrix<f64>,
    /// Minus twice the log-evidence without a curve, up to a constant.
    penalty: f64,
}

impl Reduced {
    /// Returns minus twice the log-evidence with a curve whose weights have this deviation, none if `None`, and the most probable
    /// weights. The gain of an input is free in both.
    fn with_curve(&self, curve: usize, deviation: Option<f64>) -> Option<(f64, Vec<f64>)> {
        let (at, last) = (COLUMNS * curve, self.rest.nrows() - 1);
        let deviation = |b: usize| if b == BUMPS { settings().input_gain } else { deviation.unwrap_or(0.0) };
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
