//! Finite differences, for problems whose models have no exact derivatives.

use mops_math as math;

use crate::cancellation::Halt;
use crate::evaluation::Evaluation;
use crate::solver::{Linearisation, Oracle};

/// Finite differences of values with the relative accuracy `noise`.
///
/// A one-sided difference is best with a step near the square root of the noise and retains half of the digits. A
/// central difference is best near the cube root and retains two thirds, at twice the cost. One-sided differences are
/// used if half of the digits are sufficient. This holds for values exact to 1e-14 and a `reach` of at least a hundred
/// times the step.
///
/// Source: J. Nocedal, S. Wright, Numerical Optimization (2006), section 8.1.
#[derive(Debug, Clone, Copy)]
pub struct Differences {
    noise: f64,
}

impl Differences {
    /// Creates finite differences for values with this relative error.
    pub fn of_noise(noise: f64) -> Self {
        Self { noise }
    }

    /// Returns the step of a central difference for derivatives that describe the problem within `reach`. The step is a
    /// tenth of `reach`, at most a fifth of the cube root of the noise. A lower bound limits the influence of the
    /// noise.
    pub fn step(self, reach: f64) -> f64 {
        (0.1 * reach).clamp(self.noise.sqrt() / 30.0, 0.2 * math::cbrt(self.noise))
    }

    fn one_sided(self, reach: f64) -> bool {
        self.noise <= 1e-14 && reach >= 1e-6
    }

    /// Returns values and derivatives at a point. Central differences become one-sided at the bounds and if one side
    /// fails.
    ///
    /// # Errors
    /// Returns [`Halt`] if the run is over.
    pub fn linearise(self, oracle: &mut dyn Oracle, point: &[f64], reach: f64) -> Result<Option<Linearisation>, Halt> {
        if self.one_sided(reach) && oracle.shape().spacing.iter().all(|&spacing| spacing == 0.0) {
            let step = self.noise.sqrt();
            // Towards the centre of the box, to stay within the bounds.
            let moved = (0..point.len()).map(|j| vec![along(point, j, if point[j] < 0.5 { step } else { -step })]);
            if let Some(found) = slopes(oracle, point, &moved.collect::<Vec<_>>())? {
                return Ok(Some(found));
            }
        }
        let spacing = oracle.shape().spacing.clone();
        let step = |j: usize| if spacing[j] > 0.0 { spacing[j] } else { self.step(reach) };
        let moved = (0..point.len()).map(|j| vec![along(point, j, step(j)), along(point, j, -step(j))]);
        slopes(oracle, point, &moved.collect::<Vec<_>>())
    }
}

fn along(point: &[f64], j: usize, by: f64) -> Vec<f64> {
    let mut moved = point.to_vec();
    moved[j] = (moved[j] + by).clamp(0.0, 1.0);
    moved
}

/// Returns derivatives from the point and up to two neighbours along every coordinate. The point itself replaces a
/// neighbour that is missing, fails or coincides with it. `None` if a coordinate has no usable neighbour.
fn slopes(oracle: &mut dyn Oracle, point: &[f64], neighbours: &[Vec<Vec<f64>>]) -> Result<Option<Linearisation>, Halt> {
    let points: Vec<Vec<f64>> = std::iter::once(point.to_vec()).chain(neighbours.iter().flatten().cloned()).collect();
    let mut answers = oracle.evaluate(&points)?;
    let mut sides = answers.split_off(1).into_iter();
    let at = answers.pop().expect("the point itself is the first");
    let Some(values) = &at.scaled else { return Ok(None) };
    let mut rows = vec![vec![0.0; point.len()]; values.len()];
    let mut residuals = Vec::with_capacity(point.len());
    for (j, of_coordinate) in neighbours.iter().enumerate() {
        let mut usable: Vec<Evaluation> = sides.by_ref().take(of_coordinate.len()).collect();
        usable.retain(|side| side.scaled.is_some() && side.point[j] != point[j]);
        let Some(up) = usable.first() else { return Ok(None) };
        let down = usable.get(1).unwrap_or(&at);
        let distance = up.point[j] - down.point[j];
        let (high, low) = (up.scaled.as_ref().expect("usable"), down.scaled.as_ref().expect("usable"));
        for i in 0..values.len() {
            rows[i][j] = (high[i] - low[i]) / distance;
        }
        residuals.push(up.residuals.iter().zip(&down.residuals).map(|(a, b)| (a - b) / distance).collect());
    }
    Ok(Some(Linearisation { at, rows, residuals }))
}
