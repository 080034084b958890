//! Start values of effects that no slope tells: an actuator of limited speed that begins where its command is follows at once,
//! and one that begins a little beside it catches up in so short a time that the square of the distance is lost.

use std::sync::Arc;

use crate::diagnose::UNEXPLAINED;
use crate::fit::{Fit, Fitted, Slopes};

/// Distances from rest that are tried, in scales of the start value: these are a tenth of what is typical of it.
const DISTANCES: [f64; 6] = [-5.0, 5.0, -10.0, 10.0, -20.0, 20.0];

/// Iterations that follow each of them.
const FEW: usize = 4;

/// Share of the sum of squares that is no change.
const NOTHING: f64 = 1e-9;

/// What one unknown more gains by chance.
const BY_CHANCE: f64 = 1.0;

impl Fit<'_> {
    /// The fit with start values of effects, of which no slope tells anything, where they leave less, and all else by slopes
    /// again.
    pub(crate) fn roused(&self, fitted: Fitted, iterations: usize) -> Fitted {
        let begins = |piece: &usize| self.pieces[*piece].case.begins == 0.0;
        let of_effects = self.subject.model.interface().parameters.len();
        let starts = |piece: usize| {
            let locals = self.pieces[piece].locals.iter().enumerate();
            locals.filter(|(_, local)| local.parameter >= of_effects).map(move |(k, _)| (piece, k))
        };
        let starts: Vec<(usize, usize)> = (0..self.pieces.len()).filter(begins).flat_map(starts).collect();
        if starts.is_empty() || fitted.normalised() <= UNEXPLAINED {
            return fitted;
        }
        let Some(slopes) = self.looks(&fitted.point, Slopes::Free) else { return fitted };
        let is_silent =
            |&(piece, k): &(usize, usize)| slopes[piece].j[self.globals.len() + k].iter().all(|&slope| slope == 0.0);
        let mut best = fitted;
        let before = best.chi2;
        for start in starts.into_iter().filter(is_silent) {
            best = self.elsewhere(best, start);
        }
        if best.chi2 == before {
            return best;
        }
        match self.normal_at(&best) {
            Some(normal) => self.levenberg_marquardt(best.point, normal, iterations),
            None => best,
        }
    }

    /// The fit with one of the start values of a piece elsewhere, where that leaves less.
    fn elsewhere(&self, fitted: Fitted, (piece, k): (usize, usize)) -> Fitted {
        let local = &self.pieces[piece].locals[k];
        let mut best = fitted.clone();
        for distance in DISTANCES {
            let mut point = fitted.point.clone();
            point.locals[piece][k] = (local.start + distance * local.scale).clamp(local.bounds[0], local.bounds[1]);
            let Some(normal) = self.normal(&point).map(Arc::new) else { continue };
            let tried = self.levenberg_marquardt(point, normal, FEW);
            if (tried.chi2 - fitted.chi2).abs() <= NOTHING * fitted.chi2 {
                // What acts nowhere begins anywhere.
                break;
            }
            if tried.chi2 < best.chi2 - BY_CHANCE {
                best = tried;
            }
        }
        best
    }
}
