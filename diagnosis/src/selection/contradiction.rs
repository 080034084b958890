//! Contradiction: selection records that a set cannot describe together with the calibration records.

use mops_core::Role;

use super::fitted_set::{FittedSet, estimation, rms, surprise};
use crate::estimation::ErrorModel;
use crate::fit::{Fit, Point, pieces, problem};

/// Returns true if the errors of calibration and selection records, fitted together, are larger than those of the
/// calibration records alone, and other than the set and its error model expect.
pub fn is_contradicted(set: &FittedSet<'_>) -> bool {
    *set.contradicted.get_or_init(|| contradicts(set))
}

fn contradicts(set: &FittedSet<'_>) -> bool {
    let settings = &set.fit.subject.settings;
    let together = || {
        let (fit, point) = fitted_together(set)?;
        let residuals = fit.all(&point)?;
        let error = rms(residuals.iter().flatten());
        let outputs = set.under.iter().filter(|(kind, _)| *kind != ErrorModel::Force);
        let surprises =
            outputs.filter_map(|(_, estimate)| surprise(&estimate.errors, &fit.pieces, &residuals, settings));
        Some((error, surprises.min_by(f64::total_cmp)?))
    };
    let expected = set.error().unwrap_or(f64::INFINITY).max(1.0);
    together().is_some_and(|(error, surprise)| error > settings.matters * expected && surprise > settings.fires)
}

/// Fits a set to calibration and selection records together by least squares; `None` if they cannot be simulated.
pub fn fitted_together<'a>(set: &FittedSet<'a>) -> Option<(Fit<'a>, Point)> {
    let subject = set.fit.subject;
    let start = set.start_at(&set.least_squares.point);
    let pieces = pieces::pieces(subject, |role| role != Role::Validation);
    let mut locals = pieces::first_locals(&pieces);
    for (known, piece) in start.locals.iter().zip(&set.fit.pieces) {
        if let Some(index) = pieces.iter().position(|p| p.measurement == piece.measurement) {
            locals[index].clone_from(known);
        }
    }
    let (fit, point, variant) = problem(subject, &start.added, pieces, &start.tuners, locals, &[], set.fit.simulations);
    let point = estimation(subject, &fit, &variant, &start.added, &[], &point).least_squares(point)?.point;
    Some((fit, point))
}
