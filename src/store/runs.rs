//! The table of runs: a row for every one that wrote in the folder.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use mops_core::file::digest;
use rusqlite::types::{ToSqlOutput, ValueRef};
use rusqlite::{Connection, Row, ToSql, params};
use serde_json::json;

use super::bytes;
use super::database::{integer, size};
use super::identity::Identity;

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

/// Enters a run that begins; its number.
pub(super) fn begin(connection: &Connection, run: &RunRow) -> rusqlite::Result<i64> {
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

pub(super) fn run_row(row: &Row<'_>) -> rusqlite::Result<RunRow> {
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

/// The row of a run that begins now.
pub(crate) fn row(identity: &Identity) -> RunRow {
    RunRow {
        begun: now(),
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
        begin: None,
        evaluations: 0,
    }
}
