//! CSV reader: a header with names and units, and rows of numbers.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use csv::{ByteRecord, ReaderBuilder};
use mops_language::{Diagnostic, Source};

use super::Variable;
use super::cells::{BLANK, cells, first_line, is_dotted_date, is_gap, number, refuse_long_quotes, shortened};
use super::header::{Header, is_date, is_time, later_headers};
use super::stamps::{self, Origin, Reference, is_basic, is_like_date, is_stamp};

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

/// Content of a CSV file.
pub(super) struct Content {
    pub variables: Vec<Variable>,
    /// Skipped columns, as `name: reason`.
    pub skipped: Vec<String>,
    pub layout: Layout,
    /// Lines before the header, which are not read.
    pub before: Range<usize>,
}

/// Reads every column that contains numbers or only gaps. If the first line is no header of a table, a later one may
/// be.
///
/// # Errors
/// If there is no header, no row or no column of numbers, or if a name is repeated. If a row has a different number of
/// cells than the header. If a column mixes numbers and text, or contains an infinite number.
pub(super) fn read(source: &Arc<Source>) -> Result<Content, Diagnostic> {
    let first = first_line(&source.text).ok_or_else(|| {
        Diagnostic::new("the data file is empty")
            .with_help("write a header such as `t[s],u[N*m]` and rows of numbers below it")
            .at(source, 0..0)
    })?;
    read_from(source, first).or_else(|mistake| {
        let mut later = later_headers(&source.text, first).into_iter();
        let found = later.find_map(|start| Some(Content { before: first..start, ..read_from(source, start).ok()? }));
        found.ok_or(mistake)
    })
}

/// Reads the table whose header starts at a byte.
fn read_from(source: &Arc<Source>, start: usize) -> Result<Content, Diagnostic> {
    let header = Header::read(source, start)?;
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
    let cell_at = |cell: usize, row: usize| layout.cell(&source.text, cell, row).map_or("", |span| &source.text[span]);
    let (stamps, mut skipped) = read_stamps(&columns, &header.names, cell_at);
    skipped.sort();
    let mut variables = Vec::new();
    for (cell, (column, (name, unit))) in columns.into_iter().zip(&header.names).enumerate() {
        let (name, rows) = (name.clone(), column.values.len());
        if let Some((_, column)) = stamps.iter().find(|(known, _)| *known == cell) {
            let (values, origin) = since_first(column);
            let unit = Some("s".to_owned());
            layout.cells.push(cell);
            variables.push(Variable { name, unit, rows, columns: 1, values, origin });
        } else if skipped.iter().any(|(known, _)| *known == cell) {
        } else if cell + 1 == header.names.len() && header.ends_unnamed(source) && !column.has_numbers {
            // A separator at the end of the header starts no column.
        } else {
            layout.cells.push(cell);
            variables.push(Variable {
                name,
                unit: unit.clone(),
                rows,
                columns: 1,
                values: column.values,
                origin: None,
            });
        }
    }
    let skipped = skipped.into_iter().map(|(cell, reason)| format!("{}: {reason}", header.names[cell].0)).collect();
    if variables.is_empty() {
        return Err(Diagnostic::new("no column of the file contains numbers")
            .with_help("separate the cells by commas, semicolons, tabs or blanks")
            .at(source, header.span));
    }
    Ok(Content { variables, skipped, layout, before: start..start })
}

/// Columns of time stamps, by index.
type Stamped = Vec<(usize, stamps::Column)>;

/// Skipped columns, by index, with the reason.
type Skipped = Vec<(usize, String)>;

/// Reads the columns of time stamps. Returns them, and the columns of text with the reason why they are skipped.
fn read_stamps<'t>(
    columns: &[Reading],
    names: &[(String, Option<String>)],
    cell_at: impl Fn(usize, usize) -> &'t str,
) -> (Stamped, Skipped) {
    let (mut stamps, mut skipped) = (Vec::new(), Vec::new());
    for (cell, column) in columns.iter().enumerate() {
        let (name, unit) = &names[cell];
        match column.stamps(|row| cell_at(cell, row), name, unit.as_deref()) {
            Some(Ok(column)) => stamps.push((cell, column)),
            Some(Err(reason)) => skipped.push((cell, reason)),
            None => {
                let unread = |row: &usize| !is_gap(cell_at(cell, *row)) && !is_stamp(cell_at(cell, *row));
                if let Some(first) = column.bad {
                    let row = (first..column.values.len()).find(unread).unwrap_or(first);
                    skipped.push((cell, format!("text (`{}`)", shortened(cell_at(cell, row)))));
                }
            }
        }
    }
    // Columns of dates that are not read, or read as numbers.
    let is_unread_date = |(cell, column): &(usize, &Reading)| {
        let is_read = stamps.iter().any(|(known, _)| known == cell);
        let given = || (0..column.values.len()).map(|row| cell_at(*cell, row)).filter(|text| !is_gap(text));
        let differs = || given().next().is_some_and(|first| given().any(|text| text != first));
        !is_read && ((column.bad.is_some() && given().any(is_like_date)) || (is_date(&names[*cell].0) && differs()))
    };
    let unread: Vec<usize> = columns.iter().enumerate().filter(is_unread_date).map(|(cell, _)| cell).collect();
    join(&mut stamps, &mut skipped, names, &unread);
    (stamps, skipped)
}

/// Adds the dates of one column to the times of day of all others. Times of day are skipped if their dates are not read
/// or may be in several columns, and so are dates without a time beside times that are not read: either would merge
/// different instants.
fn join(stamps: &mut Stamped, skipped: &mut Skipped, names: &[(String, Option<String>)], unread: &[usize]) {
    let name = |cell: usize| names[cell].0.as_str();
    let is_midnight = |column: &stamps::Column| column.reference == Some(Reference::Midnight);
    let is_dates = |column: &stamps::Column| column.is_dates && column.reference == Some(Reference::Local);
    let refuse = |stamps: &mut Stamped, skipped: &mut Skipped, reason: &str| {
        let refused = stamps.extract_if(.., |(_, column)| is_midnight(column) || is_dates(column));
        skipped.extend(refused.map(|(cell, _)| (cell, reason.to_owned())));
    };
    let times: Vec<usize> = stamps.iter().filter(|(_, column)| is_midnight(column)).map(|(cell, _)| *cell).collect();
    let read = stamps.iter().filter(|(_, column)| is_dates(column)).map(|(cell, _)| *cell);
    let mut dates: Vec<usize> = read.chain(unread.iter().copied()).collect();
    if dates.iter().any(|cell| is_date(name(*cell))) {
        dates.retain(|cell| is_date(name(*cell)));
    }
    if times.is_empty() {
        let unread_time = skipped.iter().find(|(cell, _)| is_time(name(*cell)));
        if let Some((cell, reason)) = unread_time.cloned() {
            refuse(stamps, skipped, &format!("the times of its days, in `{}`, are not read: {reason}", name(cell)));
        }
        return;
    }
    match dates[..] {
        [] => {}
        [date] if unread.contains(&date) => {
            let known = skipped.iter().find(|(cell, _)| *cell == date);
            let why = known.map_or("numbers", |(_, reason)| reason);
            let way_out = "write them as year-month-day, or delete the column if it has no dates";
            let way_out = if why.contains(';') { String::new() } else { format!("; {way_out}") };
            refuse(stamps, skipped, &format!("its dates, in `{}`, are not read: {why}{way_out}", name(date)));
        }
        [date] => {
            let at = stamps.iter().position(|(cell, _)| *cell == date).expect("the dates are read");
            let (_, dates) = stamps.remove(at);
            for (_, column) in stamps.iter_mut().filter(|(_, column)| is_midnight(column)) {
                for (time, date) in column.nanoseconds.iter_mut().zip(&dates.nanoseconds) {
                    *time = time.zip(*date).and_then(|(time, date)| time.checked_add(date));
                }
                column.reference = Some(Reference::Local);
            }
            let of_times: Vec<String> = times.iter().map(|cell| format!("`{}`", name(*cell))).collect();
            skipped.push((date, format!("joined with {}", of_times.join(", "))));
        }
        _ => {
            let several: Vec<String> = dates.iter().map(|cell| format!("`{}`", name(*cell))).collect();
            let several = several.join(", ");
            refuse(stamps, skipped, &format!("its dates may be in several columns ({several}); delete all but one"));
        }
    }
}

/// Returns the times of a column since its first one, s, and the first one; elapsed times are returned as they are.
fn since_first(column: &stamps::Column) -> (Vec<f64>, Option<Origin>) {
    let nanoseconds = column.nanoseconds.iter().flatten().next().copied().unwrap_or(0);
    let origin = column.reference.map(|reference| Origin { nanoseconds, reference });
    let zero = origin.map_or(0, |origin| origin.nanoseconds);
    #[allow(clippy::cast_precision_loss)]
    let value = |ns: &Option<i64>| ns.map_or(f64::NAN, |ns| (ns - zero) as f64 * 1e-9);
    (column.nanoseconds.iter().map(value).collect(), origin)
}

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

    /// Returns the time stamps of a column that has only these and gaps, as [`stamps::column`]. Stamps in digits only
    /// are numbers, too: the name of the column decides.
    fn stamps<'t>(
        &self,
        cell: impl Fn(usize) -> &'t str,
        name: &str,
        unit: Option<&str>,
    ) -> Option<Result<stamps::Column, String>> {
        let given = |row: usize| Some(cell(row)).filter(|text| !is_gap(text));
        let all = || (0..self.values.len()).map(given);
        let is_basic = |text: &str| {
            (is_date(name) && is_basic(text, false)) || ((is_date(name) || is_time(name)) && is_basic(text, true))
        };
        let is_stamped = match self.bad {
            Some(_) => !self.has_numbers,
            None => self.has_numbers && unit.is_none() && all().flatten().all(is_basic),
        };
        if is_stamped { stamps::column(all(), unit) } else { None }
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

/// Marks of thousands in the numbers of a column, as in `993` and `1.535`: some numbers have marks, each followed by
/// three digits.
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
        if is_dotted_date(cell) {
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
