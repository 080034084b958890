//! Edits of a TOML text that leave all else as it is: comments, order, spaces.

mod edit;
mod entries;
#[cfg(test)]
mod tests;

use toml::de::DeTable;

use entries::{Entry, Form, entries};

/// A TOML text that can be edited. It must be right: what is edited was read before.
pub(super) struct TomlText(String);

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

    /// Every value with the keys that lead to it; tables in braces count by what is in them.
    pub(super) fn values(&self) -> Vec<(Vec<String>, String)> {
        let value = |entry: Entry| match entry.form {
            Form::Value(span) => Some((entry.path, self.0[span].to_owned())),
            Form::Inline(span) if entry.empty => Some((entry.path, self.0[span].to_owned())),
            _ => None,
        };
        entries(&self.0).into_iter().filter_map(value).collect()
    }

    /// Puts a comment above all else.
    pub(super) fn head(&mut self, comment: &str) {
        let lines: String = comment.lines().map(|line| format!("# {line}\n")).collect();
        self.0.insert_str(0, &format!("{lines}\n"));
    }

    /// Whether something stands there.
    pub(super) fn has(&self, path: &[&str]) -> bool {
        entries(&self.0).iter().any(|entry| entry.path == path)
    }

    /// The keys of a table, in the order of the text.
    pub(super) fn keys(&self, path: &[&str]) -> Vec<String> {
        let path = owned(path);
        let below = |entry: Entry| match entry.path.strip_prefix(path.as_slice()) {
            Some([key]) => Some(key.clone()),
            _ => None,
        };
        entries(&self.0).into_iter().filter_map(below).collect()
    }

    /// The text of a value, or of a table in braces.
    pub(super) fn get(&self, path: &[&str]) -> Option<&str> {
        match entries(&self.0).into_iter().find(|entry| entry.path == path)?.form {
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
}

fn owned(path: &[&str]) -> Vec<String> {
    path.iter().map(|&key| key.to_owned()).collect()
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
