//! Mistakes of users, with the keys that lead to their place.

use std::fmt;
use std::ops::Range;

/// A mistake in a study, with the keys that lead to its place: `criteria`, `overshoot`, `overshoot`, `signal`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mistake {
    /// Keys from the study down.
    pub path: Vec<String>,
    /// The fact.
    pub message: String,
    /// The way out.
    pub help: Option<String>,
    /// Bytes of the text under the last key, where the mistake is in a part of it.
    pub span: Option<Range<usize>>,
}

impl Mistake {
    /// A mistake at a key.
    pub fn new(key: impl Into<String>, message: impl Into<String>) -> Self {
        Self { path: vec![key.into()], message: message.into(), help: None, span: None }
    }

    /// A mistake in the thing itself rather than under one of its keys.
    pub fn here(message: impl Into<String>) -> Self {
        Self { path: Vec::new(), message: message.into(), help: None, span: None }
    }

    /// Adds the way out.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Narrows the place to these bytes of the text under the key.
    #[must_use]
    pub fn at(mut self, span: Range<usize>) -> Self {
        self.span = Some(span);
        self
    }

    /// Puts the mistake under one more key.
    #[must_use]
    pub fn within(mut self, key: &str) -> Self {
        self.path.insert(0, key.to_owned());
        self
    }
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.path.join("."), self.message)?;
        self.help.as_ref().map_or(Ok(()), |help| write!(f, "; {help}"))
    }
}

impl std::error::Error for Mistake {}
