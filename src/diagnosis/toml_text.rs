//! Edits of a TOML text that leave all else as it is: comments, order, spaces.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A TOML text that can be edited. It must be right: what is edited was read before.
pub(super) struct TomlText(String);

/// How a table is written down.
enum Form {
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
struct Entry {
    path: Vec<String>,
    key: Range<usize>,
    form: Form,
    empty: bool,
}

impl TomlText {
    pub(super) fn new(text: &str) -> Self {
        let mut text = text.to_owned();
        if !text.is_empty() && !text.ends_with('\n') {
            text.push('\n');
        }
        Self(text)
    }

    pub(super) fn into_text(self) -> String {
        self.0
    }

    /// Every entry, in the order of the text within its table.
    fn entries(&self) -> Vec<Entry> {
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
        let table = DeTable::parse(&self.0).expect("a study that was read is right TOML, and every edit keeps it so");
        let mut all = Vec::new();
        walk(&self.0, table.get_ref(), &[], &mut all);
        all
    }

    /// Every value with the keys that lead to it; tables in braces count by what is in them.
    pub(super) fn values(&self) -> Vec<(Vec<String>, String)> {
        let value = |entry: Entry| match entry.form {
            Form::Value(span) => Some((entry.path, self.0[span].to_owned())),
            Form::Inline(span) if entry.empty => Some((entry.path, self.0[span].to_owned())),
            _ => None,
        };
        self.entries().into_iter().filter_map(value).collect()
    }

    /// Puts a comment above all else.
    pub(super) fn head(&mut self, comment: &str) {
        let lines: String = comment.lines().map(|line| format!("# {line}\n")).collect();
        self.0.insert_str(0, &format!("{lines}\n"));
    }

    /// Whether something stands there.
    pub(super) fn has(&self, path: &[&str]) -> bool {
        self.entries().iter().any(|entry| entry.path == path)
    }

    /// The keys of a table, in the order of the text.
    pub(super) fn keys(&self, path: &[&str]) -> Vec<String> {
        let path = owned(path);
        let below = |entry: Entry| match entry.path.strip_prefix(path.as_slice()) {
            Some([key]) => Some(key.clone()),
            _ => None,
        };
        self.entries().into_iter().filter_map(below).collect()
    }

    /// The text of a value, or of a table in braces.
    pub(super) fn get(&self, path: &[&str]) -> Option<&str> {
        match self.entries().into_iter().find(|entry| entry.path == path)?.form {
            Form::Value(span) | Form::Inline(span) => Some(&self.0[span]),
            Form::Header(_) | Form::Implied => None,
        }
    }

    /// What a value that is a text says.
    pub(super) fn words(&self, path: &[&str]) -> Option<String> {
        let value = format!("v = {}", self.get(path)?);
        let table = DeTable::parse(&value).ok()?;
        table.get_ref().get("v")?.get_ref().as_str().map(str::to_owned)
    }

    /// Puts `value`, written as TOML, under these keys: instead of the value that is there, or where it belongs.
    pub(super) fn set(&mut self, path: &[&str], value: &str) {
        let entries = self.entries();
        let at = |path: &[&str]| entries.iter().find(|entry| entry.path == path);
        if let Some(Form::Value(span) | Form::Inline(span)) = at(path).map(|entry| &entry.form) {
            self.0.replace_range(span.clone(), value);
            return;
        }
        for depth in (1..path.len()).rev() {
            let (above, below) = path.split_at(depth);
            let Some(entry) = at(above) else { continue };
            let last = last_line(&entries, above);
            match &entry.form {
                Form::Value(_) => break,
                Form::Inline(span) => {
                    let comma = if entry.empty { " " } else { ", " };
                    let inside = self.0[..span.end - 1].trim_end_matches([' ', '\t', '\n', ',']).len();
                    let text = format!("{comma}{} = {value} ", keys(below));
                    self.0.replace_range(inside..span.end - 1, &text);
                    return;
                }
                Form::Header(header) => {
                    let after = self.end_of_line(own_end(&entries, header));
                    self.0.insert_str(after, &format!("{} = {value}\n", keys(below)));
                    return;
                }
                // Written with dots in the table above: so is the new one. Else a table of its own follows the last one.
                Form::Implied
                    if entries
                        .iter()
                        .any(|e| matches!(&e.form, Form::Inline(span) if span.contains(&entry.key.start))) => {}
                Form::Implied => {
                    let header =
                        entries.iter().filter_map(|e| header_of(e, entry.key.start)).max_by_key(|(_, h)| h.start);
                    let has_headers =
                        entries.iter().any(|e| e.path.starts_with(&owned(above)) && matches!(e.form, Form::Header(_)));
                    let after = self.end_of_line(last);
                    let (start, line) = if has_headers {
                        let (table, key) = path.split_at(path.len() - 1);
                        (after, format!("\n[{}]\n{} = {value}\n", keys(table), keys(key)))
                    } else {
                        let known = header.map_or(0, |(path, _)| path.len());
                        (after, format!("{} = {value}\n", keys(&path[known..])))
                    };
                    self.0.insert_str(start, &line);
                    return;
                }
            }
        }
        let (table, key) = path.split_at(path.len() - 1);
        self.0.push_str(&format!("\n[{}]\n{} = {value}\n", keys(table), keys(key)));
    }

    /// Takes an entry away: within braces it is cut out, elsewhere its lines become comments.
    pub(super) fn remove(&mut self, path: &[&str], why: &str) {
        let entries = self.entries();
        let path = owned(path);
        let Some(entry) = entries.iter().find(|entry| entry.path == path) else { return };
        let within = |e: &&Entry| matches!(&e.form, Form::Inline(span) if span.contains(&entry.key.start));
        if entries.iter().filter(|e| e.path.len() < path.len()).find(within).is_some() {
            let (Form::Value(span) | Form::Inline(span)) = &entry.form else { return };
            let (mut start, mut end) = (entry.key.start, span.end);
            let rest = self.0[end..].len() - self.0[end..].trim_start().trim_start_matches(',').trim_start().len();
            if self.0[end..end + rest].contains(',') {
                end += rest;
            } else {
                start = self.0[..start].trim_end().trim_end_matches(',').trim_end().len();
            }
            self.0.replace_range(start..end, "");
            return;
        }
        let of_it = entries.iter().filter(|e| e.path.starts_with(&path));
        let spans = of_it.filter_map(|e| match &e.form {
            Form::Header(span) => Some(span.clone()),
            Form::Value(span) | Form::Inline(span) => Some(e.key.start.min(span.start)..span.end),
            Form::Implied => None,
        });
        let mut starts: Vec<usize> = Vec::new();
        for span in spans {
            let first = self.0[..span.start].rfind('\n').map_or(0, |at| at + 1);
            starts.push(first);
            starts.extend(self.0[first..span.end].match_indices('\n').map(|(at, _)| first + at + 1));
        }
        starts.sort_unstable();
        starts.dedup();
        for (i, &start) in starts.iter().enumerate().rev() {
            self.0.insert_str(start, "# ");
            if i == 0 {
                self.0.insert_str(start, &format!("# {why}\n"));
            }
        }
    }

    /// The start of the line after a place.
    fn end_of_line(&self, at: usize) -> usize {
        self.0[at..].find('\n').map_or(self.0.len(), |end| at + end + 1)
    }
}

fn owned(path: &[&str]) -> Vec<String> {
    path.iter().map(|&key| key.to_owned()).collect()
}

/// The header that a place stands under, if this entry is one before it.
fn header_of(entry: &Entry, place: usize) -> Option<(&Vec<String>, &Range<usize>)> {
    match &entry.form {
        Form::Header(span) if span.end <= place => Some((&entry.path, span)),
        _ => None,
    }
}

/// Where the last thing below a path ends.
fn last_line(entries: &[Entry], path: &[&str]) -> usize {
    let below = entries.iter().filter(|entry| entry.path.starts_with(&owned(path)));
    let end = |entry: &Entry| match &entry.form {
        Form::Header(span) | Form::Inline(span) | Form::Value(span) => span.end,
        Form::Implied => entry.key.end,
    };
    below.map(end).max().unwrap_or(0)
}

/// Where the last entry that stands right under a header ends, or the header itself.
fn own_end(entries: &[Entry], header: &Range<usize>) -> usize {
    let headers = entries.iter().filter_map(|e| if let Form::Header(span) = &e.form { Some(span.start) } else { None });
    let next = headers.filter(|&start| start > header.start).min().unwrap_or(usize::MAX);
    let own = entries.iter().filter_map(|e| match &e.form {
        Form::Inline(span) | Form::Value(span) if span.start > header.start && span.start < next => Some(span.end),
        _ => None,
    });
    own.max().unwrap_or(header.end)
}

/// Keys with dots between them, in quotes where they need some.
fn keys(path: &[&str]) -> String {
    path.iter().map(|key| self::key(key)).collect::<Vec<_>>().join(".")
}

/// A key, in quotes if it needs some.
pub(super) fn key(key: &str) -> String {
    let bare = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if bare { key.to_owned() } else { quoted(key) }
}

/// A text as TOML writes it.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A number as TOML writes it.
pub(super) fn number(value: f64) -> String {
    format!("{value:?}")
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\
# A swing.
[study]
name = \"swing\" # short

[models.rig.furuta]
tolerance = 1e-9

[tuners]
b  = { start = 2e-3, min = 5e-4 }   # inertia
bp.start = 1e-5
bp.min = 0.0

[tuners.d]
start = 1.0
values = [
  1.0,
  2.0,
]

[experiments.swing]
file = 'swing.csv'
";

    fn edited(edit: impl FnOnce(&mut TomlText)) -> String {
        let mut text = TomlText::new(TEXT);
        edit(&mut text);
        let read: toml::Table = toml::from_str(&text.0).unwrap_or_else(|e| panic!("{e}\n{}", text.0));
        assert!(read.contains_key("study"));
        text.0
    }

    #[test]
    fn a_value_is_replaced_where_it_stands_and_its_comment_stays() {
        assert_eq!(edited(|t| t.set(&["study", "name"], "\"x\"")), TEXT.replace("\"swing\" #", "\"x\" #"));
        let started = edited(|t| t.set(&["tuners", "b", "start"], "7.0"));
        assert_eq!(started, TEXT.replace("start = 2e-3", "start = 7.0"));
    }

    #[test]
    fn a_new_value_goes_where_its_table_is_whatever_its_form() {
        let cases: [(&[&str], &str, &str); 6] = [
            (&["tuners", "b", "max"], "min = 5e-4 }", "min = 5e-4, max = 1 }"),
            (&["tuners", "bp", "max"], "bp.min = 0.0\n", "bp.min = 0.0\nbp.max = 1\n"),
            (&["tuners", "d", "min"], "  2.0,\n]\n", "  2.0,\n]\nmin = 1\n"),
            (&["tuners", "arm.c"], "bp.min = 0.0\n", "bp.min = 0.0\n\"arm.c\" = 1\n"),
            (&["models", "rig", "effects", "arm"], "1e-9\n", "1e-9\n\n[models.rig.effects]\narm = 1\n"),
            (&["criteria", "phi"], "'swing.csv'\n", "'swing.csv'\n\n[criteria]\nphi = 1\n"),
        ];
        for (path, from, to) in cases {
            assert_eq!(edited(|t| t.set(path, "1")), TEXT.replace(from, to), "{path:?}");
        }
        let twice = edited(|t| {
            t.set(&["models", "rig", "effects", "arm"], "{}");
            t.set(&["models", "rig", "effects", "pendulum"], "{}");
            t.set(&["models", "rig", "effects", "arm", "at"], "1");
        });
        let dotted = edited(|t| {
            t.set(&["tuners", "b", "x", "y"], "1");
            t.set(&["tuners", "b", "x", "z"], "2");
        });
        assert!(dotted.contains("min = 5e-4, x.y = 1, x.z = 2 }"), "{dotted}");
        assert!(twice.contains("[models.rig.effects]\narm = { at = 1 }\npendulum = {}\n"), "{twice}");
    }

    #[test]
    fn what_is_removed_becomes_a_comment_that_says_why() {
        assert_eq!(
            edited(|t| t.remove(&["tuners", "b"], "not needed")),
            TEXT.replace("b  = {", "# not needed\n# b  = {")
        );
        assert_eq!(
            edited(|t| t.remove(&["tuners", "bp"], "gone")),
            TEXT.replace("bp.start", "# gone\n# bp.start").replace("bp.min", "# bp.min")
        );
        let section = edited(|t| t.remove(&["tuners", "d"], "gone"));
        assert!(
            section.contains("# gone\n# [tuners.d]\n# start = 1.0\n# values = [\n#   1.0,\n#   2.0,\n# ]\n"),
            "{section}"
        );
        assert_eq!(edited(|t| t.remove(&["tuners", "b", "min"], "")), TEXT.replace(", min = 5e-4", ""));
        assert_eq!(edited(|t| t.remove(&["tuners", "b", "start"], "")), TEXT.replace("start = 2e-3, ", ""));
    }

    #[test]
    fn keys_and_texts_are_quoted_where_they_must_be() {
        assert_eq!([key("arm"), key("arm.torque"), key("")], ["arm", "\"arm.torque\"", "\"\""]);
        let text = TomlText::new(TEXT);
        assert_eq!(text.words(&["experiments", "swing", "file"]).as_deref(), Some("swing.csv"));
        assert_eq!(text.keys(&["tuners"]), ["b", "bp", "d"]);
    }
}
