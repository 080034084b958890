//! Smooth random force at the balances of a plant, with white noise of the sensors: filter, likelihood and smoother
//! along a linearised motion.

use mops_language::{Dual, Scalar};
use mops_math as math;

use super::likelihood::{LN_TWO_PI, Likelihood};
use super::output_error::matern_penalty;
use super::process::{Matern32, Process, Steps};
use crate::fit::dot;

/// Motion of a plant over one record, linearised from sample to sample: `x[k+1] = F[k] x[k] + G[k] f[k]`,
/// `r = H x + D f`.
///
/// `x` is the deviation of the states, `f[k]` the forces kept from sample `k` to the next one, in units of the nominal
/// forces of their balances, and `r` what they add to the residuals.
#[derive(Debug, Clone, Default)]
pub struct LinearisedMotion {
    /// Sample times of all channels, increasing, s.
    pub times: Vec<f64>,
    /// Number of states.
    pub states: usize,
    /// Number of forces.
    pub forces: usize,
    /// `F` between samples, row by row, one after the other.
    pub transitions: Vec<f64>,
    /// `G` between samples, row by row, one after the other.
    pub gains: Vec<f64>,
    /// What is measured at each sample.
    pub measured: Vec<Vec<Measured>>,
}

/// Measured value at a sample.
#[derive(Debug, Clone)]
pub struct Measured {
    /// Index of the channel.
    pub channel: usize,
    /// Index among the residuals of the record.
    pub residual: usize,
    /// Derivatives of the residual with respect to the states (a row of `H`), then to each force (a row of `D`) and its
    /// rate, which is 0; without forces that act on the output, those of the states suffice.
    pub slopes: Vec<f64>,
}

impl LinearisedMotion {
    fn transition(&self, k: usize) -> &[f64] {
        let size = self.states * self.states;
        &self.transitions[k * size..(k + 1) * size]
    }

    fn gain(&self, k: usize) -> &[f64] {
        let size = self.states * self.forces;
        &self.gains[k * size..(k + 1) * size]
    }

    /// Returns what forces add to the residuals; `forces` holds those of each sample one after the other.
    pub fn response(&self, forces: &[f64]) -> Vec<f64> {
        let mut residuals = vec![0.0; self.measured.iter().map(Vec::len).sum()];
        let mut x = vec![0.0; self.states];
        for (k, measured) in self.measured.iter().enumerate() {
            let f = &forces[k * self.forces..(k + 1) * self.forces];
            for m in measured {
                let (of_states, of_forces) = m.slopes.split_at(self.states);
                let direct = of_forces.iter().step_by(2).zip(f).map(|(d, f)| d * f).sum::<f64>();
                residuals[m.residual] = dot(of_states, &x) + direct;
            }
            if k + 1 < self.times.len() {
                let of_states = self.transition(k).chunks_exact(self.states).map(|row| dot(row, &x));
                let of_forces = self.gain(k).chunks_exact(self.forces).map(|row| dot(row, f));
                x = of_states.zip(of_forces).map(|(a, b)| a + b).collect();
            }
        }
        residuals
    }
}

/// Random forces, independent Matern-3/2 processes of one deviation and one correlation length, plus white noise of the
/// sensors. One for all records.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceError {
    /// Standard deviation of the forces, in nominal forces.
    pub deviation: f64,
    /// Correlation length, s.
    pub length: f64,
    /// Standard deviation of the white noise of each channel, in the unit of the residuals.
    pub noise: Vec<f64>,
}

impl ForceError {
    /// Returns the log-likelihood of the residuals of a record, with its derivatives with respect to the
    /// hyperparameters: the logarithms of deviation, length and each noise, in this order; derivatives beyond these are
    /// 0.
    ///
    /// # Panics
    /// `N` is less than the number of hyperparameters.
    pub fn likelihood<const N: usize>(&self, motion: &LinearisedMotion, residuals: &[f64]) -> Likelihood<Dual<N>> {
        assert!(N >= 2 + self.noise.len(), "one direction per hyperparameter");
        let exponential = |value: f64, index| Dual::<N>::variable(math::ln(value), index).exp();
        let process = Matern32 { deviation: exponential(self.deviation, 0), length: exponential(self.length, 1) };
        let noise: Vec<Dual<N>> = self.noise.iter().enumerate().map(|(c, &noise)| exponential(noise, 2 + c)).collect();
        let mut likelihood = Likelihood::default();
        let mut state = vec![Dual::from(0.0); motion.states + 2 * motion.forces];
        let mut next = state.clone();
        Recursion::new(motion, &process, &noise).run(|event| match event {
            Event::Measured(m, gain, variance) => {
                let innovation = innovation(m, &state, residuals[m.residual]);
                likelihood.add(innovation, variance);
                state.iter_mut().zip(gain).for_each(|(x, k)| *x += *k * innovation);
            }
            Event::Sample(k, kernel) => {
                moved(motion, k, kernel, &state, &mut next);
                std::mem::swap(&mut state, &mut next);
            }
        });
        likelihood
    }

    /// Replaces columns over the residuals of a record by their innovations, divided by the standard deviations of
    /// these. Returns the sum of `ln S + ln 2 pi` over the variances `S`, see [`super::OutputError::whiten`].
    pub fn whiten<'a>(&self, motion: &LinearisedMotion, columns: impl Iterator<Item = &'a mut [f64]>) -> f64 {
        let process = Matern32 { deviation: self.deviation, length: self.length };
        let mut columns: Vec<&mut [f64]> = columns.collect();
        let mut next = vec![0.0; motion.states + 2 * motion.forces];
        let mut states = vec![next.clone(); columns.len()];
        let mut sum = 0.0;
        Recursion::new(motion, &process, &self.noise).run(|event| match event {
            Event::Measured(m, gain, variance) => {
                sum += math::ln(variance) + LN_TWO_PI;
                for (column, state) in columns.iter_mut().zip(&mut states) {
                    let innovation = innovation(m, state, column[m.residual]);
                    column[m.residual] = innovation / variance.sqrt();
                    state.iter_mut().zip(gain).for_each(|(x, k)| *x += k * innovation);
                }
            }
            Event::Sample(k, kernel) => {
                for state in &mut states {
                    moved(motion, k, kernel, state, &mut next);
                    state.copy_from_slice(&next);
                }
            }
        });
        sum
    }

    /// Returns `f' K^-1 f` for forces `f` with the covariance `K` at the samples of a motion: the penalty of the
    /// forces.
    pub fn penalty(&self, motion: &LinearisedMotion, forces: &[f64]) -> f64 {
        let of = |j: usize| {
            let values: Vec<f64> = forces.iter().skip(j).step_by(motion.forces).copied().collect();
            matern_penalty(self.deviation, self.length, &motion.times, &values)
        };
        (0..motion.forces).map(of).sum()
    }

    /// Returns the most probable forces behind the residuals of a record, in nominal forces: those of each sample one
    /// after the other.
    ///
    /// Source: G. Bierman, Fixed interval smoothing with discrete measurements, International Journal of Control 18
    /// (1973) 65 (modified Bryson-Frazier smoother).
    pub fn smooth(&self, motion: &LinearisedMotion, residuals: &[f64]) -> Vec<f64> {
        let process = Matern32 { deviation: self.deviation, length: self.length };
        let (states, forces, count) = (motion.states, motion.forces, motion.times.len());
        let size = states + 2 * forces;
        let mut state = vec![0.0; size];
        // Of each measured value the gain and the innovation over its variance; of each sample the predicted forces
        // with their rows of the covariance, and the transition that follows.
        let (mut updates, mut predictions, mut kernels) = (Vec::new(), Vec::new(), Vec::new());
        let mut recursion = Recursion::new(motion, &process, &self.noise);
        let mut predicted = |state: &[f64], p: &[f64]| {
            let rows: Vec<usize> = (0..forces).map(|j| states + 2 * j).collect();
            let values: Vec<f64> = rows.iter().map(|&row| state[row]).collect();
            predictions
                .push((values, rows.iter().flat_map(|&row| p[row * size..][..size].to_vec()).collect::<Vec<f64>>()));
        };
        for k in 0..count {
            predicted(&state, &recursion.covariance);
            for m in &motion.measured[k] {
                let variance = recursion.measure(m);
                let innovation = innovation(m, &state, residuals[m.residual]);
                state.iter_mut().zip(&recursion.gain).for_each(|(x, gain)| *x += gain * innovation);
                updates.push((recursion.gain.clone(), innovation / variance));
            }
            if k + 1 < count {
                let kernel = recursion.predict(k);
                let before = state.clone();
                moved(motion, k, &kernel, &before, &mut state);
                kernels.push(kernel);
            }
        }
        let mut smoothed = vec![0.0; count * forces];
        let mut adjoint = vec![0.0; size];
        for k in (0..count).rev() {
            for m in motion.measured[k].iter().rev() {
                let (gain, scaled) = updates.pop().expect("one per measured value");
                let pull = -scaled - dot(&gain, &adjoint);
                adjoint.iter_mut().zip(&m.slopes).for_each(|(a, slope)| *a += slope * pull);
            }
            let (values, rows) = &predictions[k];
            for j in 0..forces {
                smoothed[k * forces + j] = values[j] - dot(&rows[j * size..(j + 1) * size], &adjoint);
            }
            if k > 0 {
                adjoint = transposed(motion, k - 1, &kernels[k - 1], &adjoint);
            }
        }
        smoothed
    }
}

/// Transition of a force and its rate.
type KernelStep<S> = [[S; 2]; 2];

/// Event of the covariance recursion.
enum Event<'a, S> {
    /// Measured value with its gain and the variance of its innovation.
    Measured(&'a Measured, &'a [S], S),
    /// Transition from the sample of this index to the next.
    Sample(usize, &'a KernelStep<S>),
}

/// Recursion of the covariance of states, forces and rates of forces, which depends on no residual.
struct Recursion<'a, S, P> {
    motion: &'a LinearisedMotion,
    /// Variance of the white noise of each channel.
    noise: Vec<S>,
    /// Covariance, row by row: states first, then each force with its rate.
    covariance: Vec<S>,
    gain: Vec<S>,
    /// Buffers: for products with the covariance, and for one of its rows before and after a step.
    product: Vec<S>,
    row: [Vec<S>; 2],
    /// Steps of a force from sample to sample.
    steps: Steps<'a, S, P, 2>,
}

impl<'a, S: Scalar, P: Process<S, 2>> Recursion<'a, S, P> {
    fn new(motion: &'a LinearisedMotion, process: &'a P, noise: &[S]) -> Self {
        let zero = S::from(0.0);
        let size = motion.states + 2 * motion.forces;
        let mut covariance = vec![zero; size * size];
        let stationary = process.stationary();
        for j in 0..motion.forces {
            let row = motion.states + 2 * j;
            for (a, stationary) in stationary.iter().enumerate() {
                covariance[(row + a) * size + row..][..2].copy_from_slice(stationary);
            }
        }
        let noise = noise.iter().map(|&noise| noise * noise).collect();
        let (gain, product) = (vec![zero; size], vec![zero; size * size]);
        let row = [gain.clone(), gain.clone()];
        Self { motion, noise, covariance, gain, product, row, steps: Steps::new(process) }
    }

    fn run(mut self, mut on: impl FnMut(Event<'_, S>)) {
        let count = self.motion.times.len();
        for k in 0..count {
            for m in &self.motion.measured[k] {
                let variance = self.measure(m);
                on(Event::Measured(m, &self.gain, variance));
            }
            if k + 1 < count {
                let kernel = self.predict(k);
                on(Event::Sample(k, &kernel));
            }
        }
    }

    /// Updates the covariance with a measured value; returns the variance of its innovation, and leaves its gain in
    /// `self.gain`.
    fn measure(&mut self, m: &Measured) -> S {
        let size = self.gain.len();
        let noise = self.noise[m.channel];
        let [across, lost] = &mut self.row;
        let rows = self.covariance.chunks_exact(size);
        across.iter_mut().zip(rows).for_each(|(across, row)| *across = weighted(&m.slopes, row));
        let variance = weighted(&m.slopes, across) + noise;
        let precision = S::from(1.0) / variance;
        self.gain.iter_mut().zip(&*across).for_each(|(gain, &across)| *gain = across * precision);
        for a in 0..size {
            for b in a..size {
                let value = self.covariance[a * size + b] - self.gain[a] * across[b];
                self.covariance[a * size + b] = value;
                self.covariance[b * size + a] = value;
            }
        }
        // Joseph's form corrects what the subtraction lost. Source: R. Bucy, P. Joseph, Filtering for Stochastic
        // Processes (1968).
        let rows = self.covariance.chunks_exact(size).zip(&self.gain);
        lost.iter_mut().zip(rows).for_each(|(lost, (row, &gain))| *lost = weighted(&m.slopes, row) - noise * gain);
        for a in 0..size {
            for b in a..size {
                let correction = (lost[a] * self.gain[b] + self.gain[a] * lost[b]) * 0.5;
                let value = self.covariance[a * size + b] - correction;
                self.covariance[a * size + b] = value;
                self.covariance[b * size + a] = value;
            }
        }
        variance
    }

    /// Moves the covariance from a sample to the next one; returns the transition of the forces.
    fn predict(&mut self, k: usize) -> KernelStep<S> {
        let (states, size) = (self.motion.states, self.gain.len());
        let (kernel, noise) = self.steps.over(self.motion.times[k + 1] - self.motion.times[k]);
        // With the transition T of all: first T P, then (T P) T', by columns of the transposed product.
        let [before, after] = &mut self.row;
        for b in 0..size {
            before.iter_mut().enumerate().for_each(|(a, x)| *x = self.covariance[a * size + b]);
            moved(self.motion, k, &kernel, before, &mut self.product[b * size..(b + 1) * size]);
        }
        for a in 0..size {
            before.iter_mut().enumerate().for_each(|(b, x)| *x = self.product[b * size + a]);
            moved(self.motion, k, &kernel, before, after);
            for b in a..size {
                self.covariance[a * size + b] = after[b];
                self.covariance[b * size + a] = after[b];
            }
        }
        for j in 0..self.motion.forces {
            let row = states + 2 * j;
            for a in 0..2 {
                for b in 0..2 {
                    self.covariance[(row + a) * size + row + b] += noise[a][b];
                }
            }
        }
        kernel
    }
}

/// Returns the sum of products of slopes with the first of `values`.
#[inline]
fn weighted<S: Scalar>(slopes: &[f64], values: &[S]) -> S {
    let mut sum = S::from(0.0);
    for (&slope, &value) in slopes.iter().zip(values) {
        sum += value * slope;
    }
    sum
}

fn innovation<S: Scalar>(m: &Measured, state: &[S], residual: f64) -> S {
    -weighted(&m.slopes, state) + residual
}

/// Writes states, forces and rates at the sample after `k`.
fn moved<S: Scalar>(motion: &LinearisedMotion, k: usize, kernel: &KernelStep<S>, x: &[S], next: &mut [S]) {
    let (states, forces) = (motion.states, motion.forces);
    let (transition, gain) = (motion.transition(k), motion.gain(k));
    let (of_states, of_forces) = next.split_at_mut(states);
    for (a, next) in of_states.iter_mut().enumerate() {
        let mut sum = weighted(&transition[a * states..(a + 1) * states], x);
        for j in 0..forces {
            sum += x[states + 2 * j] * gain[a * forces + j];
        }
        *next = sum;
    }
    for (force, next) in x[states..].chunks_exact(2).zip(of_forces.chunks_exact_mut(2)) {
        for (row, next) in kernel.iter().zip(next) {
            *next = row[0] * force[0] + row[1] * force[1];
        }
    }
}

/// Returns the product of the transposed transition from sample `k` with an adjoint state.
fn transposed(motion: &LinearisedMotion, k: usize, kernel: &KernelStep<f64>, x: &[f64]) -> Vec<f64> {
    let (states, forces) = (motion.states, motion.forces);
    let (transition, gain) = (motion.transition(k), motion.gain(k));
    let mut before = vec![0.0; x.len()];
    for a in 0..states {
        for b in 0..states {
            before[b] += transition[a * states + b] * x[a];
        }
        for j in 0..forces {
            before[states + 2 * j] += gain[a * forces + j] * x[a];
        }
    }
    for j in 0..forces {
        let row = states + 2 * j;
        for a in 0..2 {
            for b in 0..2 {
                before[row + b] += kernel[a][b] * x[row + a];
            }
        }
    }
    before
}
