//! Tables of `evaluations.sqlite`, and all statements that read or write them.

use std::collections::HashMap;
use std::fs::{self, Metadata};
use std::path::{Path, PathBuf};
use std::time::Duration;

use mops_core::{
    Study,
    run::{Known, RowSlopes},
};
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension, params};

use super::bytes;
use super::columns::{columns, known};
use super::companions::obstacle;
use super::runs::{RunRow, RunState, insert_run, now, run_row};
use super::sizes::{integer, size};

/// `PRAGMA application_id`: "mops" in ASCII.
const APPLICATION: i32 = i32::from_be_bytes(*b"mops");

/// Version of the tables.
const FORMAT: i32 = 3;

const TABLES: &str = "
CREATE TABLE runs (
    id INTEGER PRIMARY KEY,
    begun INTEGER NOT NULL,            -- seconds since 1970-01-01 UTC
    ended INTEGER,                     -- seconds since 1970-01-01 UTC; NULL while it runs, or after a kill
    state TEXT NOT NULL,               -- running, converged, budget, time-limit, stalled, interrupted
    mops TEXT NOT NULL,                -- version of the program
    command TEXT NOT NULL,             -- command line
    home TEXT NOT NULL,                -- the study file, or the name of a shipped study
    settings TEXT NOT NULL,            -- JSON: the --set of the command line
    name TEXT NOT NULL,                -- name of the study
    task TEXT NOT NULL,
    text TEXT NOT NULL,                -- the study file, settings at its end
    identity TEXT NOT NULL,            -- JSON: content of the study and digests of its data
    seed INTEGER NOT NULL,
    solver TEXT NOT NULL,
    max_evaluations INTEGER NOT NULL,
    begin BLOB,                        -- initial guess in the unit box, float64; NULL: the start values
    evaluations INTEGER NOT NULL,      -- points of this run so far
    reused INTEGER NOT NULL            -- points among them that were stored already
);
CREATE TABLE points (
    id INTEGER PRIMARY KEY,            -- in the order of evaluation
    run INTEGER NOT NULL REFERENCES runs (id),
    tuners BLOB NOT NULL UNIQUE,       -- values of all tuners (and uncertain parameters), float64 little-endian
    criteria BLOB NOT NULL,            -- values of all rows, float64 little-endian; NaN for a missing value
    notes TEXT,                        -- JSON: row -> note on its value, or [note, horizon] for a target never reached
    failures TEXT                      -- JSON: jobs that failed, rows without a value
);
CREATE TABLE slopes (
    tuners BLOB NOT NULL,              -- point of the derivatives
    reach REAL NOT NULL,               -- difference step in the unit box
    slopes BLOB,                       -- derivatives: lists, one per row and coordinate; NULL: none exist
    PRIMARY KEY (tuners, reach)
) WITHOUT ROWID;
";

/// Open database.
pub(super) struct Database {
    pub(super) connection: Connection,
    /// Path, and metadata of the file when it was opened; `None` in memory.
    ///
    /// N.B.: not an open file, as closing it would release the locks of all connections of this process.
    pub(super) place: Option<(PathBuf, Metadata)>,
}

/// Row of the table of points.
pub(super) struct PointRow {
    pub tuners: Vec<u64>,
    pub known: Known,
}

/// Stored points by their key.
pub(super) type Points = HashMap<Vec<u64>, Known>;

/// Stored derivatives by key and difference step.
pub(super) type Slopes = HashMap<(Vec<u64>, u64), Option<RowSlopes>>;

impl Database {
    /// Creates an empty database in memory.
    ///
    /// # Errors
    /// If there is no memory.
    pub(super) fn in_memory() -> rusqlite::Result<Self> {
        let connection = Connection::open_in_memory()?;
        prepare(&connection)?;
        Ok(Self { connection, place: None })
    }

    /// Opens an existing database, for writing or read-only; returns `None` if the file is not from mops or has another
    /// format.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn open(path: &Path, writes: bool) -> rusqlite::Result<Option<Self>> {
        match Self::read(path, writes) {
            Err(error) if error.sqlite_error_code() == Some(ErrorCode::NotADatabase) => Ok(None),
            read => read,
        }
    }

    fn read(path: &Path, writes: bool) -> rusqlite::Result<Option<Self>> {
        if obstacle(path).is_some() {
            return Ok(None);
        }
        let mode = if writes { OpenFlags::SQLITE_OPEN_READ_WRITE } else { OpenFlags::SQLITE_OPEN_READ_ONLY };
        let connection = Connection::open_with_flags(path, mode | OpenFlags::SQLITE_OPEN_NO_MUTEX)?;
        connection.busy_timeout(WAITS)?;
        let pragma = |name: &str| connection.pragma_query_value(None, name, |row| row.get::<_, i32>(0));
        if pragma("application_id")? != APPLICATION || pragma("user_version")? != FORMAT {
            return Ok(None);
        }
        let place = fs::metadata(path).ok().map(|file| (path.to_owned(), file));
        Ok(Some(Self { connection, place }))
    }

    /// Switches to a write-ahead log, for frequent writes. A killed process loses no committed data; a loss of power
    /// may lose the last moments.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(super) fn write_ahead(&self) -> rusqlite::Result<()> {
        self.connection.pragma_update(None, "journal_mode", "WAL")?;
        self.connection.pragma_update(None, "synchronous", "NORMAL")
    }

    /// Sets whether a commit waits for a lock of another program, instead of failing at once.
    ///
    /// # Errors
    /// If SQLite refuses the timeout.
    pub(super) fn waits(&self, waits: bool) -> rusqlite::Result<()> {
        self.connection.busy_timeout(if waits { WAITS } else { Duration::ZERO })
    }

    /// Returns the run that started last.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn last_run(&self) -> rusqlite::Result<Option<RunRow>> {
        let columns = "begun, state, mops, command, home, settings, name, task, text, identity, seed, solver, \
                       max_evaluations, begin, evaluations";
        let sql = format!("SELECT {columns} FROM runs ORDER BY id DESC LIMIT 1");
        self.connection.query_row(&sql, [], run_row).optional()
    }

    /// Returns the number of points.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn count(&self) -> rusqlite::Result<usize> {
        self.connection.query_row("SELECT count(*) FROM points", [], |row| size(row, 0))
    }

    /// Inserts a new run; returns its id.
    pub(super) fn insert_run(&self, run: &RunRow) -> rusqlite::Result<i64> {
        insert_run(&self.connection, run)
    }

    /// Writes the end of a run, and the number of its points if none was written before.
    pub(super) fn end(&self, run: i64, state: RunState, reused: usize, points: usize) -> rusqlite::Result<()> {
        let sql = "UPDATE runs SET ended = ?, state = ?, reused = ?, \
                   evaluations = CASE WHEN evaluations = 0 THEN ? ELSE evaluations END WHERE id = ?";
        self.connection.execute(sql, params![now(), state.name(), integer(reused), integer(points), run])?;
        // Merges the log into one file, which is readable from a read-only folder. Has no effect while another program
        // reads.
        let _ = self.connection.pragma_update(None, "journal_mode", "DELETE");
        Ok(())
    }

    /// Writes points, derivatives and, if given, the number of points of the run in one transaction.
    pub(super) fn write(
        &mut self,
        run: i64,
        rows: usize,
        points: &[PointRow],
        slopes: &[(Vec<u64>, f64, Option<RowSlopes>)],
        evaluations: Option<usize>,
    ) -> rusqlite::Result<()> {
        let transaction = self.connection.transaction()?;
        {
            let mut insert = transaction.prepare(
                "INSERT INTO points (run, tuners, criteria, notes, failures) VALUES (?, ?, ?, ?, ?) \
                 ON CONFLICT (tuners) DO UPDATE SET criteria = excluded.criteria, notes = excluded.notes, \
                 failures = excluded.failures",
            )?;
            for PointRow { tuners, known } in points {
                let (criteria, notes, failures) = columns(known, rows);
                insert.execute(params![run, bytes::of_key(tuners), criteria, notes, failures])?;
            }
            let mut insert =
                transaction.prepare("INSERT OR REPLACE INTO slopes (tuners, reach, slopes) VALUES (?, ?, ?)")?;
            for (tuners, reach, slopes) in slopes {
                insert.execute(params![bytes::of_key(tuners), reach, slopes.as_ref().map(bytes::of_slopes)])?;
            }
            if let Some(evaluations) = evaluations {
                let mut update = transaction.prepare("UPDATE runs SET evaluations = ? WHERE id = ?")?;
                update.execute(params![integer(evaluations), run])?;
            }
        }
        transaction.commit()
    }

    /// Reads all points, for a study with the same jobs and rows.
    pub(super) fn points(
        &self,
        study: &Study,
        intern: &mut dyn FnMut(&str) -> &'static str,
    ) -> rusqlite::Result<Points> {
        let mut statement =
            self.connection.prepare("SELECT tuners, criteria, notes, failures FROM points ORDER BY id")?;
        let mut rows = statement.query([])?;
        let mut points = Points::new();
        while let Some(row) = rows.next()? {
            let key = bytes::numbers(row.get_ref(0)?.as_blob()?);
            points.insert(bytes::key(&key), known(row, study, intern)?);
        }
        Ok(points)
    }

    /// Removes points with more than `tuners` values: those with values of uncertain parameters that have changed.
    pub(super) fn forget_beyond(&self, tuners: usize) -> rusqlite::Result<()> {
        let most = integer(8 * tuners);
        self.connection.execute("DELETE FROM points WHERE length(tuners) > ?", [most])?;
        self.connection.execute("DELETE FROM slopes WHERE length(tuners) > ?", [most])?;
        Ok(())
    }

    /// Removes all derivatives, as they belong to the coordinates of another unit box.
    pub(super) fn forget_slopes(&self) -> rusqlite::Result<()> {
        self.connection.execute("DELETE FROM slopes", []).map(|_| ())
    }

    /// Reads all derivatives.
    pub(super) fn slopes(&self) -> rusqlite::Result<Slopes> {
        let mut statement = self.connection.prepare("SELECT tuners, reach, slopes FROM slopes")?;
        let mut rows = statement.query([])?;
        let mut slopes = Slopes::new();
        while let Some(row) = rows.next()? {
            let key = bytes::key(&bytes::numbers(row.get_ref(0)?.as_blob()?));
            let found = row.get_ref(2)?.as_blob_or_null()?.map(bytes::slopes);
            // Truncated derivatives are ignored.
            match found {
                None => slopes.insert((key, row.get::<_, f64>(1)?.to_bits()), None),
                Some(Some(found)) => slopes.insert((key, row.get::<_, f64>(1)?.to_bits()), Some(found)),
                Some(None) => None,
            };
        }
        Ok(slopes)
    }

    /// Returns the size of the derivatives, in bytes.
    pub(super) fn room_taken(&self) -> rusqlite::Result<usize> {
        let sql = "SELECT coalesce(sum(length(slopes)), 0) FROM slopes";
        self.connection.query_row(sql, [], |row| size(row, 0))
    }
}

/// Time to wait for a lock of another program.
pub(super) const WAITS: Duration = Duration::from_secs(5);

/// Returns true for an error that may be temporary: a lock of another program, or a full disk.
pub(super) fn is_temporary(error: &rusqlite::Error) -> bool {
    let passing = [ErrorCode::DatabaseBusy, ErrorCode::DatabaseLocked, ErrorCode::DiskFull];
    error.sqlite_error_code().is_some_and(|code| passing.contains(&code))
}

/// Returns true for an error that says nothing about the content of a database: of the disk, of its permissions, or
/// temporary.
pub(super) fn is_of_machine(error: &rusqlite::Error) -> bool {
    let of_machine = [
        ErrorCode::SystemIoFailure,
        ErrorCode::PermissionDenied,
        ErrorCode::ReadOnly,
        ErrorCode::CannotOpen,
        ErrorCode::OutOfMemory,
        ErrorCode::FileLockingProtocolFailed,
    ];
    is_temporary(error) || error.sqlite_error_code().is_some_and(|code| of_machine.contains(&code))
}

/// Creates the tables.
pub(super) fn prepare(connection: &Connection) -> rusqlite::Result<()> {
    connection.pragma_update(None, "application_id", APPLICATION)?;
    connection.pragma_update(None, "user_version", FORMAT)?;
    connection.execute_batch(TABLES)
}
