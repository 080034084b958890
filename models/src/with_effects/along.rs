//! Linearisation along a simulation: response of the states and signals of a model with effects to small forces at the
//! ports.

use std::ops::Range;

use mops_core::{Cancellation, Failure, Instant, Job, Plant};
use mops_language::{DIRECTIONS, Dual, Dual7, Scalar};
use mops_linear::Clock;
use nalgebra::DMatrix;

use super::model::WithEffects;
use super::plant::{Affected, fixed};
use crate::kernel::{Driven, Sink, Step, integrate_for, is_due};

/// Simulation with its linearisation along it.
///
/// The linearised states are those of the plant, those of the effects, 8 for every delayed quantity, and the values
/// that clocks have computed and not yet passed on to their memory.
#[derive(Debug, Clone)]
pub struct Along {
    /// Chosen times.
    pub moments: Vec<Moment>,
    /// Instants at which clocks sample or change their memory, in order.
    pub ticks: Vec<Tick>,
}

/// Time of a simulation with its linearisation `dz' = A dz + B db`, `dy = C dz + D db`. The vector `z` contains the
/// linearised states, `b` the commanded inputs, then the forces.
#[derive(Debug, Clone)]
pub struct Moment {
    /// Time, s.
    pub t: f64,
    /// States of the plant, then those of the effects.
    pub x: Vec<f64>,
    /// Rates of the states.
    pub rates: Vec<f64>,
    /// Commanded inputs.
    pub u: Vec<f64>,
    /// Requested signals.
    pub y: Vec<f64>,
    /// Joints with dry friction.
    pub sliding: Vec<Sliding>,
    /// State matrix `A`. A stuck joint creeps: it slides with a friction proportional to the speed that reaches the
    /// largest holding force at 1e-4 of its typical speed. A joint that takes no force could never break loose.
    pub a: DMatrix<f64>,
    /// Input matrix `B`.
    pub b: DMatrix<f64>,
    /// Output matrix `C`.
    pub c: DMatrix<f64>,
    /// Feedthrough matrix `D`.
    pub d: DMatrix<f64>,
}

/// Instant of clocks: the linearised states become `M dz + N db`.
#[derive(Debug, Clone)]
pub struct Tick {
    /// Time, s.
    pub t: f64,
    /// Matrix `M`.
    pub states: DMatrix<f64>,
    /// Matrix `N`.
    pub inputs: DMatrix<f64>,
}

/// Joint with dry friction at an instant.
#[derive(Debug, Clone, Copy)]
pub struct Sliding {
    /// Speed, as a state.
    pub velocity: usize,
    /// 1 if the joint slides forward, -1 if backward, 0 if it is stuck.
    pub direction: f64,
    /// How many times it has come to rest so far.
    pub rests: usize,
}

/// States at chosen times, with the mode of the step.
struct Looks<'t> {
    times: &'t [f64],
    cancellation: &'t Cancellation,
    next: usize,
    sliding: Vec<Sliding>,
    found: Vec<Look>,
}

struct Look {
    t: f64,
    x: Vec<f64>,
    u: Vec<f64>,
    /// External forces.
    w: Vec<f64>,
    contacts: super::contacts::Contacts,
    sliding: Vec<Sliding>,
    /// Delayed values.
    delayed: Vec<f64>,
    /// Contact and hysteresis state of each effect.
    effects: Vec<(Option<bool>, Vec<f64>)>,
}

impl Sink<f64, Affected<'_, f64>> for Looks<'_> {
    fn ends(&self, _: f64) -> Option<Failure> {
        self.cancellation.requested().map(|_| Failure::Cancelled)
    }

    fn step(&mut self, step: &Step<f64>, system: &Driven<'_, f64, Affected<'_, f64>>) {
        let plant = &system.plant;
        let end = step.start + step.taken;
        let before = std::mem::take(&mut self.sliding);
        let now = plant.contacts.directions().enumerate().map(|(k, (velocity, direction))| {
            let rests =
                before.get(k).map_or(0, |was| was.rests + usize::from(direction == 0.0 && was.direction != 0.0));
            Sliding { velocity, direction, rests }
        });
        self.sliding = now.collect();
        let mut x = vec![0.0; plant.size()];
        while self.next < self.times.len() && self.times[self.next] <= end + 1e-9 * (1.0 + end.abs()) {
            let t = self.times[self.next];
            let s = if step.taken > 0.0 { ((t - step.start) / step.taken).clamp(0.0, 1.0) } else { 1.0 };
            step.state(s, &mut x);
            let [u, w] = system.inputs_at(t.clamp(step.start, end));
            self.found.push(Look {
                t,
                x: x.clone(),
                u,
                w,
                delayed: plant.memory().map_or_else(Vec::new, |memory| memory.delayed(system.time(t))),
                contacts: plant.contacts.clone(),
                sliding: self.sliding.clone(),
                effects: plant.effects.iter().map(|effect| (effect.closed, effect.hysteresis.clone())).collect(),
            });
            self.next += 1;
        }
    }
}

/// What clocks do at an instant.
#[derive(Debug, Clone, PartialEq)]
struct Due {
    t: f64,
    /// Clocks whose computed values reach their memory.
    arrive: Vec<usize>,
    /// Clocks that sample.
    sample: Vec<usize>,
}

/// Returns the instants of clocks after the start up to `end`, for a simulation that begins at the clock time `begins`.
fn instants(clocks: &[Clock], begins: f64, end: f64) -> Vec<Due> {
    let mut all: Vec<(f64, usize, bool)> = Vec::new();
    for (k, clock) in clocks.iter().enumerate() {
        let first = ((begins - clock.offset) / clock.period).floor().max(0.0) - 1.0;
        let numbers = (0_u32..).map(|j| first + f64::from(j)).filter(|&number| number >= 0.0);
        let times = numbers.map(|number| clock.offset + number * clock.period - begins);
        for t in times.take_while(|&t| t <= end) {
            let arrival = (clock.delay > 0.0).then_some((t + clock.delay, k, false));
            all.extend(arrival.into_iter().chain([(t, k, true)]).filter(|(t, ..)| *t > 0.0 && *t <= end));
        }
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut due: Vec<Due> = Vec::new();
    for (t, clock, samples) in all {
        if due.last().is_none_or(|last| !is_due(t, last.t)) {
            due.push(Due { t, arrive: Vec::new(), sample: Vec::new() });
        }
        if let Some(last) = due.last_mut() {
            if samples { &mut last.sample } else { &mut last.arrive }.push(clock);
        }
    }
    due
}

impl WithEffects {
    /// Returns the clocks of the model at these values of its parameters and those of the effects.
    fn clocks(&self, parameters: &[f64]) -> Result<Vec<Clock>, Failure> {
        self.model.clocks(&parameters[..self.own()])
    }

    /// Returns the instants after the start at which clocks sample or change their memory, s.
    ///
    /// # Errors
    /// The model is not defined for the parameters.
    pub fn instants(&self, job: &Job<'_>) -> Result<Vec<f64>, Failure> {
        let clocks = self.clocks(job.parameters)?;
        Ok(instants(&clocks, job.case.begins, job.horizon).into_iter().map(|due| due.t).collect())
    }

    /// Linearises the model at increasing times along a simulation, for the signals of the job, and at the instants of
    /// its clocks.
    ///
    /// # Errors
    /// The failure of the simulation.
    pub fn along(&self, job: &Job<'_>, times: &[f64]) -> Result<Along, Failure> {
        self.check_disturbances(job.case)?;
        let acting = self.acting(job.parameters);
        let inputs = self.inputs(&acting, job, job.parameters)?;
        let mut driven = Driven::new(self.affected(&acting, job, job.parameters)?, inputs, &[]);
        let start = driven.begin()?;
        let end = times.last().copied().unwrap_or(job.horizon).max(job.horizon);
        let clocks = self.clocks(job.parameters)?;
        let due = instants(&clocks, job.case.begins, end);
        let mut all: Vec<f64> = times.iter().copied().chain(due.iter().map(|due| due.t)).collect();
        all.sort_by(f64::total_cmp);
        let mut looks = Looks {
            times: &all,
            cancellation: &job.case.cancellation,
            next: 0,
            sliding: Vec::new(),
            found: Vec::with_capacity(all.len()),
        };
        integrate_for(&mut driven, (0.0, end), &start, &self.tolerance(), &mut looks)?;

        let parameters: Vec<Dual7> = job.parameters.iter().map(|&p| p.into()).collect();
        let inputs = self.inputs(&acting, job, &parameters)?;
        let mut tangent = Driven::new(self.affected(&acting, job, &parameters)?, inputs, &[]);
        tangent.begin()?;
        let looks = looks.found;
        let typical = |state: usize| {
            #[allow(clippy::cast_precision_loss)]
            let count = looks.len().max(1) as f64;
            (looks.iter().map(|look| look.x[state] * look.x[state]).sum::<f64>() / count).sqrt()
        };
        let speeds: Vec<f64> = (0..driven.plant.size()).map(typical).collect();
        let delays = driven.plant.memory().map_or_else(Vec::new, |memory| memory.delays());
        let layout = Layout::new(speeds.len(), &delays, &clocks);
        let mut system = Linear { tangent: &mut tangent.plant, begins: job.case.begins, layout: &layout };
        let mut along = Along { moments: Vec::with_capacity(times.len()), ticks: Vec::with_capacity(due.len()) };
        let (mut times, mut due) = (times.iter().peekable(), due.iter().peekable());
        for look in &looks {
            if let Some(due) = due.next_if(|due| due.t == look.t) {
                along.ticks.push(system.tick(look, due));
            } else if times.next_if(|&&t| t == look.t).is_some() {
                along.moments.push(system.moment(look, &speeds, job.signals));
            }
        }
        Ok(along)
    }

    /// Returns the rate that a unit force at each balance adds to its state at the beginning of a simulation.
    ///
    /// # Errors
    /// The model cannot start.
    pub fn mobilities(&self, job: &Job<'_>) -> Result<Vec<f64>, Failure> {
        self.bare_mobilities(job, job.parameters)
    }
}

/// Places of the linearised states.
struct Layout {
    /// Number of states of plant and effects.
    states: usize,
    /// Delays, s.
    delays: Vec<f64>,
    /// Memory of each clock, and the first of its values that are on their way, if it computes for some time.
    clocks: Vec<(Range<usize>, Option<usize>)>,
    /// Number of linearised states.
    size: usize,
}

impl Layout {
    fn new(states: usize, delays: &[f64], clocks: &[Clock]) -> Self {
        let mut size = states + LINE * delays.len();
        let of_clock = |clock: &Clock| {
            let first = (clock.delay > 0.0).then_some(size);
            size += first.map_or(0, |_| clock.memory.len());
            (clock.memory.clone(), first)
        };
        let clocks = clocks.iter().map(of_clock).collect();
        Self { states, delays: delays.to_vec(), clocks, size }
    }

    /// Returns the states of a delay line.
    fn line(&self, delay: usize) -> Range<usize> {
        self.states + LINE * delay..self.states + LINE * (delay + 1)
    }
}

/// Number of states of a delay line: the Pade approximant of this order is accurate to 1 % up to `w T` of about 8.
const LINE: usize = 8;

/// Returns the rate of state `i` of a delay line with a delay of 1 s, `m_i' = sum_j A_ij m_j + B_i z`; the output is
/// the sum of the states.
///
/// Source: A. Voelker, I. Kajic, C. Eliasmith, Legendre memory units, NeurIPS 2019, equation 2.
fn line_rate(i: usize) -> ([f64; LINE], f64) {
    #[allow(clippy::cast_precision_loss)]
    let factor = (2 * i + 1) as f64;
    let sign = |odd: bool| if odd { -1.0 } else { 1.0 };
    (
        std::array::from_fn(|j| factor * if i < j { -1.0 } else { sign((i - j).is_multiple_of(2)) }),
        factor * sign(!i.is_multiple_of(2)),
    )
}

/// Share of its typical speed at which a stuck joint creeps under the largest force that holds it.
const CREEP: f64 = 1e-4;

/// Linear system at the instants of a simulation.
struct Linear<'l, 'a> {
    tangent: &'l mut Affected<'a, Dual7>,
    begins: f64,
    layout: &'l Layout,
}

impl Linear<'_, '_> {
    /// Returns the derivatives of what `of` evaluates with respect to the states, inputs, forces and delayed values,
    /// and its values.
    fn slopes(
        &mut self,
        look: &Look,
        of: impl Fn(&mut Affected<'_, Dual7>, &Instant<'_, Dual7>) -> Vec<Dual7>,
    ) -> (DMatrix<f64>, Vec<f64>) {
        let base: Vec<f64> = [&look.x, &look.u, &look.w, &look.delayed].into_iter().flatten().copied().collect();
        let mut slopes = DMatrix::zeros(0, base.len());
        let mut values = Vec::new();
        for first in (0..base.len()).step_by(DIRECTIONS) {
            let seeded = |(j, &value): (usize, &f64)| {
                let direction = j.wrapping_sub(first);
                if direction < DIRECTIONS { Dual::variable(value, direction) } else { Dual::from(value) }
            };
            let all: Vec<Dual7> = base.iter().enumerate().map(seeded).collect();
            let (x, rest) = all.split_at(look.x.len());
            let (u, rest) = rest.split_at(look.u.len());
            let (w, delayed) = rest.split_at(look.w.len());
            if let Some(memory) = self.tangent.memory_mut() {
                memory.hold(delayed);
            }
            let found = of(self.tangent, &Instant { t: look.t + self.begins, x, u, w });
            if first == 0 {
                slopes = DMatrix::zeros(found.len(), base.len());
                values = found.iter().map(|value| value.value()).collect();
            }
            for (i, row) in found.iter().enumerate() {
                for j in first..base.len().min(first + DIRECTIONS) {
                    slopes[(i, j)] = row.tangents()[j - first];
                }
            }
        }
        (slopes, values)
    }

    /// Splits rows of slopes into those by the linearised states, and those by inputs and forces.
    fn split(&self, slopes: &DMatrix<f64>, inputs: usize) -> [DMatrix<f64>; 2] {
        let (n, rows) = (self.layout.states, slopes.nrows());
        let mut by_states = DMatrix::zeros(rows, self.layout.size);
        by_states.view_mut((0, 0), (rows, n)).copy_from(&slopes.view((0, 0), (rows, n)));
        for delay in 0..self.layout.delays.len() {
            for state in self.layout.line(delay) {
                by_states.set_column(state, &slopes.column(n + inputs + delay));
            }
        }
        [by_states, slopes.view((0, n), (rows, inputs)).into_owned()]
    }

    fn moment(&mut self, look: &Look, speeds: &[f64], signals: &[usize]) -> Moment {
        let (n, inputs) = (look.x.len(), look.u.len() + look.w.len());
        let constant = |values: &[f64]| values.iter().map(|&v| Dual7::from(v)).collect::<Vec<_>>();
        let [x, u, w] = [&look.x, &look.u, &look.w].map(|values| constant(values));
        let here = Instant { t: look.t + self.begins, x: &x, u: &u, w: &w };
        self.tangent.take(&look.contacts, &look.effects);
        let kept = self.tangent.holding(&fixed(&here));
        if let Some(memory) = self.tangent.memory_mut() {
            memory.hold(&constant(&look.delayed));
        }
        let fixed_rates = (!kept.is_empty()).then(|| self.tangent.look(&here, &[]).0);
        self.tangent.take(&look.contacts.sliding(), &look.effects);
        let (mut slopes, values) = self.slopes(look, |plant, at| {
            let (mut all, outputs) = plant.look(at, signals);
            all.extend(outputs);
            all.extend(plant.memory().map_or_else(Vec::new, |memory| memory.past(at)));
            all
        });
        let (rates, outputs) = values.split_at(n);
        let mut rates = rates.to_vec();
        if let Some(fixed_rates) = fixed_rates {
            rates.iter_mut().zip(&fixed_rates).for_each(|(r, d)| *r = d.value());
        }
        for (w, velocity, most) in kept {
            let slope = most / (CREEP * speeds[velocity]);
            if slope.is_finite() {
                let forward = self.tangent.forward(w);
                for i in 0..n {
                    let creep = slope * forward * slopes[(i, n + look.u.len() + w)];
                    slopes[(i, velocity)] -= creep;
                }
            }
        }
        let [by_states, by_inputs] = self.split(&slopes, inputs);
        let size = self.layout.size;
        let (mut a, mut b) = (DMatrix::zeros(size, size), DMatrix::zeros(size, inputs));
        a.view_mut((0, 0), (n, size)).copy_from(&by_states.view((0, 0), (n, size)));
        b.view_mut((0, 0), (n, inputs)).copy_from(&by_inputs.view((0, 0), (n, inputs)));
        for (delay, time) in self.layout.delays.iter().enumerate() {
            let past = n + signals.len() + delay;
            let line = self.layout.line(delay);
            for (i, row) in line.clone().enumerate() {
                let (of_line, of_past) = line_rate(i);
                a.set_row(row, &(by_states.row(past) * (of_past / time)));
                b.set_row(row, &(by_inputs.row(past) * (of_past / time)));
                line.clone().zip(of_line).for_each(|(column, rate)| a[(row, column)] += rate / time);
            }
        }
        Moment {
            t: look.t,
            sliding: look.sliding.clone(),
            x: look.x.clone(),
            rates,
            u: look.u.clone(),
            y: outputs[..signals.len()].to_vec(),
            a,
            b,
            c: by_states.view((n, 0), (signals.len(), size)).into_owned(),
            d: by_inputs.view((n, 0), (signals.len(), inputs)).into_owned(),
        }
    }

    fn tick(&mut self, look: &Look, due: &Due) -> Tick {
        let (n, inputs, size) = (look.x.len(), look.u.len() + look.w.len(), self.layout.size);
        let identity = DMatrix::<f64>::identity(size, size);
        // Values that were computed earlier reach the memory before it is read.
        let mut arrived = identity.clone();
        for &clock in &due.arrive {
            let (memory, first) = &self.layout.clocks[clock];
            for (k, row) in memory.clone().enumerate() {
                arrived.set_row(row, &identity.row(first.unwrap_or(row) + k));
            }
        }
        let mut tick = Tick { t: look.t, states: arrived, inputs: DMatrix::zeros(size, inputs) };
        if due.sample.is_empty() {
            return tick;
        }
        self.tangent.take(&look.contacts, &look.effects);
        let (slopes, _) = self.slopes(look, |plant, at| {
            plant.look(at, &[]);
            let mut changes = vec![Dual7::from(0.0); n];
            if let Some(breaks) = plant.breaks() {
                breaks.changes(at, &mut changes);
            }
            changes
        });
        let [by_states, by_inputs] = self.split(&slopes, inputs);
        let mut sampled = identity.clone();
        for &clock in &due.sample {
            let (memory, first) = &self.layout.clocks[clock];
            for (k, row) in memory.clone().enumerate() {
                let to = first.map_or(row, |first| first + k);
                sampled.set_row(to, &(by_states.row(row) + identity.row(row)));
                tick.inputs.set_row(to, &by_inputs.row(row));
            }
        }
        tick.states = sampled * tick.states;
        tick
    }
}
