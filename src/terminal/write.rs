//! Text to the terminal. Write errors are reported. Control characters of a study, a data file or a result are escaped: they
//! would move the cursor, change the title or clear the screen.

use std::io::{self, ErrorKind, Write};

use super::CommandError;
use crate::plain::{escaped, plain};

/// Writes to standard output, control characters escaped. A reader that closes the pipe early is no error.
///
/// # Errors
/// Standard output cannot be written.
pub fn print(text: &str) -> Result<(), CommandError> {
    whole(&plain(text))
}

/// Writes JSON to standard output.
pub(crate) fn print_json(value: &impl serde::Serialize) -> Result<(), CommandError> {
    let text = serde_json::to_string_pretty(value).expect("results are JSON") + "\n";
    // N.B.: within JSON these characters stand in strings alone, and have an escape of their own there.
    whole(&escaped(&text, |c| format!("\\u{:04x}", u32::from(c))))
}

fn whole(text: &str) -> Result<(), CommandError> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(CommandError::Failure(format!("standard output cannot be written: {error}")))
        }
        _ => Ok(()),
    }
}

/// Writes a line to standard error; a failure to do so is ignored.
pub(crate) fn say(text: &str) {
    let _ = writeln!(io::stderr(), "{}", plain(text));
}
