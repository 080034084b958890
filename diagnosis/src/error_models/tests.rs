//! Error models against an independent implementation, dense Gaussian densities and finite differences.

use mops_math as math;
use nalgebra::{DMatrix, DVector};

use super::*;

/// Generator of uniform numbers in [-1, 1). Source: G. Steele, D. Lea, C. Flood, Fast splittable pseudorandom number
/// generators, OOPSLA (2014).
struct SplitMix(u64);

impl SplitMix {
    #[allow(clippy::cast_precision_loss)]
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 * math::powi(2.0, -52) - 1.0
    }
}

/// Returns times and residuals of a first-order autoregressive series with white noise.
fn series(seed: u64, count: usize, regular: bool) -> (Vec<f64>, Vec<f64>) {
    let mut random = SplitMix(seed);
    let (mut times, mut time) = (Vec::new(), 0.0);
    for _ in 0..count {
        times.push(time);
        time += if regular { 0.05 } else { 0.02 + 0.03 * (1.0 + random.uniform()) };
    }
    let mut smooth = 0.0;
    let residuals = times.iter().map(|_| {
        smooth = 0.9 * smooth + random.uniform();
        smooth + 0.3 * random.uniform()
    });
    let residuals = residuals.collect();
    (times, residuals)
}

/// Returns a random linearised motion with gaps in its channels, and residuals.
fn motion(seed: u64, count: usize, states: usize, forces: usize, channels: usize) -> (LinearisedMotion, Vec<f64>) {
    let mut random = SplitMix(seed);
    let mut motion = LinearisedMotion { states, forces, ..LinearisedMotion::default() };
    let mut time = 0.0;
    for _ in 0..count {
        motion.times.push(time);
        time += 0.02 + 0.01 * (1.0 + random.uniform());
    }
    for _ in 1..count {
        for a in 0..states {
            for b in 0..states {
                motion.transitions.push(if a == b { 0.95 } else { 0.0 } + 0.05 * random.uniform());
            }
            for _ in 0..forces {
                motion.gains.push(0.1 * random.uniform());
            }
        }
    }
    let mut residuals = Vec::new();
    for _ in 0..count {
        let mut measured = Vec::new();
        for channel in 0..channels {
            let slope = |a| if a == channel { 1.0 } else { 0.0 } + 0.1 * random.uniform();
            let slopes = (0..states).map(slope).collect();
            let is_measured = random.uniform() < 0.6;
            let residual = random.uniform();
            if is_measured {
                measured.push(Measured { channel, residual: residuals.len(), slopes });
                residuals.push(residual);
            }
        }
        motion.measured.push(measured);
    }
    (motion, residuals)
}

fn matern(deviation: f64, length: f64, distance: f64) -> f64 {
    let a = 3.0_f64.sqrt() * distance.abs() / length;
    deviation * deviation * (1.0 + a) * math::exp(-a)
}

/// Returns the logarithm of the normal density with mean 0.
fn density(covariance: DMatrix<f64>, values: &[f64]) -> f64 {
    let values = DVector::from_column_slice(values);
    let cholesky = covariance.cholesky().expect("positive definite");
    let determinant: f64 = cholesky.l_dirty().diagonal().iter().map(|l| 2.0 * math::ln(*l)).sum();
    -0.5 * (values.dot(&cholesky.solve(&values)) + determinant + values.len() as f64 * likelihood::LN_TWO_PI)
}

fn relative(a: f64, b: f64) -> f64 {
    (a - b).abs() / b.abs().max(1.0)
}

// Log-likelihoods of the same series by an independent implementation in Python, computed once: (seed, samples,
// regular), (deviation, length, noise), Ornstein-Uhlenbeck, Matern-3/2.
type Reference = ((u64, usize, bool), [f64; 3], f64, f64);
const OUTPUT: [Reference; 4] = [
    ((1, 200, true), [1.4, 0.4, 0.3], -194.473_747_499_378_08, -212.215_458_838_753_48),
    ((2, 150, false), [1.4, 0.4, 0.3], -152.744_739_103_288_85, -179.879_771_696_671_07),
    ((3, 200, true), [3.0, 20.0, 0.05], -711.118_401_499_714_8, -19_512.528_782_782_912),
    ((4, 100, false), [0.5, 0.01, 1.0], -155.459_127_613_657_16, -155.551_417_437_799_8),
];

#[test]
fn likelihoods_of_output_errors_are_those_of_an_independent_implementation() {
    for ((seed, count, regular), [deviation, length, noise], rough, smooth) in OUTPUT {
        let (times, residuals) = series(seed, count, regular);
        for (kernel, expected) in [(Kernel::OrnsteinUhlenbeck, rough), (Kernel::Matern32, smooth)] {
            let error = OutputError { kernel, deviation, length, noise };
            let found = error.likelihood(&times, &residuals).log();
            assert!(relative(found, expected) < 1e-9, "{seed} {kernel:?}: {found} {expected}");
            let mut white = residuals.clone();
            let sum = error.whiten(&times, std::iter::once(&mut white[..]));
            let again = -0.5 * (white.iter().map(|r| r * r).sum::<f64>() + sum);
            assert!(relative(again, expected) < 1e-9, "{seed} {kernel:?}: {again} {expected}");
        }
    }
}

#[test]
fn likelihoods_of_output_errors_are_dense_normal_densities() {
    let (times, residuals) = series(5, 60, false);
    let (deviation, length, noise) = (0.8, 0.25, 0.2);
    for kernel in [Kernel::OrnsteinUhlenbeck, Kernel::Matern32] {
        let covariance = DMatrix::from_fn(60, 60, |i, j| {
            let distance = (times[i] - times[j]).abs();
            let smooth = match kernel {
                Kernel::OrnsteinUhlenbeck => deviation * deviation * math::exp(-distance / length),
                Kernel::Matern32 => matern(deviation, length, distance),
            };
            smooth + if i == j { noise * noise } else { 0.0 }
        });
        let found = OutputError { kernel, deviation, length, noise }.likelihood(&times, &residuals).log();
        assert!(relative(found, density(covariance, &residuals)) < 1e-11, "{kernel:?}");
    }
}

#[test]
fn an_output_error_without_correlated_part_is_white_noise() {
    let (times, residuals) = series(6, 80, true);
    let white: f64 = residuals.iter().map(|r| -0.5 * (r * r / 0.09 + math::ln(0.09) + likelihood::LN_TWO_PI)).sum();
    for kernel in [Kernel::OrnsteinUhlenbeck, Kernel::Matern32] {
        let error = OutputError { kernel, deviation: 1e-9, length: 0.3, noise: 0.3 };
        assert!(relative(error.likelihood(&times, &residuals).log(), white) < 1e-12);
    }
}

#[test]
fn gradients_of_output_errors_agree_with_central_differences() {
    let (times, residuals) = series(7, 90, false);
    for kernel in [Kernel::OrnsteinUhlenbeck, Kernel::Matern32] {
        let at = |logarithms: [f64; 3]| {
            let [deviation, length, noise] = logarithms.map(math::exp);
            OutputError { kernel, deviation, length, noise }.likelihood(&times, &residuals)
        };
        let point = [0.3, -1.1, -1.4];
        let gradient = at(point).gradient();
        for k in 0..3 {
            let side = |h: f64| {
                let mut there = point;
                there[k] += h;
                at(there).log()
            };
            let difference = (side(1e-5) - side(-1e-5)) / 2e-5;
            assert!((gradient[k] - difference).abs() < 1e-6 * (1.0 + difference.abs()), "{kernel:?} {k}");
        }
    }
}

#[test]
fn the_information_of_white_noise_is_that_of_the_textbook() {
    // Of the logarithm of the standard deviation: 2 per sample, whatever the residuals are.
    let (times, residuals) = series(8, 50, true);
    let error = OutputError { kernel: Kernel::Matern32, deviation: 1e-9, length: 0.3, noise: 0.3 };
    assert!((error.likelihood(&times, &residuals).information()[(2, 2)] - 100.0).abs() < 1e-9);
}

#[test]
fn the_information_is_the_covariance_of_the_gradient() {
    // Over series drawn from the model itself, by Cholesky factors of its covariance.
    let (count, draws) = (40, 1500);
    let mut random = SplitMix(9);
    let times: Vec<f64> = (0..count).map(|k| 0.05 * f64::from(k)).collect();
    let error = OutputError { kernel: Kernel::Matern32, deviation: 0.9, length: 0.2, noise: 0.4 };
    let covariance = DMatrix::from_fn(count as usize, count as usize, |i, j| {
        matern(0.9, 0.2, times[i] - times[j]) + if i == j { 0.16 } else { 0.0 }
    });
    let root = covariance.cholesky().expect("positive definite").unpack();
    let mut sum = DMatrix::zeros(3, 3);
    let mut information = DMatrix::zeros(3, 3);
    for _ in 0..draws {
        // Sums of twelve uniform numbers have variance 4 and nearly the fourth moment of a normal distribution.
        let normal = DVector::from_fn(count as usize, |_, _| (0..12).map(|_| random.uniform()).sum::<f64>() / 2.0);
        let found = error.likelihood(&times, (&root * normal).as_slice());
        sum += found.gradient() * found.gradient().transpose() / f64::from(draws);
        information += found.information() / f64::from(draws);
    }
    for a in 0..3 {
        let (found, expected) = (sum[(a, a)], information[(a, a)]);
        // Four standard errors of a variance: 4 sqrt(2/1500) = 0.146.
        assert!((found / expected - 1.0).abs() < 0.15, "{a}: {found} {expected}");
    }
}

/// Seed, samples, states, forces, channels; deviation, length, noise of each channel; log-likelihood. See [`OUTPUT`].
type ReferenceForce = (u64, [usize; 4], f64, f64, &'static [f64], f64);
const FORCE: [ReferenceForce; 3] = [
    (11, [120, 2, 1, 1], 1.5, 0.2, &[0.4], -103.134_050_402_033_3),
    (12, [80, 4, 2, 2], 0.7, 0.05, &[0.5, 0.2], -237.477_694_114_054_4),
    (13, [60, 3, 2, 1], 2.0, 3.0, &[0.1], -673.467_121_282_316_5),
];

fn force_likelihood(error: &ForceError, motion: &LinearisedMotion, residuals: &[f64]) -> (f64, DVector<f64>) {
    if error.noise.len() == 1 {
        let found = error.likelihood::<3>(motion, residuals);
        (found.log(), found.gradient())
    } else {
        let found = error.likelihood::<4>(motion, residuals);
        (found.log(), found.gradient())
    }
}

#[test]
fn likelihoods_of_force_errors_are_those_of_an_independent_implementation() {
    for (seed, [count, states, forces, channels], deviation, length, noise, expected) in FORCE {
        let (motion, residuals) = motion(seed, count, states, forces, channels);
        let error = ForceError { deviation, length, noise: noise.to_vec() };
        let (found, _) = force_likelihood(&error, &motion, &residuals);
        assert!(relative(found, expected) < 1e-9, "{seed}: {found} {expected}");
        let mut white = residuals.clone();
        let sum = error.whiten(&motion, std::iter::once(&mut white[..]));
        let again = -0.5 * (white.iter().map(|r| r * r).sum::<f64>() + sum);
        assert!(relative(again, expected) < 1e-9, "{seed}: {again} {expected}");
    }
}

#[test]
fn gradients_of_force_errors_agree_with_central_differences() {
    let (motion, residuals) = motion(14, 50, 3, 2, 2);
    let at = |logarithms: [f64; 4]| {
        let [deviation, length, first, second] = logarithms.map(math::exp);
        force_likelihood(&ForceError { deviation, length, noise: vec![first, second] }, &motion, &residuals)
    };
    let point = [0.2, -1.5, -0.9, -0.4];
    let (_, gradient) = at(point);
    for k in 0..4 {
        let side = |h: f64| {
            let mut there = point;
            there[k] += h;
            at(there).0
        };
        let difference = (side(1e-5) - side(-1e-5)) / 2e-5;
        assert!(
            (gradient[k] - difference).abs() < 1e-6 * (1.0 + difference.abs()),
            "{k}: {} {difference}",
            gradient[k]
        );
    }
}

#[test]
fn smoothed_forces_are_the_dense_conditional_mean() {
    let (mut motion, residuals) = motion(15, 40, 3, 2, 2);
    // The second channel shows the forces directly, as an accelerometer does.
    let second = motion.measured.iter_mut().flatten().filter(|m| m.channel == 1);
    second.for_each(|m| m.slopes.extend([0.4, 0.0, -0.3, 0.0]));
    let error = ForceError { deviation: 1.2, length: 0.3, noise: vec![0.3, 0.2] };
    let (count, forces) = (motion.times.len(), motion.forces);
    // Column by column the response to a unit force kept over one sample.
    let columns: Vec<Vec<f64>> = (0..count * forces)
        .map(|k| {
            let mut unit = vec![0.0; count * forces];
            unit[k] = 1.0;
            motion.response(&unit)
        })
        .collect();
    let response = DMatrix::from_fn(residuals.len(), count * forces, |i, k| columns[k][i]);
    let prior = DMatrix::from_fn(count * forces, count * forces, |a, b| {
        let distance = motion.times[a / forces] - motion.times[b / forces];
        if a % forces == b % forces { matern(1.2, 0.3, distance) } else { 0.0 }
    });
    let mut covariance = &response * &prior * response.transpose();
    for m in motion.measured.iter().flatten() {
        covariance[(m.residual, m.residual)] += error.noise[m.channel] * error.noise[m.channel];
    }
    let cholesky = covariance.clone().cholesky().expect("positive definite");
    let dual = response.transpose() * cholesky.solve(&DVector::from_column_slice(&residuals));
    let smoothed = error.smooth(&motion, &residuals);
    let mean = &prior * &dual;
    for k in 0..count * forces {
        assert!((smoothed[k] - mean[k]).abs() < 1e-9, "{k}: {} {}", smoothed[k], mean[k]);
    }
    let penalty = mean.dot(&dual);
    assert!(relative(error.penalty(&motion, &smoothed), penalty) < 1e-8, "{penalty}");
    let (found, _) = force_likelihood(&error, &motion, &residuals);
    assert!(relative(found, density(covariance, &residuals)) < 1e-11);
}

#[test]
fn innovations_stay_right_where_sensors_are_far_better_than_the_model() {
    // A force 1e5 noises large: the filter against the dense density, whose Cholesky factor is accurate to 1e-16 times
    // the condition number, 1e10.
    let (motion, residuals) = motion(16, 40, 2, 1, 1);
    let error = ForceError { deviation: 1e4, length: 0.3, noise: vec![1e-2] };
    let (count, forces) = (motion.times.len(), motion.forces);
    let mut covariance = DMatrix::zeros(residuals.len(), residuals.len());
    let columns: Vec<DVector<f64>> = (0..count)
        .map(|k| {
            let mut unit = vec![0.0; count];
            unit[k] = 1.0;
            DVector::from_vec(motion.response(&unit))
        })
        .collect();
    for a in 0..count {
        for b in 0..count {
            let weight = matern(1e4, 0.3, motion.times[a] - motion.times[b]);
            covariance += &columns[a] * columns[b].transpose() * weight;
        }
    }
    assert_eq!(forces, 1);
    for k in 0..residuals.len() {
        covariance[(k, k)] += 1e-4;
    }
    let (found, _) = force_likelihood(&error, &motion, &residuals);
    assert!(relative(found, density(covariance, &residuals)) < 1e-5);
}
