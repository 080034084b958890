//! What is fitted of a study: its unknowns, its records.

use mops_core::Role;

use super::residuals::{Global, Piece, Sets};
use super::windows::whole;
use crate::records::Subject;

/// The unknowns of the study as globals of a fit.
pub fn globals(subject: &Subject) -> Vec<Global> {
    let global = |(k, &index): (usize, &usize)| {
        let tuner = &subject.study.tuners()[index];
        let log = subject.is_log(k);
        let scale = (tuner.bounds[1] - tuner.bounds[0])
            .abs()
            .min(tuner.start.abs().max(1e-3 * (tuner.bounds[1] - tuner.bounds[0])));
        Global { sets: Sets::Tuner(k), bounds: tuner.bounds, log, scale, steps: false }
    };
    subject.globals.iter().enumerate().map(global).collect()
}

/// The experiments with a role that is asked for, whole.
pub fn pieces(subject: &Subject, wanted: impl Fn(Role) -> bool) -> Vec<Piece> {
    let all = subject.measurements.iter().enumerate().filter(|(_, m)| wanted(m.role));
    all.map(|(index, m)| whole(index, m)).collect()
}

/// The first guesses of all locals.
pub fn first_locals(pieces: &[Piece]) -> Vec<Vec<f64>> {
    pieces.iter().map(|piece| piece.locals.iter().map(|local| local.start).collect()).collect()
}
