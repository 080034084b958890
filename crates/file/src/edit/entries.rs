//! Entries of a TOML text with their positions.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::owned;

/// Form of an entry.
pub(super) enum Form {
    /// Table with a header `[a.b]`; byte range of the header.
    Header(Range<usize>),
    /// Inline table `{ ... }`; its byte range.
    Inline(Range<usize>),
    /// Table defined only by its entries: `a.b = 1`, or `[a.b]` for `a`.
    Implied,
    /// Value other than a table; its byte range.
    Value(Range<usize>),
}

/// Entry of the text: its keys, the position of its last key, its form.
pub(super) struct Entry {
    pub(super) path: Vec<String>,
    pub(super) key: Range<usize>,
    pub(super) form: Form,
    pub(super) empty: bool,
}

/// Returns all entries; those of a table are in the order of the text.
pub(super) fn entries(text: &str) -> Vec<Entry> {
    let table = DeTable::parse(text).expect("a study that was read is valid TOML, and every edit keeps it valid");
    let mut all = Vec::new();
    walk(text, table.get_ref(), &[], &mut all);
    all
}

fn walk(text: &str, table: &DeTable<'_>, path: &[String], all: &mut Vec<Entry>) {
    for (key, value) in table {
        let path = [path, &[key.get_ref().to_string()]].concat();
        let (form, below) = form(text, value);
        let empty = below.is_none_or(|below| below.is_empty());
        all.push(Entry { path: path.clone(), key: key.span(), form, empty });
        if let Some(below) = below {
            walk(text, below, &path, all);
        }
    }
}

fn form<'v, 't>(text: &str, value: &'v Spanned<DeValue<'t>>) -> (Form, Option<&'v DeTable<'t>>) {
    let span = value.span();
    match value.get_ref() {
        DeValue::Table(below) => match text.as_bytes().get(span.start) {
            Some(b'[') => (Form::Header(span), Some(below)),
            Some(b'{') => (Form::Inline(span), Some(below)),
            _ => (Form::Implied, Some(below)),
        },
        _ => (Form::Value(span), None),
    }
}

/// Returns the path and the header of an entry, if it is a header before the position.
pub(super) fn header_of(entry: &Entry, place: usize) -> Option<(&Vec<String>, &Range<usize>)> {
    match &entry.form {
        Form::Header(span) if span.end <= place => Some((&entry.path, span)),
        _ => None,
    }
}

/// Returns the end of the last entry below a path.
pub(super) fn last_line(entries: &[Entry], path: &[&str]) -> usize {
    let below = entries.iter().filter(|entry| entry.path.starts_with(&owned(path)));
    let end = |entry: &Entry| match &entry.form {
        Form::Header(span) | Form::Inline(span) | Form::Value(span) => span.end,
        Form::Implied => entry.key.end,
    };
    below.map(end).max().unwrap_or(0)
}

/// Returns the end of the last entry directly below a header, or the end of the header if there is none.
pub(super) fn own_end(entries: &[Entry], header: &Range<usize>) -> usize {
    let headers = entries.iter().filter_map(|e| if let Form::Header(span) = &e.form { Some(span.start) } else { None });
    let next = headers.filter(|&start| start > header.start).min().unwrap_or(usize::MAX);
    let own = entries.iter().filter_map(|e| match &e.form {
        Form::Inline(span) | Form::Value(span) if span.start > header.start && span.start < next => Some(span.end),
        _ => None,
    });
    own.max().unwrap_or(header.end)
}
