//! Storage of the evaluations of a run in `evaluations.sqlite` in its folder. A killed run can be resumed, and a study
//! with other demands can reuse the points. `docs/reference/run-files.md` describes the tables.
//!
//! [`Recorder::open`] locks the folder and opens the database for a run with an [`Identity`]; [`Recorder::run`] stores
//! its points, and
//! [`FinishedRun`] writes its end. [`last_run`] reads the row of the last run in a folder.
//!
//! | module | content |
//! |---|---|
//! | `recorder` | the database of a run, before, during and after the run |
//! | `folder` | the database in the folder of a run |
//! | `identity` | content of a study, and the part of it that determines values |
//! | `memory` | points known to a run, and new ones on their way to the writer |
//! | `writer` | the thread that writes points in batches; reports follow the commit |
//! | `database` | tables, and all statements that read or write them; `runs`, `columns`, `bytes`, `sizes`: their rows and values |
//! | `lock` | one run at a time in a folder |
//! | `open_error` | why a database cannot be opened |
//! | `replace` | an existing database makes room for that of a new run |
//! | `relocate`, `companions` | the file of a database: creation, merging, restoration; the files of SQLite beside it |
//! | `best` | the start of a run that reuses points |
//! | `ending` | the end of a run that the database lacks |

mod best;
mod bytes;
mod columns;
mod companions;
mod database;
mod ending;
mod folder;
mod identity;
mod lock;
mod memory;
mod open_error;
mod recorder;
mod relocate;
mod replace;
mod runs;
mod sizes;
#[cfg(test)]
mod tests;
mod writer;

pub use folder::{FILE, file, last_run};
pub use identity::Identity;
pub use lock::FolderLock;
pub use open_error::OpenError;
pub use recorder::{FinishedRun, Recorder, Start, lock_folder};
pub use runs::{RunRow, RunState};
