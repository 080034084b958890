//! Search for three and more objectives: evenly spread reference directions from the ideal point, then those in the
//! gaps of the front.

use mops_core::{Halt, Oracle, front::SAME};
use mops_math as math;

use super::archive::Candidate;
use super::archive::insert;
use super::scalarisation::Scalarisation;
use super::subproblem::MIN_WEIGHT;
use super::subproblem::Subproblems;
use crate::simplex_lattice::{max_divisions, simplex_lattice};

/// Reference directions still to be solved.
#[derive(Debug)]
pub struct ReferenceDirections {
    pending: Vec<Vec<f64>>,
    /// Solved directions with the points found.
    solved: Vec<(Vec<f64>, Candidate)>,
    /// Directions for gaps of the front.
    fine: Vec<Vec<f64>>,
    /// Evaluated points whose directions were solved.
    tried: Vec<Candidate>,
}

/// Number of directions for gaps, per requested point.
const FINE: usize = 8;

/// Separation from the front, in units of the ranges, from which an evaluated point shows a gap.
const GAP: f64 = 10.0 * SAME;

/// Largest number of solved directions, per requested point.
const MAX_SOLVED: usize = 3;

impl ReferenceDirections {
    pub fn new(objectives: usize, points: usize) -> Self {
        let shift_inwards = |weight: f64| MIN_WEIGHT + weight;
        let lattice = |points: usize| -> Vec<Vec<f64>> {
            let directions = simplex_lattice(objectives, max_divisions(objectives, points));
            directions.into_iter().map(|direction| direction.into_iter().map(shift_inwards).collect()).collect()
        };
        Self { pending: lattice(points), solved: Vec::new(), fine: lattice(FINE * points), tried: Vec::new() }
    }

    /// Returns the evaluated point farthest from the front, as far as none of the front dominates it.
    fn off_the_front(&self, subproblems: &Subproblems, front: &[Candidate]) -> Option<Candidate> {
        let range = &subproblems.range;
        let separation = |candidate: &Candidate| {
            let of = front.iter().chain(&self.tried).map(|known| known.separation(candidate, range));
            of.fold(f64::INFINITY, f64::min)
        };
        let is_open = |candidate: &&Candidate| front.iter().all(|known| !known.dominates(candidate, range, 0.0));
        let open = subproblems.archive.candidates().iter().filter(is_open);
        let farthest = open.map(|candidate| (separation(candidate), candidate)).max_by(|a, b| a.0.total_cmp(&b.0));
        farthest.filter(|(separation, _)| *separation > GAP).map(|(_, candidate)| candidate.clone())
    }

    /// Returns the direction in the largest gap: the farthest one from the points of the front and from the solved
    /// directions.
    fn in_gap(&self, subproblems: &Subproblems, front: &[Candidate]) -> Option<Vec<f64>> {
        let image = |candidate: &Candidate| {
            let of = candidate.objectives.iter().zip(&subproblems.ideal).zip(&subproblems.range);
            direction_of(of.map(|((f, ideal), range)| ((f - ideal) / range).max(0.0)).collect())
        };
        let solved = self.solved.iter().map(|(direction, _)| direction_of(direction.clone()));
        let known: Vec<Vec<f64>> = front.iter().map(image).chain(solved).collect();
        let gap = |direction: &Vec<f64>| {
            let direction = direction_of(direction.clone());
            known.iter().map(|other| square(&direction, other)).fold(f64::INFINITY, f64::min)
        };
        let largest = self.fine.iter().map(|direction| (gap(direction), direction)).max_by(|a, b| a.0.total_cmp(&b.0));
        largest.filter(|(gap, _)| *gap > 0.0).map(|(_, direction)| direction.clone())
    }

    /// Solves the direction that is nearest to one solved before, or one in a gap of the front; returns false if no gap
    /// is left, or if the front has enough points.
    pub fn solve_next(
        &mut self,
        oracle: &mut dyn Oracle,
        subproblems: &mut Subproblems,
        front: &mut Vec<Candidate>,
        points: usize,
    ) -> Result<bool, Halt> {
        let nearest = |direction: &[f64]| {
            let of = |(other, candidate): &(Vec<f64>, Candidate)| (square(direction, other), candidate.clone());
            self.solved.iter().map(of).min_by(|a, b| a.0.total_cmp(&b.0))
        };
        // The first direction is the one nearest to the centre.
        let middle = |direction: &[f64]| square(direction, &vec![1.0 / direction.len() as f64; direction.len()]);
        let key = |direction: &[f64]| nearest(direction).map_or_else(|| middle(direction), |(distance, _)| distance);
        let next = (0..self.pending.len()).min_by(|&a, &b| key(&self.pending[a]).total_cmp(&key(&self.pending[b])));
        let mut neighbour = None;
        let direction = match next {
            Some(next) => self.pending[next].clone(),
            None if front.len() >= points || self.solved.len() >= MAX_SOLVED * points => return Ok(false),
            None => match (self.off_the_front(subproblems, front), self.in_gap(subproblems, front)) {
                (Some(candidate), _) => {
                    let of = candidate.objectives.iter().zip(&subproblems.ideal).zip(&subproblems.range);
                    let image = of.map(|((f, ideal), range)| MIN_WEIGHT + ((f - ideal) / range).max(0.0)).collect();
                    self.tried.push(candidate.clone());
                    neighbour = Some(candidate);
                    direction_of(image)
                }
                (None, Some(direction)) => direction,
                (None, None) => return Ok(false),
            },
        };
        let neighbour = neighbour.or_else(|| nearest(&direction).map(|(_, candidate)| candidate));
        if let Some(next) = next {
            self.pending.swap_remove(next);
        }
        let range: Vec<f64> = direction.iter().zip(&subproblems.range).map(|(w, range)| w * range).collect();
        let scalarisation = Scalarisation::chebyshev(&subproblems.ideal, &range);
        let mut starts = subproblems.archive.best(&scalarisation, if neighbour.is_none() { 4 } else { 1 }, 0.1);
        starts.extend(neighbour.filter(|candidate| starts.iter().all(|start| start.distance(candidate) > 0.05)));
        let radius = if self.solved.is_empty() { 0.3 } else { 0.1 };
        let found = subproblems.solve(oracle, &scalarisation, &starts, radius)?;
        let found = subproblems.remove_slack(oracle, &scalarisation, found)?;
        self.solved.push((direction, found.clone()));
        insert(front, found, &subproblems.range);
        Ok(true)
    }
}

/// Returns the squared distance of two directions.
fn square(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| math::powi(a - b, 2)).sum()
}

/// Returns the direction with the sum 1.
fn direction_of(mut weights: Vec<f64>) -> Vec<f64> {
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight /= sum.max(f64::MIN_POSITIVE));
    weights
}
