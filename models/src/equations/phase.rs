//! Phases of the events of a user's model.

/// Phase of an event: the condition that it waits for.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Phase {
    /// The event occurs when its guard falls below this value. The value is 0, or the guard after a reset that left it
    /// at or below 0 and not falling.
    Armed(f64),
    /// The guard became negative: the event is armed again when the guard is positive.
    Passed,
    /// The events have accumulated and states are fixed. The event waits until the weighted rates of these states would
    /// increase the guard.
    AtRest(Vec<(usize, f64)>),
}
