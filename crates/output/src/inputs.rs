//! Files that a command reads, found again by any path.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Largest number of symbolic links that are followed on the way to a file, as in Linux (`path_resolution(7)`).
const MOST_LINKS: usize = 40;

/// Files that a command reads, and the symbolic links on the way to them, each with words for a message.
#[derive(Debug, Default)]
pub struct Inputs {
    known: HashMap<Identity, String>,
}

impl Inputs {
    /// Adds a file; `what` follows "would overwrite".
    pub fn add(&mut self, path: &Path, what: &str) {
        for entry in way(path) {
            if let Some(identity) = identity(&entry) {
                self.known.entry(identity).or_insert_with(|| what.to_owned());
            }
        }
    }

    /// Returns what stands at a path, if it is an input or a link to one.
    pub(super) fn at(&self, path: &Path) -> Option<&str> {
        // Most commands read few files, and some write thousands.
        let known = identity(path).and_then(|identity| self.known.get(&identity));
        known.map(String::as_str)
    }
}

/// Returns the symbolic links on the way to a file, and its path without them.
fn way(path: &Path) -> Vec<PathBuf> {
    let mut path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut found = Vec::new();
    while let Some((link, rest)) = first_link(&path).filter(|_| found.len() < MOST_LINKS) {
        let Ok(target) = fs::read_link(&link) else { break };
        // N.B.: to join an empty rest would make a file a folder.
        path = link.parent().unwrap_or(Path::new("")).join(target);
        path.extend(rest.iter());
        found.push(link);
    }
    found.push(path);
    found
}

/// Returns the first symbolic link in a path, and the rest of the path.
fn first_link(path: &Path) -> Option<(PathBuf, PathBuf)> {
    let mut before = PathBuf::new();
    let mut rest = path.components();
    while let Some(component) = rest.next() {
        before.push(component);
        if before.is_symlink() {
            return Some((before, rest.as_path().to_owned()));
        }
    }
    None
}

/// Identity of a directory entry: device and number of the file, without following a link.
#[cfg(unix)]
type Identity = (u64, u64);

#[cfg(unix)]
fn identity(path: &Path) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt;
    fs::symlink_metadata(path).ok().map(|file| (file.dev(), file.ino()))
}

/// Identity of a directory entry: its real folder and its name.
#[cfg(not(unix))]
type Identity = PathBuf;

#[cfg(not(unix))]
fn identity(path: &Path) -> Option<Identity> {
    let parent = std::path::absolute(path).ok()?.parent()?.canonicalize().ok()?;
    Some(PathBuf::from(parent.join(path.file_name()?).to_string_lossy().to_lowercase()))
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn an_input_is_known_by_every_path_and_by_the_links_that_lead_to_it() {
        let root = tempfile::tempdir().unwrap();
        let at = |name: &str| root.path().join(name);
        fs::create_dir_all(at("data/deep")).unwrap();
        fs::write(at("data/deep/real.csv"), "").unwrap();
        fs::write(at("other.csv"), "").unwrap();
        symlink("deep", at("data/short")).unwrap();
        symlink("short/real.csv", at("data/second.csv")).unwrap();
        symlink(at("data/second.csv"), at("first.csv")).unwrap();
        let mut inputs = Inputs::default();
        inputs.add(&at("first.csv"), "the data");
        for known in ["first.csv", "data/second.csv", "data/short", "data/deep/real.csv", "data/../data/short/real.csv"]
        {
            assert_eq!(inputs.at(&at(known)), Some("the data"), "{known}");
        }
        for other in ["other.csv", "data", "data/deep", "nothing.csv"] {
            assert_eq!(inputs.at(&at(other)), None, "{other}");
        }
        // Links in a circle end.
        symlink("b", at("a")).unwrap();
        symlink("a", at("b")).unwrap();
        inputs.add(&at("a"), "a circle");
        assert_eq!(inputs.at(&at("b")), Some("a circle"));
    }
}
