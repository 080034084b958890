//! Table of runs, with one row for every run in the folder.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use mops_file::digest;
use rusqlite::types::{ToSqlOutput, ValueRef};
use rusqlite::{Connection, Row, ToSql, params};
use serde_json::json;

use super::bytes;
use super::identity::Identity;
use super::sizes::{integer, size};

/// State of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunState {
    /// In progress, or killed.
    Running,
    /// Converged.
    Converged,
    /// Budget of evaluations spent.
    Budget,
    /// Time limit reached.
    TimeLimit,
    /// No further improvement.
    Stalled,
    /// Stopped by the user.
    Interrupted,
}

impl RunState {
    const ALL: [(Self, &'static str); 6] = [
        (Self::Running, "running"),
        (Self::Converged, "converged"),
        (Self::Budget, "budget"),
        (Self::TimeLimit, "time-limit"),
        (Self::Stalled, "stalled"),
        (Self::Interrupted, "interrupted"),
    ];

    /// Returns the name in the table.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(state, _)| *state == self).map_or("running", |(_, name)| name)
    }

    pub(super) fn of(name: &str) -> Self {
        Self::ALL.iter().find(|(_, known)| *known == name).map_or(Self::Running, |(state, _)| *state)
    }
}

/// Row of the table of runs.
#[derive(Debug, Clone)]
pub struct RunRow {
    /// Start, in seconds since 1970-01-01 UTC.
    pub started: i64,
    /// State.
    pub state: RunState,
    /// Version of the program.
    pub mops: String,
    /// Command line.
    pub command: String,
    /// Study file, or the name of a study of the catalogue.
    pub home: PathBuf,
    /// Settings of the command line, `--set`.
    pub settings: Vec<String>,
    /// Name of the study.
    pub name: String,
    /// Task of the study.
    pub task: String,
    /// Text of the study file, settings at its end.
    pub text: String,
    /// Identity of the run, as JSON.
    pub identity: String,
    /// Seed of the run.
    pub seed: u64,
    /// Kind of the solver.
    pub solver: String,
    /// Budget: largest number of evaluated points.
    pub max_evaluations: usize,
    /// Initial guess in the unit box, if not the start values.
    pub start_point: Option<Vec<f64>>,
    /// Number of points of the run so far.
    pub evaluations: usize,
}

impl RunRow {
    /// Creates the row of a run that starts now.
    pub fn of(identity: &Identity) -> Self {
        Self {
            started: now(),
            state: RunState::Running,
            mops: env!("CARGO_PKG_VERSION").to_owned(),
            command: std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" "),
            home: PathBuf::new(),
            settings: Vec::new(),
            name: String::new(),
            task: String::new(),
            text: String::new(),
            identity: serde_json::to_string(identity).expect("an identity is JSON"),
            seed: 0,
            solver: String::new(),
            max_evaluations: 0,
            start_point: None,
            evaluations: 0,
        }
    }

    /// Returns the digest of the identity of the run; a result with the same digest belongs to the run.
    pub fn id(&self) -> String {
        digest(self.identity.as_bytes())
    }
}

/// Inserts a new run; returns its id.
pub(super) fn insert_run(connection: &Connection, run: &RunRow) -> rusqlite::Result<i64> {
    connection.execute(
        "INSERT INTO runs (begun, state, mops, command, home, settings, name, task, text, identity, seed, solver, \
         max_evaluations, begin, evaluations, reused) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, 0, 0)",
        params![
            run.started,
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
            run.start_point.as_deref().map(bytes::of_numbers),
        ],
    )?;
    Ok(connection.last_insert_rowid())
}

/// Path in a column: as text, or as bytes if it is not valid UTF-8.
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

/// Returns the time in seconds since 1970-01-01 UTC.
pub(super) fn now() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    i64::try_from(since).unwrap_or(i64::MAX)
}

pub(super) fn run_row(row: &Row<'_>) -> rusqlite::Result<RunRow> {
    Ok(RunRow {
        started: row.get(0)?,
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
        start_point: row.get_ref(13)?.as_blob_or_null()?.map(bytes::numbers),
        evaluations: size(row, 14)?,
    })
}
