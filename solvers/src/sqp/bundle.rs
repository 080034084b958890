//! Pieces of criteria beyond their kinks.

use crate::rows::Rows;

/// Points beyond kinks, with the rows there; what a criterion of several pieces needs besides the rows here.
///
/// Source: K. C. Kiwiel, Methods of Descent for Nondifferentiable Optimization, Lecture Notes in Mathematics 1133 (1985).
#[derive(Debug, Default)]
pub(super) struct Bundle {
    pieces: Vec<(Vec<f64>, Rows)>,
    /// Memory of those that are forgotten.
    spare: Vec<(Vec<f64>, Rows)>,
    /// The way from a piece to here.
    back: Vec<f64>,
}

impl Bundle {
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    pub fn clear(&mut self) {
        self.spare.append(&mut self.pieces);
    }

    /// Keeps a piece; where there are many, the oldest one gives way.
    pub fn remember(&mut self, point: &[f64], rows: &Rows) {
        let most = 2 * (point.len() + 1);
        if self.pieces.len() == most {
            self.pieces.rotate_left(1);
        } else {
            self.pieces.push(self.spare.pop().unwrap_or_default());
        }
        let (at, piece) = self.pieces.last_mut().expect("there is room for one");
        at.clear();
        at.extend_from_slice(point);
        piece.clone_from(rows);
    }

    /// Forgets pieces farther away than `reach`: they describe nothing here.
    pub fn keep_near(&mut self, here: &[f64], reach: f64) {
        let is_far = |(point, _): &mut (Vec<f64>, Rows)| point.iter().zip(here).any(|(a, b)| (*a - b).abs() > reach);
        self.spare.extend(self.pieces.extract_if(.., is_far));
    }

    /// Adds the pieces, as they extend to here, to the rows here.
    pub fn add_to(&mut self, rows: &Rows, here: &[f64], all: &mut Rows) {
        all.gather(rows, here, &self.pieces, &mut self.back);
    }
}
