//! Studies that a catalogue knows by name: files in the program, a folder, or built in Rust.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mops_language::files::Files;

use crate::study::StudyBuilder;

/// Study that a catalogue knows by name: `mops list` shows it, and every command that takes a study file takes the
/// name.
#[derive(Clone)]
#[non_exhaustive]
pub enum CatalogueStudy {
    /// Files in the program.
    Shipped(Shipped),
    /// Folder with `study.toml`, data, and `README.md`.
    Folder(StudyFolder),
    /// Built in Rust.
    Built(BuiltStudy),
}

/// Study shipped with the program: its files, by name.
#[derive(Debug, Clone, Copy)]
pub struct Shipped {
    /// Name.
    pub name: &'static str,
    /// File names and contents: `study.toml`, `README.md` and data.
    pub files: &'static [(&'static str, &'static [u8])],
}

impl Shipped {
    /// Returns the contents of a file.
    pub fn file(&self, name: &str) -> Option<&'static [u8]> {
        self.files.iter().find(|(path, _)| *path == name).map(|(_, bytes)| *bytes)
    }
}

/// Folder with `study.toml`, data, and `README.md`; the study is known by its name in `study.toml`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StudyFolder {
    name: String,
    path: PathBuf,
}

/// Study built in Rust.
#[derive(Clone)]
pub struct BuiltStudy {
    name: String,
    about: String,
    draft: Arc<dyn Fn() -> StudyBuilder + Send + Sync>,
}

impl CatalogueStudy {
    /// Returns the name.
    pub fn name(&self) -> &str {
        match self {
            Self::Shipped(shipped) => shipped.name,
            Self::Folder(folder) => &folder.name,
            Self::Built(built) => &built.name,
        }
    }

    /// Returns where the study comes from, in a few words.
    pub fn origin(&self) -> String {
        match self {
            Self::Shipped(_) => "shipped with the program".to_owned(),
            Self::Folder(folder) => format!("in the folder {}", folder.path.display()),
            Self::Built(_) => "built in Rust".to_owned(),
        }
    }
}

impl StudyFolder {
    /// Returns the study in a folder that has a `study.toml`; `None` for other folders. Without a readable name in the
    /// file, the study has the name of the folder, and its errors are reported when it is read.
    pub fn open(path: &Path) -> Option<Self> {
        let file = path.join("study.toml");
        let folder = path.file_name()?.to_str()?;
        file.is_file()
            .then(|| Self { name: name_in(&file).unwrap_or_else(|| folder.to_owned()), path: path.to_owned() })
    }

    /// Returns the path of `study.toml`.
    pub fn file(&self) -> PathBuf {
        self.path.join("study.toml")
    }

    /// Returns the path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// Returns the name of a study in its file.
fn name_in(file: &Path) -> Option<String> {
    let table: toml::Table = std::fs::read_to_string(file).ok()?.parse().ok()?;
    Some(table.get("study")?.get("name")?.as_str()?.to_owned())
}

impl BuiltStudy {
    /// Creates a study of this name. `about` is one sentence for `mops list`; `draft` describes the study each time it
    /// is opened, and its errors are reported then.
    pub fn new(
        name: impl Into<String>,
        about: impl Into<String>,
        draft: impl Fn() -> StudyBuilder + Send + Sync + 'static,
    ) -> Self {
        Self { name: name.into(), about: about.into(), draft: Arc::new(draft) }
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the sentence for `mops list`.
    pub fn about(&self) -> &str {
        &self.about
    }

    /// Describes the study.
    pub fn draft(&self) -> StudyBuilder {
        (self.draft)()
    }
}

impl From<Shipped> for CatalogueStudy {
    fn from(shipped: Shipped) -> Self {
        Self::Shipped(shipped)
    }
}

impl From<StudyFolder> for CatalogueStudy {
    fn from(folder: StudyFolder) -> Self {
        Self::Folder(folder)
    }
}

impl From<BuiltStudy> for CatalogueStudy {
    fn from(built: BuiltStudy) -> Self {
        Self::Built(built)
    }
}

impl Files for Shipped {
    fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        self.file(path).map(<[u8]>::to_vec).ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    fn show(&self, path: &str) -> String {
        format!("{}/{path}", self.name)
    }
}
