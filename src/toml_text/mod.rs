//! Edits of a TOML text that leave all else as it is: comments, order, spaces.

mod edit;
mod entries;
#[cfg(test)]
mod tests;

use toml::de::DeTable;

use entries::{Entry, Form, entries};

use crate::plain::plain;

/// A TOML text that can be edited. It must be right: what is edited was read before.
pub(crate) struct TomlText(String);

impl TomlText {
    pub(crate) fn new(text: &str) -> Self {
        let mut text = text.to_owned();
        if !text.is_empty() && !text.ends_with('\n') {
            text.push('\n');
        }
        Self(text)
    }

    pub(crate) fn into_text(self) -> String {
        self.0
    }

    /// Every value with the keys that lead to it; tables in braces count by what is in them.
    pub(crate) fn values(&self) -> Vec<(Vec<String>, String)> {
        let value = |entry: Entry| match entry.form {
            Form::Value(span) => Some((entry.path, self.0[span].to_owned())),
            Form::Inline(span) if entry.empty => Some((entry.path, self.0[span].to_owned())),
            _ => None,
        };
        entries(&self.0).into_iter().filter_map(value).collect()
    }

    /// Puts a comment above all else.
    pub(crate) fn head(&mut self, comment: &str) {
        // Of control characters a comment may have tabs alone.
        let lines: String = comment.lines().map(|line| format!("# {}\n", plain(line))).collect();
        self.0.insert_str(0, &format!("{lines}\n"));
    }

    /// Whether something stands there.
    pub(crate) fn has(&self, path: &[&str]) -> bool {
        entries(&self.0).iter().any(|entry| entry.path == path)
    }

    /// The keys of a table, in the order of the text.
    pub(crate) fn keys(&self, path: &[&str]) -> Vec<String> {
        let path = owned(path);
        let below = |entry: Entry| match entry.path.strip_prefix(path.as_slice()) {
            Some([key]) => Some(key.clone()),
            _ => None,
        };
        entries(&self.0).into_iter().filter_map(below).collect()
    }

    /// The text of a value, or of a table in braces.
    pub(crate) fn get(&self, path: &[&str]) -> Option<&str> {
        match entries(&self.0).into_iter().find(|entry| entry.path == path)?.form {
            Form::Value(span) | Form::Inline(span) => Some(&self.0[span]),
            Form::Header(_) | Form::Implied => None,
        }
    }

    /// What a value that is a text says.
    pub(crate) fn words(&self, path: &[&str]) -> Option<String> {
        let value = format!("v = {}", self.get(path)?);
        let table = DeTable::parse(&value).ok()?;
        table.get_ref().get("v")?.get_ref().as_str().map(str::to_owned)
    }
}

/// A study with `key=value` settings in their places, for another folder: `locate` leads from the path of a data file to the
/// path as it counts from there.
pub(crate) fn settled(text: &str, settings: &[String], locate: &dyn Fn(&str) -> String) -> TomlText {
    let mut text = TomlText::new(text);
    for setting in settings {
        for (path, value) in TomlText::new(setting).values() {
            text.set(&path.iter().map(String::as_str).collect::<Vec<_>>(), &value);
        }
    }
    for experiment in text.keys(&["experiments"]) {
        let place = ["experiments", &experiment, "file"];
        if let Some(file) = text.words(&place) {
            text.set(&place, &quoted(&locate(&file)));
        }
    }
    text
}

fn owned(path: &[&str]) -> Vec<String> {
    path.iter().map(|&key| key.to_owned()).collect()
}

/// Keys with dots between them, in quotes where they need some.
fn keys(path: &[&str]) -> String {
    path.iter().map(|key| self::key(key)).collect::<Vec<_>>().join(".")
}

/// A key, in quotes if it needs some.
pub(crate) fn key(key: &str) -> String {
    let bare = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if bare { key.to_owned() } else { quoted(key) }
}

/// A text as TOML writes it, in one line: a key may have no other form.
pub(crate) fn quoted(text: &str) -> String {
    if !text.contains(char::is_control) {
        return toml::Value::String(text.to_owned()).to_string();
    }
    let escaped = |c: char| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c.is_control() => format!("\\u{:04x}", u32::from(c)),
        c => c.to_string(),
    };
    format!("\"{}\"", text.chars().map(escaped).collect::<String>())
}

/// A number as TOML writes it.
pub(crate) fn number(value: f64) -> String {
    format!("{value:?}")
}
