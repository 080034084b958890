//! What a simulation of a twin is given.

/// Place of an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Site {
    /// Joint, by its index.
    Joint(usize),
    /// State in whose equation a term acts, by its index.
    Process(usize),
    /// Place between the command and the plant.
    Actuator,
    /// Place between a signal and its measurement: the index of a state, or the number of states for the input that
    /// acts.
    Sensor(usize),
}

/// Effect at a place.
#[derive(Debug, Clone, Copy)]
pub struct Declared<'a> {
    /// Name in the catalogue.
    pub name: &'a str,
    /// Place.
    pub site: Site,
    /// Second place, for an effect that has one.
    pub companion: Option<Site>,
    /// True for a force between two joints, with the reaction at the second.
    pub is_mutual: bool,
    /// Values of the parameters, in the order of the catalogue.
    pub parameters: &'a [f64],
}

/// Input of a simulation.
pub struct Command<'a> {
    /// Value at a time, s.
    pub value: &'a dyn Fn(f64) -> f64,
    /// Value before time 0.
    pub before: f64,
    /// Times at which the input jumps or bends, s.
    pub knots: &'a [f64],
}
