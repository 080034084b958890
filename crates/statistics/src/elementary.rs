//! Elementary effects of the inputs of a function (Morris screening).

use rand::Rng;
use rand::seq::SliceRandom;

use mops_math as math;
use mops_math::Stream;

/// Number of levels of a coordinate, equally spaced over [0, 1].
const LEVELS: usize = 4;

/// Step size, half of the levels: every level is reached from exactly one other.
const STEP: f64 = 2.0 / 3.0;

/// Elementary effects of one input, summarised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementaryEffect {
    /// Mean of the effects, in which opposite signs cancel.
    pub mean: f64,
    /// Mean of the magnitudes, a measure of importance.
    pub magnitude: f64,
    /// Standard deviation of the effects, a measure of nonlinearity and interaction.
    pub deviation: f64,
}

/// Returns random trajectories through the unit cube. Each starts at a random grid point and moves every coordinate
/// once, in random order, by two thirds.
///
/// Source: M. D. Morris, Technometrics 33 (1991) 161-174, with four levels.
#[allow(clippy::cast_precision_loss)]
pub fn trajectories(count: usize, inputs: usize, random: &mut Stream) -> Vec<Vec<Vec<f64>>> {
    let level = |random: &mut Stream| random.random_range(0..LEVELS) as f64 / (LEVELS - 1) as f64;
    (0..count)
        .map(|_| {
            let mut point: Vec<f64> = (0..inputs).map(|_| level(random)).collect();
            let mut order: Vec<usize> = (0..inputs).collect();
            order.shuffle(random);
            let mut points = vec![point.clone()];
            for i in order {
                point[i] += if point[i] < 0.5 { STEP } else { -STEP };
                points.push(point.clone());
            }
            points
        })
        .collect()
}

/// Returns the effect of every input, per length of its range, from the values along trajectories.
///
/// Source (mean of magnitudes): F. Campolongo, J. Cariboni, A. Saltelli, Environmental Modelling and Software 22 (2007)
/// 1509-1518.
///
/// # Panics
/// If there is no trajectory, or if a trajectory does not have one value per point.
#[allow(clippy::cast_precision_loss)]
pub fn elementary_effects(trajectories: &[Vec<Vec<f64>>], values: &[Vec<f64>]) -> Vec<ElementaryEffect> {
    let inputs = trajectories[0][0].len();
    let mut effects = vec![Vec::new(); inputs];
    for (points, values) in trajectories.iter().zip(values) {
        for (ends, value) in points.windows(2).zip(values.windows(2)) {
            let moved = (0..inputs).find(|&i| ends[0][i] != ends[1][i]).expect("every step moves one coordinate");
            effects[moved].push((value[1] - value[0]) / (ends[1][moved] - ends[0][moved]));
        }
    }
    let summary = |of_input: &Vec<f64>| {
        let mean = |f: &dyn Fn(f64) -> f64| of_input.iter().map(|&e| f(e)).sum::<f64>() / of_input.len() as f64;
        let centre = mean(&|e| e);
        let spare = (of_input.len() as f64 - 1.0).max(1.0) / of_input.len() as f64;
        let deviation = (mean(&|e| math::powi(e - centre, 2)) / spare).sqrt();
        ElementaryEffect { mean: centre, magnitude: mean(&f64::abs), deviation }
    };
    effects.iter().map(summary).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mops_math::stream;

    fn found(inputs: usize, f: impl Fn(&[f64]) -> f64) -> Vec<ElementaryEffect> {
        let trajectories = trajectories(50, inputs, &mut stream(1, "test"));
        let values: Vec<Vec<f64>> = trajectories.iter().map(|points| points.iter().map(|p| f(p)).collect()).collect();
        elementary_effects(&trajectories, &values)
    }

    #[test]
    fn effects_of_a_linear_function_are_its_slopes_without_spread() {
        for (found, slope) in found(4, |u| 3.0 * u[0] - 2.0 * u[1] + 0.5 * u[2]).iter().zip([3.0, -2.0, 0.5, 0.0]) {
            assert!((found.mean - slope).abs() < 1e-12 && (found.magnitude - slope.abs()).abs() < 1e-12, "{found:?}");
            assert!(found.deviation < 1e-12);
        }
    }

    #[test]
    fn what_goes_both_ways_and_what_acts_together_shows_in_the_spread() {
        // (2 u - 1)^2: effects of +-4/3 along steps from 0 and from 1/3.
        let of_square = found(2, |u| math::powi(2.0 * u[0] - 1.0, 2))[0];
        assert!((of_square.magnitude - 4.0 / 3.0).abs() < 1e-12 && of_square.mean.abs() < 0.5, "{of_square:?}");
        // u1 u2: the effect of u1 is u2, whose levels have the variance 5/36.
        let of_product = found(2, |u| u[0] * u[1])[0];
        assert!((of_product.deviation - (5.0_f64 / 36.0).sqrt()).abs() < 0.08, "{of_product:?}");
    }

    #[test]
    fn a_trajectory_moves_every_coordinate_once_and_stays_inside() {
        for points in trajectories(20, 3, &mut stream(2, "test")) {
            assert_eq!(points.len(), 4);
            assert!(points.iter().flatten().all(|u| (-1e-12..=1.0 + 1e-12).contains(u)));
        }
    }
}
