//! Law of an undeclared effect in a plant.

/// Function of the simulation state.
pub type Term = Box<dyn Fn(&At<'_>) -> f64 + Send + Sync>;
/// Function of the simulation state and of a value that is passed through.
pub type Through = Box<dyn Fn(&At<'_>, f64) -> f64 + Send + Sync>;
/// Function that writes the effect's own states, or their derivatives.
pub type Own = Box<dyn Fn(&At<'_>, &mut [f64]) + Send + Sync>;
/// Function that returns the levels of dry friction for a direction of motion, 1 or -1.
pub type Levels = Box<dyn Fn(&At<'_>, f64) -> Dry + Send + Sync>;
/// Function of time that changes the parameters.
pub type Parameters = Box<dyn Fn(f64, &mut [f64]) + Send + Sync>;

/// Levels of dry friction, both positive.
#[derive(Debug, Clone, Copy)]
pub struct Dry {
    /// Force against the motion while sliding.
    pub slide: f64,
    /// Breakaway force: largest force at rest.
    pub hold: f64,
}

/// State of the simulation at an effect's place.
#[derive(Debug, Clone, Copy)]
pub struct At<'a> {
    /// Time, s.
    pub t: f64,
    /// Index of the experiment.
    pub experiment: usize,
    /// Position or state at the effect's place; command at an actuator.
    pub q: f64,
    /// Speed at the effect's place; 0 if there is none.
    pub v: f64,
    /// All states of the plant.
    pub x: &'a [f64],
    /// All commands.
    pub u: &'a [f64],
    /// Own states of the effect.
    pub z: &'a [f64],
}

/// Place of an effect, as an index of the plant's places, inputs or outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spot {
    /// Place in an equation.
    Place(usize),
    /// Place between a command and the plant.
    Actuator(usize),
    /// Place between a state and its measurement.
    Sensor(usize),
}

/// Complete effect. Unused parts are `None`.
#[derive(Default)]
pub struct Law {
    /// Initial values of the effect's own states, unless `begin` sets others.
    pub states: Vec<f64>,
    /// Writes the initial values of own states in an experiment, from the initial state and command of the plant.
    pub begin: Option<Own>,
    /// Derivatives of own states.
    pub rates: Option<Own>,
    /// Updates own states after every step, as backlash does; independent of the step size.
    pub settle: Option<Own>,
    /// Term in the equation of the place.
    pub force: Option<Term>,
    /// Equations of other places with the same term, times a factor.
    pub also: Vec<(usize, f64)>,
    /// Dry friction at the place.
    pub dry: Option<Levels>,
    /// Map of a command.
    pub actuate: Option<Through>,
    /// Map of a measured state.
    pub sense: Option<Through>,
    /// Time dependence of the parameters.
    pub parameters: Option<Parameters>,
    /// Delay of the command or of the measurement, s.
    pub delay: f64,
}

/// Effect at its place.
pub struct Installed {
    /// Law of the effect.
    pub law: Law,
    /// Place of the effect.
    pub spot: Spot,
}
