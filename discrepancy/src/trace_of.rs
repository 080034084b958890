//! The trace of a candidate: what it would add to the residuals, to first order in its size, along the motion of the model.

use mops_core::{
    Input,
    case::Hold,
    effect::{BoundEffect, InitialGrid, Port, PortState},
};
use mops_models::{Moment, WithEffects};

use crate::candidate::{Candidate, Sizes};
use crate::fit::Piece;
use crate::gap::gap;
use crate::trajectory::Trajectory;

/// Indices of a candidate's places in a model.
#[derive(Debug, Clone, Copy)]
pub enum Spot {
    /// Force of an equation, position, speed.
    Joint(usize, usize, usize),
    /// Force of an equation, state.
    Process(usize, usize),
    /// Input.
    Actuator(usize),
    /// Series of the piece.
    Sensor(usize),
}

/// Finds a port in a model and a piece; `None` for a sensor without data.
pub fn spot(port: &Port, model: &WithEffects, piece: &Piece) -> Option<Spot> {
    let interface = model.model().interface();
    let states = model.model().equation_states();
    let state = |name: &str| states.iter().position(|s| s.name == name);
    let force = |name: &str| {
        let mut processes = interface.ports.iter().filter_map(|p| match p {
            Port::Process { state, .. } => Some(state),
            _ => None,
        });
        processes.position(|s| s == name)
    };
    Some(match port {
        Port::Joint { position, velocity, .. } => Spot::Joint(force(velocity)?, state(position)?, state(velocity)?),
        Port::Process { state: name, .. } => Spot::Process(force(name)?, state(name)?),
        Port::Actuator { input } => Spot::Actuator(interface.inputs.iter().position(|i| i.name == *input)?),
        Port::Sensor { output } => Spot::Sensor(piece.series.iter().position(|s| s.name == *output)?),
    })
}

/// Root of twice the mean square about the middle: of a sine its amplitude. About 0 where nothing but rounding moves.
#[allow(clippy::cast_precision_loss)]
fn amplitude(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / n;
    let about_middle = size(values.map(|v| v - mean));
    if about_middle > 1e-6 * mean.abs() { about_middle } else { 2.0_f64.sqrt() * mean.abs() }
}

/// The same about 0: a falling ball has a constant acceleration, and a size of the forces on it all the same.
#[allow(clippy::cast_precision_loss)]
fn size(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count().max(1) as f64;
    (2.0 * values.map(|v| v * v).sum::<f64>() / n).sqrt()
}

fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

/// Largest slew rate of an input from sample to sample.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn slew_rate(input: &Input, sample: f64, horizon: f64) -> f64 {
    let at = |k: u32| input.at(f64::from(k) * sample);
    (0..(horizon / sample) as u32).map(|k| (at(k + 1) - at(k)).abs() / sample).fold(0.0, f64::max)
}

/// The value at a time, along straight lines from sample to sample; before the first and after the last sample theirs.
fn between(times: &[f64], values: &[f64], at: f64) -> f64 {
    let next = times.partition_point(|&t| t < at);
    match (next.checked_sub(1), values.get(next)) {
        (None, Some(&first)) => first,
        (Some(last), None) => values[last],
        (Some(k), Some(&to)) => {
            let share = (at - times[k]) / (times[next] - times[k]);
            values[k] + share * (to - values[k])
        }
        (None, None) => 0.0,
    }
}

/// Typical sizes at a place, over the pieces in which it is measured.
pub fn sizes(place: &Port, model: &WithEffects, pieces: &[Piece], trajectories: &[Trajectory]) -> Option<Sizes> {
    let spots: Vec<(usize, Spot)> =
        pieces.iter().enumerate().filter_map(|(i, piece)| Some((i, spot(place, model, piece)?))).collect();
    let record = pieces.iter().map(|p| p.horizon + p.case.begins).fold(0.0, f64::max);
    let samples = pieces.iter().flat_map(|p| &p.series);
    let sample = samples
        .filter(|s| s.times.len() > 1)
        .map(|s| (s.times[s.times.len() - 1] - s.times[0]) / (s.times.len() - 1) as f64);
    let sample = sample.fold(f64::INFINITY, f64::min);
    let moments = || spots.iter().flat_map(|(i, _)| trajectories[*i].moments.iter());
    let positive = |x: f64| if x.is_finite() && x > 1e-300 { x } else { 1.0 };
    let common = Sizes { record, sample, ..Sizes::UNTOLD };
    let mobility_of = |force: usize| positive(trajectories[0].mobilities[force].abs());
    let sizes = match spots.first()?.1 {
        Spot::Joint(w, q, v) => {
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
        Spot::Process(w, s) => {
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
                ..common
            }
        }
        Spot::Actuator(input) => {
            let value = positive(amplitude(moments().map(|m| m.u[input])));
            let states = moments().next().map_or(0, |m| m.x.len());
            let quickness =
                |s: usize| size(moments().map(|m| m.rates[s])) / positive(amplitude(moments().map(|m| m.x[s])));
            let fastest = (0..states).map(quickness).fold(0.0, f64::max);
            let time = 1.0 / positive(fastest).clamp(1.0 / record, 1.0 / sample);
            let name = &model.model().interface().inputs[input].name;
            let slew =
                |(i, _): &(usize, Spot)| Some(slew_rate(pieces[*i].case.input(name)?, sample, pieces[*i].horizon));
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
        Spot::Sensor(_) => {
            let of = |&(i, s): &(usize, Spot)| match s {
                Spot::Sensor(k) => (pieces[i].series[k].times.as_slice(), trajectories[i].predicted[k].as_slice()),
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

/// The same at a joint, with position and speed relative to those of another: of shafts that turn together, by how much one is
/// ahead.
pub fn relative_sizes(
    joint: &Port,
    other: &Port,
    model: &WithEffects,
    pieces: &[Piece],
    trajectories: &[Trajectory],
) -> Option<Sizes> {
    let own = sizes(joint, model, pieces, trajectories)?;
    let (first, second) = (spot(joint, model, pieces.first()?)?, spot(other, model, pieces.first()?)?);
    let (Spot::Joint(_, q, v), Spot::Joint(_, other_q, other_v)) = (first, second) else { return None };
    let moments = || trajectories.iter().flat_map(|along| along.moments.iter());
    let positions = moments().map(|m| m.x[q] - m.x[other_q]);
    let [position, speed] = [amplitude(positions.clone()), amplitude(moments().map(|m| m.x[v] - m.x[other_v]))];
    let moves = |x: f64| x.is_finite() && x > 1e-300;
    // Joints that move as one tell no size of their own.
    if !moves(position) || !moves(speed) {
        return Some(own);
    }
    Some(Sizes { position, speed, time: position / speed, range: range(positions), ..own })
}

/// The same with what samples at a sensor tell of an effect whose strengths ask for it: the size of steps, a gap.
pub fn sizes_by_samples(sizes: Sizes, candidate: &Candidate, model: &WithEffects, pieces: &[Piece]) -> Sizes {
    let asks = |wanted: fn(InitialGrid) -> bool| candidate.effect.parameters().iter().any(|s| wanted(s.grid));
    let of_steps = asks(|trials| trials == InitialGrid::Steps);
    let of_gap = asks(|trials| matches!(trials, InitialGrid::WithinAndGap(_) | InitialGrid::ScaledAndGap(_)));
    if !(of_steps || of_gap) {
        return sizes;
    }
    let (mut samples, mut noise) = (Vec::new(), 0.0_f64);
    for piece in pieces {
        if let Some(Spot::Sensor(series)) = spot(&candidate.port, model, piece) {
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

/// Typical sizes for a candidate: at its port, between two joints relative to each other; of a joint that is the companion of an
/// actuator or sensor the position and speed.
pub fn sizes_for(
    candidate: &Candidate,
    model: &WithEffects,
    pieces: &[Piece],
    trajectories: &[Trajectory],
) -> Option<Sizes> {
    let own = match &candidate.companion {
        Some(other @ Port::Joint { .. }) if candidate.effect.mutual() => {
            relative_sizes(&candidate.port, other, model, pieces, trajectories)?
        }
        _ => sizes(&candidate.port, model, pieces, trajectories)?,
    };
    let own = sizes_by_samples(own, candidate, model, pieces);
    match (&candidate.port, &candidate.companion) {
        (Port::Actuator { .. } | Port::Sensor { .. }, Some(joint @ Port::Joint { .. })) => {
            let Sizes { position, speed, .. } = sizes(joint, model, pieces, trajectories)?;
            Some(Sizes { position, speed, ..own })
        }
        _ => Some(own),
    }
}

/// A candidate's place in a piece, and what it sees there.
pub struct View<'a> {
    candidate: &'a Candidate,
    piece: &'a Piece,
    along: &'a Trajectory,
    here: Spot,
    companion: Option<Spot>,
    /// At the nodes of the motion, at a sensor at its samples; nothing where the candidate does not act.
    seen: Vec<PortState<'a, f64>>,
    /// The input that an actuator commands.
    input: Option<&'a Input>,
}

impl<'a> View<'a> {
    /// Of a candidate in a piece; `None` where it cannot act there, or has more states than can be followed.
    pub fn new(
        candidate: &'a Candidate,
        model: &'a WithEffects,
        piece: &'a Piece,
        along: &'a Trajectory,
    ) -> Option<Self> {
        let mut view =
            Self { candidate, piece, along, here: Spot::Actuator(0), companion: None, seen: Vec::new(), input: None };
        if candidate.only.is_some_and(|only| only != piece.measurement) {
            return Some(view);
        }
        if candidate.effect.states() > MOST_STATES {
            return None;
        }
        view.here = spot(&candidate.port, model, piece)?;
        let companion = match &candidate.companion {
            Some(port) => Some(spot(port, model, piece)?),
            None => None,
        };
        view.companion = companion;
        view.seen = match view.here {
            Spot::Sensor(series) => {
                (0..along.predicted[series].len()).map(|k| view.at_sample(series, companion, k)).collect()
            }
            _ => along.moments.iter().map(|m| view.at_node(companion, m)).collect(),
        };
        if let Spot::Actuator(input) = view.here {
            view.input = piece.case.input(&model.model().interface().inputs[input].name);
        }
        Some(view)
    }

    fn at_node(&self, companion: Option<Spot>, m: &'a Moment) -> PortState<'a, f64> {
        let inputs = self.along.inputs();
        let inertial = self.candidate.effect.is_inertial();
        let (other, other_speed) = match companion {
            Some(Spot::Joint(_, q, v)) => (m.x[q], m.x[v]),
            Some(Spot::Process(_, s)) => (m.x[s], 0.0),
            Some(Spot::Actuator(i)) => (m.u[i], 0.0),
            Some(Spot::Sensor(_)) | None => (0.0, 0.0),
        };
        let (value, q, v, a, mobility) = match self.here {
            Spot::Joint(w, q, v) => {
                let gain = m.b[(v, inputs + w)] * self.along.forward[w];
                (0.0, m.x[q], m.x[v], if inertial { m.rates[v] } else { 0.0 }, gain)
            }
            Spot::Process(_, s) => (0.0, m.x[s], 0.0, 0.0, 0.0),
            Spot::Actuator(i) => (m.u[i], m.u[i], 0.0, 0.0, 0.0),
            Spot::Sensor(_) => (0.0, 0.0, 0.0, 0.0, 0.0),
        };
        PortState {
            t: m.t + self.piece.case.begins,
            value,
            q,
            v,
            a,
            mobility,
            other,
            other_speed,
            u: &m.u,
            closed: None,
        }
    }

    fn at_sample(&self, series: usize, companion: Option<Spot>, k: usize) -> PortState<'a, f64> {
        let at = self.piece.series[series].times[k];
        let other = match companion {
            Some(Spot::Sensor(other)) => between(&self.piece.series[other].times, &self.along.predicted[other], at),
            _ => 0.0,
        };
        let y = self.along.predicted[series][k];
        PortState {
            t: at + self.piece.case.begins,
            value: y,
            q: y,
            v: 0.0,
            a: 0.0,
            mobility: 0.0,
            other,
            other_speed: 0.0,
            u: &[],
            closed: None,
        }
    }

    /// What the candidate at these strengths adds to the residuals of the piece; `None` where that is not finite.
    pub fn trace(&self, strengths: &[f64]) -> Option<Vec<f64>> {
        let series = &self.piece.series;
        let total: usize = series.iter().map(|s| s.times.len()).sum();
        if self.seen.is_empty() {
            return Some(vec![0.0; total]);
        }
        let effect = self.candidate.effect.as_ref();
        // What inertia adds changes the acceleration that it adds to: proportional to the strength only where that is small.
        let small = if effect.is_inertial() { 1e-6 } else { 1.0 };
        let mut strengths = strengths.to_vec();
        strengths[0] *= small;
        let acting = effect.bind(&strengths);
        if let Spot::Sensor(index) = self.here {
            let mut all = vec![0.0; total];
            let offset: usize = series[..index].iter().map(|s| s.times.len()).sum();
            let change = self.measured(acting.as_ref(), index);
            all[offset..offset + change.len()].copy_from_slice(&change);
            return Some(all);
        }
        let (column, mut signal) = self.signal(acting.as_ref())?;
        signal.iter_mut().for_each(|s| *s /= small);
        let mut response = self.along.response(column, &signal);
        if let Some((column, signal)) = self.onward(acting.as_ref()) {
            response.iter_mut().zip(self.along.response(column, &signal)).for_each(|(r, onward)| *r += onward);
        }
        Some(response)
    }

    /// What the candidate at these strengths adds at its place, at the nodes of the motion or at the samples of a sensor, in the
    /// unit of the place, forces forward; `None` where that is not finite.
    pub fn added(&self, strengths: &[f64]) -> Option<Vec<f64>> {
        let acting = self.candidate.effect.bind(strengths);
        let sign = match self.here {
            _ if self.seen.is_empty() => return Some(Vec::new()),
            Spot::Sensor(index) => {
                let (change, noise) = (self.measured(acting.as_ref(), index), self.piece.series[index].noise);
                return change.iter().all(|c| c.is_finite()).then(|| change.iter().map(|c| c * noise).collect());
            }
            Spot::Joint(w, ..) | Spot::Process(w, _) => self.along.forward[w],
            Spot::Actuator(_) => 1.0,
        };
        let signal = self.signal(acting.as_ref())?.1;
        Some(signal.into_iter().map(|s| s * sign).collect())
    }

    /// The signal that an effect adds at the nodes of a motion, and its column.
    fn signal(&self, acting: &dyn BoundEffect<f64>) -> Option<(usize, Vec<f64>)> {
        let along = self.along;
        let inputs = along.inputs();
        let begins = self.piece.case.begins;
        let command = |t: f64| self.input.map_or(0.0, |input| input.at(t.max(-begins)));
        let delayed = |k: usize, delay: f64| command(self.seen[k].t - begins - delay);
        let change = |at: &PortState<'_, f64>, value: f64, z: &[f64]| match self.here {
            Spot::Actuator(_) => value - at.value,
            _ => {
                let friction = acting.friction(at, z).map_or(0.0, |f| match at.v {
                    v if v > 0.0 => -f.sliding[0],
                    v if v < 0.0 => f.sliding[1],
                    _ => 0.0,
                });
                value + friction
            }
        };
        let mut signal = self.followed(acting, delayed, change);
        if !signal.iter().all(|s| s.is_finite()) {
            return None;
        }
        let column = match self.here {
            Spot::Joint(w, ..) | Spot::Process(w, _) => {
                signal.iter_mut().for_each(|s| *s *= along.forward[w]);
                inputs + w
            }
            Spot::Actuator(input) => input,
            Spot::Sensor(_) => return None,
        };
        Some((column, signal))
    }

    /// The signal that an effect adds at its second place, and its column; `None` where it adds nothing there.
    fn onward(&self, acting: &dyn BoundEffect<f64>) -> Option<(usize, Vec<f64>)> {
        let (Spot::Joint(w, ..) | Spot::Process(w, _)) = self.companion? else { return None };
        let forward = self.along.forward[w];
        let signal = self.followed(acting, |_, _| 0.0, |at, _, z| acting.onward(at, z) * forward);
        signal.iter().any(|s| *s != 0.0).then(|| (self.along.inputs() + w, signal))
    }

    /// What is made of each moment, of the value of the effect there and of its states, which move on from moment to moment;
    /// `delayed` is what came so much earlier.
    fn followed(
        &self,
        acting: &dyn BoundEffect<f64>,
        delayed: impl Fn(usize, f64) -> f64,
        made: impl Fn(&PortState<'_, f64>, f64, &[f64]) -> f64,
    ) -> Vec<f64> {
        let effect = self.candidate.effect.as_ref();
        let mut z = vec![0.0; effect.states()];
        let mut memory = vec![f64::NAN; effect.hysteresis_states()];
        if matches!(self.here, Spot::Actuator(_)) && !memory.is_empty() {
            self.before().iter().for_each(|at| acting.update_hysteresis(at, &mut memory));
        }
        let delay = acting.delay();
        let one = |(k, at): (usize, &PortState<'_, f64>)| {
            if k == 0 {
                acting.start(at, &mut z);
            } else if !z.is_empty() {
                advance(acting, &self.seen[k - 1], at, &mut z);
            }
            let value = if let Some(delay) = delay {
                delayed(k, delay)
            } else if memory.is_empty() {
                acting.value(at, &z)
            } else {
                acting.update_hysteresis(at, &mut memory);
                acting.hysteresis_value(at, &memory)
            };
            made(at, value, &z)
        };
        self.seen.iter().enumerate().map(one).collect()
    }

    /// What came to an actuator before the window of a record, where it bends or jumps: there from the left and from the right.
    fn before(&self) -> Vec<PortState<'a, f64>> {
        let begins = self.piece.case.begins;
        let (Some(input), Some(first)) = (self.input, self.seen.first()) else { return Vec::new() };
        let at = |t: f64, value: f64| PortState { t: t + begins, value, q: value, ..*first };
        let mut before = Vec::new();
        let mut t = -begins;
        while t < 0.0 {
            let value = input.at(t);
            let next = input.next_break(t).min(0.0);
            let is_held = matches!(input, Input::Sampled { hold: Hold::Zero, .. } | Input::Step { .. });
            before.extend([at(t, value), at(next, if is_held { value } else { input.at(next) })]);
            t = next;
        }
        before
    }

    /// What an effect changes at a sensor, in units of the noise.
    fn measured(&self, acting: &dyn BoundEffect<f64>, series: usize) -> Vec<f64> {
        let s = &self.piece.series[series];
        let y = &self.along.predicted[series];
        let interpolate = |t: f64| {
            if let ([t0, t1, t2, ..], [y0, y1, y2, ..]) = (s.times.as_slice(), y.as_slice())
                && t < *t0
            {
                // The parabola through the first samples.
                let (first, second) = ((y1 - y0) / (t1 - t0), (y2 - y1) / (t2 - t1));
                return y0 + (t - t0) * (first + (t - t1) * (second - first) / (t2 - t0));
            }
            between(&s.times, y, t)
        };
        let delayed = |k: usize, delay: f64| interpolate(s.times[k] - delay);
        // At a sensor the value of a moment is the sample.
        self.followed(acting, delayed, |at, value, _| (value - at.value) / s.noise)
    }
}

/// Moves the states of an effect from one node to the next, in two steps of the classical Runge-Kutta method.
fn advance(acting: &dyn BoundEffect<f64>, from: &PortState<'_, f64>, to: &PortState<'_, f64>, z: &mut [f64]) {
    const PARTS: u32 = 2;
    let between = |s: f64| {
        let mix = |a: f64, b: f64| a + s * (b - a);
        PortState {
            t: mix(from.t, to.t),
            value: mix(from.value, to.value),
            q: mix(from.q, to.q),
            v: mix(from.v, to.v),
            a: mix(from.a, to.a),
            mobility: mix(from.mobility, to.mobility),
            other: mix(from.other, to.other),
            other_speed: mix(from.other_speed, to.other_speed),
            u: from.u,
            closed: None,
        }
    };
    let h = (to.t - from.t) / f64::from(PARTS);
    let n = z.len();
    // Effects have few states: nothing is allocated here, where screening spends its time.
    let mut k = [[0.0; MOST_STATES]; 4];
    for part in 0..PARTS {
        let s = |c: f64| (f64::from(part) + c) / f64::from(PARTS);
        for (stage, c) in [0.0, 0.5, 0.5, 1.0].into_iter().enumerate() {
            let mut moved = [0.0; MOST_STATES];
            for i in 0..n {
                moved[i] = if stage == 0 { z[i] } else { z[i] + c * h * k[stage - 1][i] };
            }
            acting.rates(&between(s(c)), &moved[..n], &mut k[stage][..n]);
        }
        for i in 0..n {
            z[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
        }
    }
}

/// The largest number of states of an effect that is screened.
const MOST_STATES: usize = 8;

#[cfg(test)]
mod tests {
    use super::between;

    #[test]
    fn a_sensor_of_another_rate_is_read_along_straight_lines_and_keeps_its_ends() {
        let (times, values) = ([0.0, 0.5, 2.0], [1.0, 2.0, -1.0]);
        let read = [-1.0, 0.0, 0.25, 0.5, 1.0, 2.0, 3.0].map(|t| between(&times, &values, t));
        assert_eq!(read, [1.0, 1.0, 1.5, 2.0, 1.0, -1.0, -1.0]);
    }
}
