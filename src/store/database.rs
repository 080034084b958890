//! The tables of `evaluations.sqlite`, and every statement that reads or writes them.

use std::collections::HashMap;
use std::fs::{self, Metadata};
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use mops_core::file::digest;
use mops_core::{Failure, JobValues, Known, Missed, RowSlopes, Study, Value};
use rusqlite::types::{ToSqlOutput, ValueRef};
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension, Row, ToSql, params};
use serde_json::json;

use super::bytes;
use crate::files::{beside, is_at};

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
    connection: Connection,
    /// Where it is, and the file that had this name when it was opened; none in memory.
    ///
    /// N.B.: not an open file: to close one takes the locks of all connections of this process to it.
    place: Option<(PathBuf, Metadata)>,
}

/// A new database that is not yet at its place.
pub(super) struct Draft {
    beside: PathBuf,
    path: PathBuf,
    run: i64,
}

/// How a run stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RunState {
    /// It goes on, or was killed.
    Running,
    /// It came to its end.
    Converged,
    /// It spent its budget.
    Budget,
    /// It could not improve any more.
    Stalled,
    /// The user ended it.
    Interrupted,
}

impl RunState {
    const ALL: [(Self, &'static str); 5] = [
        (Self::Running, "running"),
        (Self::Converged, "converged"),
        (Self::Budget, "budget"),
        (Self::Stalled, "stalled"),
        (Self::Interrupted, "interrupted"),
    ];

    /// As it stands in the table.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(state, _)| *state == self).map_or("running", |(_, name)| name)
    }

    pub(super) fn of(name: &str) -> Self {
        Self::ALL.iter().find(|(_, known)| *known == name).map_or(Self::Running, |(state, _)| *state)
    }
}

/// A run, as it stands in its table.
#[derive(Debug, Clone)]
pub(crate) struct RunRow {
    pub begun: i64,
    pub state: RunState,
    pub mops: String,
    pub command: String,
    pub home: PathBuf,
    pub settings: Vec<String>,
    pub name: String,
    pub task: String,
    pub text: String,
    pub identity: String,
    pub seed: u64,
    pub solver: String,
    pub max_evaluations: usize,
    pub begin: Option<Vec<f64>>,
    pub evaluations: usize,
}

impl RunRow {
    /// What the run was asked, as a digest: a result with the same one belongs to it.
    pub fn id(&self) -> String {
        digest(self.identity.as_bytes())
    }
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

    /// Removes what a run left that was killed while it made its database.
    pub(super) fn clear_draft(path: &Path) {
        for left in with_companions(&beside(path)) {
            let _ = fs::remove_file(left);
        }
    }

    /// Makes a new one that holds this run and nothing else. Nobody sees a half of it: it is made beside its place, in one
    /// transaction, and moved by [`Draft::settle`].
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn draft(path: &Path, run: &RunRow) -> rusqlite::Result<Draft> {
        let beside = beside(path);
        let mut connection = Connection::open(&beside)?;
        let transaction = connection.transaction()?;
        prepare(&transaction)?;
        let run = begin(&transaction, run)?;
        transaction.commit()?;
        connection.close().map_err(|(_, error)| error)?;
        Ok(Draft { beside, path: path.to_owned(), run })
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
        let beside = beside(&path);
        let _ = fs::remove_file(&beside);
        let copied = beside.to_str().ok_or_else(|| io::Error::other("its path is no text"));
        self.connection.execute("VACUUM INTO ?", [copied?]).map_err(io::Error::other)?;
        fs::rename(&beside, &path)?;
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
    pub(super) fn settle(self) -> io::Result<(Database, i64)> {
        fs::rename(&self.beside, &self.path)?;
        let database = Database::open(&self.path, true).map_err(io::Error::other)?;
        Ok((database.ok_or_else(|| io::Error::other("it was replaced at once"))?, self.run))
    }
}

/// How long others who have the file are waited for.
const WAITS: Duration = Duration::from_secs(5);

/// Whether what went wrong may pass: somebody else has the file, or the disk is full.
pub(super) fn is_passing(error: &rusqlite::Error) -> bool {
    let passing = [ErrorCode::DatabaseBusy, ErrorCode::DatabaseLocked, ErrorCode::DiskFull];
    error.sqlite_error_code().is_some_and(|code| passing.contains(&code))
}

/// A database with the files that SQLite keeps beside it.
pub(super) fn with_companions(path: &Path) -> [PathBuf; 4] {
    ["", "-wal", "-shm", "-journal"].map(|end| {
        let mut name = path.as_os_str().to_owned();
        name.push(end);
        PathBuf::from(name)
    })
}

/// Makes the tables.
fn prepare(connection: &Connection) -> rusqlite::Result<()> {
    connection.pragma_update(None, "application_id", APPLICATION)?;
    connection.pragma_update(None, "user_version", FORMAT)?;
    connection.execute_batch(TABLES)
}

/// Enters a run that begins; its number.
fn begin(connection: &Connection, run: &RunRow) -> rusqlite::Result<i64> {
    connection.execute(
        "INSERT INTO runs (begun, state, mops, command, home, settings, name, task, text, identity, seed, solver, \
         max_evaluations, begin, evaluations, reused) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, 0, 0)",
        params![
            run.begun,
            RunState::Running.name(),
            run.mops,
            run.command,
            Home(&run.home),
            json!(run.settings).to_string(),
            run.name,
            run.task,
            run.text,
            run.identity,
            run.seed.cast_signed(),
            run.solver,
            integer(run.max_evaluations),
            run.begin.as_deref().map(bytes::of_numbers),
        ],
    )?;
    Ok(connection.last_insert_rowid())
}

/// A path in a column: as text, or by its bytes where it is none.
struct Home<'p>(&'p Path);

impl ToSql for Home<'_> {
    fn to_sql(&self) -> rusqlite::Result<ToSqlOutput<'_>> {
        let bytes = self.0.as_os_str().as_encoded_bytes();
        Ok(ToSqlOutput::Borrowed(self.0.to_str().map_or(ValueRef::Blob(bytes), |text| ValueRef::Text(text.as_bytes()))))
    }
}

fn home_of(value: ValueRef<'_>) -> rusqlite::Result<PathBuf> {
    #[cfg(unix)]
    if let ValueRef::Blob(bytes) = value {
        use std::os::unix::ffi::OsStrExt;
        return Ok(PathBuf::from(std::ffi::OsStr::from_bytes(bytes)));
    }
    Ok(PathBuf::from(value.as_str()?))
}

/// Seconds since 1970-01-01 UTC.
pub(super) fn now() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    i64::try_from(since).unwrap_or(i64::MAX)
}

fn run_row(row: &Row<'_>) -> rusqlite::Result<RunRow> {
    Ok(RunRow {
        begun: row.get(0)?,
        state: RunState::of(&row.get::<_, String>(1)?),
        mops: row.get(2)?,
        command: row.get(3)?,
        home: home_of(row.get_ref(4)?)?,
        settings: serde_json::from_str(&row.get::<_, String>(5)?).unwrap_or_default(),
        name: row.get(6)?,
        task: row.get(7)?,
        text: row.get(8)?,
        identity: row.get(9)?,
        seed: row.get::<_, i64>(10)?.cast_unsigned(),
        solver: row.get(11)?,
        max_evaluations: size(row, 12)?,
        begin: row.get_ref(13)?.as_blob_or_null()?.map(bytes::numbers),
        evaluations: size(row, 14)?,
    })
}

fn size(row: &Row<'_>, column: usize) -> rusqlite::Result<usize> {
    Ok(usize::try_from(row.get::<_, i64>(column)?).unwrap_or(0))
}

fn integer(size: usize) -> i64 {
    i64::try_from(size).unwrap_or(i64::MAX)
}

type Columns = (Vec<u8>, Option<String>, Option<String>, Option<Vec<u8>>);

/// What is known of a point, as columns: criteria, notes, failures, residuals.
fn columns(known: &Known, rows: usize) -> Columns {
    let mut criteria = vec![f64::NAN; rows];
    let mut notes = serde_json::Map::new();
    let mut failures = Vec::new();
    let mut residuals: Vec<(usize, &[f64])> = Vec::new();
    for (job, values) in &known.jobs {
        match values {
            Err(failure) => {
                let (kind, at, why) = match failure {
                    Failure::Diverged(t) => ("diverged", Some(t), None),
                    Failure::StepLimit(t) => ("step-limit", Some(t), None),
                    Failure::StepTooSmall(t) => ("step-too-small", Some(t), None),
                    Failure::EventsAccumulate(t, why) => ("events-accumulate", Some(t), Some(why)),
                    Failure::Undefined(why) => ("undefined", None, Some(why)),
                    Failure::RecordLimit(t) => ("record-limit", Some(t), None),
                    Failure::Criterion(why) => ("criterion", None, Some(why)),
                    Failure::Cancelled => continue,
                };
                // As text, which keeps every bit and what is no number.
                failures.push(json!({ "job": job, "kind": kind, "at": at.map(f64::to_string), "why": why }));
            }
            Ok(values) => {
                for (row, value) in values {
                    match value {
                        Err(why) => failures.push(json!({ "row": row, "why": why })),
                        Ok(value) => {
                            criteria[*row] = value.number;
                            let missed = value.missed.map(|missed| missed.horizon.map(|h| h.to_string()));
                            match (value.note, missed) {
                                (None, None) => {}
                                (Some(note), None) => drop(notes.insert(row.to_string(), json!(note))),
                                (note, Some(horizon)) => drop(notes.insert(row.to_string(), json!([note, horizon]))),
                            }
                            if !value.residuals.is_empty() {
                                residuals.push((*row, &value.residuals));
                            }
                        }
                    }
                }
            }
        }
    }
    let text = |value: serde_json::Value| value.to_string();
    (
        bytes::of_numbers(&criteria),
        (!notes.is_empty()).then(|| text(notes.into())),
        (!failures.is_empty()).then(|| text(failures.into())),
        (!residuals.is_empty()).then(|| bytes::of_lists(residuals.into_iter())),
    )
}

/// What the columns of a point say; a job is known if it failed, or as far as its rows have a value or none for a reason.
fn known(row: &Row<'_>, study: &Study, intern: &mut dyn FnMut(&str) -> &'static str) -> rusqlite::Result<Known> {
    let criteria = bytes::numbers(row.get_ref(1)?.as_blob()?);
    let json = |column: usize| -> rusqlite::Result<serde_json::Value> {
        let text = row.get_ref(column)?.as_str_or_null()?;
        Ok(text.and_then(|text| serde_json::from_str(text).ok()).unwrap_or_default())
    };
    let (notes, failures) = (json(2)?, json(3)?);
    let lists = row.get_ref(4)?.as_blob_or_null()?.and_then(bytes::lists).unwrap_or_default();
    let mut residuals: HashMap<usize, Vec<f64>> = lists.into_iter().collect();
    let failures = failures.as_array().cloned().unwrap_or_default();
    let of = |key: &str, index: usize| failures.iter().find(|failure| failure[key].as_u64() == Some(index as u64));

    let mut known = Known::default();
    for job in 0..study.jobs.len() {
        if let Some(failure) = of("job", job) {
            known.jobs.push((job, Err(failure_of(failure))));
            continue;
        }
        let mut value = |index: usize| -> Option<Result<Value, String>> {
            if let Some(why) = of("row", index) {
                return Some(Err(why["why"].as_str().unwrap_or_default().to_owned()));
            }
            let number = *criteria.get(index).filter(|number| number.is_finite())?;
            // A note; or a note and a horizon, where nothing was reached.
            let written = &notes[index.to_string()];
            let missed = written
                .is_array()
                .then(|| Missed { horizon: written[1].as_str().and_then(|horizon| horizon.parse().ok()) });
            let note = written.as_str().or(written[0].as_str()).map(&mut *intern);
            Some(Ok(Value { number, residuals: residuals.remove(&index).unwrap_or_default(), note, missed }))
        };
        let rows = (0..study.rows.len()).filter(|&index| study.rows[index].job == job);
        let values: Vec<_> = rows.filter_map(|index| Some((index, value(index)?))).collect();
        if !values.is_empty() {
            known.jobs.push((job, JobValues::Ok(values)));
        }
    }
    Ok(known)
}

fn failure_of(written: &serde_json::Value) -> Failure {
    let at = written["at"].as_str().and_then(|at| at.parse().ok()).unwrap_or(f64::NAN);
    let why = written["why"].as_str().unwrap_or_default().to_owned();
    match written["kind"].as_str() {
        Some("diverged") => Failure::Diverged(at),
        Some("step-limit") => Failure::StepLimit(at),
        Some("step-too-small") => Failure::StepTooSmall(at),
        Some("events-accumulate") => Failure::EventsAccumulate(at, why),
        Some("record-limit") => Failure::RecordLimit(at),
        Some("criterion") => Failure::Criterion(why),
        _ => Failure::Undefined(why),
    }
}
