//! Sizes as integers of SQLite.

use rusqlite::Row;

/// Returns the size in a column; 0 if it is negative.
pub(super) fn size(row: &Row<'_>, column: usize) -> rusqlite::Result<usize> {
    Ok(usize::try_from(row.get::<_, i64>(column)?).unwrap_or(0))
}

/// Returns a size as an integer for a column.
pub(super) fn integer(size: usize) -> i64 {
    i64::try_from(size).unwrap_or(i64::MAX)
}
