//! Pieces of a text with their emphasis and tone.

/// Judgement of a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// What was asked for.
    Good,
    /// A result with doubts or missed demands.
    Mixed,
    /// No result, or one that must not be used.
    Bad,
}

/// Piece of a text or of a cell.
#[derive(Debug, Clone, PartialEq)]
pub enum Part {
    /// Text; names are in backticks.
    Text(String),
    /// Result.
    Strong(String),
    /// Remark on what precedes it.
    Small(String),
    /// Remark of little weight.
    Quiet(String),
    /// Judged text.
    Toned(Tone, String),
    /// File, key or command.
    Code(String),
    /// Line of its own.
    Line(String),
    /// Bar of a share from 0 to 1.
    Bar(f64),
    /// Bars of errors before and after, relative to the largest, with a mark at the noise.
    Errors {
        /// Width of the bar of the error before, from 0 to 1; `None` for a single bar.
        before: Option<f64>,
        /// Width of the bar of the error after.
        after: f64,
        /// Position of the mark.
        noise: f64,
    },
    /// Sample of the colour of such a bar: true for the error after.
    Swatch(bool),
}

impl Part {
    /// Creates a plain text.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// Returns the text without its emphasis; empty for a drawing.
    pub fn plain(&self) -> String {
        match self {
            Self::Text(text) | Self::Strong(text) | Self::Quiet(text) | Self::Toned(_, text) => text.replace('`', ""),
            Self::Code(text) => text.clone(),
            Self::Small(text) => format!(" {text}"),
            Self::Line(text) => format!("{text} "),
            Self::Bar(_) | Self::Errors { .. } | Self::Swatch(_) => String::new(),
        }
    }
}
