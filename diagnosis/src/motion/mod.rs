//! The motion of a fitted model, linearised along it: what forces and candidates change in the outputs, and what the
//! records can show of them.

mod coverage;
mod ports;
mod sizes;
mod trace;
mod trajectory;

pub(crate) use coverage::is_covered;
pub(crate) use ports::{PortIndex, port_index};
#[cfg(test)]
pub(crate) use sizes::relative_sizes;
pub(crate) use sizes::{sizes, sizes_for};
pub(crate) use trace::{View, between};
pub(crate) use trajectory::Trajectory;
