//! Linear system in state space.

use nalgebra::DMatrix;

/// Complex number.
pub type Complex = nalgebra::Complex<f64>;

/// Linear time-invariant system with named states, inputs and outputs:
///
/// ```text
/// dx/dt = A x + B u(t - delay),   y = C x + D u(t - delay)
/// ```
///
/// A sampled system is represented by its bilinear image, see [`StateSpace::sampled`].
#[derive(Debug, Clone, PartialEq)]
pub struct StateSpace {
    /// Matrix `A`, states x states.
    pub a: DMatrix<f64>,
    /// Matrix `B`, states x inputs.
    pub b: DMatrix<f64>,
    /// Matrix `C`, outputs x states.
    pub c: DMatrix<f64>,
    /// Matrix `D`, outputs x inputs.
    pub d: DMatrix<f64>,
    /// Names of the states.
    pub states: Vec<String>,
    /// Names of the inputs.
    pub inputs: Vec<String>,
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// Delay of all inputs, s.
    pub delay: f64,
    /// Sampling period of a sampled system, s; `None` for a continuous one.
    pub period: Option<f64>,
}

impl StateSpace {
    /// Returns the system with every matrix and the delay moved by `distance` along a tangent with the same dimensions.
    #[must_use]
    pub fn moved(&self, tangent: &Self, distance: f64) -> Self {
        Self {
            a: &self.a + &tangent.a * distance,
            b: &self.b + &tangent.b * distance,
            c: &self.c + &tangent.c * distance,
            d: &self.d + &tangent.d * distance,
            delay: self.delay + distance * tangent.delay,
            ..self.clone()
        }
    }
}
