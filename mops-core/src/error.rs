//! Errors in a study, with the path of keys to their location.

use std::fmt;
use std::ops::Range;

/// An error in a study, with the path of keys to its location: `criteria`, `overshoot`, `overshoot`, `signal`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StudyError {
    /// Keys from the root of the study.
    pub path: Vec<String>,
    /// Description of the error.
    pub message: String,
    /// Suggested fix.
    pub help: Option<String>,
    /// Byte range within the text under the last key, if only a part of the text is wrong.
    pub span: Option<Range<usize>>,
}

impl StudyError {
    /// Creates an error at a key.
    pub fn new(key: impl Into<String>, message: impl Into<String>) -> Self {
        Self { path: vec![key.into()], message: message.into(), help: None, span: None }
    }

    /// Creates an error in the object itself rather than under one of its keys.
    pub fn here(message: impl Into<String>) -> Self {
        Self { path: Vec::new(), message: message.into(), help: None, span: None }
    }

    /// Adds a suggested fix.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Restricts the location to these bytes of the text under the key.
    #[must_use]
    pub fn at(mut self, span: Range<usize>) -> Self {
        self.span = Some(span);
        self
    }

    /// Prepends a key to the path.
    #[must_use]
    pub fn within(mut self, key: &str) -> Self {
        self.path.insert(0, key.to_owned());
        self
    }
}

impl fmt::Display for StudyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.path.join("."), self.message)?;
        self.help.as_ref().map_or(Ok(()), |help| write!(f, "; {help}"))
    }
}

impl std::error::Error for StudyError {}
