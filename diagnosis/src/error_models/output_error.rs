//! Correlated error at the output of a channel, with white noise of the sensor.

use mops_language::{Dual, Scalar};
use mops_math as math;

use super::likelihood::{LN_TWO_PI, Likelihood};
use super::process::{Matern32, OrnsteinUhlenbeck, Process, Steps};

/// Covariance of the correlated part of an output error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// Exponential: a rough error, such as that of a sensor.
    OrnsteinUhlenbeck,
    /// Matern-3/2: a smooth error, such as that of a model.
    Matern32,
}

/// Output error of a channel: a stationary process plus white noise. One for all records.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutputError {
    /// Covariance of the correlated part.
    pub kernel: Kernel,
    /// Standard deviation of the correlated part, in the unit of the residuals.
    pub deviation: f64,
    /// Correlation length, s.
    pub length: f64,
    /// Standard deviation of the white noise, in the unit of the residuals.
    pub noise: f64,
}

impl OutputError {
    /// Number of hyperparameters: the logarithms of deviation, length and noise, in this order.
    pub const HYPERPARAMETERS: usize = 3;

    /// Returns the log-likelihood of one channel of a record, with its derivatives with respect to the hyperparameters.
    ///
    /// `times` increase (s); `residuals` has as many values. Exact, in a time that grows linearly with the number of
    /// samples; sample times may be irregular.
    pub fn likelihood(&self, times: &[f64], residuals: &[f64]) -> Likelihood<Dual<3>> {
        let [deviation, length, noise] = [self.deviation, self.length, self.noise].map(math::ln);
        let exponential = |logarithm, index| Dual::<3>::variable(logarithm, index).exp();
        let (deviation, length) = (exponential(deviation, 0), exponential(length, 1));
        let noise = exponential(noise, 2);
        let mut likelihood = Likelihood::default();
        let mut add = |innovation, variance| likelihood.add(innovation, variance);
        match self.kernel {
            Kernel::OrnsteinUhlenbeck => {
                Filter::new(&OrnsteinUhlenbeck { deviation, length }, noise, times).innovations(residuals, &mut add);
            }
            Kernel::Matern32 => {
                Filter::new(&Matern32 { deviation, length }, noise, times).innovations(residuals, &mut add);
            }
        }
        likelihood
    }

    /// Replaces columns over the samples of one channel of a record by their innovations, divided by the standard
    /// deviations of these. Returns the sum of `ln S + ln 2 pi` over the variances `S`.
    ///
    /// With white residuals `r` the log-likelihood is `-(r'r + sum)/2`.
    pub fn whiten<'a>(&self, times: &[f64], columns: impl Iterator<Item = &'a mut [f64]>) -> f64 {
        let (deviation, length) = (self.deviation, self.length);
        match self.kernel {
            Kernel::OrnsteinUhlenbeck => {
                Filter::new(&OrnsteinUhlenbeck { deviation, length }, self.noise, times).whiten(columns)
            }
            Kernel::Matern32 => Filter::new(&Matern32 { deviation, length }, self.noise, times).whiten(columns),
        }
    }
}

/// Returns `f' K^-1 f` for values `f` of a Matern-3/2 process with covariance `K` at these times: the penalty of the
/// values.
pub(super) fn matern_penalty(deviation: f64, length: f64, times: &[f64], values: &[f64]) -> f64 {
    let mut penalty = 0.0;
    let filter = Filter::new(&Matern32 { deviation, length }, 0.0, times);
    filter.innovations(values, &mut |innovation, variance| penalty += innovation * innovation / variance);
    penalty
}

/// Kalman filter of a process observed with white noise, which depends on the sample times alone.
struct Filter<S, const D: usize> {
    /// State transition to each sample from the one before it.
    transitions: Vec<[[S; D]; D]>,
    gains: Vec<[S; D]>,
    /// Variances of the innovations.
    variances: Vec<S>,
}

impl<S: Scalar, const D: usize> Filter<S, D> {
    fn new(process: &impl Process<S, D>, noise: S, times: &[f64]) -> Self {
        let count = times.len();
        let (mut transitions, mut gains) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut variances = Vec::with_capacity(count);
        let noise = noise * noise;
        let mut p = process.stationary();
        let mut steps = Steps::new(process);
        for (k, &time) in times.iter().enumerate() {
            let (f, added) = steps.over(if k == 0 { 0.0 } else { time - times[k - 1] });
            if k > 0 {
                p = predicted(&f, &p, &added);
            }
            let variance = p[0][0] + noise;
            let gain: [S; D] = std::array::from_fn(|a| p[a][0] / variance);
            // The covariance with the value shrinks by noise/variance, a product that cannot lose digits by
            // subtraction.
            let share = noise / variance;
            let first: [S; D] = std::array::from_fn(|b| p[0][b]);
            for a in 1..D {
                for b in 1..D {
                    p[a][b] -= gain[a] * first[b];
                }
            }
            for b in 0..D {
                p[0][b] = first[b] * share;
                p[b][0] = p[0][b];
            }
            transitions.push(f);
            gains.push(gain);
            variances.push(variance);
        }
        Self { transitions, gains, variances }
    }

    fn innovations(&self, column: &[f64], add: &mut impl FnMut(S, S)) {
        let mut state = [S::from(0.0); D];
        for (k, &value) in column.iter().enumerate() {
            let f = &self.transitions[k];
            let predicted: [S; D] = std::array::from_fn(|a| {
                let mut sum = S::from(0.0);
                for b in 0..D {
                    sum += f[a][b] * state[b];
                }
                sum
            });
            let innovation = -predicted[0] + value;
            add(innovation, self.variances[k]);
            state = std::array::from_fn(|a| predicted[a] + self.gains[k][a] * innovation);
        }
    }
}

impl<const D: usize> Filter<f64, D> {
    fn whiten<'a>(&self, columns: impl Iterator<Item = &'a mut [f64]>) -> f64 {
        let mut white = Vec::with_capacity(self.variances.len());
        for column in columns {
            white.clear();
            self.innovations(column, &mut |innovation, variance: f64| white.push(innovation / variance.sqrt()));
            column.copy_from_slice(&white);
        }
        self.variances.iter().map(|&variance| math::ln(variance) + LN_TWO_PI).sum()
    }
}

/// Returns `F P F' + Q`.
fn predicted<S: Scalar, const D: usize>(f: &[[S; D]; D], p: &[[S; D]; D], q: &[[S; D]; D]) -> [[S; D]; D] {
    let mut next = *q;
    for a in 0..D {
        for b in a..D {
            for i in 0..D {
                for j in 0..D {
                    next[a][b] += f[a][i] * p[i][j] * f[b][j];
                }
            }
            next[b][a] = next[a][b];
        }
    }
    next
}
