//! Output to the terminal. Write errors are reported. Control characters from a study, a data file or a result are
//! escaped: they could move the cursor, change the title or clear the screen.

use std::io;
use std::io::ErrorKind;

use mops_language::plain::{escaped, plain};

use super::command_error::CommandError;
use std::io::Write;

/// Writes a text to standard output, with control characters escaped. A closed pipe is not an error.
///
/// # Errors
/// If standard output cannot be written.
pub fn print(text: &str) -> Result<(), CommandError> {
    write_all(&plain(text))
}

/// Writes a value as JSON to standard output, with control characters escaped.
pub(crate) fn print_json(value: &impl serde::Serialize) -> Result<(), CommandError> {
    let text = serde_json::to_string_pretty(value).expect("results are JSON") + "\n";
    // N.B.: in JSON these characters occur in strings only, where a JSON escape exists for them.
    write_all(&escaped(&text, |c| format!("\\u{:04x}", u32::from(c))))
}

fn write_all(text: &str) -> Result<(), CommandError> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(CommandError::Failure(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}
