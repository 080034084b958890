//! Pattern of poll points around the best point.

use mops_math::Stream;
use nalgebra::{DMatrix, DVector};
use rand::Rng;

use super::point_buffer::PointBuffer;

/// Directions of the pattern, one per column, randomly oriented.
#[derive(Debug, Clone)]
pub struct Pattern {
    basis: DMatrix<f64>,
}

impl Pattern {
    /// Creates a pattern along the coordinate axes.
    pub fn coordinate_axes(n: usize) -> Self {
        Self { basis: DMatrix::identity(n, n) }
    }

    /// Reorients the pattern by a random reflection `I - 2 v v'`.
    pub fn reorient_randomly(&mut self, random: &mut Stream) {
        let n = self.basis.nrows();
        let v = DVector::from_fn(n, |_, _| random.random_range(-1.0..1.0));
        if v.norm_squared() > 1e-6 {
            self.reflect(&v);
        }
    }

    /// Reorients the pattern so that its first direction is the given one.
    pub fn align(&mut self, direction: &DVector<f64>) {
        let mut v = direction / direction.norm();
        v[0] += v[0].signum();
        self.reflect(&v);
    }

    /// Sets the basis to `I - 2 v v' / v'v`.
    fn reflect(&mut self, v: &DVector<f64>) {
        self.basis.fill_with_identity();
        self.basis.ger(-2.0 / v.norm_squared(), v, v, 1.0);
    }

    /// Collects the points at distance `radius` from `centre` on both sides along every direction, inside the box. On a
    /// grid, the distance is at least one value.
    pub fn points(&self, centre: &[f64], radius: f64, spacing: &[f64], points: &mut PointBuffer) {
        let n = centre.len();
        points.clear();
        for j in 0..n {
            for side in [1.0, -1.0] {
                let at = |i: usize| {
                    let offset = if spacing[i] == 0.0 {
                        side * radius * self.basis[(i, j)]
                    } else if i == j {
                        // On a grid, the direction is the coordinate itself, with a whole number of steps.
                        side * (radius / spacing[i]).round().max(1.0) * spacing[i]
                    } else {
                        0.0
                    };
                    (centre[i] + offset).clamp(0.0, 1.0)
                };
                points.push_if((0..n).map(at), |point, _| point != centre);
            }
        }
    }
}
