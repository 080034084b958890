//! Twins: independent simulations of small plants with several effects at one place, for comparison.
//!
//! The laws follow the documented formulas of the effects. The integrator is the classical Runge-Kutta method with
//! fixed steps; steps end where the input jumps, where a law jumps, and where dry friction sticks or breaks away.

mod actuators;
mod declared;
mod events;
mod friction;
mod joints;
mod law;
mod laws;
mod plants;
mod processes;
mod record;
mod sensors;
mod state;

pub use plants::{BODIES, Body, Joint};

pub use declared::{Command, Declared, Site};
use laws::law;
use record::Record;
use state::Twin;

/// Returns true if the twins have a law with this name and number of parameters.
#[must_use]
pub fn has_law(name: &str, parameters: usize) -> bool {
    law(name, &vec![0.5; parameters]).is_some()
}

/// Returns the measured signals at increasing times (s), by time: the states, then the command. Integration steps have
/// at most the given length, s.
///
/// # Panics
/// An effect has no law, or the plant with its effects has too many states.
#[must_use]
pub fn simulate(
    body: &Body,
    effects: &[Declared<'_>],
    command: &Command<'_>,
    times: &[f64],
    longest: f64,
) -> Vec<Vec<f64>> {
    let mut twin = Twin::new(body, effects, command);
    let mut record = Record::new(&twin);
    let end = times.last().copied().unwrap_or(0.0);
    let mut stops: Vec<f64> = command.knots.iter().map(|knot| knot + twin.delay()).collect();
    stops.extend([0.0, twin.delay()]);
    stops.extend(times);
    stops.retain(|t| (0.0..=end).contains(t));
    stops.sort_by(f64::total_cmp);
    stops.dedup_by(|b, a| *b - *a < 1e-9);
    let mut rows = Vec::new();
    for span in stops.windows(2) {
        twin.enter(span[0], span[1]);
        record.push(&twin);
        let steps = ((span[1] - span[0]) / longest).ceil();
        for _ in 0..steps as usize {
            twin.advance((span[1] - span[0]) / steps, &mut record);
        }
        if times.iter().any(|t| (t - span[1]).abs() < 1e-9) {
            rows.push(record.signals(&twin));
        }
    }
    rows
}
