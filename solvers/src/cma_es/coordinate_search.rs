//! A search along every axis by itself: where tuners act apart from each other, it finds the best of many basins at once.

use mops_core::{Halt, Merit, Oracle};

use crate::ranking::compare;

/// Places along an axis that are looked at, both ends among them.
const GRID_POINTS: u16 = 201;

/// Minima among them that are looked at closely, and how often.
const MINIMA: usize = 8;
const REFINEMENTS: usize = 8;

/// Share of the wider side of a bracket at which its next place is where a parabola tells none. Source: R. P. Brent, Algorithms
/// for Minimization Without Derivatives (1973), section 5.4: the golden section.
const GOLDEN: f64 = 0.381_966_011_250_105;

/// First standard deviation of a run that begins where the search ended.
pub const RESTART_SIGMA: f64 = 0.005;

/// The search, an axis at a time, from a point.
///
/// Source of restarts beside it: I. Loshchilov, M. Schoenauer, M. Sebag, Bi-population CMA-ES algorithms with surrogate models
/// and line searches, GECCO companion (2013) 1177-1184.
#[derive(Debug, Clone)]
pub struct CoordinateSearch {
    point: Vec<f64>,
    merit: Merit,
    next: usize,
    improved: bool,
}

/// Three places on an axis, of which the middle one is best.
struct Bracket {
    positions: [f64; 3],
    merits: [Merit; 3],
}

impl CoordinateSearch {
    /// Before the first axis, at a point.
    pub fn new(point: Vec<f64>, merit: Merit) -> Self {
        Self { point, merit, next: 0, improved: false }
    }

    /// Whether every axis was searched.
    pub fn is_finished(&self) -> bool {
        self.next == self.point.len()
    }

    /// The best point and its merit, where these are better than those it began with.
    pub fn improvement(self) -> Option<(Vec<f64>, Merit)> {
        self.improved.then_some((self.point, self.merit))
    }

    /// Searches the next axis, with the other coordinates as they are best.
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

    /// Evaluates places on an axis, and keeps the best point of all.
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

/// Places along an axis whose values are so far apart, 0 where it has any.
fn positions(spacing: f64) -> Vec<f64> {
    let mut values = 2;
    while values < GRID_POINTS && f64::from(values - 1) * spacing < 1.0 {
        values += 1;
    }
    (0..values).map(|i| f64::from(i) / f64::from(values - 1)).collect()
}

/// Brackets around the places that are no worse than both neighbours.
fn brackets(positions: &[f64], merits: &[Merit]) -> Vec<Bracket> {
    let all = positions.windows(3).zip(merits.windows(3));
    let is_least = |merits: &[Merit]| !merits[0].is_better_than(&merits[1]) && merits[1].is_better_than(&merits[2]);
    all.filter(|(_, merits)| is_least(merits))
        .map(|(p, m)| Bracket::new([p[0], p[1], p[2]], [m[0], m[1], m[2]]))
        .collect()
}

impl Bracket {
    fn new(positions: [f64; 3], merits: [Merit; 3]) -> Self {
        Self { positions, merits }
    }

    /// Where to look next: the vertex of a parabola, or where that is no guide, in the wider side.
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

    /// Takes in what a place between the ends is worth.
    fn update(&mut self, position: f64, merit: Merit) {
        let right = usize::from(position > self.positions[1]);
        if merit.is_better_than(&self.merits[1]) {
            // The middle becomes an end.
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
    use mops_core::math;

    #[test]
    fn a_grid_is_looked_at_where_it_has_values() {
        assert_eq!(positions(0.25), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!((positions(0.0).len(), positions(1.0)), (usize::from(GRID_POINTS), vec![0.0, 1.0]));
    }

    #[test]
    fn a_bracket_closes_on_the_least_of_a_curve() {
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
