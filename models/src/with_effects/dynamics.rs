//! Equations of a plant together with those of the effects at its ports.

use std::cell::RefCell;

use mops_core::enclosure::Enclosure;
use mops_core::{
    BoundEffect, Case, EventInstant, Failure, Instant, Interface, Job, MOST_LOST, Model, Opening, Plant, Port,
    PortState, Scalar, Span,
};

use super::command::Command;
use super::contacts::{Contacts, solve};
use super::edges::BLINK;
use super::{Place, Site, WithEffects};
use crate::kernel::drive::Drive;
use crate::kernel::{Dynamics, common, shift, shown};

/// Effect in a simulation.
pub(super) struct Actor<S> {
    pub(super) acting: Box<dyn BoundEffect<S>>,
    pub(super) place: Place,
    /// Index of the first state of the effect, and number of its states.
    pub(super) z: (usize, usize),
    /// Hysteresis state.
    pub(super) memory: Vec<S>,
    /// Initial offset between output and input.
    ahead: S,
    /// True if the contact of the effect is closed; `None` without a contact.
    pub(super) closed: Option<bool>,
    inertial: bool,
}

impl<S: Scalar> Actor<S> {
    /// Updates the hysteresis state to an instant.
    pub(super) fn follow(&mut self, at: &PortState<'_, S>) {
        let first = self.memory[0].value().is_nan();
        self.acting.update_hysteresis(at, &mut self.memory);
        if first {
            self.memory[0] += self.ahead;
            self.acting.update_hysteresis(at, &mut self.memory);
        }
    }
}

impl WithEffects {
    /// Creates the plant with the effects of these indices.
    pub(super) fn driven<'a, S: Opening>(
        &self,
        plant: Box<dyn Plant<S> + 'a>,
        acting: &[usize],
        job: &Job<'a>,
        parameters: &[S],
    ) -> Driven<'a, S> {
        let own = self.model.equation_states().len();
        let mut states = own;
        let actor = |&index: &usize| {
            let (effect, place) = (&self.placements[index].effect, self.places[index]);
            let parameters = &parameters[place.parameters..place.parameters + effect.parameters().len()];
            let z = (states, effect.states());
            states += effect.states();
            Actor {
                acting: S::bind(effect.as_ref(), parameters),
                place,
                z,
                memory: vec![S::from(f64::NAN); effect.hysteresis_states()],
                ahead: S::from(0.0),
                closed: None,
                inertial: effect.is_inertial(),
            }
        };
        let actors = acting.iter().map(actor).collect();
        Driven::new(self.model.as_ref(), own, plant, actors, job)
    }
}

/// Plant with effects; the state consists of the states of the plant, then those of the effects.
pub(super) struct Driven<'a, S> {
    pub(super) plant: Box<dyn Plant<S> + 'a>,
    pub(super) actors: Vec<Actor<S>>,
    pub(super) contacts: Contacts,
    pub(super) commands: Vec<Command<'a, S>>,
    /// Number of states of the plant.
    pub(super) own: usize,
    forces: usize,
    /// Times at which effects change their form, s.
    breaks: Vec<S>,
    longest_step: f64,
    damped_step: f64,
    /// Index of the state that each signal equals, if any.
    shows: Vec<Option<usize>>,
    /// Index of the state that each signal equals, if any, for signals that no effect changes.
    untouched: Vec<Option<usize>>,
    /// Clock time at the start of the simulation, s.
    begins: f64,
    pub(super) started: bool,
    /// Text of the last event of the plant.
    happened: String,
    scratch: RefCell<Scratch<S>>,
    /// Values that reach the effects of actuators, by the index of the effect.
    pub(super) incoming: RefCell<Vec<S>>,
    /// Derivatives of the time of an event or a break while the system passes it, with value 0.
    late: S,
    /// Half the time over which the rate of a value is a difference, s.
    pub(super) blink: f64,
    /// Sign of each force for which it acts in the forward direction.
    forward: Vec<f64>,
    /// State whose equation contains each force of the plant.
    balances: Vec<usize>,
    /// Disturbances of the case, one for each force of the plant if there are any.
    disturbances: Vec<Drive<'a, S>>,
    /// Force for each unit of a disturbance.
    force_per_rate: Vec<S>,
    /// Additional forces; used only when the equations are evaluated for linearisation.
    further: Vec<S>,
    /// Rates of constant inputs: all 0.
    still: Vec<f64>,
}

/// Inputs, forces and rates at one instant.
struct Scratch<S> {
    u: Vec<S>,
    w: Vec<S>,
    dx: Vec<S>,
}

impl<'a, S: Opening> Driven<'a, S> {
    pub(super) fn new(
        model: &dyn Model,
        own: usize,
        plant: Box<dyn Plant<S> + 'a>,
        actors: Vec<Actor<S>>,
        job: &Job<'a>,
    ) -> Self {
        let of = model.interface();
        let delay = |input: usize| {
            let late = actors.iter().filter(|a| matches!(a.place.site, Site::Actuator { input: i } if i == input));
            late.filter_map(|actor| actor.acting.delay()).reduce(|a, b| a + b)
        };
        // The output of a sensor effect may be rough, so steps end at all samples.
        let every_sample = actors.iter().any(Actor::is_at_sensor);
        let command = |(i, v): (usize, &mops_core::Variable)| {
            Command::new(job.case.input(&v.name), delay(i), job.case.begins, every_sample)
        };
        let commands: Vec<_> = of.inputs.iter().enumerate().map(command).collect();
        let forces = of.forces();
        let disturbances = disturbances(of, job.case);
        let states = model.equation_states();
        let shows = shown(of, &states);
        let touched = |k: usize| actors.iter().any(|a| a.is_at_sensor_of(k));
        let untouched = (0..shows.len()).map(|k| shows[k].filter(|_| !touched(k))).collect();
        let begins = job.case.begins;
        let breaks = actors.iter().flat_map(|a| a.acting.breaks()).filter(|t| t.value().is_finite());
        let mut breaks: Vec<S> = breaks.map(|t| t - begins).collect();
        breaks.sort_by(|a, b| a.value().total_cmp(&b.value()));
        let longest = actors.iter().map(|a| a.acting.longest_step()).fold(f64::INFINITY, f64::min);
        let damped = actors.iter().map(|a| a.acting.damped_step()).fold(f64::INFINITY, f64::min);
        let longest = commands.iter().map(Command::longest_step).fold(longest, f64::min);
        let longest = disturbances.iter().map(Drive::longest_step).fold(longest, f64::min);
        let longest = longest.min(plant.longest_step());
        Self {
            plant,
            contacts: Contacts::default(),
            actors,
            commands,
            own,
            forces,
            breaks,
            longest_step: longest,
            damped_step: damped,
            shows,
            untouched,
            begins,
            started: false,
            happened: String::new(),
            scratch: RefCell::new(Scratch { u: Vec::new(), w: Vec::new(), dx: Vec::new() }),
            incoming: RefCell::default(),
            late: S::from(0.0),
            blink: BLINK * job.horizon,
            forward: vec![1.0; forces],
            balances: balances(of).filter_map(|state| states.iter().position(|s| s.name == *state)).collect(),
            disturbances,
            force_per_rate: Vec::new(),
            further: Vec::new(),
            still: vec![0.0; of.inputs.len()],
        }
    }

    /// Returns the initial state. Also finds the joints with dry friction, and the signs of forces.
    pub(super) fn start(&mut self, parameters: &[S]) -> Result<Vec<S>, Failure> {
        let mut x = self.plant.start();
        let total = self.actors.last().map_or(self.own, |a| a.z.0 + a.z.1);
        x.resize(total, S::from(0.0));
        self.start_actuators(&mut x, parameters);
        let mut u = Vec::new();
        self.inputs(0.0, &x, &mut u);
        let w = vec![S::from(0.0); self.forces];
        self.plant.settle(&Instant { t: 0.0, x: &x[..self.own], u: &u, w: &w });
        let sites = self.actors.iter().flat_map(|actor| [Some(actor.place.site), actor.place.companion]);
        for site in sites.flatten() {
            let (Site::Joint { w: k, velocity: state, .. } | Site::Process { w: k, state }) = site else {
                continue;
            };
            self.forward[k] = if self.mobility(&x, &u, k, state).value() < 0.0 { -1.0 } else { 1.0 };
        }
        let force_per_rate = |k: usize| S::from(1.0) / self.mobility(&x, &u, k, self.balances[k]);
        self.force_per_rate = (0..self.disturbances.len()).map(force_per_rate).collect();
        let (last, first): (Vec<usize>, Vec<usize>) =
            (0..self.actors.len()).partition(|&index| self.actors[index].is_at_sensor());
        // What sensors measure depends on all other effects, and on the sensor effects before.
        for index in first.into_iter().chain(last) {
            let actor = &self.actors[index];
            if actor.is_at_actuator() {
                continue;
            }
            let (first, count) = actor.z;
            let at = self.at(actor, 0.0, &x, &u, self.arriving(index, 0.0, &x));
            let mut z = vec![S::from(0.0); count];
            actor.acting.start(&at, &mut z);
            if actor.acting.friction(&at, &z).is_some() {
                let Site::Joint { w, velocity, .. } = actor.place.site else {
                    return Err(Failure::Undefined("dry friction acts at a joint".into()));
                };
                self.contacts.add(index, w, velocity);
            }
            if let Some(starts) = actor.place.starts {
                z.iter_mut().zip(&parameters[starts..]).for_each(|(z, &over)| *z += over);
                self.actors[index].ahead = parameters[starts];
            }
            x[first..first + count].copy_from_slice(&z);
            if !self.actors[index].memory.is_empty() {
                self.update_hysteresis_of(index, 0.0, &x);
            }
        }
        self.settle_gaps(0.0, &x);
        let before = self.commands.clone();
        self.commands.iter_mut().for_each(|command| command.pass_break(0.0));
        self.inputs(0.0, &x, &mut u);
        self.commands = before;
        self.plant.can_start(&Instant { t: 0.0, x: &x[..self.own], u: &u, w: &w })?;
        Ok(x)
    }

    /// Returns the value at a sensor before this effect; 0 for effects elsewhere.
    fn passing(&self, index: usize, t: f64, x: &[S], u: &[S], w: &[S]) -> S {
        let Site::Sensor { signal } = self.actors[index].place.site else { return S::from(0.0) };
        let value = self.plant.signal(signal, &Instant { t, x: &x[..self.own], u, w });
        self.through(signal, index, value, t, x, u)
    }

    /// Returns a value of a signal after the effects at its sensor whose index is below `end`, in their order.
    fn through(&self, signal: usize, end: usize, value: S, t: f64, x: &[S], u: &[S]) -> S {
        let here = |actor: &&Actor<S>| actor.is_at_sensor_of(signal);
        let see = |value: S, actor: &Actor<S>| actor.passed(&self.at(actor, t, x, u, value), self.states(actor, x));
        self.actors[..end].iter().filter(here).fold(value, see)
    }

    /// Returns the port state that an effect receives.
    pub(super) fn at<'b>(&self, actor: &Actor<S>, t: f64, x: &[S], u: &'b [S], value: S) -> PortState<'b, S> {
        let zero = S::from(0.0);
        let (q, v) = match actor.place.site {
            Site::Joint { position, velocity, .. } => (x[position], x[velocity]),
            Site::Process { state, .. } => (x[state], zero),
            _ => (value, zero),
        };
        let (other, other_speed) = match actor.place.companion {
            Some(Site::Joint { position, velocity, .. }) => (x[position], x[velocity]),
            Some(Site::Process { state, .. }) => (x[state], zero),
            Some(Site::Actuator { input }) => (u.get(input).copied().unwrap_or(zero), zero),
            Some(Site::Sensor { signal }) => {
                (self.plant.signal(signal, &Instant { t, x: &x[..self.own], u, w: &vec![zero; self.forces] }), zero)
            }
            None => (zero, zero),
        };
        let closed = actor.closed;
        let t = self.late + (t + self.begins);
        PortState { t, value, q, v, a: zero, mobility: zero, other, other_speed, u, closed }
    }

    pub(super) fn states<'b>(&self, actor: &Actor<S>, x: &'b [S]) -> &'b [S] {
        &x[actor.z.0..actor.z.0 + actor.z.1]
    }

    /// Computes the rates of all states.
    pub(super) fn rates(&self, t: f64, x: &[S], dx: &mut [S]) {
        let mut scratch = self.scratch.borrow_mut();
        let Scratch { u, w, .. } = &mut *scratch;
        let (own, further) = dx.split_at_mut(self.own);
        self.balance(t, x, u, w, own);
        for (index, actor) in self.actors.iter().enumerate().filter(|(_, actor)| actor.z.1 > 0) {
            // The states of an effect follow what reaches it.
            let value = match actor.place.site {
                Site::Actuator { .. } => self.incoming.borrow()[index],
                _ => self.passing(index, t, x, u, w),
            };
            let at = self.at(actor, t, x, u, value);
            let (first, count) = (actor.z.0 - self.own, actor.z.1);
            actor.acting.rates(&at, self.states(actor, x), &mut further[first..first + count]);
        }
    }

    /// Computes the inputs that reach the plant: the effects of an actuator act in their order, after its delays.
    pub(super) fn inputs(&self, t: f64, x: &[S], u: &mut Vec<S>) {
        u.clear();
        match S::DIRECTIONS {
            0 => u.extend(self.commands.iter().map(|command| command.at(t))),
            _ => u.extend(self.commands.iter().map(|command| command.at(t) + self.late * command.slope(t))),
        }
        let mut incoming = self.incoming.borrow_mut();
        incoming.resize(self.actors.len(), S::from(0.0));
        for (index, actor) in self.actors.iter().enumerate() {
            let Site::Actuator { input } = actor.place.site else { continue };
            incoming[index] = u[input];
            let passed = actor.passed(&self.at(actor, t, x, u, u[input]), self.states(actor, x));
            u[input] = passed;
        }
    }

    /// Computes the forces of the effects, without those proportional to the acceleration and without the friction of
    /// stuck joints.
    fn forces(&self, t: f64, x: &[S], u: &[S], w: &mut Vec<S>) {
        w.clear();
        w.extend_from_slice(&self.further);
        w.resize(self.forces, S::from(0.0));
        for ((w, drive), &unit) in w.iter_mut().zip(&self.disturbances).zip(&self.force_per_rate) {
            *w += unit * drive.at(t);
        }
        for (index, actor) in self.actors.iter().enumerate() {
            let (Site::Joint { w: k, .. } | Site::Process { w: k, .. }) = actor.place.site else { continue };
            if actor.inertial {
                continue;
            }
            let at = self.at(actor, t, x, u, S::from(0.0));
            let z = self.states(actor, x);
            w[k] += actor.acting.value(&at, z) * self.forward[k];
            if let Some(Site::Joint { w: next, .. } | Site::Process { w: next, .. }) = actor.place.companion {
                w[next] += actor.acting.onward(&at, z) * self.forward[next];
            }
            if let Some(direction) = self.contacts.direction(index) {
                let friction = actor.acting.friction(&at, z).expect("it has friction from the start");
                let against = friction.sliding[usize::from(direction < 0.0)];
                w[k] -= against * (direction * self.forward[k]);
            }
        }
    }

    /// Returns the rate that a unit force adds to a state at the beginning.
    fn mobility(&self, x: &[S], u: &[S], force: usize, state: usize) -> S {
        let rate = |unit: f64| {
            let (mut w, mut rates) = (vec![S::from(0.0); self.forces], vec![S::from(0.0); self.own]);
            w[force] = S::from(unit);
            self.plant.rates(&Instant { t: 0.0, x: &x[..self.own], u, w: &w }, &mut rates);
            rates[state]
        };
        rate(1.0) - rate(0.0)
    }

    /// Returns the rate that a unit force at each balance adds to its state at the beginning.
    pub(super) fn mobilities(&self) -> Vec<f64> {
        let x = self.plant.start();
        let u: Vec<S> = self.commands.iter().map(|c| c.at(0.0)).collect();
        self.balances.iter().enumerate().map(|(k, &state)| self.mobility(&x, &u, k, state).value()).collect()
    }

    /// Returns the number of states, including those of the effects.
    pub(super) fn size(&self) -> usize {
        self.actors.last().map_or(self.own, |actor| actor.z.0 + actor.z.1)
    }

    /// Returns the commanded inputs, including delays.
    pub(super) fn commanded(&self, t: f64) -> Vec<S> {
        self.commands.iter().map(|command| command.at(t)).collect()
    }

    /// Copies the contacts of another simulation, and the contact and hysteresis states of its effects.
    pub(super) fn take(&mut self, contacts: &Contacts, effects: &[(Option<bool>, Vec<f64>)]) {
        self.contacts = contacts.clone();
        for (actor, (closed, memory)) in self.actors.iter_mut().zip(effects) {
            actor.closed = *closed;
            actor.memory = memory.iter().map(|&m| S::from(m)).collect();
        }
    }

    /// Returns the disturbances.
    pub(super) fn disturbed(&self, t: f64) -> Vec<S> {
        self.disturbances.iter().map(|drive| drive.at(t)).collect()
    }

    /// Replaces commands and disturbances by constant ones.
    pub(super) fn command(&mut self, commands: impl Iterator<Item = S>, disturbances: impl Iterator<Item = S>) {
        self.commands = commands.map(Command::held).collect();
        self.disturbances = disturbances.map(Drive::held).collect();
    }

    /// Evaluates the rates of all states and the values of signals, with additional forces `further` at the ports.
    pub(super) fn look(&mut self, t: f64, x: &[S], further: &[S], signals: &[usize]) -> (Vec<S>, Vec<S>) {
        self.further = further.to_vec();
        let x = x.to_vec();
        let (mut u, mut w, mut dx) = (Vec::new(), Vec::new(), vec![S::from(0.0); x.len()]);
        self.balance(t, &x, &mut u, &mut w, &mut dx[..self.own]);
        self.plant.settle(&Instant { t, x: &x[..self.own], u: &u, w: &w });
        self.derivative(t, &x, &mut dx);
        let outputs = signals.iter().map(|&signal| self.measured(signal, t, &x)).collect();
        self.further.clear();
        (dx, outputs)
    }

    /// Returns the sign with which a force acts in the forward direction.
    pub(super) fn forward(&self, w: usize) -> f64 {
        self.forward[w]
    }

    pub(super) fn own_rates(&self, t: f64, x: &[S], u: &[S], w: &[S], dx: &mut [S]) {
        self.plant.rates(&Instant { t, x: &x[..self.own], u, w }, dx);
    }

    /// Computes the rates of the plant, after adding the forces proportional to the acceleration: with the masses `m` that effects add
    /// to joints, the forces `w` are `-m q''`, where `q'' = a + B w`.
    pub(super) fn moved(&self, t: f64, x: &[S], u: &[S], w: &mut [S], dx: &mut [S]) {
        self.own_rates(t, x, u, w, dx);
        let mut joints: Vec<(usize, usize)> = Vec::new();
        for actor in self.actors.iter().filter(|actor| actor.inertial) {
            let Site::Joint { w: k, velocity, .. } = actor.place.site else { continue };
            if !joints.contains(&(k, velocity)) {
                joints.push((k, velocity));
            }
        }
        if joints.is_empty() {
            return;
        }
        let free: Vec<S> = joints.iter().map(|&(_, velocity)| dx[velocity]).collect();
        let mut moved_by_unit = Vec::with_capacity(joints.len());
        for &(k, _) in &joints {
            w[k] += S::from(self.forward[k]);
            self.own_rates(t, x, u, w, dx);
            w[k] += S::from(-self.forward[k]);
            moved_by_unit.push(joints.iter().zip(&free).map(|(&(_, v), &free)| dx[v] - free).collect::<Vec<S>>());
        }
        let mass = |i: usize| self.added_mass(joints[i].0, moved_by_unit[i][i], t, x, u);
        let masses: Vec<S> = (0..joints.len()).map(mass).collect();
        for (j, column) in moved_by_unit.iter_mut().enumerate() {
            column.iter_mut().zip(&masses).for_each(|(moved, &mass)| *moved = mass * *moved);
            column[j] += S::from(1.0);
        }
        let pushed: Vec<S> = masses.iter().zip(&free).map(|(&mass, &free)| mass * free).collect();
        for (&(k, _), &force) in joints.iter().zip(&solve(&moved_by_unit, &pushed)) {
            w[k] += force * self.forward[k];
        }
        self.own_rates(t, x, u, w, dx);
    }

    /// Returns the mass that effects add to a joint, where a unit force moves it with this acceleration.
    fn added_mass(&self, k: usize, mobility: S, t: f64, x: &[S], u: &[S]) -> S {
        let (mut added, mut lost) = (S::from(0.0), S::from(0.0));
        let here = |actor: &&Actor<S>| actor.inertial && matches!(actor.place.site, Site::Joint { w, .. } if w == k);
        for actor in self.actors.iter().filter(here) {
            let mass = actor.acting.inertia(&self.at(actor, t, x, u, S::from(0.0)));
            *(if mass.value() < 0.0 { &mut lost } else { &mut added }) += mass;
        }
        if lost.value() == 0.0 {
            return added + lost;
        }
        let most = -(S::from(1.0) / mobility + added) * MOST_LOST;
        added + if lost.value() > most.value() { lost } else { most }
    }

    /// Computes inputs, forces including the friction of stuck joints, and the rates of the plant. Returns the friction
    /// of each contact, empty if no joint is stuck.
    pub(super) fn balance(&self, t: f64, x: &[S], u: &mut Vec<S>, w: &mut Vec<S>, dx: &mut [S]) -> Vec<S> {
        self.inputs(t, x, u);
        self.forces(t, x, u, w);
        if self.contacts.any_stuck() {
            return self.hold(t, x, u, w, dx);
        }
        self.moved(t, x, u, w, dx);
        Vec::new()
    }

    /// Returns the measured value of a signal; effects with a delay act after the simulation.
    pub(super) fn measured(&self, signal: usize, t: f64, x: &[S]) -> S {
        self.seen(signal, self.actors.len(), t, x)
    }

    /// Returns the value of a signal after the effects at its sensor whose index is below `end`.
    pub(super) fn seen(&self, signal: usize, end: usize, t: f64, x: &[S]) -> S {
        let here = |actor: &&Actor<S>| actor.is_at_sensor_of(signal);
        let simple = |actor: &Actor<S>| actor.place.companion.is_none();
        if let Some(state) = self.shows[signal]
            && self.actors[..end].iter().filter(here).all(simple)
        {
            return self.through(signal, end, x[state], t, x, &[]);
        }
        let mut scratch = self.scratch.borrow_mut();
        let Scratch { u, w, dx, .. } = &mut *scratch;
        dx.resize(self.own, S::from(0.0));
        // Outputs may contain rates, which depend on the forces.
        self.balance(t, x, u, w, dx);
        let value = self.plant.signal(signal, &Instant { t, x: &x[..self.own], u, w });
        self.through(signal, end, value, t, x, u)
    }

    /// Passes a break at which `due` changes what is valid from `t` on. The time of the break has the derivatives `late`: the state
    /// moves along the rates before the break, and back along those after it.
    fn pass(&mut self, t: f64, x: &mut [S], late: S, due: impl FnOnce(&mut Self)) {
        let moves = late.tangents().iter().any(|&tangent| tangent != 0.0);
        let mut rates = x.to_vec();
        if moves {
            shift(self, t, x, &mut rates, late);
            self.late = late;
        }
        self.update_hysteresis(t, x, |_| true);
        due(self);
        self.follow(t, x, 0, Actor::is_at_actuator);
        if moves {
            self.late = S::from(0.0);
            shift(self, t, x, &mut rates, -late);
        }
    }
}

/// Returns the names of the states whose equations contain a force, in the order of the forces.
fn balances(of: &Interface) -> impl Iterator<Item = &String> {
    of.ports.iter().filter_map(|port| match port {
        Port::Process { state, .. } => Some(state),
        _ => None,
    })
}

/// Returns the disturbances of a case, one for each force of the plant; empty if there are none.
fn disturbances<'a, S: Scalar>(of: &Interface, case: &'a Case) -> Vec<Drive<'a, S>> {
    if case.disturbances.is_empty() {
        return Vec::new();
    }
    let of_state = |state: &String| case.disturbances.iter().find(|(name, _)| name == state).map(|(_, of)| of);
    balances(of).map(|state| Drive::new(of_state(state))).collect()
}

impl<S: Opening> Dynamics<S> for Driven<'_, S> {
    fn signal(&self, signal: usize, t: f64, x: &[S]) -> S {
        self.measured(signal, t, x)
    }

    fn derivative(&self, t: f64, x: &[S], dx: &mut [S]) {
        self.rates(t, x, dx);
    }

    fn delay_events(&mut self, delay: S) {
        self.late = delay;
    }

    fn guards(&self) -> usize {
        let [gaps, turns] = self.edges();
        self.plant.guards() + self.contacts.len() + gaps + turns
    }

    fn guard(&self, index: usize, t: f64, x: &[S]) -> S {
        let own = self.plant.guards();
        let edges = own + self.contacts.len();
        if index >= edges {
            return self.edge_guard(index - edges, t, x);
        }
        let mut scratch = self.scratch.borrow_mut();
        let Scratch { u, w, dx } = &mut *scratch;
        if index >= own {
            return self.contact_guard(index - own, t, x, u, w);
        }
        dx.resize(self.own, S::from(0.0));
        self.balance(t, x, u, w, dx);
        self.plant.guard(index, &Instant { t, x: &x[..self.own], u, w })
    }

    fn switch(&mut self, index: usize, t: f64, x: &mut [S]) -> &str {
        let own = self.plant.guards();
        let edges = own + self.contacts.len();
        let (mut u, mut w) = (Vec::new(), Vec::new());
        let mut dx = vec![S::from(0.0); self.own];
        if index >= own {
            let what = if index >= edges {
                let happened = self.edge_switch(index - edges, t, x);
                self.settle_contacts(t, x, None);
                happened
            } else if self.contact_switch(index - own, t, x) {
                "a joint sticks"
            } else {
                "a joint slides"
            };
            self.balance(t, x, &mut u, &mut w, &mut dx);
            self.plant.settle(&Instant { t, x: &x[..self.own], u: &u, w: &w });
            return what;
        }
        self.balance(t, x, &mut u, &mut w, &mut dx);
        let before = x[..self.own].to_vec();
        let event = EventInstant { at: Instant { t, x: &before, u: &u, w: &w }, du: &self.still, delay: self.late };
        self.plant.switch(index, &event, &mut x[..self.own]).clone_into(&mut self.happened);
        self.settle_gaps(t, x);
        &self.happened
    }

    fn has_bounds(&self) -> bool {
        self.plant.has_bounds()
    }

    /// Returns bounds of the guards of the plant. Inputs with effects, and forces, are unbounded.
    fn enclose_guard(&self, index: usize, time: Enclosure, x: &[Enclosure]) -> Enclosure {
        if index >= self.plant.guards() {
            return Enclosure::UNKNOWN;
        }
        let acts_on = |i: usize| {
            self.actors.iter().any(|actor| matches!(actor.place.site, Site::Actuator { input } if input == i))
        };
        let input = |(i, command): (usize, &Command<'_, S>)| match command.undelayed().filter(|_| !acts_on(i)) {
            Some(drive) => drive.enclose(time),
            None => Enclosure::UNKNOWN,
        };
        let u: Vec<Enclosure> = self.commands.iter().enumerate().map(input).collect();
        let w = vec![Enclosure::UNKNOWN; self.forces];
        self.plant.enclose_guard(index, &Span { time, x: &x[..self.own], u: &u, w: &w })
    }

    fn rest(&mut self, index: usize, t: f64, close: f64, x: &mut [S]) -> Result<&str, String> {
        let own = self.plant.guards();
        if index >= own {
            let what = if index < own + self.contacts.len() {
                "a joint sticks and slides"
            } else {
                "a contact opens and closes"
            };
            return Err(format!("{what} without end"));
        }
        let (mut u, mut w) = (Vec::new(), Vec::new());
        let mut dx = vec![S::from(0.0); self.own];
        self.balance(t, x, &mut u, &mut w, &mut dx);
        let before = x[..self.own].to_vec();
        let event = EventInstant { at: Instant { t, x: &before, u: &u, w: &w }, du: &self.still, delay: self.late };
        self.plant.rest(index, &event, close, &mut x[..self.own])?.clone_into(&mut self.happened);
        self.settle_gaps(t, x);
        Ok(&self.happened)
    }

    fn scale(&self, state: usize) -> Option<f64> {
        (state < self.own).then(|| self.plant.scale(state)).flatten()
    }

    fn shows(&self, signal: usize) -> Option<usize> {
        self.untouched[signal]
    }

    fn next_break(&self, t: f64) -> f64 {
        let inputs = self.commands.iter().map(Command::next_break).fold(f64::INFINITY, f64::min);
        let forces = self.disturbances.iter().map(|drive| drive.next_break(t)).fold(inputs, f64::min);
        let next = self.plant.next_break(t).min(forces);
        self.breaks.iter().map(|at| at.value()).find(|&at| at > t).map_or(next, |at| at.min(next))
    }

    fn longest_step(&self) -> f64 {
        self.longest_step
    }

    fn damped_step(&self) -> f64 {
        self.damped_step
    }

    fn pass_break(&mut self, t: f64, x: &mut [S]) -> S {
        let moving = self.breaks.iter().find(|at| at.value() == t).copied();
        let mut moves = moving.map(|at| at - at.value());
        for k in 0..self.commands.len() {
            if self.commands[k].is_due(t) {
                let late = self.commands[k].late();
                self.pass(t, x, late, |of| of.commands[k].pass_break(t));
                if self.commands[k].is_delayed() {
                    moves = Some(moves.map_or(late, |moves| common(moves, late)));
                }
            }
        }
        self.disturbances.iter_mut().for_each(|drive| drive.pass_break(t));
        let first = !std::mem::replace(&mut self.started, true);
        if first || self.guards() > 0 {
            self.settle_contacts(t, x, None);
            let (mut u, mut w) = (Vec::new(), Vec::new());
            let mut dx = vec![S::from(0.0); self.own];
            self.balance(t, x, &mut u, &mut w, &mut dx);
            self.plant.settle(&Instant { t, x: &x[..self.own], u: &u, w: &w });
        }
        moves.unwrap_or(S::from(0.0))
    }
}
