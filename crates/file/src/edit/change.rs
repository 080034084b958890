//! Insertion, replacement and removal of entries of a TOML text.

use mops_language::plain::line;

use super::entries::{Entry, Form, entries, header_of, last_line, own_end};
use super::{TomlText, keys, owned};

impl TomlText {
    /// Sets the entry at `path` to `value`, written as TOML. An existing value or table is replaced, a new entry is
    /// inserted where its table is.
    pub fn set(&mut self, path: &[&str], value: &str) {
        let mut entries = entries(&self.0);
        match entries.iter().find(|entry| entry.path == path).map(|entry| &entry.form) {
            Some(Form::Value(span) | Form::Inline(span)) => {
                self.0.replace_range(span.clone(), value);
                return;
            }
            Some(Form::Header(_) | Form::Implied) => {
                self.clear(path);
                entries = self::entries(&self.0);
            }
            None => {}
        }
        let at = |path: &[&str]| entries.iter().find(|entry| entry.path == path);
        for depth in (1..path.len()).rev() {
            let (above, below) = path.split_at(depth);
            let Some(entry) = at(above) else { continue };
            let last = last_line(&entries, above);
            match &entry.form {
                Form::Value(span) => {
                    self.0.replace_range(span.clone(), &format!("{{ {} = {value} }}", keys(below)));
                    return;
                }
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
                // The key is written with dots in the enclosing braces. Otherwise it follows the last entry of the
                // table, under a header of its own if the table has headers.
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
        if table.is_empty() {
            // Top-level keys are inserted before the first table.
            let headers =
                entries.iter().filter_map(|e| if let Form::Header(span) = &e.form { Some(span.start) } else { None });
            let first =
                headers.min().map_or(self.0.len(), |start| self.0[..start].rfind('\n').map_or(0, |end| end + 1));
            self.0.insert_str(first, &format!("{} = {value}\n", keys(key)));
        } else {
            self.0.push_str(&format!("\n[{}]\n{} = {value}\n", keys(table), keys(key)));
        }
    }

    /// Removes a table, whatever its form.
    fn clear(&mut self, path: &[&str]) {
        let path = owned(path);
        let below = |text: &Self| {
            let leaf = |entry: &Entry| matches!(entry.form, Form::Value(_) | Form::Inline(_));
            let below = entries(&text.0).into_iter().find(|entry| entry.path.starts_with(&path) && leaf(entry));
            below.map(|entry| entry.path)
        };
        while let Some(leaf) = below(self) {
            let before = self.0.clone();
            self.remove(&leaf.iter().map(String::as_str).collect::<Vec<_>>(), "replaced");
            assert!(self.0 != before, "an existing entry can be removed");
        }
        self.remove(&path.iter().map(String::as_str).collect::<Vec<_>>(), "replaced");
    }

    /// Removes an entry: within braces it is deleted, elsewhere its lines become comments, with the reason `why` above
    /// them.
    pub fn remove(&mut self, path: &[&str], why: &str) {
        let entries = entries(&self.0);
        let path = owned(path);
        let Some(entry) = entries.iter().find(|entry| entry.path == path) else { return };
        let within = |e: &&Entry| matches!(&e.form, Form::Inline(span) if span.contains(&entry.key.start));
        let braces = entries.iter().filter(|e| e.path.len() < path.len()).filter(within).map(|e| e.path.len()).max();
        if let Some(braces) = braces {
            let (Form::Value(span) | Form::Inline(span)) = &entry.form else { return };
            let dotted = path.len() - braces - 1;
            let (mut start, mut end) = (self.start_of_keys(entry.key.start, dotted), span.end);
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
                self.0.insert_str(start, &format!("# {}\n", line(why)));
            }
        }
    }

    /// Returns the start of a dotted key whose last part starts at `last` and is preceded by `more` parts.
    fn start_of_keys(&self, last: usize, more: usize) -> usize {
        (0..more).fold(last, |start, _| {
            let key = self.0[..start].trim_end().trim_end_matches('.').trim_end();
            match key.chars().next_back() {
                Some(quote @ ('"' | '\'')) => {
                    let inner = &key[..key.len() - 1];
                    let slashes = |at: usize| at - inner[..at].trim_end_matches('\\').len();
                    let escaped = |at: usize| quote == '"' && slashes(at) % 2 == 1;
                    inner.rmatch_indices(quote).map(|(at, _)| at).find(|&at| !escaped(at)).unwrap_or(0)
                }
                _ => {
                    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
                    key.trim_end_matches(bare).len()
                }
            }
        })
    }

    /// Returns the start of the line after a position.
    fn end_of_line(&self, at: usize) -> usize {
        self.0[at..].find('\n').map_or(self.0.len(), |end| at + end + 1)
    }
}
