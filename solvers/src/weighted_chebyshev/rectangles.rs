//! Search for two objectives: rectangles between neighbouring points of the front, the largest first.

use mops_core::{Halt, Oracle, evaluation::FEASIBLE};
use mops_math as math;

use super::archive::Candidate;
use super::archive::insert;
use super::scalarisation::Scalarisation;
use super::subproblem::Subproblems;

/// Rectangles that contain no point of the front.
#[derive(Debug, Default)]
pub struct Rectangles {
    /// Corners of rectangles, as criteria, with the number of successive unsuccessful searches.
    failures: Vec<(Vec<f64>, Vec<f64>, usize)>,
    /// Number of solved subproblems.
    solved: usize,
}

/// Relative length above which a part of a divided rectangle counts as undivided. After [`MAX_FAILURES`] such divisions
/// in succession, the rectangle is a gap of the front.
const MIN_DIVISION: f64 = 0.85;
const MAX_FAILURES: usize = 2;

/// Depth in the rectangle, from 0 to 1, below which a point coincides with a corner.
const MIN_DEPTH: f64 = 1e-3;

/// Approximate minimum depth of a point between two neighbours on the same smooth part of the front.
const EXPECTED_DEPTH: f64 = 0.4;

impl Rectangles {
    /// Searches the largest rectangle for a point; returns false if all rectangles are small or empty.
    pub fn bisect(
        &mut self,
        oracle: &mut dyn Oracle,
        subproblems: &mut Subproblems,
        front: &mut Vec<Candidate>,
        points: usize,
    ) -> Result<bool, Halt> {
        let all = std::mem::take(front);
        for candidate in all {
            insert(front, candidate, &[]);
        }
        front.sort_by(|a, b| a.objectives[0].total_cmp(&b.objectives[0]));
        if front.len() >= points || self.solved >= 3 * points {
            return Ok(false);
        }
        let range = subproblems.range.clone();
        let length = |p: &Candidate, q: &Candidate| {
            (0..2).map(|k| math::powi((p.objectives[k] - q.objectives[k]) / range[k], 2)).sum::<f64>().sqrt()
        };
        let is_open = |i: &usize| {
            self.failures(&front[*i], &front[*i + 1]) < MAX_FAILURES && is_wide(&front[*i], &front[*i + 1], &range)
        };
        let longest = (0..front.len().saturating_sub(1))
            .filter(is_open)
            .max_by(|&a, &b| length(&front[a], &front[a + 1]).total_cmp(&length(&front[b], &front[b + 1])));
        let Some(i) = longest else { return Ok(false) };
        let (p, q) = (front[i].clone(), front[i + 1].clone());
        let failures = self.failures(&p, &q);
        self.solved += 1;
        let found = search_rectangle(oracle, subproblems, &p, &q, front.len())?;
        let Some(found) = found else {
            self.failures.push((p.objectives, q.objectives, MAX_FAILURES));
            return Ok(true);
        };
        for (a, b) in [(&p, &found), (&found, &q)] {
            let new_failures = if length(a, b) > MIN_DIVISION * length(&p, &q) { failures + 1 } else { 0 };
            self.failures.push((a.objectives.clone(), b.objectives.clone(), new_failures));
        }
        if !insert(front, found, &range) {
            self.failures.push((p.objectives, q.objectives, MAX_FAILURES));
        }
        Ok(true)
    }

    fn failures(&self, p: &Candidate, q: &Candidate) -> usize {
        let same = |(a, b, _): &&(Vec<f64>, Vec<f64>, usize)| *a == p.objectives && *b == q.objectives;
        self.failures.iter().rev().find(same).map_or(0, |(_, _, failures)| *failures)
    }
}

/// Returns true if both sides of a rectangle are longer than the resolution.
fn is_wide(p: &Candidate, q: &Candidate, range: &[f64]) -> bool {
    (0..2).all(|k| (p.objectives[k] - q.objectives[k]).abs() > 1e-5 * range[k])
}

/// Returns the deepest point of the rectangle; `None` if it is empty.
fn search_rectangle(
    oracle: &mut dyn Oracle,
    subproblems: &mut Subproblems,
    p: &Candidate,
    q: &Candidate,
    solved: usize,
) -> Result<Option<Candidate>, Halt> {
    let low = [p.objectives[0], q.objectives[1]];
    let scalarisation =
        Scalarisation::chebyshev(&low, &[q.objectives[0] - p.objectives[0], p.objectives[1] - q.objectives[1]]);
    let distance = p.distance(q);
    let radius = distance.clamp(1e-3, 0.3);
    let between: Vec<f64> = p.point.iter().zip(&q.point).map(|(a, b)| 0.5 * (a + b)).collect();
    let answers = oracle.evaluate(&[between])?;
    subproblems.archive.record(oracle.shape(), &answers);
    // The first rectangles are large and may contain basins other than those of their corners.
    let count = if solved < 6 { 4 } else { 1 };
    let starts = subproblems.archive.best(&scalarisation, count, (0.3 * distance).max(1e-3));
    let mut found = subproblems.solve(oracle, &scalarisation, &starts, radius)?;
    if scalarisation.merit(&found.objectives).objective > 1.0 - EXPECTED_DEPTH {
        found = subproblems.solve(oracle, &scalarisation, &[p.clone(), q.clone()], radius)?;
    }
    // At an end of the front both gradients may vanish: start elsewhere.
    if scalarisation.merit(&found.objectives).objective > 1.0 - MIN_DEPTH
        && let Some(start) = balanced_point(oracle, subproblems, &scalarisation, p, q)?
    {
        found = subproblems.solve(oracle, &scalarisation, &[start], radius)?;
    }
    if scalarisation.merit(&found.objectives).objective > 1.0 - MIN_DEPTH {
        return Ok(None);
    }
    subproblems.remove_slack(oracle, &scalarisation, found).map(Some)
}

/// Number of bisections between two neighbours.
const BISECTIONS: usize = 10;

/// Returns the point on the segment from `p` to `q` at which both scalarised criteria are equal; it exists for
/// continuous criteria. `None` if a simulation fails or a constraint is violated there.
fn balanced_point(
    oracle: &mut dyn Oracle,
    subproblems: &mut Subproblems,
    scalarisation: &Scalarisation,
    p: &Candidate,
    q: &Candidate,
) -> Result<Option<Candidate>, Halt> {
    let [mut low, mut high] = [0.0, 1.0];
    let mut last = None;
    for _ in 0..BISECTIONS {
        let at = 0.5 * (low + high);
        let point = p.point.iter().zip(&q.point).map(|(a, b)| a + at * (b - a)).collect();
        let answers = oracle.evaluate(&[point])?;
        subproblems.archive.record(oracle.shape(), &answers);
        let Some(scaled) = &answers[0].scaled else { return Ok(None) };
        let objectives = oracle.shape().objectives(scaled);
        let scalarised_values = scalarisation.scalarised_values(&objectives);
        let feasible = answers[0].merit.violation <= FEASIBLE;
        last = feasible.then(|| Candidate { point: answers[0].point.clone(), objectives });
        if scalarised_values[0] < scalarised_values[1] { low = at } else { high = at }
    }
    Ok(last)
}
