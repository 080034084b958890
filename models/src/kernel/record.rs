//! From steps to traces: the signals of a model along its dense output.

use mops_core::{Event, Response, Trace};

use super::{Dynamics, Sink, Step, Tolerance, integrate};
use mops_core::Failure;

/// Records signals along the steps.
struct Recorder<'a, D: Dynamics<f64>, F> {
    traces: Vec<(String, Trace)>,
    events: Vec<Event>,
    /// Writes the wanted signals for a time and a state.
    outputs: &'a F,
    state: D::State,
    values: Vec<[f64; 5]>,
    row: Vec<f64>,
}

impl<D: Dynamics<f64>, F: Fn(&D, f64, &D::State, &mut [f64])> Sink<f64, D> for Recorder<'_, D, F> {
    fn step(&mut self, step: &Step<D::State>, dynamics: &D) {
        for (node, s) in Trace::NODES.into_iter().enumerate() {
            step.state(s, &mut self.state);
            (self.outputs)(dynamics, step.start + s * step.taken, &self.state, &mut self.row);
            for (values, value) in self.values.iter_mut().zip(&self.row) {
                values[node] = *value;
            }
        }
        for ((_, trace), values) in self.traces.iter_mut().zip(&self.values) {
            trace.push(step.start + step.taken, *values);
        }
    }

    fn event(&mut self, t: f64, what: &'static str) {
        self.events.push(Event { time: t, what: what.to_owned() });
    }
}

/// Simulates from 0 to `end` and records the signals `names`, which `outputs` writes in that order.
///
/// # Errors
/// The failure of the simulation.
pub fn record<D: Dynamics<f64>>(
    dynamics: &mut D,
    start: D::State,
    end: f64,
    tolerance: &Tolerance,
    names: impl Iterator<Item = String>,
    outputs: &impl Fn(&D, f64, &D::State, &mut [f64]),
) -> Result<Response, Failure> {
    let traces: Vec<(String, Trace)> = names.map(|name| (name, Trace::starting_at(0.0, 256))).collect();
    let count = traces.len();
    let mut recorder = Recorder {
        traces,
        events: Vec::new(),
        outputs,
        state: start.clone(),
        values: vec![[0.0; 5]; count],
        row: vec![0.0; count],
    };
    let (_, work) = integrate(dynamics, 0.0, end, start, tolerance, &mut recorder)?;
    Ok(Response { traces: recorder.traces, events: recorder.events, work })
}
