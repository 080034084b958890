//! Two criteria: the rectangle between two neighbours, from the largest down.

use mops_core::math;
use mops_core::{FEASIBLE, Halt, Oracle};

use super::aim::Aim;
use super::insert;
use super::known::Place;
use super::subproblem::Subproblems;

/// Which rectangles hold nothing.
#[derive(Debug, Default)]
pub struct Gaps {
    /// Their corners, as criteria, with the number of searches that brought next to nothing.
    poor: Vec<(Vec<f64>, Vec<f64>, usize)>,
    /// Subproblems solved.
    solved: usize,
}

/// A gap that keeps this much of its length was hardly divided; so many times in a row, and it is one of the front itself.
const DIVIDED: f64 = 0.85;
const POOR: usize = 2;

/// Depth of a point in the rectangle, from 0 to 1, below which it is one of the corners.
const DEPTH: f64 = 1e-3;

/// Depth that a point between two neighbours of one smooth piece has at least, about.
const USUAL: f64 = 0.4;

impl Gaps {
    /// Looks for a point in the largest rectangle; `false` where all are small or empty.
    pub fn bisect(
        &mut self,
        oracle: &mut dyn Oracle,
        subproblems: &mut Subproblems,
        front: &mut Vec<Place>,
        points: usize,
    ) -> Result<bool, Halt> {
        let all = std::mem::take(front);
        for place in all {
            insert(front, place);
        }
        front.sort_by(|a, b| a.criteria[0].total_cmp(&b.criteria[0]));
        if front.len() >= points || self.solved >= 3 * points {
            return Ok(false);
        }
        let range = subproblems.range.clone();
        let length = |p: &Place, q: &Place| {
            (0..2).map(|k| math::powi((p.criteria[k] - q.criteria[k]) / range[k], 2)).sum::<f64>().sqrt()
        };
        let open =
            |i: &usize| self.poor(&front[*i], &front[*i + 1]) < POOR && is_wide(&front[*i], &front[*i + 1], &range);
        let longest = (0..front.len().saturating_sub(1))
            .filter(open)
            .max_by(|&a, &b| length(&front[a], &front[a + 1]).total_cmp(&length(&front[b], &front[b + 1])));
        let Some(i) = longest else { return Ok(false) };
        let (p, q) = (front[i].clone(), front[i + 1].clone());
        let poor = self.poor(&p, &q);
        self.solved += 1;
        let found = within(oracle, subproblems, &p, &q, front.len())?;
        let Some(found) = found else {
            self.poor.push((p.criteria, q.criteria, POOR));
            return Ok(true);
        };
        for (a, b) in [(&p, &found), (&found, &q)] {
            let strikes = if length(a, b) > DIVIDED * length(&p, &q) { poor + 1 } else { 0 };
            self.poor.push((a.criteria.clone(), b.criteria.clone(), strikes));
        }
        if !insert(front, found) {
            self.poor.push((p.criteria, q.criteria, POOR));
        }
        Ok(true)
    }

    fn poor(&self, p: &Place, q: &Place) -> usize {
        let same = |(a, b, _): &&(Vec<f64>, Vec<f64>, usize)| *a == p.criteria && *b == q.criteria;
        self.poor.iter().rev().find(same).map_or(0, |(_, _, poor)| *poor)
    }
}

/// Whether a rectangle has sides to speak of.
fn is_wide(p: &Place, q: &Place, range: &[f64]) -> bool {
    (0..2).all(|k| (p.criteria[k] - q.criteria[k]).abs() > 1e-5 * range[k])
}

/// The deepest point of the rectangle; `None` where nothing is found in it.
fn within(
    oracle: &mut dyn Oracle,
    subproblems: &mut Subproblems,
    p: &Place,
    q: &Place,
    solved: usize,
) -> Result<Option<Place>, Halt> {
    let low = [p.criteria[0], q.criteria[1]];
    let aim = Aim::chebyshev(&low, &[q.criteria[0] - p.criteria[0], p.criteria[1] - q.criteria[1]]);
    let apart = p.apart(q);
    let radius = apart.clamp(1e-3, 0.3);
    let between: Vec<f64> = p.point.iter().zip(&q.point).map(|(a, b)| 0.5 * (a + b)).collect();
    let answers = oracle.evaluate(&[between])?;
    subproblems.known.take(oracle.shape(), &answers);
    // The first rectangles are large, and may hold other basins than those of their corners.
    let count = if solved < 6 { 4 } else { 1 };
    let starts = subproblems.known.best_for(&aim, count, (0.3 * apart).max(1e-3));
    let mut found = subproblems.solve(oracle, &aim, &starts, radius)?;
    if aim.merit(&found.criteria).objective > 1.0 - USUAL {
        found = subproblems.solve(oracle, &aim, &[p.clone(), q.clone()], radius)?;
    }
    // An end of the front may be stationary for both criteria: no slope leads away from it.
    if aim.merit(&found.criteria).objective > 1.0 - DEPTH
        && let Some(start) = on_the_way(oracle, subproblems, &aim, p, q)?
    {
        found = subproblems.solve(oracle, &aim, &[start], radius)?;
    }
    if aim.merit(&found.criteria).objective > 1.0 - DEPTH {
        return Ok(None);
    }
    subproblems.without_slack(oracle, &aim, found).map(Some)
}

/// Halvings of the way between two neighbours.
const HALVINGS: usize = 10;

/// The point on the straight way from `p` to `q` where both criteria stand equally high in the rectangle: criteria that are
/// continuous have one. `None` where a simulation fails, or where a constraint is violated there.
fn on_the_way(
    oracle: &mut dyn Oracle,
    subproblems: &mut Subproblems,
    aim: &Aim,
    p: &Place,
    q: &Place,
) -> Result<Option<Place>, Halt> {
    let [mut low, mut high] = [0.0, 1.0];
    let mut last = None;
    for _ in 0..HALVINGS {
        let at = 0.5 * (low + high);
        let point = p.point.iter().zip(&q.point).map(|(a, b)| a + at * (b - a)).collect();
        let answers = oracle.evaluate(&[point])?;
        subproblems.known.take(oracle.shape(), &answers);
        let Some(scaled) = &answers[0].scaled else { return Ok(None) };
        let criteria = oracle.shape().objectives(scaled);
        let heights = aim.heights(&criteria);
        let feasible = answers[0].merit.violation <= FEASIBLE;
        last = feasible.then(|| Place { point: answers[0].point.clone(), criteria });
        if heights[0] < heights[1] { low = at } else { high = at }
    }
    Ok(last)
}
