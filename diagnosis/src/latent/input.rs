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
            latent_input(set, nominal, port, &here)
        } else {
            latent_input(declared, nominal, port, &[])
        }
    };
    ports.iter().filter_map(of).collect()
}

/// Returns the latent input at a place on top of a set, with effects there by their positions in the set; `None` if
/// the place has none, or the error model of the place was not fitted.
fn latent_input(set: &FittedSet<'_>, nominal: &[f64], port: &Port, effects: &[usize]) -> Option<LatentInput> {
    let kind = match port {
        Port::Joint { .. } | Port::Speed { .. } | Port::Process { .. } => ErrorModel::Force,
        Port::Sensor { .. } => ErrorModel::SmoothOutput,
        Port::Actuator { .. } => return None,
    };
    let (estimate, estimation) = (set.estimate(kind)?, set.estimation(nominal));
    let fit = estimation.along(&estimate.errors);
    let trajectories = estimation.trajectories(&fit, estimate)?;
    let (estimation, fit, trajectories) = (&estimation, &fit, &trajectories);
    Course { set, estimate, estimation, fit, trajectories, port, effects }.latent_input()
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
    /// Fit under the error model of the place.
    estimate: &'c Estimate,
    estimation: &'c Estimation<'c>,
    /// Fit with the force of the error model in its records.
    fit: &'c Fit<'c>,
    /// Motion in each record.
    trajectories: &'c [Trajectory],
    port: &'c Port,
    /// Effects at the place, by their positions in the set.
    effects: &'c [usize],
}

/// Instants of a record with what is missing there, and with the effects found; these are empty without effects.
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
        let place = self.port.to_string();
        let at_place = |c: &Coordinate| c.names.place == place && c.names.other.is_none() && c.value.is_local();
        let coordinates: Vec<Coordinate> =
            coordinates(self.estimation, self.trajectories).into_iter().filter(at_place).collect();
        let curves = self.curves().unwrap_or_default();
        let mut over_time = Vec::new();
        let mut over: Vec<Curve> = vec![Curve::default(); coordinates.len()];
        for (index, (piece, trajectory)) in self.fit.pieces.iter().zip(self.trajectories).enumerate() {
            let Some(Remainder { times, missing, fitted, found }) = self.remainder(index) else { continue };
            let thin = |values: Vec<f64>| -> Vec<f64> {
                let step = times.len().div_ceil(POINTS).max(1);
                values.into_iter().step_by(step).collect()
            };
            let estimated = thin(missing.iter().enumerate().map(|(k, m)| m + fitted.get(k).unwrap_or(&0.0)).collect());
            let found = thin(found);
            for (coordinate, curve) in coordinates.iter().zip(&mut over) {
                let values: Vec<f64> = trajectory.moments.iter().map(|m| coordinate.value.at(m)).collect();
                let x = thin(at_times(trajectory, &values, &times));
                let free = curves.iter().find(|free| free.coordinate == coordinate.names.coordinate);
                curve.estimated.extend(free.map_or_else(|| estimated.clone(), |free| at(free, &x)));
                curve.x.extend(x);
                curve.found.extend_from_slice(&found);
            }
            let x = thin(times.iter().map(|t| piece.case.begins + t).collect());
            let name = self.set.fit.subject.measurements[piece.measurement].name.clone();
            over_time.push((name, Curve { x, estimated, found }));
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

    /// Returns the unit of the place, if the model determines it.
    fn unit(&self) -> Option<Unit> {
        let interface = self.set.variant.model.model().interface();
        match self.port {
            Port::Joint { unit, .. } | Port::Speed { unit, .. } | Port::Process { unit, .. } => unit.clone(),
            Port::Sensor { output: name } | Port::Actuator { input: name } => {
                let mut all = interface.signals.iter().chain(&interface.inputs);
                all.find(|variable| variable.name == *name).map(|variable| variable.unit.clone())
            }
        }
    }

    /// Returns the views of the effects in a record, with their parameters at a point.
    fn views(&self, index: usize, point: &Point) -> Option<Vec<(View<'_>, Vec<f64>)>> {
        let set = self.set;
        let view = |&effect: &usize| {
            let candidate = &set.added[effect].candidate;
            let count = candidate.effect.parameters().len();
            let strengths = set.variant.strengths(&set.fit, point, effect, count, index);
            let (piece, along) = (&self.fit.pieces[index], &self.trajectories[index]);
            Some((View::new(candidate, &set.variant.model, piece, along)?, strengths))
        };
        self.effects.iter().map(view).collect()
    }

    /// Returns the sum of what the effects do in a record with their parameters at a point, over
    /// so many values.
    fn sum(
        &self,
        index: usize,
        point: &Point,
        length: usize,
        of: impl Fn(&View<'_>, &[f64]) -> Option<Vec<f64>>,
    ) -> Option<Vec<f64>> {
        let mut sum = vec![0.0; length];
        for (view, strengths) in self.views(index, point)? {
            // Nothing where it does not act.
            sum.iter_mut().zip(of(&view, &strengths)?).for_each(|(sum, own)| *sum += own);
        }
        Some(sum)
    }

    /// Returns the free curves at a balance on top of the set without its effects there, everything else fixed.
    fn curves(&self) -> Option<Vec<Dependence>> {
        if self.effects.is_empty() || !matches!(self.estimate.errors, Errors::Force(..)) {
            return None;
        }
        let of = |index: usize| {
            let samples = self.fit.pieces[index].series.iter().map(|s| s.times.len()).sum();
            self.sum(index, &self.estimate.point, samples, |view, strengths| view.trace(strengths))
        };
        let added: Vec<Vec<f64>> = (0..self.trajectories.len()).map(of).collect::<Option<_>>()?;
        let place = self.port.to_string();
        self.estimation.curves_without(self.estimate, (self.fit, self.trajectories), &place, &added)
    }

    /// Returns what is missing in a record; `None` where the place is not measured.
    fn remainder(&self, index: usize) -> Option<Remainder> {
        let (piece, trajectory) = (&self.fit.pieces[index], &self.trajectories[index]);
        match (&self.estimate.errors, port_index(self.port, &self.set.variant.model, piece)?) {
            (
                Errors::Force(_, motions),
                PortIndex::Joint(w, ..) | PortIndex::Speed(w, _) | PortIndex::Process(w, _),
            ) => {
                let nominal = &self.estimation.nominal;
                let size = trajectory.forward[w] * nominal[w] / trajectory.mobilities[w];
                // Forces are kept from sample to sample: they are those of the middle.
                let samples = &motions[index].linearised.times;
                let times: Vec<f64> = samples.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
                let forces = motions[index].forces.iter().skip(w).step_by(nominal.len());
                let missing = forces.map(|f| f * size).take(times.len()).collect();
                let of = |point: &Point| -> Option<Vec<f64>> {
                    let nodes = trajectory.moments.len();
                    let added = self.sum(index, point, nodes, |view, strengths| view.added(strengths))?;
                    Some(at_times(trajectory, &added, &times))
                };
                let [fitted, found] = self.with_effects(of)?;
                Some(Remainder { times, missing, fitted, found })
            }
            (Errors::Output(errors), PortIndex::Sensor(series)) => {
                let samples = &piece.series[series];
                // What the model lacks: measured minus simulated.
                let lacking = samples.values.iter().zip(&trajectory.predicted[series]);
                let lacking: Vec<f64> = lacking.map(|(y, predicted)| (y - predicted) / samples.noise).collect();
                let smoothed = smoothed(&errors[self.estimation.channels.of(index, series)], &samples.times, &lacking);
                let missing = smoothed.into_iter().map(|e| e * samples.noise).collect();
                let count = samples.times.len();
                let of = |point: &Point| self.sum(index, point, count, |view, strengths| view.added(strengths));
                let [fitted, found] = self.with_effects(of)?;
                Some(Remainder { times: samples.times.clone(), missing, fitted, found })
            }
            _ => None,
        }
    }

    /// Returns what is computed at the optimum under the error model and at that of least squares; nothing without
    /// effects.
    fn with_effects(&self, of: impl Fn(&Point) -> Option<Vec<f64>>) -> Option<[Vec<f64>; 2]> {
        if self.effects.is_empty() {
            return Some([Vec::new(), Vec::new()]);
        }
        Some([of(&self.estimate.point)?, of(&self.set.least_squares.point)?])
    }
}

/// Returns values at the nodes of a motion read at other times.
fn at_times(trajectory: &Trajectory, values: &[f64], times: &[f64]) -> Vec<f64> {
    let nodes: Vec<f64> = trajectory.moments.iter().map(|m| m.t).collect();
    times.iter().map(|&t| between(&nodes, values, t)).collect()
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
