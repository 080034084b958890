//! From steps to traces: the signals of a model along its dense output, with their tangents.

use mops_core::{Along, Analysis, DIRECTIONS, Dual, Event, Failure, Job, Response, Scalar, Trace, WithTangents};

use super::{Dynamics, Sink, Step, Tolerance, integrate};

/// A recorded simulation: the signals, and their derivative along every direction of the scalar.
pub struct Recording {
    /// The signals.
    pub response: Response,
    /// One per direction; on the segments of the signals.
    pub tangents: Vec<Response>,
}

/// What a time-domain model does once, over the scalar.
pub trait Simulate {
    /// Simulates a job; `parameters` stand for those of the job, with tangents.
    ///
    /// # Errors
    /// The failure of the simulation.
    fn simulate<S: Scalar>(&self, job: &Job<'_>, parameters: &[S]) -> Result<Recording, Failure>;
}

/// [`mops_core::Model::analyse`] of a model that can [`Simulate`].
///
/// # Errors
/// The failure of the simulation.
pub fn analyse(model: &impl Simulate, job: &Job<'_>) -> Result<Analysis, Failure> {
    model.simulate(job, job.parameters).map(|recording| Analysis::Time(recording.response))
}

/// [`mops_core::Model::tangents`] of a model that can [`Simulate`]: [`DIRECTIONS`] directions in one simulation.
///
/// # Errors
/// The failure of the simulation.
pub fn tangents(model: &impl Simulate, job: &Job<'_>, seeds: &[Vec<f64>]) -> Result<WithTangents, Failure> {
    if seeds.is_empty() {
        return analyse(model, job).map(|analysis| (analysis, Vec::new()));
    }
    tangents_of(|parameters| model.simulate(job, parameters), job.parameters, seeds)
}

/// The analysis and its tangents along the seeds, of which there is one at least, by a simulation over the scalar.
///
/// # Errors
/// The failure of the simulation.
pub fn tangents_of(
    simulate: impl Fn(&[Along]) -> Result<Recording, Failure>,
    parameters: &[f64],
    seeds: &[Vec<f64>],
) -> Result<WithTangents, Failure> {
    let mut analysis = None;
    let mut tangents = Vec::with_capacity(seeds.len());
    for seeds in seeds.chunks(DIRECTIONS) {
        let parameter = |(i, &value): (usize, &f64)| {
            let tangent = std::array::from_fn(|direction| seeds.get(direction).map_or(0.0, |seed| seed[i]));
            Dual { value, tangent }
        };
        let parameters: Vec<Along> = parameters.iter().enumerate().map(parameter).collect();
        let recording = simulate(&parameters)?;
        analysis.get_or_insert(recording.response);
        tangents.extend(recording.tangents.into_iter().take(seeds.len()).map(Analysis::Time));
    }
    Ok((Analysis::Time(analysis.expect("there is a seed")), tangents))
}

/// Records signals along the steps.
struct Recorder<'a, X, F> {
    signals: &'a [(usize, String)],
    /// The value of a signal, by its index, at a time and a state.
    output: &'a F,
    /// Traces of the signals, then of their tangents along every direction in turn.
    traces: Vec<Vec<Trace>>,
    events: Vec<Event>,
    /// The state at [`Trace::NODES`].
    states: [X; 5],
}

impl<S: Scalar, D: Dynamics<S>, F: Fn(&D, usize, f64, &D::State) -> S> Sink<S, D> for Recorder<'_, D::State, F> {
    fn step(&mut self, step: &Step<D::State>, dynamics: &D) {
        if self.signals.iter().any(|(signal, _)| dynamics.shows(*signal).is_none()) {
            for (state, s) in self.states.iter_mut().zip(Trace::NODES) {
                step.state(s, state);
            }
        }
        let end = step.start + step.taken;
        for (i, (signal, _)) in self.signals.iter().enumerate() {
            let values: [S; 5] = match dynamics.shows(*signal) {
                Some(state) => std::array::from_fn(|node| step.component(Trace::NODES[node], state)),
                None => std::array::from_fn(|node| {
                    let t = step.start + Trace::NODES[node] * step.taken;
                    (self.output)(dynamics, *signal, t, &self.states[node])
                }),
            };
            self.traces[0][i].push(end, values.map(Scalar::value));
            for direction in 0..S::DIRECTIONS {
                self.traces[1 + direction][i].push(end, std::array::from_fn(|node| values[node].tangents()[direction]));
            }
        }
    }

    fn event(&mut self, t: f64, what: &str) {
        // Events without a name are between branches of an expression, nothing that happens to the plant.
        if !what.is_empty() {
            self.events.push(Event { time: t, what: what.to_owned() });
        }
    }
}

/// Simulates from 0 to `end` and records `signals`, by index and name; `output` gives the value of one.
///
/// # Errors
/// The failure of the simulation.
pub fn record<S: Scalar, D: Dynamics<S>>(
    dynamics: &mut D,
    start: D::State,
    end: f64,
    tolerance: &Tolerance,
    signals: &[(usize, String)],
    output: &impl Fn(&D, usize, f64, &D::State) -> S,
) -> Result<Recording, Failure> {
    let mut recorder = Recorder {
        signals,
        output,
        traces: vec![vec![Trace::starting_at(0.0, 256); signals.len()]; 1 + S::DIRECTIONS],
        events: Vec::new(),
        states: std::array::from_fn(|_| start.clone()),
    };
    let (_, work) = integrate(dynamics, 0.0, end, start, tolerance, &mut recorder)?;
    let name = |traces: Vec<Trace>| signals.iter().map(|(_, name)| name.clone()).zip(traces).collect();
    let mut traces = recorder.traces.into_iter();
    let response =
        Response { traces: name(traces.next().expect("the signals come first")), events: recorder.events, work };
    let tangents = traces.map(|traces| Response { traces: name(traces), ..Response::default() }).collect();
    Ok(Recording { response, tangents })
}

/// Indices and names of the signals that a job wants.
pub fn wanted(job: &Job<'_>, signals: &[mops_core::Variable]) -> Vec<(usize, String)> {
    job.signals.iter().map(|&i| (i, signals[i].name.clone())).collect()
}
