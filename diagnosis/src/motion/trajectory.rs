//! A model's motion in an experiment with its linear system along it: what any small force at a port does to the
//! outputs, for the price of a few multiplications per sample.
//!
//! Between samples the linear system is solved with two Gauss nodes and a fourth-order Magnus expansion (S. Blanes, F.
//! Casas, J. Oteo, J. Ros, The Magnus expansion and some of its applications, Physics Reports 470 (2009) 151, section
//! 5).

use mops_core::{Failure, Job, effect::Port};
use mops_models::{Along, Moment, WithEffects};
use nalgebra::allocator::Allocator;
use nalgebra::{Const, DMatrix, DefaultAllocator, Dim, Dyn, OMatrix};

use crate::error_models::{LinearisedMotion, Measured};
use crate::fit::{Fit, Point};
use crate::records::Series;

/// A sample interval, or a part of it.
struct Interval {
    /// State transition over it.
    transition: DMatrix<f64>,
    /// What unit signals at the two nodes add to the state at its end: inputs, then forces.
    gains: [DMatrix<f64>; 2],
}

/// The motion in one experiment.
pub struct Trajectory {
    /// The moments at the Gauss nodes, two per interval.
    pub moments: Vec<Moment>,
    intervals: Vec<Interval>,
    /// Ends of the intervals, s; the first is 0.
    pub knots: Vec<f64>,
    /// For each series: the knot of every sample.
    samples: Vec<Vec<usize>>,
    /// The model's outputs at the samples, in the units of the signals.
    pub predicted: Vec<Vec<f64>>,
    /// Noise of each series.
    noise: Vec<f64>,
    /// For each series, and each of its samples: slopes of the output by the states, then by the columns.
    outputs: Vec<Vec<f64>>,
    /// Number of linearised states.
    states: usize,
    /// Number of columns: inputs, then forces.
    columns: usize,
    /// Number of inputs.
    inputs: usize,
    /// Signs with which forces act forward.
    pub forward: Vec<f64>,
    /// Rate that a unit force at each balance adds to its state at the beginning.
    pub mobilities: Vec<f64>,
}

/// Position between the nodes of the middle between the first node and the end of an interval: `1/4 + sqrt(3)/4`.
const AHEAD: f64 = 0.683_012_701_892_219_3;

/// Shares of an interval at which its Gauss nodes lie: `1/2 -+ sqrt(3)/6`.
const NODES: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

impl Trajectory {
    /// The motion of a fitted model in one of its pieces.
    ///
    /// # Errors
    /// The failure of the simulation.
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    pub fn new(fit: &Fit<'_>, model: &WithEffects, piece: usize, point: &Point) -> Result<Self, Failure> {
        let p = &fit.pieces[piece];
        let parameters = fit.parameters(piece, point);
        let signals = p.signals();
        let job = Job { case: &p.case, parameters: &parameters, signals: &signals, horizon: p.horizon };
        let mut sampled: Vec<f64> = p.series.iter().flat_map(|s| s.times.iter().copied()).chain([0.0]).collect();
        sampled.sort_by(f64::total_cmp);
        let is_same = |a: f64, b: f64| (a - b).abs() <= 1e-9 * (1.0 + a.abs());
        // Clocks change their memory at knots.
        let mut ends = [&sampled[..], &model.instants(&job)?].concat();
        ends.sort_by(f64::total_cmp);
        ends.dedup_by(|a, b| is_same(*b, *a));
        let coarse = model.along(&job, &Self::nodes(&ends))?;
        // Delay lines are fast, but do not vary.
        let rates = |m: &Moment| m.a.rows(0, m.x.len()).amax();
        let fastest = coarse.moments.iter().map(rates).fold(0.0, f64::max);
        // Rates in very different units exaggerate: at most eight parts.
        let largest = ends.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
        let parts = ((fastest.sqrt().min(fastest) * largest / 0.5).ceil() as usize).clamp(1, 8);
        let mut knots = vec![ends[0]];
        for pair in ends.windows(2) {
            knots.extend((1..=parts).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / parts as f64));
        }
        let Along { moments, ticks } = if parts == 1 { coarse } else { model.along(&job, &Self::nodes(&knots))? };
        let mut intervals: Vec<Interval> =
            knots.windows(2).zip(moments.chunks(2)).map(|(ends, m)| interval(ends[1] - ends[0], m)).collect();
        for (k, interval) in intervals.iter_mut().enumerate() {
            // A switch between the nodes of an interval counts from its end on, one before its first node from its
            // beginning on.
            if let Some(jump) = jump(&moments[2 * k], &moments[2 * k + 1]) {
                interval.transition = &jump * &interval.transition;
                interval.gains[0] = &jump * &interval.gains[0];
            }
            if let Some(jump) = k.checked_sub(1).and_then(|before| jump(&moments[2 * before + 1], &moments[2 * k])) {
                interval.transition = &interval.transition * jump;
            }
        }
        let place = |t: f64| knots.partition_point(|&knot| knot < t - 1e-9 * (1.0 + t.abs()));
        for tick in &ticks {
            // What clocks change at a sample has changed when it is taken.
            let Some(before) = place(tick.t).checked_sub(1) else { continue };
            let interval = &mut intervals[before];
            interval.transition = &tick.states * &interval.transition;
            interval.gains = interval.gains.each_ref().map(|gain| &tick.states * gain);
            interval.gains[1] += &tick.inputs;
        }
        let samples: Vec<Vec<usize>> = p.series.iter().map(|s| s.times.iter().map(|&t| place(t)).collect()).collect();
        let row = |s: &Series| signals.iter().position(|&k| k == s.signal).expect("it is asked for");
        let slopes = |(s, knots): (&Series, &Vec<usize>)| {
            let row = row(s);
            // What jumps at a sample has jumped when it is taken.
            let at = knots.iter().map(|knot| &moments[(2 * knot).min(moments.len() - 1)]);
            at.flat_map(|m| m.c.row(row).iter().chain(m.d.row(row).iter()).copied().collect::<Vec<f64>>()).collect()
        };
        let outputs = p.series.iter().zip(&samples).map(slopes).collect();
        let residuals = fit.residuals(piece, point).ok_or(Failure::Diverged(0.0))?;
        let mut at = 0;
        let predicted = p.series.iter().map(|s| {
            let part = &residuals[at..at + s.times.len()];
            at += s.times.len();
            part.iter().zip(&s.values).map(|(r, y)| y + r * s.noise).collect()
        });
        let predicted = predicted.collect();
        let interface = model.model().interface();
        let states = model.model().equation_states();
        let inputs = interface.inputs.len();
        let forward = interface.ports.iter().filter_map(|port| match port {
            Port::Process { state, .. } => states.iter().position(|s| s.name == *state),
            _ => None,
        });
        let forward = forward.enumerate().map(|(k, state)| {
            let gain: f64 = moments.iter().map(|m| m.b[(state, inputs + k)]).sum();
            if gain < 0.0 { -1.0 } else { 1.0 }
        });
        Ok(Self {
            forward: forward.collect(),
            mobilities: model.mobilities(&job)?,
            noise: p.series.iter().map(|s| s.noise).collect(),
            outputs,
            states: moments.first().map_or(0, |m| m.a.nrows()),
            columns: moments.first().map_or(0, |m| m.b.ncols()),
            moments,
            intervals,
            knots,
            samples,
            predicted,
            inputs,
        })
    }

    fn nodes(knots: &[f64]) -> Vec<f64> {
        knots.windows(2).flat_map(|w| NODES.map(|s| w[0] + s * (w[1] - w[0]))).collect()
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Returns the motion linearised from sample to sample, with forces in units of those that add the `nominal` rates
    /// at the beginning, one for each force of the model; `channels` are those of the series.
    pub fn linearised(&self, nominal: &[f64], channels: &[usize]) -> LinearisedMotion {
        let (states, forces) = (self.states, nominal.len());
        let nominal: Vec<f64> = nominal.iter().zip(&self.mobilities).map(|(rate, mobility)| rate / mobility).collect();
        let mut knots: Vec<usize> = self.samples.iter().flatten().copied().chain([0]).collect();
        knots.sort_unstable();
        knots.dedup();
        let mut motion = LinearisedMotion { states, forces, ..LinearisedMotion::default() };
        motion.times = knots.iter().map(|&k| self.knots[k]).collect();
        motion.measured = vec![Vec::new(); knots.len()];
        for pair in knots.windows(2) {
            let mut transition = DMatrix::identity(states, states);
            let mut gain = DMatrix::zeros(states, forces);
            for interval in &self.intervals[pair[0]..pair[1]] {
                let fixed = DMatrix::from_fn(states, forces, |a, j| {
                    interval.gains.iter().map(|g| g[(a, self.inputs + j)]).sum::<f64>() * nominal[j]
                });
                gain = &interval.transition * gain + fixed;
                transition = &interval.transition * transition;
            }
            motion.transitions.extend(transition.transpose().iter());
            motion.gains.extend(gain.transpose().iter());
        }
        let (mut residual, row) = (0, states + self.columns);
        for (series, samples) in self.samples.iter().enumerate() {
            for (sample, knot) in samples.iter().enumerate() {
                let of = &self.outputs[series][sample * row..(sample + 1) * row];
                let direct =
                    of[states + self.inputs..].iter().zip(&nominal).flat_map(|(d, nominal)| [d * nominal, 0.0]);
                let slopes = of[..states].iter().copied().chain(direct).map(|s| s / self.noise[series]).collect();
                let at = knots.binary_search(knot).expect("samples lie at knots");
                motion.measured[at].push(Measured { channel: channels[series], residual, slopes });
                residual += 1;
            }
        }
        motion
    }

    /// What a signal at the nodes, in a column (inputs, then forces), adds to the residuals.
    pub fn response(&self, column: usize, signal: &[f64]) -> Vec<f64> {
        match self.states {
            1 => self.response_of::<1>(column, signal),
            2 => self.response_of::<2>(column, signal),
            3 => self.response_of::<3>(column, signal),
            4 => self.response_of::<4>(column, signal),
            5 => self.response_of::<5>(column, signal),
            6 => self.response_of::<6>(column, signal),
            _ => self.response_of_many(column, signal),
        }
    }

    /// Returns the response for `N` states, which fit into registers: screening spends its time here.
    fn response_of<const N: usize>(&self, column: usize, signal: &[f64]) -> Vec<f64> {
        let mut states = vec![[0.0; N]; self.knots.len()];
        // At rest until the signal begins.
        let begin = signal.iter().position(|&f| f != 0.0).unwrap_or(signal.len()) / 2;
        for (k, interval) in self.intervals.iter().enumerate().skip(begin) {
            let (now, mut next) = (states[k], [0.0; N]);
            for (gain, &f) in interval.gains.iter().zip(&signal[2 * k..2 * k + 2]) {
                let gain = &gain.as_slice()[N * column..N * (column + 1)];
                next.iter_mut().zip(gain).for_each(|(x, g)| *x += f * g);
            }
            for (slopes, x) in interval.transition.as_slice().chunks_exact(N).zip(now) {
                next.iter_mut().zip(slopes).for_each(|(next, slope)| *next += slope * x);
            }
            states[k + 1] = next;
        }
        self.outputs(column, signal, |knot| &states[knot])
    }

    fn response_of_many(&self, column: usize, signal: &[f64]) -> Vec<f64> {
        let n = self.states;
        // The states at the knots, one after the other; at rest until the signal begins.
        let mut states = vec![0.0; n * self.knots.len()];
        let begin = signal.iter().position(|&f| f != 0.0).unwrap_or(signal.len()) / 2;
        for (k, interval) in self.intervals.iter().enumerate().skip(begin) {
            let (done, next) = states.split_at_mut(n * (k + 1));
            let next = &mut next[..n];
            for (gain, &f) in interval.gains.iter().zip(&signal[2 * k..2 * k + 2]) {
                next.iter_mut().zip(gain.column(column).iter()).for_each(|(x, g)| *x += f * g);
            }
            for (slopes, &x) in interval.transition.as_slice().chunks_exact(n.max(1)).zip(&done[n * k..]) {
                next.iter_mut().zip(slopes).for_each(|(next, slope)| *next += slope * x);
            }
        }
        self.outputs(column, signal, |knot| &states[n * knot..n * (knot + 1)])
    }

    /// The residuals of states at the knots, and of what a signal adds to the outputs itself.
    fn outputs<'s>(&self, column: usize, signal: &[f64], states: impl Fn(usize) -> &'s [f64]) -> Vec<f64> {
        let (n, row) = (self.states, self.states + self.columns);
        let mut residuals = Vec::with_capacity(self.samples.iter().map(Vec::len).sum());
        for ((samples, slopes), noise) in self.samples.iter().zip(&self.outputs).zip(&self.noise) {
            residuals.extend(samples.iter().zip(slopes.chunks_exact(row.max(1))).map(|(&knot, slopes)| {
                let node = (2 * knot).min(self.moments.len() - 1);
                let y = slopes[..n].iter().zip(states(knot)).fold(0.0, |y, (c, x)| y + c * x);
                (y + slopes[n + column] * signal[node]) / noise
            }));
        }
        residuals
    }
}

fn interval(h: f64, moments: &[Moment]) -> Interval {
    match moments[0].a.nrows() {
        1 => interval_of(Const::<1>, h, moments),
        2 => interval_of(Const::<2>, h, moments),
        3 => interval_of(Const::<3>, h, moments),
        4 => interval_of(Const::<4>, h, moments),
        5 => interval_of(Const::<5>, h, moments),
        6 => interval_of(Const::<6>, h, moments),
        n => interval_of(Dyn(n), h, moments),
    }
}

/// Returns the interval for `n` states; where the type fixes their number, its matrices need no allocation.
fn interval_of<N: Dim>(n: N, h: f64, moments: &[Moment]) -> Interval
where
    DefaultAllocator: Allocator<N, N> + Allocator<N, Dyn>,
{
    let square = |m: &DMatrix<f64>| OMatrix::<f64, N, N>::from_column_slice_generic(n, n, m.as_slice());
    let (a1, a2) = (square(&moments[0].a), square(&moments[1].a));
    let commutator = &a2 * &a1 - &a1 * &a2;
    let magnus = (&a1 + &a2) * (0.5 * h) + commutator * (3.0_f64.sqrt() / 12.0 * h * h);
    let transition = exponential(&magnus);
    // Between the nodes the system is a line through both; beyond the second it stays, as it may have switched.
    let ahead = &a1 + (&a2 - &a1) * AHEAD;
    let gains = [0, 1].map(|k| {
        // From a node to the end by the system in the middle of what is left.
        let left = h * (1.0 - NODES[k]);
        let along = if k == 0 { &ahead } else { &a2 };
        let columns = Dyn(moments[k].b.ncols());
        let b = OMatrix::<f64, N, Dyn>::from_column_slice_generic(n, columns, moments[k].b.as_slice());
        let gain = exponential(&(along * left)) * b * (0.5 * h);
        DMatrix::from_column_slice(gain.nrows(), gain.ncols(), gain.as_slice())
    });
    Interval { transition: DMatrix::from_column_slice(n.value(), n.value(), transition.as_slice()), gains }
}

/// Returns the jump of small deviations of the states where a joint with dry friction comes to rest or turns between
/// two nodes: with rates `f-` before, `f+` after and the event `v = 0`, `I + (f+ - f-) e_v'/(e_v' f-)`. `None` if no
/// joint does.
///
/// Source: M. di Bernardo, C. Budd, A. Champneys, P. Kowalczyk, Piecewise-smooth Dynamical Systems (Springer 2008),
/// section 2.5.
fn jump(before: &Moment, after: &Moment) -> Option<DMatrix<f64>> {
    let mut all: Option<DMatrix<f64>> = None;
    for (was, is) in before.sliding.iter().zip(&after.sliding) {
        let (velocity, states) = (was.velocity, before.a.nrows());
        let deceleration = before.rates[velocity];
        let mut jump = DMatrix::<f64>::identity(states, states);
        if is.rests > was.rests {
            // What has come to rest does not remember its speed.
            jump[(velocity, velocity)] = 0.0;
        } else if was.direction * is.direction < 0.0 && deceleration != 0.0 {
            for i in 0..before.rates.len() {
                jump[(i, velocity)] += (after.rates[i] - before.rates[i]) / deceleration;
            }
        } else {
            continue;
        }
        all = Some(all.map_or_else(|| jump.clone(), |all| &jump * all));
    }
    all
}

/// `exp(M)` by its series after halving.
fn exponential<N: Dim>(m: &OMatrix<f64, N, N>) -> OMatrix<f64, N, N>
where
    DefaultAllocator: Allocator<N, N>,
{
    let mut halvings = 0;
    let mut scaled = m.clone();
    while scaled.amax() > 0.25 && halvings < 40 {
        scaled *= 0.5;
        halvings += 1;
    }
    let (rows, columns) = m.shape_generic();
    let identity = OMatrix::<f64, N, N>::identity_generic(rows, columns);
    let mut sum = identity.clone();
    for k in (1..=8).rev() {
        sum = &identity + (&scaled * sum) / f64::from(k);
    }
    for _ in 0..halvings {
        sum = &sum * &sum;
    }
    sum
}

#[cfg(test)]
mod tests;
