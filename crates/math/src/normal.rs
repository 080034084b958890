//! Normal random numbers.

use rand::Rng;

use crate::layers::EDGES;
use crate::{exp, ln};

/// Returns a standard normal random number by the ziggurat method with 256 layers.
///
/// A number of 64 bits selects a layer and a position in it, which lies below the density in 99 of 100 cases. Wedges
/// and the tail need more numbers.
///
/// Source: J. A. Doornik, An Improved Ziggurat Method to Generate Normal Random Samples, University of Oxford (2005);
/// the tail by G. Marsaglia, Technometrics 6 (1964) 101-102.
pub fn normal<R: Rng + ?Sized>(random: &mut R) -> f64 {
    let density = |x: f64| exp(-0.5 * x * x);
    loop {
        let bits = random.next_u64();
        let layer = (bits & 0xff) as usize;
        // The upper 52 bits are the mantissa of a number in [2, 4), from which 3 is subtracted.
        let u = f64::from_bits(bits >> 12 | 1024 << 52) - 3.0;
        let x = u * EDGES[layer];
        if x.abs() < EDGES[layer + 1] {
            return x;
        }
        if layer == 0 {
            return tail(random).copysign(u);
        }
        let [low, high] = [EDGES[layer], EDGES[layer + 1]].map(density);
        if high + (low - high) * random.random::<f64>() < density(x) {
            return x;
        }
    }
}

/// Returns a normal random number beyond the edge of the first layer.
fn tail<R: Rng + ?Sized>(random: &mut R) -> f64 {
    let edge = EDGES[1];
    loop {
        let [x, y] = [open(random), open(random)].map(|u| -ln(u));
        let x = x / edge;
        if 2.0 * y >= x * x {
            return edge + x;
        }
    }
}

/// Returns a random number in (0, 1), both ends excluded, in steps of 2^-52.
fn open<R: Rng + ?Sized>(random: &mut R) -> f64 {
    f64::from_bits(random.next_u64() >> 12 | 1023 << 52) - (1.0 - 0.5 * f64::EPSILON)
}
