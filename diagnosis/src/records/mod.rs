//! What was measured: experiments with their channels, noise and unknown initial states, and what the samples alone
//! show.

mod gap;
mod hygiene;
mod quantum;
mod subject;

pub(crate) use gap::{Gap, gap};
pub use hygiene::noise_of;
pub(crate) use quantum::quantum;
pub(crate) use subject::{Local, Measurement, Series, Subject, task_of};
