//! A TOML text with the position of every key and value, and the way from a mistake back to its position.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use schemars::{JsonSchema, Schema};
use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

use super::schema::{documentation, keys_of, schema_of};
use crate::diagnostic::{Diagnostic, Source, suggestion};
use crate::study::Mistake;

/// A study's text, with every setting of the command line as a line of its own at the end, so that mistakes in
/// settings have a position too. `parts` are what is parsed: each padded so that positions are those in the whole text.
pub(super) struct Text {
    source: Arc<Source>,
    parts: Vec<String>,
}

impl Text {
    pub fn new(name: &str, text: &str, settings: &[String]) -> Self {
        let mut all = text.to_owned();
        let mut parts = vec![text.to_owned()];
        for setting in settings {
            if !all.ends_with('\n') {
                all.push('\n');
            }
            all.push_str("# --set ");
            parts.push(" ".repeat(all.len()) + setting);
            all.push_str(setting);
            all.push('\n');
        }
        Self { source: Arc::new(Source { name: name.to_owned(), text: all }), parts }
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
        let mut lines = error.message().lines();
        let message = lines.next().unwrap_or("this is not TOML").to_owned();
        let rest: Vec<&str> = lines.collect();
        let help = match rest.join("; ") {
            help if help.is_empty() => {
                "correct the TOML at the place shown; texts need quotes, as in unit = \"s\"".to_owned()
            }
            help => help,
        };
        Diagnostic::new(message).with_help(help).at(&self.source, error.span().unwrap_or(0..part.len()))
    }
}

fn merge<'t>(into: &mut DeTable<'t>, from: DeTable<'t>) {
    for (key, value) in from {
        match into.get_mut(key.get_ref().as_ref()).map(Spanned::get_mut) {
            Some(DeValue::Table(old)) if value.get_ref().is_table() => {
                let DeValue::Table(new) = value.into_inner() else { unreachable!("it is a table") };
                merge(old, new);
            }
            _ => {
                into.insert(key, value);
            }
        }
    }
}

/// A value of the text, with the place of the key that leads to it.
#[derive(Clone)]
pub(super) struct Node<'t> {
    source: &'t Arc<Source>,
    key: Range<usize>,
    value: Cow<'t, Spanned<DeValue<'t>>>,
}

impl<'t> Node<'t> {
    /// A mistake in the value.
    pub fn diagnostic(&self, message: String) -> Diagnostic {
        Diagnostic::new(message).at(self.source, self.value.span())
    }

    /// A mistake at the key.
    pub fn key_diagnostic(&self, message: String) -> Diagnostic {
        Diagnostic::new(message).at(self.source, self.key.clone())
    }

    fn as_table(&self) -> Result<&DeTable<'t>, Diagnostic> {
        self.value.get_ref().as_table().ok_or_else(|| {
            self.diagnostic(format!("a {} stands where a table is expected", self.value.get_ref().type_str()))
                .with_help("write a table: name = { key = value }, or [name] followed by its keys")
        })
    }

    fn below(&self, key: &Spanned<Cow<'t, str>>, value: &Spanned<DeValue<'t>>) -> Self {
        Node { source: self.source, key: key.span(), value: Cow::Owned(value.clone()) }
    }

    /// Keys and values, in the order of the text.
    pub fn entries(&self) -> Result<Vec<(String, Self)>, Diagnostic> {
        let table = self.as_table()?;
        Ok(table.iter().map(|(key, value)| (key.get_ref().to_string(), self.below(key, value))).collect())
    }

    /// The value under a key.
    pub fn child(&self, key: &str) -> Option<Self> {
        let table = self.value.get_ref().as_table()?;
        table.iter().find(|(k, _)| k.get_ref() == key).map(|(k, v)| self.below(k, v))
    }

    /// The value under a key that must be there.
    pub fn required(&self, key: &str, help: &str) -> Result<Self, Diagnostic> {
        self.child(key)
            .ok_or_else(|| Diagnostic::new(format!("the study has no [{key}]")).with_help(help).at(self.source, 0..0))
    }

    /// Keys and values of the table under a key; nothing where it is absent.
    pub fn table(&self, key: &str) -> Result<Vec<(String, Self)>, Diagnostic> {
        self.child(key).map_or(Ok(Vec::new()), |node| node.entries())
    }

    /// Refuses keys that are not known.
    pub fn check_keys(&self, known: &[&str]) -> Result<(), Diagnostic> {
        for (key, node) in self.entries()? {
            if !known.contains(&key.as_str()) {
                return Err(node.unknown_key(&key, known));
            }
        }
        Ok(())
    }

    fn unknown_key(&self, key: &str, known: &[&str]) -> Diagnostic {
        self.key_diagnostic(format!("unknown key `{key}`")).with_help(suggestion(key, known.iter().copied()))
    }

    /// The same table with these keys alone.
    pub fn only(&self, keys: &[&str]) -> Self {
        let Some(table) = self.value.get_ref().as_table() else { return self.clone() };
        let kept = table.iter().filter(|(key, _)| keys.contains(&key.get_ref().as_ref()));
        let table: DeTable<'t> = kept.map(|(key, value)| (key.clone(), value.clone())).collect();
        let value = Spanned::new(self.value.span(), DeValue::Table(table));
        Node { source: self.source, key: self.key.clone(), value: Cow::Owned(value) }
    }

    /// Reads the value as a `T`: unknown keys and wrong types are refused where they stand.
    pub fn read<T: DeserializeOwned + JsonSchema>(&self) -> Result<T, Diagnostic> {
        self.read_with(&schema_of::<T>(), T::deserialize)
    }

    /// Reads the value with a reader whose schema is given.
    pub fn read_with<T>(
        &self,
        schema: &Schema,
        reader: impl FnOnce(ValueDeserializer<'t>) -> Result<T, toml::de::Error>,
    ) -> Result<T, Diagnostic> {
        self.check_against(schema.as_value())?;
        reader(ValueDeserializer::from(self.value.as_ref().clone())).map_err(|error| self.type_error(schema, &error))
    }

    /// Refuses unknown keys at any depth.
    fn check_against(&self, schema: &serde_json::Value) -> Result<(), Diagnostic> {
        let Some(known) = keys_of(schema) else { return Ok(()) };
        if let Ok(entries) = self.entries() {
            for (key, node) in entries {
                match known.get(&key) {
                    Some(below) => node.check_against(below)?,
                    None => {
                        let names: Vec<&str> = known.names();
                        return Err(node.unknown_key(&key, &names));
                    }
                }
            }
        }
        Ok(())
    }

    fn type_error(&self, schema: &Schema, error: &toml::de::Error) -> Diagnostic {
        let span = error.span().unwrap_or_else(|| self.value.span());
        let message = error.message().trim_end().replace("invalid type: ", "wrong type: ").replace('\n', "; ");
        // serde names the missing key between back-quotes.
        let named = message.split('`').nth(1).unwrap_or_default();
        let help = if message.starts_with("unknown variant") {
            let known: Vec<&str> = message.split('`').skip(3).step_by(2).collect();
            suggestion(named, known.iter().copied())
        } else if message.starts_with("missing field") {
            format!(
                "add `{named}`: {}",
                documentation(schema.as_value(), named).unwrap_or_else(|| "it has no default".into())
            )
        } else {
            let key = self.key_around(&span).and_then(|key| documentation(schema.as_value(), &key).map(|d| (key, d)));
            match key {
                Some((key, about)) => format!("`{key}` is: {about}"),
                None => "`mops describe` tells what each key takes".to_owned(),
            }
        };
        let span = if message.starts_with("missing field") && !self.key.is_empty() { self.key.clone() } else { span };
        Diagnostic::new(message).with_help(help).at(self.source, span)
    }

    /// The key of this table under which the place lies.
    fn key_around(&self, place: &Range<usize>) -> Option<String> {
        let table = self.value.get_ref().as_table()?;
        let around = |value: &Spanned<DeValue<'_>>| value.span().start <= place.start && place.end <= value.span().end;
        table.iter().find(|(_, value)| around(value)).map(|(key, _)| key.get_ref().to_string())
    }

    /// A mistake with its position: the value under its last key, or the last key that is there.
    pub fn locate(&self, mistake: &Mistake) -> Diagnostic {
        let mut node = self.clone();
        let mut whole = true;
        for key in &mistake.path {
            match node.child(key) {
                Some(below) => node = below,
                None => {
                    // `free = ["phi"]` names its entries as elements.
                    if let Some(element) = node.element(key) {
                        node = element;
                    } else {
                        whole = false;
                    }
                    break;
                }
            }
        }
        let is_table = node.value.get_ref().is_table();
        let diagnostic = if (is_table || !whole) && !node.key.is_empty() {
            node.key_diagnostic(mistake.message.clone())
        } else if node.key.is_empty() && node.value.span().len() == self.source.text.len() {
            Diagnostic::new(mistake.message.clone()).at(self.source, 0..0)
        } else {
            node.diagnostic(mistake.message.clone())
        };
        Diagnostic { help: mistake.help.clone(), ..diagnostic }
    }

    fn element(&self, text: &str) -> Option<Self> {
        let found = self.value.get_ref().as_array()?.iter().find(|e| e.get_ref().as_str() == Some(text))?;
        Some(Node { source: self.source, key: found.span(), value: Cow::Owned(found.clone()) })
    }
}
