//! Numeric variables of a data file.

use crate::stamps::Origin;

/// Numeric variable: a CSV column, or a MATLAB matrix.
///
/// Each row is a sample; a MATLAB matrix with more columns than rows (1 x n, 2 x n) is transposed. Integers beyond 2^53
/// are rounded to the nearest `f64`.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Name in the file, without the unit; `Y{2}` is the second element of the cell array `Y`.
    pub name: String,
    /// Unit as given in the header of a CSV file.
    pub unit: Option<String>,
    /// Number of samples.
    pub rows: usize,
    /// Number of signals; 1 for CSV.
    pub columns: usize,
    /// Values column by column, `rows * columns` of them; NaN is a gap.
    pub values: Vec<f64>,
    /// First stamp of a column of time stamps, whose values are in s from there on.
    pub origin: Option<Origin>,
}
