//! Search over start values of effects of which no slope tells anything. An actuator of limited speed that begins where its
//! command is follows at once; begun a little beside it, it catches up in a time in proportion to the distance, so that what
//! it adds is of second order in that. Phases that differ from record to record, while nothing has their amplitude, are
//! looked for in the same way.

use std::sync::Arc;

use crate::diagnose::UNEXPLAINED;
use crate::fit::{Fit, Fitted, Point};
use crate::weigh::CLEARLY;

/// Distances from the first guess that are tried, in scales of the unknown. The scale of a start value is a tenth of its
/// typical size: half of that, once and twice, to both sides.
const DISTANCES: [f64; 6] = [-5.0, 5.0, -10.0, 10.0, -20.0, 20.0];

/// Iterations that follow each of them, as the others had made up for a start that was wrong.
const FEW: usize = 4;

/// Relative change of the sum of squares that is none.
const NOTHING: f64 = 1e-9;

impl Fit<'_> {
    /// The fit with what effects have of their own in pieces that begin with a record, and no slope tells, where that leaves
    /// clearly less, and all else by slopes again; as it is where it explains the data.
    pub(crate) fn with_starts(&self, fitted: Fitted, iterations: usize) -> Fitted {
        let silent = self.silent_starts(&fitted);
        if silent.is_empty() {
            return fitted;
        }
        // The few iterations that follow each trial are not to its credit.
        let Some(beside) = self.few_more(fitted.point.clone()) else { return fitted };
        let mut best = None;
        for start in silent {
            best = self.start_elsewhere(best.as_ref().unwrap_or(&beside), start).or(best);
        }
        let Some(best) = best else { return fitted };
        match self.normal_at(&best) {
            Some(normal) => self.levenberg_marquardt(best.point, normal, iterations),
            None => best,
        }
    }

    /// A fit of few iterations from a point; `None` where that cannot be simulated.
    fn few_more(&self, from: Point) -> Option<Fitted> {
        let normal = self.normal(&from).map(Arc::new)?;
        Some(self.levenberg_marquardt(from, normal, FEW))
    }

    /// Unknowns of effects, by piece and index there, in pieces that begin with a record, of which no slope tells anything; none
    /// where the fit explains the data.
    fn silent_starts(&self, fitted: &Fitted) -> Vec<(usize, usize)> {
        if fitted.normalised() <= UNEXPLAINED {
            return Vec::new();
        }
        let declared = self.subject.model.interface().parameters.len();
        let mut starts = Vec::new();
        let mut unknown = self.globals.len();
        for (piece, p) in self.pieces.iter().enumerate() {
            let of_effects = p.locals.iter().enumerate().filter(|(_, local)| local.parameter >= declared);
            if p.case.begins == 0.0 {
                starts.extend(of_effects.map(|(k, _)| ((piece, k), unknown + k)));
            }
            unknown += p.locals.len();
        }
        if starts.is_empty() {
            return Vec::new();
        }
        let Some(normal) = self.normal_at(fitted) else { return Vec::new() };
        starts.into_iter().filter(|(_, unknown)| normal.tells_nothing_of(*unknown)).map(|(start, _)| start).collect()
    }

    /// The fit with an unknown of a piece elsewhere, where that leaves clearly less.
    #[allow(clippy::cast_precision_loss)]
    fn start_elsewhere(&self, fitted: &Fitted, (piece, k): (usize, usize)) -> Option<Fitted> {
        let local = &self.pieces[piece].locals[k];
        let mut least = self.total(fitted) - CLEARLY * fitted.chi2 / fitted.count.max(1) as f64;
        let mut best = None;
        for distance in DISTANCES {
            let mut point = fitted.point.clone();
            point.locals[piece][k] = (local.start + distance * local.scale).clamp(local.bounds[0], local.bounds[1]);
            let Some(tried) = self.few_more(point) else { continue };
            if (tried.chi2 - fitted.chi2).abs() <= NOTHING * fitted.chi2 {
                // What acts nowhere begins anywhere.
                break;
            }
            let total = self.total(&tried);
            if total < least {
                (least, best) = (total, Some(tried));
            }
        }
        best
    }
}
