//! The events of a user's model: when they are armed, what they reset, where they come to rest.

use mops_core::enclosure::Enclosure;
use mops_core::{Dual, Scalar};

use super::bank::{Bank, Large};
use super::bounds::{moved, signed};
use super::running::{Running, set_up};
use crate::kernel::Dynamics;

/// What an event waits for.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Phase {
    /// Its guard falls below this value: 0, or where the guard was when a reset left it at or below 0 and not falling.
    Armed(f64),
    /// Its guard was passed: it is armed again where the guard is positive.
    Passed,
    /// Its events have accumulated, and states are held: it waits until their rates, weighted, would make the guard rise.
    AtRest(Vec<(usize, f64)>),
}

/// A state may be that far from where its events are said to end, relative to its size: a thousand times what accumulated
/// events leave (see [`crate::kernel`]), so that a rest state that is elsewhere is found out.
const NEAR: f64 = 1e-6;

impl<S: Scalar, X: AsRef<[S]> + AsMut<[S]> + Clone, B: Bank<S>> Running<'_, S, X, B> {
    /// The value that is not negative while an event waits.
    pub(super) fn happening_guard(&self, k: usize, t: f64, x: &X) -> S {
        let guard = |running: &Self| running.results::<1>(&running.model.happenings[k].guard, t, x.as_ref())[0];
        match &self.phases[k] {
            Phase::Armed(threshold) => guard(self) - *threshold,
            Phase::Passed => -guard(self),
            Phase::AtRest(weights) => {
                let mut rates = x.clone();
                self.free_rates(t, x.as_ref(), rates.as_mut());
                weights.iter().fold(S::from(0.0), |sum, &(state, weight)| sum - rates.as_ref()[state] * weight)
            }
        }
    }

    /// Bounds of [`Running::happening_guard`] on registers in which time, states and inputs stand.
    pub(super) fn enclose_happening(&self, k: usize, registers: &mut [Enclosure]) -> Enclosure {
        let guard = &self.model.happenings[k].guard;
        let derivative = &self.model.derivative;
        match &self.phases[k] {
            Phase::AtRest(weights) => {
                derivative.enclose(registers);
                let rate = |state: usize| registers[usize::from(derivative.results[state])];
                weights
                    .iter()
                    .fold(Enclosure::from(0.0), |sum, &(state, weight)| sum - rate(state) * Enclosure::from(weight))
            }
            phase => {
                guard.enclose(registers);
                let value = registers[usize::from(guard.results[0])];
                match phase {
                    Phase::Armed(threshold) => moved(value, -threshold),
                    _ => signed(true, value),
                }
            }
        }
    }

    /// An event happens, is armed, or leaves its rest. Returns what happened.
    pub(super) fn happen(&mut self, k: usize, t: f64, x: &mut X) -> &str {
        let model = self.model;
        let happening = &model.happenings[k];
        match self.phases[k] {
            Phase::Passed => {
                self.phases[k] = Phase::Armed(0.0);
                ""
            }
            Phase::AtRest(_) => {
                self.phases[k] = Phase::Armed(0.0);
                self.hold_states();
                self.arm(k, t, x);
                &happening.leaves
            }
            Phase::Armed(_) => {
                self.assign(&happening.resets, t, x);
                self.settle(t, x.as_ref());
                self.arm(k, t, x);
                &happening.name
            }
        }
    }

    /// Arms an event where its guard is positive, or will be: at a reset that turns the guard round, rounding may leave it
    /// negative, and it is 0 where nothing moves any more.
    fn arm(&mut self, k: usize, t: f64, x: &X) {
        self.phases[k] = Phase::Armed(0.0);
        let guard = self.happening_guard(k, t, x).value();
        if guard <= 0.0 {
            let rises = self.guard_rate(self.guard_of(k), t, x).is_some_and(|rate| rate >= 0.0);
            self.phases[k] = if rises { Phase::Armed(guard) } else { Phase::Passed };
        }
    }

    /// Its events accumulate: takes the states to where they rest, if the study gives such a place, it is the place where they
    /// accumulate, and nothing makes the guard rise there.
    pub(super) fn come_to_rest(&mut self, k: usize, t: f64, close: f64, x: &mut X) -> Result<&str, String> {
        let model = self.model;
        let happening = &model.happenings[k];
        let name = &happening.name;
        let states = &happening.at_rest.0;
        if states.is_empty() {
            return Err(format!(
                "`{name}` happens again and again; `at-rest` gives the values of the states at which that ends, as in \
                 at-rest = {{ h = 0, v = 0 }}"
            ));
        }
        let before = x.clone();
        self.assign(&happening.at_rest, t, x);
        // A state that never moved has no size: it counts as what it becomes in the interval of the events.
        let [rates, bends] = self.rates_and_bends(t, &before);
        let is_near = |&state: &usize| {
            let (x, was) = (x.as_ref()[state].value(), before.as_ref()[state].value());
            let size = NEAR * self.sizes[state].max(x.abs());
            (x - was).abs() <= size.max(close * rates[state].abs()).max(close * close * bends[state].abs())
        };
        if !states.iter().all(is_near) {
            return Err(format!("`{name}` happens again and again, but not where its `at-rest` says that it ends"));
        }
        let weights = self.lift(k, t, x);
        if weights.iter().all(|(_, weight)| *weight == 0.0) {
            return Err(format!("the states that `at-rest` of `{name}` names do not move its guard"));
        }
        self.phases[k] = Phase::AtRest(weights);
        self.hold_states();
        self.settle(t, x.as_ref());
        match self.happening_guard(k, t, x).value() >= 0.0 {
            true => Ok(&happening.rests),
            false => Err(format!("`{name}` happens again and again where nothing holds it at its `at-rest`")),
        }
    }

    /// The states that are held, from the phases of all events.
    fn hold_states(&mut self) {
        self.held.clear();
        for (happening, phase) in self.model.happenings.iter().zip(&self.phases) {
            if matches!(phase, Phase::AtRest(_)) {
                self.held.extend(&happening.at_rest.0);
            }
        }
    }

    /// How much the rate of each held state makes the guard rise: by the first derivative of the guard with respect to time
    /// if it contains these rates, else by the second, as where the guard is a position and its speed is held too.
    fn lift(&self, k: usize, t: f64, x: &X) -> Vec<(usize, f64)> {
        let model = self.model;
        let (held, n) = (&model.happenings[k].at_rest.0, x.as_ref().len());
        let mut free = x.clone();
        self.free_rates(t, x.as_ref(), free.as_mut());
        let guard = &model.happenings[k].guard;
        let mut bank = self.dual_bank();
        let gradient: Vec<f64> = (0..n)
            .map(|state| {
                self.load_dual(&mut bank, t, x.as_ref(), |i| f64::from(u8::from(i == state)), 0.0);
                guard.run(&mut bank);
                bank.get(guard.results[0]).tangent[0]
            })
            .collect();
        if held.iter().any(|&state| gradient[state] * free.as_ref()[state].value() != 0.0) {
            return held.iter().map(|&state| (state, gradient[state])).collect();
        }
        let mut second = |state: usize| {
            self.load_dual(&mut bank, t, x.as_ref(), |i| f64::from(u8::from(i == state)), 0.0);
            model.derivative.run(&mut bank);
            let rate = |i: usize| bank.get(model.derivative.results[i]).tangent[0];
            (0..n).map(|i| if gradient[i] == 0.0 { 0.0 } else { gradient[i] * rate(i) }).sum()
        };
        held.iter().map(|&state| (state, second(state))).collect()
    }

    /// First and second derivatives of all states with respect to time, none of them held.
    fn rates_and_bends(&self, t: f64, x: &X) -> [Vec<f64>; 2] {
        let mut rates = x.clone();
        self.free_rates(t, x.as_ref(), rates.as_mut());
        let mut bank = self.dual_bank();
        self.load_dual(&mut bank, t, x.as_ref(), |i| rates.as_ref()[i].value(), 1.0);
        self.model.derivative.run(&mut bank);
        let bends = self.model.derivative.results.iter().map(|&register| bank.get(register).tangent[0]);
        [rates.as_ref().iter().map(|rate| rate.value()).collect(), bends.collect()]
    }

    /// The rate of a guard's tape along the solution.
    pub(super) fn tape_rate(&self, tape: &super::program::Program, result: usize, t: f64, x: &X) -> f64 {
        let mut slope = x.clone();
        self.derivative(t, x, &mut slope);
        let mut bank = self.dual_bank();
        self.load_dual(&mut bank, t, x.as_ref(), |i| slope.as_ref()[i].value(), 1.0);
        tape.run(&mut bank);
        let rate: Dual<1> = bank.get(tape.results[result]);
        rate.tangent[0]
    }

    /// A bank of numbers with one tangent, in the present modes.
    fn dual_bank(&self) -> Large<Dual<1>> {
        let mut bank = Large::with(self.model.layout.registers);
        set_up(self.model, &mut bank, self.parameters.iter().map(|p| Dual::from(p.value())));
        for (mode, &value) in self.modes.iter().enumerate() {
            bank.set(self.model.layout.mode(mode), Dual::from(value));
        }
        bank
    }

    /// States with these tangents; time, and inputs as it passes, with the tangent `time`.
    fn load_dual(&self, bank: &mut Large<Dual<1>>, t: f64, x: &[S], tangent: impl Fn(usize) -> f64, time: f64) {
        let layout = &self.model.layout;
        for (i, x) in x.iter().enumerate() {
            bank.set(layout.state(i), Dual { value: x.value(), tangent: [tangent(i)] });
        }
        for (i, drive) in self.drives.iter().enumerate() {
            bank.set(layout.input(i), Dual { value: drive.at(t).value(), tangent: [time * drive.slope(t)] });
        }
        bank.set(layout.time(), Dual { value: t, tangent: [time] });
    }
}
