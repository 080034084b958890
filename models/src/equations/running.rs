//! A compiled model in a simulation: the present values, modes and inputs.

use std::cell::RefCell;
use std::marker::PhantomData;

use mops_core::enclosure::Enclosure;
use mops_core::expression::Comparison;
use mops_core::{Dual, Failure, Instant, Scalar};

use super::bank::{Bank, Large};
use super::bounds::{self, moved, signed};
use super::compiled::{Compiled, Signal};
use super::happenings::Phase;
use super::program::Program;
use crate::kernel::drive::Drive;
use crate::kernel::{Dynamics, Tolerance};

/// The dynamics of a compiled model; `X` is the state vector, `B` the registers.
pub struct Running<'a, S, X, B> {
    pub(super) model: &'a Compiled,
    pub(super) bank: RefCell<B>,
    pub(super) drives: Vec<Drive<'a, S>>,
    pub(super) parameters: &'a [S],
    pub(super) tolerance: Tolerance,
    started: bool,
    /// Present values of the modes.
    pub(super) modes: Vec<f64>,
    /// What is added to the guard of a switch: a kink is only left when it is clear that it is.
    pub(super) slack: Vec<f64>,
    /// The largest size of the sides of each switch where it was looked at.
    pub(super) spans: Vec<f64>,
    /// How often each switch has switched.
    flips: Vec<usize>,
    /// What each event waits for.
    pub(super) phases: Vec<Phase>,
    /// By how much the event of the moment comes later: tangents without a value.
    delay: S,
    /// States that are held where events have come to rest.
    pub(super) held: Vec<usize>,
    /// Largest absolute values of the states where the simulation begins and at events.
    pub(super) sizes: Vec<f64>,
    /// Registers with bounds, from their first use on.
    bounds: RefCell<Vec<Enclosure>>,
    /// Registers in which the Jacobian is computed, from its first use on.
    jacobian: RefCell<Option<Large<Dual<CHUNK>>>>,
    state: PhantomData<X>,
}

/// Columns of the Jacobian that are computed at once.
const CHUNK: usize = 8;

/// A condition that has switched that often is blamed where a simulation runs out of steps: a thousandth of those there are.
const FLIPS: usize = 100;

/// What is said of conditions that never agree with themselves.
const TO_AND_FRO: &str =
    "a condition of `sign` or `if` switches to and fro without end; dry friction is written under `friction`";

/// What a mode's guard is about.
enum Guard {
    Joint(usize),
    Switch(usize),
    Happening(usize),
}

impl<'a, S: Scalar, X: AsRef<[S]> + AsMut<[S]> + Clone, B: Bank<S>> Running<'a, S, X, B> {
    /// A simulation with these parameters, the start values among them left aside.
    pub fn new(model: &'a Compiled, drives: Vec<Drive<'a, S>>, parameters: &'a [S], tolerance: Tolerance) -> Self {
        let mut bank = B::with(model.layout.registers);
        set_up(model, &mut bank, parameters.iter().copied());
        Self {
            model,
            bank: RefCell::new(bank),
            drives,
            jacobian: RefCell::new(None),
            parameters,
            tolerance,
            started: false,
            modes: vec![0.0; model.switches.len() + 2 * model.joints.len()],
            slack: vec![0.0; model.switches.len()],
            spans: vec![0.0; model.switches.len()],
            flips: vec![0; model.switches.len()],
            phases: vec![Phase::Armed(0.0); model.happenings.len()],
            delay: S::from(0.0),
            held: Vec::new(),
            sizes: vec![0.0; model.states],
            bounds: RefCell::new(Vec::new()),
            state: PhantomData,
        }
    }

    /// Start values that are expressions: state and value.
    pub fn starts(&self) -> Vec<(usize, S)> {
        let mut bank = self.bank.borrow_mut();
        let (states, tape) = &self.model.starts;
        tape.run(&mut *bank);
        states.iter().zip(&tape.results).map(|(&state, &register)| (state, bank.get(register))).collect()
    }

    #[inline(always)]
    pub(super) fn load(&self, bank: &mut B, t: f64, x: &[S]) {
        let layout = &self.model.layout;
        for (i, &x) in x.iter().enumerate() {
            bank.set(layout.state(i), x);
        }
        for (i, drive) in self.drives.iter().enumerate() {
            bank.set(layout.input(i), drive.at(t));
        }
        bank.set(layout.time(), S::from(t));
    }

    /// Results of a tape at a time and a state.
    pub(super) fn results<const N: usize>(&self, tape: &Program, t: f64, x: &[S]) -> [S; N] {
        let mut bank = self.bank.borrow_mut();
        self.load(&mut bank, t, x);
        tape.run(&mut *bank);
        std::array::from_fn(|k| bank.get(tape.results[k]))
    }

    /// The derivative with inputs and forces from outside.
    pub(super) fn open_rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        let mut bank = self.bank.borrow_mut();
        let bank = &mut *bank;
        let layout = &self.model.layout;
        for (i, &x) in at.x.iter().enumerate() {
            bank.set(layout.state(i), x);
        }
        for (i, &value) in at.u.iter().chain(at.w).enumerate() {
            // A drive that is held adds a slope of 0, which makes a negative zero positive.
            bank.set(layout.input(i), value + 0.0);
        }
        bank.set(layout.time(), S::from(at.t));
        let tape = &self.model.derivative;
        tape.run(bank);
        for (dx, &register) in dx.iter_mut().zip(&tape.results) {
            *dx = bank.get(register);
        }
        for &state in &self.held {
            dx[state] = S::from(0.0);
        }
    }

    /// Holds the inputs at these values.
    pub fn hold_drives(&mut self, values: impl Iterator<Item = S>) {
        for (drive, value) in self.drives.iter_mut().zip(values) {
            *drive = Drive::held(value);
        }
    }

    /// The value of a signal.
    pub fn signal(&self, signal: usize, t: f64, x: &[S]) -> S {
        match &self.model.signals[signal] {
            Signal::State(state) => x[*state],
            Signal::Input(input) => self.drives[*input].at(t),
            Signal::Tape(tape) => self.results::<1>(tape, t, x)[0],
        }
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

    /// Bounds of a guard over a time, with bounds of the states and of the inputs.
    pub(super) fn enclose(
        &self,
        index: usize,
        time: Enclosure,
        x: &[Enclosure],
        inputs: impl Iterator<Item = Enclosure>,
    ) -> Enclosure {
        let layout = &self.model.layout;
        let mut registers = self.bounds.borrow_mut();
        if registers.is_empty() {
            *registers = bounds::registers(&*self.bank.borrow(), layout.registers);
        }
        for (mode, &value) in self.modes.iter().enumerate() {
            registers[usize::from(layout.mode(mode))] = Enclosure::from(value);
        }
        registers[usize::from(layout.state(0))..][..x.len()].copy_from_slice(x);
        for (i, input) in inputs.enumerate() {
            registers[usize::from(layout.input(i))] = input;
        }
        registers[usize::from(layout.time())] = time;
        match self.kind(index) {
            Guard::Joint(j) => {
                let joint = &self.model.joints[j];
                if self.is(joint.contact.stuck) {
                    joint.balance.enclose(&mut registers);
                    let [torque, limit] = [0, 1].map(|k| registers[usize::from(joint.balance.results[k])]);
                    let zero = Enclosure::from(0.0);
                    limit - torque.holds(Comparison::AtLeast, zero).choose(torque, -torque)
                } else {
                    x[joint.contact.velocity] * Enclosure::from(self.modes[joint.contact.direction])
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

    /// The guard of an event.
    pub(super) fn guard_of(&self, happening: usize) -> usize {
        self.model.joints.len() + self.model.switches.len() + happening
    }

    /// The derivatives, of states that are held too.
    pub(super) fn free_rates(&self, t: f64, x: &[S], dx: &mut [S]) {
        let mut bank = self.bank.borrow_mut();
        let bank = &mut *bank;
        self.load(bank, t, x);
        self.model.derivative.run(bank);
        for (dx, &register) in dx.iter_mut().zip(&self.model.derivative.results) {
            *dx = bank.get(register);
        }
    }

    /// Gives states new values, computed from those they have.
    pub(super) fn assign(&self, (states, tape): &(Vec<usize>, Program), t: f64, x: &mut X) {
        let mut bank = self.bank.borrow_mut();
        self.load(&mut bank, t, x.as_ref());
        if S::DIRECTIONS > 0 {
            let layout = &self.model.layout;
            for (i, drive) in self.drives.iter().enumerate() {
                bank.set(layout.input(i), drive.at(t) + self.delay * drive.slope(t));
            }
            bank.set(layout.time(), self.delay + t);
        }
        tape.run(&mut *bank);
        for (&state, &register) in states.iter().zip(&tape.results) {
            x.as_mut()[state] = bank.get(register);
        }
    }

    fn note_sizes(&mut self, x: &[S]) {
        for (size, x) in self.sizes.iter_mut().zip(x) {
            *size = size.max(x.value().abs());
        }
    }

    /// What went wrong where a simulation got nowhere: a condition that switched to and fro.
    pub fn explain(&self, failure: Failure) -> Failure {
        let mut jumping = self.model.switches.iter().zip(&self.flips);
        match failure {
            Failure::StepLimit(t) if jumping.any(|(switch, &flips)| switch.jumps && flips >= FLIPS) => {
                Failure::EventsAccumulate(t, TO_AND_FRO.to_owned())
            }
            failure => failure,
        }
    }
}

/// Writes the parameters into a bank, and all that follows from them alone.
pub(super) fn set_up<S: Scalar>(model: &Compiled, bank: &mut impl Bank<S>, parameters: impl Iterator<Item = S>) {
    for (i, value) in parameters.take(model.parameters).enumerate() {
        bank.set(model.layout.parameter(i), value);
    }
    model.setup.run(bank);
}

impl<S: Scalar, X: AsRef<[S]> + AsMut<[S]> + Clone, B: Bank<S>> Dynamics<S> for Running<'_, S, X, B> {
    type State = X;

    #[inline(always)]
    fn derivative(&self, t: f64, x: &X, dx: &mut X) {
        self.free_rates(t, x.as_ref(), dx.as_mut());
        for &state in &self.held {
            dx.as_mut()[state] = S::from(0.0);
        }
    }

    fn guards(&self) -> usize {
        self.model.joints.len() + self.model.switches.len() + self.model.happenings.len()
    }

    fn guard(&self, index: usize, t: f64, x: &X) -> S {
        match self.kind(index) {
            Guard::Joint(j) => {
                let joint = &self.model.joints[j];
                if self.is(joint.contact.stuck) {
                    let [torque, limit, ..] = self.results::<4>(&joint.balance, t, x.as_ref());
                    limit - torque.abs()
                } else {
                    x.as_ref()[joint.contact.velocity] * self.modes[joint.contact.direction]
                }
            }
            Guard::Switch(k) => {
                let switch = &self.model.switches[k];
                let [difference, _] = self.results(&switch.sides, t, x.as_ref());
                let sign = if self.is(switch.mode) { 1.0 } else { -1.0 };
                difference * sign + self.slack[k]
            }
            Guard::Happening(k) => self.happening_guard(k, t, x),
        }
    }

    fn guard_rate(&self, index: usize, t: f64, x: &X) -> Option<f64> {
        match self.kind(index) {
            Guard::Joint(_) => None,
            Guard::Switch(k) => {
                let switch = &self.model.switches[k];
                let rate = self.tape_rate(&switch.sides, 0, t, x);
                Some(if self.is(switch.mode) { rate } else { -rate })
            }
            Guard::Happening(k) => match &self.phases[k] {
                Phase::AtRest(_) => None,
                phase => {
                    let rate = self.tape_rate(&self.model.happenings[k].guard, 0, t, x);
                    Some(if *phase == Phase::Passed { -rate } else { rate })
                }
            },
        }
    }

    fn has_bounds(&self) -> bool {
        true
    }

    fn enclose_guard(&self, index: usize, time: Enclosure, x: &[Enclosure]) -> Enclosure {
        self.enclose(index, time, x, self.drives.iter().map(|drive| drive.enclose(time)))
    }

    fn rest(&mut self, index: usize, t: f64, close: f64, x: &mut X) -> Result<&str, String> {
        match self.kind(index) {
            Guard::Happening(k) => self.come_to_rest(k, t, close, x),
            Guard::Joint(j) => Err(format!(
                "a joint with dry friction does not settle: {}, again and again",
                self.model.joints[j].slides
            )),
            Guard::Switch(_) => Err(TO_AND_FRO.to_owned()),
        }
    }

    fn scale(&self, state: usize) -> Option<f64> {
        self.model.scales[state]
    }

    fn switch(&mut self, index: usize, t: f64, x: &mut X) -> &str {
        self.note_sizes(x.as_ref());
        match self.kind(index) {
            Guard::Joint(j) => {
                let joint = &self.model.joints[j];
                let [torque, limit, ..] = self.results::<4>(&joint.balance, t, x.as_ref()).map(Scalar::value);
                if limit == 0.0 {
                    // Without friction the joint passes through its rest; which way it moves counts where friction comes.
                    self.set_contact(j, -self.modes[joint.contact.direction]);
                    return "";
                }
                if self.is(joint.contact.stuck) {
                    self.set_contact(j, if torque > 0.0 { 1.0 } else { -1.0 });
                } else {
                    x.as_mut()[joint.contact.velocity] = S::from(0.0);
                    self.find_contacts(t, x.as_ref());
                }
                if self.is(joint.contact.stuck) { &joint.sticks } else { &joint.slides }
            }
            Guard::Switch(k) => {
                let switch = &self.model.switches[k];
                let holds = !self.is(switch.mode);
                self.set_mode(switch.mode, f64::from(u8::from(holds)));
                self.flips[k] += 1;
                let sides = self.results(&switch.sides, t, x.as_ref()).map(Scalar::value);
                self.set_slack(k, sides);
                if switch.jumps {
                    self.find_contacts(t, x.as_ref());
                }
                ""
            }
            Guard::Happening(k) => self.happen(k, t, x),
        }
    }

    fn delay_events(&mut self, delay: S) {
        self.delay = delay;
    }

    fn shows(&self, signal: usize) -> Option<usize> {
        match &self.model.signals[signal] {
            Signal::State(state) => Some(*state),
            _ => None,
        }
    }

    fn jacobian_pattern(&self) -> Option<Vec<(usize, usize)>> {
        Some(self.model.pattern.clone())
    }

    /// Columns that share no row are differentiated together, eight such groups in one run of the tape.
    fn jacobian(&self, t: f64, x: &X, entry: &mut dyn FnMut(usize, usize, f64)) -> bool {
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
        for (i, drive) in self.drives.iter().enumerate() {
            bank.set(layout.input(i), Dual::from(drive.at(t).value()));
        }
        bank.set(layout.time(), Dual::from(t));
        for groups in model.columns.chunks(CHUNK) {
            for (i, x) in x.as_ref().iter().enumerate() {
                bank.set(layout.state(i), Dual::from(x.value()));
            }
            for (direction, group) in groups.iter().enumerate() {
                for (column, _) in group {
                    bank.set(layout.state(*column), Dual::variable(x.as_ref()[*column].value(), direction));
                }
            }
            model.derivative.run(bank);
            for (direction, group) in groups.iter().enumerate() {
                for (column, rows) in group {
                    for &row in rows.iter().filter(|row| !self.held.contains(row)) {
                        entry(row, *column, bank.get(model.derivative.results[row]).tangent[direction]);
                    }
                }
            }
        }
        true
    }

    fn next_break(&self, t: f64) -> f64 {
        self.drives.iter().map(|drive| drive.next_break(t)).fold(f64::INFINITY, f64::min)
    }

    fn longest_step(&self) -> f64 {
        self.drives.iter().map(Drive::longest_step).fold(f64::INFINITY, f64::min)
    }

    fn pass_break(&mut self, t: f64, x: &mut X) {
        for drive in &mut self.drives {
            drive.pass_break(t);
        }
        self.settle(t, x.as_ref());
        if !std::mem::replace(&mut self.started, true) {
            self.note_sizes(x.as_ref());
            for k in 0..self.phases.len() {
                let passed = self.happening_guard(k, t, x).value() < 0.0;
                self.phases[k] = if passed { Phase::Passed } else { Phase::Armed(0.0) };
            }
        }
    }
}
