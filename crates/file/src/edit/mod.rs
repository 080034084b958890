//! Edits of a TOML text that preserve comments, order and spaces.

mod change;
mod entries;
#[cfg(test)]
mod tests;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use entries::{Entry, Form, entries};

use mops_language::plain::plain;

/// TOML text to be edited. It must be valid, as a text is parsed before it is edited.
pub struct TomlText(String);

impl TomlText {
    /// Creates the text to be edited.
    pub fn new(text: &str) -> Self {
        let mut text = text.to_owned();
        if !text.is_empty() && !text.ends_with('\n') {
            text.push('\n');
        }
        Self(text)
    }

    /// Returns the edited text.
    pub fn into_text(self) -> String {
        self.0
    }

    /// Returns every value with its keys; inline tables contribute their entries.
    pub fn values(&self) -> Vec<(Vec<String>, String)> {
        let value = |entry: Entry| match entry.form {
            Form::Value(span) => Some((entry.path, self.0[span].to_owned())),
            Form::Inline(span) if entry.empty => Some((entry.path, self.0[span].to_owned())),
            _ => None,
        };
        entries(&self.0).into_iter().filter_map(value).collect()
    }

    /// Inserts a comment at the start of the text.
    pub fn head(&mut self, comment: &str) {
        // The only control character allowed in a comment is the tab.
        let lines: String = comment.lines().map(|line| format!("# {}\n", plain(line))).collect();
        self.0.insert_str(0, &format!("{lines}\n"));
    }

    /// Returns true if the entry exists.
    pub fn has(&self, path: &[&str]) -> bool {
        entries(&self.0).iter().any(|entry| entry.path == path)
    }

    /// Returns the keys of a table, in the order of the text.
    pub fn keys(&self, path: &[&str]) -> Vec<String> {
        let path = owned(path);
        let below = |entry: Entry| match entry.path.strip_prefix(path.as_slice()) {
            Some([key]) => Some(key.clone()),
            _ => None,
        };
        entries(&self.0).into_iter().filter_map(below).collect()
    }

    /// Returns the text of a value or of an inline table.
    pub fn get(&self, path: &[&str]) -> Option<&str> {
        match entries(&self.0).into_iter().find(|entry| entry.path == path)?.form {
            Form::Value(span) | Form::Inline(span) => Some(&self.0[span]),
            Form::Header(_) | Form::Implied => None,
        }
    }

    /// Returns the content of a string value.
    pub fn words(&self, path: &[&str]) -> Option<String> {
        let value = format!("v = {}", self.get(path)?);
        let table = DeTable::parse(&value).ok()?;
        table.get_ref().get("v")?.get_ref().as_str().map(str::to_owned)
    }
}

/// Returns a study with its `key=value` settings merged, for another folder. `locate` converts the path of a data file
/// to be relative to that folder.
pub fn settled(text: &str, settings: &[String], locate: &dyn Fn(&str) -> String) -> TomlText {
    let mut text = TomlText::new(text);
    for setting in settings {
        for (path, value) in TomlText::new(setting).values() {
            text.set(&path.iter().map(String::as_str).collect::<Vec<_>>(), &value);
        }
    }
    for (path, value) in text.values() {
        let path: Vec<&str> = path.iter().map(String::as_str).collect();
        if let (["cases", _, "inputs", _], Some(moved)) = (&path[..], files_of_sum(&value, locate)) {
            text.set(&path, &moved);
        }
        let is_data = match path[..] {
            ["experiments", _, key] => key == "file" || key == "files",
            ["experiments", _, "channels" | "inputs", _, "file"] => true,
            ["cases", _, "inputs", _, "file", "path"] => true,
            ["models", _, "equations", "tables", _, "file"] => true,
            _ => false,
        };
        if let (true, Some(file)) = (is_data, text.words(&path)) {
            text.set(&path, &quoted(&locate(&file)));
        }
    }
    text
}

/// Returns an input that is a list of signals, with the converted paths of their data files; `None` for other values.
fn files_of_sum(value: &str, locate: &dyn Fn(&str) -> String) -> Option<String> {
    let mut text = format!("v = {value}");
    let table = DeTable::parse(&text).ok()?;
    let list = table.get_ref().get("v")?.get_ref().as_array()?;
    let path = |part: &Spanned<DeValue<'_>>| {
        let path = part.get_ref().get("file")?.get_ref().get("path")?;
        Some((path.span(), path.get_ref().as_str()?.to_owned()))
    };
    let found: Vec<_> = list.iter().filter_map(path).collect();
    for (span, file) in found.into_iter().rev() {
        text.replace_range(span, &quoted(&locate(&file)));
    }
    Some(text.split_off("v = ".len()))
}

fn owned(path: &[&str]) -> Vec<String> {
    path.iter().map(|&key| key.to_owned()).collect()
}

/// Joins keys by dots, quoted if necessary.
fn keys(path: &[&str]) -> String {
    path.iter().map(|key| self::key(key)).collect::<Vec<_>>().join(".")
}

/// Returns a key as TOML, quoted if necessary.
pub fn key(key: &str) -> String {
    let bare = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if bare { key.to_owned() } else { quoted(key) }
}

/// Returns a text as a TOML string on one line, as keys require.
pub fn quoted(text: &str) -> String {
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

/// Returns a number as TOML.
pub fn number(value: f64) -> String {
    format!("{value:?}")
}
