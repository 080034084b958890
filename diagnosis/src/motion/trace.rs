//! The trace of a candidate: what it would add to the residuals, to first order in its size, along the motion of the
//! model.

use mops_core::{
    Input,
    case::Hold,
    effect::{BoundEffect, PortState},
};
use mops_models::{Moment, WithEffects};

use super::ports::{PortIndex, port_index};
use super::trajectory::Trajectory;
use crate::candidates::Candidate;
use crate::fit::Piece;

/// Returns the value at a time, along straight lines from sample to sample; before the first and after the last sample
/// theirs.
pub fn between(times: &[f64], values: &[f64], at: f64) -> f64 {
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

/// A candidate's place in a piece, and what it sees there.
pub struct View<'a> {
    candidate: &'a Candidate,
    piece: &'a Piece,
    along: &'a Trajectory,
    here: PortIndex,
    companion: Option<PortIndex>,
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
        let mut view = Self {
            candidate,
            piece,
            along,
            here: PortIndex::Actuator(0),
            companion: None,
            seen: Vec::new(),
            input: None,
        };
        if candidate.only.is_some_and(|only| only != piece.measurement) {
            return Some(view);
        }
        if candidate.effect.states() > MOST_STATES {
            return None;
        }
        view.here = port_index(&candidate.port, model, piece)?;
        let companion = match &candidate.companion {
            Some(port) => Some(port_index(port, model, piece)?),
            None => None,
        };
        view.companion = companion;
        view.seen = match view.here {
            PortIndex::Sensor(series) => {
                (0..along.predicted[series].len()).map(|k| view.at_sample(series, companion, k)).collect()
            }
            _ => along.moments.iter().map(|m| view.at_node(companion, m)).collect(),
        };
        if let PortIndex::Actuator(input) = view.here {
            view.input = piece.case.input(&model.model().interface().inputs[input].name);
        }
        Some(view)
    }

    fn at_node(&self, companion: Option<PortIndex>, m: &'a Moment) -> PortState<'a, f64> {
        let inputs = self.along.inputs();
        let inertial = self.candidate.effect.is_inertial();
        let (other, other_speed) = match companion {
            Some(PortIndex::Joint(_, q, v)) => (m.x[q], m.x[v]),
            Some(PortIndex::Speed(_, v)) => (0.0, m.x[v]),
            Some(PortIndex::Process(_, s)) => (m.x[s], 0.0),
            Some(PortIndex::Actuator(i)) => (m.u[i], 0.0),
            Some(PortIndex::Sensor(_)) | None => (0.0, 0.0),
        };
        let (value, q, v, a, mobility) = match self.here {
            PortIndex::Joint(w, q, v) => {
                let gain = m.b[(v, inputs + w)] * self.along.forward[w];
                (0.0, m.x[q], m.x[v], if inertial { m.rates[v] } else { 0.0 }, gain)
            }
            PortIndex::Speed(w, v) => {
                let gain = m.b[(v, inputs + w)] * self.along.forward[w];
                (0.0, 0.0, m.x[v], if inertial { m.rates[v] } else { 0.0 }, gain)
            }
            PortIndex::Process(_, s) => (0.0, m.x[s], 0.0, 0.0, 0.0),
            PortIndex::Actuator(i) => (m.u[i], m.u[i], 0.0, 0.0, 0.0),
            PortIndex::Sensor(_) => (0.0, 0.0, 0.0, 0.0, 0.0),
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

    fn at_sample(&self, series: usize, companion: Option<PortIndex>, k: usize) -> PortState<'a, f64> {
        let at = self.piece.series[series].times[k];
        let other = match companion {
            Some(PortIndex::Sensor(other)) => {
                between(&self.piece.series[other].times, &self.along.predicted[other], at)
            }
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
        // What inertia adds changes the acceleration that it adds to: proportional to the strength only where that is
        // small.
        let small = if effect.is_inertial() { 1e-6 } else { 1.0 };
        let mut strengths = strengths.to_vec();
        strengths[0] *= small;
        let acting = effect.bind(&strengths);
        if let PortIndex::Sensor(index) = self.here {
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

    /// What the candidate at these strengths adds at its place, at the nodes of the motion or at the samples of a
    /// sensor, in the unit of the place, forces forward; `None` where that is not finite.
    pub fn added(&self, strengths: &[f64]) -> Option<Vec<f64>> {
        let acting = self.candidate.effect.bind(strengths);
        let sign = match self.here {
            _ if self.seen.is_empty() => return Some(Vec::new()),
            PortIndex::Sensor(index) => {
                let (change, noise) = (self.measured(acting.as_ref(), index), self.piece.series[index].noise);
                return change.iter().all(|c| c.is_finite()).then(|| change.iter().map(|c| c * noise).collect());
            }
            PortIndex::Joint(w, ..) | PortIndex::Speed(w, _) | PortIndex::Process(w, _) => self.along.forward[w],
            PortIndex::Actuator(_) => 1.0,
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
            PortIndex::Actuator(_) => value - at.value,
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
            PortIndex::Joint(w, ..) | PortIndex::Speed(w, _) | PortIndex::Process(w, _) => {
                signal.iter_mut().for_each(|s| *s *= along.forward[w]);
                inputs + w
            }
            PortIndex::Actuator(input) => input,
            PortIndex::Sensor(_) => return None,
        };
        Some((column, signal))
    }

    /// The signal that an effect adds at its second place, and its column; `None` where it adds nothing there.
    fn onward(&self, acting: &dyn BoundEffect<f64>) -> Option<(usize, Vec<f64>)> {
        let (PortIndex::Joint(w, ..) | PortIndex::Speed(w, _) | PortIndex::Process(w, _)) = self.companion? else {
            return None;
        };
        let forward = self.along.forward[w];
        let signal = self.followed(acting, |_, _| 0.0, |at, _, z| acting.onward(at, z) * forward);
        signal.iter().any(|s| *s != 0.0).then(|| (self.along.inputs() + w, signal))
    }

    /// What is made of each moment, of the value of the effect there and of its states, which move on from moment to
    /// moment; `delayed` is what came so much earlier.
    fn followed(
        &self,
        acting: &dyn BoundEffect<f64>,
        delayed: impl Fn(usize, f64) -> f64,
        made: impl Fn(&PortState<'_, f64>, f64, &[f64]) -> f64,
    ) -> Vec<f64> {
        let effect = self.candidate.effect.as_ref();
        let mut z = vec![0.0; effect.states()];
        let mut memory = vec![f64::NAN; effect.hysteresis_states()];
        if matches!(self.here, PortIndex::Actuator(_)) && !memory.is_empty() {
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

    /// What came to an actuator before the window of a record, where it bends or jumps: there from the left and from
    /// the right.
    fn before(&self) -> Vec<PortState<'a, f64>> {
        let begins = self.piece.case.begins;
        let (Some(input), Some(first)) = (self.input, self.seen.first()) else { return Vec::new() };
        let at = |t: f64, value: f64| PortState { t: t + begins, value, q: value, ..*first };
        let mut before = Vec::new();
        let mut t = -begins;
        while t < 0.0 {
            let value = input.at(t);
            let next = input.next_break(t).min(0.0);
            let is_constant = matches!(input, Input::Sampled { hold: Hold::Zero, .. } | Input::Step { .. });
            before.extend([at(t, value), at(next, if is_constant { value } else { input.at(next) })]);
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
mod tests;
