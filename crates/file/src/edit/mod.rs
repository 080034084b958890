//! Edits of a TOML text that preserve comments, order and spaces, with two exceptions of `toml_edit`: dotted keys of a
//! table that stand apart move to the first of them, and lines end without a carriage return.

#[cfg(test)]
mod tests;

use std::mem::{replace, take};
use std::ops::Range;

use mops_language::plain::{line, plain};
use toml_edit::visit::{Visit, visit_table};
use toml_edit::visit_mut::VisitMut;
use toml_edit::{Document, DocumentMut, Formatted, InlineTable, Item, KeyMut, Table, TableLike, Value};

/// TOML text to be edited. It must be valid, as a text is parsed before it is edited.
pub struct TomlText(DocumentMut);

const VALID: &str = "a study that was read is valid TOML, and every edit keeps it valid";

impl TomlText {
    /// Creates the text to be edited.
    pub fn new(text: &str) -> Self {
        Self(text.parse().expect(VALID))
    }

    /// Returns the edited text.
    pub fn into_text(self) -> String {
        self.0.to_string()
    }

    /// Inserts a comment at the start of the text.
    pub fn head(&mut self, comment: &str) {
        // The only control character allowed in a comment is the tab.
        let lines: String = comment.lines().map(|line| format!("# {}\n", plain(line))).collect();
        self.0.decor_mut().set_prefix(format!("{lines}\n"));
    }

    /// Returns the entry at a path.
    pub fn item(&self, path: &[&str]) -> Option<&Item> {
        path.iter().try_fold(self.0.as_item(), |item, key| item.get(key))
    }

    /// Returns true if the entry exists.
    pub fn has(&self, path: &[&str]) -> bool {
        self.item(path).is_some()
    }

    /// Returns the keys of a table, in the order of the text.
    pub fn keys(&self, path: &[&str]) -> Vec<String> {
        let table = self.item(path).and_then(Item::as_table_like);
        table.into_iter().flat_map(TableLike::iter).map(|(key, _)| key.to_owned()).collect()
    }

    /// Sets the entry at `path` to `value`, written as TOML. An existing value is replaced, the lines of an existing
    /// table become comments, and a new entry is inserted where its table is.
    pub fn set(&mut self, path: &[&str], value: &str) {
        self.put(path, value.parse().expect("values are written as TOML"));
    }

    fn put(&mut self, path: &[&str], value: Value) {
        for depth in 1..=path.len() {
            match self.item(&path[..depth]) {
                Some(Item::Table(_)) if depth < path.len() => {}
                Some(Item::Table(_) | Item::ArrayOfTables(_)) => self.remove(&path[..depth], "replaced"),
                _ => break,
            }
        }
        let section = &path[..path.len() - 1];
        let is_new = !section.is_empty() && !self.has(&path[..1]);
        place(self.0.as_item_mut(), path, Some(value));
        if is_new {
            // A new section is the last, and the comments at the end of the text stay before it.
            let comments = format!("{}\n", self.0.trailing().as_str().unwrap_or_default());
            self.0.set_trailing("");
            let section = section.iter().fold(self.0.as_item_mut(), |item, key| &mut item[key]);
            let section = section.as_table_mut().expect("a new section has a header");
            section.decor_mut().set_prefix(comments);
            section.set_position(Some(isize::MAX));
        }
    }

    /// Removes an entry: within braces it is deleted, elsewhere its lines become comments, with the reason `why` above
    /// them.
    pub fn remove(&mut self, path: &[&str], why: &str) {
        if !self.has(path) {
            return;
        }
        if (1..path.len()).any(|depth| self.item(&path[..depth]).is_some_and(Item::is_value)) {
            return place(self.0.as_item_mut(), path, None);
        }
        let text = self.0.to_string();
        let document = Document::parse(text.as_str()).expect(VALID);
        let mut spans = Spans(Vec::new());
        spans.visit_item(path.iter().fold(document.as_item(), |item, key| &item[key]));
        let mut reason = format!("# {}\n", line(why));
        let (mut commented, mut end) = (String::new(), 0);
        for line in text.split_inclusive('\n') {
            let start = end;
            end += line.len();
            if spans.0.iter().any(|span| span.start < end && start < span.end) {
                commented += &take(&mut reason);
                commented += "# ";
            }
            commented += line;
        }
        *self = Self::new(&commented);
    }
}

/// Byte ranges of headers and values.
struct Spans(Vec<Range<usize>>);

impl<'d> Visit<'d> for Spans {
    fn visit_table(&mut self, table: &'d Table) {
        self.0.extend(table.span());
        visit_table(self, table);
    }

    fn visit_value(&mut self, value: &'d Value) {
        self.0.extend(value.span());
    }
}

/// Puts a value at a path below an item, or deletes the one there. Missing tables are created in the form of the table
/// around them: within braces and below a header as dotted keys, elsewhere with headers.
fn place(item: &mut Item, path: &[&str], value: Option<Value>) {
    let Some((key, below)) = path.split_first() else { return exchange(item, value) };
    match item {
        Item::Table(table) => {
            let is_dotted = table.is_dotted() || table.position().is_some();
            let missing = || {
                let mut missing = Table::new();
                missing.set_implicit(true);
                missing.set_dotted(is_dotted);
                if below.is_empty() { Item::None } else { missing.into() }
            };
            place(table.entry(key).or_insert_with(missing), below, value);
        }
        Item::Value(Value::InlineTable(table)) => {
            // The space before the closing brace stays there.
            let space = last(table).and_then(|last| {
                let space = last.decor().suffix().cloned();
                last.decor_mut().set_suffix("");
                space
            });
            place(TableLike::entry(table, key).or_insert(Item::None), below, value);
            if let (Some(space), Some(last)) = (space, last(table)) {
                last.decor_mut().set_suffix(space);
            }
        }
        _ => {
            let mut table = InlineTable::new();
            table.set_dotted(item.is_none());
            exchange(item, Some(table.into()));
            place(item, path, value);
        }
    }
}

/// Replaces an item by a value between the same spaces and comments, or deletes it.
fn exchange(item: &mut Item, value: Option<Value>) {
    let decor = item.as_value().map(|old| old.decor().clone()).unwrap_or_default();
    *item = value.map_or(Item::None, |mut value| {
        *value.decor_mut() = decor;
        value.into()
    });
}

/// Returns the last value in braces.
fn last(table: &mut InlineTable) -> Option<&mut Value> {
    let values = table.iter_mut().filter_map(|(_, value)| match value.as_inline_table() {
        Some(table) if table.is_dotted() => last(value.as_inline_table_mut()?),
        _ => Some(value),
    });
    values.last()
}

/// Returns a study with its `key=value` settings merged, for another folder. `locate` converts the path of a data file
/// to be relative to that folder.
pub fn settled(text: &str, settings: &[String], locate: &dyn Fn(&str) -> String) -> TomlText {
    let mut text = TomlText::new(text);
    for setting in settings {
        merge(&mut text, &[], TomlText::new(setting).0.as_table());
    }
    DataFiles { path: Vec::new(), locate }.visit_document_mut(&mut text.0);
    text
}

/// Sets the values of a table one by one, except an empty table, which replaces what is there.
fn merge(text: &mut TomlText, path: &[&str], table: &dyn TableLike) {
    for (key, item) in table.iter() {
        let path = [path, &[key]].concat();
        match item.as_table_like() {
            Some(table) if !table.is_empty() => merge(text, &path, table),
            _ => item.as_value().into_iter().for_each(|value| text.put(&path, value.clone())),
        }
    }
}

/// Data files at their keys; entries of a list have the keys of the list.
struct DataFiles<'a> {
    path: Vec<String>,
    locate: &'a dyn Fn(&str) -> String,
}

impl VisitMut for DataFiles<'_> {
    fn visit_table_like_kv_mut(&mut self, key: KeyMut<'_>, item: &mut Item) {
        self.path.push(key.get().to_owned());
        self.visit_item_mut(item);
        self.path.pop();
    }

    fn visit_string_mut(&mut self, text: &mut Formatted<String>) {
        let path: Vec<&str> = self.path.iter().map(String::as_str).collect();
        if let ["experiments", _, "file" | "files"]
        | ["experiments", _, "channels" | "inputs", _, "file"]
        | ["cases", _, "inputs", _, "file", "path"]
        | ["models", _, "equations", "tables", _, "file"] = path[..]
        {
            let moved = Formatted::new((self.locate)(text.value()));
            let decor = replace(text, moved).decor().clone();
            *text.decor_mut() = decor;
        }
    }
}

/// Returns a key as TOML, quoted if necessary.
pub fn key(key: &str) -> String {
    let bare = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if bare { key.to_owned() } else { quoted(key) }
}

/// Returns a text as a TOML string on one line, as keys require.
pub fn quoted(text: &str) -> String {
    if !text.contains(char::is_control) {
        return Value::from(text).to_string();
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
