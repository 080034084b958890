//! Files that SQLite keeps beside a database.

use std::fs;
use std::path::{Path, PathBuf};

/// Returns the paths of a database and of the companion files of SQLite.
pub(super) fn with_companions(path: &Path) -> [PathBuf; 4] {
    ["", "-wal", "-shm", "-journal"].map(|end| {
        let mut name = path.as_os_str().to_owned();
        name.push(end);
        PathBuf::from(name)
    })
}

/// Returns the first of a database and its companion files that is not a regular file: SQLite would wait for the writer
/// of a pipe, and a device may have no end.
pub(super) fn obstacle(path: &Path) -> Option<PathBuf> {
    with_companions(path).into_iter().find(|name| fs::metadata(name).is_ok_and(|file| !file.is_file()))
}
