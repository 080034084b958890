//! The user's mistakes: one message with the place, the fact and the way out.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

/// A text that positions point into: a study file, or a data file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// Path as the user wrote it.
    pub name: String,
    /// The whole text; empty for binary files.
    pub text: String,
}

/// A mistake in what the user gave: the study, its data or the command line.
///
/// Numerical trouble is never a diagnostic: it is a value ([`crate::Failure`]).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// The fact, one sentence without a full stop.
    pub message: String,
    /// What the marked place is, in a few words.
    pub label: Option<String>,
    /// The way out.
    pub help: Option<String>,
    /// Where: the text and the range of bytes in it.
    pub place: Option<(Arc<Source>, Range<usize>)>,
}

impl Diagnostic {
    /// A mistake without a place yet.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), label: None, help: None, place: None }
    }

    /// Adds the way out.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Adds what the marked place is.
    #[must_use]
    pub fn with_label(mut self, label: impl Into<String>) -> Self {
        self.label = Some(label.into());
        self
    }

    /// Adds the place: bytes `span` of `source`.
    #[must_use]
    pub fn at(mut self, source: &Arc<Source>, span: Range<usize>) -> Self {
        self.place = Some((Arc::clone(source), span));
        self
    }

    /// Line and column, both from 1, the column counted in characters.
    pub fn line_column(&self) -> Option<(usize, usize)> {
        let (source, span) = self.place.as_ref()?;
        let before = &source.text[..source.text.floor_char_boundary(span.start)];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
        Some((line, column))
    }
}

/// `file:line:column: fact; way out`.
impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some((source, _)) = &self.place {
            write!(f, "{}", source.name)?;
            if !source.text.is_empty() {
                let (line, column) = self.line_column().expect("a diagnostic with a place has a line");
                write!(f, ":{line}:{column}")?;
            }
            write!(f, ": ")?;
        }
        write!(f, "{}", self.message)?;
        if let Some(help) = &self.help {
            write!(f, "; {help}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Diagnostic {}

/// The known name nearest to `given`, if one is near enough to be meant.
pub fn nearest<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(&given.to_lowercase(), &name.to_lowercase()), name))
        .filter(|(distance, name)| *distance <= 1 + name.chars().count().max(given.chars().count()) / 3)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, name)| name)
}

/// "did you mean `omega`?" or the list of what is known.
pub fn suggestion<'a>(given: &str, known: impl IntoIterator<Item = &'a str> + Clone) -> String {
    match nearest(given, known.clone()) {
        Some(name) => format!("did you mean `{name}`?"),
        None => {
            let names: Vec<&str> = known.into_iter().collect();
            if names.is_empty() { "nothing is known here".to_owned() } else { format!("known: {}", names.join(", ")) }
        }
    }
}
