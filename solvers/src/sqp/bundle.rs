//! Pieces of criteria beyond their kinks.

use crate::linearised_criteria::LinearisedCriteria;

/// Points beyond kinks, with the rows there; what a criterion of several pieces needs besides the rows here.
///
/// Source: K. C. Kiwiel, Methods of Descent for Nondifferentiable Optimization, Lecture Notes in Mathematics 1133 (1985).
#[derive(Debug, Default)]
pub(super) struct Bundle {
    cuts: Vec<(Vec<f64>, LinearisedCriteria)>,
    /// Memory of those that are forgotten.
    unused: Vec<(Vec<f64>, LinearisedCriteria)>,
    /// The way from a piece to here.
    offset: Vec<f64>,
}

impl Bundle {
    pub fn is_empty(&self) -> bool {
        self.cuts.is_empty()
    }

    pub fn clear(&mut self) {
        self.unused.append(&mut self.cuts);
    }

    /// Keeps a piece; where there are many, the oldest one gives way.
    pub fn insert(&mut self, point: &[f64], criteria: &LinearisedCriteria) {
        let capacity = 2 * (point.len() + 1);
        if self.cuts.len() == capacity {
            self.cuts.rotate_left(1);
        } else {
            self.cuts.push(self.unused.pop().unwrap_or_default());
        }
        let (at, cut) = self.cuts.last_mut().expect("there is room for one");
        at.clear();
        at.extend_from_slice(point);
        cut.clone_from(criteria);
    }

    /// Forgets pieces farther away than `reach`: they describe nothing here.
    pub fn retain_near(&mut self, here: &[f64], radius: f64) {
        let is_far = |(point, _): &mut (Vec<f64>, LinearisedCriteria)| {
            point.iter().zip(here).any(|(a, b)| (*a - b).abs() > radius)
        };
        self.unused.extend(self.cuts.extract_if(.., is_far));
    }

    /// Adds the pieces, as they extend to here, to the rows here.
    pub fn add_to(&mut self, criteria: &LinearisedCriteria, here: &[f64], all: &mut LinearisedCriteria) {
        all.assign_with_cuts(criteria, here, &self.cuts, &mut self.offset);
    }
}
