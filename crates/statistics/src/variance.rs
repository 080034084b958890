//! Variance-based sensitivity: Sobol indices of the inputs of a function.

use mops_math as math;
use mops_math::Stream;
use rand::Rng;

use super::sampling::{Sampling, draw};
use super::summary::quantile;

/// Sobol indices of one input: its shares of the variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VarianceShares {
    /// First-order index: share of the input alone.
    pub first: f64,
    /// Total index: share of the input alone and in interaction with others.
    pub total: f64,
    /// Bootstrap interval of `first`.
    pub first_interval: [f64; 2],
    /// Bootstrap interval of `total`.
    pub total_interval: [f64; 2],
}

/// Returns the points of the unit cube at which a function is evaluated.
///
/// Each of `count` samples has a point of `A` and a point of `B`. For every input it also has the point of `A` with
/// this input from `B`.
pub fn radial(count: usize, inputs: usize, random: &mut Stream) -> Vec<Vec<Vec<f64>>> {
    let of_sample = |both: Vec<f64>| {
        let (a, b) = both.split_at(inputs);
        let mixed = (0..inputs).map(|i| {
            let mut point = a.to_vec();
            point[i] = b[i];
            point
        });
        [a.to_vec(), b.to_vec()].into_iter().chain(mixed).collect()
    };
    draw(Sampling::Sobol, count, 2 * inputs, random).into_iter().map(of_sample).collect()
}

/// Returns the Sobol indices from the values at the points of [`radial`]: per sample the values at `A`, at `B`, and one
/// per input. Returns `None` if the values do not vary.
///
/// ```text
/// first_i = mean(f(B) (f(A_B^i) - f(A))) / V        total_i = mean((f(A) - f(A_B^i))^2) / (2 V)
/// ```
///
/// with V the variance of all f(A) and f(B), and values relative to their mean. The intervals are percentiles over
/// `replicates` bootstrap resamples of the samples.
///
/// Source: A. Saltelli, P. Annoni, I. Azzini, F. Campolongo, M. Ratto, S. Tarantola, Computer Physics Communications
/// 181 (2010) 259-270, table 2 (b) and (f); the latter by M. J. W. Jansen, Computer Physics Communications 117 (1999)
/// 35-43.
///
/// # Panics
/// If the samples have different lengths, or fewer than three values.
pub fn variance_shares(
    values: &[Vec<f64>],
    level: f64,
    replicates: usize,
    random: &mut Stream,
) -> Option<Vec<VarianceShares>> {
    let inputs = values.first()?.len().checked_sub(2).filter(|&n| n > 0).expect("a sample has A, B and the inputs");
    let all: Vec<usize> = (0..values.len()).collect();
    let found = shares(values, &all)?;
    let tail = 0.5 * (1.0 - level);
    let mut drawn = vec![Vec::with_capacity(replicates); 2 * inputs];
    for _ in 0..replicates {
        let again: Vec<usize> = all.iter().map(|_| random.random_range(0..values.len())).collect();
        for (list, share) in drawn.iter_mut().zip(shares(values, &again).into_iter().flatten().flatten()) {
            list.push(share);
        }
    }
    let interval = |list: &mut Vec<f64>| {
        list.sort_by(f64::total_cmp);
        if list.is_empty() { [f64::NAN; 2] } else { [quantile(list, tail), quantile(list, 1.0 - tail)] }
    };
    let of_input = |(i, [first, total]): (usize, [f64; 2])| VarianceShares {
        first,
        total,
        first_interval: interval(&mut drawn[2 * i]),
        total_interval: interval(&mut drawn[2 * i + 1]),
    };
    Some(found.into_iter().enumerate().map(of_input).collect())
}

/// Returns the first and total index of every input over the given samples.
#[allow(clippy::cast_precision_loss)]
fn shares(values: &[Vec<f64>], samples: &[usize]) -> Option<Vec<[f64; 2]>> {
    let n = samples.len() as f64;
    let of_both = || samples.iter().flat_map(|&s| [values[s][0], values[s][1]]);
    let mean = of_both().sum::<f64>() / (2.0 * n);
    let variance = of_both().map(|f| math::powi(f - mean, 2)).sum::<f64>() / (2.0 * n);
    if !(variance > 1e-24 * mean * mean && variance > 0.0) {
        return None;
    }
    let of_input = |i: usize| {
        let terms = samples.iter().map(|&s| {
            let (a, b, mixed) = (values[s][0], values[s][1], values[s][2 + i]);
            [(b - mean) * (mixed - a), 0.5 * math::powi(a - mixed, 2)]
        });
        terms.fold([0.0; 2], |sum, term| [sum[0] + term[0], sum[1] + term[1]]).map(|sum| sum / (n * variance))
    };
    Some((0..values[samples[0]].len() - 2).map(of_input).collect())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use mops_math::stream;

    fn found(count: usize, inputs: usize, f: impl Fn(&[f64]) -> f64) -> Vec<VarianceShares> {
        let points = radial(count, inputs, &mut stream(1, "points"));
        let values: Vec<Vec<f64>> = points.iter().map(|sample| sample.iter().map(|p| f(p)).collect()).collect();
        variance_shares(&values, 0.95, 200, &mut stream(1, "bootstrap")).unwrap()
    }

    /// Checks `sin x1 + 7 sin^2 x2 + 0.1 x3^4 sin x1`, x in (-pi, pi), whose variances are known in closed form.
    ///
    /// Source: T. Ishigami, T. Homma, Proceedings of the First International Symposium on Uncertainty Modeling (1990).
    #[test]
    fn the_shares_of_the_ishigami_function_are_those_of_closed_forms() {
        let (a, b) = (7.0, 0.1);
        let f = |u: &[f64]| {
            let x: Vec<f64> = u.iter().map(|u| PI * (2.0 * u - 1.0)).collect();
            math::sin(x[0]) + a * math::powi(math::sin(x[1]), 2) + b * math::powi(x[2], 4) * math::sin(x[0])
        };
        let v1 = 0.5 * math::powi(1.0 + b * math::powi(PI, 4) / 5.0, 2);
        let v2 = a * a / 8.0;
        let v13 = b * b * math::powi(PI, 8) * (1.0 / 18.0 - 1.0 / 50.0);
        let v = v1 + v2 + v13;
        let exact = [[v1, v1 + v13], [v2, v2], [0.0, v13]].map(|pair| pair.map(|part| part / v));
        for (found, [first, total]) in found(4096, 3, f).iter().zip(exact) {
            assert!(
                (found.first - first).abs() < 0.01 && (found.total - total).abs() < 0.01,
                "{found:?} {first} {total}"
            );
            assert!(found.first_interval[0] < first + 1e-3 && first - 1e-3 < found.first_interval[1], "{found:?}");
        }
    }

    /// Checks the g-function, a product of `(|4 u - 2| + a) / (1 + a)` with partial variances `(1/3)/(1 + a)^2`.
    ///
    /// Source: A. Saltelli, I. M. Sobol, Reliability Engineering and System Safety 50 (1995) 225-239.
    #[test]
    fn the_shares_of_the_g_function_are_those_of_closed_forms() {
        let a = [0.0, 1.0, 4.5, 9.0];
        let f = |u: &[f64]| u.iter().zip(a).map(|(u, a)| ((4.0 * u - 2.0).abs() + a) / (1.0 + a)).product();
        let part = a.map(|a| 1.0 / 3.0 / (1.0 + a) / (1.0 + a));
        let all: f64 = part.iter().map(|v| 1.0 + v).product::<f64>() - 1.0;
        for (found, v) in found(4096, 4, f).iter().zip(part) {
            let (first, total) = (v / all, v * (all + 1.0) / (1.0 + v) / all);
            assert!(
                (found.first - first).abs() < 0.01 && (found.total - total).abs() < 0.01,
                "{found:?} {first} {total}"
            );
        }
    }

    #[test]
    fn a_constant_has_no_variance_to_share() {
        let values = vec![vec![3.0; 4]; 10];
        assert!(variance_shares(&values, 0.95, 10, &mut stream(1, "test")).is_none());
    }
}
