//! What an undeclared effect does to a plant.

/// A function of where the simulation is.
pub type Term = Box<dyn Fn(&At<'_>) -> f64 + Send + Sync>;
/// A function of where the simulation is and of a value that passes through.
pub type Through = Box<dyn Fn(&At<'_>, f64) -> f64 + Send + Sync>;
/// A function that writes own states, or their derivatives.
pub type Own = Box<dyn Fn(&At<'_>, &mut [f64]) + Send + Sync>;
/// A function that gives the levels of dry friction for a direction of motion, 1 or -1.
pub type Levels = Box<dyn Fn(&At<'_>, f64) -> Dry + Send + Sync>;
/// A function of time that changes the parameters.
pub type Parameters = Box<dyn Fn(f64, &mut [f64]) + Send + Sync>;

/// Levels of dry friction, both positive.
#[derive(Debug, Clone, Copy)]
pub struct Dry {
    /// Force against the motion while it slides.
    pub slide: f64,
    /// Largest force that holds it at rest.
    pub hold: f64,
}

/// Where the simulation is.
#[derive(Debug, Clone, Copy)]
pub struct At<'a> {
    /// Time, s.
    pub t: f64,
    /// Number of the experiment.
    pub experiment: usize,
    /// Position or state at the effect's place; at an actuator its command.
    pub q: f64,
    /// Speed at the effect's place; 0 where there is none.
    pub v: f64,
    /// All states of the plant.
    pub x: &'a [f64],
    /// All commands.
    pub u: &'a [f64],
    /// Own states of the effect.
    pub z: &'a [f64],
}

/// Where an effect acts, as indices of the plant's places, inputs and outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spot {
    /// In an equation.
    Place(usize),
    /// Between a command and what acts.
    Actuator(usize),
    /// Between a state and what is measured.
    Sensor(usize),
}

/// An effect with all its numbers. What it does not do is `None`.
#[derive(Default)]
pub struct Law {
    /// Start values of own states, where `begin` gives no others.
    pub states: Vec<f64>,
    /// Writes the start values of own states in an experiment, from where the plant and its commands begin.
    pub begin: Option<Own>,
    /// Derivatives of own states.
    pub rates: Option<Own>,
    /// Moves own states after every step, as play does; the time of the step plays no part.
    pub settle: Option<Own>,
    /// Term in the equation of the place.
    pub force: Option<Term>,
    /// The same term, times a factor, in the equations of other places.
    pub also: Vec<(usize, f64)>,
    /// Dry friction at the place.
    pub dry: Option<Levels>,
    /// What becomes of a command.
    pub actuate: Option<Through>,
    /// What becomes of a measured state.
    pub sense: Option<Through>,
    /// How parameters change with time.
    pub parameters: Option<Parameters>,
    /// Delay of the command or of the measurement, s.
    pub delay: f64,
}

/// An effect at its place.
pub struct Installed {
    /// What it does.
    pub law: Law,
    /// Where.
    pub spot: Spot,
}
