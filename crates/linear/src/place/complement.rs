//! Orthogonal complements.

use nalgebra::{ComplexField, DMatrix};

/// Returns orthonormal columns that complete those of `m` to a basis; `m` has full column rank.
pub(super) fn complement<T: ComplexField>(m: &DMatrix<T>) -> DMatrix<T> {
    let (rows, columns) = m.shape();
    let mut square = DMatrix::<T>::zeros(rows, rows);
    square.columns_mut(0, columns).copy_from(m);
    // Factor Q of the padded matrix: zero columns have trivial reflections.
    square.qr().q().columns(columns, rows - columns).into_owned()
}
