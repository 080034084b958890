//! Plant with effects at its ports: a plant around a plant.

use std::cell::RefCell;

use mops_core::{
    Failure, Instant, Plant,
    effect::{BoundEffect, MOST_LOST, PortState},
    plant::{Bounds, Breaks, EventInstant, Events, InputRates, Memory, Past, PlantScalar, Span, Stretch},
};
use mops_language::{Scalar, enclosure::Enclosure};
use mops_linear as linear;

use super::contacts::{Contacts, solve};
use super::place::{Place, Site};
use crate::kernel::{common, is_due, latest, mobility};

/// Effect at its place in a plant.
pub(super) struct PlacedEffect<S> {
    pub(super) effect: Box<dyn BoundEffect<S>>,
    pub(super) place: Place,
    /// Index of the first state of the effect, and number of its states.
    pub(super) states: (usize, usize),
    /// Hysteresis state.
    pub(super) hysteresis: Vec<S>,
    /// Initial offsets of the states, or of the output from the input; empty without.
    pub(super) offsets: Vec<S>,
    /// Offset of the output that the first hysteresis state takes.
    pub(super) first_offset: S,
    /// True if the contact of the effect is closed; `None` without a contact.
    pub(super) closed: Option<bool>,
    pub(super) inertial: bool,
}

/// Plant with effects. The state consists of the states of the plant, then those of the effects; the inputs are
/// commands, which the effects of actuators change before they reach the plant.
pub(super) struct Affected<'a, S> {
    pub(super) plant: Box<dyn Plant<S> + 'a>,
    pub(super) effects: Vec<PlacedEffect<S>>,
    pub(super) contacts: Contacts,
    /// Number of states of the plant.
    pub(super) own: usize,
    /// Times at which effects change their form, s.
    changes: Vec<S>,
    /// Index of the state that each signal equals, if any.
    shows: &'a [Option<usize>],
    pub(super) started: bool,
    /// Text of the last event of the plant.
    happened: String,
    scratch: RefCell<Scratch<S>>,
    /// Values that reach the effects of actuators, by the index of the effect.
    pub(super) incoming: RefCell<Vec<S>>,
    /// Half the time over which the rate of a value is a difference, s.
    pub(super) blink: f64,
    /// Sign of each force for which it acts in the forward direction.
    forward: Vec<f64>,
}

/// Inputs, forces and rates at one instant.
struct Scratch<S> {
    u: Vec<S>,
    w: Vec<S>,
    dx: Vec<S>,
}

impl<S> Default for Scratch<S> {
    fn default() -> Self {
        Self { u: Vec::new(), w: Vec::new(), dx: Vec::new() }
    }
}

/// Returns an instant at a fixed time, with constant inputs.
pub(super) fn fixed<'h, S: Scalar>(at: &Instant<'h, S>) -> EventInstant<'h, S> {
    EventInstant { at: *at, du: &|_| 0.0, delay: S::from(0.0) }
}

/// Returns an instant with other states.
pub(super) fn with_states<'h, S: Copy>(here: &EventInstant<'h, S>, x: &'h [S]) -> EventInstant<'h, S> {
    EventInstant { at: Instant { x, ..here.at }, ..*here }
}

impl<'a, S: PlantScalar> Affected<'a, S> {
    /// Puts effects around a plant with this number of states and of forces; `shows` gives for each signal the state
    /// that it equals.
    pub(super) fn new(
        plant: Box<dyn Plant<S> + 'a>,
        effects: Vec<PlacedEffect<S>>,
        [own, forces]: [usize; 2],
        shows: &'a [Option<usize>],
        blink: f64,
    ) -> Self {
        let mut changes: Vec<S> =
            effects.iter().flat_map(|e| e.effect.breaks()).filter(|t| t.value().is_finite()).collect();
        changes.sort_by(|a, b| a.value().total_cmp(&b.value()));
        Self {
            plant,
            contacts: Contacts::default(),
            effects,
            own,
            changes,
            shows,
            started: false,
            happened: String::new(),
            scratch: RefCell::default(),
            incoming: RefCell::default(),
            blink,
            forward: vec![1.0; forces],
        }
    }

    /// Returns the number of states, including those of the effects.
    pub(super) fn size(&self) -> usize {
        self.effects.last().map_or(self.own, |effect| effect.states.0 + effect.states.1)
    }

    /// Returns the instant that the plant sees, with the inputs that reach it and the forces on it.
    fn inner<'h>(&self, at: &Instant<'h, S>, u: &'h [S], w: &'h [S]) -> Instant<'h, S> {
        Instant { t: at.t, x: &at.x[..self.own], u, w }
    }

    /// Returns the value at a sensor before this effect; 0 for effects elsewhere.
    fn passing(&self, index: usize, here: &EventInstant<'_, S>, u: &[S], w: &[S]) -> S {
        let Site::Sensor { signal } = self.effects[index].place.site else { return S::from(0.0) };
        let value = self.plant.signal(signal, &self.inner(&here.at, u, w));
        self.through(signal, index, value, here, u)
    }

    /// Returns a value of a signal after the effects at its sensor whose index is below `end`, in their order.
    fn through(&self, signal: usize, end: usize, value: S, here: &EventInstant<'_, S>, u: &[S]) -> S {
        let at_sensor = |effect: &&PlacedEffect<S>| effect.is_at_sensor_of(signal);
        let see = |value: S, effect: &PlacedEffect<S>| {
            effect.passed(&self.at(effect, here, u, value), effect.states(here.at.x))
        };
        self.effects[..end].iter().filter(at_sensor).fold(value, see)
    }

    /// Returns the port state that an effect receives; `u` are the inputs that reach the plant.
    pub(super) fn at<'b>(
        &self,
        effect: &PlacedEffect<S>,
        here: &EventInstant<'_, S>,
        u: &'b [S],
        value: S,
    ) -> PortState<'b, S> {
        let zero = S::from(0.0);
        let x = here.at.x;
        let (q, v) = match effect.place.site {
            Site::Joint { position, velocity, .. } => (x[position], x[velocity]),
            Site::Speed { velocity, .. } => (zero, x[velocity]),
            Site::Process { state, .. } => (x[state], zero),
            _ => (value, zero),
        };
        let (other, other_speed) = match effect.place.companion {
            Some(Site::Joint { position, velocity, .. }) => (x[position], x[velocity]),
            Some(Site::Speed { velocity, .. }) => (zero, x[velocity]),
            Some(Site::Process { state, .. }) => (x[state], zero),
            Some(Site::Actuator { input }) => (u.get(input).copied().unwrap_or(zero), zero),
            Some(Site::Sensor { signal }) => {
                let still = vec![zero; self.forward.len()];
                (self.plant.signal(signal, &Instant { t: here.at.t, x: &x[..self.own], u, w: &still }), zero)
            }
            None => (zero, zero),
        };
        let closed = effect.closed;
        let t = here.delay + here.at.t;
        PortState { t, value, q, v, a: zero, mobility: zero, other, other_speed, u, closed }
    }

    /// Computes the rates of all states.
    pub(super) fn all_rates(&self, here: &EventInstant<'_, S>, dx: &mut [S]) {
        let mut scratch = self.scratch.take();
        let Scratch { u, w, .. } = &mut scratch;
        let (own, further) = dx.split_at_mut(self.own);
        self.balance(here, u, w, own);
        for (index, effect) in self.effects.iter().enumerate().filter(|(_, effect)| effect.states.1 > 0) {
            // The states of an effect follow what reaches it.
            let value = match effect.place.site {
                Site::Actuator { .. } => self.incoming.borrow()[index],
                _ => self.passing(index, here, u, w),
            };
            let at = self.at(effect, here, u, value);
            let (first, count) = (effect.states.0 - self.own, effect.states.1);
            effect.effect.rates(&at, effect.states(here.at.x), &mut further[first..first + count]);
        }
        self.scratch.replace(scratch);
    }

    /// Computes the inputs that reach the plant: the effects of an actuator act in their order, after its dead time.
    pub(super) fn inputs(&self, here: &EventInstant<'_, S>, u: &mut Vec<S>) {
        u.clear();
        u.extend_from_slice(here.at.u);
        let mut incoming = self.incoming.borrow_mut();
        incoming.resize(self.effects.len(), S::from(0.0));
        for (index, effect) in self.effects.iter().enumerate() {
            let Site::Actuator { input } = effect.place.site else { continue };
            incoming[index] = u[input];
            let passed = effect.passed(&self.at(effect, here, u, u[input]), effect.states(here.at.x));
            u[input] = passed;
        }
    }

    /// Computes the forces from outside and of the effects, without those proportional to the acceleration and without
    /// the friction of stuck joints.
    fn forces(&self, here: &EventInstant<'_, S>, u: &[S], w: &mut Vec<S>) {
        w.clear();
        w.extend_from_slice(here.at.w);
        for (index, effect) in self.effects.iter().enumerate() {
            let Some(k) = effect.place.site.force() else { continue };
            if effect.inertial {
                continue;
            }
            let at = self.at(effect, here, u, S::from(0.0));
            let z = effect.states(here.at.x);
            w[k] += effect.effect.value(&at, z) * self.forward[k];
            if let Some(next) = effect.place.companion.and_then(Site::force) {
                w[next] += effect.effect.onward(&at, z) * self.forward[next];
            }
            if let Some(direction) = self.contacts.direction(index) {
                let friction = effect.effect.friction(&at, z).expect("it has friction from the start");
                let against = friction.sliding[usize::from(direction < 0.0)];
                w[k] -= against * (direction * self.forward[k]);
            }
        }
    }

    /// Returns the sign with which a force acts in the forward direction.
    pub(super) fn forward(&self, w: usize) -> f64 {
        self.forward[w]
    }

    fn own_rates(&self, at: &Instant<'_, S>, u: &[S], w: &[S], dx: &mut [S]) {
        self.plant.rates(&self.inner(at, u, w), dx);
    }

    /// Computes the rates of the plant, after adding the forces proportional to the acceleration: with the masses `m`
    /// that effects add to joints, the forces `w` are `-m q''`, where `q'' = a + B w`.
    pub(super) fn moved(&self, here: &EventInstant<'_, S>, u: &[S], w: &mut [S], dx: &mut [S]) {
        self.own_rates(&here.at, u, w, dx);
        let mut joints: Vec<(usize, usize)> = Vec::new();
        for effect in self.effects.iter().filter(|effect| effect.inertial) {
            let Some((k, velocity)) = effect.place.site.speed() else { continue };
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
            self.own_rates(&here.at, u, w, dx);
            w[k] += S::from(-self.forward[k]);
            moved_by_unit.push(joints.iter().zip(&free).map(|(&(_, v), &free)| dx[v] - free).collect::<Vec<S>>());
        }
        let mass = |i: usize| self.added_mass(joints[i].0, moved_by_unit[i][i], here, u);
        let masses: Vec<S> = (0..joints.len()).map(mass).collect();
        for (j, column) in moved_by_unit.iter_mut().enumerate() {
            column.iter_mut().zip(&masses).for_each(|(moved, &mass)| *moved = mass * *moved);
            column[j] += S::from(1.0);
        }
        let pushed: Vec<S> = masses.iter().zip(&free).map(|(&mass, &free)| mass * free).collect();
        for (&(k, _), &force) in joints.iter().zip(&solve(&moved_by_unit, &pushed)) {
            w[k] += force * self.forward[k];
        }
        self.own_rates(&here.at, u, w, dx);
    }

    /// Returns the mass that effects add to a joint, where a unit force moves it with this acceleration.
    fn added_mass(&self, k: usize, mobility: S, here: &EventInstant<'_, S>, u: &[S]) -> S {
        let (mut added, mut lost) = (S::from(0.0), S::from(0.0));
        let at_joint = |e: &&PlacedEffect<S>| e.inertial && e.place.site.speed().is_some_and(|(w, _)| w == k);
        for effect in self.effects.iter().filter(at_joint) {
            let mass = effect.effect.inertia(&self.at(effect, here, u, S::from(0.0)));
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
    pub(super) fn balance(&self, here: &EventInstant<'_, S>, u: &mut Vec<S>, w: &mut Vec<S>, dx: &mut [S]) -> Vec<S> {
        self.inputs(here, u);
        self.forces(here, u, w);
        if self.contacts.any_stuck() {
            return self.hold(here, u, w, dx);
        }
        self.moved(here, u, w, dx);
        Vec::new()
    }

    /// Calls a function with the inputs that reach the plant, the forces on it, and the friction of each contact if a
    /// joint is stuck.
    pub(super) fn balanced_with<R>(&self, here: &EventInstant<'_, S>, of: impl FnOnce(&[S], &[S], Vec<S>) -> R) -> R {
        // Taken and not borrowed: the function may evaluate the plant again.
        let mut scratch = self.scratch.take();
        let Scratch { u, w, dx } = &mut scratch;
        dx.resize(self.own, S::from(0.0));
        let kept = self.balance(here, u, w, dx);
        let found = of(u, w, kept);
        self.scratch.replace(scratch);
        found
    }

    /// Calls a function with the inputs that reach the plant and the forces on it.
    fn balanced<R>(&self, here: &EventInstant<'_, S>, of: impl FnOnce(&[S], &[S]) -> R) -> R {
        self.balanced_with(here, |u, w, _| of(u, w))
    }

    /// Returns the inputs that reach the plant and the forces on it.
    fn reaching(&self, here: &EventInstant<'_, S>) -> [Vec<S>; 2] {
        self.balanced(here, |u, w| [u.to_vec(), w.to_vec()])
    }

    /// Returns the value of a signal after the effects at its sensor whose index is below `end`; effects with a delay
    /// act after the simulation.
    pub(super) fn seen(&self, signal: usize, end: usize, here: &EventInstant<'_, S>) -> S {
        let at_sensor = |effect: &&PlacedEffect<S>| effect.is_at_sensor_of(signal);
        let simple = |effect: &PlacedEffect<S>| effect.place.companion.is_none();
        if let Some(state) = self.shows[signal]
            && self.effects[..end].iter().filter(at_sensor).all(simple)
        {
            return self.through(signal, end, here.at.x[state], here, &[]);
        }
        // Outputs may contain rates, which depend on the forces.
        self.balanced(here, |u, w| {
            let value = self.plant.signal(signal, &self.inner(&here.at, u, w));
            self.through(signal, end, value, here, u)
        })
    }

    /// Enters the mode of the plant at an instant.
    fn settle_plant(&mut self, here: &EventInstant<'_, S>) {
        let [u, w] = self.reaching(here);
        let at = Instant { t: here.at.t, x: &here.at.x[..self.own], u: &u, w: &w };
        self.plant.settle(&at);
    }

    /// Evaluates the rates of all states and the values of signals, in the mode of the plant at this instant.
    pub(super) fn look(&mut self, at: &Instant<'_, S>, signals: &[usize]) -> (Vec<S>, Vec<S>) {
        let here = fixed(at);
        self.settle_plant(&here);
        let mut dx = vec![S::from(0.0); at.x.len()];
        self.all_rates(&here, &mut dx);
        (dx, signals.iter().map(|&signal| self.signal(signal, at)).collect())
    }

    /// Copies the contacts of another simulation, and the contact and hysteresis states of its effects.
    pub(super) fn take(&mut self, contacts: &Contacts, effects: &[(Option<bool>, Vec<f64>)]) {
        self.contacts = contacts.clone();
        for (effect, (closed, hysteresis)) in self.effects.iter_mut().zip(effects) {
            effect.closed = *closed;
            effect.hysteresis = hysteresis.iter().map(|&m| S::from(m)).collect();
        }
    }

    /// Calls a function with the event as the plant sees it, with its guards and events.
    fn at_event<R>(
        &mut self,
        event: &EventInstant<'_, S>,
        of: impl FnOnce(&mut dyn Events<S>, &EventInstant<'_, S>, &mut String) -> R,
    ) -> Option<R> {
        let [u, w] = self.reaching(event);
        let slopes: Vec<f64> = (0..u.len()).map(|input| self.rate_of_input(input, event)).collect();
        let at = Instant { t: event.at.t, x: &event.at.x[..self.own], u: &u, w: &w };
        let seen = EventInstant { at, du: &|input| slopes[input], delay: event.delay };
        let Self { plant, happened, .. } = self;
        plant.events_mut().map(|events| of(events, &seen, happened))
    }

    fn own_guards(&self) -> usize {
        self.plant.events().map_or(0, |events| events.guards())
    }

    fn own_guard(&self, index: usize, here: &EventInstant<'_, S>) -> S {
        let Some(events) = self.plant.events() else { return S::from(1.0) };
        self.balanced(here, |u, w| {
            let du = |input: usize| self.rate_of_input(input, here);
            events.guard(index, &self.inner(&here.at, u, w), &du)
        })
    }
}

impl<S: PlantScalar> Plant<S> for Affected<'_, S> {
    fn start(&self) -> Vec<S> {
        let mut x = self.plant.start();
        x.resize(self.size(), S::from(0.0));
        x
    }

    fn begin(&mut self, at: &Instant<'_, S>, x: &mut [S]) -> Result<(), Failure> {
        let still = vec![S::from(0.0); self.forward.len()];
        self.start_actuators(at, x);
        let before = x.to_vec();
        let here = with_states(&fixed(at), &before);
        let mut u = Vec::new();
        self.inputs(&here, &mut u);
        let inner = Instant { t: at.t, x: &before[..self.own], u: &u, w: &still };
        self.plant.begin(&inner, &mut x[..self.own])?;
        self.plant.settle(&Instant { x: &x[..self.own], ..inner });
        let sites = self.effects.iter().flat_map(|effect| [Some(effect.place.site), effect.place.companion]);
        for site in sites.flatten() {
            let (Site::Joint { w: k, velocity: state, .. }
            | Site::Speed { w: k, velocity: state }
            | Site::Process { w: k, state }) = site
            else {
                continue;
            };
            let inner = Instant { x: &x[..self.own], ..inner };
            self.forward[k] = if mobility(&self.plant, &inner, k, state).value() < 0.0 { -1.0 } else { 1.0 };
        }
        self.start_others(at, &u, x)
    }

    fn can_start(&self, at: &Instant<'_, S>) -> Result<(), Failure> {
        let (mut u, still) = (Vec::new(), vec![S::from(0.0); self.forward.len()]);
        self.inputs(&fixed(at), &mut u);
        self.plant.can_start(&self.inner(at, &u, &still))
    }

    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        self.all_rates(&fixed(at), dx);
    }

    fn signal(&self, signal: usize, at: &Instant<'_, S>) -> S {
        self.seen(signal, self.effects.len(), &fixed(at))
    }

    fn settle(&mut self, at: &Instant<'_, S>) {
        let first = !std::mem::replace(&mut self.started, true);
        if first || self.guards() > 0 {
            let here = fixed(at);
            self.settle_contacts(&here, None);
            self.settle_plant(&here);
        }
    }

    fn scale(&self, state: usize) -> Option<f64> {
        (state < self.own).then(|| self.plant.scale(state)).flatten()
    }

    fn dead_time(&self, input: usize) -> Option<S> {
        let here = |e: &&PlacedEffect<S>| matches!(e.place.site, Site::Actuator { input: i } if i == input);
        let of_effects = self.effects.iter().filter(here).filter_map(|effect| effect.effect.delay());
        of_effects.chain(self.plant.dead_time(input)).reduce(|a, b| a + b)
    }

    fn longest_step(&self) -> f64 {
        self.effects.iter().map(|e| e.effect.longest_step()).fold(self.plant.longest_step(), f64::min)
    }

    fn damped_step(&self) -> f64 {
        self.effects.iter().map(|e| e.effect.damped_step()).fold(self.plant.damped_step(), f64::min)
    }

    fn explain(&self, failure: Failure) -> Failure {
        self.plant.explain(failure)
    }

    fn events(&self) -> Option<&dyn Events<S>> {
        Some(self)
    }

    fn events_mut(&mut self) -> Option<&mut dyn Events<S>> {
        Some(self)
    }

    fn breaks(&self) -> Option<&dyn Breaks<S>> {
        (!self.changes.is_empty() || self.plant.breaks().is_some()).then_some(self as _)
    }

    fn breaks_mut(&mut self) -> Option<&mut dyn Breaks<S>> {
        (!self.changes.is_empty() || self.plant.breaks().is_some()).then_some(self as _)
    }

    fn memory(&self) -> Option<&dyn Memory<S>> {
        (self.has_hysteresis() || self.plant.memory().is_some()).then_some(self as _)
    }

    fn memory_mut(&mut self) -> Option<&mut dyn Memory<S>> {
        (self.has_hysteresis() || self.plant.memory().is_some()).then_some(self as _)
    }

    fn bounds(&self) -> Option<&dyn Bounds> {
        self.plant.bounds().is_some().then_some(self as _)
    }
}

/// The guards of the plant come first, then those of contacts, then those of edges and hysteresis states.
impl<S: PlantScalar> Events<S> for Affected<'_, S> {
    fn guards(&self) -> usize {
        let [gaps, turns] = self.edges();
        self.own_guards() + self.contacts.len() + gaps + turns
    }

    fn guard(&self, index: usize, at: &Instant<'_, S>, du: InputRates<'_>) -> S {
        let here = EventInstant { at: *at, du, delay: S::from(0.0) };
        let own = self.own_guards();
        let edges = own + self.contacts.len();
        if index >= edges {
            self.edge_guard(index - edges, &here)
        } else if index >= own {
            self.contact_guard(index - own, &here)
        } else {
            self.own_guard(index, &here)
        }
    }

    fn arm(&mut self, at: &Instant<'_, S>) {
        self.at_event(&fixed(at), |events, event, _| events.arm(&event.at));
    }

    fn switch(&mut self, index: usize, event: &EventInstant<'_, S>, x: &mut [S]) -> &str {
        let own = self.own_guards();
        let edges = own + self.contacts.len();
        if index >= own {
            let what = if index >= edges {
                let happened = self.edge_switch(index - edges, event);
                self.settle_contacts(event, None);
                happened
            } else if self.contact_switch(index - own, event, x) {
                "a joint sticks"
            } else {
                "a joint slides"
            };
            let now = x.to_vec();
            self.settle_plant(&with_states(event, &now));
            return what;
        }
        let of_plant = self.own;
        self.at_event(event, |events, event, happened| {
            events.switch(index, event, &mut x[..of_plant]).clone_into(happened);
        });
        let now = x.to_vec();
        self.settle_gaps(&with_states(event, &now));
        &self.happened
    }

    fn rest(&mut self, index: usize, event: &EventInstant<'_, S>, close: f64, x: &mut [S]) -> Result<&str, String> {
        let own = self.own_guards();
        if index >= own {
            let what = if index < own + self.contacts.len() {
                "a joint sticks and slides"
            } else {
                "a contact opens and closes"
            };
            return Err(format!("{what} without end"));
        }
        let of_plant = self.own;
        let rested = self.at_event(event, |events, event, happened| {
            events.rest(index, event, close, &mut x[..of_plant]).map(|what| what.clone_into(happened))
        });
        rested.unwrap_or(Ok(()))?;
        let now = x.to_vec();
        self.settle_gaps(&with_states(event, &now));
        Ok(&self.happened)
    }
}

/// Times at which effects change their form, and the breaks of the plant.
impl<S: PlantScalar> Breaks<S> for Affected<'_, S> {
    fn next(&self, t: f64) -> f64 {
        let of_plant = self.plant.breaks().map_or(f64::INFINITY, |breaks| breaks.next(t));
        let of_effects = self.changes.iter().map(|change| change.value()).find(|&change| change > latest(t));
        of_effects.map_or(of_plant, |change| change.min(of_plant))
    }

    fn pass(&mut self, at: &Instant<'_, S>, x: &mut [S]) -> S {
        let is_now = |change: &&S| is_due(change.value(), at.t) && is_due(at.t, change.value());
        let changes = self.changes.iter().filter(is_now).map(|&change| change - change.value());
        let moves = changes.reduce(|a, b| common(a, b));
        let zero = S::from(0.0);
        if self.plant.breaks().is_none() {
            return moves.unwrap_or(zero);
        }
        // What the plant samples is what it is just before its break, with the effects settled.
        let here = fixed(at);
        self.update_hysteresis(&here, |_| true);
        if self.contacts.len() > 0 {
            self.settle_contacts(&here, None);
        }
        let [u, w] = self.reaching(&here);
        let seen = Instant { t: at.t, x: &at.x[..self.own], u: &u, w: &w };
        let own = self.own;
        let of_plant = self.plant.breaks_mut().map_or(zero, |breaks| breaks.pass(&seen, &mut x[..own]));
        let now = x.to_vec();
        let after = with_states(&here, &now);
        self.settle_gaps(&after);
        self.follow_jump(&after, 0, |_| false);
        match moves.filter(|_| of_plant.tangents().iter().any(|&tangent| tangent != 0.0)) {
            Some(moves) => common(moves, of_plant),
            None => moves.unwrap_or(of_plant),
        }
    }

    fn clocks(&self) -> Vec<linear::Clock> {
        self.plant.breaks().map_or_else(Vec::new, |breaks| breaks.clocks())
    }

    fn changes(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        if let Some(breaks) = self.plant.breaks() {
            self.balanced(&fixed(at), |u, w| breaks.changes(&self.inner(at, u, w), &mut dx[..self.own]));
        }
    }
}

/// Hysteresis of the effects, and the memory of the plant.
impl<S: PlantScalar> Memory<S> for Affected<'_, S> {
    fn reach(&self) -> f64 {
        let remembers = self.effects.iter().any(|e| e.is_at_actuator() && !e.hysteresis.is_empty());
        if remembers { f64::INFINITY } else { self.plant.memory().map_or(0.0, |memory| memory.reach()) }
    }

    fn begin(&mut self, at: &Instant<'_, S>, x: &mut [S]) {
        self.start_past(at, x);
        let now = x.to_vec();
        let (mut u, still) = (Vec::new(), vec![S::from(0.0); self.forward.len()]);
        self.inputs(&with_states(&fixed(at), &now), &mut u);
        let seen = Instant { t: at.t, x: &now[..self.own], u: &u, w: &still };
        let own = self.own;
        if let Some(memory) = self.plant.memory_mut() {
            memory.begin(&seen, &mut x[..own]);
        }
    }

    fn follow(&mut self, over: &Stretch<'_, S>) {
        self.run_up(over);
    }

    fn jump(&mut self, before: &EventInstant<'_, S>, after: &EventInstant<'_, S>) {
        self.update_hysteresis(before, |_| true);
        self.follow_jump(after, 0, PlacedEffect::is_at_actuator);
    }

    fn delays(&self) -> Vec<f64> {
        self.plant.memory().map_or_else(Vec::new, |memory| memory.delays())
    }

    fn past(&self, at: &Instant<'_, S>) -> Vec<S> {
        let Some(memory) = self.plant.memory() else { return Vec::new() };
        self.balanced(&fixed(at), |u, w| memory.past(&self.inner(at, u, w)))
    }

    fn remember(&mut self, over: &Past<'_, S>) -> bool {
        self.plant.memory_mut().is_none_or(|memory| memory.remember(over))
    }

    fn delayed(&self, t: f64) -> Vec<S> {
        self.plant.memory().map_or_else(Vec::new, |memory| memory.delayed(t))
    }

    fn hold(&mut self, past: &[S]) {
        if let Some(memory) = self.plant.memory_mut() {
            memory.hold(past);
        }
    }
}

impl<S: PlantScalar> Affected<'_, S> {
    /// Calls a function with the bounds of the plant, over what reaches it: inputs with effects, and forces, are
    /// unbounded.
    fn bounded(&self, over: &Span<'_>, of: impl FnOnce(&dyn Bounds, &Span<'_>) -> Enclosure) -> Enclosure {
        let Some(bounds) = self.plant.bounds() else { return Enclosure::UNKNOWN };
        let acts_on =
            |i: usize| self.effects.iter().any(|e| matches!(e.place.site, Site::Actuator { input } if input == i));
        let input = |(i, &u): (usize, &Enclosure)| if acts_on(i) { Enclosure::UNKNOWN } else { u };
        let u: Vec<Enclosure> = over.u.iter().enumerate().map(input).collect();
        let w = vec![Enclosure::UNKNOWN; over.w.len()];
        of(bounds, &Span { time: over.time, x: &over.x[..self.own], u: &u, w: &w })
    }
}

/// Bounds of the guards of the plant, and of signals without an effect at their sensor.
impl<S: PlantScalar> Bounds for Affected<'_, S> {
    fn of_guard(&self, index: usize, over: &Span<'_>) -> Enclosure {
        if index >= self.own_guards() {
            return Enclosure::UNKNOWN;
        }
        self.bounded(over, |bounds, over| bounds.of_guard(index, over))
    }

    fn of_signal(&self, signal: usize, over: &Span<'_>) -> Enclosure {
        if self.effects.iter().any(|effect| effect.is_at_sensor_of(signal)) {
            return Enclosure::UNKNOWN;
        }
        self.bounded(over, |bounds, over| bounds.of_signal(signal, over))
    }
}
