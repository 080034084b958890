//! Whether an unknown signal foretells what it has not seen: blocks of samples are left out in turn.

use mops_models::WithEffects;
use nalgebra::{DMatrix, DVector};

use crate::fit::Fit;
use crate::locate::Located;
use crate::screen::Scene;
use crate::unknown::{Unknown, basis};

/// Blocks per piece of a record; every fifth is left out at a time.
const BLOCKS: f64 = 25.0;
const FOLDS: usize = 5;

/// By which share the free signal at a place lowers the error on samples left out: 0.1 is 10 %, and below 0 it does harm.
/// The unknowns of the fit are estimated anew, to first order, with the signal and without it; how smooth and how large the
/// signal is expected to be is not, but stays as all samples want it.
///
/// Source: M. Stone, Cross-validatory choice and assessment of statistical predictions, Journal of the Royal Statistical
/// Society B 36 (1974) 111; blocks as residuals next to each other are alike.
pub fn predictive_gain(located: &Located, fit: &Fit<'_>, model: &WithEffects, scene: &Scene) -> f64 {
    let gain = || {
        let unknown = Unknown::new(&located.port, fit, model, scene)?;
        let prior = unknown.prior(located.terms())?;
        let chosen = DMatrix::from_fn(unknown.columns.nrows(), prior.columns.len(), |i, j| {
            unknown.columns[(i, prior.columns[j])]
        });
        let shaped = chosen * &prior.root * located.variance().sqrt();
        let basis = basis(scene);
        let signals = shaped.ncols();
        let mut design = DMatrix::zeros(shaped.nrows(), signals + basis.ncols());
        design.columns_mut(0, signals).copy_from(&shaped);
        design.columns_mut(signals, basis.ncols()).copy_from(&basis);
        let residuals = DVector::from_column_slice(&scene.residuals);
        let folds = folds(fit);
        let (mut with, mut without) = (0.0, 0.0);
        for fold in 0..FOLDS {
            let rows =
                |kept: bool| -> Vec<usize> { (0..folds.len()).filter(|&i| (folds[i] == fold) != kept).collect() };
            let (seen, left) = (rows(true), rows(false));
            with += error(&design, &residuals, signals, &seen, &left)?;
            without += error(&basis, &residuals, 0, &seen, &left)?;
        }
        (without > 0.0).then(|| 1.0 - (with / without).sqrt())
    };
    gain().unwrap_or(0.0)
}

/// The fold of every residual: all channels of a block are left out together.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn folds(fit: &Fit<'_>) -> Vec<usize> {
    let series = fit.pieces.iter().flat_map(|piece| piece.series.iter().map(move |s| (s, piece.horizon)));
    series.flat_map(|(s, end)| s.times.iter().map(move |t| (BLOCKS * t / end).floor() as usize % FOLDS)).collect()
}

/// Sum of the squares that are left of the samples left out; the first `signals` columns have coefficients of variance 1.
fn error(
    design: &DMatrix<f64>,
    residuals: &DVector<f64>,
    signals: usize,
    seen: &[usize],
    left: &[usize],
) -> Option<f64> {
    let rows = design.select_rows(seen);
    let turned = rows.transpose();
    let mut normal = &turned * rows;
    for k in 0..normal.nrows() {
        normal[(k, k)] += if k < signals { 1.0 } else { 1e-9 };
    }
    let solved = normal.cholesky()?.solve(&(turned * residuals.select_rows(seen)));
    let rest = residuals.select_rows(left) - design.select_rows(left) * solved;
    Some(rest.norm_squared())
}
