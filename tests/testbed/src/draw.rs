//! Random numbers of a trial, in streams by label: an additional draw in one place changes nothing elsewhere.

use mops_math as math;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Stream of random numbers.
#[derive(Debug, Clone)]
pub struct Draw(Xoshiro256PlusPlus);

impl Draw {
    /// Creates the stream of a seed and a label.
    pub fn new(seed: u64, label: &str) -> Self {
        // FNV-1a; seed_from_u64 spreads it over the state.
        let hash =
            label.bytes().fold(0xcbf2_9ce4_8422_2325 ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15), |hash, byte| {
                (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
            });
        Self(Xoshiro256PlusPlus::seed_from_u64(hash))
    }

    /// Draws from the uniform distribution between two numbers.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// Draws from the log-uniform distribution between two positive numbers.
    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        math::exp(self.between(math::ln(low), math::ln(high)))
    }

    /// Draws from the standard normal distribution.
    pub fn normal(&mut self) -> f64 {
        math::normal(&mut self.0)
    }

    /// Draws 1 or -1.
    pub fn sign(&mut self) -> f64 {
        if self.0.random::<bool>() { 1.0 } else { -1.0 }
    }

    /// Returns true with the given probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.0.random::<f64>() < probability
    }

    /// Draws an integer below `n`, which must be positive.
    pub fn below(&mut self, n: usize) -> usize {
        self.0.random_range(0..n)
    }
}
