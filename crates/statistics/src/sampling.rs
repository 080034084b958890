//! Points of the unit cube: random, Latin hypercube, or scrambled Sobol sequence.

use mops_math::Stream;
use rand::Rng;
use rand::seq::SliceRandom;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::sobol_sequence::{MOST_DIMENSIONS, sobol_sequence};

/// Sampling method.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Sampling {
    /// Independent random samples; confidence intervals have their stated level.
    #[default]
    Random,
    /// Latin hypercube: one value of every parameter in each of as many equally probable ranges as there are samples.
    /// Means are more accurate than the stated confidence intervals.
    LatinHypercube,
    /// Sobol sequence with a random digital shift. Means are more accurate than the stated confidence intervals. Up to
    /// 21 parameters; with more, samples are random.
    Sobol,
}

/// Returns `count` points of the open unit cube.
pub fn draw(method: Sampling, count: usize, dimensions: usize, random: &mut Stream) -> Vec<Vec<f64>> {
    match method {
        Sampling::Sobol if dimensions <= MOST_DIMENSIONS => shifted(count, dimensions, random),
        Sampling::LatinHypercube => latin_hypercube(count, dimensions, random),
        Sampling::Random | Sampling::Sobol => {
            (0..count).map(|_| (0..dimensions).map(|_| inner(random.random())).collect()).collect()
        }
    }
}

/// Returns `u` clamped away from 0 and 1, where quantiles may be infinite.
fn inner(u: f64) -> f64 {
    u.clamp(f64::EPSILON, 1.0 - f64::EPSILON)
}

/// Returns a Sobol sequence in which the digits of every coordinate are changed by the same random ones.
///
/// Each point then is uniformly distributed, and together the points still fill the cube evenly. Source: C. Lemieux,
/// Monte Carlo and Quasi-Monte Carlo Sampling (2009), section 6.2.
fn shifted(count: usize, dimensions: usize, random: &mut Stream) -> Vec<Vec<f64>> {
    let shifts: Vec<u32> = (0..dimensions).map(|_| random.random()).collect();
    // Centre of the cell at a resolution of 32 digits.
    let fraction = |x: u32| (f64::from(x) + 0.5) / 4_294_967_296.0;
    let points = sobol_sequence(count, dimensions).into_iter();
    points.map(|point| point.iter().zip(&shifts).map(|(x, shift)| fraction(x ^ shift)).collect()).collect()
}

/// Returns a Latin hypercube. Source: M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21 (1979) 239-245.
#[allow(clippy::cast_precision_loss)]
fn latin_hypercube(count: usize, dimensions: usize, random: &mut Stream) -> Vec<Vec<f64>> {
    let mut points = vec![vec![0.0; dimensions]; count];
    for j in 0..dimensions {
        let mut cells: Vec<usize> = (0..count).collect();
        cells.shuffle(random);
        for (point, cell) in points.iter_mut().zip(cells) {
            point[j] = inner((cell as f64 + random.random::<f64>()) / count as f64);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use mops_math::stream;

    const ALL: [Sampling; 3] = [Sampling::Random, Sampling::LatinHypercube, Sampling::Sobol];

    #[test]
    fn points_lie_inside_the_cube_and_depend_on_the_seed_alone() {
        for method in ALL {
            let points = |seed| draw(method, 100, 5, &mut stream(seed, "test"));
            assert!(points(1).iter().flatten().all(|u| (0.0..1.0).contains(u) && *u > 0.0), "{method:?}");
            assert!(points(1) == points(1) && points(1) != points(2), "{method:?}");
        }
    }

    /// Checks the mean of `u1 u2`, which is 1/4. Independent samples have a standard error of 0.0069, the others a
    /// smaller one.
    #[test]
    fn means_are_those_of_the_uniform_distribution() {
        for (method, error) in ALL.into_iter().zip([0.021, 0.01, 0.001]) {
            let points = draw(method, 1024, 2, &mut stream(3, "test"));
            let mean = points.iter().map(|p| p[0] * p[1]).sum::<f64>() / 1024.0;
            assert!((mean - 0.25).abs() < error, "{method:?}: {mean}");
        }
    }

    #[test]
    fn a_latin_hypercube_has_one_point_in_every_row() {
        let points = draw(Sampling::LatinHypercube, 50, 3, &mut stream(1, "test"));
        for j in 0..3 {
            let mut cells: Vec<usize> = points.iter().map(|p| (p[j] * 50.0) as usize).collect();
            cells.sort_unstable();
            assert_eq!(cells, (0..50).collect::<Vec<_>>());
        }
    }
}
