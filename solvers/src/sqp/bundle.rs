//! Pieces of criteria beyond their kinks.

use crate::epigraph::Rows;

/// Points beyond kinks, with the rows there; what a criterion of several pieces needs besides the rows here.
///
/// Source: K. C. Kiwiel, Methods of Descent for Nondifferentiable Optimization, Lecture Notes in Mathematics 1133 (1985).
#[derive(Debug, Default)]
pub(super) struct Bundle {
    pieces: Vec<(Vec<f64>, Rows)>,
}

impl Bundle {
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    pub fn clear(&mut self) {
        self.pieces.clear();
    }

    /// Keeps a piece, and forgets the oldest ones.
    pub fn remember(&mut self, point: Vec<f64>, rows: Rows) {
        let most = 2 * (point.len() + 1);
        self.pieces.push((point, rows));
        self.pieces.drain(..self.pieces.len().saturating_sub(most));
    }

    /// Forgets pieces farther away than `reach`: they describe nothing here.
    pub fn keep_near(&mut self, here: &[f64], reach: f64) {
        self.pieces.retain(|(point, _)| point.iter().zip(here).all(|(a, b)| (a - b).abs() <= reach));
    }

    /// Adds the pieces, as they extend to here, to the rows here.
    pub fn add_to(&self, rows: &mut Rows, here: &[f64]) {
        for (point, pieces) in &self.pieces {
            let back: Vec<f64> = here.iter().zip(point).map(|(a, b)| a - b).collect();
            rows.add_pieces(pieces, &back);
        }
    }
}
