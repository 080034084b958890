//! Three criteria and more: rays from the ideal point, spread evenly.

use mops_core::math;
use mops_core::{Halt, Oracle};

use super::aim::Aim;
use super::insert;
use super::known::Place;
use super::subproblem::Subproblems;
use crate::directions::{divisions_for, simplex};

/// The rays that are left.
#[derive(Debug)]
pub struct Rays {
    left: Vec<Vec<f64>>,
    /// Those that were followed, with the point found.
    followed: Vec<(Vec<f64>, Place)>,
}

/// The least weight: a ray along a side of the simplex is turned inwards by this much.
const LEAST: f64 = 0.01;

impl Rays {
    pub fn new(criteria: usize, points: usize) -> Self {
        let inwards = |weight: f64| LEAST + weight;
        let rays = simplex(criteria, divisions_for(criteria, points));
        let turned = rays.into_iter().map(|ray| ray.into_iter().map(inwards).collect());
        Self { left: turned.collect(), followed: Vec::new() }
    }

    /// Follows the ray that is nearest to one followed before; `false` where none is left.
    pub fn follow(
        &mut self,
        oracle: &mut dyn Oracle,
        subproblems: &mut Subproblems,
        front: &mut Vec<Place>,
    ) -> Result<bool, Halt> {
        let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| math::powi(a - b, 2)).sum::<f64>();
        let nearest = |ray: &[f64]| {
            let of = |(other, place): &(Vec<f64>, Place)| (distance(ray, other), place.clone());
            self.followed.iter().map(of).min_by(|a, b| a.0.total_cmp(&b.0))
        };
        // The first ray leads into the middle.
        let middle = |ray: &[f64]| distance(ray, &vec![1.0 / ray.len() as f64; ray.len()]);
        let key = |ray: &[f64]| nearest(ray).map_or_else(|| middle(ray), |(distance, _)| distance);
        let next = (0..self.left.len()).min_by(|&a, &b| key(&self.left[a]).total_cmp(&key(&self.left[b])));
        let Some(next) = next else { return Ok(false) };
        let neighbour = nearest(&self.left[next]).map(|(_, place)| place);
        let ray = self.left.swap_remove(next);
        let range: Vec<f64> = ray.iter().zip(&subproblems.range).map(|(w, range)| w * range).collect();
        let aim = Aim::chebyshev(&subproblems.ideal, &range);
        let mut starts = subproblems.known.best_for(&aim, if neighbour.is_none() { 4 } else { 1 }, 0.1);
        starts.extend(neighbour.filter(|place| starts.iter().all(|start| start.apart(place) > 0.05)));
        let radius = if self.followed.is_empty() { 0.3 } else { 0.1 };
        let found = subproblems.solve(oracle, &aim, &starts, radius)?;
        let found = subproblems.without_slack(oracle, &aim, found)?;
        self.followed.push((ray, found.clone()));
        insert(front, found);
        Ok(true)
    }
}
