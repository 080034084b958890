//! Search over start values of effects of which no slope tells anything. An actuator of limited speed that begins where its
//! command is follows at once; begun a little beside it, it catches up in a time in proportion to the distance, so that what
//! it adds is of second order in that. Phases that differ from record to record, while nothing has their amplitude, are
//! looked for in the same way.

use std::sync::Arc;

use crate::diagnose::UNEXPLAINED;
use crate::fit::{Fit, Fitted, Point, Residuals, Slopes};
use crate::weigh::CLEARLY;

/// Distances from the first guess that are tried, in scales of the unknown. The scale of a start value is a tenth of its
/// typical size: half of that, once and twice, to both sides.
const DISTANCES: [f64; 6] = [-5.0, 5.0, -10.0, 10.0, -20.0, 20.0];

/// Iterations that follow the best of them, as the others had made up for a start that was wrong.
const FEW: usize = 4;

/// Shares of a clear gain: what one step must bring at least to be followed, and what is none.
const PROMISING: f64 = 0.1;
const NOTHING: f64 = 0.01;

/// A fit that starts elsewhere are compared with.
struct Origin {
    point: Point,
    /// Residuals and slopes there.
    known: Vec<Residuals>,
    /// One step from there.
    stays: Fitted,
}

impl Fit<'_> {
    /// The fit with what effects have of their own in pieces that begin with a record, and no slope tells, where that leaves
    /// clearly less, and all else by slopes again; as it is where it explains the data.
    pub(crate) fn with_starts(&self, fitted: Fitted, iterations: usize) -> Fitted {
        let silent = self.silent_starts(&fitted);
        if silent.is_empty() {
            return fitted;
        }
        let mut best: Option<Fitted> = None;
        let mut origin = self.origin(&fitted);
        for start in silent {
            let Some(from) = &origin else { break };
            let Some(moved) = self.start_elsewhere(from, start) else { continue };
            origin = self.origin(&moved);
            best = Some(moved);
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

    /// Where starts elsewhere are compared with.
    fn origin(&self, fitted: &Fitted) -> Option<Origin> {
        let known = self.looks(&fitted.point, Slopes::Free)?;
        let stays = self.one_step(fitted.point.clone(), known.clone());
        Some(Origin { point: fitted.point.clone(), known, stays })
    }

    /// One step from a point whose residuals and slopes are known.
    fn one_step(&self, from: Point, known: Vec<Residuals>) -> Fitted {
        let normal = Arc::new(self.equations(&from, known));
        self.levenberg_marquardt(from, normal, 1)
    }

    /// The fit with an unknown of a piece elsewhere, where that leaves clearly less: the distance from the first guess that does
    /// best in one step of all others. What follows that is not to its credit.
    #[allow(clippy::cast_precision_loss)]
    fn start_elsewhere(&self, origin: &Origin, (piece, k): (usize, usize)) -> Option<Fitted> {
        let Origin { point: from, known, stays } = origin;
        let local = &self.pieces[piece].locals[k];
        let clearly = CLEARLY * stays.chi2 / stays.count.max(1) as f64;
        let (mut least, mut best) = (self.total(stays) - PROMISING * clearly, None);
        for distance in DISTANCES {
            let mut point = from.clone();
            point.locals[piece][k] = (local.start + distance * local.scale).clamp(local.bounds[0], local.bounds[1]);
            // It changes what begins with it alone.
            let Some(there) = self.look(piece, &point, Slopes::Free) else { continue };
            let mut all = known.clone();
            all[piece] = there;
            let moved = self.one_step(point, all);
            if (moved.chi2 - stays.chi2).abs() <= NOTHING * clearly {
                // What acts nowhere begins anywhere.
                break;
            }
            let total = self.total(&moved);
            if total < least {
                (least, best) = (total, Some(moved));
            }
        }
        let (moved, stays) = (self.few_more(best?.point)?, self.few_more(stays.point.clone())?);
        (self.total(&moved) < self.total(&stays) - clearly).then_some(moved)
    }
}
