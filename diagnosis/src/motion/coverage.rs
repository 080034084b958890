//! Which candidates the records can show at all, decided before any of them is fitted.

use mops_core::{
    Variable,
    effect::{Characteristic, DeclaredTerm, Dimension, EffectParameter, InitialGrid, ParameterKind, Port},
};
use mops_models::{Moment, WithEffects};
use nalgebra::DMatrix;

use super::ports::{PortIndex, port_index};
use super::trajectory::Trajectory;
use crate::candidates::Candidate;
use crate::fit::Piece;
use crate::records::quantum;
use crate::settings::Coverage;

/// Share of the largest acceleration that a declared spring must have, and of the largest speed below which a motion is
/// at rest. Basis: an assumption.
const SLIGHT: f64 = 1e-3;

/// Relative difference of two slopes up to which they are the same: rounding.
const RECIPROCAL: f64 = 1e-6;

/// Returns true if the records show what a candidate needs: the term of the declared model that it modifies, an angle,
/// a limit that was touched, visible steps.
pub fn is_covered(
    candidate: &Candidate,
    model: &WithEffects,
    pieces: &[Piece],
    along: &[Trajectory],
    coverage: Coverage,
) -> bool {
    if candidate.effect.is_sum() {
        return false;
    }
    let modifies = candidate.effect.modifies();
    if modifies == Some(DeclaredTerm::Spring) && !has_spring(candidate, model, pieces, along) {
        return false;
    }
    if modifies == Some(DeclaredTerm::Coupling) && !has_coupling(candidate, model, pieces, along) {
        return false;
    }
    if candidate.effect.characteristic() == Some(Characteristic::Stops)
        && !shows_stops(candidate, model, pieces, along, coverage.samples)
    {
        return false;
    }
    let builds_up = |p: &EffectParameter| p.kind == ParameterKind::BuildUp && p.dimension == Dimension::POSITION;
    if candidate.effect.parameters().iter().any(builds_up) && !reverses(candidate, model, pieces, along, coverage.free)
    {
        return false;
    }
    if candidate.effect.is_over_a_turn() && !is_angle(&candidate.port, model) {
        return false;
    }
    if !matches!(candidate.port, Port::Sensor { .. }) {
        return true;
    }
    let first = &candidate.effect.parameters()[0];
    match first.grid {
        _ if first.null_value == Some(f64::INFINITY) => {
            any_series(candidate, model, pieces, |values, noise| touches_limit(values, noise, coverage))
        }
        InitialGrid::Steps => any_series(candidate, model, pieces, |values, noise| {
            let largest = values.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
            quantum(values, coverage.visible * noise, largest).is_some()
        }),
        _ => true,
    }
}

/// Returns true if a position or signal is an angle, or may be one: a number without a unit.
fn is_angle(port: &Port, model: &WithEffects) -> bool {
    let states = model.model().equation_states();
    let unit = |name: &String, of: &[Variable]| of.iter().find(|v| v.name == *name).map(|v| v.unit.clone());
    let unit = match port {
        Port::Joint { position, .. } => unit(position, &states),
        Port::Sensor { output } => unit(output, &model.model().interface().signals),
        Port::Speed { state, .. } | Port::Process { state, .. } => unit(state, &states),
        Port::Actuator { .. } => None,
    };
    unit.is_none_or(|unit| unit.is_angle() || unit.dimension().is_none())
}

/// Returns true if the declared force at a joint depends on its position, or on that of the companion. Without a
/// companion it is a spring to the ground: a shift of all joints alike, which no spring between joints resists, changes
/// the force.
fn has_spring(candidate: &Candidate, model: &WithEffects, pieces: &[Piece], along: &[Trajectory]) -> bool {
    let Some(piece) = pieces.first() else { return false };
    let Some(PortIndex::Joint(_, position, speed)) = port_index(&candidate.port, model, piece) else { return false };
    let coordinates = match candidate.companion.as_ref().and_then(|port| port_index(port, model, piece)) {
        Some(PortIndex::Joint(_, other, _)) => vec![other],
        _ => positions_like(position, model, piece),
    };
    let moments = || along.iter().flat_map(|trajectory| &trajectory.moments);
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0_f64, |most, v| most.max(v.abs()));
    let acceleration = largest(&mut moments().map(|m| m.rates[speed]));
    let slope = |m: &Moment| coordinates.iter().map(|&coordinate| m.a[(speed, coordinate)]).sum::<f64>();
    let spring = largest(&mut moments().map(|m| slope(m) * m.x[position]));
    spring > SLIGHT * acceleration
}

/// Returns the positions of all joints in the unit of one of them.
fn positions_like(position: usize, model: &WithEffects, piece: &Piece) -> Vec<usize> {
    let states = model.model().equation_states();
    let positions = model.model().interface().ports.iter().filter_map(|port| match port_index(port, model, piece)? {
        PortIndex::Joint(_, position, _) => Some(position),
        _ => None,
    });
    positions.filter(|&other| states[other].unit == states[position].unit).collect()
}

/// Returns true if the declared model has a spring or a damper between the joints of a candidate: the force on each
/// depends on the position or the speed of the other, by the same slope (reciprocity).
fn has_coupling(candidate: &Candidate, model: &WithEffects, pieces: &[Piece], along: &[Trajectory]) -> bool {
    let Some(piece) = pieces.first() else { return false };
    let ports = &model.model().interface().ports;
    let joints: Vec<(&Port, usize, usize, usize)> = ports
        .iter()
        .filter_map(|port| match port_index(port, model, piece)? {
            PortIndex::Joint(force, position, speed) => Some((port, force, position, speed)),
            _ => None,
        })
        .collect();
    let index = |port: &Port| joints.iter().position(|joint| joint.0 == port);
    let Some((first, second)) = index(&candidate.port).zip(candidate.companion.as_ref().and_then(index)) else {
        return false;
    };
    // Slopes of the forces on both by the position or the speed of the other, from the accelerations by the mass
    // matrix.
    let cross = |along: &Trajectory, m: &Moment, [of_first, of_second]: [usize; 2]| {
        let mobility = DMatrix::from_fn(joints.len(), joints.len(), |i, j| {
            let force = joints[j].1;
            m.b[(joints[i].3, along.inputs() + force)] * along.forward[force]
        });
        let slopes = DMatrix::from_fn(joints.len(), 2, |i, j| m.a[(joints[i].3, [of_first, of_second][j])]);
        mobility.lu().solve(&slopes).map(|k| [k[(first, 1)], k[(second, 0)]])
    };
    let is_reciprocal = |[a, b]: [f64; 2]| (a - b).abs() <= RECIPROCAL * a.abs().max(b.abs());
    let is_coupled = |states: [usize; 2]| {
        let of = |along: &Trajectory| along.moments.iter().map(|m| cross(along, m, states)).collect::<Option<Vec<_>>>();
        let all: Option<Vec<Vec<[f64; 2]>>> = along.iter().map(of).collect();
        let all = all.unwrap_or_default().concat();
        all.iter().copied().all(is_reciprocal) && all.iter().any(|k| k[0] != 0.0)
    };
    is_coupled([joints[first].2, joints[second].2]) || is_coupled([joints[first].3, joints[second].3])
}

/// Returns true if a motion shows stops: it turns back at both ends, or comes to rest. A falling body turns back at its
/// top only.
fn shows_stops(
    candidate: &Candidate,
    model: &WithEffects,
    pieces: &[Piece],
    along: &[Trajectory],
    samples: usize,
) -> bool {
    speeds(candidate, model, pieces, along).iter().any(|speeds| {
        let still = still(speeds);
        let turns = |sign: f64| {
            let moving = speeds.iter().position(|v| sign * v > still);
            moving.is_some_and(|first| speeds[first..].iter().any(|v| sign * v <= still))
        };
        let is_at_rest = |speeds: &[f64]| speeds.iter().all(|v| v.abs() <= still);
        let moved = speeds.iter().position(|v| v.abs() > still).unwrap_or(speeds.len());
        turns(1.0) && turns(-1.0) || speeds[moved..].windows(2 * samples).any(is_at_rest)
    })
}

/// Returns true if a motion goes both ways for a good part of its range: a hysteresis shows itself at reversals.
fn reverses(candidate: &Candidate, model: &WithEffects, pieces: &[Piece], along: &[Trajectory], free: f64) -> bool {
    speeds(candidate, model, pieces, along).iter().any(|speeds| {
        let way = |sign: f64| speeds.iter().map(|v| (sign * v).max(0.0)).sum::<f64>();
        let (forward, back) = (way(1.0), way(-1.0));
        forward.min(back) > free * forward.max(back)
    })
}

/// Returns the speeds of a joint, or of a joint relative to another one, in every record.
fn speeds(candidate: &Candidate, model: &WithEffects, pieces: &[Piece], along: &[Trajectory]) -> Vec<Vec<f64>> {
    let of = |(piece, along): (&Piece, &Trajectory)| {
        let Some(PortIndex::Joint(_, _, speed) | PortIndex::Speed(_, speed)) =
            port_index(&candidate.port, model, piece)
        else {
            return None;
        };
        let other = match candidate.companion.as_ref().and_then(|port| port_index(port, model, piece)) {
            Some(PortIndex::Joint(_, _, other)) => Some(other),
            _ => None,
        };
        let speed = |m: &Moment| m.x[speed] - other.map_or(0.0, |other| m.x[other]);
        Some(along.moments.iter().map(speed).collect())
    };
    pieces.iter().zip(along).filter_map(of).collect()
}

/// Returns the speed up to which a joint does not move.
fn still(speeds: &[f64]) -> f64 {
    SLIGHT * speeds.iter().fold(0.0_f64, |most, v| most.max(v.abs()))
}

fn touches_limit(values: &[f64], noise: f64, coverage: Coverage) -> bool {
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let count = |limit: f64| values.iter().filter(|v| (*v - limit).abs() < coverage.visible * noise).count();
    count(low) >= coverage.samples || count(high) >= coverage.samples
}

fn any_series(
    candidate: &Candidate,
    model: &WithEffects,
    pieces: &[Piece],
    shows: impl Fn(&[f64], f64) -> bool,
) -> bool {
    pieces.iter().any(|piece| match port_index(&candidate.port, model, piece) {
        Some(PortIndex::Sensor(series)) => shows(&piece.series[series].values, piece.series[series].noise),
        _ => false,
    })
}
