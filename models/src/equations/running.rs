//! Compiled model as a plant, with its current values and modes.

use std::cell::{RefCell, RefMut};

use mops_core::{
    Failure, Instant, Plant,
    plant::{Bounds, Breaks, EventInstant, Events, InputRates, Jacobian, LeftOut, Memory, Past, Selected, Span},
};
use mops_language::{DIRECTIONS, Dual, Dual7, Scalar, enclosure::Enclosure, expression::Comparison};
use mops_linear as linear;

use super::bank::{Bank, Large, Register};
use super::bounds::{self, moved, signed};
use super::compiled::{Compiled, Signal};
use super::phase::Phase;
use super::program::Program;
use super::ticking::Ticking;
use crate::kernel::elements::delay::{Delay, Restart, pass_delays, remember_delays};
use crate::kernel::{Tolerance, next_of};

/// Plant of a compiled model; `B` is the bank of registers.
pub struct Running<'a, S, B> {
    pub(super) model: &'a Compiled,
    pub(super) bank: RefCell<B>,
    /// Initial states.
    start: Vec<S>,
    pub(super) parameters: &'a [S],
    pub(super) tolerance: Tolerance,
    started: bool,
    /// Current values of the modes.
    pub(super) modes: Vec<f64>,
    /// Joints whose friction is zero throughout.
    pub(super) frictionless: Vec<bool>,
    /// Tolerance added to the guard of each switch, so that a kink is clearly passed before the branch changes.
    pub(super) slack: Vec<f64>,
    /// Largest magnitude of the sides of each switch at its evaluations so far.
    pub(super) spans: Vec<f64>,
    /// Number of changes of each switch.
    flips: Vec<usize>,
    /// Phases of the events.
    pub(super) phases: Vec<Phase>,
    /// Delayed quantities.
    pub(super) delays: Vec<Delay<S>>,
    /// Progress of the clocks.
    pub(super) ticking: Vec<Ticking<S>>,
    /// States fixed by events at rest.
    pub(super) fixed: Vec<usize>,
    /// Largest absolute values of the states, at the start and at events.
    pub(super) sizes: Vec<f64>,
    /// Registers with bounds, created on first use.
    bounds: RefCell<Vec<Enclosure>>,
    /// Registers for the Jacobian, created on first use.
    jacobian: RefCell<Option<Large<Dual7>>>,
}

/// Number of changes from which a condition is reported as the cause of a reached step limit: a thousandth of the
/// default limit.
const FLIPS: usize = 100;

/// Limit on the number of passes to determine the past: an echo of half the size is then below rounding.
const MOST_PASSES: usize = 100;

/// Message for conditions that switch without end.
const TO_AND_FRO: &str =
    "a condition of `sign` or `if` switches back and forth without end; use `friction` for dry friction";

/// Object of a guard.
enum Guard {
    Joint(usize),
    Switch(usize),
    Happening(usize),
}

impl<'a, S: Scalar, B: Bank<S>> Running<'a, S, B> {
    /// Creates the plant with these parameters; initial states among them are ignored.
    pub fn new(model: &'a Compiled, parameters: &'a [S], tolerance: Tolerance) -> Self {
        let mut bank = B::with(model.layout.registers);
        set_up(model, &mut bank, parameters.iter().copied());
        model.delays.run(&mut bank);
        let delays = model.delays.results.iter().map(|&time| Delay::new(bank.get(time), S::from(0.0))).collect();
        Self {
            model,
            bank: RefCell::new(bank),
            start: Vec::new(),
            jacobian: RefCell::new(None),
            parameters,
            tolerance,
            started: false,
            modes: vec![0.0; model.switches.len() + 2 * model.joints.len()],
            frictionless: vec![false; model.joints.len()],
            slack: vec![0.0; model.switches.len()],
            spans: vec![0.0; model.switches.len()],
            flips: vec![0; model.switches.len()],
            phases: vec![Phase::Armed(0.0); model.happenings.len()],
            delays,
            ticking: vec![Ticking::new(); model.clocks.len()],
            fixed: Vec::new(),
            sizes: vec![0.0; model.states],
            bounds: RefCell::new(Vec::new()),
        }
    }

    /// Sets the initial states.
    #[must_use]
    pub fn starting_at(self, start: Vec<S>) -> Self {
        Self { start, ..self }
    }

    /// Returns the initial values given by expressions: state and value.
    pub fn starts(&self) -> Vec<(usize, S)> {
        let mut bank = self.bank.borrow_mut();
        let (states, tape) = &self.model.starts;
        tape.run(&mut *bank);
        states.iter().zip(&tape.results).map(|(&state, &register)| (state, bank.get(register))).collect()
    }

    /// Loads an instant into the registers. External forces are inputs after the others, if the model was compiled with
    /// them.
    #[inline(always)]
    pub(super) fn load(&self, bank: &mut B, at: &Instant<'_, S>) {
        let layout = &self.model.layout;
        for (i, &x) in at.x.iter().enumerate() {
            bank.set(layout.state(i), x);
        }
        for (i, &u) in at.u.iter().enumerate() {
            bank.set(layout.input(i), u);
        }
        for (i, &w) in self.forces(at.w).iter().enumerate() {
            bank.set(layout.input(at.u.len() + i), w);
        }
        for (delay, register) in self.delays.iter().zip(self.delayed_inputs(at)) {
            bank.set(register, delay.at(at.t));
        }
        bank.set(layout.time(), S::from(at.t));
    }

    /// Returns the registers of the delayed quantities.
    #[inline(always)]
    pub(super) fn delayed_inputs<'w, T>(&self, at: &Instant<'w, T>) -> impl Iterator<Item = Register> {
        let first = at.u.len() + self.forces(at.w).len();
        (first..first + self.delays.len()).map(|index| self.model.layout.input(index))
    }

    /// Returns the external forces, if the equations contain them.
    #[inline(always)]
    pub(super) fn forces<'w, T>(&self, w: &'w [T]) -> &'w [T] {
        if self.model.takes_forces { w } else { &[] }
    }

    /// Returns the results of a tape at an instant.
    pub(super) fn results<const N: usize>(&self, tape: &Program, at: &Instant<'_, S>) -> [S; N] {
        let mut bank = self.bank.borrow_mut();
        self.load(&mut bank, at);
        tape.run(&mut *bank);
        std::array::from_fn(|k| bank.get(tape.results[k]))
    }

    fn kind(&self, index: usize) -> Guard {
        let (joints, switches) = (self.model.joints.len(), self.model.switches.len());
        if index < joints {
            Guard::Joint(index)
        } else if index < joints + switches {
            Guard::Switch(index - joints)
        } else {
            Guard::Happening(index - joints - switches)
        }
    }

    /// Returns the registers with the bounds of an interval.
    fn load_bounds(&self, Span { time, x, u, w }: &Span<'_>) -> RefMut<'_, Vec<Enclosure>> {
        let layout = &self.model.layout;
        let mut registers = self.bounds.borrow_mut();
        if registers.is_empty() {
            *registers = bounds::registers(&*self.bank.borrow(), layout.registers);
        }
        for (mode, &value) in self.modes.iter().enumerate() {
            registers[usize::from(layout.mode(mode))] = Enclosure::from(value);
        }
        registers[usize::from(layout.state(0))..][..x.len()].copy_from_slice(x);
        for (i, input) in u.iter().chain(self.forces(w)).enumerate() {
            registers[usize::from(layout.input(i))] = *input;
        }
        let first = u.len() + self.forces(w).len();
        for k in 0..self.delays.len() {
            registers[usize::from(layout.input(first + k))] = Enclosure::UNKNOWN;
        }
        registers[usize::from(layout.time())] = *time;
        registers
    }

    fn enclose(&self, index: usize, over: &Span<'_>) -> Enclosure {
        let mut registers = self.load_bounds(over);
        match self.kind(index) {
            Guard::Joint(j) if self.frictionless[j] => Enclosure::from(1.0),
            Guard::Joint(j) => {
                let joint = &self.model.joints[j];
                if self.is(joint.contact.stuck) {
                    joint.balance.enclose(&mut registers);
                    let [torque, limit] = [0, 1].map(|k| registers[usize::from(joint.balance.results[k])]);
                    let zero = Enclosure::from(0.0);
                    limit - torque.holds(Comparison::AtLeast, zero).choose(torque, -torque)
                } else {
                    over.x[joint.contact.velocity] * Enclosure::from(self.modes[joint.contact.direction])
                }
            }
            Guard::Switch(k) => {
                let switch = &self.model.switches[k];
                switch.sides.enclose(&mut registers);
                let difference = registers[usize::from(switch.sides.results[0])];
                moved(signed(!self.is(switch.mode), difference), self.slack[k])
            }
            Guard::Happening(k) => self.enclose_happening(k, &mut registers),
        }
    }

    /// Returns the guard index of an event.
    pub(super) fn guard_of(&self, happening: usize) -> usize {
        self.model.joints.len() + self.model.switches.len() + happening
    }

    /// Computes the derivatives, with no state fixed.
    #[inline(always)]
    pub(super) fn free_rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        let mut bank = self.bank.borrow_mut();
        let bank = &mut *bank;
        self.load(bank, at);
        self.model.derivative.run(bank);
        for (dx, &register) in dx.iter_mut().zip(&self.model.derivative.results) {
            *dx = bank.get(register);
        }
    }

    /// Assigns new values to states, computed from the values before the event.
    pub(super) fn assign(&self, (states, tape): &(Vec<usize>, Program), event: &EventInstant<'_, S>, x: &mut [S]) {
        let mut bank = self.bank.borrow_mut();
        self.load(&mut bank, &event.at);
        if S::DIRECTIONS > 0 {
            bank.set(self.model.layout.time(), event.delay + event.at.t);
            for (delay, register) in self.delays.iter().zip(self.delayed_inputs(&event.at)) {
                bank.set(register, delay.at(event.at.t) + event.delay * delay.slope(event.at.t));
            }
        }
        tape.run(&mut *bank);
        for (&state, &register) in states.iter().zip(&tape.results) {
            x[state] = bank.get(register);
        }
    }

    fn has_breaks(&self) -> bool {
        !self.ticking.is_empty() || !self.delays.is_empty()
    }

    /// Returns the values that conditions select at a point, in the mode for linearisation.
    fn selected(&self, at: &Instant<'_, S>) -> Vec<Selected<S>> {
        let (places, program) = &self.model.selections;
        let mut bank = self.bank.borrow_mut();
        self.load(&mut bank, at);
        program.run(&mut *bank);
        let values: Vec<S> = program.results.iter().map(|&register| bank.get(register)).collect();
        let selected = |((place, rates), value): (&(String, Vec<usize>), &[S])| Selected {
            place: place.clone(),
            taken: value[0],
            other: value[1],
            rates: rates.clone(),
        };
        places.iter().zip(values.chunks(2)).map(selected).collect()
    }

    fn note_sizes(&mut self, x: &[S]) {
        for (size, x) in self.sizes.iter_mut().zip(x) {
            *size = size.max(x.value().abs());
        }
    }
}

/// Loads the parameters into a bank, and computes all numbers that depend only on them.
pub(super) fn set_up<S: Scalar>(model: &Compiled, bank: &mut impl Bank<S>, parameters: impl Iterator<Item = S>) {
    for (i, value) in parameters.take(model.parameters).enumerate() {
        bank.set(model.layout.parameter(i), value);
    }
    model.setup.run(bank);
}

impl<S: Scalar, B: Bank<S>> Plant<S> for Running<'_, S, B> {
    fn start(&self) -> Vec<S> {
        self.start.clone()
    }

    fn can_start(&self, at: &Instant<'_, S>) -> Result<(), Failure> {
        self.check_start(at)
    }

    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        self.free_rates(at, dx);
        for &state in &self.fixed {
            dx[state] = S::from(0.0);
        }
    }

    fn signal(&self, signal: usize, at: &Instant<'_, S>) -> S {
        match &self.model.signals[signal] {
            Signal::State(state) => at.x[*state],
            Signal::Input(input) => at.u[*input],
            Signal::Tape(tape) => self.results::<1>(tape, at)[0],
        }
    }

    fn scale(&self, state: usize) -> Option<f64> {
        self.model.scales[state]
    }

    fn longest_step(&self) -> f64 {
        self.delays.iter().map(Delay::longest_step).fold(f64::INFINITY, f64::min)
    }

    /// Replaces a step limit by its cause, a condition that switched back and forth.
    fn explain(&self, failure: Failure) -> Failure {
        let mut jumping = self.model.switches.iter().zip(&self.flips);
        match failure {
            Failure::StepLimit(t, _) if jumping.any(|(switch, &flips)| switch.jumps && flips >= FLIPS) => {
                Failure::EventsAccumulate(t, TO_AND_FRO.to_owned())
            }
            failure => failure,
        }
    }

    fn settle(&mut self, at: &Instant<'_, S>) {
        self.settle_modes(at);
        if !std::mem::replace(&mut self.started, true) {
            self.note_sizes(at.x);
        }
    }

    fn linearise(&mut self, at: &Instant<'_, S>, at_rest: bool) -> Result<LeftOut<S>, Failure> {
        let frictionless = self.look(at, at_rest);
        Ok(LeftOut { frictionless, selected: self.selected(at), exceeded: None })
    }

    fn events(&self) -> Option<&dyn Events<S>> {
        Some(self)
    }

    fn events_mut(&mut self) -> Option<&mut dyn Events<S>> {
        Some(self)
    }

    fn breaks(&self) -> Option<&dyn Breaks<S>> {
        self.has_breaks().then_some(self as _)
    }

    fn breaks_mut(&mut self) -> Option<&mut dyn Breaks<S>> {
        self.has_breaks().then_some(self as _)
    }

    fn memory(&self) -> Option<&dyn Memory<S>> {
        (!self.delays.is_empty()).then_some(self as _)
    }

    fn memory_mut(&mut self) -> Option<&mut dyn Memory<S>> {
        (!self.delays.is_empty()).then_some(self as _)
    }

    fn jacobian(&self) -> Option<&dyn Jacobian<S>> {
        Some(self)
    }

    fn bounds(&self) -> Option<&dyn Bounds> {
        Some(self)
    }
}

impl<S: Scalar, B: Bank<S>> Events<S> for Running<'_, S, B> {
    fn guards(&self) -> usize {
        self.model.joints.len() + self.model.switches.len() + self.model.happenings.len()
    }

    fn guard(&self, index: usize, at: &Instant<'_, S>, _: InputRates<'_>) -> S {
        match self.kind(index) {
            Guard::Joint(j) if self.frictionless[j] => S::from(1.0),
            Guard::Joint(j) => {
                let joint = &self.model.joints[j];
                if self.is(joint.contact.stuck) {
                    let [torque, limit, ..] = self.results::<4>(&joint.balance, at);
                    limit - torque.abs()
                } else {
                    at.x[joint.contact.velocity] * self.modes[joint.contact.direction]
                }
            }
            Guard::Switch(k) => {
                let switch = &self.model.switches[k];
                let [difference, _] = self.results(&switch.sides, at);
                let sign = if self.is(switch.mode) { 1.0 } else { -1.0 };
                difference * sign + self.slack[k]
            }
            Guard::Happening(k) => self.happening_guard(k, at),
        }
    }

    fn guard_rate(&self, index: usize, at: &Instant<'_, S>, du: InputRates<'_>) -> Option<f64> {
        match self.kind(index) {
            Guard::Joint(_) => None,
            Guard::Switch(k) => {
                let switch = &self.model.switches[k];
                let rate = self.tape_rate(&switch.sides, 0, at, du);
                Some(if self.is(switch.mode) { rate } else { -rate })
            }
            Guard::Happening(k) => match &self.phases[k] {
                Phase::AtRest(_) => None,
                phase => {
                    let rate = self.tape_rate(&self.model.happenings[k].guard, 0, at, du);
                    Some(if *phase == Phase::Passed { -rate } else { rate })
                }
            },
        }
    }

    fn arm(&mut self, at: &Instant<'_, S>) {
        for k in 0..self.phases.len() {
            let passed = self.happening_guard(k, at).value() < 0.0;
            self.phases[k] = if passed { Phase::Passed } else { Phase::Armed(0.0) };
        }
    }

    fn switch(&mut self, index: usize, event: &EventInstant<'_, S>, x: &mut [S]) -> &str {
        self.note_sizes(x);
        self.delays
            .iter_mut()
            .for_each(|delay| delay.restart(Restart { derivative: None, moves: event.delay, jumps: true }));
        let at = event.at;
        match self.kind(index) {
            Guard::Joint(j) => {
                let joint = &self.model.joints[j];
                let [torque, limit, ..] = self.results::<4>(&joint.balance, &at).map(Scalar::value);
                if limit == 0.0 {
                    // Without friction the joint passes through rest; its direction matters once there is friction.
                    self.set_contact(j, -self.modes[joint.contact.direction]);
                    return "";
                }
                if self.is(joint.contact.stuck) {
                    self.set_contact(j, if torque > 0.0 { 1.0 } else { -1.0 });
                } else {
                    x[joint.contact.velocity] = S::from(0.0);
                    self.find_contacts(&Instant { x, ..at });
                }
                if self.is(joint.contact.stuck) { &joint.sticks } else { &joint.slides }
            }
            Guard::Switch(k) => {
                let switch = &self.model.switches[k];
                let holds = !self.is(switch.mode);
                self.set_mode(switch.mode, f64::from(u8::from(holds)));
                self.flips[k] += 1;
                let sides = self.results(&switch.sides, &at).map(Scalar::value);
                self.set_slack(k, sides);
                if switch.jumps {
                    self.find_contacts(&at);
                }
                ""
            }
            Guard::Happening(k) => self.happen(k, event, x),
        }
    }

    fn rest(&mut self, index: usize, event: &EventInstant<'_, S>, close: f64, x: &mut [S]) -> Result<&str, String> {
        match self.kind(index) {
            Guard::Happening(k) => self.come_to_rest(k, event, close, x),
            Guard::Joint(j) => Err(format!(
                "a joint with dry friction does not come to rest: {} again and again",
                self.model.joints[j].slides
            )),
            Guard::Switch(_) => Err(TO_AND_FRO.to_owned()),
        }
    }
}

impl<S: Scalar, B: Bank<S>> Breaks<S> for Running<'_, S, B> {
    fn next(&self, t: f64) -> f64 {
        let ticks = self.ticking.iter().zip(&self.model.clocks).map(|(ticking, (clock, _))| ticking.next_break(clock));
        next_of(ticks.chain(self.delays.iter().map(|delay| delay.next_break(t))))
    }

    fn pass(&mut self, at: &Instant<'_, S>, x: &mut [S]) -> S {
        let moves = pass_delays(self, |running| &mut running.delays, Self::settle_modes, at, x);
        self.tick(at, x);
        moves
    }

    fn clocks(&self) -> Vec<linear::Clock> {
        self.model.clocks.iter().map(|(clock, _)| clock.clone()).collect()
    }

    fn changes(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        for (clock, next) in &self.model.clocks {
            let mut bank = self.bank.borrow_mut();
            self.load(&mut bank, at);
            next.run(&mut *bank);
            for (state, &register) in clock.memory.clone().zip(&next.results) {
                dx[state] = bank.get(register) - at.x[state];
            }
        }
    }
}

impl<S: Scalar, B: Bank<S>> Memory<S> for Running<'_, S, B> {
    fn begin(&mut self, at: &Instant<'_, S>, _: &mut [S]) {
        // Delays of delays, and a quantity that contains its own past, need several passes.
        for _ in 0..MOST_PASSES {
            self.settle_modes(at);
            let past = self.past(at);
            let is_known = self.delays.iter().zip(&past).all(|(delay, past)| delay.before().value() == past.value());
            self.delays.iter_mut().zip(past).for_each(|(delay, past)| delay.set_before(past));
            if is_known {
                break;
            }
        }
    }

    fn remember(&mut self, over: &Past<'_, S>) -> bool {
        remember_delays(&mut self.delays, &self.tolerance, over)
    }

    fn delays(&self) -> Vec<f64> {
        self.delays.iter().map(|delay| delay.time().value()).collect()
    }

    fn past(&self, at: &Instant<'_, S>) -> Vec<S> {
        let mut bank = self.bank.borrow_mut();
        self.load(&mut bank, at);
        self.model.delayed.run(&mut *bank);
        self.model.delayed.results.iter().map(|&register| bank.get(register)).collect()
    }

    fn hold(&mut self, past: &[S]) {
        self.delays.iter_mut().zip(past).for_each(|(delay, &past)| delay.hold(past));
    }

    fn delayed(&self, t: f64) -> Vec<S> {
        self.delays.iter().map(|delay| delay.at(t)).collect()
    }
}

impl<S: Scalar, B: Bank<S>> Jacobian<S> for Running<'_, S, B> {
    fn pattern(&self) -> Vec<(usize, usize)> {
        self.model.pattern.clone()
    }

    /// Passes the entries of the Jacobian. Columns that share no row are differentiated together, several such groups
    /// per run.
    fn entries(&self, at: &Instant<'_, S>, entry: &mut dyn FnMut(usize, usize, f64)) -> bool {
        let model = self.model;
        let mut bank = self.jacobian.borrow_mut();
        let bank = bank.get_or_insert_with(|| {
            let mut bank = Large::with(model.layout.registers);
            set_up(model, &mut bank, self.parameters.iter().map(|p| Dual::from(p.value())));
            bank
        });
        let layout = &model.layout;
        for (mode, &value) in self.modes.iter().enumerate() {
            bank.set(layout.mode(mode), Dual::from(value));
        }
        for (i, input) in at.u.iter().chain(self.forces(at.w)).enumerate() {
            bank.set(layout.input(i), Dual::from(input.value()));
        }
        for (delay, register) in self.delays.iter().zip(self.delayed_inputs(at)) {
            bank.set(register, Dual::from(delay.at(at.t).value()));
        }
        bank.set(layout.time(), Dual::from(at.t));
        for groups in model.columns.chunks(DIRECTIONS) {
            for (i, x) in at.x.iter().enumerate() {
                bank.set(layout.state(i), Dual::from(x.value()));
            }
            for (direction, group) in groups.iter().enumerate() {
                for (column, _) in group {
                    bank.set(layout.state(*column), Dual::variable(at.x[*column].value(), direction));
                }
            }
            model.derivative.run(bank);
            for (direction, group) in groups.iter().enumerate() {
                for (column, rows) in group {
                    for &row in rows.iter().filter(|row| !self.fixed.contains(row)) {
                        entry(row, *column, bank.get(model.derivative.results[row]).tangent[direction]);
                    }
                }
            }
        }
        true
    }
}

impl<S: Scalar, B: Bank<S>> Bounds for Running<'_, S, B> {
    fn of_guard(&self, index: usize, over: &Span<'_>) -> Enclosure {
        self.enclose(index, over)
    }

    fn of_signal(&self, signal: usize, over: &Span<'_>) -> Enclosure {
        match &self.model.signals[signal] {
            Signal::State(state) => over.x[*state],
            Signal::Input(input) => over.u[*input],
            Signal::Tape(tape) => {
                let mut registers = self.load_bounds(over);
                tape.enclose(&mut registers);
                registers[usize::from(tape.results[0])]
            }
        }
    }
}
