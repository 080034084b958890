//! A compiled model in a simulation: the present values, modes and inputs.

use std::cell::RefCell;
use std::marker::PhantomData;

use mops_core::{Case, Dual, Failure, Scalar};

use super::compiled::{Compiled, Signal};
use super::program::{Bank, Large, Program, Small};
use crate::kernel::drive::Drive;
use crate::kernel::{Dynamics, Tolerance};

/// The dynamics of a compiled model; `X` is the state vector, `B` the registers.
pub struct Running<'a, S, X, B> {
    model: &'a Compiled,
    bank: RefCell<B>,
    drives: Vec<Drive<'a>>,
    parameters: &'a [S],
    tolerance: Tolerance,
    started: bool,
    /// Present values of the modes.
    modes: Vec<f64>,
    /// What is added to the guard of a switch: a kink is only left when it is clear that it is.
    slack: Vec<f64>,
    /// How often each switch has switched.
    flips: Vec<usize>,
    /// Whether an event waits for its guard to become negative, rather than positive again, and where the guard began.
    armed: Vec<(bool, f64)>,
    state: PhantomData<X>,
}

/// What a mode's guard is about.
enum Guard {
    Joint(usize),
    Switch(usize),
    Happening(usize),
}

impl<'a, S: Scalar, X: AsRef<[S]> + AsMut<[S]> + Clone, B: Bank<S>> Running<'a, S, X, B> {
    /// A simulation with these parameters, the start values among them left aside.
    pub fn new(
        model: &'a Compiled,
        inputs: &[&str],
        case: &'a Case,
        parameters: &'a [S],
        tolerance: Tolerance,
    ) -> Self {
        let mut bank = B::with(model.layout.registers);
        set_up(model, &mut bank, parameters.iter().copied());
        Self {
            model,
            bank: RefCell::new(bank),
            drives: inputs.iter().map(|name| Drive::new(case.input(name))).collect(),
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
    fn load(&self, bank: &mut B, t: f64, x: &[S]) {
        let layout = &self.model.layout;
        for (i, &x) in x.iter().enumerate() {
            bank.set(layout.state(i), x);
        }
        for (i, drive) in self.drives.iter().enumerate() {
            bank.set(layout.input(i), S::from(drive.at(t)));
        }
        bank.set(layout.time(), S::from(t));
    }

    /// Results of a tape at a time and a state.
    fn results<const N: usize>(&self, tape: &Program, t: f64, x: &[S]) -> [S; N] {
        let mut bank = self.bank.borrow_mut();
        self.load(&mut bank, t, x);
        tape.run(&mut *bank);
        std::array::from_fn(|k| bank.get(tape.results[k]))
    }

    /// The value of a signal.
    pub fn signal(&self, signal: usize, t: f64, x: &[S]) -> S {
        match &self.model.signals[signal] {
            Signal::State(state) => x[*state],
            Signal::Input(input) => S::from(self.drives[*input].at(t)),
            Signal::Tape(tape) => self.results::<1>(tape, t, x)[0],
        }
    }

    fn set_mode(&mut self, mode: usize, value: f64) {
        self.modes[mode] = value;
        self.bank.borrow_mut().set(self.model.layout.mode(mode), S::from(value));
    }

    fn is(&self, mode: usize) -> bool {
        self.modes[mode] > 0.0
    }

    /// Puts every condition and contact into the mode that fits this moment.
    fn settle(&mut self, t: f64, x: &[S]) {
        for k in 0..self.model.switches.len() {
            let switch = &self.model.switches[k];
            let [difference, right] = self.results(&switch.sides, t, x).map(Scalar::value);
            let holds = difference > 0.0 || difference == 0.0 && !switch.strict;
            self.set_mode(switch.mode, f64::from(u8::from(holds)));
            self.set_slack(k, 0.0, right);
        }
        self.find_contacts(t, x);
    }

    /// A kink is left behind it by a tenth of the tolerance, so that nothing comes and goes at it; a jump exactly, or
    /// from where rounding left it.
    fn set_slack(&mut self, k: usize, guard: f64, right: f64) {
        self.slack[k] = if self.model.switches[k].jumps {
            (-guard).max(0.0)
        } else {
            0.1 * (self.tolerance.absolute + self.tolerance.relative * right.abs())
        };
    }

    /// Joints that move slide the way they move. Of those at rest each is stuck if the torque it takes is within its
    /// limit, else it slides the way it accelerates: the choice in which all agree, as in [`crate::kernel::friction`].
    fn find_contacts(&mut self, t: f64, x: &[S]) {
        let model = self.model;
        let mut resting = Vec::new();
        for (j, joint) in model.joints.iter().enumerate() {
            let speed = x[joint.contact.velocity].value();
            let [_, limit, ..] = self.results::<4>(&joint.balance, t, x).map(Scalar::value);
            if speed == 0.0 && limit > 0.0 {
                resting.push(j);
            }
            self.set_contact(j, if speed >= 0.0 { 1.0 } else { -1.0 });
        }
        let mut best = (f64::INFINITY, 0);
        let choices = 3_usize.pow(u32::try_from(resting.len()).expect("few joints"));
        for code in 0..choices {
            self.choose_contacts(&resting, code);
            let discord = resting.iter().map(|&j| {
                let joint = &model.joints[j];
                let [torque, limit, coulomb, acceleration] = self.results(&joint.balance, t, x).map(Scalar::value);
                let direction = self.modes[joint.contact.direction];
                if direction == 0.0 {
                    torque.abs() / limit - 1.0
                } else {
                    // Rounding leaves an acceleration of about 0 with either sign.
                    -direction * acceleration / (acceleration.abs() + coulomb.abs() + f64::MIN_POSITIVE)
                }
            });
            let discord = discord.fold(f64::NEG_INFINITY, f64::max).max(0.0);
            if discord < best.0 {
                best = (discord, code);
            }
            if discord == 0.0 {
                break;
            }
        }
        self.choose_contacts(&resting, best.1);
    }

    fn choose_contacts(&mut self, resting: &[usize], mut code: usize) {
        for &j in resting {
            self.set_contact(j, [0.0, 1.0, -1.0][code % 3]);
            code /= 3;
        }
    }

    fn set_contact(&mut self, joint: usize, direction: f64) {
        let contact = self.model.joints[joint].contact;
        self.set_mode(contact.direction, direction);
        self.set_mode(contact.stuck, f64::from(u8::from(direction == 0.0)));
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
            bank.set(layout.input(i), Dual { value: drive.at(t), tangent: [(drive.at(t + 1e-6) - drive.at(t)) * 1e6] });
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

    /// Whether equations that are solved together have a solution here.
    pub fn check_start(&self, x: &X) -> Result<(), Failure> {
        let mut slope = x.clone();
        self.derivative(0.0, x, &mut slope);
        if slope.as_ref().iter().all(|d| d.value().is_finite()) {
            return Ok(());
        }
        let mut bank = self.bank.borrow_mut();
        for tape in &self.model.matrices {
            self.load(&mut bank, 0.0, x.as_ref());
            tape.run(&mut *bank);
            let entries: Vec<f64> = tape.results.iter().map(|&r| bank.get(r).value()).collect();
            if determinant(entries) == 0.0 {
                return Err(Failure::Undefined("the mass matrix is singular at the start".to_owned()));
            }
        }
        Ok(())
    }
}

/// Writes the parameters into a bank, and all that follows from them alone.
fn set_up<S: Scalar>(model: &Compiled, bank: &mut impl Bank<S>, parameters: impl Iterator<Item = S>) {
    for (i, value) in parameters.take(model.parameters).enumerate() {
        bank.set(model.layout.parameter(i), value);
    }
    model.setup.run(bank);
}

/// Determinant of a square matrix, row by row.
fn determinant(mut m: Vec<f64>) -> f64 {
    let n = m.len().isqrt();
    let mut product = 1.0;
    for k in 0..n {
        let pivot = (k..n).fold(k, |best, i| if m[i * n + k].abs() > m[best * n + k].abs() { i } else { best });
        product *= m[pivot * n + k];
        if product == 0.0 {
            return 0.0;
        }
        for j in 0..n {
            m.swap(k * n + j, pivot * n + j);
        }
        for i in k + 1..n {
            let factor = m[i * n + k] / m[k * n + k];
            for j in k..n {
                m[i * n + j] -= factor * m[k * n + j];
            }
        }
    }
    product
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

    fn switch(&mut self, index: usize, t: f64, x: &mut X) -> &'static str {
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
                if self.is(joint.contact.stuck) { joint.sticks } else { joint.slides }
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
                happening.name
            }
        }
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

/// Registers of models that fit into few.
pub type Few<S> = Small<S>;
/// Registers of all others.
pub type Many<S> = Large<S>;
