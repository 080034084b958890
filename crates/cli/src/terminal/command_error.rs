//! Errors of commands.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use mops_language::Diagnostic;
use mops_output::Overwrites;

use super::eprint::eprint_line;
use super::mistake;

/// Reason why a command ends without its result.
#[derive(Debug)]
#[non_exhaustive]
pub enum CommandError {
    /// Mistake of the user, in a file or on the command line: exit status 2.
    Mistake(Box<Diagnostic>),
    /// Failure of the run or of the machine, as one sentence: exit status 3.
    Failure(String),
}

impl From<Diagnostic> for CommandError {
    fn from(diagnostic: Diagnostic) -> Self {
        Self::Mistake(Box::new(diagnostic))
    }
}

impl CommandError {
    /// Returns a conversion of write errors at `path`, for `map_err`. To overwrite an input is a mistake of the user.
    pub fn cannot_write(path: &Path) -> impl FnOnce(std::io::Error) -> Self + use<> {
        let path: PathBuf = path.to_owned();
        move |error| match error.get_ref().and_then(|error| error.downcast_ref::<Overwrites>()) {
            Some(refusal) => Diagnostic::new(refusal.to_string()).with_help("write to another place with --out").into(),
            None => Self::Failure(format!("cannot write {}: {error}", path.display())),
        }
    }

    /// Writes the error to standard error, a mistake with its source line, and returns the exit status.
    #[must_use]
    pub fn report(&self) -> ExitCode {
        match self {
            Self::Mistake(diagnostic) => {
                mistake::show(diagnostic);
                ExitCode::from(2)
            }
            Self::Failure(message) => {
                eprint_line(&format!("error: {message}"));
                ExitCode::from(3)
            }
        }
    }
}
