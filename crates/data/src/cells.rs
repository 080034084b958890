//! Cells of a line of text: separators, quotes and numbers.

use std::ops::Range;
use std::sync::Arc;

use mops_language::{Diagnostic, Source};

use super::stamps::is_stamp;

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

/// Returns the start of the first line that is neither blank nor a `#` comment.
pub(super) fn first_line(text: &str) -> Option<usize> {
    let mut start = 0;
    for line in text.split_inclusive(['\n', '\r']) {
        if !line.trim().is_empty() && !line.starts_with('#') {
            return Some(start);
        }
        start += line.len();
    }
    None
}

/// Returns the separator: a semicolon if the line contains one, else a tab, else a comma, else a blank if the next line
/// has as many cells between blanks.
pub(super) fn separator(text: &str, start: usize) -> u8 {
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
        count(next, BLANK) == by_blanks && row.all(|cell| is_value(&text[cell], BLANK))
    });
    if by_blanks > 1 && is_table { BLANK } else { b',' }
}

/// Separator of cells between blanks; any number of them counts as one.
pub(super) const BLANK: u8 = b' ';

/// Refuses a cell whose quotation mark is unclosed, or closed after further rows, because the enclosed rows would be
/// lost silently. Multi-line text is accepted.
pub(super) fn refuse_long_quotes(source: &Arc<Source>, start: usize, separator: u8) -> Result<(), Diagnostic> {
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

/// Returns the number in a cell, NaN for a gap, or `None` for text.
pub(super) fn number(cell: &[u8], separator: u8) -> Option<f64> {
    let cell = str::from_utf8(cell.trim_ascii()).ok()?;
    match cell {
        "" | "NA" => Some(f64::NAN),
        _ if separator != b',' && cell.contains(',') => cell.replace(',', ".").parse().ok(),
        _ => cell.parse().ok(),
    }
}

/// Returns true for a gap.
pub(super) fn is_gap(cell: &str) -> bool {
    number(cell.as_bytes(), b',').is_some_and(f64::is_nan)
}

/// Returns true for a number, a time stamp or a gap.
pub(super) fn is_value(cell: &str, separator: u8) -> bool {
    number(cell.as_bytes(), separator).is_some() || is_stamp(cell)
}

/// Returns the cells of the row that starts at `start`, with their quotes.
pub(super) fn cells(text: &str, start: usize, separator: u8) -> impl Iterator<Item = Range<usize>> {
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

/// Returns the cell between blanks that starts at `begin` or later in a line, and where the next one starts. A unit in
/// brackets belongs to the cell before it.
pub(super) fn cell_between_blanks(bytes: &[u8], begin: usize) -> (Range<usize>, Option<usize>) {
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

/// Returns true for a date such as `12.03.2026`: three groups of digits between points, none of them three digits long
/// as those of thousands are.
pub(super) fn is_dotted_date(cell: &[u8]) -> bool {
    let text = cell.trim_ascii();
    let text = text.strip_prefix(b"\"").and_then(|text| text.strip_suffix(b"\"")).unwrap_or(text);
    let groups: Vec<&[u8]> = text.split(|byte| *byte == b'.').collect();
    let is_group = |group: &&[u8]| matches!(group.len(), 1 | 2 | 4) && group.iter().all(u8::is_ascii_digit);
    groups.len() == 3 && groups.iter().all(is_group)
}

pub(super) fn shortened(cell: &str) -> String {
    let cell = cell.trim();
    match cell.char_indices().nth(30) {
        Some((end, _)) => format!("{}...", &cell[..end]),
        None => cell.to_owned(),
    }
}
