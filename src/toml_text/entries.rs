//! What stands in a TOML text, and where.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::owned;

/// How a table is written down.
pub(super) enum Form {
    /// `[a.b]`; the bytes of the header.
    Header(Range<usize>),
    /// `{ ... }`; its bytes.
    Inline(Range<usize>),
    /// By what stands below it alone: `a.b = 1`, or `[a.b]` for `a`.
    Implied,
    /// No table: a value; its bytes.
    Value(Range<usize>),
}

/// What stands in the text: the keys that lead to it, the place of its last key, its form.
pub(super) struct Entry {
    pub(super) path: Vec<String>,
    pub(super) key: Range<usize>,
    pub(super) form: Form,
    pub(super) empty: bool,
}

/// Every entry, in the order of the text within its table.
pub(super) fn entries(text: &str) -> Vec<Entry> {
    let table = DeTable::parse(text).expect("a study that was read is right TOML, and every edit keeps it so");
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

/// The header that a place stands under, if this entry is one before it.
pub(super) fn header_of(entry: &Entry, place: usize) -> Option<(&Vec<String>, &Range<usize>)> {
    match &entry.form {
        Form::Header(span) if span.end <= place => Some((&entry.path, span)),
        _ => None,
    }
}

/// Where the last thing below a path ends.
pub(super) fn last_line(entries: &[Entry], path: &[&str]) -> usize {
    let below = entries.iter().filter(|entry| entry.path.starts_with(&owned(path)));
    let end = |entry: &Entry| match &entry.form {
        Form::Header(span) | Form::Inline(span) | Form::Value(span) => span.end,
        Form::Implied => entry.key.end,
    };
    below.map(end).max().unwrap_or(0)
}

/// Where the last entry that stands right under a header ends, or the header itself.
pub(super) fn own_end(entries: &[Entry], header: &Range<usize>) -> usize {
    let headers = entries.iter().filter_map(|e| if let Form::Header(span) = &e.form { Some(span.start) } else { None });
    let next = headers.filter(|&start| start > header.start).min().unwrap_or(usize::MAX);
    let own = entries.iter().filter_map(|e| match &e.form {
        Form::Inline(span) | Form::Value(span) if span.start > header.start && span.start < next => Some(span.end),
        _ => None,
    });
    own.max().unwrap_or(header.end)
}
