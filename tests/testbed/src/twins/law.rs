//! Law of an effect at given parameters, and constructors of common forms.

use crate::law::Dry;

/// State of the simulation at an effect's place.
#[derive(Debug, Clone, Copy)]
pub(super) struct At<'a> {
    /// Time, s.
    pub t: f64,
    /// Value that the effect receives: command at an actuator, signal at a sensor.
    pub value: f64,
    /// Position of the joint, or state of the process.
    pub q: f64,
    /// Speed of the joint.
    pub v: f64,
    /// Value at the second place: position, state, command or signal.
    pub other: f64,
    /// Speed at the second place.
    pub other_speed: f64,
    /// Own states of the effect.
    pub z: &'a [f64],
    /// Output at the start of the integration step; NaN before the first one.
    pub last: f64,
    /// Time since the start of the integration step, s.
    pub elapsed: f64,
}

/// Function of the simulation state.
pub(super) type Term = Box<dyn Fn(&At<'_>) -> f64>;
/// Function that writes the effect's own states, or their rates.
pub(super) type Own = Box<dyn Fn(&At<'_>, &mut [f64])>;
/// Function that returns the levels of dry friction for a direction of motion, 1 or -1.
pub(super) type Levels = Box<dyn Fn(&At<'_>, f64) -> Dry>;

/// Law of an effect. Unused parts are `None` or 0.
#[derive(Default)]
pub(super) struct Law {
    /// Number of own states.
    pub states: usize,
    /// Initial values of own states; 0 otherwise.
    pub begin: Option<Own>,
    /// Rates of own states.
    pub rates: Option<Own>,
    /// Term in the equation of a joint or process; output of an actuator or sensor.
    pub output: Option<Term>,
    /// Term in the equation of the second place, divided by that of the first.
    pub onward: f64,
    /// Dry friction at a joint.
    pub dry: Option<Levels>,
    /// Mass or inertia that is added at a joint.
    pub added: f64,
    /// Mass or inertia that is lost at a joint, per s.
    pub lost: f64,
    /// Delay of the command or signal, s.
    pub delay: f64,
    /// Functions with sign changes where the law jumps or bends.
    pub guards: Vec<Term>,
}

/// Creates a law without states.
pub(super) fn term(output: impl Fn(&At<'_>) -> f64 + 'static) -> Law {
    Law { output: Some(Box::new(output)), ..Law::default() }
}

/// Creates a law with states.
pub(super) fn dynamic(
    states: usize,
    begin: impl Fn(&At<'_>, &mut [f64]) + 'static,
    rates: impl Fn(&At<'_>, &mut [f64]) + 'static,
    output: impl Fn(&At<'_>) -> f64 + 'static,
) -> Law {
    Law { states, begin: Some(Box::new(begin)), rates: Some(Box::new(rates)), ..term(output) }
}

impl Law {
    /// Adds a function with a sign change where the law jumps or bends.
    pub(super) fn with_guard(mut self, guard: impl Fn(&At<'_>) -> f64 + 'static) -> Self {
        self.guards.push(Box::new(guard));
        self
    }
}

/// Returns the share of a smooth change: 0 before `from`, 1 after `from + length`.
pub(super) fn change(t: f64, from: f64, length: f64) -> f64 {
    let share = ((t - from) / length).clamp(0.0, 1.0);
    0.5 * (1.0 - mops_math::cos(std::f64::consts::PI * share))
}

/// Returns 1 for positive, -1 for negative numbers, and 0 for 0.
pub(super) fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}
