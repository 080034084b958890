//! Twins: independent simulations of small plants with several effects at one place, for comparison.
//!
//! The laws follow the documented formulas of the effects. The integrator is the classical Runge-Kutta method with
//! fixed steps; steps end where the input jumps, where a law jumps, and where dry friction sticks or breaks away.

mod actuators;
mod events;
mod friction;
mod joints;
mod law;
mod plants;
mod processes;
mod record;
mod sensors;
mod state;

pub use plants::{BODIES, Body, Joint};

use law::Law;
use record::Record;
use state::Twin;

/// Place of an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Site {
    /// Joint, by its index.
    Joint(usize),
    /// State in whose equation a term acts, by its index.
    Process(usize),
    /// Place between the command and the plant.
    Actuator,
    /// Place between a signal and its measurement: the index of a state, or the number of states for the input that
    /// acts.
    Sensor(usize),
}

/// Effect at a place.
#[derive(Debug, Clone, Copy)]
pub struct Declared<'a> {
    /// Name in the catalogue.
    pub name: &'a str,
    /// Place.
    pub site: Site,
    /// Second place, for an effect that has one.
    pub companion: Option<Site>,
    /// True for a force between two joints, with the reaction at the second.
    pub is_mutual: bool,
    /// Values of the parameters, in the order of the catalogue.
    pub parameters: &'a [f64],
}

/// Input of a simulation.
pub struct Command<'a> {
    /// Value at a time, s.
    pub value: &'a dyn Fn(f64) -> f64,
    /// Value before time 0.
    pub before: f64,
    /// Times at which the input jumps or bends, s.
    pub knots: &'a [f64],
}

/// Returns the law of an effect; `None` for an unknown name or number of parameters.
fn law(name: &str, parameters: &[f64]) -> Option<Law> {
    let kinds = [friction::law, joints::law, processes::law, actuators::law, sensors::law];
    kinds.iter().find_map(|law| law(name, parameters))
}

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
