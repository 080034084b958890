//! What was measured: experiments with their channels, noise and unknown initial states, and what the samples alone
//! show.

mod gap;
mod hygiene;
mod measurement;
mod quantum;
mod sensor_noise;
mod subject;

pub(crate) use gap::{Gap, gap};
pub use hygiene::noise_of;
pub(crate) use measurement::{Local, Measurement, Series};
pub(crate) use quantum::quantum;
#[cfg(test)]
pub(crate) use sensor_noise::SensorNoise;
pub(crate) use subject::{Subject, task_of};
