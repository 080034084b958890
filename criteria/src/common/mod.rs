//! What several criteria share: reading options, the step a response answers, the measurement it is compared with.

mod comparison;
mod error_integral;
mod linear;
mod part;
mod step;
#[cfg(test)]
pub mod testing;

use mops_core::{Analysis, Mistake, Quantity, Trace, Unit, Variable, suggestion};

pub use comparison::{compare, compared_slopes};
pub use error_integral::ErrorIntegral;
pub use linear::{Channel, LinearCriterion, Of, Values, capped, feedback, poles};
pub use part::part;
pub use step::{Step, StepOptions};

/// The range of values that are never negative.
pub const NOT_NEGATIVE: [f64; 2] = [0.0, f64::INFINITY];

/// The signal of that name.
pub fn signal<'a>(signals: &'a [Variable], name: &str) -> Result<&'a Variable, Mistake> {
    signals.iter().find(|signal| signal.name == name).ok_or_else(|| {
        Mistake::new("signal", format!("the model has no signal `{name}`"))
            .with_help(suggestion(name, signals.iter().map(|signal| signal.name.as_str())))
    })
}

/// An option as a number in `unit`.
pub fn number(key: &str, option: &Quantity, unit: &Unit) -> Result<f64, Mistake> {
    let number = option.to(unit).map_err(|why| Mistake::new(key, why))?;
    if number.is_finite() {
        Ok(number)
    } else {
        Err(Mistake::new(key, format!("`{key}` must be finite, not {number}")))
    }
}

/// An option that may be absent, as a number in `unit`.
pub fn optional(key: &str, option: Option<&Quantity>, unit: &Unit) -> Result<Option<f64>, Mistake> {
    option.map(|option| number(key, option, unit)).transpose()
}

/// An option that may be absent and must be positive, as a number in `unit`.
pub fn positive(key: &str, option: Option<&Quantity>, unit: &Unit) -> Result<Option<f64>, Mistake> {
    match optional(key, option, unit)? {
        Some(number) if number <= 0.0 => {
            Err(Mistake::new(key, format!("`{key}` must be positive, not {}", unit.amount(number))))
        }
        number => Ok(number),
    }
}

/// The time of the step, s; 0 where absent.
pub fn step_time(option: Option<&Quantity>) -> Result<f64, Mistake> {
    match optional("step-time", option, &second())? {
        Some(time) if time < 0.0 => {
            Err(Mistake::new("step-time", format!("a step at {time} s lies before the simulation begins")))
        }
        time => Ok(time.unwrap_or(0.0)),
    }
}

/// The unit of time.
pub fn second() -> Unit {
    Unit::known("s")
}

/// The trace of a signal, finite throughout: a comparison would pass over a NaN in silence.
pub fn trace<'a>(analysis: &'a Analysis, signal: &str) -> Result<&'a Trace, String> {
    let trace = analysis.trace(signal);
    if trace.is_empty() {
        return Err(format!("the simulation of `{signal}` has no length"));
    }
    // 0 y is 0, or NaN where y is not finite.
    if trace.integral(|_, y| 0.0 * y) == 0.0 { Ok(trace) } else { Err(format!("`{signal}` is not finite throughout")) }
}
