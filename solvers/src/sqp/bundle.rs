//! Bundle of linear models (cuts) beyond the kinks of criteria.

use crate::linearised_criteria::LinearisedCriteria;

/// Criteria linearised at points beyond kinks, which complement the linearisation at the iterate.
///
/// Source: K. C. Kiwiel, Methods of Descent for Nondifferentiable Optimization, Lecture Notes in Mathematics 1133
/// (1985).
#[derive(Debug, Default)]
pub(super) struct Bundle {
    cuts: Vec<(Vec<f64>, LinearisedCriteria)>,
    /// Memory of removed cuts, for reuse.
    unused: Vec<(Vec<f64>, LinearisedCriteria)>,
    /// Buffer for the distance from a cut to the iterate.
    offset: Vec<f64>,
}

impl Bundle {
    pub fn is_empty(&self) -> bool {
        self.cuts.is_empty()
    }

    pub fn clear(&mut self) {
        self.unused.append(&mut self.cuts);
    }

    /// Adds a cut; replaces the oldest one if the bundle is full.
    pub fn insert(&mut self, point: &[f64], criteria: &LinearisedCriteria) {
        let capacity = 2 * (point.len() + 1);
        if self.cuts.len() == capacity {
            self.cuts.rotate_left(1);
        } else {
            self.cuts.push(self.unused.pop().unwrap_or_default());
        }
        let (at, cut) = self.cuts.last_mut().expect("the bundle has at least one cut");
        at.clear();
        at.extend_from_slice(point);
        cut.clone_from(criteria);
    }

    /// Removes cuts farther away than `radius`, which do not describe the criteria here.
    pub fn retain_near(&mut self, here: &[f64], radius: f64) {
        let is_far = |(point, _): &mut (Vec<f64>, LinearisedCriteria)| {
            point.iter().zip(here).any(|(a, b)| (*a - b).abs() > radius)
        };
        self.unused.extend(self.cuts.extract_if(.., is_far));
    }

    /// Combines the criteria at the iterate with the cuts, extrapolated to the iterate.
    pub fn add_to(&mut self, criteria: &LinearisedCriteria, here: &[f64], all: &mut LinearisedCriteria) {
        all.assign_with_cuts(criteria, here, &self.cuts, &mut self.offset);
    }
}
