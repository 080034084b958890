//! CSV reader: a header with names and units, and rows of numbers.

use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use csv::{ByteRecord, ReaderBuilder};

use super::Variable;
use super::stamps::nanoseconds;
use crate::diagnostic::{Diagnostic, Source};
use crate::unit::Unit;

/// Positions of the cells in the text.
#[derive(Debug, Clone, Default)]
pub(super) struct Layout {
    separator: u8,
    /// First byte of each row.
    rows: Vec<usize>,
    /// Index of the cell in a row for each variable.
    cells: Vec<usize>,
}

impl Layout {
    /// Returns the byte range of the cell of `variable` in `row`.
    pub fn span(&self, text: &str, variable: usize, row: usize) -> Option<Range<usize>> {
        self.cell(text, *self.cells.get(variable)?, row)
    }

    fn cell(&self, text: &str, cell: usize, row: usize) -> Option<Range<usize>> {
        cells(text, *self.rows.get(row)?, self.separator).nth(cell)
    }
}

/// Reads every column that contains numbers or only gaps. Returns the variables, the skipped columns and the cell
/// positions.
///
/// # Errors
/// If there is no header, no row or no column of numbers, or if a name is repeated. If a row has a different number of
/// cells than the header. If a column mixes numbers and text, or contains an infinite number.
pub(super) fn read(source: &Arc<Source>) -> Result<(Vec<Variable>, Vec<String>, Layout), Diagnostic> {
    let header = Header::read(source)?;
    let mut layout = Layout { separator: header.separator, ..Layout::default() };
    let columns = read_rows(source, &header, &mut layout)?;
    let mistakes = columns.iter().enumerate().filter_map(|(cell, column)| Some((column.mistake()?, cell)));
    if let Some((row, cell)) = mistakes.min() {
        let span = layout.cell(&source.text, cell, row).expect("the row is in the layout");
        return Err(not_a_number(source, span, &header.names[cell].0));
    }
    if let Some((row, cell)) = columns.iter().enumerate().find_map(|(k, column)| Some((column.thousands.found()?, k))) {
        let span = layout.cell(&source.text, cell, row).expect("the row is in the layout");
        let fact = format!("`{}` is a thousand or a decimal number", source.text[span.clone()].trim());
        return Err(Diagnostic::new(fact)
            .with_label("every mark in this column is followed by three digits")
            .with_help("write thousands without a mark, or decimal numbers with a fixed number of digits")
            .at(source, span));
    }
    let (mut variables, mut skipped) = (Vec::new(), Vec::new());
    for (cell, (column, (name, unit))) in columns.into_iter().zip(&header.names).enumerate() {
        if let Some((values, origin)) = column.stamps(|row| layout.cell(&source.text, cell, row), &source.text) {
            layout.cells.push(cell);
            let (name, rows) = (name.clone(), values.len());
            variables.push(Variable {
                name,
                unit: Some("s".to_owned()),
                rows,
                columns: 1,
                values,
                origin: Some(origin),
            });
        } else if let Some(row) = column.bad {
            let span = layout.cell(&source.text, cell, row).expect("the row is in the layout");
            skipped.push(format!("{name}: text (`{}`)", shortened(&source.text[span])));
        } else if cell + 1 == header.names.len() && is_unnamed(&header, source) && !column.has_numbers {
            // A separator at the end of the header starts no column.
        } else {
            layout.cells.push(cell);
            let (name, unit, rows) = (name.clone(), unit.clone(), column.values.len());
            variables.push(Variable { name, unit, rows, columns: 1, values: column.values, origin: None });
        }
    }
    if variables.is_empty() {
        return Err(Diagnostic::new("no column of the file contains numbers")
            .with_help("separate the cells by commas, semicolons, tabs or blanks")
            .at(source, header.span));
    }
    Ok((variables, skipped, layout))
}

/// Returns true if the last cell of the header is empty.
fn is_unnamed(header: &Header, source: &Arc<Source>) -> bool {
    header.names.len() > 1 && source.text[header.span.clone()].ends_with(char::from(header.separator))
}

struct Header {
    separator: u8,
    /// Name and unit of each column.
    names: Vec<(String, Option<String>)>,
    span: Range<usize>,
    /// First byte of the rows.
    body: usize,
}

impl Header {
    fn read(source: &Arc<Source>) -> Result<Self, Diagnostic> {
        let text = &source.text;
        let start = first_line(text).ok_or_else(|| {
            Diagnostic::new("the data file is empty")
                .with_help("write a header such as `t[s],u[N*m]` and rows of numbers below it")
                .at(source, 0..0)
        })?;
        let separator = separator(text, start);
        let spans: Vec<_> = cells(text, start, separator).collect();
        let span = start..spans.last().expect("every line has a cell").end;
        // A line of numbers and time stamps is a row; the file has no header then.
        let number = |cell: &Range<usize>| {
            let cell = &text[cell.clone()];
            number(cell.as_bytes(), separator).or_else(|| nanoseconds(cell).map(|ns| ns as f64))
        };
        let numbers: Option<Vec<f64>> = spans.iter().map(number).collect();
        if numbers.is_some_and(|numbers| numbers.iter().any(|number| !number.is_nan())) {
            let names = (1..=spans.len()).map(|k| (k.to_string(), None)).collect();
            return Ok(Self { separator, names, span, body: start });
        }
        refuse_long_quotes(source, start, separator)?;
        let name = |(cell, k): (&Range<usize>, usize)| name_and_unit(&text[cell.clone()], k);
        let mut names: Vec<_> = spans.iter().zip(1..).map(name).collect();
        keep_labels_that_differ(&mut names);
        refuse_duplicates(source, &names, &spans)?;
        Ok(Self { separator, names, body: span.end, span })
    }
}

/// Returns the start of the first line that is neither blank nor a `#` comment.
fn first_line(text: &str) -> Option<usize> {
    let mut start = 0;
    for line in text.split_inclusive(['\n', '\r']) {
        if !line.trim().is_empty() && !line.starts_with('#') {
            return Some(start);
        }
        start += line.len();
    }
    None
}

/// Returns the separator: a semicolon if the line contains one, else a tab, else a comma, else a blank if the next line has as many
/// cells between blanks.
fn separator(text: &str, start: usize) -> u8 {
    let count = |start: usize, separator: u8| cells(text, start, separator).count();
    if let Some(separator) = [b';', b'\t', b','].into_iter().find(|&separator| count(start, separator) > 1) {
        return separator;
    }
    let next = text[start..].find(['\n', '\r']).and_then(|end| {
        let rest = &text[start + end..];
        first_line(rest).map(|line| start + end + line)
    });
    let by_blanks = count(start, BLANK);
    let is_table = next.is_some_and(|next| {
        let mut row = cells(text, next, BLANK);
        let is_value = |cell: &str| number(cell.as_bytes(), BLANK).is_some() || nanoseconds(cell).is_some();
        count(next, BLANK) == by_blanks && row.all(|cell| is_value(&text[cell]))
    });
    if by_blanks > 1 && is_table { BLANK } else { b',' }
}

/// Separator of cells between blanks; any number of them counts as one.
const BLANK: u8 = b' ';

/// Returns the text with a semicolon in place of the first blank between two cells, of the same length.
fn with_semicolons(text: &str) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    let mut start = 0;
    for line in text.split_inclusive(['\n', '\r']) {
        let ends: Vec<usize> = cells(text, start, BLANK).map(|cell| cell.end).collect();
        ends.iter().rev().skip(1).for_each(|&end| bytes[end] = b';');
        start += line.len();
    }
    bytes
}

/// Splits a label into name and unit: `u [N*m]`, or `u (N*m)` if the parentheses contain a unit.
pub(super) fn label(text: &str) -> Option<(&str, &str)> {
    let text = text.trim();
    let within = |open: char, close: char| {
        let (name, unit) = text.strip_suffix(close)?.rsplit_once(open)?;
        Some((name.trim(), unit.trim()))
    };
    // `trial (2)` and `motor (left)` have no unit.
    let is_unit = |text: &str| text.contains(|c: char| c.is_alphabetic() || c == '%') && Unit::parse(text).is_ok();
    within('[', ']').or_else(|| within('(', ')').filter(|(name, unit)| !name.is_empty() && is_unit(unit)))
}

/// Formats a label that [`label`] can read.
pub(super) fn labelled(name: &str, unit: &str) -> String {
    format!("{name} ({unit})")
}

/// Splits a cell of the header into name and unit; an unnamed column gets its number as name.
fn name_and_unit(cell: &str, k: usize) -> (String, Option<String>) {
    let cell = cell.trim();
    let unquoted = cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"'));
    let cell = unquoted.map_or(cell.to_owned(), |cell| cell.replace("\"\"", "\""));
    let (name, unit) = label(&cell).unwrap_or((&cell, ""));
    let (name, unit) = (name.trim(), unit.trim());
    let name = if name.is_empty() { k.to_string() } else { name.to_owned() };
    (name, (!unit.is_empty()).then(|| unit.to_owned()))
}

/// Uses the whole label as name for columns that differ only in their units, such as `motor (V)` and `motor (A)`.
fn keep_labels_that_differ(names: &mut [(String, Option<String>)]) {
    let differs = |(name, unit): &(String, Option<String>)| {
        let count = |unit: Option<&String>| {
            names
                .iter()
                .filter(|other| other.0 == *name && unit.is_none_or(|unit| other.1.as_ref() == Some(unit)))
                .count()
        };
        unit.is_some() && count(unit.as_ref()) < count(None)
    };
    let differs: Vec<bool> = names.iter().map(differs).collect();
    for ((name, unit), _) in names.iter_mut().zip(differs).filter(|(_, differs)| *differs) {
        *name = labelled(name, unit.as_deref().unwrap_or_default());
    }
}

fn refuse_duplicates(
    source: &Arc<Source>,
    names: &[(String, Option<String>)],
    spans: &[Range<usize>],
) -> Result<(), Diagnostic> {
    let mut seen = HashMap::new();
    for (k, (name, _)) in names.iter().enumerate() {
        if let Some(first) = seen.insert(name, k) {
            return Err(Diagnostic::new(format!("columns {} and {} have the same name `{name}`", first + 1, k + 1))
                .with_label("second column")
                .with_help("rename one of them in the header")
                .at(source, spans[k].clone()));
        }
    }
    Ok(())
}

/// Column during reading.
#[derive(Clone, Default)]
struct Reading {
    values: Vec<f64>,
    thousands: Thousands,
    /// First row with a cell that is not a finite number.
    bad: Option<usize>,
    has_numbers: bool,
}

impl Reading {
    fn push(&mut self, number: Option<f64>) {
        let row = self.values.len();
        self.values.push(number.unwrap_or(f64::NAN));
        self.has_numbers |= number.is_some_and(|number| !number.is_nan());
        if number.is_none_or(f64::is_infinite) {
            self.bad.get_or_insert(row);
        }
    }

    /// Returns the times of a column of time stamps, s from the first one on, and the first one, ns since 1970; `None` if a cell is
    /// no time stamp.
    fn stamps(&self, cell: impl Fn(usize) -> Option<Range<usize>>, text: &str) -> Option<(Vec<f64>, i64)> {
        let first = self.bad.filter(|_| !self.has_numbers)?;
        let stamp = |row: usize| nanoseconds(&text[cell(row)?]);
        let origin = stamp(first)?;
        let is_gap = |row: usize| cell(row).is_some_and(|span| number(text[span].as_bytes(), b';').is_some());
        #[allow(clippy::cast_precision_loss)]
        let value = |row: usize| match stamp(row) {
            Some(ns) => Some((ns - origin) as f64 * 1e-9),
            None => is_gap(row).then_some(f64::NAN),
        };
        let values: Option<Vec<f64>> = (0..self.values.len()).map(value).collect();
        values.map(|values| (values, origin))
    }

    /// Returns the first bad row of a column that contains numbers; a column of text only has none.
    fn mistake(&self) -> Option<usize> {
        self.bad.filter(|_| self.has_numbers)
    }
}

fn read_rows(source: &Arc<Source>, header: &Header, layout: &mut Layout) -> Result<Vec<Reading>, Diagnostic> {
    let text = &source.text;
    let mut columns = vec![Reading::default(); header.names.len()];
    let (bytes, delimiter) = match header.separator {
        BLANK => (Cow::from(with_semicolons(text)), b';'),
        separator => (Cow::from(text.as_bytes()), separator),
    };
    let mut reader =
        ReaderBuilder::new().has_headers(false).flexible(true).delimiter(delimiter).from_reader(&bytes[header.body..]);
    let mut record = ByteRecord::new();
    let mut marks = DecimalMarks::of(header.separator);
    while reader.read_byte_record(&mut record).expect("reading from memory does not fail") {
        let start = record.position().expect("the reader sets the position").byte() as usize + header.body;
        // N.B.: the position may be before line feeds that the reader skipped.
        let start = start + text[start..].len() - text[start..].trim_start_matches(['\n', '\r']).len();
        refuse_long_quotes(source, start, header.separator)?;
        if record.len() == 1 && columns.len() > 1 && record[0].trim_ascii().is_empty() {
            continue;
        }
        // A separator at the end of a row starts no cell.
        let ends_with_separator = record.len() == columns.len() + 1 && record[columns.len()].trim_ascii().is_empty();
        if record.len() != columns.len() && !ends_with_separator {
            return Err(uneven(source, start, record.len(), header));
        }
        if columns.len() == 1 {
            // The reader skips blank lines, but in a single column they are empty cells.
            let last = layout.rows.last().copied().unwrap_or(header.body);
            for blank in blank_lines(text, last..start) {
                layout.rows.push(blank);
                columns[0].push(Some(f64::NAN));
            }
        }
        layout.rows.push(start);
        for (k, (column, cell)) in columns.iter_mut().zip(&record).enumerate() {
            column.thousands.see(cell, layout.rows.len() - 1, header.separator);
            column.push(number(cell, header.separator));
            marks.refuse_both(source, cell, || layout.cell(text, k, layout.rows.len() - 1))?;
        }
    }
    if layout.rows.is_empty() {
        return Err(Diagnostic::new("the header has no rows below it")
            .with_help("add a row of numbers for each sample")
            .at(source, header.span.clone()));
    }
    Ok(columns)
}

/// Returns the starts of the blank lines within a range of bytes.
fn blank_lines(text: &str, between: Range<usize>) -> impl Iterator<Item = usize> {
    let ends = text[between.clone()].match_indices('\n').map(move |(end, _)| between.start + end + 1);
    let mut ends = ends.peekable();
    std::iter::from_fn(move || ends.next().filter(|_| ends.peek().is_some()))
}

/// Refuses a cell whose quotation mark is unclosed, or closed after further rows, because the enclosed rows would be
/// lost silently. Multi-line text is accepted.
fn refuse_long_quotes(source: &Arc<Source>, start: usize, separator: u8) -> Result<(), Diagnostic> {
    let text = &source.text;
    let row: Vec<Range<usize>> = cells(text, start, separator).collect();
    let Some(cell) = row.iter().find(|cell| text[(*cell).clone()].contains(['\n', '\r'])) else { return Ok(()) };
    let inside = &text[cell.clone()];
    let quotes = inside.bytes().filter(|&byte| byte == b'"').count();
    // Two stray marks in one column enclose as many separators as a row has.
    let swallows_a_row = inside.bytes().filter(|&byte| byte == separator).count() + 1 >= row.len();
    let fact = if quotes % 2 == 1 {
        "unclosed quotation mark"
    } else if swallows_a_row {
        "quotation mark closed in another row"
    } else {
        return Ok(());
    };
    let line = inside.find(['\n', '\r']).expect("the cell has a line break");
    Err(Diagnostic::new(fact)
        .with_label("opened here")
        .with_help("remove the quotation mark, or close it in the same line")
        .at(source, cell.start..cell.start + line))
}

/// Marks of thousands in the numbers of a column, as in `993` and `1.535`: some numbers have marks, each followed by three digits.
#[derive(Clone, Default)]
struct Thousands {
    /// Numbers with and without marks.
    marked: usize,
    plain: usize,
    /// First row with a mark.
    first: usize,
    /// True if a number cannot have marks of thousands.
    excluded: bool,
}

impl Thousands {
    fn see(&mut self, cell: &[u8], row: usize, separator: u8) {
        let text = cell.trim_ascii();
        let digits = text.strip_prefix(b"-").or_else(|| text.strip_prefix(b"+")).unwrap_or(text);
        if self.excluded || digits.is_empty() || digits.eq_ignore_ascii_case(b"nan") || digits == b"NA" {
            return;
        }
        let is_mark = |byte: &u8| *byte == b'.' || (*byte == b',' && separator != b',');
        let mut groups = digits.split(is_mark);
        let first = groups.next().unwrap_or_default();
        let rest: Vec<&[u8]> = groups.collect();
        let is_number = |group: &[u8]| !group.is_empty() && group.iter().all(u8::is_ascii_digit);
        let fits =
            is_number(first) && first.len() <= 3 && rest.iter().all(|group| group.len() == 3 && is_number(group));
        // A leading 0 is that of a decimal number.
        self.excluded = !fits || (!rest.is_empty() && first.starts_with(b"0"));
        if rest.is_empty() {
            self.plain += 1;
        } else {
            if self.marked == 0 {
                self.first = row;
            }
            self.marked += 1;
        }
    }

    /// Returns the first row with a mark if the column has marks of thousands.
    fn found(&self) -> Option<usize> {
        (!self.excluded && self.marked >= 2 && self.plain >= 2).then_some(self.first)
    }
}

/// Decimal marks of a file whose cells are not separated by commas, where `1,234` and `1.5` together are ambiguous.
struct DecimalMarks {
    /// True if numbers may contain a comma.
    with_commas: bool,
    point: bool,
    comma: bool,
}

impl DecimalMarks {
    fn of(separator: u8) -> Self {
        Self { with_commas: separator != b',', point: false, comma: false }
    }

    /// Refuses a number whose decimal mark differs from that of earlier numbers.
    fn refuse_both(
        &mut self,
        source: &Arc<Source>,
        cell: &[u8],
        span: impl FnOnce() -> Option<Range<usize>>,
    ) -> Result<(), Diagnostic> {
        if !self.with_commas || !cell.iter().all(|byte| b"0123456789+-.,eE \"".contains(byte)) {
            return Ok(());
        }
        self.point |= cell.contains(&b'.');
        self.comma |= cell.contains(&b',');
        if !(self.point && self.comma) {
            return Ok(());
        }
        Err(Diagnostic::new("decimal points and decimal commas are mixed")
            .with_help("use one decimal mark, and no thousands separators")
            .at(source, span().unwrap_or(0..0)))
    }
}

/// Returns the number in a cell, NaN for a gap, or `None` for text.
fn number(cell: &[u8], separator: u8) -> Option<f64> {
    let cell = str::from_utf8(cell.trim_ascii()).ok()?;
    match cell {
        "" | "NA" => Some(f64::NAN),
        _ if separator != b',' && cell.contains(',') => cell.replace(',', ".").parse().ok(),
        _ => cell.parse().ok(),
    }
}

/// Returns the cells of the row that starts at `start`, with their quotes.
fn cells(text: &str, start: usize, separator: u8) -> impl Iterator<Item = Range<usize>> {
    let bytes = text.as_bytes();
    let mut next = Some(start);
    std::iter::from_fn(move || {
        let begin = next?;
        if separator == BLANK {
            let (cell, after) = cell_between_blanks(bytes, begin);
            next = after;
            return Some(cell);
        }
        let mut quotes = Quotes::Before;
        let mut end = begin;
        while let Some(&byte) = bytes.get(end) {
            if quotes != Quotes::Inside && (byte == separator || byte == b'\n' || byte == b'\r') {
                break;
            }
            quotes = quotes.after(byte);
            end += 1;
        }
        next = (bytes.get(end) == Some(&separator)).then_some(end + 1);
        Some(begin..end)
    })
}

/// Returns the cell between blanks that starts at `begin` or later in a line, and where the next one starts. A unit in brackets belongs
/// to the cell before it.
fn cell_between_blanks(bytes: &[u8], begin: usize) -> (Range<usize>, Option<usize>) {
    let is_blank = |at: usize| bytes.get(at) == Some(&BLANK);
    let skip = |mut at: usize| {
        while is_blank(at) {
            at += 1;
        }
        at
    };
    let ends_line = |at: usize| matches!(bytes.get(at), None | Some(b'\n' | b'\r'));
    let start = skip(begin);
    let (mut end, mut bracket) = (start, None);
    while !ends_line(end) && (!is_blank(end) || bracket.is_some()) {
        match (bytes[end], bracket) {
            (b'[', None) => bracket = Some(b']'),
            (b'(', None) => bracket = Some(b')'),
            (byte, Some(closing)) if byte == closing => bracket = None,
            _ => {}
        }
        end += 1;
        let next = skip(end);
        if is_blank(end) && bracket.is_none() && matches!(bytes.get(next), Some(b'[' | b'(')) {
            end = next;
        }
    }
    let next = skip(end);
    (start..end, (!ends_line(next)).then_some(next))
}

/// Parser state within a cell: a quote opens the cell at its first byte only, and is doubled inside.
#[derive(Clone, Copy, PartialEq)]
enum Quotes {
    Before,
    Inside,
    JustClosed,
    Outside,
}

impl Quotes {
    fn after(self, byte: u8) -> Self {
        match (self, byte) {
            (Self::Before | Self::JustClosed, b'"') => Self::Inside,
            (Self::Inside, b'"') => Self::JustClosed,
            (Self::Inside, _) => Self::Inside,
            _ => Self::Outside,
        }
    }
}

fn not_a_number(source: &Arc<Source>, span: Range<usize>, name: &str) -> Diagnostic {
    let cell = &source.text[span.clone()];
    let finite = if cell.trim().parse().is_ok_and(f64::is_infinite) { "finite" } else { "a number" };
    Diagnostic::new(format!("`{}` in column `{name}` is not {finite}", shortened(cell)))
        .with_label(format!("not {finite}"))
        .with_help("write a number such as 1.5e-3; a gap is an empty cell, NaN or NA")
        .at(source, span)
}

fn uneven(source: &Arc<Source>, start: usize, count: usize, header: &Header) -> Diagnostic {
    let span = start..cells(&source.text, start, header.separator).last().map_or(start, |cell| cell.end);
    let columns = header.names.len();
    let help = match header.separator {
        b',' if count > columns => "write the same number of cells in every row; decimal commas need `;` as separator",
        _ => "write the same number of cells in every row, an empty one for a gap",
    };
    Diagnostic::new(format!("the row has {}, the first line has {columns}", plural(count)))
        .with_label(plural(count))
        .with_help(help)
        .at(source, span)
}

fn plural(count: usize) -> String {
    if count == 1 { "1 cell".to_owned() } else { format!("{count} cells") }
}

fn shortened(cell: &str) -> String {
    let cell = cell.trim();
    match cell.char_indices().nth(30) {
        Some((end, _)) => format!("{}...", &cell[..end]),
        None => cell.to_owned(),
    }
}
