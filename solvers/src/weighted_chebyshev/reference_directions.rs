//! Search for three and more criteria: evenly spread reference directions from the ideal point.

use mops_core::math;
use mops_core::{Halt, Oracle};

use super::archive::Candidate;
use super::insert;
use super::scalarisation::Scalarisation;
use super::subproblem::Subproblems;
use crate::simplex_lattice::{max_divisions, simplex_lattice};

/// Reference directions still to be solved.
#[derive(Debug)]
pub struct ReferenceDirections {
    pending: Vec<Vec<f64>>,
    /// Solved directions with the points found.
    solved: Vec<(Vec<f64>, Candidate)>,
}

/// Offset of every weight, which turns directions on the boundary of the simplex inwards.
const MIN_WEIGHT: f64 = 0.01;

impl ReferenceDirections {
    pub fn new(criteria: usize, points: usize) -> Self {
        let shift_inwards = |weight: f64| MIN_WEIGHT + weight;
        let reference_directions = simplex_lattice(criteria, max_divisions(criteria, points));
        let shifted =
            reference_directions.into_iter().map(|direction| direction.into_iter().map(shift_inwards).collect());
        Self { pending: shifted.collect(), solved: Vec::new() }
    }

    /// Solves the direction that is nearest to one solved before; returns false if none is left.
    pub fn solve_next(
        &mut self,
        oracle: &mut dyn Oracle,
        subproblems: &mut Subproblems,
        front: &mut Vec<Candidate>,
    ) -> Result<bool, Halt> {
        let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| math::powi(a - b, 2)).sum::<f64>();
        let nearest = |direction: &[f64]| {
            let of = |(other, candidate): &(Vec<f64>, Candidate)| (distance(direction, other), candidate.clone());
            self.solved.iter().map(of).min_by(|a, b| a.0.total_cmp(&b.0))
        };
        // The first direction is the one nearest to the centre.
        let middle = |direction: &[f64]| distance(direction, &vec![1.0 / direction.len() as f64; direction.len()]);
        let key = |direction: &[f64]| nearest(direction).map_or_else(|| middle(direction), |(distance, _)| distance);
        let next = (0..self.pending.len()).min_by(|&a, &b| key(&self.pending[a]).total_cmp(&key(&self.pending[b])));
        let Some(next) = next else { return Ok(false) };
        let neighbour = nearest(&self.pending[next]).map(|(_, candidate)| candidate);
        let direction = self.pending.swap_remove(next);
        let range: Vec<f64> = direction.iter().zip(&subproblems.range).map(|(w, range)| w * range).collect();
        let scalarisation = Scalarisation::chebyshev(&subproblems.ideal, &range);
        let mut starts = subproblems.archive.best(&scalarisation, if neighbour.is_none() { 4 } else { 1 }, 0.1);
        starts.extend(neighbour.filter(|candidate| starts.iter().all(|start| start.distance(candidate) > 0.05)));
        let radius = if self.solved.is_empty() { 0.3 } else { 0.1 };
        let found = subproblems.solve(oracle, &scalarisation, &starts, radius)?;
        let found = subproblems.remove_slack(oracle, &scalarisation, found)?;
        self.solved.push((direction, found.clone()));
        insert(front, found);
        Ok(true)
    }
}
