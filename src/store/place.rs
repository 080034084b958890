//! Where a database is: made beside its place and moved there, moved aside as one file, written again where it was removed.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use rusqlite::{Connection, OpenFlags};

use super::database::{Database, WAITS, is_passing, prepare};
use super::runs::{RunRow, begin};
use crate::files::{is_at, temporary_path};

/// A new database that is not yet at its place.
pub(super) struct Draft {
    temporary: PathBuf,
    path: PathBuf,
    run: i64,
}

/// A database with the files that SQLite keeps beside it.
pub(super) fn with_companions(path: &Path) -> [PathBuf; 4] {
    ["", "-wal", "-shm", "-journal"].map(|end| {
        let mut name = path.as_os_str().to_owned();
        name.push(end);
        PathBuf::from(name)
    })
}

impl Database {
    /// Removes what a run left that was killed while it made its database.
    pub(super) fn clear_draft(path: &Path) {
        for left in with_companions(&temporary_path(path)) {
            let _ = fs::remove_file(left);
        }
    }

    /// Makes a new one that holds this run and nothing else. Nobody sees a half of it: it is made beside its place, in one
    /// transaction, and moved by [`Draft::commit`].
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn draft(path: &Path, run: &RunRow) -> rusqlite::Result<Draft> {
        let temporary = temporary_path(path);
        let mut connection = Connection::open(&temporary)?;
        let transaction = connection.transaction()?;
        prepare(&transaction)?;
        let run = begin(&transaction, run)?;
        transaction.commit()?;
        connection.close().map_err(|(_, error)| error)?;
        Ok(Draft { temporary, path: path.to_owned(), run })
    }

    /// Whether no run was ever entered there: a run was killed while it began, in a version that made its database in parts.
    pub(super) fn is_blank(path: &Path) -> bool {
        let count = |connection: &Connection, sql: &str| connection.query_row(sql, [], |row| row.get::<_, i64>(0));
        let Ok(connection) = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_WRITE) else { return false };
        match count(&connection, "SELECT count(*) FROM sqlite_schema") {
            Ok(0) => true,
            Ok(_) => matches!(Self::open(path, false), Ok(Some(ours)) if matches!(ours.last_run(), Ok(None))),
            Err(_) => false,
        }
    }

    /// Whether its file is still the one that has its name.
    pub(super) fn is_in_place(&self) -> bool {
        self.place.as_ref().is_none_or(|(path, file)| is_at(path, file))
    }

    /// Writes all of it again where its file was removed. `false` where another file has its place.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn restore(&mut self) -> io::Result<bool> {
        let Some((path, _)) = self.place.as_ref().filter(|(path, file)| !is_at(path, file)) else { return Ok(true) };
        if fs::symlink_metadata(path).is_ok() {
            return Ok(false);
        }
        let path = path.clone();
        let temporary = temporary_path(&path);
        let _ = fs::remove_file(&temporary);
        let copied = temporary.to_str().ok_or_else(|| io::Error::other("its path is no text"));
        self.connection.execute("VACUUM INTO ?", [copied?]).map_err(io::Error::other)?;
        fs::rename(&temporary, &path)?;
        if let Some(again) = Self::open(&path, true).map_err(io::Error::other)? {
            *self = again;
        }
        Ok(true)
    }

    /// Brings all of it into one file, which can be moved. `false` where somebody else has it open.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn gather(&self) -> rusqlite::Result<bool> {
        let until = Instant::now() + WAITS;
        loop {
            let mode: rusqlite::Result<String> =
                self.connection.pragma_update_and_check(None, "journal_mode", "DELETE", |row| row.get(0));
            match mode {
                Ok(mode) if mode == "delete" => return Ok(true),
                Err(error) if !is_passing(&error) => return Err(error),
                _ if Instant::now() > until => return Ok(false),
                _ => thread::sleep(Duration::from_millis(50)),
            }
        }
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        Database::clear_draft(&self.path);
    }
}

impl Draft {
    /// Moves the database to its place and opens it there; with the number of its run.
    ///
    /// # Errors
    /// It cannot be moved, or opened.
    pub(super) fn commit(self) -> io::Result<(Database, i64)> {
        fs::rename(&self.temporary, &self.path)?;
        let database = Database::open(&self.path, true).map_err(io::Error::other)?;
        Ok((database.ok_or_else(|| io::Error::other("it was replaced at once"))?, self.run))
    }
}
