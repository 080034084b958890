//! Typical sizes at a place along the motions of a model.

use mops_core::{
    Input,
    effect::{InitialGrid, Port},
};
use mops_models::WithEffects;

use super::ports::{PortIndex, port_index};
use super::trajectory::Trajectory;
use crate::candidates::{Candidate, Sizes};
use crate::fit::Piece;
use crate::records::gap;
use crate::settings::Coverage;

/// Returns the root of twice the mean square about the middle: of a sine its amplitude. About 0 where nothing but
/// rounding moves.
#[allow(clippy::cast_precision_loss)]
fn amplitude(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / n;
    let about_middle = size(values.map(|v| v - mean));
    if about_middle > 1e-6 * mean.abs() { about_middle } else { 2.0_f64.sqrt() * mean.abs() }
}

/// Returns the root of twice the mean square about 0: a falling ball has a constant acceleration, and forces of a size.
#[allow(clippy::cast_precision_loss)]
fn size(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count().max(1) as f64;
    (2.0 * values.map(|v| v * v).sum::<f64>() / n).sqrt()
}

fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

/// Returns the largest slew rate of an input from sample to sample.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn slew_rate(input: &Input, sample: f64, horizon: f64) -> f64 {
    let at = |k: u32| input.at(f64::from(k) * sample);
    (0..(horizon / sample) as u32).map(|k| (at(k + 1) - at(k)).abs() / sample).fold(0.0, f64::max)
}

/// Returns the typical sizes at a place, over the pieces in which it is measured.
pub fn sizes(
    place: &Port,
    model: &WithEffects,
    pieces: &[Piece],
    trajectories: &[Trajectory],
    coverage: Coverage,
) -> Option<Sizes> {
    let spots: Vec<(usize, PortIndex)> =
        pieces.iter().enumerate().filter_map(|(i, piece)| Some((i, port_index(place, model, piece)?))).collect();
    let record = pieces.iter().map(|p| p.horizon + p.case.begins).fold(0.0, f64::max);
    let samples = pieces.iter().flat_map(|p| &p.series);
    let sample = samples
        .filter(|s| s.times.len() > 1)
        .map(|s| (s.times[s.times.len() - 1] - s.times[0]) / (s.times.len() - 1) as f64);
    let sample = sample.fold(f64::INFINITY, f64::min);
    let moments = || spots.iter().flat_map(|(i, _)| trajectories[*i].moments.iter());
    let positive = |x: f64| if x.is_finite() && x > 1e-300 { x } else { 1.0 };
    let common = Sizes { record, sample, coverage, ..Sizes::UNKNOWN };
    let mobility_of = |force: usize| positive(trajectories[0].mobilities[force].abs());
    let sizes = match spots.first()?.1 {
        PortIndex::Joint(w, q, v) => {
            let inputs = trajectories[0].inputs();
            let accelerations = moments().map(|m| m.rates[v]);
            let mobility = moments().map(|m| m.b[(v, inputs + w)].abs()).fold(0.0, f64::max);
            let output = size(accelerations) / positive(mobility);
            let speed = positive(amplitude(moments().map(|m| m.x[v])));
            let position = positive(amplitude(moments().map(|m| m.x[q])));
            let range = range(moments().map(|m| m.x[q]));
            let stiffness = Some(size(moments().map(|m| m.a[(v, q)])) / positive(mobility));
            let mobility = mobility_of(w);
            Sizes { output, mobility, position, speed, time: position / speed, range, stiffness, ..common }
        }
        PortIndex::Speed(w, v) => {
            let inputs = trajectories[0].inputs();
            let mobility = moments().map(|m| m.b[(v, inputs + w)].abs()).fold(0.0, f64::max);
            let acceleration = positive(size(moments().map(|m| m.rates[v])));
            let speed = positive(amplitude(moments().map(|m| m.x[v])));
            let time = speed / acceleration;
            let output = acceleration / positive(mobility);
            Sizes { output, mobility: mobility_of(w), position: speed * time, speed, time, ..common }
        }
        PortIndex::Process(w, s) => {
            let inputs = trajectories[0].inputs();
            let mobility = moments().map(|m| m.b[(s, inputs + w)].abs()).fold(0.0, f64::max);
            let rate = size(moments().map(|m| m.rates[s]));
            let position = positive(amplitude(moments().map(|m| m.x[s])));
            let speed = positive(rate);
            Sizes {
                output: rate / positive(mobility),
                mobility: mobility_of(w),
                position,
                speed,
                time: position / speed,
                range: range(moments().map(|m| m.x[s])),
                zero: model.model().equation_states()[s].unit.absolute_zero_offset(),
                ..common
            }
        }
        PortIndex::Actuator(input) => {
            let value = positive(amplitude(moments().map(|m| m.u[input])));
            let states = moments().next().map_or(0, |m| m.x.len());
            let quickness =
                |s: usize| size(moments().map(|m| m.rates[s])) / positive(amplitude(moments().map(|m| m.x[s])));
            let fastest = (0..states).map(quickness).fold(0.0, f64::max);
            let time = 1.0 / positive(fastest).clamp(1.0 / record, 1.0 / sample);
            let name = &model.model().interface().inputs[input].name;
            let slew =
                |(i, _): &(usize, PortIndex)| Some(slew_rate(pieces[*i].case.input(name)?, sample, pieces[*i].horizon));
            Sizes {
                output: value,
                position: value,
                speed: value / time,
                value,
                time,
                range: range(moments().map(|m| m.u[input])),
                slew: Some(spots.iter().filter_map(slew).fold(0.0, f64::max)),
                ..common
            }
        }
        PortIndex::Sensor(_) => {
            let of = |&(i, s): &(usize, PortIndex)| match s {
                PortIndex::Sensor(k) => (pieces[i].series[k].times.as_slice(), trajectories[i].predicted[k].as_slice()),
                _ => (&[][..], &[][..]),
            };
            let values = || spots.iter().flat_map(|spot| of(spot).1.iter().copied());
            let rates = spots.iter().flat_map(|spot| {
                let (times, values) = of(spot);
                values.windows(2).zip(times.windows(2)).map(|(y, t)| (y[1] - y[0]) / (t[1] - t[0]))
            });
            let value = positive(amplitude(values()));
            let speed = positive(amplitude(rates.collect::<Vec<_>>().into_iter()));
            Sizes {
                output: value,
                position: value,
                speed,
                value,
                time: value / speed,
                range: range(values()),
                ..common
            }
        }
    };
    Some(Sizes { output: positive(sizes.output), ..sizes })
}

/// Returns the typical sizes at a joint, with position and speed relative to those of another: of shafts that turn
/// together, by how much one is ahead.
pub fn relative_sizes(
    joint: &Port,
    other: &Port,
    model: &WithEffects,
    pieces: &[Piece],
    trajectories: &[Trajectory],
    coverage: Coverage,
) -> Option<Sizes> {
    let own = sizes(joint, model, pieces, trajectories, coverage)?;
    let (first, second) = (port_index(joint, model, pieces.first()?)?, port_index(other, model, pieces.first()?)?);
    let (PortIndex::Joint(_, q, v), PortIndex::Joint(_, other_q, other_v)) = (first, second) else { return None };
    let moments = || trajectories.iter().flat_map(|along| along.moments.iter());
    let positions = moments().map(|m| m.x[q] - m.x[other_q]);
    let [position, speed] = [amplitude(positions.clone()), amplitude(moments().map(|m| m.x[v] - m.x[other_v]))];
    let moves = |x: f64| x.is_finite() && x > 1e-300;
    // Joints that move as one have no size of their own.
    if !moves(position) || !moves(speed) {
        return Some(own);
    }
    Some(Sizes { position, speed, time: position / speed, range: range(positions), ..own })
}

/// Adds to sizes what samples at a sensor show of an effect whose parameters need it: the size of steps, a gap.
pub fn sizes_by_samples(sizes: Sizes, candidate: &Candidate, model: &WithEffects, pieces: &[Piece]) -> Sizes {
    let asks = |wanted: fn(InitialGrid) -> bool| candidate.effect.parameters().iter().any(|s| wanted(s.grid));
    let of_steps = asks(|trials| trials == InitialGrid::Steps);
    let of_gap = asks(|trials| matches!(trials, InitialGrid::WithinAndGap(_) | InitialGrid::ScaledAndGap(_)));
    if !(of_steps || of_gap) {
        return sizes;
    }
    let (mut samples, mut noise) = (Vec::new(), 0.0_f64);
    for piece in pieces {
        if let Some(PortIndex::Sensor(series)) = port_index(&candidate.port, model, piece) {
            samples.extend_from_slice(&piece.series[series].values);
            noise = noise.max(piece.series[series].noise);
        }
    }
    if samples.is_empty() {
        return sizes;
    }
    let quantum = of_steps.then(|| sizes.quantum_of(&samples, noise)).flatten();
    let gap = of_gap.then(|| gap(&samples, noise)).flatten();
    Sizes { quantum, gap, ..sizes }
}

/// Returns the typical sizes for a candidate: at its port, between two joints relative to each other; of a joint that
/// is the companion of an actuator or sensor the position and speed.
pub fn sizes_for(
    candidate: &Candidate,
    model: &WithEffects,
    pieces: &[Piece],
    trajectories: &[Trajectory],
    coverage: Coverage,
) -> Option<Sizes> {
    let own = match &candidate.companion {
        Some(other @ Port::Joint { .. }) if candidate.effect.mutual() => {
            relative_sizes(&candidate.port, other, model, pieces, trajectories, coverage)?
        }
        _ => sizes(&candidate.port, model, pieces, trajectories, coverage)?,
    };
    let own = sizes_by_samples(own, candidate, model, pieces);
    match (&candidate.port, &candidate.companion) {
        (Port::Actuator { .. } | Port::Sensor { .. }, Some(joint @ Port::Joint { .. })) => {
            let Sizes { position, speed, .. } = sizes(joint, model, pieces, trajectories, coverage)?;
            Some(Sizes { position, speed, ..own })
        }
        _ => Some(own),
    }
}
