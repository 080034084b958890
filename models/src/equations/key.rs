//! Keys of the tables: names, and families such as `T[1..100]`, `T[i]`, `T[i=2..99]`.

use mops_core::StudyError;

/// Key of a table of declarations or definitions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    /// Name before the bracket.
    pub name: String,
    /// Index in the bracket.
    pub index: Index,
}

/// Index in the bracket of a key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Index {
    /// No bracket.
    None,
    /// A single member.
    One(i64),
    /// Members from the first to the second, with the name of the index if given.
    Range(Option<String>, i64, i64),
    /// All members that no other key gives.
    Rest(String),
}

/// Limit on the number of members of a family.
const LARGEST: i64 = 10_000;

impl Key {
    /// Parses a key.
    ///
    /// # Errors
    /// An invalid name, or a bracket of unknown form.
    pub fn parse(key: &str) -> Result<Self, StudyError> {
        let (name, bracket) = match key.split_once('[') {
            None => (key, None),
            Some((name, rest)) => (name, Some(rest.strip_suffix(']').ok_or_else(|| wrong_bracket(key))?)),
        };
        if !is_name(name) {
            return Err(StudyError::here(format!("`{name}` is not a valid name"))
                .with_help("names consist of letters, digits and `_`, and start with a letter"));
        }
        if RESERVED.contains(&name) {
            return Err(StudyError::here(format!("`{name}` is a reserved word")).with_help("choose another name"));
        }
        let index = match bracket {
            None => Index::None,
            Some(text) => index(text.trim()).ok_or_else(|| wrong_bracket(key))?,
        };
        match index {
            Index::Range(_, from, to) if from > to || to.checked_sub(from).is_none_or(|n| n >= LARGEST) => {
                Err(StudyError::here(format!("expected 1 to {LARGEST} members, found the range {from}..{to}"))
                    .with_help("for example \"T[1..100]\""))
            }
            index => Ok(Self { name: name.to_owned(), index }),
        }
    }

    /// Returns the names of the quantities that a key declares.
    pub fn declared(&self) -> Result<Vec<String>, StudyError> {
        match &self.index {
            Index::None => Ok(vec![self.name.clone()]),
            Index::One(k) => Ok(vec![member(&self.name, *k)]),
            Index::Range(_, from, to) => Ok((*from..=*to).map(|k| member(&self.name, k)).collect()),
            Index::Rest(_) => Err(StudyError::here(format!("expected the range of the members of `{}`", self.name))
                .with_help(format!("for example \"{}[1..100]\"", self.name))),
        }
    }
}

/// Reserved words of expressions.
const RESERVED: [&str; 6] = ["time", "pi", "and", "or", "not", "der"];

/// Returns the name of a member, such as `T[3]`.
pub fn member(name: &str, index: i64) -> String {
    format!("{name}[{index}]")
}

fn is_name(text: &str) -> bool {
    let mut letters = text.chars();
    letters.next().is_some_and(|c| c.is_alphabetic() || c == '_') && letters.all(|c| c.is_alphanumeric() || c == '_')
}

fn wrong_bracket(key: &str) -> StudyError {
    StudyError::here(format!("the bracket in `{key}` is invalid")).with_help(
        "declare a family as \"T[1..100]\"; define \"T[1]\", \"T[i=2..99]\", or \"T[i]\" for all other members",
    )
}

fn index(text: &str) -> Option<Index> {
    let range = |text: &str| {
        let (from, to) = text.split_once("..")?;
        Some((from.trim().parse::<i64>().ok()?, to.trim().parse::<i64>().ok()?))
    };
    if let Ok(one) = text.parse() {
        return Some(Index::One(one));
    }
    if let Some((name, text)) = text.split_once('=') {
        let (from, to) = range(text)?;
        return is_name(name.trim()).then(|| Index::Range(Some(name.trim().to_owned()), from, to));
    }
    if let Some((from, to)) = range(text) {
        return Some(Index::Range(None, from, to));
    }
    is_name(text).then(|| Index::Rest(text.to_owned()))
}
