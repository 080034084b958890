//! Command of an actuator: an input of the case, delayed by the effects of the actuator.

use mops_core::{Input, Scalar};

use crate::kernel::drive::Drive;
use crate::kernel::is_due;

/// Input of the plant before the other effects of its actuator.
///
/// The value changes from that before a break to that after it in [`Command::pass_break`] alone, as that of a [`Drive`].
#[derive(Clone)]
pub(super) struct Command<'a, S> {
    drive: Drive<'a, S>,
    /// Sum of the delays, if an effect delays the input.
    delay: Option<S>,
    /// Value until the start has reached the output; `None` from then on. The start is below 0 in a window of a record, and for
    /// records with earlier samples.
    before: Option<S>,
    /// True if every sample is a break, also one that equals the sample before.
    every_sample: bool,
    /// Next time at which the input or its rate jumps, before the delay, s.
    ahead: f64,
}

impl<'a, S: Scalar> Command<'a, S> {
    /// Creates the command of an input, before its start. `begins` is the clock time of the case at time 0, s. Without an input the
    /// command is zero.
    pub fn new(input: Option<&'a Input>, delay: Option<S>, begins: f64, every_sample: bool) -> Self {
        let begun = input.map_or(0.0, Input::first_known).min(0.0 - begins);
        let before = input.map_or(0.0, |input| input.at(begun.next_down()));
        Self { drive: Drive::new(input), delay, before: Some(S::from(before)), every_sample, ahead: begun }
    }

    /// Creates a command with a constant value.
    pub fn held(value: S) -> Self {
        Self { drive: Drive::held(value), delay: None, before: None, every_sample: false, ahead: f64::INFINITY }
    }

    fn delayed_by(&self) -> f64 {
        self.delay.map_or(0.0, Scalar::value)
    }

    /// Returns the derivatives of the delay, which are those of the time of each break, with value 0.
    pub fn late(&self) -> S {
        self.delay.map_or(S::from(0.0), |delay| delay - delay.value())
    }

    /// Returns true if an effect delays the input.
    pub fn is_delayed(&self) -> bool {
        self.delay.is_some()
    }

    /// Returns the value at `t`.
    pub fn at(&self, t: f64) -> S {
        match (self.before, self.delay) {
            (Some(before), _) => before,
            (None, None) => self.drive.at(t),
            (None, Some(delay)) => {
                let then = t - delay.value();
                self.drive.at(then) - self.late() * self.drive.slope(then)
            }
        }
    }

    /// Returns the rate at `t`, per s.
    pub fn slope(&self, t: f64) -> f64 {
        if self.before.is_some() { 0.0 } else { self.drive.slope(t - self.delayed_by()) }
    }

    /// Returns the drive, if no effect delays it.
    pub fn undelayed(&self) -> Option<&Drive<'a, S>> {
        (self.delay.is_none() && self.before.is_none()).then_some(&self.drive)
    }

    /// Returns the longest step that resolves the input, s.
    pub fn longest_step(&self) -> f64 {
        self.drive.longest_step()
    }

    /// Returns the next time at which the value or its rate jumps, s.
    pub fn next_break(&self) -> f64 {
        self.ahead + self.delayed_by()
    }

    /// Returns true if the value or its rate jumps at `t`.
    pub fn is_due(&self, t: f64) -> bool {
        is_due(self.next_break(), t)
    }

    /// Moves on to the value that is valid from `t` on, if there is a break.
    pub fn pass_break(&mut self, t: f64) {
        while self.is_due(t) {
            let here = self.ahead;
            self.before = None;
            self.drive.pass_break(here);
            self.ahead = if self.every_sample { self.drive.next_sample(here) } else { self.drive.next_break(here) };
        }
    }
}
