//! Edges of effects, at which their laws change, and hysteresis states: their guards, and what happens there.

use mops_core::{Opening, PortState};

use super::Site;
use super::command::Command;
use super::dynamics::{Actor, Driven};

/// Half the time over which the rate of a value at an actuator or a sensor is a difference, as a fraction of the horizon: it resolves
/// 10,000 oscillations, and rounding of the value changes the rate by 1e-9 of the value per horizon.
pub(super) const BLINK: f64 = 1e-7;

/// Change of a value at an edge, relative to the value, that is more than rounding: an edge is located to some 1e-12 of a step.
const JUMP: f64 = 1e-6;

/// Number of parts of a time span before time 0, at whose ends hysteresis guards are read: commands are polynomials within it.
const RUN_UP_PARTS: f64 = 16.0;

/// Width of the bracket in which a hysteresis guard crosses zero before time 0, relative to a part.
const RUN_UP_RESOLUTION: f64 = 1e-10;

impl<S: Opening> Actor<S> {
    /// Returns the output of the effect at an actuator or a sensor.
    pub(super) fn passed(&self, at: &PortState<'_, S>, z: &[S]) -> S {
        match &self.memory[..] {
            [] => self.acting.value(at, z),
            memory => self.acting.hysteresis_value(at, memory),
        }
    }

    /// Returns true if the effect acts at an actuator.
    pub(super) fn is_at_actuator(&self) -> bool {
        matches!(self.place.site, Site::Actuator { .. })
    }

    /// Returns true if the effect acts at a sensor.
    pub(super) fn is_at_sensor(&self) -> bool {
        matches!(self.place.site, Site::Sensor { .. })
    }

    /// Returns true if the effect acts at the sensor of this signal.
    pub(super) fn is_at_sensor_of(&self, signal: usize) -> bool {
        matches!(self.place.site, Site::Sensor { signal: of } if of == signal)
    }
}

impl<S: Opening> Driven<'_, S> {
    /// Returns the number of gaps, and of effects with a hysteresis state.
    pub(super) fn edges(&self) -> [usize; 2] {
        let count = |has: fn(&&Actor<S>) -> bool| self.actors.iter().filter(has).count();
        [count(|actor| actor.closed.is_some()), count(|actor| !actor.memory.is_empty())]
    }

    /// Returns the index of an effect with a gap, or of one with a hysteresis state, by the number of the edge: first the gaps.
    fn of_edge(&self, number: usize) -> (usize, bool) {
        let all = || self.actors.iter().enumerate();
        let gaps = all().filter(|(_, actor)| actor.closed.is_some()).map(|(index, _)| (index, true));
        let turns = all().filter(|(_, actor)| !actor.memory.is_empty()).map(|(index, _)| (index, false));
        gaps.chain(turns).nth(number).expect("the number is valid")
    }

    /// Returns the value that reaches an effect at an actuator or a sensor; 0 for other effects.
    pub(super) fn arriving(&self, index: usize, t: f64, x: &[S]) -> S {
        match self.actors[index].place.site {
            Site::Actuator { .. } => {
                self.inputs(t, x, &mut Vec::new());
                self.incoming.borrow()[index]
            }
            Site::Sensor { signal } => self.seen(signal, index, t, x),
            Site::Joint { .. } | Site::Process { .. } => S::from(0.0),
        }
    }

    /// Returns what an effect with an edge receives; for an effect with a hysteresis state with the rate of its value, per s.
    fn at_edge(&self, index: usize, t: f64, x: &[S]) -> PortState<'static, S> {
        let actor = &self.actors[index];
        let at = self.at(actor, t, x, &[], self.arriving(index, t, x));
        let v = if actor.memory.is_empty() { at.v } else { self.arriving_rate(index, t, x) };
        PortState { v, u: &[], ..at }
    }

    fn arriving_rate(&self, index: usize, t: f64, x: &[S]) -> S {
        let mut rates = vec![S::from(0.0); x.len()];
        if self.started {
            self.rates(t, x, &mut rates);
        }
        let there = |by: f64| {
            let x: Vec<S> = x.iter().zip(&rates).map(|(&x, &rate)| x + rate * by).collect();
            self.arriving(index, t + by, &x)
        };
        (there(self.blink) - there(-self.blink)) / (2.0 * self.blink)
    }

    /// Returns the guard of an edge, by its number.
    pub(super) fn edge_guard(&self, number: usize, t: f64, x: &[S]) -> S {
        let (index, is_gap) = self.of_edge(number);
        let (actor, at) = (&self.actors[index], self.at_edge(index, t, x));
        if !is_gap {
            return actor.acting.hysteresis_guard(&at, &actor.memory);
        }
        let gap = actor.acting.gap(&at).expect("the effect had a gap at the start");
        if actor.closed == Some(true) { -gap } else { gap }
    }

    /// Finds the side of their edges on which all effects are: at the start, and after a jump of the plant state.
    pub(super) fn settle_gaps(&mut self, t: f64, x: &[S]) {
        (0..self.actors.len()).for_each(|index| self.settle_gap(index, t, x));
    }

    fn settle_gap(&mut self, index: usize, t: f64, x: &[S]) {
        // The sign decides where the side is unknown.
        self.actors[index].closed = None;
        let gap = self.actors[index].acting.gap(&self.at_edge(index, t, x));
        self.actors[index].closed = gap.map(|gap| gap.value() < 0.0);
    }

    /// Takes the effects from `first` on to the values that they receive after a jump, in their order, as each receives the output of those
    /// before it: their hysteresis states, and of some the side of the edge.
    pub(super) fn follow(&mut self, t: f64, x: &[S], first: usize, settles: impl Fn(&Actor<S>) -> bool) {
        for index in first..self.actors.len() {
            let actor = &self.actors[index];
            if (actor.is_at_actuator() || actor.is_at_sensor()) && actor.closed.is_some() && settles(actor) {
                self.settle_gap(index, t, x);
            }
            if !self.actors[index].memory.is_empty() {
                self.update_hysteresis_of(index, t, x);
            }
        }
    }

    /// Passes an edge after its guard became negative. Returns what happened; empty at actuators and sensors.
    pub(super) fn edge_switch(&mut self, number: usize, t: f64, x: &[S]) -> &'static str {
        let (index, is_gap) = self.of_edge(number);
        if !is_gap {
            self.update_hysteresis_of(index, t, x);
            return "";
        }
        let before = self.onward_of(index, t, x);
        self.cross(index);
        if (self.onward_of(index, t, x) - before).value().abs() > JUMP * before.value().abs() {
            // The value that is passed on jumps, as that of a sensor with a gap: what comes after goes up to the jump, then over it.
            self.cross(index);
            self.update_hysteresis(t, x, |_| true);
            self.cross(index);
            self.follow(t, x, index + 1, |_| true);
        }
        let actor = &self.actors[index];
        match (actor.place.site, actor.closed == Some(true)) {
            (Site::Process { .. }, true) => "a level rises above an edge",
            (Site::Process { .. }, false) => "a level falls below an edge",
            (Site::Joint { .. }, true) => "a contact closes",
            (Site::Joint { .. }, false) => "a contact opens",
            (Site::Actuator { .. } | Site::Sensor { .. }, _) => "",
        }
    }

    /// Takes an effect to the other side of its edge.
    fn cross(&mut self, index: usize) {
        let closed = self.actors[index].closed.as_mut().expect("the effect has a gap");
        *closed = !*closed;
    }

    /// Returns the value that an effect at an actuator or a sensor passes on; 0 for other effects.
    fn onward_of(&self, index: usize, t: f64, x: &[S]) -> S {
        let actor = &self.actors[index];
        match actor.place.site {
            Site::Actuator { .. } | Site::Sensor { .. } => {
                actor.passed(&self.at(actor, t, x, &[], self.arriving(index, t, x)), self.states(actor, x))
            }
            Site::Joint { .. } | Site::Process { .. } => S::from(0.0),
        }
    }

    pub(super) fn update_hysteresis_of(&mut self, index: usize, t: f64, x: &[S]) {
        let at = self.at_edge(index, t, x);
        self.actors[index].follow(&at);
    }

    /// Updates the hysteresis states of some effects, in their order.
    pub(super) fn update_hysteresis(&mut self, t: f64, x: &[S], which: impl Fn(&Actor<S>) -> bool) {
        for index in 0..self.actors.len() {
            if which(&self.actors[index]) && !self.actors[index].memory.is_empty() {
                self.update_hysteresis_of(index, t, x);
            }
        }
    }

    /// Updates the hysteresis states of the effects at actuators up to the end of a time span in which no command jumps or bends, also
    /// where their laws change within it.
    fn run_up(&mut self, [start, end]: [f64; 2], x: &[S]) {
        let lowest = |of: &Self, t: f64| {
            let acts = |(_, actor): &(usize, &Actor<S>)| actor.is_at_actuator() && !actor.memory.is_empty();
            let guard = |(index, actor): (usize, &Actor<S>)| {
                actor.acting.hysteresis_guard(&of.at_edge(index, t, x), &actor.memory)
            };
            of.actors.iter().enumerate().filter(acts).map(|e| guard(e).value()).fold(f64::INFINITY, f64::min)
        };
        let part = (end - start) / RUN_UP_PARTS;
        let mut t = start;
        while t < end {
            // The last part ends at the end, whatever the rounding.
            let to = if t + 1.5 * part >= end { end } else { t + part };
            let [mut low, mut high] = [t, to];
            if lowest(self, to) < 0.0 {
                let near = RUN_UP_RESOLUTION * part;
                while high - low > near {
                    let middle = 0.5 * (low + high);
                    if middle <= low || middle >= high {
                        break;
                    }
                    *(if lowest(self, middle) < 0.0 { &mut high } else { &mut low }) = middle;
                }
                self.update_hysteresis(high, x, Actor::is_at_actuator);
                // A guard that is negative again at once, by rounding, is read at the end of the part.
                high = if high - t > 2.0 * near { high } else { to };
            }
            t = high;
        }
        self.update_hysteresis(end, x, Actor::is_at_actuator);
    }

    /// Moves the commands to time 0 from the left, and initialises the states and the hysteresis states of the effects at actuators, as
    /// if the command just before time 0 had been constant for long. Hysteresis states follow the earlier samples of a record.
    ///
    /// N.B.: effects before them on the same actuator that depend on the state of the plant, or have states, are
    /// evaluated as at time 0.
    pub(super) fn start_actuators(&mut self, x: &mut [S], parameters: &[S]) {
        let next = |of: &Self| of.commands.iter().map(Command::next_break).fold(0.0, f64::min);
        let mut t = next(self);
        for index in (0..self.actors.len()).filter(|&index| self.actors[index].is_at_actuator()).collect::<Vec<_>>() {
            self.start_actuator(index, t, x);
            if !self.actors[index].memory.is_empty() {
                self.update_hysteresis_of(index, t, x);
            }
        }
        while t < 0.0 {
            self.commands.iter_mut().for_each(|command| command.pass_break(t));
            self.update_hysteresis(t, x, Actor::is_at_actuator);
            let end = next(self);
            self.run_up([t, end], x);
            t = end;
        }
        for index in (0..self.actors.len()).filter(|&index| self.actors[index].is_at_actuator()).collect::<Vec<_>>() {
            self.start_actuator(index, 0.0, x);
            let actor = &mut self.actors[index];
            let ahead = actor.place.starts.map_or(&[][..], |starts| &parameters[starts..]);
            x[actor.z.0..actor.z.0 + actor.z.1].iter_mut().zip(ahead).for_each(|(z, &ahead)| *z += ahead);
            if let Some(output) = actor.memory.first_mut() {
                *output += ahead.first().copied().unwrap_or(S::from(0.0));
                self.update_hysteresis_of(index, 0.0, x);
            }
        }
    }

    /// Initialises the states of an effect at an actuator, as if the value that reaches it had been constant for long.
    fn start_actuator(&self, index: usize, t: f64, x: &mut [S]) {
        let (at, actor) = (self.at_edge(index, t, x), &self.actors[index]);
        actor.acting.start(&at, &mut x[actor.z.0..actor.z.0 + actor.z.1]);
    }
}
