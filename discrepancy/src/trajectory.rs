//! A model's motion in an experiment with its linear system along it: what any small force at a port does to the outputs,
//! for the price of a few multiplications per sample.
//!
//! Between samples the linear system is solved with two Gauss nodes and a fourth-order Magnus expansion (S. Blanes, F. Casas,
//! J. Oteo, J. Ros, The Magnus expansion and some of its applications, Physics Reports 470 (2009) 151, section 5).

use mops_core::{Failure, Job, Port};
use mops_models::{Moment, WithEffects};
use nalgebra::{DMatrix, DVector};

use crate::fit::{Fit, Point};

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
    /// Row of each series in the outputs of the moments.
    rows: Vec<usize>,
    /// Number of inputs.
    inputs: usize,
    /// Signs with which forces act forward.
    pub forward: Vec<f64>,
}

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
        let mut signals: Vec<usize> = p.series.iter().map(|s| s.signal).collect();
        signals.sort_unstable();
        signals.dedup();
        let job = Job { case: &p.case, parameters: &parameters, signals: &signals, horizon: p.horizon };
        let mut sampled: Vec<f64> = p.series.iter().flat_map(|s| s.times.iter().copied()).chain([0.0]).collect();
        sampled.sort_by(f64::total_cmp);
        sampled.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * (1.0 + a.abs()));
        let first = Self::nodes(&sampled);
        let coarse = model.along(&job, &first)?;
        let fastest = coarse.iter().map(|m| m.a.amax()).fold(0.0, f64::max);
        // Rates in very different units exaggerate: at most eight parts.
        let largest = sampled.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
        let parts = ((fastest.sqrt().min(fastest) * largest / 0.5).ceil() as usize).clamp(1, 8);
        let mut knots = vec![sampled[0]];
        for pair in sampled.windows(2) {
            knots.extend((1..=parts).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / parts as f64));
        }
        let moments = if parts == 1 { coarse } else { model.along(&job, &Self::nodes(&knots))? };
        let intervals =
            knots.windows(2).zip(moments.chunks(2)).map(|(ends, m)| interval(ends[1] - ends[0], m)).collect();
        let place = |t: f64| sampled.partition_point(|&s| s < t - 1e-9 * (1.0 + t.abs())) * parts;
        let samples = p.series.iter().map(|s| s.times.iter().map(|&t| place(t)).collect()).collect();
        let residuals = fit.residuals(piece, point, false).ok_or(Failure::Diverged(0.0))?.r;
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
            noise: p.series.iter().map(|s| s.noise).collect(),
            rows: p
                .series
                .iter()
                .map(|s| signals.iter().position(|&k| k == s.signal).expect("it is asked for"))
                .collect(),
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

    /// What a signal at the nodes, in a column (inputs, then forces), adds to the residuals.
    pub fn response(&self, column: usize, signal: &[f64]) -> Vec<f64> {
        let n = self.moments.first().map_or(0, |m| m.x.len());
        let mut states = Vec::with_capacity(self.knots.len());
        let mut x = DVector::zeros(n);
        states.push(x.clone());
        let mut next = DVector::zeros(n);
        for (interval, f) in self.intervals.iter().zip(signal.chunks(2)) {
            next.gemv(1.0, &interval.transition, &x, 0.0);
            next.axpy(f[0], &interval.gains[0].column(column), 1.0);
            next.axpy(f[1], &interval.gains[1].column(column), 1.0);
            std::mem::swap(&mut x, &mut next);
            states.push(x.clone());
        }
        let mut residuals = Vec::new();
        for ((samples, &row), noise) in self.samples.iter().zip(&self.rows).zip(&self.noise) {
            residuals.extend(samples.iter().map(|&knot| {
                let node = (2 * knot).saturating_sub(1).min(self.moments.len() - 1);
                let m = &self.moments[node];
                let mut y = 0.0;
                for i in 0..n {
                    y += m.c[(row, i)] * states[knot][i];
                }
                (y + m.d[(row, column)] * signal[node]) / noise
            }));
        }
        residuals
    }

    /// The states at the knots for a unit pulse of one node's signal: the columns of what a free force does.
    pub fn transition(&self, interval: usize) -> &DMatrix<f64> {
        &self.intervals[interval].transition
    }

    /// What a constant unit signal over an interval adds to the state at its end.
    pub fn gain(&self, interval: usize, column: usize) -> DVector<f64> {
        let [first, second] = &self.intervals[interval].gains;
        first.column(column) + second.column(column)
    }

    /// Samples that lie at each knot: series, index of the sample, and the row of the outputs.
    pub fn samples_at(&self) -> Vec<Vec<(usize, usize, usize)>> {
        let mut at = vec![Vec::new(); self.knots.len()];
        for (series, (samples, &row)) in self.samples.iter().zip(&self.rows).enumerate() {
            for (index, &knot) in samples.iter().enumerate() {
                at[knot].push((series, index, row));
            }
        }
        at
    }
}

fn interval(h: f64, moments: &[Moment]) -> Interval {
    let (a1, a2) = (&moments[0].a, &moments[1].a);
    let commutator = a2 * a1 - a1 * a2;
    let magnus = (a1 + a2) * (0.5 * h) + commutator * (3.0_f64.sqrt() / 12.0 * h * h);
    let transition = exponential(&magnus);
    let mean = (a1 + a2) * 0.5;
    let gains = [0, 1].map(|k| {
        // From a node to the end: the mean of the system over what is left.
        let left = h * (1.0 - NODES[k]);
        let along = if k == 0 { mean.clone() } else { a2.clone() };
        exponential(&(along * left)) * &moments[k].b * (0.5 * h)
    });
    Interval { transition, gains }
}

/// `exp(M)` by its series after halving.
fn exponential(m: &DMatrix<f64>) -> DMatrix<f64> {
    let mut halvings = 0;
    let mut scaled = m.clone();
    while scaled.amax() > 0.25 && halvings < 40 {
        scaled *= 0.5;
        halvings += 1;
    }
    let identity = DMatrix::identity(m.nrows(), m.ncols());
    let mut sum = identity.clone();
    for k in (1..=8).rev() {
        sum = &identity + (&scaled * sum) / f64::from(k);
    }
    for _ in 0..halvings {
        sum = &sum * &sum;
    }
    sum
}
