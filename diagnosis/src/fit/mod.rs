//! Fits: a model with effects over records or windows of them, residuals with exact derivatives.

mod meter;
pub(crate) mod pieces;
mod residuals;
mod variant;
mod windows;

pub(crate) use meter::Meter;
pub(crate) use residuals::{Fit, Global, Piece, Point, Residuals, Sets, dot};
pub(crate) use variant::{Added, Variant, problem};
pub(crate) use windows::{cut, whole};
