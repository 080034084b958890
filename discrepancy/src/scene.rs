//! A fitted model along its motion, with the directions in the residuals that its unknowns absorb.

use mops_models::WithEffects;
use rayon::prelude::*;

use crate::fit::{Fit, Point, Residuals, dot};
use crate::trajectory::Trajectory;

/// A fitted model along its motion.
pub struct Scene {
    /// The motion in each piece.
    pub trajectories: Vec<Trajectory>,
    /// Residuals of each piece one after the other.
    pub residuals: Vec<f64>,
    /// Where the residuals of each piece begin.
    pub begins: Vec<usize>,
    /// Orthonormal directions that the unknowns can absorb.
    pub basis: Vec<Direction>,
}

impl Scene {
    /// The scene of a fit; `None` where a simulation fails.
    pub fn new(fit: &Fit<'_>, model: &WithEffects, point: &Point) -> Option<Self> {
        let all = fit.slopes(point)?;
        let pieces: Vec<usize> = (0..fit.pieces.len()).collect();
        let trajectories: Option<Vec<Trajectory>> =
            pieces.par_iter().map(|&piece| Trajectory::new(fit, model, piece, point).ok()).collect();
        let mut begins = vec![0];
        for piece in &all {
            begins.push(begins[begins.len() - 1] + piece.r.len());
        }
        let residuals = all.iter().flat_map(|piece| piece.r.iter().copied()).collect();
        let basis = basis(&all, &begins, fit.globals.len());
        Some(Self { trajectories: trajectories?, residuals, basis, begins })
    }

    /// Returns a trace without what the unknowns absorb.
    pub fn project(&self, trace: &[f64]) -> Vec<f64> {
        let mut left = trace.to_vec();
        self.basis.iter().for_each(|q| q.take_out_of(&mut left, 0));
        left
    }
}

/// A direction of length 1 in the residuals, 0 outside of a part.
pub struct Direction {
    /// Where the part begins.
    pub begin: usize,
    /// The direction there.
    pub values: Vec<f64>,
}

impl Direction {
    /// Takes the direction out of a vector, whose first element is that at `begin`.
    fn take_out_of(&self, vector: &mut [f64], begin: usize) {
        let part = &mut vector[self.begin - begin..][..self.values.len()];
        let along = dot(&self.values, part);
        part.iter_mut().zip(&self.values).for_each(|(v, q)| *v -= along * q);
    }
}

/// An orthonormal basis of the slopes, by the modified Gram-Schmidt method with a second pass; what is left of a column
/// that depends on others is dropped. Locals, of which each moves its own piece alone, come first: so they stay short.
fn basis(all: &[Residuals], begins: &[usize], globals: usize) -> Vec<Direction> {
    let mut basis: Vec<Direction> = Vec::new();
    for (piece, &begin) in all.iter().zip(begins) {
        let first = basis.len();
        for local in &piece.j[globals..] {
            let rest = rest(&basis[first..], begin, local.clone());
            basis.extend(rest);
        }
    }
    for g in 0..globals {
        let column = all.iter().flat_map(|piece| piece.j[g].iter().copied()).collect();
        let rest = rest(&basis, 0, column);
        basis.extend(rest);
    }
    basis
}

/// What a column adds to a basis.
fn rest(basis: &[Direction], begin: usize, mut column: Vec<f64>) -> Option<Direction> {
    let before = dot(&column, &column).sqrt();
    for _ in 0..2 {
        basis.iter().for_each(|q| q.take_out_of(&mut column, begin));
    }
    let left = dot(&column, &column).sqrt();
    (left > 1e-7 * before).then(|| {
        column.iter_mut().for_each(|c| *c /= left);
        Direction { begin, values: column }
    })
}
