//! Files that a benchmark writes.

use std::path::Path;

use mops::terminal::CommandError;

/// Writes a file of a benchmark; creates the folder if it does not exist.
pub(super) fn write(folder: &Path, name: &str, content: &str) -> Result<(), CommandError> {
    std::fs::create_dir_all(folder).map_err(CommandError::cannot_write(folder))?;
    let path = folder.join(name);
    std::fs::write(&path, content).map_err(CommandError::cannot_write(&path))
}
