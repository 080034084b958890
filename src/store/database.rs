//! The tables of `evaluations.sqlite`, and every statement that reads or writes them.

use std::collections::HashMap;
use std::fs::{self, Metadata};
use std::path::{Path, PathBuf};
use std::time::Duration;

use mops_core::{Known, RowSlopes, Study};
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension, Row, params};

use super::bytes;
use super::columns::{columns, known};
use super::runs::{RunRow, RunState, begin, now, run_row};

/// `PRAGMA application_id`: the letters of mops.
const APPLICATION: i32 = i32::from_be_bytes(*b"mops");

/// Version of the tables.
const FORMAT: i32 = 2;

const TABLES: &str = "
CREATE TABLE runs (
    id INTEGER PRIMARY KEY,
    begun INTEGER NOT NULL,            -- seconds since 1970-01-01 UTC
    ended INTEGER,                     -- the same; NULL while it runs, and where it was killed
    state TEXT NOT NULL,               -- running, converged, budget, stalled, interrupted
    mops TEXT NOT NULL,                -- version of the program
    command TEXT NOT NULL,             -- command line
    home TEXT NOT NULL,                -- the study file, or the name of a shipped study
    settings TEXT NOT NULL,            -- JSON: the --set of the command line
    name TEXT NOT NULL,                -- name of the study
    task TEXT NOT NULL,
    text TEXT NOT NULL,                -- the study file, settings at its end
    identity TEXT NOT NULL,            -- JSON: what the study says and the digests of its data
    seed INTEGER NOT NULL,
    solver TEXT NOT NULL,
    max_evaluations INTEGER NOT NULL,
    begin BLOB,                        -- point of the unit box where it began, float64; NULL: at the start values
    evaluations INTEGER NOT NULL,      -- points of this run so far
    reused INTEGER NOT NULL            -- those of them that were known already
);
CREATE TABLE points (
    id INTEGER PRIMARY KEY,            -- in the order of evaluation
    run INTEGER NOT NULL REFERENCES runs (id),
    tuners BLOB NOT NULL UNIQUE,       -- values of all tuners (and uncertain parameters), float64 little-endian
    criteria BLOB NOT NULL,            -- values of all rows, float64 little-endian; NaN where there is none
    notes TEXT,                        -- JSON: row -> note on its value, or [note, horizon] where it was never reached
    failures TEXT,                     -- JSON: jobs that failed, rows without a value
    residuals BLOB                     -- lists: row, length, float64; absent where none are needed or room is short
);
CREATE TABLE slopes (
    tuners BLOB NOT NULL,              -- the point
    reach REAL NOT NULL,               -- the distance within which they describe it, in the unit box
    slopes BLOB,                       -- lists, one per row and coordinate; NULL: there are none
    PRIMARY KEY (tuners, reach)
) WITHOUT ROWID;
";

/// An open database.
pub(crate) struct Database {
    pub(super) connection: Connection,
    /// Where it is, and the file that had this name when it was opened; none in memory.
    ///
    /// N.B.: not an open file: to close one takes the locks of all connections of this process to it.
    pub(super) place: Option<(PathBuf, Metadata)>,
}

/// A point as it is written.
pub(super) struct PointRow {
    pub tuners: Vec<u64>,
    pub known: Known,
}

/// Points by their tuners.
pub(super) type Points = HashMap<Vec<u64>, Known>;

/// Derivatives by tuners and reach.
pub(super) type Slopes = HashMap<(Vec<u64>, u64), Option<RowSlopes>>;

impl Database {
    /// An empty one in memory.
    ///
    /// # Errors
    /// There is no memory.
    pub(super) fn in_memory() -> rusqlite::Result<Self> {
        let connection = Connection::open_in_memory()?;
        prepare(&connection)?;
        Ok(Self { connection, place: None })
    }

    /// Opens one that is there, to write or only to read; `None` where the file is none of mops, or of another format.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn open(path: &Path, writes: bool) -> rusqlite::Result<Option<Self>> {
        match Self::read(path, writes) {
            Err(error) if error.sqlite_error_code() == Some(ErrorCode::NotADatabase) => Ok(None),
            read => read,
        }
    }

    fn read(path: &Path, writes: bool) -> rusqlite::Result<Option<Self>> {
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

    /// Prepares it for a run that writes often. A killed process loses nothing that is committed; a machine without power,
    /// the last moments.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn write_ahead(&self) -> rusqlite::Result<()> {
        self.connection.pragma_update(None, "journal_mode", "WAL")?;
        self.connection.pragma_update(None, "synchronous", "NORMAL")
    }

    /// Whether a commit waits for others who have the file, instead of failing at once.
    ///
    /// # Errors
    /// Never, as far as is known.
    pub(super) fn waits(&self, waits: bool) -> rusqlite::Result<()> {
        self.connection.busy_timeout(if waits { WAITS } else { Duration::ZERO })
    }

    /// The run that began last.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn last_run(&self) -> rusqlite::Result<Option<RunRow>> {
        let columns = "begun, state, mops, command, home, settings, name, task, text, identity, seed, solver, \
                       max_evaluations, begin, evaluations";
        let sql = format!("SELECT {columns} FROM runs ORDER BY id DESC LIMIT 1");
        self.connection.query_row(&sql, [], run_row).optional()
    }

    /// Number of points.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn count(&self) -> rusqlite::Result<usize> {
        self.connection.query_row("SELECT count(*) FROM points", [], |row| size(row, 0))
    }

    /// Enters a run that begins; its number.
    pub(super) fn begin(&self, run: &RunRow) -> rusqlite::Result<i64> {
        begin(&self.connection, run)
    }

    /// Writes how a run ended; the number of its points where it told of none before.
    pub(super) fn end(&self, run: i64, state: RunState, reused: usize, points: usize) -> rusqlite::Result<()> {
        let sql = "UPDATE runs SET ended = ?, state = ?, reused = ?, \
                   evaluations = CASE WHEN evaluations = 0 THEN ? ELSE evaluations END WHERE id = ?";
        self.connection.execute(sql, params![now(), state.name(), integer(reused), integer(points), run])?;
        // One file, which can be read where nothing can be written; while somebody reads it stays as it is.
        let _ = self.connection.pragma_update(None, "journal_mode", "DELETE");
        Ok(())
    }

    /// Writes points and derivatives, and how many points the run has where that is known, all or nothing.
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
                "INSERT INTO points (run, tuners, criteria, notes, failures, residuals) VALUES (?, ?, ?, ?, ?, ?) \
                 ON CONFLICT (tuners) DO UPDATE SET criteria = excluded.criteria, notes = excluded.notes, \
                 failures = excluded.failures, residuals = coalesce(excluded.residuals, residuals)",
            )?;
            for PointRow { tuners, known } in points {
                let (criteria, notes, failures, residuals) = columns(known, rows);
                insert.execute(params![run, bytes::of_key(tuners), criteria, notes, failures, residuals])?;
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

    /// All points, for a study with the same jobs and rows.
    pub(super) fn points(
        &self,
        study: &Study,
        intern: &mut dyn FnMut(&str) -> &'static str,
    ) -> rusqlite::Result<Points> {
        let mut statement =
            self.connection.prepare("SELECT tuners, criteria, notes, failures, residuals FROM points ORDER BY id")?;
        let mut rows = statement.query([])?;
        let mut points = Points::new();
        while let Some(row) = rows.next()? {
            let key = bytes::numbers(row.get_ref(0)?.as_blob()?);
            points.insert(bytes::key(&key), known(row, study, intern)?);
        }
        Ok(points)
    }

    /// Removes points at which more than so many tuners have values: those at uncertain parameters that are others now.
    pub(super) fn forget_beyond(&self, tuners: usize) -> rusqlite::Result<()> {
        let most = integer(8 * tuners);
        self.connection.execute("DELETE FROM points WHERE length(tuners) > ?", [most])?;
        self.connection.execute("DELETE FROM slopes WHERE length(tuners) > ?", [most])?;
        Ok(())
    }

    /// Removes all derivatives: those along the coordinates of another unit box.
    pub(super) fn forget_slopes(&self) -> rusqlite::Result<()> {
        self.connection.execute("DELETE FROM slopes", []).map(|_| ())
    }

    /// All derivatives.
    pub(super) fn slopes(&self) -> rusqlite::Result<Slopes> {
        let mut statement = self.connection.prepare("SELECT tuners, reach, slopes FROM slopes")?;
        let mut rows = statement.query([])?;
        let mut slopes = Slopes::new();
        while let Some(row) = rows.next()? {
            let key = bytes::key(&bytes::numbers(row.get_ref(0)?.as_blob()?));
            let found = row.get_ref(2)?.as_blob_or_null()?.map(bytes::slopes);
            // What is cut short is not known.
            match found {
                None => slopes.insert((key, row.get::<_, f64>(1)?.to_bits()), None),
                Some(Some(found)) => slopes.insert((key, row.get::<_, f64>(1)?.to_bits()), Some(found)),
                Some(None) => None,
            };
        }
        Ok(slopes)
    }

    /// Bytes that residuals and derivatives take.
    pub(super) fn room_taken(&self) -> rusqlite::Result<usize> {
        let sql = "SELECT (SELECT coalesce(sum(length(residuals)), 0) FROM points) + \
                   (SELECT coalesce(sum(length(slopes)), 0) FROM slopes)";
        self.connection.query_row(sql, [], |row| size(row, 0))
    }
}

/// How long others who have the file are waited for.
pub(super) const WAITS: Duration = Duration::from_secs(5);

/// Whether what went wrong may pass: somebody else has the file, or the disk is full.
pub(super) fn is_passing(error: &rusqlite::Error) -> bool {
    let passing = [ErrorCode::DatabaseBusy, ErrorCode::DatabaseLocked, ErrorCode::DiskFull];
    error.sqlite_error_code().is_some_and(|code| passing.contains(&code))
}

/// Makes the tables.
pub(super) fn prepare(connection: &Connection) -> rusqlite::Result<()> {
    connection.pragma_update(None, "application_id", APPLICATION)?;
    connection.pragma_update(None, "user_version", FORMAT)?;
    connection.execute_batch(TABLES)
}

pub(super) fn size(row: &Row<'_>, column: usize) -> rusqlite::Result<usize> {
    Ok(usize::try_from(row.get::<_, i64>(column)?).unwrap_or(0))
}

pub(super) fn integer(size: usize) -> i64 {
    i64::try_from(size).unwrap_or(i64::MAX)
}
