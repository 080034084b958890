//! Lines on standard error.

use std::io::{self, Write};

use mops_language::plain::plain;

/// Writes a line to standard error; a failure to do so is ignored.
pub(crate) fn eprint_line(text: &str) {
    let _ = writeln!(io::stderr(), "{}", plain(text));
}
