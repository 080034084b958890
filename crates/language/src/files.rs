//! Where a study finds its data files.

use std::fmt;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// Source of data files: a folder, or the program itself.
pub trait Files {
    /// Reads a file, by its path in the study.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read.
    fn read(&self, path: &str) -> io::Result<Vec<u8>>;

    /// Returns the path as shown to the user.
    fn show(&self, path: &str) -> String;

    /// Returns the names of the files in a folder, in any order.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be read, or if files are known by their paths only.
    fn list(&self, _folder: &str) -> io::Result<Vec<String>> {
        Err(ErrorKind::Unsupported.into())
    }
}

/// Data files in a folder, usually that of the study file, and below. Files elsewhere are read only from folders that
/// [`Folder::reading`] names: a study may come from an untrusted source. Devices and pipes are refused, as they may
/// have no end.
#[derive(Debug, Clone, Default)]
pub struct Folder {
    path: PathBuf,
    readable: Vec<PathBuf>,
}

/// Refusal to read a file outside of the folders that a study may read ([`Folder`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OutsideFolder;

impl fmt::Display for OutsideFolder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("it is outside of the folder of the study")
    }
}

impl std::error::Error for OutsideFolder {}

impl OutsideFolder {
    /// What the user can do.
    pub const HELP: &'static str =
        "copy it into the folder of the study, or let studies read its folder with `--allow-read DIR`";

    /// Returns true if this is the reason of an error.
    pub fn is_reason_of(error: &io::Error) -> bool {
        error.get_ref().is_some_and(|reason| reason.is::<Self>())
    }
}

impl Folder {
    /// Creates the source of the files in a folder and below; an empty path is the working directory.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), readable: Vec::new() }
    }

    /// Adds folders whose files, and those below, are read too. A folder that does not exist has none.
    #[must_use]
    pub fn reading(mut self, folders: impl IntoIterator<Item = PathBuf>) -> Self {
        self.readable.extend(folders);
        self
    }

    /// Returns the real path of the folder because of which a file may be read; `None` if it may not, or does not
    /// exist.
    pub fn root_of(&self, path: &Path) -> Option<PathBuf> {
        let (own, real) = (self.here().canonicalize().ok()?, path.canonicalize().ok()?);
        if real.starts_with(&own) { Some(own) } else { self.readable_root(&real) }
    }

    fn here(&self) -> &Path {
        if self.path.as_os_str().is_empty() { Path::new(".") } else { &self.path }
    }

    /// Returns the first readable folder, apart from the own one, that contains a real path.
    fn readable_root(&self, real: &Path) -> Option<PathBuf> {
        self.readable.iter().filter_map(|folder| folder.canonicalize().ok()).find(|root| real.starts_with(root))
    }

    /// Returns the real path of a file or folder that may be read.
    ///
    /// N.B.: the error is the same whether a file outside exists or not.
    fn resolve(&self, path: &str) -> io::Result<PathBuf> {
        let here = self.here();
        let own = here.canonicalize()?;
        let is_inside = |real: &Path| real.starts_with(&own) || self.readable_root(real).is_some();
        let wanted = here.join(path);
        let real = wanted.canonicalize();
        let nearest = || wanted.ancestors().find_map(|folder| folder.canonicalize().ok());
        match (&real, real.as_ref().ok().cloned().or_else(nearest)) {
            (_, Some(place)) if !is_inside(&place) => Err(io::Error::new(ErrorKind::PermissionDenied, OutsideFolder)),
            _ => real,
        }
    }
}

impl Files for Folder {
    fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        read_regular(&self.resolve(path)?)
    }

    fn show(&self, path: &str) -> String {
        self.path.join(path).display().to_string()
    }

    fn list(&self, folder: &str) -> io::Result<Vec<String>> {
        let entries = fs::read_dir(self.resolve(folder)?)?;
        let names = entries.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()));
        names.collect()
    }
}

/// Returns the bytes of a regular file.
///
/// # Errors
/// If the file cannot be read. A device or a pipe, which may be endless or have no writer, is `InvalidInput`.
pub fn read_regular(path: &Path) -> io::Result<Vec<u8>> {
    let kind = fs::metadata(path)?;
    if kind.is_dir() {
        return Err(ErrorKind::IsADirectory.into());
    }
    if !kind.is_file() {
        return Err(io::Error::new(ErrorKind::InvalidInput, "the path is a device or a pipe, not a file"));
    }
    fs::read(path)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    /// Returns what reading gives: the content, or `outside`, or the kind of the error.
    fn read(folder: &Folder, path: &str) -> String {
        match folder.read(path) {
            Ok(bytes) => String::from_utf8(bytes).unwrap(),
            Err(error) if OutsideFolder::is_reason_of(&error) => "outside".to_owned(),
            Err(error) => error.kind().to_string(),
        }
    }

    fn tree() -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        let at = |name: &str| root.path().join(name);
        fs::create_dir_all(at("study/data")).unwrap();
        fs::create_dir_all(at("study-2")).unwrap();
        fs::write(at("study/data/own.csv"), "own").unwrap();
        fs::write(at("secret.csv"), "secret").unwrap();
        fs::write(at("study-2/other.csv"), "other").unwrap();
        root
    }

    #[test]
    fn a_study_reads_its_folder_and_below_by_any_path() {
        let root = tree();
        let folder = Folder::new(root.path().join("study"));
        let absolute = root.path().join("study/data/own.csv").display().to_string();
        for path in ["data/own.csv", "./data/../data/own.csv", "../study/data/own.csv", absolute.as_str()] {
            assert_eq!(read(&folder, path), "own", "{path}");
        }
        assert_eq!(folder.list("data").unwrap(), ["own.csv"]);
    }

    #[test]
    fn other_files_are_refused_whether_they_exist_or_not() {
        let root = tree();
        let folder = Folder::new(root.path().join("study"));
        let absolute = root.path().join("secret.csv").display().to_string();
        for path in [
            "../secret.csv",
            "../nothing.csv",
            "data/../../secret.csv",
            "../study-2/other.csv",
            absolute.as_str(),
            "/no",
        ] {
            assert_eq!(read(&folder, path), "outside", "{path}");
        }
        for path in ["data/nothing.csv", "nothing/../../secret.csv"] {
            assert_eq!(read(&folder, path), "entity not found", "{path}");
        }
        assert!(OutsideFolder::is_reason_of(&folder.list("..").unwrap_err()));
        let allowed = folder.reading([root.path().join("study-2"), root.path().join("none")]);
        assert_eq!([read(&allowed, "../study-2/other.csv"), read(&allowed, "../secret.csv")], ["other", "outside"]);
    }

    #[cfg(unix)]
    #[test]
    fn links_are_judged_by_where_they_lead() {
        use std::os::unix::fs::symlink;
        let root = tree();
        let at = |name: &str| root.path().join(name);
        symlink("../../secret.csv", at("study/data/link.csv")).unwrap();
        symlink(root.path(), at("study/up")).unwrap();
        symlink("own.csv", at("study/data/inner.csv")).unwrap();
        symlink("study", at("alias")).unwrap();
        let folder = Folder::new(at("study"));
        assert_eq!(read(&folder, "data/link.csv"), "outside");
        assert_eq!([read(&folder, "up/secret.csv"), read(&folder, "up/nothing.csv")], ["outside", "outside"]);
        assert_eq!(read(&folder, "data/inner.csv"), "own");
        assert_eq!(read(&folder, "up/study/data/own.csv"), "own");
        assert!(OutsideFolder::is_reason_of(&folder.list("up").unwrap_err()));
        // The folder of the study may itself be reached through a link.
        assert_eq!(read(&Folder::new(at("alias")), "data/own.csv"), "own");
        assert_eq!(read(&Folder::new(at("alias")), "data/nothing.csv"), "entity not found");
        assert_eq!(read(&Folder::new(at("alias")), "../secret.csv"), "outside");
    }
}
