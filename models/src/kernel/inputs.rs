//! Inputs of a plant and forces on it, along a simulation.

use std::cell::{RefCell, RefMut};

use mops_core::{
    Instant,
    plant::{InputRates, Span},
};
use mops_language::{Scalar, enclosure::Enclosure};

use super::drive::Drive;
use super::{is_due, next_of};

/// Inputs of a plant, some with a dead time, and forces from outside.
///
/// Times are those of the simulation, from 0 on; the plant sees those of the record, which begins earlier by `begins`.
#[derive(Clone)]
pub struct Inputs<'a, S> {
    drives: Vec<Drive<'a, S>>,
    /// Next time at which each input without a dead time jumps, s; minus infinity before the start.
    ahead: Vec<f64>,
    /// Inputs with a dead time.
    late: Vec<Late<S>>,
    /// Forces from outside, one for each force of the plant if there are any, each with its unit and the next time at
    /// which it jumps.
    pushes: Vec<(Drive<'a, S>, S, f64)>,
    /// Time of the plant at the start, s.
    begins: f64,
    /// True if steps end at every sample, also at one that equals the sample before.
    every_sample: bool,
    /// Inputs since the last break, if all of them are constant up to the next.
    constant: Option<Vec<S>>,
    /// Inputs and forces at the time of the last evaluation.
    values: RefCell<Vec<S>>,
    forces: RefCell<Vec<S>>,
    /// Forces without any from outside: all 0.
    still: Vec<S>,
    /// Bounds of inputs and forces, to enclose guards.
    bounds: RefCell<Vec<Enclosure>>,
}

/// Inputs and forces at a time.
pub(super) struct Varying<'s, S> {
    t: f64,
    u: RefMut<'s, Vec<S>>,
    w: Option<RefMut<'s, Vec<S>>>,
    still: &'s [S],
}

impl<S> Varying<'_, S> {
    #[inline(always)]
    pub(super) fn at<'s>(&'s self, x: &'s [S]) -> Instant<'s, S> {
        Instant { t: self.t, x, u: &self.u, w: self.w.as_ref().map_or(self.still, |w| w) }
    }
}

/// Input with a dead time.
#[derive(Debug, Clone)]
struct Late<S> {
    input: usize,
    time: S,
    /// Next time at which the input or its rate jumps, before the dead time, s.
    ahead: f64,
}

impl<S: Scalar> Late<S> {
    /// Returns the derivatives of the dead time, with value 0: those of the time of each break.
    fn moves(&self) -> S {
        self.time - self.time.value()
    }

    fn next_break(&self) -> f64 {
        self.ahead + self.time.value()
    }
}

impl<'a, S: Scalar> Inputs<'a, S> {
    /// Creates the inputs just before the start, in the order of [`mops_core::Interface::inputs`]. `forces` is the
    /// number of forces of the plant.
    pub fn new(drives: Vec<Drive<'a, S>>, forces: usize) -> Self {
        let values = RefCell::new(vec![S::from(0.0); drives.len()]);
        let still = vec![S::from(0.0); forces];
        Self {
            ahead: vec![f64::NEG_INFINITY; drives.len()],
            drives,
            late: Vec::new(),
            pushes: Vec::new(),
            begins: 0.0,
            every_sample: false,
            constant: None,
            values,
            forces: RefCell::new(still.clone()),
            still,
            bounds: RefCell::default(),
        }
    }

    /// Sets the time of the plant at the start, s.
    #[must_use]
    pub fn beginning_at(self, begins: f64) -> Self {
        Self { begins, ..self }
    }

    /// Ends steps at every sample.
    #[must_use]
    pub fn at_every_sample(self, every_sample: bool) -> Self {
        Self { every_sample, ..self }
    }

    /// Sets forces from outside, one for each force of the plant, with their unit.
    #[must_use]
    pub fn with_forces(self, pushes: Vec<(Drive<'a, S>, S)>) -> Self {
        Self { pushes: pushes.into_iter().map(|(drive, unit)| (drive, unit, f64::NEG_INFINITY)).collect(), ..self }
    }

    /// Sets the dead times of inputs, by `dead_time`. Such an input is at first as it was before anything of it is
    /// known.
    pub(super) fn delay(&mut self, dead_time: impl Fn(usize) -> Option<S>) {
        let late = |(input, drive): (usize, &Drive<'a, S>)| {
            let time = dead_time(input)?;
            Some(Late { input, time, ahead: drive.first_known().min(0.0 - self.begins) })
        };
        self.late = self.drives.iter().enumerate().filter_map(late).collect();
        for late in &self.late {
            self.drives[late.input].hold_before(late.ahead);
            self.ahead[late.input] = f64::INFINITY;
        }
    }

    /// Returns the number of inputs.
    pub(super) fn len(&self) -> usize {
        self.drives.len()
    }

    /// Evaluates a function at a time and a state.
    #[inline(always)]
    pub(super) fn look<R>(&self, t: f64, x: &[S], at: impl FnOnce(&Instant<'_, S>) -> R) -> R {
        if let Some(constant) = self.constant_at(t, x) {
            return at(&constant);
        }
        let varying = self.varying_at(t);
        at(&varying.at(x))
    }

    /// Returns the instant if all inputs are constant up to the next break.
    #[inline(always)]
    pub(super) fn constant_at<'s>(&'s self, t: f64, x: &'s [S]) -> Option<Instant<'s, S>> {
        self.constant.as_ref().map(|u| Instant { t: t + self.begins, x, u, w: &self.still })
    }

    /// Returns inputs and forces at a time.
    #[inline(always)]
    pub(super) fn varying_at(&self, t: f64) -> Varying<'_, S> {
        let mut u = self.values.borrow_mut();
        self.take_inputs(t, &mut u);
        let w = (!self.pushes.is_empty()).then(|| {
            let mut w = self.forces.borrow_mut();
            self.take_forces(t, &mut w);
            w
        });
        Varying { t: t + self.begins, u, w, still: &self.still }
    }

    #[inline(always)]
    fn take_inputs(&self, t: f64, inputs: &mut [S]) {
        for (u, drive) in inputs.iter_mut().zip(&self.drives) {
            *u = drive.at(t);
        }
        for late in &self.late {
            let (then, drive) = (t - late.time.value(), &self.drives[late.input]);
            inputs[late.input] = drive.at(then) - late.moves() * drive.slope(then);
        }
    }

    fn take_forces(&self, t: f64, forces: &mut [S]) {
        for (w, (push, unit, _)) in forces.iter_mut().zip(&self.pushes) {
            *w = *unit * push.at(t);
        }
    }

    /// Returns the rate of an input at `t`, per s.
    pub(super) fn slope(&self, input: usize, t: f64) -> f64 {
        let late = self.late.iter().find(|late| late.input == input).map_or(0.0, |late| late.time.value());
        self.drives[input].slope(t - late)
    }

    /// Calls a function with the rates of the inputs at `t`.
    #[inline(always)]
    pub(super) fn with_rates<R>(&self, t: f64, of: impl FnOnce(InputRates<'_>) -> R) -> R {
        of(&|input| self.slope(input, t))
    }

    /// Returns inputs and forces at `t`, where an event occurs whose time has the derivatives `delay`.
    pub(super) fn at_event(&self, t: f64, delay: S) -> [Vec<S>; 2] {
        let (mut u, mut w) = (vec![S::from(0.0); self.drives.len()], self.still.clone());
        self.take_inputs(t, &mut u);
        if S::DIRECTIONS > 0 {
            for (input, u) in u.iter_mut().enumerate() {
                *u += delay * self.slope(input, t);
            }
        }
        self.take_forces(t, &mut w);
        [u, w]
    }

    /// Evaluates bounds over a time span in which the states stay within `x`.
    pub(super) fn over(
        &self,
        time: Enclosure,
        x: &[Enclosure],
        bounds_of: impl FnOnce(&Span<'_>) -> Enclosure,
    ) -> Enclosure {
        let mut bounds = self.bounds.borrow_mut();
        bounds.clear();
        let is_late = |input: usize| self.late.iter().any(|late| late.input == input);
        let enclose = |(input, drive): (usize, &Drive<'_, S>)| match is_late(input) {
            true => Enclosure::UNKNOWN,
            false => drive.enclose(time),
        };
        bounds.extend(self.drives.iter().enumerate().map(enclose));
        let force = if self.pushes.is_empty() { Enclosure::from(0.0) } else { Enclosure::UNKNOWN };
        bounds.resize(self.drives.len() + self.still.len(), force);
        let (u, w) = bounds.split_at(self.drives.len());
        bounds_of(&Span { time: time + Enclosure::from(self.begins), x, u, w })
    }

    /// Returns true if an input jumps at the start, before which it is.
    pub(super) fn jumps_at_start(&self) -> bool {
        self.drives.iter().any(Drive::jumps_at_start) || self.late_at(0.0).is_some()
    }

    /// Returns the earliest time from which on an input is known to reach the plant, at most 0 s.
    pub(super) fn first_known(&self) -> f64 {
        let of_drive = |(input, drive): (usize, &Drive<'a, S>)| match self.late.iter().find(|l| l.input == input) {
            Some(late) => late.next_break(),
            None => drive.first_known().min(0.0 - self.begins),
        };
        self.drives.iter().enumerate().map(of_drive).fold(0.0, f64::min)
    }

    /// Moves the inputs to just before the start.
    pub(super) fn arrive(&mut self) {
        for (drive, ahead) in self.drives.iter_mut().zip(&mut self.ahead).filter(|(_, ahead)| **ahead < f64::INFINITY) {
            drive.hold_before(0.0);
            *ahead = f64::NEG_INFINITY;
        }
        while let Some(k) = (0..self.late.len()).find(|&k| !is_due(0.0, self.late[k].next_break())) {
            self.pass_late(k);
        }
    }

    /// Returns the next time at which an input or a force jumps, s.
    pub(super) fn next_break(&self) -> f64 {
        let of_late = self.late.iter().map(Late::next_break);
        next_of(self.ahead.iter().copied().chain(of_late).chain(self.pushes.iter().map(|(.., ahead)| *ahead)))
    }

    /// Returns true if an input without a dead time, or a force, jumps at `t`.
    pub(super) fn jumps_at(&self, t: f64) -> bool {
        self.ahead.iter().chain(self.pushes.iter().map(|(.., ahead)| ahead)).any(|&ahead| is_due(ahead, t))
    }

    /// Moves inputs without a dead time, and forces, that jump at `t` on to the values that are valid from then on.
    pub(super) fn pass(&mut self, t: f64) {
        self.constant = None;
        let inputs = self.drives.iter_mut().zip(&mut self.ahead);
        let forces = self.pushes.iter_mut().map(|(push, _, ahead)| (push, ahead));
        for (drive, ahead) in inputs.chain(forces).filter(|(_, ahead)| is_due(**ahead, t)) {
            drive.pass_break(t);
            *ahead = if self.every_sample { drive.next_sample(t) } else { drive.next_break(t) };
        }
    }

    /// Moves all inputs, and forces, on to the values that are valid from `t` on.
    pub(super) fn pass_all(&mut self, t: f64) {
        self.pass(t);
        while let Some((k, _)) = self.late_at(t) {
            self.pass_late(k);
        }
    }

    /// Returns the next input with a dead time that jumps at `t`, as its number among those, with the derivatives of
    /// the time of the jump.
    pub(super) fn late_at(&self, t: f64) -> Option<(usize, S)> {
        let due = self.late.iter().enumerate().find(|(_, late)| is_due(late.next_break(), t));
        due.map(|(k, late)| (k, late.moves()))
    }

    /// Moves an input with a dead time on to its next value.
    pub(super) fn pass_late(&mut self, k: usize) {
        self.constant = None;
        let late = &mut self.late[k];
        let (drive, here) = (&mut self.drives[late.input], late.ahead);
        drive.pass_break(here);
        late.ahead = if self.every_sample { drive.next_sample(here) } else { drive.next_break(here) };
    }

    /// Finds out whether all inputs are constant up to the next break.
    pub(super) fn settle(&mut self, t: f64) {
        let is_constant = self.pushes.is_empty() && self.drives.iter().all(Drive::is_constant);
        self.constant = is_constant.then(|| {
            let mut u = vec![S::from(0.0); self.drives.len()];
            self.take_inputs(t, &mut u);
            u
        });
    }

    /// Returns the longest step that resolves the inputs, s.
    pub(super) fn longest_step(&self) -> f64 {
        let all = self.drives.iter().chain(self.pushes.iter().map(|(push, ..)| push));
        all.map(Drive::longest_step).fold(f64::INFINITY, f64::min)
    }

    /// Returns the time of the plant, s.
    pub(super) fn time(&self, t: f64) -> f64 {
        t + self.begins
    }

    /// Returns the time of the simulation, s.
    pub(super) fn since_start(&self, time: f64) -> f64 {
        time - self.begins
    }
}
