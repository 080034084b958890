//! Edges of effects, at which their laws change, and hysteresis states: their guards, what happens there, and how they
//! start.

use mops_core::{
    Failure, Instant,
    effect::PortState,
    plant::{EventInstant, PlantScalar, Stretch},
};

use super::place::Site;
use super::plant::{Affected, PlacedEffect, fixed, with_states};

/// Half the time over which the rate of a value at an actuator or a sensor is a difference, as a fraction of the
/// horizon: it resolves 10,000 oscillations, and rounding of the value changes the rate by 1e-9 of the value per
/// horizon.
pub(super) const BLINK: f64 = 1e-7;

/// Change of a value at an edge, relative to the value, that is more than rounding: an edge is located to some 1e-12 of
/// a step.
const JUMP: f64 = 1e-6;

/// Number of parts of a time span before time 0, at whose ends hysteresis guards are read: commands are polynomials
/// within it.
const RUN_UP_PARTS: f64 = 16.0;

/// Width of the bracket in which a hysteresis guard crosses zero before time 0, relative to a part.
const RUN_UP_RESOLUTION: f64 = 1e-10;

impl<S: PlantScalar> PlacedEffect<S> {
    /// Returns the output of the effect at an actuator or a sensor.
    pub(super) fn passed(&self, at: &PortState<'_, S>, z: &[S]) -> S {
        match &self.hysteresis[..] {
            [] => self.effect.value(at, z),
            hysteresis => self.effect.hysteresis_value(at, hysteresis),
        }
    }

    /// Returns the states of the effect.
    pub(super) fn states<'b>(&self, x: &'b [S]) -> &'b [S] {
        &x[self.states.0..self.states.0 + self.states.1]
    }

    /// Updates the hysteresis state to an instant.
    fn follow(&mut self, at: &PortState<'_, S>) {
        let first = self.hysteresis[0].value().is_nan();
        self.effect.update_hysteresis(at, &mut self.hysteresis);
        if first {
            self.hysteresis[0] += self.first_offset;
            self.effect.update_hysteresis(at, &mut self.hysteresis);
        }
    }

    /// Returns true if the effect has a hysteresis state that is known.
    fn has_started(&self) -> bool {
        self.hysteresis.first().is_some_and(|first| !first.value().is_nan())
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

impl<S: PlantScalar> Affected<'_, S> {
    /// Returns the number of gaps, and of effects with a hysteresis state.
    pub(super) fn edges(&self) -> [usize; 2] {
        let count = |has: fn(&&PlacedEffect<S>) -> bool| self.effects.iter().filter(has).count();
        [count(|effect| effect.closed.is_some()), count(|effect| !effect.hysteresis.is_empty())]
    }

    /// Returns true if effects follow jumps of the inputs.
    pub(super) fn has_hysteresis(&self) -> bool {
        self.effects.iter().any(|e| !e.hysteresis.is_empty() || e.is_at_actuator() && e.closed.is_some())
    }

    /// Returns the index of an effect with a gap, or of one with a hysteresis state, by the number of the edge: first
    /// the gaps.
    fn of_edge(&self, number: usize) -> (usize, bool) {
        let all = || self.effects.iter().enumerate();
        let gaps = all().filter(|(_, effect)| effect.closed.is_some()).map(|(index, _)| (index, true));
        let turns = all().filter(|(_, effect)| !effect.hysteresis.is_empty()).map(|(index, _)| (index, false));
        gaps.chain(turns).nth(number).expect("the number is valid")
    }

    /// Returns the value that reaches an effect at an actuator or a sensor; 0 for other effects.
    pub(super) fn arriving(&self, index: usize, here: &EventInstant<'_, S>) -> S {
        match self.effects[index].place.site {
            Site::Actuator { .. } => {
                self.inputs(here, &mut Vec::new());
                self.incoming.borrow()[index]
            }
            Site::Sensor { signal } => self.seen(signal, index, here),
            Site::Joint { .. } | Site::Speed { .. } | Site::Process { .. } => S::from(0.0),
        }
    }

    /// Returns what an effect with an edge receives; for an effect with a hysteresis state with the rate of its value,
    /// per s.
    fn at_edge(&self, index: usize, here: &EventInstant<'_, S>) -> PortState<'static, S> {
        let effect = &self.effects[index];
        let at = self.at(effect, here, &[], self.arriving(index, here));
        let arriving = |here: &EventInstant<'_, S>| self.arriving(index, here);
        let v = if effect.hysteresis.is_empty() { at.v } else { self.rate_of(here, arriving) };
        PortState { v, u: &[], ..at }
    }

    /// Returns the rate of a value along the solution, per s.
    fn rate_of(&self, here: &EventInstant<'_, S>, value: impl Fn(&EventInstant<'_, S>) -> S) -> S {
        let mut rates = vec![S::from(0.0); here.at.x.len()];
        if self.started {
            self.all_rates(here, &mut rates);
        }
        let there = |by: f64| {
            let x: Vec<S> = here.at.x.iter().zip(&rates).map(|(&x, &rate)| x + rate * by).collect();
            let u: Vec<S> = here.at.u.iter().enumerate().map(|(input, &u)| u + (here.du)(input) * by).collect();
            let at = Instant { t: here.at.t + by, x: &x, u: &u, w: here.at.w };
            value(&EventInstant { at, ..*here })
        };
        (there(self.blink) - there(-self.blink)) / (2.0 * self.blink)
    }

    /// Returns the rate of an input as it reaches the plant, per s.
    pub(super) fn rate_of_input(&self, input: usize, here: &EventInstant<'_, S>) -> f64 {
        let acts = |e: &PlacedEffect<S>| matches!(e.place.site, Site::Actuator { input: i } if i == input);
        if !self.effects.iter().any(acts) {
            return (here.du)(input);
        }
        let reaching = |here: &EventInstant<'_, S>| {
            let mut u = Vec::new();
            self.inputs(here, &mut u);
            u[input]
        };
        self.rate_of(here, reaching).value()
    }

    /// Returns the guard of an edge, by its number.
    pub(super) fn edge_guard(&self, number: usize, here: &EventInstant<'_, S>) -> S {
        let (index, is_gap) = self.of_edge(number);
        let (effect, at) = (&self.effects[index], self.at_edge(index, here));
        if !is_gap {
            return effect.effect.hysteresis_guard(&at, &effect.hysteresis);
        }
        let gap = effect.effect.gap(&at).expect("the effect had a gap at the start");
        if effect.closed == Some(true) { -gap } else { gap }
    }

    /// Finds the side of their edges on which all effects are: at the start, and after a jump of the plant state.
    pub(super) fn settle_gaps(&mut self, here: &EventInstant<'_, S>) {
        (0..self.effects.len()).for_each(|index| self.settle_gap(index, here));
    }

    fn settle_gap(&mut self, index: usize, here: &EventInstant<'_, S>) {
        // The sign decides where the side is unknown.
        self.effects[index].closed = None;
        let gap = self.effects[index].effect.gap(&self.at_edge(index, here));
        self.effects[index].closed = gap.map(|gap| gap.value() < 0.0);
    }

    /// Takes the effects from `first` on to the values that they receive after a jump, in their order, as each receives
    /// the output of those before it: their hysteresis states, and of some the side of the edge.
    pub(super) fn follow_jump(
        &mut self,
        here: &EventInstant<'_, S>,
        first: usize,
        settles: impl Fn(&PlacedEffect<S>) -> bool,
    ) {
        for index in first..self.effects.len() {
            let effect = &self.effects[index];
            if (effect.is_at_actuator() || effect.is_at_sensor()) && effect.closed.is_some() && settles(effect) {
                self.settle_gap(index, here);
            }
            if self.effects[index].has_started() {
                self.update_hysteresis_of(index, here);
            }
        }
    }

    /// Passes an edge after its guard became negative. Returns what happened; empty at actuators and sensors.
    pub(super) fn edge_switch(&mut self, number: usize, event: &EventInstant<'_, S>) -> &'static str {
        let (index, is_gap) = self.of_edge(number);
        if !is_gap {
            self.update_hysteresis_of(index, event);
            return "";
        }
        let before = self.onward_of(index, event);
        self.cross(index);
        if (self.onward_of(index, event) - before).value().abs() > JUMP * before.value().abs() {
            // The value that is passed on jumps, as that of a sensor with a gap: what comes after goes up to the jump,
            // then over it.
            self.cross(index);
            self.update_hysteresis(event, |_| true);
            self.cross(index);
            self.follow_jump(event, index + 1, |_| true);
        }
        let effect = &self.effects[index];
        match (effect.place.site, effect.closed == Some(true)) {
            (Site::Process { .. }, true) => "a level rises above an edge",
            (Site::Process { .. }, false) => "a level falls below an edge",
            (Site::Joint { .. }, true) => "a contact closes",
            (Site::Joint { .. }, false) => "a contact opens",
            (Site::Speed { .. } | Site::Actuator { .. } | Site::Sensor { .. }, _) => "",
        }
    }

    /// Takes an effect to the other side of its edge.
    fn cross(&mut self, index: usize) {
        let closed = self.effects[index].closed.as_mut().expect("the effect has a gap");
        *closed = !*closed;
    }

    /// Returns the value that an effect at an actuator or a sensor passes on; 0 for other effects.
    fn onward_of(&self, index: usize, here: &EventInstant<'_, S>) -> S {
        let effect = &self.effects[index];
        match effect.place.site {
            Site::Actuator { .. } | Site::Sensor { .. } => {
                effect.passed(&self.at(effect, here, &[], self.arriving(index, here)), effect.states(here.at.x))
            }
            Site::Joint { .. } | Site::Speed { .. } | Site::Process { .. } => S::from(0.0),
        }
    }

    fn update_hysteresis_of(&mut self, index: usize, here: &EventInstant<'_, S>) {
        let at = self.at_edge(index, here);
        self.effects[index].follow(&at);
    }

    /// Updates the hysteresis states of some effects, in their order.
    pub(super) fn update_hysteresis(&mut self, here: &EventInstant<'_, S>, which: impl Fn(&PlacedEffect<S>) -> bool) {
        for index in 0..self.effects.len() {
            if which(&self.effects[index]) && self.effects[index].has_started() {
                self.update_hysteresis_of(index, here);
            }
        }
    }

    /// Updates the hysteresis states of the effects at actuators up to the end of a stretch of the past, also where
    /// their laws change within it.
    pub(super) fn run_up(&mut self, over: &Stretch<'_, S>) {
        fn look<S: PlantScalar, R>(over: &Stretch<'_, S>, t: f64, of: impl FnOnce(&EventInstant<'_, S>) -> R) -> R {
            let [u, w] = (over.at)(t);
            let at = Instant { t, x: over.x, u: &u, w: &w };
            of(&EventInstant { at, du: &|input| (over.rate)(t, input), delay: S::from(0.0) })
        }
        let lowest = |of: &Self, t: f64| {
            let acts = |(_, e): &(usize, &PlacedEffect<S>)| e.is_at_actuator() && !e.hysteresis.is_empty();
            look(over, t, |here| {
                let guard = |(index, e): (usize, &PlacedEffect<S>)| {
                    e.effect.hysteresis_guard(&of.at_edge(index, here), &e.hysteresis)
                };
                of.effects.iter().enumerate().filter(acts).map(|e| guard(e).value()).fold(f64::INFINITY, f64::min)
            })
        };
        let update = |of: &mut Self, t: f64| {
            look(over, t, |here| of.update_hysteresis(here, PlacedEffect::is_at_actuator));
        };
        let [start, end] = over.time;
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
                update(self, high);
                // A guard that is negative again at once, by rounding, is read at the end of the part.
                high = if high - t > 2.0 * near { high } else { to };
            }
            t = high;
        }
        update(self, end);
    }

    fn at_actuators(&self) -> Vec<usize> {
        (0..self.effects.len()).filter(|&index| self.effects[index].is_at_actuator()).collect()
    }

    /// Initialises the states of an effect at an actuator, as if the value that reaches it had been constant for long.
    /// Returns what reaches it.
    ///
    /// N.B.: effects before it on the same actuator that depend on the state of the plant, or have states, are
    /// evaluated as at the start.
    fn start_actuator(&mut self, index: usize, at: &Instant<'_, S>, x: &mut [S]) {
        let now = x.to_vec();
        let state = self.at_edge(index, &with_states(&fixed(at), &now));
        let effect = &mut self.effects[index];
        effect.effect.start(&state, &mut x[effect.states.0..effect.states.0 + effect.states.1]);
    }

    /// Initialises the effects at actuators for inputs that have been constant for long.
    pub(super) fn start_past(&mut self, at: &Instant<'_, S>, x: &mut [S]) {
        for index in self.at_actuators() {
            self.start_actuator(index, at, x);
            if !self.effects[index].hysteresis.is_empty() {
                let now = x.to_vec();
                self.update_hysteresis_of(index, &with_states(&fixed(at), &now));
            }
        }
    }

    /// Initialises the effects at actuators just before the start, with their offsets; their hysteresis states have
    /// followed the past.
    pub(super) fn start_actuators(&mut self, at: &Instant<'_, S>, x: &mut [S]) {
        for index in self.at_actuators() {
            self.start_actuator(index, at, x);
            let effect = &mut self.effects[index];
            let z = effect.states.0..effect.states.0 + effect.states.1;
            x[z].iter_mut().zip(&effect.offsets).for_each(|(z, &offset)| *z += offset);
            if let Some(output) = effect.hysteresis.first_mut() {
                *output += effect.offsets.first().copied().unwrap_or(S::from(0.0));
                let now = x.to_vec();
                self.update_hysteresis_of(index, &with_states(&fixed(at), &now));
            }
        }
    }

    /// Initialises the states of all other effects and finds the joints with dry friction; `u` are the inputs that
    /// reach the plant.
    ///
    /// # Errors
    /// Dry friction acts elsewhere.
    pub(super) fn start_others(&mut self, at: &Instant<'_, S>, u: &[S], x: &mut [S]) -> Result<(), Failure> {
        let (last, first): (Vec<usize>, Vec<usize>) =
            (0..self.effects.len()).partition(|&index| self.effects[index].is_at_sensor());
        // What sensors measure depends on all other effects, and on the sensor effects before.
        for index in first.into_iter().chain(last) {
            if self.effects[index].is_at_actuator() {
                continue;
            }
            let now = x.to_vec();
            let here = with_states(&fixed(at), &now);
            let effect = &self.effects[index];
            let (first, count) = effect.states;
            let state = self.at(effect, &here, u, self.arriving(index, &here));
            let mut z = vec![S::from(0.0); count];
            effect.effect.start(&state, &mut z);
            if effect.effect.friction(&state, &z).is_some() {
                let Some((w, velocity)) = effect.place.site.speed() else {
                    return Err(Failure::Undefined("dry friction acts at a joint or a speed".into()));
                };
                self.contacts.add(index, w, velocity);
            }
            let effect = &mut self.effects[index];
            z.iter_mut().zip(&effect.offsets).for_each(|(z, &over)| *z += over);
            effect.first_offset = effect.offsets.first().copied().unwrap_or(S::from(0.0));
            x[first..first + count].copy_from_slice(&z);
            if !effect.hysteresis.is_empty() {
                let now = x.to_vec();
                self.update_hysteresis_of(index, &with_states(&fixed(at), &now));
            }
        }
        let now = x.to_vec();
        self.settle_gaps(&with_states(&fixed(at), &now));
        Ok(())
    }
}
