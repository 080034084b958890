//! Tables: columns of text and numbers, rows of cells.

use crate::text::{Part, Tone};

/// Table with a header.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// Name, for screen readers.
    pub name: String,
    /// Columns.
    pub columns: Vec<Column>,
    /// Rows.
    pub rows: Vec<Row>,
    /// Number of cells at the start of each row that are its heading.
    pub headings: usize,
    /// True if the rows are the points of a Pareto front, which a page lets select.
    pub are_points: bool,
}

/// Row of a table.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Row {
    /// A cell for every column, or cells over several columns.
    pub cells: Vec<Cell>,
    /// True for a row to be noticed.
    pub is_marked: bool,
}

impl From<Vec<Cell>> for Row {
    fn from(cells: Vec<Cell>) -> Self {
        Self { cells, is_marked: false }
    }
}

/// Column of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Title; may be empty.
    pub title: String,
    /// True for numbers, which are aligned to the right.
    pub is_number: bool,
}

/// Returns a column of text.
pub fn text(title: impl Into<String>) -> Column {
    Column { title: title.into(), is_number: false }
}

/// Returns a column of numbers.
pub fn numbers(title: impl Into<String>) -> Column {
    Column { title: title.into(), is_number: true }
}

/// Cell of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Content.
    pub parts: Vec<Part>,
    /// Value by which rows are sorted; the text if `None`.
    pub value: Option<f64>,
    /// Background: its tone, and its strength from 0 to 1.
    pub shade: Option<(Tone, f64)>,
    /// True for a cell of little weight.
    pub is_quiet: bool,
    /// Number of columns.
    pub width: usize,
}

impl Default for Cell {
    fn default() -> Self {
        Self { parts: Vec::new(), value: None, shade: None, is_quiet: false, width: 1 }
    }
}

impl Cell {
    /// Creates a cell.
    pub fn new(parts: impl IntoIterator<Item = Part>) -> Self {
        Self { parts: parts.into_iter().collect(), ..Self::default() }
    }

    /// Creates an emphasised cell.
    pub fn strong(text: impl Into<String>) -> Self {
        Self::new([Part::Strong(text.into())])
    }

    /// Creates a cell with a remark on its text.
    pub fn with_remark(text: impl Into<String>, remark: impl Into<String>) -> Self {
        Self::new([Part::text(text), Part::Small(remark.into())])
    }

    /// Creates a judged cell.
    pub fn toned(tone: Tone, text: impl Into<String>) -> Self {
        Self::new([Part::Toned(tone, text.into())])
    }

    /// Sets the value by which rows are sorted.
    #[must_use]
    pub fn sorted_by(mut self, value: f64) -> Self {
        self.value = Some(value);
        self
    }

    /// Makes the cell span columns.
    #[must_use]
    pub fn over(mut self, columns: usize) -> Self {
        self.width = columns;
        self
    }

    /// Returns the text.
    pub fn plain(&self) -> String {
        self.parts.iter().map(Part::plain).collect()
    }
}

impl<T: Into<String>> From<T> for Cell {
    fn from(text: T) -> Self {
        let text = text.into();
        Self { parts: if text.is_empty() { Vec::new() } else { vec![Part::Text(text)] }, ..Self::default() }
    }
}

impl Table {
    /// Creates a table without rows, whose first column is the heading of each row.
    pub fn new(name: impl Into<String>, columns: impl IntoIterator<Item = Column>) -> Self {
        Self { name: name.into(), columns: columns.into_iter().collect(), headings: 1, ..Self::default() }
    }

    /// Adds rows.
    #[must_use]
    pub fn rows<R: Into<Row>>(mut self, rows: impl IntoIterator<Item = R>) -> Self {
        self.rows.extend(rows.into_iter().map(Into::into));
        self
    }
}
