//! Where a study finds its data files.

use std::io;
use std::path::PathBuf;

use super::read_regular;

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
        Err(io::ErrorKind::Unsupported.into())
    }
}

/// Data files in a folder, usually that of the study file. Devices and pipes are refused: they may have no end.
#[derive(Debug, Clone, Default)]
pub struct Folder(pub PathBuf);

impl Files for Folder {
    fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        read_regular(&self.0.join(path))
    }

    fn show(&self, path: &str) -> String {
        self.0.join(path).display().to_string()
    }

    fn list(&self, folder: &str) -> io::Result<Vec<String>> {
        let path = self.0.join(folder);
        let path = if path.as_os_str().is_empty() { PathBuf::from(".") } else { path };
        let entries = std::fs::read_dir(path)?;
        let names = entries.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()));
        names.collect()
    }
}
