//! Sections of a report: headings, sentences, tables and plots in their order.

use crate::figures::Group;
use crate::table::Table;

pub use crate::text::{Part, Tone};

/// Verdict on a result: one to three sentences.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Verdict {
    /// Judgement.
    pub tone: Tone,
    /// Sentences; names are in backticks.
    pub text: String,
}

impl Verdict {
    /// Creates a verdict.
    pub fn new(tone: Tone, text: impl Into<String>) -> Self {
        Self { tone, text: text.into() }
    }
}

/// Part of a report with a title.
#[derive(Debug, Clone)]
pub struct Section {
    /// Title.
    pub title: String,
    /// Content, in its order.
    pub blocks: Vec<Block>,
}

impl Section {
    /// Creates a section.
    pub fn new(title: impl Into<String>, blocks: impl IntoIterator<Item = Block>) -> Self {
        Self { title: title.into(), blocks: blocks.into_iter().collect() }
    }

    /// Returns the groups of plots.
    pub fn groups(&self) -> impl Iterator<Item = &Group> {
        self.blocks.iter().filter_map(|block| if let Block::Plots(group) = block { Some(group) } else { None })
    }
}

/// Piece of a section. In texts, names are in backticks.
#[derive(Debug, Clone)]
pub enum Block {
    /// Heading below the title.
    Heading(String),
    /// Explanation.
    Paragraph(Vec<Part>),
    /// Findings, one sentence each.
    Findings(Vec<String>),
    /// Table.
    Table(Table),
    /// Plots.
    Plots(Group),
    /// Something found, with its formula.
    Card(Card),
    /// Content that a page shows on request: its summary, and the content.
    Folded(String, Vec<Self>),
    /// Lines without a blank line between them.
    Lines(Vec<String>),
}

impl Block {
    /// Creates a paragraph of plain text.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Paragraph(vec![Part::text(text)])
    }
}

/// Something found: a heading, a formula and what is known of it.
#[derive(Debug, Clone, Default)]
pub struct Card {
    /// Heading.
    pub title: String,
    /// Remark below the heading; may be empty.
    pub remark: String,
    /// Formula.
    pub formula: String,
    /// What is known, in list items.
    pub items: Vec<Vec<Part>>,
}
