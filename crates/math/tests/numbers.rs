//! Complex functions against those of real numbers, rough functions against accurate ones, and normal random numbers
//! against their distribution.

use mops_math::{self as math, complex, rough};
use nalgebra::Complex;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

const COUNT: usize = 400_000;

fn drawn() -> Vec<f64> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    (0..COUNT).map(|_| math::normal(&mut random)).collect()
}

#[test]
fn roots_and_exponentials_of_complex_numbers_agree_with_their_definitions() {
    for (re, im) in [(3.0, 4.0), (-3.0, 4.0), (-3.0, -4.0), (0.0, -2.0), (1e-9, 1e3), (-5.0, 1e-12)] {
        let z = Complex::new(re, im);
        let root = complex::sqrt(z);
        assert!(root.re >= 0.0 && (root * root - z).norm_sqr().sqrt() <= 4e-16 * complex::norm(z), "{z} {root}");
        let back = complex::from_polar(complex::norm(z), complex::arg(z));
        assert!((back - z).norm_sqr().sqrt() <= 4e-16 * complex::norm(z), "{z} {back}");
    }
    // exp(a + i b) = e^a (cos b + i sin b)
    let e = complex::exp(Complex::new(-0.5, 2.0));
    assert_eq!([e.re, e.im], [math::exp(-0.5) * math::cos(2.0), math::exp(-0.5) * math::sin(2.0)]);
    assert!((complex::norm(Complex::new(3e200, -4e200)) / 5e200 - 1.0).abs() <= f64::EPSILON);
}

/// Checks shares below a level, which are binomial: four standard deviations are exceeded once in 16,000 levels.
#[test]
fn as_many_normal_numbers_lie_below_every_level_as_should() {
    let mut numbers = drawn();
    numbers.sort_by(f64::total_cmp);
    for k in -40..=40 {
        let level = 0.1 * f64::from(k);
        let share = numbers.partition_point(|x| *x < level) as f64 / COUNT as f64;
        let expected = 0.5 * math::erfc(-level / 2f64.sqrt());
        let deviation = (expected * (1.0 - expected) / COUNT as f64).sqrt();
        assert!((share - expected).abs() <= 4.0 * deviation, "{level}: {share}, not {expected}");
    }
}

/// Checks the moments of order 1 to 4: 0, 1, 0, 3, with variances 1, 2, 15 and 96 divided by the count.
#[test]
fn moments_are_those_of_the_normal_distribution() {
    let numbers = drawn();
    for (order, moment, variance) in [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0)] {
        let found = numbers.iter().map(|x| math::powi(*x, order)).sum::<f64>() / COUNT as f64;
        assert!((found - moment).abs() <= 4.0 * (variance / COUNT as f64).sqrt(), "{order}: {found}");
    }
}

/// Checks the mean `phi(r)/Q(r)` beyond the edge of the first layer, where the density falls as `exp(-x^2/2)`.
#[test]
fn the_tail_has_its_mean() {
    let edge = 3.654_152_885_361_009;
    let chance = 0.5 * math::erfc(edge / 2f64.sqrt());
    let mean = math::exp(-0.5 * edge * edge) / (2.0 * std::f64::consts::PI).sqrt() / chance;
    let tail: Vec<f64> = drawn().into_iter().map(f64::abs).filter(|x| *x > edge).collect();
    let found = tail.iter().sum::<f64>() / tail.len() as f64;
    // The standard deviation of the tail is about 1/r.
    assert!((found - mean).abs() <= 4.0 / edge / (tail.len() as f64).sqrt(), "{found}, not {mean}");
}

#[test]
fn logarithm_and_power_have_their_stated_accuracy() {
    for k in -3000..3000 {
        let x = f64::from(k) / 97.0;
        let power = math::exp2(x);
        assert!((rough::exp2(x) / power - 1.0).abs() < 1.2e-4, "{x}");
        assert!((rough::log2(power) - x).abs() < 1.1e-3, "{x}");
    }
}
