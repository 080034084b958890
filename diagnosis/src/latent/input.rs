//! Course of what is missing at a place: the smooth force of the force error at a balance, the smooth error at a
//! sensor.
//!
//! Where effects were added, their formulas are drawn: over time beside formula plus remainder, a
//! component-plus-residual plot, and over a coordinate beside the free curve on top of the set without them. Where the
//! formula is right, both agree.
//!
//! Source: F. R. Wood, The use of individual effects and residuals in fitting equations to data, Technometrics 15
//! (1973) 677.

use mops_core::effect::Port;
use mops_language::Unit;
use mops_outcome::diagnosis::{Curve, Dependence, LatentInput};

use super::coordinates::{Coordinate, coordinates};
use crate::candidates::Candidate;
use crate::error_models::{ForceError, LinearisedMotion, Measured, OutputError};
use crate::estimation::{ErrorModel, Errors, Estimate, Estimation};
use crate::fit::{Fit, Point};
use crate::motion::{PortIndex, Trajectory, View, between, port_index};
use crate::selection::FittedSet;

/// Points of a course that are kept; more are thinned out evenly.
const POINTS: usize = 800;

/// Returns the latent inputs at places, by their ports: on top of a set, with its effects there, or of the declared
/// model where it has none or they cannot be drawn. A place without balance and sensor has none.
pub fn latent_inputs(ports: &[&Port], [declared, set]: [&FittedSet<'_>; 2], nominal: &[f64]) -> Vec<LatentInput> {
    let of = |port: &&Port| {
        let here: Vec<usize> = (0..set.added.len()).filter(|&k| set.added[k].candidate.port == **port).collect();
        if !here.is_empty() && here.iter().all(|&k| can_be_drawn(&set.added[k].candidate)) {
            Course { set, nominal, port, effects: &here }.latent_input()
        } else {
            Course { set: declared, nominal, port, effects: &[] }.latent_input()
        }
    };
    ports.iter().filter_map(of).collect()
}

/// Returns true if the formula of an effect can be drawn along a motion that has it already: inertia adds to the
/// acceleration that it changes, and the states of others begin where a fit put them.
fn can_be_drawn(candidate: &Candidate) -> bool {
    let effect = candidate.effect.as_ref();
    !effect.is_inertial() && effect.states() == 0
}

/// Course at a place on top of a set at its optimum under the error model of the place.
struct Course<'c, 'a> {
    set: &'c FittedSet<'a>,
    /// Nominal rates of the balances.
    nominal: &'c [f64],
    port: &'c Port,
    /// Effects at the place, by their positions in the set.
    effects: &'c [usize],
}

/// Instants of a record with what is missing there, and with the effects found.
struct Remainder {
    /// Since the beginning of the record, s.
    times: Vec<f64>,
    /// Remainder in the unit of the place.
    missing: Vec<f64>,
    /// What the effects add with their parameters under the error model.
    fitted: Vec<f64>,
    /// What they add with those of least squares, which are reported.
    found: Vec<f64>,
}

impl Course<'_, '_> {
    /// Returns the course in all records, over time and over the coordinates of the place; `None` if it has none.
    fn latent_input(&self) -> Option<LatentInput> {
        let kind = match self.port {
            Port::Joint { .. } | Port::Process { .. } => ErrorModel::Force,
            Port::Sensor { .. } => ErrorModel::SmoothOutput,
            Port::Actuator { .. } => return None,
        };
        let (set, model) = (self.set, &self.set.variant.model);
        let Estimate { point, errors, .. } = set.estimate(kind)?;
        let estimation = set.estimation(self.nominal);
        let fit = estimation.along(errors);
        let along = |piece: usize| Trajectory::new(&fit, model, piece, point).ok();
        let trajectories: Vec<Trajectory> = (0..fit.pieces.len()).map(along).collect::<Option<_>>()?;
        let place = self.port.to_string();
        let at_place = |c: &Coordinate| c.names.place == place && c.names.other.is_none() && c.value.is_local();
        let coordinates: Vec<Coordinate> =
            coordinates(&estimation, &trajectories).into_iter().filter(at_place).collect();
        let curves = self.curves(&estimation, &fit, &trajectories).unwrap_or_default();
        let mut over_time = Vec::new();
        let mut over: Vec<Curve> = vec![Curve::default(); coordinates.len()];
        for (piece, trajectory) in trajectories.iter().enumerate() {
            let remainder = match (errors, port_index(self.port, model, &fit.pieces[piece])) {
                (Errors::Force(_, motions), Some(PortIndex::Joint(w, ..) | PortIndex::Process(w, _))) => {
                    let forces = motions[piece].forces.iter().skip(w).step_by(self.nominal.len());
                    let size = trajectory.forward[w] * self.nominal[w] / trajectory.mobilities[w];
                    let times = &motions[piece].linearised.times;
                    self.of_forces(&fit, piece, trajectory, times, forces.map(|f| f * size).collect())
                }
                (Errors::Output(errors), Some(PortIndex::Sensor(series))) => {
                    let error = &errors[estimation.channels.of(piece, series)];
                    self.at_sensor(&fit, piece, series, trajectory, error)
                }
                _ => None,
            };
            let Some(Remainder { times, missing, fitted, found }) = remainder else { continue };
            let thin = |values: Vec<f64>| -> Vec<f64> {
                let step = times.len().div_ceil(POINTS).max(1);
                values.into_iter().step_by(step).collect()
            };
            let estimated = thin(missing.iter().enumerate().map(|(k, m)| m + fitted.get(k).unwrap_or(&0.0)).collect());
            let found = thin(found);
            for (coordinate, curve) in coordinates.iter().zip(&mut over) {
                let moments: Vec<f64> = trajectory.moments.iter().map(|m| m.t).collect();
                let values: Vec<f64> = trajectory.moments.iter().map(|m| coordinate.value.at(m)).collect();
                let x = thin(times.iter().map(|&t| between(&moments, &values, t)).collect());
                let free = curves.iter().find(|free| free.coordinate == coordinate.names.coordinate);
                curve.estimated.extend(free.map_or_else(|| estimated.clone(), |free| at(free, &x)));
                curve.x.extend(x);
                curve.found.extend_from_slice(&found);
            }
            let begins = fit.pieces[piece].case.begins;
            let x = thin(times.iter().map(|t| begins + t).collect());
            let name = &fit.subject.measurements[fit.pieces[piece].measurement].name;
            over_time.push((name.clone(), Curve { x, estimated, found }));
        }
        if over_time.is_empty() {
            return None;
        }
        let named = |(c, curve): (Coordinate, Curve)| (c.names.coordinate, c.names.unit, curve);
        Some(LatentInput {
            place,
            unit: self.unit().map(|unit| unit.to_string()).unwrap_or_default(),
            over_time,
            over: coordinates.into_iter().zip(over).map(named).collect(),
        })
    }

    /// Returns the free curves at a balance on top of the set without its effects there, everything else fixed.
    fn curves(&self, estimation: &Estimation<'_>, fit: &Fit<'_>, along: &[Trajectory]) -> Option<Vec<Dependence>> {
        let estimate = self.set.estimate(ErrorModel::Force).filter(|_| !self.effects.is_empty())?;
        let of = |piece: usize| -> Option<Vec<f64>> {
            let samples = fit.pieces[piece].series.iter().map(|s| s.times.len()).sum();
            let mut sum = vec![0.0; samples];
            for (view, strengths) in self.views(fit, piece, &along[piece], &estimate.point)? {
                sum.iter_mut().zip(view.trace(&strengths)?).for_each(|(sum, trace)| *sum += trace);
            }
            Some(sum)
        };
        let added: Option<Vec<Vec<f64>>> = (0..along.len()).map(of).collect();
        estimation.curves_without(estimate, &self.port.to_string(), &added?)
    }

    /// Returns the unit of the place, if the model determines it.
    fn unit(&self) -> Option<Unit> {
        let interface = self.set.variant.model.model().interface();
        match self.port {
            Port::Joint { unit, .. } | Port::Process { unit, .. } => unit.clone(),
            Port::Sensor { output: name } | Port::Actuator { input: name } => {
                let mut all = interface.signals.iter().chain(&interface.inputs);
                all.find(|variable| variable.name == *name).map(|variable| variable.unit.clone())
            }
        }
    }

    /// Returns the views of the effects in a record, with their parameters at a point.
    fn views<'v>(
        &'v self,
        fit: &'v Fit<'_>,
        piece: usize,
        trajectory: &'v Trajectory,
        point: &Point,
    ) -> Option<Vec<(View<'v>, Vec<f64>)>> {
        let set = self.set;
        let view = |&index: &usize| {
            let candidate = &set.added[index].candidate;
            let count = candidate.effect.parameters().len();
            let strengths = set.variant.strengths(&set.fit, point, index, count, piece);
            Some((View::new(candidate, &set.variant.model, &fit.pieces[piece], trajectory)?, strengths))
        };
        self.effects.iter().map(view).collect()
    }

    /// Returns what the effects add in a record with the parameters of a point, in the unit of the place, at the nodes
    /// of its motion or the samples of its sensor.
    fn added(&self, fit: &Fit<'_>, piece: usize, trajectory: &Trajectory, point: &Point) -> Option<Vec<f64>> {
        let mut sum = Vec::new();
        for (view, strengths) in self.views(fit, piece, trajectory, point)? {
            let added = view.added(&strengths)?;
            sum.resize(sum.len().max(added.len()), 0.0);
            sum.iter_mut().zip(added).for_each(|(sum, added)| *sum += added);
        }
        Some(sum)
    }

    /// Returns the forces of a record, which are kept from sample to sample, in the middle of these.
    fn of_forces(
        &self,
        fit: &Fit<'_>,
        piece: usize,
        trajectory: &Trajectory,
        samples: &[f64],
        mut missing: Vec<f64>,
    ) -> Option<Remainder> {
        let times: Vec<f64> = samples.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
        missing.truncate(times.len());
        let moments: Vec<f64> = trajectory.moments.iter().map(|m| m.t).collect();
        let of = |point: &Point| -> Option<Vec<f64>> {
            let added = self.added(fit, piece, trajectory, point)?;
            // Nothing where they do not act.
            let added = if added.is_empty() { vec![0.0; moments.len()] } else { added };
            Some(times.iter().map(|&t| between(&moments, &added, t)).collect())
        };
        let [fitted, found] = self.with_effects(of, ErrorModel::Force)?;
        Some(Remainder { times, missing, fitted, found })
    }

    /// Returns the smoothed error of a sensor in a record.
    fn at_sensor(
        &self,
        fit: &Fit<'_>,
        piece: usize,
        series: usize,
        trajectory: &Trajectory,
        error: &OutputError,
    ) -> Option<Remainder> {
        let samples = &fit.pieces[piece].series[series];
        // What the model lacks: measured minus simulated.
        let predicted = &trajectory.predicted[series];
        let lacking: Vec<f64> = samples.values.iter().zip(predicted).map(|(y, p)| (y - p) / samples.noise).collect();
        let missing = smoothed(error, &samples.times, &lacking).into_iter().map(|e| e * samples.noise).collect();
        let count = samples.times.len();
        let of = |point: &Point| -> Option<Vec<f64>> {
            let mut added = self.added(fit, piece, trajectory, point)?;
            added.resize(count, 0.0);
            Some(added)
        };
        let [fitted, found] = self.with_effects(of, ErrorModel::SmoothOutput)?;
        Some(Remainder { times: samples.times.clone(), missing, fitted, found })
    }

    /// Returns what is computed at the optimum under an error model and at that of least squares; nothing without
    /// effects.
    fn with_effects(&self, of: impl Fn(&Point) -> Option<Vec<f64>>, kind: ErrorModel) -> Option<[Vec<f64>; 2]> {
        if self.effects.is_empty() {
            return Some([Vec::new(), Vec::new()]);
        }
        Some([of(&self.set.estimate(kind)?.point)?, of(&self.set.least_squares.point)?])
    }
}

/// Returns the most probable smooth errors of a channel behind its residuals: a force that acts on the output alone.
fn smoothed(error: &OutputError, times: &[f64], residuals: &[f64]) -> Vec<f64> {
    let measured = |residual| vec![Measured { channel: 0, residual, slopes: vec![1.0, 0.0] }];
    let motion = LinearisedMotion {
        times: times.to_vec(),
        forces: 1,
        measured: (0..times.len()).map(measured).collect(),
        ..LinearisedMotion::default()
    };
    let OutputError { deviation, length, noise, .. } = *error;
    ForceError { deviation, length, noise: vec![noise] }.smooth(&motion, residuals)
}

/// Returns the values of a curve, at its ends beyond these.
fn at(curve: &Dependence, x: &[f64]) -> Vec<f64> {
    let [places, values] = [0, 1].map(|k| curve.curve.iter().map(|point| point[k]).collect::<Vec<f64>>());
    x.iter().map(|&x| between(&places, &values, x)).collect()
}
