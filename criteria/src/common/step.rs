//! Step of a response: initial value, target and time.

use std::borrow::Cow;

use mops_core::{
    Analysis, Interface, StudyError, Trace, Value,
    criterion::{Mark, Side},
};
use mops_language::{Quantity, Unit};

use super::{optional, part, step_time, trace};

/// Share of a step that counts as near a level.
const NEAR: f64 = 0.01;

/// Share of a band below which a reversal of motion is ignored.
const TURN: f64 = 1e-3;

/// Options that define the step.
pub struct StepOptions<'a> {
    pub signal: &'a str,
    pub target: Option<&'a Quantity>,
    pub from: Option<&'a Quantity>,
    pub step_time: Option<&'a Quantity>,
}

/// Checked options of the step.
pub struct Step {
    pub signal: String,
    pub unit: Unit,
    target: Option<f64>,
    from: Option<f64>,
    time: f64,
}

/// Response from the step on.
pub struct Answer<'a> {
    /// Signal from the time of the step on.
    pub trace: Cow<'a, Trace>,
    /// Value before the step.
    pub from: f64,
    /// Value at which the signal should settle.
    pub target: f64,
    /// Time of the step, s.
    pub time: f64,
    /// True if the target is the last value because none was given.
    pub is_assumed: bool,
}

impl StepOptions<'_> {
    /// Checks the names and units.
    pub fn bind(&self, model: &Interface) -> Result<Step, StudyError> {
        let unit = model.signal(self.signal)?.unit.clone();
        let target = optional("target", self.target, &unit)?;
        let from = optional("from", self.from, &unit)?;
        let time = step_time(self.step_time)?;
        if let (Some(target), Some(from)) = (target, from)
            && target == from
        {
            return Err(StudyError::new(
                "target",
                format!("the step has no height: `from` and `target` are both {}", unit.amount(from)),
            ));
        }
        Ok(Step { signal: self.signal.to_owned(), unit, target, from, time })
    }
}

impl Step {
    /// Returns the assumption on the target if the study gives none.
    pub fn assumption(&self) -> Option<String> {
        let text = "no `target` given: the value of the signal at the end of the simulation is used";
        self.target.is_none().then(|| text.to_owned())
    }

    /// Returns the response to the step.
    pub fn answer<'a>(&self, analysis: &'a Analysis) -> Result<Answer<'a>, String> {
        let whole = trace(analysis, &self.signal)?;
        let (time, end) = (self.time, whole.end());
        if time >= end {
            return Err(format!("the step at {time} s is after the end of the simulation at {end} s"));
        }
        Ok(Answer {
            trace: if time <= whole.start() {
                Cow::Borrowed(whole)
            } else {
                Cow::Owned(part(whole, &[time, end], |_, y| y))
            },
            from: self.from.unwrap_or_else(|| whole.initial()),
            target: self.target.unwrap_or_else(|| whole.last()),
            time,
            is_assumed: self.target.is_none(),
        })
    }

    /// Returns a constant bound of the signal from a time on, to be plotted.
    pub fn mark(&self, label: &str, from: f64, level: f64, excluded: Option<Side>) -> Mark {
        let times = [from, f64::INFINITY];
        Mark { signal: self.signal.clone(), label: label.to_owned(), times, values: [level; 2], excluded }
    }
}

impl Answer<'_> {
    /// Returns the height of the step, `target - from`, not zero.
    pub fn height(&self) -> Result<f64, String> {
        let height = self.target - self.from;
        // A height at rounding level counts as zero.
        if height.abs() > 1e-12 * self.target.abs().max(self.from.abs()) {
            Ok(height)
        } else {
            Err(format!("the step from {} to {} has no height", self.from, self.target))
        }
    }

    /// Returns true if the response should rise; a step of zero height counts as upwards.
    fn rises(&self) -> bool {
        self.target >= self.from
    }

    /// Returns a difference relative to the direction of the step.
    pub fn upwards(&self, difference: f64) -> f64 {
        if self.rises() { difference } else { -difference }
    }

    /// Returns the value farthest in the direction of the step.
    pub fn farthest_ahead(&self) -> f64 {
        if self.rises() { self.trace.maximum().0 } else { self.trace.minimum().0 }
    }

    /// Returns the value farthest against the direction of the step.
    pub fn farthest_behind(&self) -> f64 {
        if self.rises() { self.trace.minimum().0 } else { self.trace.maximum().0 }
    }

    /// Returns the time from the step until the response first reaches `fraction` of the step.
    pub fn first_reaching(&self, fraction: f64) -> Result<Option<f64>, String> {
        let level = self.from + fraction * self.height()?;
        Ok(self.trace.first_reaching(level, self.rises()).map(|t| t - self.time))
    }

    /// Returns the value of a missed event, which requires the signal within `near` of `level`.
    ///
    /// The distance is the mean deviation from `level` in the last tenth of the time from the step to the end.
    pub fn missed(&self, horizon: f64, level: f64, near: f64, note: &'static str) -> Value {
        let end = self.trace.end();
        let tenth = 0.1 * self.length();
        let tail = part(&self.trace, &[end - tenth, end], |_, y| y);
        let distance = tail.integral_of_deviation(level, |_, e| e) / tenth;
        Value::missed(Some(horizon), distance, near, note)
    }

    /// Returns the value of a level, `fraction` of the step, that was never reached; near is 1 % of the step. See
    /// [`Answer::missed`].
    pub fn not_reached(&self, horizon: f64, fraction: f64, note: &'static str) -> Result<Value, String> {
        let height = self.height()?;
        Ok(self.missed(horizon, self.from + fraction * height, NEAR * height.abs(), note))
    }

    /// Returns the last time at which the response is not within `band` of the target; `None` if it always is.
    pub fn last_outside(&self, band: f64) -> Option<f64> {
        let (low, high) = (self.target - band, self.target + band);
        let is_outside = |y: f64| y < low || y > high;
        let last = self.trace.last_piece(|piece| piece.value.into_iter().any(is_outside))?;
        if is_outside(last.value[1]) {
            return Some(last.time[1]);
        }
        // The piece is monotone: it enters across the edge beyond which it starts.
        let edge = if last.value[0] > high { high } else { low };
        Some(self.trace.crossing(&last, edge).unwrap_or(last.time[0]))
    }

    /// Returns true if the response, within `band` of the target since `time` (s), appears to stay there after the end.
    ///
    /// This is the case if the response has reversed since `time`. The response also stays if at its final rate it
    /// would not leave the band within the simulated time. The third case is a response that slows down to a value
    /// within the band. With the final rate and curvature, an exponential approach ends at `y - y'^2/y''`. Otherwise
    /// the response crosses the band when the simulation ends.
    pub fn stays_within(&self, band: f64, time: f64) -> bool {
        let [value, rate, curvature] = self.trace.motion_at_end();
        let is_within = |y: f64| (y - self.target).abs() <= band;
        if is_within(value + rate * self.length())
            || is_within(value - rate * rate / curvature) && rate * curvature < 0.0
        {
            return true;
        }
        let since = self.trace.pieces().into_iter().rev().take_while(|piece| piece.time[1] > time);
        // A reversal at rounding level is ignored.
        let mut moves = since.map(|piece| piece.value[1] - piece.value[0]).filter(|y| y.abs() > TURN * band);
        moves.next().is_some_and(|last| moves.any(|earlier| earlier.signum() != last.signum()))
    }

    /// Adds a note if the target is the last value and the response does not appear to stay within 2 % of the step
    /// there.
    pub fn note(&self, value: Value) -> Value {
        let moves = || {
            let band = 0.02 * self.height().unwrap_or(0.0).abs();
            !self.stays_within(band, self.last_outside(band).unwrap_or(self.time))
        };
        let note = (self.is_assumed && moves()).then_some("still moving at the end");
        Value { note: value.note.or(note), ..value }
    }

    /// Returns the time from the step to the end of the simulation, s.
    pub fn length(&self) -> f64 {
        self.trace.end() - self.time
    }
}
