//! `sources.toml`: where to get the data files that a folder needs and does not include.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use serde::Deserialize;
use toml::de::{DeTable, ValueDeserializer};

use mops_language::{Diagnostic, Source};

/// Name of the file.
pub const FILE: &str = "sources.toml";

/// Source of a data file.
#[derive(Deserialize)]
struct Entry {
    source: String,
    sha256: String,
}

/// Returns where to get a file that is missing, as one sentence, if [`FILE`] in its folder lists it; `shown` is the
/// path of
/// [`FILE`] and `bytes` its content.
///
/// # Errors
/// If the content is not a list of sources.
pub fn source_of(path: &Path, shown: &str, bytes: Vec<u8>) -> Result<Option<String>, Diagnostic> {
    let source = Arc::new(Source::from_bytes(shown, bytes)?);
    let wrong = |place: Range<usize>, why: String| {
        Diagnostic::new(format!("no data file `{}`, and its source cannot be looked up: {why}", path.display()))
            .with_help("give every file a table such as [\"data.csv\"] with the strings `source` and `sha256`")
            .at(&source, place)
    };
    let table = DeTable::parse(&source.text).map_err(|error| {
        wrong(error.span().unwrap_or(0..0), format!("invalid TOML: {}", error.message().replace('\n', "; ")))
    })?;
    let mut found = None;
    for (key, value) in table.into_inner() {
        let (name, place) = (key.get_ref(), key.span());
        let entry = Entry::deserialize(ValueDeserializer::from(value));
        let entry =
            entry.map_err(|_| wrong(place, format!("the entry `{name}` needs the strings `source` and `sha256`")))?;
        if path.file_name().is_some_and(|file| file == name.as_ref()) {
            found = Some(format!("it is not included; source: {}; SHA-256: {}", entry.source, entry.sha256));
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(path: &str, sources: &str) -> Result<Option<String>, String> {
        source_of(Path::new(path), "sources.toml", sources.into()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_listed_file_has_its_source_and_its_digest() {
        let sources = "[\"a.mat\"]\nsource = \"cell 1 of b.mat\"\nsha256 = \"06d8\"\n";
        let listed = "it is not included; source: cell 1 of b.mat; SHA-256: 06d8".to_owned();
        assert_eq!(found("data/a.mat", sources), Ok(Some(listed)));
        assert_eq!(found("data/b.mat", sources), Ok(None));
    }

    #[test]
    fn a_broken_list_is_reported_with_its_line() {
        let start = |sources| found("a.mat", sources).unwrap_err();
        let fact = "no data file `a.mat`, and its source cannot be looked up";
        let lacks = format!("sources.toml:2:1: {fact}: the entry `b.mat` needs the strings `source` and `sha256`; ");
        assert!(start("# Data\n\"b.mat\" = 3").starts_with(&lacks), "{}", start("# Data\n\"b.mat\" = 3"));
        let invalid = start("[\"a.mat\"]\nsource = somewhere\n");
        assert!(invalid.starts_with(&format!("sources.toml:2:10: {fact}: invalid TOML: ")), "{invalid}");
    }
}
