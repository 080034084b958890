//! Clocks of sampled systems.

use std::ops::Range;

/// Clock: some states, its memory, change at its instants only.
#[derive(Debug, Clone, PartialEq)]
pub struct Clock {
    /// Indices of the states that are its memory.
    pub memory: Range<usize>,
    /// Time between two instants, s, above 0.
    pub period: f64,
    /// First instant, s.
    pub offset: f64,
    /// Time between an instant and the change of the memory, s, from 0 to the period.
    pub delay: f64,
}

/// Prefix of the name of a value that a clock has computed and not applied yet.
pub const NEXT: &str = "next ";

/// Prefix of the name of memory at which a loop is cut: the value that its clock has computed.
pub const OWN: &str = "own ";
