//! Stationary Gaussian processes as linear state-space models driven by white noise.
//!
//! Source: J. Hartikainen, S. Sarkka, Kalman filtering and smoothing solutions to temporal Gaussian process regression
//! models, IEEE International Workshop on Machine Learning for Signal Processing (2010).

use mops_language::Scalar;

/// Stationary Gaussian process with mean 0 and `D` states, the first of which is its value.
pub trait Process<S: Scalar, const D: usize> {
    /// Returns the covariance of the states.
    fn stationary(&self) -> [[S; D]; D];

    /// Returns the state transition over `dt` seconds.
    fn transition(&self, dt: f64) -> [[S; D]; D];

    /// Returns the covariance that the driving noise adds to the states over `dt` seconds.
    fn noise(&self, dt: f64) -> [[S; D]; D];
}

/// Steps of a process: transition and noise over a step, kept for the next one if that is as long.
pub struct Steps<'p, S, P, const D: usize> {
    process: &'p P,
    last: Option<Step<S, D>>,
}

/// Length of a step, s, with the transition and the noise over it.
type Step<S, const D: usize> = (f64, [[S; D]; D], [[S; D]; D]);

/// Relative difference of two steps up to which they are as long: the rounding of time stamps.
const AS_LONG: f64 = 1e-9;

impl<'p, S: Scalar, P: Process<S, D>, const D: usize> Steps<'p, S, P, D> {
    pub fn new(process: &'p P) -> Self {
        Self { process, last: None }
    }

    /// Returns transition and noise over a step.
    pub fn over(&mut self, dt: f64) -> ([[S; D]; D], [[S; D]; D]) {
        let known = self.last.filter(|(of, ..)| (of - dt).abs() <= AS_LONG * dt);
        let (_, transition, noise) =
            *self.last.insert(known.unwrap_or_else(|| (dt, self.process.transition(dt), self.process.noise(dt))));
        (transition, noise)
    }
}

/// Ornstein-Uhlenbeck process: covariance `deviation^2 exp(-d/length)` at the distance `d` in s.
#[derive(Debug, Clone, Copy)]
pub struct OrnsteinUhlenbeck<S> {
    /// Standard deviation.
    pub deviation: S,
    /// Correlation length, s.
    pub length: S,
}

impl<S: Scalar> Process<S, 1> for OrnsteinUhlenbeck<S> {
    fn stationary(&self) -> [[S; 1]; 1] {
        [[self.deviation * self.deviation]]
    }

    fn transition(&self, dt: f64) -> [[S; 1]; 1] {
        [[(S::from(-dt) / self.length).exp()]]
    }

    fn noise(&self, dt: f64) -> [[S; 1]; 1] {
        // 1 - exp(-x) = tanh(x/2) (1 + exp(-x)), without cancellation for small x.
        let x = S::from(2.0 * dt) / self.length;
        [[self.deviation * self.deviation * (x * 0.5).tanh() * ((-x).exp() + 1.0)]]
    }
}

/// Matern-3/2 process: covariance `deviation^2 (1 + a) exp(-a)` with `a = sqrt(3) d/length` at the distance `d` in s.
/// States: value and rate.
#[derive(Debug, Clone, Copy)]
pub struct Matern32<S> {
    /// Standard deviation.
    pub deviation: S,
    /// Correlation length, s.
    pub length: S,
}

/// Value of `2 lambda dt` below which the integrals of [`Matern32::noise`] are summed as a series: from there on the
/// closed form loses less than two bits.
const SERIES: f64 = 2.0;

/// Terms of the series: at `2 lambda dt = 2` the last one is below 1e-17 of the sum.
const TERMS: u32 = 28;

impl<S: Scalar> Matern32<S> {
    fn rate(&self) -> S {
        S::from(3.0_f64.sqrt()) / self.length
    }

    /// Returns the integrals of `s^k exp(-2 lambda s)` over `[0, dt]` for `k` = 0, 1, 2.
    ///
    /// All terms of the series and of the downward recursion are positive, so that nothing cancels for short steps.
    /// Source: NIST Digital Library of Mathematical Functions, equations 8.7.1 and 8.8.1 (incomplete gamma function).
    fn integrals(&self, dt: f64) -> [S; 3] {
        let twice = self.rate() * 2.0;
        let x = twice * dt;
        let decay = (-x).exp();
        if x.value() >= SERIES {
            let first = (-decay + 1.0) / twice;
            let second = (first - decay * dt) / twice;
            return [first, second, (second * 2.0 - decay * (dt * dt)) / twice];
        }
        let mut term = S::from(1.0 / 3.0);
        let mut sum = term;
        for j in 1..=TERMS {
            term = term * x / f64::from(3 + j);
            sum += term;
        }
        let third = sum * decay * (dt * dt * dt);
        let second = (decay * (dt * dt) + twice * third) * 0.5;
        [decay * dt + twice * second, second, third]
    }
}

impl<S: Scalar> Process<S, 2> for Matern32<S> {
    fn stationary(&self) -> [[S; 2]; 2] {
        let (variance, zero) = (self.deviation * self.deviation, S::from(0.0));
        let rate = self.rate();
        [[variance, zero], [zero, variance * rate * rate]]
    }

    fn transition(&self, dt: f64) -> [[S; 2]; 2] {
        let rate = self.rate();
        let (x, decay) = (rate * dt, (-(rate * dt)).exp());
        [[decay * (x + 1.0), decay * dt], [-(decay * rate * x), decay * (-x + 1.0)]]
    }

    fn noise(&self, dt: f64) -> [[S; 2]; 2] {
        let rate = self.rate();
        let density = rate * rate * rate * self.deviation * self.deviation * 4.0;
        let [i0, i1, i2] = self.integrals(dt);
        // The integral of s (1 - lambda s) exp(-2 lambda s), whose antiderivative is s^2 exp(-2 lambda s)/2.
        let across = density * (-(rate * (2.0 * dt))).exp() * (0.5 * dt * dt);
        [[density * i2, across], [across, density * (i0 - rate * i1 * 2.0 + rate * rate * i2)]]
    }
}

#[cfg(test)]
mod tests;
