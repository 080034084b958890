//! Refusal to open a database.

use mops_language::Diagnostic;

/// Reason why a database cannot be opened.
pub enum OpenError {
    /// Mistake of the user.
    Mistake(Diagnostic),
    /// Failure of the machine.
    Failure(String),
}

impl From<Diagnostic> for OpenError {
    fn from(diagnostic: Diagnostic) -> Self {
        Self::Mistake(diagnostic)
    }
}
