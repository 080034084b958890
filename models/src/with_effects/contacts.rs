//! Joints with dry friction, and the friction forces of stuck ones.
//!
//! The rates of a plant are affine in its forces, `v' = a + B f`. The friction forces of stuck joints make their
//! accelerations vanish, so no mass matrix is needed.

use mops_language::Scalar;
use nalgebra::{DMatrix, DVector};

use crate::kernel::friction::Contact;

/// Joints with dry friction.
#[derive(Debug, Clone, Default)]
pub(super) struct Contacts {
    pub(super) joints: Vec<Joint>,
}

/// Joint with dry friction.
#[derive(Debug, Clone)]
pub(super) struct Joint {
    /// Effects that give the friction: the joint sticks or slides as a whole, and their friction adds up.
    pub(super) effects: Vec<usize>,
    /// Force in the equation of the joint.
    pub(super) w: usize,
    /// Speed of the joint, as a state.
    pub(super) velocity: usize,
    /// Contact of the joint.
    pub(super) contact: Contact,
}

impl Contacts {
    pub(super) fn add(&mut self, effect: usize, w: usize, velocity: usize) {
        match self.joints.iter_mut().find(|joint| joint.w == w) {
            Some(joint) => joint.effects.push(effect),
            None => self.joints.push(Joint { effects: vec![effect], w, velocity, contact: Contact::Stuck }),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.joints.len()
    }

    pub(super) fn any_stuck(&self) -> bool {
        self.joints.iter().any(|joint| joint.contact == Contact::Stuck)
    }

    /// Returns for each joint its speed, as a state, and its direction: 1 if it slides forward, -1 if backward, 0 if it
    /// is stuck.
    pub(super) fn directions(&self) -> impl Iterator<Item = (usize, f64)> {
        let direction = |joint: &Joint| if joint.contact == Contact::Stuck { 0.0 } else { joint.contact.sign() };
        self.joints.iter().map(move |joint| (joint.velocity, direction(joint)))
    }

    /// Returns the contacts with every stuck joint sliding forward.
    pub(super) fn sliding(&self) -> Self {
        let slide = |joint: &Joint| match joint.contact {
            Contact::Stuck => Joint { contact: Contact::Forward, ..joint.clone() },
            _ => joint.clone(),
        };
        Self { joints: self.joints.iter().map(slide).collect() }
    }

    /// Returns 1 if the joint of this effect slides forward, -1 if backward; `None` if it is stuck or has no dry
    /// friction.
    pub(super) fn direction(&self, effect: usize) -> Option<f64> {
        let joint = self.joints.iter().find(|joint| joint.effects.contains(&effect))?;
        (joint.contact != Contact::Stuck).then(|| joint.contact.sign())
    }
}

/// Solves `columns f = -free`; the systems are small.
pub(super) fn solve<S: Scalar>(columns: &[Vec<S>], free: &[S]) -> Vec<S> {
    let n = free.len();
    match n {
        0 => return Vec::new(),
        1 => return vec![-free[0] / columns[0][0]],
        _ => {}
    }
    // Values by LU decomposition; tangents by one Newton step, which is exact.
    let matrix = DMatrix::from_fn(n, n, |i, j| columns[j][i].value());
    let lu = matrix.lu();
    let right = DVector::from_fn(n, |i, _| -free[i].value());
    let Some(values) = lu.solve(&right) else { return vec![S::from(f64::NAN); n] };
    let residual: Vec<S> = (0..n).map(|i| (0..n).fold(free[i], |sum, j| sum + columns[j][i] * values[j])).collect();
    let mut fixed: Vec<S> = values.iter().map(|&v| S::from(v)).collect();
    for direction in 0..S::DIRECTIONS {
        let right = DVector::from_fn(n, |i, _| -residual[i].tangents()[direction]);
        if let Some(tangent) = lu.solve(&right) {
            fixed.iter_mut().zip(tangent.iter()).for_each(|(h, &t)| h.set_tangent(direction, t));
        }
    }
    fixed
}
