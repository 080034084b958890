//! TOML text with the position of every key and value, and the location of errors in it.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use mops_core::study::StudyError;
use mops_language::{Diagnostic, Source, suggestion};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::syntax;

/// Text of a study. Every setting of the command line is appended as a separate line, so that errors in settings have a
/// position too. `parts` are parsed one by one, each padded so that positions refer to the complete text.
pub(super) struct Text {
    source: Arc<Source>,
    parts: Vec<String>,
    /// Positions of the settings in the complete text.
    settings: Vec<Range<usize>>,
}

impl Text {
    pub fn new(name: &str, text: &str, settings: &[String]) -> Self {
        let mut all = text.to_owned();
        let mut parts = vec![text.to_owned()];
        let mut places = Vec::new();
        for setting in settings {
            if !all.ends_with('\n') {
                all.push('\n');
            }
            all.push_str("# --set ");
            parts.push(" ".repeat(all.len()) + setting);
            places.push(all.len()..all.len() + setting.len());
            all.push_str(setting);
            all.push('\n');
        }
        Self { source: Arc::new(Source { name: name.to_owned(), text: all }), parts, settings: places }
    }

    pub fn source(&self) -> &Arc<Source> {
        &self.source
    }

    /// Parses the text; settings replace or add values.
    pub fn parse(&self) -> Result<Node<'_>, Diagnostic> {
        let mut root = DeTable::new();
        for part in &self.parts {
            let table = DeTable::parse(part).map_err(|error| self.syntax_error(part, &error))?;
            merge(&mut root, table.into_inner());
        }
        let value = Spanned::new(0..self.source.text.len(), DeValue::Table(root));
        Ok(Node { source: &self.source, key: 0..0, value: Cow::Owned(value) })
    }

    fn syntax_error(&self, part: &str, error: &toml::de::Error) -> Diagnostic {
        let (diagnostic, place) = syntax::explain(part, error);
        diagnostic.at(&self.source, place)
    }

    /// Relocates an error in a setting of the command line to the setting itself.
    pub fn settle(&self, diagnostic: Diagnostic) -> Diagnostic {
        let Some((_, span)) = diagnostic.place.as_ref().filter(|(source, _)| Arc::ptr_eq(source, &self.source)) else {
            return diagnostic;
        };
        let within = |setting: &&Range<usize>| setting.start <= span.start && span.end <= setting.end;
        let Some(setting) = self.settings.iter().find(within) else { return diagnostic };
        let text = self.source.text[setting.clone()].to_owned() + "\n";
        let span = span.start - setting.start..span.end - setting.start;
        let help = diagnostic.help.as_ref().map(|help| match help.contains('"') {
            true => format!("{help}; put single quotes around the setting, because the shell removes quotes"),
            false => help.clone(),
        });
        Diagnostic { help, ..diagnostic.at(&Arc::new(Source { name: "--set".to_owned(), text }), span) }
    }
}

fn merge<'t>(into: &mut DeTable<'t>, from: DeTable<'t>) {
    for (key, value) in from {
        match into.get_mut(key.get_ref().as_ref()).map(Spanned::get_mut) {
            // An empty table adds nothing; it keeps the existing table.
            Some(DeValue::Table(old)) if value.get_ref().as_table().is_some_and(|new| !new.is_empty()) => {
                let DeValue::Table(new) = value.into_inner() else { unreachable!("it is a table") };
                merge(old, new);
            }
            _ => {
                into.insert(key, value);
            }
        }
    }
}

/// A value of the text, with the position of its key.
#[derive(Clone)]
pub(super) struct Node<'t> {
    pub source: &'t Arc<Source>,
    key: Range<usize>,
    pub value: Cow<'t, Spanned<DeValue<'t>>>,
}

impl<'t> Node<'t> {
    /// Returns an error located at the value.
    pub fn diagnostic(&self, message: String) -> Diagnostic {
        Diagnostic::new(message).at(self.source, self.value.span())
    }

    /// Returns an error located at the key.
    pub fn key_diagnostic(&self, message: String) -> Diagnostic {
        Diagnostic::new(message).at(self.source, self.key.clone())
    }

    /// Returns an error located at the bytes `within` of a string value.
    pub fn diagnostic_within(&self, within: Range<usize>, message: String) -> Diagnostic {
        let span = self.value.span();
        let quoted = self.source.text.get(span.start + 1..span.end.saturating_sub(1));
        match self.value.get_ref().as_str() {
            // Without escapes, the parsed string equals the written one.
            text if text == quoted => {
                Diagnostic::new(message).at(self.source, span.start + 1 + within.start..span.start + 1 + within.end)
            }
            _ => self.diagnostic(message),
        }
    }

    pub fn value(&self) -> &DeValue<'t> {
        self.value.get_ref()
    }

    /// Returns the key as written, without quotes.
    pub fn key_text(&self) -> String {
        self.source.text[self.key.clone()].trim_matches(['"', '\'']).to_owned()
    }

    /// Returns the value as written.
    pub fn value_text(&self) -> &str {
        &self.source.text[self.value.span()]
    }

    /// Returns the type of the value in words.
    pub fn in_words(&self) -> &'static str {
        match self.value.get_ref() {
            DeValue::String(_) => "a string",
            DeValue::Integer(_) | DeValue::Float(_) => "a number",
            DeValue::Boolean(true) => "`true`",
            DeValue::Boolean(false) => "`false`",
            DeValue::Datetime(_) => "a date",
            DeValue::Array(_) => "a list",
            DeValue::Table(_) => "a table",
        }
    }

    fn as_table(&self) -> Result<&DeTable<'t>, Diagnostic> {
        match self.value.get_ref().as_table() {
            Some(table) => Ok(table),
            None => Err(self
                .diagnostic(format!("expected a table, found {}", self.in_words()))
                .with_help(format!("write {} = {{ name = value }}", self.key_text()))),
        }
    }

    fn below(&self, key: &Spanned<Cow<'t, str>>, value: &Spanned<DeValue<'t>>) -> Self {
        Node { source: self.source, key: key.span(), value: Cow::Owned(value.clone()) }
    }

    /// Returns keys and values, in the order of the text.
    pub fn entries(&self) -> Result<Vec<(String, Self)>, Diagnostic> {
        let table = self.as_table()?;
        Ok(table.iter().map(|(key, value)| (key.get_ref().to_string(), self.below(key, value))).collect())
    }

    /// Returns the value under a key.
    pub fn child(&self, key: &str) -> Option<Self> {
        let table = self.value.get_ref().as_table()?;
        table.iter().find(|(k, _)| k.get_ref() == key).map(|(k, v)| self.below(k, v))
    }

    /// Returns the elements of a list.
    pub fn elements(&self) -> Vec<Self> {
        let elements = self.value.get_ref().as_array().into_iter().flat_map(|array| array.iter());
        elements.map(|e| Node { source: self.source, key: e.span(), value: Cow::Owned(e.clone()) }).collect()
    }

    /// Returns the value under a required key.
    pub fn required(&self, key: &str, help: &str) -> Result<Self, Diagnostic> {
        self.child(key)
            .ok_or_else(|| Diagnostic::new(format!("the study has no [{key}]")).with_help(help).at(self.source, 0..0))
    }

    /// Returns keys and values of the table under a key; empty if it is absent.
    pub fn table(&self, key: &str) -> Result<Vec<(String, Self)>, Diagnostic> {
        self.child(key).map_or(Ok(Vec::new()), |node| node.entries())
    }

    /// Rejects unknown keys.
    pub fn check_keys(&self, known: &[&str]) -> Result<(), Diagnostic> {
        for (key, node) in self.entries()? {
            if !known.contains(&key.as_str()) {
                return Err(node.unknown_key(&key, known));
            }
        }
        Ok(())
    }

    pub fn unknown_key(&self, key: &str, known: &[&str]) -> Diagnostic {
        self.key_diagnostic(format!("unknown key `{key}`")).with_help(suggestion(key, known.iter().copied()))
    }

    /// Returns the table reduced to these keys.
    pub fn only(&self, keys: &[&str]) -> Self {
        let Some(table) = self.value.get_ref().as_table() else { return self.clone() };
        let kept = table.iter().filter(|(key, _)| keys.contains(&key.get_ref().as_ref()));
        let table: DeTable<'t> = kept.map(|(key, value)| (key.clone(), value.clone())).collect();
        let value = Spanned::new(self.value.span(), DeValue::Table(table));
        Node { source: self.source, key: self.key.clone(), value: Cow::Owned(value) }
    }

    /// Returns this table with the keys of another table added or replaced, but for one key.
    pub fn overlaid(&self, with: &Self, without: &str) -> Result<Self, Diagnostic> {
        let mut table: DeTable<'t> = self.as_table()?.clone();
        merge(&mut table, with.as_table()?.clone());
        table.remove(without);
        let value = Spanned::new(with.value.span(), DeValue::Table(table));
        Ok(Node { source: with.source, key: with.key.clone(), value: Cow::Owned(value) })
    }

    /// Returns an error with its location: the value under its last key, or the last existing key.
    pub fn locate(&self, mistake: &StudyError) -> Diagnostic {
        let mut node = self.clone();
        for key in &mistake.path {
            // `free = ["phi"]` has its entries as elements; the options of a kind are in the table of its name.
            let element = || node.elements().into_iter().find(|e| e.value().as_str() == Some(key));
            let option = || node.entries().ok()?.into_iter().find_map(|(_, kind)| kind.child(key));
            // A table may stand for several cases, whose names begin with its key.
            let family = || {
                let begins = |(name, _): &(String, Self)| {
                    key.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with('-'))
                };
                node.entries()
                    .ok()?
                    .into_iter()
                    .filter(begins)
                    .max_by_key(|(name, _)| name.len())
                    .map(|(_, below)| below)
            };
            match node.child(key).or_else(element).or_else(option).or_else(family) {
                Some(below) => node = below,
                None => break,
            }
        }
        // A message that ends with the key is about this name, not about the value under it.
        let names_key = mistake.path.last().is_some_and(|key| mistake.message.ends_with(&format!("`{key}`")));
        let diagnostic = if let Some(span) = &mistake.span {
            node.diagnostic_within(span.clone(), mistake.message.clone())
        } else if node.key.is_empty() {
            Diagnostic::new(mistake.message.clone()).at(self.source, 0..0)
        } else if node.value().is_table() || names_key {
            node.key_diagnostic(mistake.message.clone())
        } else {
            node.diagnostic(mistake.message.clone())
        };
        Diagnostic { help: mistake.help.clone(), ..diagnostic }
    }
}
