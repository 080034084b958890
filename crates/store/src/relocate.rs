//! File of a database: creation under a temporary name, merging into one file, restoration after removal.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use mops_output::{is_at, temporary_path};
use rusqlite::{Connection, OpenFlags};

use super::companions::{obstacle, with_companions};
use super::database::{Database, WAITS, is_temporary, prepare};
use super::runs::{RunRow, insert_run};

/// New database under its temporary name.
pub(super) struct Draft {
    temporary: PathBuf,
    path: PathBuf,
    run: i64,
}

impl Database {
    /// Removes the leftover of a run that was killed while it created its database.
    pub(super) fn clear_draft(path: &Path) {
        for left in with_companions(&temporary_path(path)) {
            let _ = fs::remove_file(left);
        }
    }

    /// Creates a new database that contains only this run, under a temporary name and in one transaction.
    /// [`Draft::commit`] renames it, so that no incomplete database is ever visible.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(super) fn draft(path: &Path, run: &RunRow) -> rusqlite::Result<Draft> {
        let temporary = temporary_path(path);
        let mut connection = Connection::open(&temporary)?;
        let transaction = connection.transaction()?;
        prepare(&transaction)?;
        let run = insert_run(&transaction, run)?;
        transaction.commit()?;
        connection.close().map_err(|(_, error)| error)?;
        Ok(Draft { temporary, path: path.to_owned(), run })
    }

    /// Returns true if the database contains no run. Earlier versions created the database in several steps and left
    /// such a file when killed at the start.
    pub(super) fn is_blank(path: &Path) -> bool {
        if obstacle(path).is_some() {
            return false;
        }
        let count = |connection: &Connection, sql: &str| connection.query_row(sql, [], |row| row.get::<_, i64>(0));
        let Ok(connection) = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_WRITE) else { return false };
        match count(&connection, "SELECT count(*) FROM sqlite_schema") {
            Ok(0) => true,
            Ok(_) => matches!(Self::open(path, false), Ok(Some(ours)) if matches!(ours.last_run(), Ok(None))),
            Err(_) => false,
        }
    }

    /// Returns true if the path still names the open database.
    pub(super) fn is_in_place(&self) -> bool {
        self.place.as_ref().is_none_or(|(path, file)| is_at(path, file))
    }

    /// Writes the whole database again if its file was removed; returns `false` if another file has its name.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(super) fn restore(&mut self) -> io::Result<bool> {
        let Some((path, _)) = self.place.as_ref().filter(|(path, file)| !is_at(path, file)) else { return Ok(true) };
        if fs::symlink_metadata(path).is_ok() {
            return Ok(false);
        }
        let path = path.clone();
        let temporary = temporary_path(&path);
        Self::clear_draft(&path);
        let copied = temporary.to_str().ok_or_else(|| io::Error::other("its path is not valid UTF-8"));
        self.connection.execute("VACUUM INTO ?", [copied?]).map_err(io::Error::other)?;
        fs::rename(&temporary, &path)?;
        if let Some(again) = Self::open(&path, true).map_err(io::Error::other)? {
            *self = again;
        }
        Ok(true)
    }

    /// Merges the database into one file, which can be moved; returns `false` if another program has it open.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(super) fn gather(&self) -> rusqlite::Result<bool> {
        let until = Instant::now() + WAITS;
        loop {
            let mode: rusqlite::Result<String> =
                self.connection.pragma_update_and_check(None, "journal_mode", "DELETE", |row| row.get(0));
            match mode {
                Ok(mode) if mode == "delete" => return Ok(true),
                Err(error) if !is_temporary(&error) => return Err(error),
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
    /// Renames the database to its final name and opens it; returns it with the id of its run.
    ///
    /// # Errors
    /// If the database cannot be renamed or opened.
    pub(super) fn commit(self) -> io::Result<(Database, i64)> {
        fs::rename(&self.temporary, &self.path)?;
        let database = Database::open(&self.path, true).map_err(io::Error::other)?;
        Ok((database.ok_or_else(|| io::Error::other("it was replaced immediately"))?, self.run))
    }
}
