//! Instant of a simulation.

/// Time, states, inputs and forces at which a plant is evaluated.
#[derive(Debug, Clone, Copy)]
pub struct Instant<'a, S> {
    /// Time, s; in a window of a record the time of the record.
    pub t: f64,
    /// The states, in the order of [`crate::Model::equation_states`].
    pub x: &'a [S],
    /// The inputs as they reach the plant, in the order of [`crate::Interface::inputs`].
    pub u: &'a [S],
    /// Additive terms of the right-hand sides, one for every [`crate::effect::Port::Process`] in the order of
    /// [`crate::Interface::ports`]; 0 in the nominal model.
    pub w: &'a [S],
}
