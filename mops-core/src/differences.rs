//! Slopes by differences, for problems whose models give no exact ones.

use crate::problem::Evaluation;
use crate::solver::{Halt, Linearisation, Oracle};

/// Largest step in the unit box. Simulations at a relative tolerance of 1e-8 repeat to about 1e-9, and a central
/// difference is best near the cube root of the noise: J. Nocedal, S. Wright, Numerical Optimization (2006), section 8.1.
const STEP: f64 = 2e-4;

/// Smallest step: below it the noise of the simulation takes over.
const SMALLEST_STEP: f64 = 1e-6;

/// The step for slopes that are to describe the problem within `reach`: a tenth of it, between the limits above.
pub fn step(reach: f64) -> f64 {
    (0.1 * reach).clamp(SMALLEST_STEP, STEP)
}

/// Values and slopes at a point by central differences, one-sided at the bounds and where one side fails.
///
/// # Errors
/// The run is over.
pub fn linearise(oracle: &mut dyn Oracle, point: &[f64], reach: f64) -> Result<Option<Linearisation>, Halt> {
    let n = oracle.shape().dimension();
    let spacing = oracle.shape().spacing.clone();
    let step = |j: usize| if spacing[j] > 0.0 { spacing[j] } else { step(reach) };
    let moved = |j: usize, by: f64| {
        let mut moved = point.to_vec();
        moved[j] = (moved[j] + by).clamp(0.0, 1.0);
        moved
    };
    let points: Vec<Vec<f64>> =
        std::iter::once(point.to_vec()).chain((0..n).flat_map(|j| [moved(j, step(j)), moved(j, -step(j))])).collect();
    let mut answers = oracle.evaluate(&points)?;
    let sides = answers.split_off(1);
    let at = answers.pop().expect("the point itself is the first");
    let Some(values) = &at.scaled else { return Ok(None) };
    let mut rows = vec![vec![0.0; n]; values.len()];
    let mut residuals = Vec::with_capacity(n);
    for j in 0..n {
        let usable = |side: &Evaluation| side.scaled.is_some() && side.point[j] != point[j];
        let [up, down] = [&sides[2 * j], &sides[2 * j + 1]].map(|side| if usable(side) { side } else { &at });
        let distance = up.point[j] - down.point[j];
        if distance == 0.0 {
            return Ok(None);
        }
        let (high, low) = (up.scaled.as_ref().expect("usable"), down.scaled.as_ref().expect("usable"));
        for i in 0..values.len() {
            rows[i][j] = (high[i] - low[i]) / distance;
        }
        residuals.push(up.residuals.iter().zip(&down.residuals).map(|(a, b)| (a - b) / distance).collect());
    }
    Ok(Some(Linearisation { at, rows, residuals }))
}
