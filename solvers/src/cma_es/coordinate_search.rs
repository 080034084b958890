//! Line searches along the coordinate axes, which find the best of many basins of a separable problem.

use mops_core::{Halt, Merit, Oracle};

use crate::ranking::compare;

/// Number of grid points on an axis, including both ends.
const GRID_POINTS: u16 = 201;

/// Number of grid minima that are refined, and number of refinement steps.
const MINIMA: usize = 8;
const REFINEMENTS: usize = 8;

/// Position of the next point within the wider side of a bracket if no parabola can be fitted (golden section). Source:
/// R. P. Brent, Algorithms for Minimization Without Derivatives (1973), section 5.4.
const GOLDEN: f64 = 0.381_966_011_250_105;

/// Initial standard deviation of a run that starts at the end of the coordinate search.
pub const RESTART_SIGMA: f64 = 0.005;

/// Search along one axis at a time, from a starting point.
///
/// Source of its combination with restarts: I. Loshchilov, M. Schoenauer, M. Sebag, Bi-population CMA-ES algorithms
/// with surrogate models and line searches, GECCO companion (2013) 1177-1184.
#[derive(Debug, Clone)]
pub struct CoordinateSearch {
    point: Vec<f64>,
    merit: Merit,
    next: usize,
    improved: bool,
}

/// Three positions on an axis; the middle one is the best.
struct Bracket {
    positions: [f64; 3],
    merits: [Merit; 3],
}

impl CoordinateSearch {
    /// Creates the search at a point, before the first axis.
    pub fn new(point: Vec<f64>, merit: Merit) -> Self {
        Self { point, merit, next: 0, improved: false }
    }

    /// Returns true once every axis has been searched.
    pub fn is_finished(&self) -> bool {
        self.next == self.point.len()
    }

    /// Returns the best point and its merit if they improve on the starting point.
    pub fn improvement(self) -> Option<(Vec<f64>, Merit)> {
        self.improved.then_some((self.point, self.merit))
    }

    /// Searches the next axis, with the other coordinates at their best values so far.
    pub fn search(&mut self, oracle: &mut dyn Oracle) -> Result<(), Halt> {
        let axis = self.next;
        self.next += 1;
        let positions = positions(oracle.shape().spacing[axis]);
        let merits = self.evaluate_on_axis(oracle, axis, &positions)?;
        let mut brackets = brackets(&positions, &merits);
        brackets.sort_by(|a, b| compare(&a.merits[1], &b.merits[1]));
        brackets.truncate(MINIMA);
        for _ in 0..REFINEMENTS {
            let positions: Vec<f64> = brackets.iter().map(Bracket::next).collect();
            let merits = self.evaluate_on_axis(oracle, axis, &positions)?;
            brackets
                .iter_mut()
                .zip(positions.iter().zip(merits))
                .for_each(|(b, (&position, merit))| b.update(position, merit));
        }
        Ok(())
    }

    /// Evaluates positions on an axis and records the best point.
    fn evaluate_on_axis(
        &mut self,
        oracle: &mut dyn Oracle,
        axis: usize,
        positions: &[f64],
    ) -> Result<Vec<Merit>, Halt> {
        let at = |&position: &f64| {
            let mut point = self.point.clone();
            point[axis] = position;
            point
        };
        let points: Vec<Vec<f64>> = positions.iter().map(at).collect();
        let answers = oracle.evaluate(&points)?;
        for (point, answer) in points.into_iter().zip(&answers) {
            if answer.merit.is_better_than(&self.merit) {
                (self.point, self.merit, self.improved) = (point, answer.merit, true);
            }
        }
        Ok(answers.into_iter().map(|answer| answer.merit).collect())
    }
}

/// Returns grid positions on an axis; `spacing` is the distance between the values of the tuner, 0 if it is continuous.
fn positions(spacing: f64) -> Vec<f64> {
    let mut values = 2;
    while values < GRID_POINTS && f64::from(values - 1) * spacing < 1.0 {
        values += 1;
    }
    (0..values).map(|i| f64::from(i) / f64::from(values - 1)).collect()
}

/// Returns brackets around the positions that are no worse than both neighbours.
fn brackets(positions: &[f64], merits: &[Merit]) -> Vec<Bracket> {
    let all = positions.windows(3).zip(merits.windows(3));
    let is_minimum = |merits: &[Merit]| !merits[0].is_better_than(&merits[1]) && merits[1].is_better_than(&merits[2]);
    all.filter(|(_, merits)| is_minimum(merits))
        .map(|(p, m)| Bracket::new([p[0], p[1], p[2]], [m[0], m[1], m[2]]))
        .collect()
}

impl Bracket {
    fn new(positions: [f64; 3], merits: [Merit; 3]) -> Self {
        Self { positions, merits }
    }

    /// Returns the next position: the vertex of a parabola, or a golden-section point of the wider side if the vertex
    /// is unusable.
    fn next(&self) -> f64 {
        let [a, b, c] = self.positions;
        let wider = if c - b > b - a { b + GOLDEN * (c - b) } else { b - GOLDEN * (b - a) };
        if !self.merits.iter().all(Merit::is_feasible) {
            return wider;
        }
        let [fa, fb, fc] = self.merits.map(|merit| merit.objective);
        let (left, right) = ((b - a) * (fb - fc), (b - c) * (fb - fa));
        let vertex = b - 0.5 * ((b - a) * left - (b - c) * right) / (left - right);
        let margin = 1e-3 * (c - a);
        if vertex > a + margin && vertex < c - margin && (vertex - b).abs() > margin { vertex } else { wider }
    }

    /// Updates the bracket with the merit of a position inside it.
    fn update(&mut self, position: f64, merit: Merit) {
        let right = usize::from(position > self.positions[1]);
        if merit.is_better_than(&self.merits[1]) {
            // The middle position becomes an end.
            let end = if right == 1 { 0 } else { 2 };
            (self.positions[end], self.merits[end]) = (self.positions[1], self.merits[1]);
            (self.positions[1], self.merits[1]) = (position, merit);
        } else {
            (self.positions[2 * right], self.merits[2 * right]) = (position, merit);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mops_math as math;

    #[test]
    fn a_grid_is_searched_at_its_values() {
        assert_eq!(positions(0.25), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!((positions(0.0).len(), positions(1.0)), (usize::from(GRID_POINTS), vec![0.0, 1.0]));
    }

    #[test]
    fn a_bracket_converges_to_the_minimum_of_a_curve() {
        let curve = |u: f64| math::powi(u - 0.3, 2) + 0.2 * math::powi(u - 0.3, 3) + math::powi(u - 0.3, 4);
        let merit = |u: f64| Merit { violation: 0.0, objective: curve(u) };
        let positions = [0.1, 0.25, 0.6];
        let mut bracket = Bracket::new(positions, positions.map(merit));
        for _ in 0..REFINEMENTS {
            let next = bracket.next();
            assert!(bracket.positions[0] < next && next < bracket.positions[2]);
            bracket.update(next, merit(next));
            let [a, b, c] = bracket.merits;
            assert!(!a.is_better_than(&b) && !c.is_better_than(&b));
        }
        assert!((bracket.positions[1] - 0.3).abs() < 1e-3, "{:?}", bracket.positions);
    }
}
