//! User errors: one message with the location, the description and the suggested fix.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

/// A text that locations refer to: a study file or a data file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// Path as written by the user.
    pub name: String,
    /// Contents of the file; empty for binary files.
    pub text: String,
}

impl Source {
    /// Creates a source from the bytes of a text file, without a byte order mark.
    ///
    /// # Errors
    /// Returns an error if the bytes are not UTF-8, with the location of the first invalid one.
    pub fn from_bytes(name: &str, bytes: Vec<u8>) -> Result<Self, Diagnostic> {
        let source =
            |text: &str| Self { name: name.to_owned(), text: text.strip_prefix('\u{feff}').unwrap_or(text).to_owned() };
        let text = match String::from_utf8(bytes) {
            Ok(text) => return Ok(source(&text)),
            Err(error) => error,
        };
        let bytes = text.as_bytes();
        if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
            return Err(Diagnostic::new("the file is UTF-16, not UTF-8")
                .with_help("save it as UTF-8")
                .at(&Arc::new(source("")), 0..0));
        }
        let readable = text.utf8_error().valid_up_to();
        let unreadable = String::from_utf8_lossy(&bytes[readable..]);
        let lossy = Arc::new(source(&String::from_utf8_lossy(bytes)));
        let start = lossy.text.len() - unreadable.len();
        Err(Diagnostic::new("the file is not UTF-8")
            .with_label("from here on")
            .with_help("save it as UTF-8")
            .at(&lossy, start..start + char::REPLACEMENT_CHARACTER.len_utf8()))
    }
}

/// An error in the user's input: the study, its data or the command line.
///
/// Numerical failures are not diagnostics but values (`Failure` of the core).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Description, one sentence without a full stop.
    pub message: String,
    /// Label of the marked location, a few words.
    pub label: Option<String>,
    /// Suggested fix.
    pub help: Option<String>,
    /// Location: the text and a byte range in it; `0..0` denotes the complete file.
    pub place: Option<(Arc<Source>, Range<usize>)>,
}

impl Diagnostic {
    /// Creates an error without a location.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), label: None, help: None, place: None }
    }

    /// Adds a suggested fix.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Adds a label of the marked location.
    #[must_use]
    pub fn with_label(mut self, label: impl Into<String>) -> Self {
        self.label = Some(label.into());
        self
    }

    /// Adds the location: bytes `span` of `source`.
    #[must_use]
    pub fn at(mut self, source: &Arc<Source>, span: Range<usize>) -> Self {
        self.place = Some((Arc::clone(source), span));
        self
    }

    /// Returns line and column, both from 1, the column counted in characters; `None` if the location is the whole
    /// file.
    pub fn line_column(&self) -> Option<(usize, usize)> {
        let (source, span) = self.place.as_ref().filter(|(_, span)| *span != (0..0))?;
        let before = &source.text[..source.text.floor_char_boundary(span.start)];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
        Some((line, column))
    }
}

/// Formats as `file:line:column: description; suggested fix`.
impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some((source, _)) = &self.place {
            write!(f, "{}", source.name)?;
            if let Some((line, column)) = self.line_column() {
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

/// Returns the known name nearest to `given`, if one is close enough. At most about a quarter of its letters may
/// differ, or it starts with `given`.
pub fn nearest<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let given = given.to_lowercase();
    let length = given.chars().count();
    let distance = |name: &'a str| {
        let name = name.to_lowercase();
        let longer = length.max(name.chars().count());
        let distance = strsim::damerau_levenshtein(&given, &name);
        // If a name has one letter only, no common letter remains when that one differs.
        let near = distance <= 1 + longer / 4 && distance < longer;
        let started = length >= 3 && name.starts_with(&given);
        (near || started).then_some(if started { 0 } else { distance })
    };
    let near = known.into_iter().filter_map(|name| Some((distance(name)?, name)));
    near.min_by_key(|(distance, _)| *distance).map(|(_, name)| name)
}

/// Returns "did you mean `omega`?" or the list of known names.
pub fn suggestion<'a>(given: &str, known: impl IntoIterator<Item = &'a str> + Clone) -> String {
    match nearest(given, known.clone()) {
        Some(name) => format!("did you mean `{name}`?"),
        None => {
            let names: Vec<&str> = known.into_iter().collect();
            if names.is_empty() {
                "there are none to choose from".to_owned()
            } else {
                format!("known: {}", names.join(", "))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_near_name_is_one_that_a_slip_of_the_hand_leads_to() {
        let known = ["k", "Ti", "settling-time", "levenberg-marquardt"];
        assert_eq!(nearest("ti", known), Some("Ti"));
        assert_eq!(nearest("settlng-tiem", known), Some("settling-time"));
        assert_eq!(nearest("levenberg", known), Some("levenberg-marquardt"));
        assert_eq!(nearest("q", known), None);
        assert_eq!(nearest("tau", known), None);
    }

    #[test]
    fn a_place_in_a_text_is_counted_in_characters() {
        let source = Arc::new(Source { name: "a.txt".into(), text: "gr\u{fc}n\n\u{b5} = x".into() });
        let at = |text: &str| {
            let start = source.text.find(text).unwrap();
            Diagnostic::new("wrong").at(&source, start..start + text.len()).to_string()
        };
        assert_eq!(at("x"), "a.txt:2:5: wrong");
        assert_eq!(Diagnostic::new("wrong").at(&source, 0..0).to_string(), "a.txt: wrong");
    }
}
