//! Text cells of CSV files that a spreadsheet would take for formulas.

use std::borrow::Cow;

/// Returns a text as it is written into a cell: one that begins with `=`, `+`, `-` or `@` gets a leading apostrophe,
/// with which a spreadsheet shows it as text. A text that looks like the result of this function gets one more.
///
/// Source: OWASP, CSV injection.
pub fn as_text(cell: &str) -> Cow<'_, str> {
    if is_formula(cell) { Cow::Owned(format!("'{cell}")) } else { Cow::Borrowed(cell) }
}

/// Returns the text for which [`as_text`] wrote a cell.
pub(super) fn from_text(cell: &str) -> &str {
    cell.strip_prefix('\'').filter(|rest| is_formula(rest)).unwrap_or(cell)
}

fn is_formula(cell: &str) -> bool {
    cell.trim_start_matches('\'').starts_with(['=', '+', '-', '@'])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_that_would_be_a_formula_gets_an_apostrophe_and_is_read_back_unchanged() {
        for (text, cell) in [
            ("=1+2", "'=1+2"),
            ("+x", "'+x"),
            ("-x[s]", "'-x[s]"),
            ("@sum", "'@sum"),
            ("'=x", "''=x"),
            ("x=1", "x=1"),
            ("'x", "'x"),
            ("", ""),
        ] {
            assert_eq!((as_text(text).as_ref(), from_text(cell)), (cell, text));
        }
    }
}
