//! Shared parts of the command-line programs: error messages, tables, progress, Ctrl-C.

mod command_error;
mod date;
mod eprint;
mod limits;
mod mistake;
mod panics;
mod progress;
mod sparkline;
mod table;
mod write;

pub use command_error::CommandError;
pub use date::date;
pub(crate) use eprint::eprint_line;
pub(crate) use limits::{Limit, cancel_after, cancel_on_signal, exit_after};
pub(crate) use panics::show_each_panic_once;
pub use progress::Progress;
pub use table::{number, table};
pub use write::print;
pub(crate) use write::print_json;
