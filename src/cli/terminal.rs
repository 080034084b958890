//! What goes to the terminal: errors of writing are told, and no control character of a study, a data file or a result gets
//! there, where it would move the cursor, change the title or clear the screen.

use std::io::{self, ErrorKind, Write};

use super::Trouble;
use crate::plain::{escaped, plain};

/// Writes to standard output; a reader that closed its end early is no error.
pub(super) fn print(text: &str) -> Result<(), Trouble> {
    whole(&plain(text))
}

/// Writes JSON to standard output.
pub(super) fn print_json(value: &impl serde::Serialize) -> Result<(), Trouble> {
    let text = serde_json::to_string_pretty(value).expect("results are JSON") + "\n";
    // N.B.: within JSON these characters stand in strings alone, and have an escape of their own there.
    whole(&escaped(&text, |c| format!("\\u{:04x}", u32::from(c))))
}

fn whole(text: &str) -> Result<(), Trouble> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Trouble::Failure(format!("standard output cannot be written: {error}")))
        }
        _ => Ok(()),
    }
}

/// Writes a line to standard error; nobody can be told where that fails.
pub(super) fn say(text: &str) {
    let _ = writeln!(io::stderr(), "{}", plain(text));
}
