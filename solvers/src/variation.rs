//! Crossover and mutation of real numbers in the unit box, without allocation.

use mops_math as math;
use mops_math::Stream;
use rand::Rng;

/// Simulated binary crossover and polynomial mutation, the latter within the bounds.
///
/// N.B.: a crossover density bounded at the faces (Deb, Agrawal 1999) never creates children on them. The front of
/// DTLZ6 lies on ten faces; with that density, no point of it was found within 250 generations.
///
/// Source: K. Deb, R. B. Agrawal, Complex Systems 9 (1995) 115-148; K. Deb, M. Goyal, Computer Science and Informatics
/// 26 (1996) 30-45; bounded mutation: K. Deb, S. Agrawal, A niched-penalty approach for constraint handling in genetic
/// algorithms (1999).
#[derive(Debug, Clone, Copy)]
pub struct Variation {
    /// Probability that a pair is crossed.
    pub crossover: f64,
    /// Distribution index of the crossover; large values keep children near their parents.
    pub crossover_index: f64,
    /// Probability that a coordinate is mutated.
    pub mutation: f64,
    /// Distribution index of the mutation; large values give small steps.
    pub mutation_index: f64,
}

impl Variation {
    /// Creates the usual settings for `n` coordinates: 0.9, 15, `1 / n`, 20.
    #[allow(clippy::cast_precision_loss)]
    pub fn usual(n: usize) -> Self {
        Self { crossover: 0.9, crossover_index: 15.0, mutation: 1.0 / n.max(1) as f64, mutation_index: 20.0 }
    }

    /// Crosses two parents, already copied to `a` and `b`, in place.
    pub fn cross(&self, a: &mut [f64], b: &mut [f64], random: &mut Stream) {
        if random.random::<f64>() > self.crossover {
            return;
        }
        let power = self.crossover_index + 1.0;
        for (a, b) in a.iter_mut().zip(b) {
            if random.random::<bool>() || (*a - *b).abs() <= 1e-14 {
                continue;
            }
            let (low, high) = if *a < *b { (*a, *b) } else { (*b, *a) };
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
            let u: f64 = random.random();
            let share = 2.0 * u;
            let spread =
                if share <= 1.0 { math::powf(share, 1.0 / power) } else { math::powf(2.0 - share, -1.0 / power) };
            // Children outside the box are moved to its face, where optima often lie.
            let first = (middle - half * spread).clamp(0.0, 1.0);
            let second = (middle + half * spread).clamp(0.0, 1.0);
            (*a, *b) = if random.random::<bool>() { (first, second) } else { (second, first) };
        }
    }

    /// Mutates a point in place.
    pub fn mutate(&self, x: &mut [f64], random: &mut Stream) {
        let power = self.mutation_index + 1.0;
        for x in x {
            if random.random::<f64>() > self.mutation {
                continue;
            }
            let u: f64 = random.random();
            let step = if u < 0.5 {
                math::powf(2.0 * u + (1.0 - 2.0 * u) * math::powf(1.0 - *x, power), 1.0 / power) - 1.0
            } else {
                1.0 - math::powf(2.0 * (1.0 - u) + (2.0 * u - 1.0) * math::powf(*x, power), 1.0 / power)
            };
            *x = (*x + step).clamp(0.0, 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn children_stay_in_the_box_and_keep_the_mean_of_their_parents_inside_it() {
        let mut random = mops_math::stream(1, "variation");
        let variation = Variation { crossover: 1.0, ..Variation::usual(1) };
        let (mut mean, count) = (0.0, 20_000);
        for _ in 0..count {
            let (mut a, mut b) = ([0.45], [0.55]);
            variation.cross(&mut a, &mut b, &mut random);
            assert!((0.0..=1.0).contains(&a[0]) && (0.0..=1.0).contains(&b[0]));
            mean += 0.5 * (a[0] + b[0]) / f64::from(count);
        }
        assert!((mean - 0.5).abs() < 1e-3, "{mean}");
    }

    #[test]
    fn mutations_stay_in_the_box_also_at_its_faces() {
        let mut random = mops_math::stream(2, "variation");
        let variation = Variation { mutation: 1.0, ..Variation::usual(1) };
        for start in [0.0, 1e-9, 0.5, 1.0] {
            let mut moved = false;
            for _ in 0..1000 {
                let mut x = [start];
                variation.mutate(&mut x, &mut random);
                assert!((0.0..=1.0).contains(&x[0]));
                moved |= x[0] != start;
            }
            assert!(moved);
        }
    }
}
