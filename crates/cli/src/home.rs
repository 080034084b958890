//! Locations of studies: files, shipped and built studies.

use std::path::PathBuf;

use mops_core::catalogue::{BuiltStudy, CatalogueStudy, Shipped};

/// Location of a study and its data.
pub(super) enum Home {
    /// Study file; data paths are relative to its folder.
    File(PathBuf),
    /// Files included in the program.
    Shipped(Shipped),
    /// Study built in Rust.
    Built(BuiltStudy),
}

impl Home {
    /// Returns the location as a database records it: an absolute path, or the name of a study of the catalogue.
    pub(super) fn recorded(&self) -> PathBuf {
        match self {
            Self::Shipped(shipped) => PathBuf::from(shipped.name),
            Self::Built(built) => PathBuf::from(built.name()),
            Self::File(path) => std::path::absolute(path).unwrap_or_else(|_| path.clone()),
        }
    }

    /// Returns the location of a study of the catalogue.
    pub(super) fn of(known: &CatalogueStudy) -> Self {
        match known {
            CatalogueStudy::Shipped(shipped) => Self::Shipped(*shipped),
            CatalogueStudy::Folder(folder) => Self::File(folder.file()),
            CatalogueStudy::Built(built) => Self::Built(built.clone()),
            other => unreachable!("`{}` is an unknown sort of study", other.name()),
        }
    }
}
