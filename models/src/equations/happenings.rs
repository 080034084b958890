//! Events of a user's model: arming, resets, and rest states.

use mops_core::Instant;
use mops_core::plant::{EventInstant, InputRates};
use mops_language::{Dual, Scalar, enclosure::Enclosure};

use super::bank::{Bank, Large};
use super::bounds::{moved, signed};
use super::phase::Phase;
use super::running::{Running, set_up};
use mops_core::Plant;
use mops_core::plant::Events;

/// Permitted distance of a state from its `at-rest` value, relative to its size. A thousand times the distance that
/// remains after accumulated events (see [`crate::kernel`]), so that a wrong rest state is detected.
const NEAR: f64 = 1e-6;

/// Size of a guard after an event, relative to the largest state, that counts as 0: above the rounding of a zero
/// crossing.
const AT_ZERO: f64 = 1e-9;

impl<S: Scalar, B: Bank<S>> Running<'_, S, B> {
    /// Returns the guard of an event in its current phase: not negative while the event waits.
    pub(super) fn happening_guard(&self, k: usize, at: &Instant<'_, S>) -> S {
        let guard = |running: &Self| running.results::<1>(&running.model.happenings[k].guard, at)[0];
        match &self.phases[k] {
            Phase::Armed(threshold) => guard(self) - *threshold,
            Phase::Passed => -guard(self),
            Phase::AtRest(weights) => {
                let mut rates = at.x.to_vec();
                self.free_rates(at, &mut rates);
                weights.iter().fold(S::from(0.0), |sum, &(state, weight)| sum - rates[state] * weight)
            }
        }
    }

    /// Returns bounds of [`Running::happening_guard`], from registers that contain time, states and inputs.
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

    /// Handles an event: the event occurs, is armed again, or leaves its rest state. Returns a description.
    pub(super) fn happen(&mut self, k: usize, event: &EventInstant<'_, S>, x: &mut [S]) -> &str {
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
                self.arm(k, event, x, false);
                &happening.leaves
            }
            Phase::Armed(_) => {
                self.assign(&happening.resets, event, x);
                self.settle_modes(&Instant { x, ..event.at });
                let places = self.resets_guard(k, &Instant { x, ..event.at });
                self.arm(k, event, x, places);
                &happening.name
            }
        }
    }

    /// Arms an event if its guard is positive or increases. After a reset that reverses the guard, rounding may leave
    /// the guard negative; if nothing moves any more, the guard is 0. A guard that stays negative, as after a jump of
    /// an input, arms the event when it is positive again. A guard that the reset itself `places` at 0 happens again if
    /// it falls: the events accumulate.
    fn arm(&mut self, k: usize, event: &EventInstant<'_, S>, x: &[S], places: bool) {
        self.phases[k] = Phase::Armed(0.0);
        let at = Instant { x, ..event.at };
        let guard = self.happening_guard(k, &at).value();
        if guard <= 0.0 {
            let rounding = AT_ZERO * self.sizes.iter().fold(0.0, |largest: f64, &size| largest.max(size));
            let is_zero = guard >= -rounding;
            let rises = self
                .guard_rate(self.guard_of(k), &at, event.du)
                .is_some_and(|rate| rate > 0.0 || (rate == 0.0 && is_zero));
            self.phases[k] = match (rises, places && is_zero) {
                (true, _) => Phase::Armed(guard),
                (false, true) => Phase::Armed(0.0),
                (false, false) => Phase::Passed,
            };
        }
    }

    /// Returns true if the guard of an event depends on a state that the event resets.
    fn resets_guard(&self, k: usize, at: &Instant<'_, S>) -> bool {
        let happening = &self.model.happenings[k];
        let still = |_: usize| 0.0;
        let mut bank = self.dual_bank();
        happening.resets.0.iter().any(|&reset| {
            self.load_dual(&mut bank, at, |i| f64::from(u8::from(i == reset)), (0.0, &still));
            happening.guard.run(&mut bank);
            bank.get(happening.guard.results[0]).tangent[0] != 0.0
        })
    }

    /// Moves the states to rest after the events of a guard accumulated.
    ///
    /// # Errors
    /// The study gives no rest state, the events accumulate elsewhere, or the guard would not stay at rest there.
    pub(super) fn come_to_rest(
        &mut self,
        k: usize,
        event: &EventInstant<'_, S>,
        close: f64,
        x: &mut [S],
    ) -> Result<&str, String> {
        let model = self.model;
        let happening = &model.happenings[k];
        let name = &happening.name;
        let states = &happening.at_rest.0;
        if states.is_empty() {
            return Err(format!(
                "the events of `{name}` accumulate; give the values of the states at which they end, for example \
                 at-rest = {{ h = 0, v = 0 }}"
            ));
        }
        let before = event.at.x;
        self.assign(&happening.at_rest, event, x);
        // A state that never moved has no size: its size is its change over the interval between the events.
        let [rates, bends] = self.rates_and_bends(&event.at, event.du);
        let is_near = |&state: &usize| {
            let (x, was) = (x[state].value(), before[state].value());
            let size = NEAR * self.sizes[state].max(x.abs());
            (x - was).abs() <= size.max(close * rates[state].abs()).max(close * close * bends[state].abs())
        };
        if !states.iter().all(is_near) {
            return Err(format!("the events of `{name}` accumulate, but not at its `at-rest` values"));
        }
        let at = Instant { x, ..event.at };
        let weights = self.lift(k, &at);
        if weights.iter().all(|(_, weight)| *weight == 0.0) {
            return Err(format!("the `at-rest` states of `{name}` do not affect its guard"));
        }
        self.phases[k] = Phase::AtRest(weights);
        self.hold_states();
        self.settle_modes(&at);
        match self.happening_guard(k, &at).value() >= 0.0 {
            true => Ok(&happening.rests),
            false => {
                Err(format!("the events of `{name}` accumulate, but the states do not stay at its `at-rest` values"))
            }
        }
    }

    /// Updates the list of fixed states from the phases of all events.
    fn hold_states(&mut self) {
        self.fixed.clear();
        for (happening, phase) in self.model.happenings.iter().zip(&self.phases) {
            if matches!(phase, Phase::AtRest(_)) {
                self.fixed.extend(&happening.at_rest.0);
            }
        }
    }

    /// Returns the effect of the rate of each fixed state on the guard. The first time derivative of the guard is used
    /// if it contains these rates, else the second. The second applies, for example, if the guard is a position whose
    /// speed is fixed, too.
    fn lift(&self, k: usize, at: &Instant<'_, S>) -> Vec<(usize, f64)> {
        let model = self.model;
        let (fixed, n) = (&model.happenings[k].at_rest.0, at.x.len());
        let still = |_: usize| 0.0;
        let mut free = at.x.to_vec();
        self.free_rates(at, &mut free);
        let guard = &model.happenings[k].guard;
        let mut bank = self.dual_bank();
        let gradient: Vec<f64> = (0..n)
            .map(|state| {
                self.load_dual(&mut bank, at, |i| f64::from(u8::from(i == state)), (0.0, &still));
                guard.run(&mut bank);
                bank.get(guard.results[0]).tangent[0]
            })
            .collect();
        if fixed.iter().any(|&state| gradient[state] * free[state].value() != 0.0) {
            return fixed.iter().map(|&state| (state, gradient[state])).collect();
        }
        let mut second = |state: usize| {
            self.load_dual(&mut bank, at, |i| f64::from(u8::from(i == state)), (0.0, &still));
            model.derivative.run(&mut bank);
            let rate = |i: usize| bank.get(model.derivative.results[i]).tangent[0];
            (0..n).map(|i| if gradient[i] == 0.0 { 0.0 } else { gradient[i] * rate(i) }).sum()
        };
        fixed.iter().map(|&state| (state, second(state))).collect()
    }

    /// Returns the first and second time derivatives of all states, with no state fixed.
    fn rates_and_bends(&self, at: &Instant<'_, S>, du: InputRates<'_>) -> [Vec<f64>; 2] {
        let mut rates = at.x.to_vec();
        self.free_rates(at, &mut rates);
        let mut bank = self.dual_bank();
        self.load_dual(&mut bank, at, |i| rates[i].value(), (1.0, du));
        self.model.derivative.run(&mut bank);
        let bends = self.model.derivative.results.iter().map(|&register| bank.get(register).tangent[0]);
        [rates.iter().map(|rate| rate.value()).collect(), bends.collect()]
    }

    /// Returns the rate of a guard along the solution, from the tape of the guard.
    pub(super) fn tape_rate(
        &self,
        tape: &super::program::Program,
        result: usize,
        at: &Instant<'_, S>,
        du: InputRates<'_>,
    ) -> f64 {
        let mut slope = at.x.to_vec();
        self.rates(at, &mut slope);
        let mut bank = self.dual_bank();
        self.load_dual(&mut bank, at, |i| slope[i].value(), (1.0, du));
        tape.run(&mut bank);
        let rate: Dual<1> = bank.get(tape.results[result]);
        rate.tangent[0]
    }

    /// Creates a bank of dual numbers with one tangent, in the current modes.
    fn dual_bank(&self) -> Large<Dual<1>> {
        let mut bank = Large::with(self.model.layout.registers);
        set_up(self.model, &mut bank, self.parameters.iter().map(|p| Dual::from(p.value())));
        for (mode, &value) in self.modes.iter().enumerate() {
            bank.set(self.model.layout.mode(mode), Dual::from(value));
        }
        bank
    }

    /// Loads an instant: states with the tangents `tangent`, time with the tangent `time`, and inputs with the tangents
    /// `du`.
    fn load_dual(
        &self,
        bank: &mut Large<Dual<1>>,
        at: &Instant<'_, S>,
        tangent: impl Fn(usize) -> f64,
        (time, du): (f64, InputRates<'_>),
    ) {
        let layout = &self.model.layout;
        for (i, x) in at.x.iter().enumerate() {
            bank.set(layout.state(i), Dual { value: x.value(), tangent: [tangent(i)] });
        }
        for (i, u) in at.u.iter().enumerate() {
            bank.set(layout.input(i), Dual { value: u.value(), tangent: [du(i)] });
        }
        for (i, w) in self.forces(at.w).iter().enumerate() {
            bank.set(layout.input(at.u.len() + i), Dual::from(w.value()));
        }
        for (delay, register) in self.delays.iter().zip(self.delayed_inputs(at)) {
            bank.set(register, Dual { value: delay.at(at.t).value(), tangent: [time * delay.slope(at.t)] });
        }
        bank.set(layout.time(), Dual { value: at.t, tangent: [time] });
    }
}
