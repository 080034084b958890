//! `sources.toml`: where to get the data files that a folder needs and does not include.

use std::path::Path;

use serde::Deserialize;

/// Name of the file.
pub const FILE: &str = "sources.toml";

/// Source of a data file.
#[derive(Deserialize)]
struct Entry {
    source: String,
    sha256: String,
}

/// Returns where to get a file that is missing, as one sentence, if `sources`, the text of [`FILE`] in its folder, lists it.
pub fn source_of(path: &Path, sources: &[u8]) -> Option<String> {
    let entries: toml::Table = toml::from_str(std::str::from_utf8(sources).ok()?).ok()?;
    let entry: Entry = entries.get(path.file_name()?.to_str()?)?.clone().try_into().ok()?;
    Some(format!("it is not included; get it from {}; its SHA-256 is {}", entry.source, entry.sha256))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_listed_file_has_its_source_and_its_digest() {
        let sources = b"[\"a.mat\"]\nsource = \"somewhere\"\nsha256 = \"06d8\"\n";
        let found = source_of(Path::new("data/a.mat"), sources).unwrap();
        assert_eq!(found, "it is not included; get it from somewhere; its SHA-256 is 06d8");
        assert_eq!(source_of(Path::new("data/b.mat"), sources), None);
        assert_eq!(source_of(Path::new("data/a.mat"), b"a.mat = 3"), None);
    }
}
