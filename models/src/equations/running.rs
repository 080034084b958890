//! A compiled model in a simulation: the present values, modes and inputs.

use std::cell::RefCell;
use std::marker::PhantomData;

use mops_core::{Dual, Failure, Instant, Scalar};

use super::bank::{Bank, Large};
use super::compiled::{Compiled, Signal};
use super::program::Program;
use crate::kernel::drive::Drive;
use crate::kernel::{Dynamics, Tolerance};

/// The dynamics of a compiled model; `X` is the state vector, `B` the registers.
pub struct Running<'a, S, X, B> {
    pub(super) model: &'a Compiled,
    pub(super) bank: RefCell<B>,
    drives: Vec<Drive<'a, S>>,
    parameters: &'a [S],
    pub(super) tolerance: Tolerance,
    started: bool,
    /// Present values of the modes.
    pub(super) modes: Vec<f64>,
    /// What is added to the guard of a switch: a kink is only left when it is clear that it is.
    pub(super) slack: Vec<f64>,
    /// How often each switch has switched.
    flips: Vec<usize>,
    /// Whether an event waits for its guard to become negative, rather than positive again, and where the guard began.
    armed: Vec<(bool, f64)>,
    /// Registers in which the Jacobian is computed, from its first use on.
    jacobian: RefCell<Option<Large<Dual<CHUNK>>>>,
    state: PhantomData<X>,
}

/// Columns of the Jacobian that are computed at once.
const CHUNK: usize = 8;

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
            flips: vec![0; model.switches.len()],
            armed: vec![(true, 0.0); model.happenings.len()],
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

    /// Whether the guard of an event rises along the solution, by its exact derivative with respect to time.
    fn rises(&self, happening: usize, t: f64, x: &X) -> bool {
        let mut slope = x.clone();
        self.derivative(t, x, &mut slope);
        let mut bank = Large::<Dual<1>>::with(self.model.layout.registers);
        set_up(self.model, &mut bank, self.parameters.iter().map(|p| Dual::from(p.value())));
        let layout = &self.model.layout;
        for (mode, &value) in self.modes.iter().enumerate() {
            bank.set(layout.mode(mode), Dual::from(value));
        }
        for (i, (x, slope)) in x.as_ref().iter().zip(slope.as_ref()).enumerate() {
            bank.set(layout.state(i), Dual { value: x.value(), tangent: [slope.value()] });
        }
        for (i, drive) in self.drives.iter().enumerate() {
            let [now, soon] = [drive.at(t), drive.at(t + 1e-6)].map(Scalar::value);
            bank.set(layout.input(i), Dual { value: now, tangent: [(soon - now) * 1e6] });
        }
        bank.set(layout.time(), Dual::variable(t, 0));
        let tape = &self.model.happenings[happening].guard;
        tape.run(&mut bank);
        let guard: Dual<1> = bank.get(tape.results[0]);
        guard.tangent[0] > 0.0
    }

    fn happening_guard(&self, k: usize, t: f64, x: &[S]) -> S {
        self.results::<1>(&self.model.happenings[k].guard, t, x)[0]
    }

    /// What went wrong where a simulation got nowhere: a condition that switched to and fro.
    pub fn explain(&self, failure: Failure) -> Failure {
        let stalls = matches!(failure, Failure::StepLimit(_) | Failure::StepTooSmall(_));
        let jumping = self.model.switches.iter().zip(&self.flips);
        if stalls && jumping.into_iter().any(|(switch, &flips)| switch.jumps && flips >= 90) {
            return Failure::Undefined(format!(
                "{failure}: `sign` or `if` switches to and fro without end; dry friction is written under `friction`"
            ));
        }
        failure
    }
}

/// Writes the parameters into a bank, and all that follows from them alone.
fn set_up<S: Scalar>(model: &Compiled, bank: &mut impl Bank<S>, parameters: impl Iterator<Item = S>) {
    for (i, value) in parameters.take(model.parameters).enumerate() {
        bank.set(model.layout.parameter(i), value);
    }
    model.setup.run(bank);
}

impl<S: Scalar, X: AsRef<[S]> + AsMut<[S]> + Clone, B: Bank<S>> Dynamics<S> for Running<'_, S, X, B> {
    type State = X;

    #[inline(always)]
    fn derivative(&self, t: f64, x: &X, dx: &mut X) {
        let mut bank = self.bank.borrow_mut();
        let bank = &mut *bank;
        self.load(bank, t, x.as_ref());
        let tape = &self.model.derivative;
        tape.run(bank);
        for (dx, &register) in dx.as_mut().iter_mut().zip(&tape.results) {
            *dx = bank.get(register);
        }
    }

    fn guards(&self) -> usize {
        self.model.joints.len() + self.model.switches.len() + self.model.happenings.len()
    }

    fn guard(&self, index: usize, t: f64, x: &X) -> S {
        let x = x.as_ref();
        match self.kind(index) {
            Guard::Joint(j) => {
                let joint = &self.model.joints[j];
                if self.is(joint.contact.stuck) {
                    let [torque, limit, ..] = self.results::<4>(&joint.balance, t, x);
                    limit - torque.abs()
                } else {
                    x[joint.contact.velocity] * self.modes[joint.contact.direction]
                }
            }
            Guard::Switch(k) => {
                let switch = &self.model.switches[k];
                let [difference, _] = self.results(&switch.sides, t, x);
                let sign = if self.is(switch.mode) { 1.0 } else { -1.0 };
                difference * sign + self.slack[k]
            }
            Guard::Happening(k) => {
                let (armed, began) = self.armed[k];
                let guard = self.happening_guard(k, t, x);
                if armed { guard - began } else { -guard }
            }
        }
    }

    fn switch(&mut self, index: usize, t: f64, x: &mut X) -> &str {
        match self.kind(index) {
            Guard::Joint(j) => {
                let joint = &self.model.joints[j];
                if self.is(joint.contact.stuck) {
                    let [torque, ..] = self.results::<4>(&joint.balance, t, x.as_ref());
                    self.set_contact(j, if torque.value() > 0.0 { 1.0 } else { -1.0 });
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
                let [difference, right] = self.results(&switch.sides, t, x.as_ref()).map(Scalar::value);
                self.set_slack(k, if holds { difference } else { -difference }, right);
                if switch.jumps {
                    self.find_contacts(t, x.as_ref());
                }
                ""
            }
            Guard::Happening(k) => {
                let happening = &self.model.happenings[k];
                if !self.armed[k].0 {
                    self.armed[k] = (true, self.happening_guard(k, t, x.as_ref()).value().min(0.0));
                    return "";
                }
                let (states, tape) = &happening.resets;
                let mut bank = self.bank.borrow_mut();
                self.load(&mut bank, t, x.as_ref());
                tape.run(&mut *bank);
                for (&state, &register) in states.iter().zip(&tape.results) {
                    x.as_mut()[state] = bank.get(register);
                }
                drop(bank);
                self.settle(t, x.as_ref());
                let guard = self.happening_guard(k, t, x.as_ref()).value();
                self.armed[k] = (guard > 0.0 || self.rises(k, t, x), guard.min(0.0));
                &happening.name
            }
        }
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
                    for &row in rows {
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
            for k in 0..self.armed.len() {
                self.armed[k] = (self.happening_guard(k, t, x.as_ref()).value() >= 0.0, 0.0);
            }
        }
    }
}
