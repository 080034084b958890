//! Traces of signals from the dense output of steps, with their tangents.

use mops_core::{
    Analysis, Cancellation, Failure, Job, Plant, Response, Trace,
    model::{Event, WithTangents},
};
use mops_language::{DIRECTIONS, Dual, Dual7, Scalar, enclosure::Enclosure};

use super::integrable::Integrable;
use super::weights::{PERTURBATION, SHARE, perturbed};
use super::{Driven, Sink, Step, Tolerance, integrate};

/// Recorded simulation: the signals and their derivatives in every direction of the scalar.
pub struct Recording {
    /// Signals.
    pub response: Response,
    /// Derivatives of the signals, one response per direction, on the segments of the signals.
    pub tangents: Vec<Response>,
}

/// Runs a simulation over the scalar: returns the analysis and its tangents along the seeds, of which there is at least
/// one.
///
/// # Errors
/// The failure of the simulation.
pub fn tangents_of(
    simulate: impl Fn(&[Dual7]) -> Result<Recording, Failure>,
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
        let parameters: Vec<Dual7> = parameters.iter().enumerate().map(parameter).collect();
        let recording = simulate(&parameters)?;
        analysis.get_or_insert(recording.response);
        tangents.extend(recording.tangents.into_iter().take(seeds.len()).map(Analysis::Time));
    }
    Ok((Analysis::Time(analysis.expect("there is a seed")), tangents))
}

/// Signals to record, the means to cancel the simulation, and the limit on what it records.
pub struct Wanted {
    /// Signals, by index and name.
    pub signals: Vec<(usize, String)>,
    /// Requests the end of the simulation.
    pub cancellation: Cancellation,
    /// Limit on the size of the recording in bytes, tangents included. A segment of a trace is 7 numbers of 8 bytes:
    /// its end, five coefficients, and the derivative of its end.
    pub room: usize,
}

impl From<Vec<(usize, String)>> for Wanted {
    fn from(signals: Vec<(usize, String)>) -> Self {
        Self { signals, cancellation: Cancellation::default(), room: ROOM }
    }
}

/// Default of [`Wanted::room`]: sufficient for 100,000 steps, the default step limit, of a hundred signals.
const ROOM: usize = 512 << 20;

/// Limit on the initial capacity of all traces in bytes; most simulations take few steps.
const FIRST_ROOM: usize = 16 << 20;

/// Size of a segment of a trace in bytes: its end, five coefficients, and the derivative of its end.
const SEGMENT: usize = 7 * size_of::<f64>();

/// Sink that records signals along the steps.
struct Recorder<'a, S> {
    signals: &'a [(usize, String)],
    /// Index of the state that each signal equals, if any.
    shows: Vec<Option<usize>>,
    cancellation: &'a Cancellation,
    /// Bytes recorded so far, and their limit.
    taken: usize,
    room: usize,
    /// Traces of the signals, then of their tangents in each direction.
    traces: Vec<Vec<Trace>>,
    events: Vec<Event>,
    /// Instants of breaks and events, and their derivatives.
    restarts: Vec<(f64, S)>,
    /// States at [`Trace::NODES`].
    states: [Vec<S>; 5],
    resolved: Vec<Resolved>,
    tolerance: &'a Tolerance,
    /// Simulated time, s.
    span: f64,
    /// Bounds of the states over a part of a step.
    bounds: Vec<Enclosure>,
}

/// Resolution of a computed signal by the steps.
#[derive(Debug, Clone, Copy)]
struct Resolved {
    /// Largest absolute value so far.
    size: f64,
    /// Rate at the end of the last step, per s; NaN before the first step.
    slope: f64,
    /// Longest step whose quartic agreed with the signal when compared, s.
    longest: f64,
    /// Largest width of the bounds of the signal over a part of a step so far.
    reach: f64,
    /// Number of parts that may still be halved for their bounds alone.
    looks: usize,
}

/// Width of the bounds of a signal over a part of a step, as a multiple of the spread of its values there, from which
/// something narrow may hide between them, such as a pulse over a position. Bounds of products and quotients of smooth
/// quantities are a few times too wide.
const WIDE: f64 = 8.0;

/// Width of bounds, as a part of the largest width so far, up to which nothing hides: what bounds are too wide by
/// shrinks with the part, and what is sought is as high as the bounds of the first part that contains it.
const NARROW: f64 = 1e-3;

/// Change of a signal between two neighbouring states, relative to its changes over a part, from which it jumps there.
const ROUGH: f64 = 0.25;

/// Number of parts of a signal that are halved in vain in a simulation; each place found gives as many again. A pulse
/// of 1 ms in a step of 10 s takes some 30.
const LOOKS: usize = 64;

/// Part of the simulated time up to which nothing is sought within a step, which bounds the number of bounds that are
/// computed.
const SHORT: f64 = 2e-3;

/// Permitted deviation of the quartic in units of the tolerance: the dense output of the states is no more accurate.
const OFF: f64 = 10.0;

/// Size below which numbers are rounded to fewer digits than others, so that no part of a step is accurate enough.
const SMALLEST: f64 = f64::MIN_POSITIVE / f64::EPSILON;

/// Returns the permitted deviation of a quartic from a signal with values of this size, and of size `largest` so far.
pub(crate) fn allowed(tolerance: &Tolerance, largest: f64, size: f64) -> f64 {
    let Tolerance { relative, absolute, .. } = tolerance;
    OFF * (absolute.unwrap_or(SHARE * relative * largest) + relative * size) + SMALLEST
}

/// Limit on the number of halvings of a step for a signal: parts as short as the resolution of the clock. Rounding ends
/// them before, and so does the size of the recording.
const HALVINGS: u32 = 40;

/// Ratio to the longest compared step beyond which a step is compared again.
const LONGER: f64 = 1.2;

/// Weights of the values at [`Trace::NODES`] in the derivative of their quartic at the first node, for a step of unit
/// length.
const SLOPE: [f64; 5] = [-25.0 / 3.0, 16.0, -12.0, 16.0 / 3.0, -1.0];

/// Weights at the last node: reversed, with opposite sign.
const END_SLOPE: [f64; 5] = [1.0, -16.0 / 3.0, 12.0, -16.0, 25.0 / 3.0];

impl<S: Scalar> Recorder<'_, S> {
    /// Adds a segment that ends at `end` to the traces of a signal.
    fn push(&mut self, index: usize, end: f64, values: &[S; 5]) {
        self.taken += SEGMENT * (1 + S::DIRECTIONS);
        self.traces[0][index].push(end, values.map(Scalar::value));
        for direction in 0..S::DIRECTIONS {
            self.traces[1 + direction][index].push(end, std::array::from_fn(|node| values[node].tangents()[direction]));
        }
    }

    /// Returns the permitted deviation of the quartic of a signal with values of this size. The rule is that of the
    /// states, with the signal's own scale.
    fn allowed(&self, index: usize, size: f64) -> f64 {
        allowed(self.tolerance, self.resolved[index].size, size)
    }

    /// Returns true if the quartic through the values agrees with the signal near both ends, up to the rounding of the
    /// signal. Values that are not finite count as agreeing. `signal` returns the signal at a position, at the state or
    /// at the [`perturbed`] state.
    fn agrees(&self, index: usize, values: &[S; 5], mut signal: impl FnMut(f64, At) -> S) -> bool {
        self.fit(index, values, &mut signal) != Fit::Off
    }

    fn fit(&self, index: usize, values: &[S; 5], mut signal: impl FnMut(f64, At) -> S) -> Fit {
        let checks = Trace::CHECKS.map(|s| signal(s, At::State).value());
        let off = Trace::deviation(values.map(Scalar::value), checks);
        let allowed = self.allowed(index, checks.iter().fold(largest(values), |most, check| most.max(check.abs())));
        // The node at the middle is one of the values.
        if off.is_nan() || off <= allowed {
            return Fit::Quartic;
        }
        let rough = (signal(0.5, At::Perturbed) - values[2]).value().abs();
        let [least, most] = extremes(values);
        match off <= allowed + rough {
            true if rough >= ROUGH * (most - least) => Fit::Jump,
            true => Fit::Quartic,
            false => Fit::Off,
        }
    }

    /// Returns true if the quartic of a step of this length must be compared with the signal. Reasons: the step is
    /// longer than all compared ones, or the derivative of the quartic does not continue that of the last one within
    /// tolerance.
    #[inline]
    fn must_compare(&mut self, index: usize, length: f64, values: &[S; 5]) -> bool {
        let slope = |weights: [f64; 5]| (0..5).map(|k| weights[k] * values[k].value()).sum::<f64>() / length;
        let begin = slope(SLOPE);
        let off = (begin - self.resolved[index].slope).abs() * length;
        self.resolved[index].slope = slope(END_SLOPE);
        length > LONGER * self.resolved[index].longest || off.is_nan() || off > self.allowed(index, largest(values))
    }

    /// Returns true if the bounds of a signal over the part `[from, to]` of a step are so much wider than the values
    /// there that something may hide between them.
    fn hides<P: Integrable<S> + ?Sized>(
        &mut self,
        (step, system): (&Step<S>, &Driven<'_, S, P>),
        index: usize,
        [from, to]: [f64; 2],
        values: &[S; 5],
    ) -> bool {
        if !system.has_bounds() || self.resolved[index].looks == 0 || step.taken <= SHORT * self.span {
            return false;
        }
        let share = step.taken / step.length;
        step.enclose(from * share, to * share, &mut self.bounds);
        let time = [from, to].map(|s| step.start + s * step.taken);
        let over =
            system.enclose_signal(self.signals[index].0, Enclosure::of_time(time[0], time[1]), &self.bounds).value;
        let width = over.high - over.low;
        if !width.is_finite() {
            return false;
        }
        let resolved = &mut self.resolved[index];
        resolved.reach = resolved.reach.max(width);
        let [least, most] = extremes(values);
        let expected = (WIDE * (most - least)).max(NARROW * resolved.reach);
        let hides = width > expected + self.allowed(index, over.high.abs().max(over.low.abs()));
        self.resolved[index].looks -= usize::from(hides);
        hides
    }

    /// Finds the size of what hides in the part `[from, to]` of a step: the accuracy of a signal is relative to its
    /// size.
    fn measure<P: Integrable<S> + ?Sized>(
        &mut self,
        (step, system): (&Step<S>, &Driven<'_, S, P>),
        index: usize,
        [from, to]: [f64; 2],
        halvings: u32,
    ) {
        let which = self.signals[index].0;
        let signal = |t: f64, x: &[S]| system.signal(which, t, x);
        let middle = 0.5 * (from + to);
        for part in [[from, middle], [middle, to]] {
            let mut state = self.states[0].clone();
            let values = Trace::NODES.map(|s| At::State.within(part, s, step, &mut state, &signal));
            let resolved = &mut self.resolved[index];
            resolved.size = resolved.size.max(largest(&values));
            if halvings > 0 && self.hides((step, system), index, part, &values) {
                self.measure((step, system), index, part, halvings - 1);
            }
        }
    }

    /// Adds the part `[from, to]` of a step to the traces of a signal, halved until one quartic per part suffices.
    fn refine<P: Integrable<S> + ?Sized>(
        &mut self,
        (step, system): (&Step<S>, &Driven<'_, S, P>),
        index: usize,
        [from, to]: [f64; 2],
        halvings: u32,
    ) {
        let which = self.signals[index].0;
        let signal = |t: f64, x: &[S]| system.signal(which, t, x);
        let mut state = self.states[0].clone();
        let mut at = |s: f64, at: At| at.within([from, to], s, step, &mut state, &signal);
        let values = Trace::NODES.map(|s| at(s, At::State));
        let ends = halvings == 0 || self.taken > self.room || self.cancellation.requested().is_some();
        let fit = self.fit(index, &values, &mut at);
        if ends || fit != Fit::Off && !self.hides((step, system), index, [from, to], &values) {
            // Where a signal jumps, a quartic would exceed its values.
            let line = |s: f64| values[0] + (values[4] - values[0]) * s;
            let recorded = if fit == Fit::Quartic { values } else { Trace::NODES.map(line) };
            self.push(index, step.start + to * step.taken, &recorded);
            return;
        }
        if fit == Fit::Off {
            self.resolved[index].looks = LOOKS;
        }
        let middle = 0.5 * (from + to);
        for half in [[from, middle], [middle, to]] {
            self.refine((step, system), index, half, halvings - 1);
        }
    }
}

fn extremes<S: Scalar>(values: &[S; 5]) -> [f64; 2] {
    let values = values.map(Scalar::value);
    [values.into_iter().fold(f64::INFINITY, f64::min), values.into_iter().fold(f64::NEG_INFINITY, f64::max)]
}

/// How the quartic through the values of a signal agrees with it.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fit {
    /// Within tolerance, or within the rounding of the signal.
    Quartic,
    /// The rounding of the signal is as large as its changes: it jumps between two neighbouring states.
    Jump,
    /// Not at all.
    Off,
}

/// State at which a signal is evaluated.
#[derive(Debug, Clone, Copy)]
enum At {
    /// State of the step.
    State,
    /// The [`perturbed`] state.
    Perturbed,
}

impl At {
    /// Evaluates a signal at a part `s` of the part `[from, to]` of a step.
    fn within<S: Scalar>(
        self,
        [from, to]: [f64; 2],
        s: f64,
        step: &Step<S>,
        state: &mut [S],
        signal: &impl Fn(f64, &[S]) -> S,
    ) -> S {
        let s = from + s * (to - from);
        step.state(s, state);
        self.signal(step.start + s * step.taken, state, signal)
    }

    fn signal<S: Scalar>(self, t: f64, x: &[S], signal: &impl Fn(f64, &[S]) -> S) -> S {
        match self {
            Self::State => signal(t, x),
            Self::Perturbed => signal(t * (1.0 + PERTURBATION), &perturbed(x)),
        }
    }
}

fn largest<S: Scalar>(values: &[S; 5]) -> f64 {
    values.iter().fold(0.0, |most, value| most.max(value.value().abs()))
}

impl<S: Scalar, P: Integrable<S> + ?Sized> Sink<S, P> for Recorder<'_, S> {
    fn step(&mut self, step: &Step<S>, system: &Driven<'_, S, P>) {
        let computes = self.shows.iter().any(Option::is_none);
        if computes {
            step.states(&Trace::NODES, &mut self.states);
        }
        let end = step.start + step.taken;
        for (i, (signal, _)) in self.signals.iter().enumerate() {
            if let Some(state) = self.shows[i] {
                let value = |node: usize| match computes {
                    true => self.states[node][state],
                    false => step.component(Trace::NODES[node], state),
                };
                self.push(i, end, &std::array::from_fn(value));
                continue;
            }
            let computed = |t: f64, x: &[S]| system.signal(*signal, t, x);
            let time = |s: f64| step.start + s * step.taken;
            let values = system.signal_at(*signal, &Trace::NODES.map(time), &self.states);
            self.resolved[i].size = self.resolved[i].size.max(largest(&values));
            let mut is_resolved = true;
            if self.must_compare(i, step.taken, &values) {
                let mut state = self.states[0].clone();
                let inside = |s: f64, at: At| at.within([0.0, 1.0], s, step, &mut state, &computed);
                is_resolved = self.agrees(i, &values, inside);
                if is_resolved {
                    let longest = &mut self.resolved[i].longest;
                    *longest = longest.max(step.taken);
                }
            }
            let hides = self.hides((step, system), i, [0.0, 1.0], &values);
            if is_resolved && !hides {
                self.push(i, end, &values);
                continue;
            }
            if hides {
                // What is found here is recorded afterwards.
                let looks = self.resolved[i].looks;
                self.measure((step, system), i, [0.0, 1.0], HALVINGS);
                self.resolved[i].looks = looks;
            }
            for half in [[0.0, 0.5], [0.5, 1.0]] {
                self.refine((step, system), i, half, HALVINGS);
            }
        }
    }

    fn ends(&self, t: f64) -> Option<Failure> {
        match self.cancellation.requested() {
            Some(_) => Some(Failure::Cancelled),
            None => (self.taken > self.room).then_some(Failure::RecordLimit(t)),
        }
    }

    fn end(&mut self, t: f64, x: &[S], system: &Driven<'_, S, P>) {
        for (i, (signal, _)) in self.signals.iter().enumerate() {
            // An input jump at the end of the simulation appears in the signals that depend on it directly; a sampled
            // state may jump itself.
            let value = self.shows[i].map_or_else(|| system.signal(*signal, t, x), |state| x[state]);
            let before = self.traces[0][i].last();
            if (value.value() - before).abs() > self.allowed(i, before.abs().max(value.value().abs())) {
                self.traces[0][i].jump_at_end(value.value());
                for direction in 0..S::DIRECTIONS {
                    self.traces[1 + direction][i].jump_at_end(value.tangents()[direction]);
                }
            }
        }
    }

    fn event(&mut self, t: f64, what: &str) {
        // Events without a name switch branches of an expression and are no events of the plant.
        if !what.is_empty() {
            self.taken += size_of::<Event>() + what.len();
            self.events.push(Event { time: t, what: what.to_owned() });
        }
    }

    fn restart(&mut self, t: f64, moves: S) {
        if S::DIRECTIONS > 0 {
            self.restarts.push((t, moves));
        }
    }
}

/// Simulates from 0 to `end` and records signals.
///
/// # Errors
/// The failure of the simulation.
pub fn record<S: Scalar, P: Plant<S>>(
    system: &mut Driven<'_, S, P>,
    start: &[S],
    end: f64,
    tolerance: &Tolerance,
    wanted: &Wanted,
) -> Result<Recording, Failure> {
    let Wanted { signals, cancellation, room } = wanted;
    let traces = (1 + S::DIRECTIONS) * signals.len();
    let segments = (FIRST_ROOM / SEGMENT / traces.max(1)).min(256);
    let mut recorder = Recorder {
        signals,
        shows: signals.iter().map(|(signal, _)| system.shows(*signal)).collect(),
        cancellation,
        taken: 0,
        room: *room,
        traces: vec![vec![Trace::starting_at(0.0, segments); signals.len()]; 1 + S::DIRECTIONS],
        events: Vec::new(),
        restarts: Vec::new(),
        states: std::array::from_fn(|_| start.to_vec()),
        resolved: vec![Resolved { size: 0.0, slope: f64::NAN, longest: 0.0, reach: 0.0, looks: LOOKS }; signals.len()],
        tolerance,
        span: end,
        bounds: Vec::new(),
    };
    let (_, work) = integrate(system, 0.0, end, start, tolerance, &mut recorder)?;
    for direction in 0..S::DIRECTIONS {
        let moves = |&(t, moves): &(f64, S)| (t, moves.tangents()[direction]);
        let moves: Vec<(f64, f64)> = recorder.restarts.iter().map(moves).collect();
        recorder.traces[1 + direction].iter_mut().for_each(|trace| trace.move_knots(&moves));
    }
    let name = |traces: Vec<Trace>| signals.iter().map(|(_, name)| name.clone()).zip(traces).collect();
    let mut traces = recorder.traces.into_iter();
    let response =
        Response { traces: name(traces.next().expect("the signals come first")), events: recorder.events, work };
    let tangents = traces.map(|traces| Response { traces: name(traces), ..Response::default() }).collect();
    Ok(Recording { response, tangents })
}

impl Recording {
    /// Sets the values of all signals just before the start.
    pub fn set_initial<S: Scalar>(&mut self, values: &[S]) {
        for (i, value) in values.iter().enumerate() {
            self.response.traces[i].1.set_initial(value.value());
            for (tangents, &tangent) in self.tangents.iter_mut().zip(value.tangents()) {
                tangents.traces[i].1.set_initial(tangent);
            }
        }
    }
}

/// Returns the signals to record and the cancellation of a job, for a model with these signals.
pub fn wanted(job: &Job<'_>, signals: &[mops_core::Variable]) -> Wanted {
    Wanted {
        signals: job.signals.iter().map(|&i| (i, signals[i].name.clone())).collect(),
        cancellation: job.case.cancellation.clone(),
        room: ROOM,
    }
}
