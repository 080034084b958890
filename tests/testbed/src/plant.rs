//! What a plant is: names, sizes, equations, and how it is excited.

use crate::draw::Draw;

/// `rates(x, u, p, w, dx)` writes the derivatives of the states.
pub type Rates = fn(&[f64], &[f64], &[f64], &[f64], &mut [f64]);

/// A plant: `E(x) x' = f(x, u; p) + w` with a term `w` at each place, 0 in the base model.
#[derive(Debug)]
pub struct Plant {
    /// Name, in kebab case.
    pub name: &'static str,
    /// Names and units of the states.
    pub states: &'static [(&'static str, &'static str)],
    /// Names and units of the inputs.
    pub inputs: &'static [(&'static str, &'static str)],
    /// What is measured.
    pub outputs: &'static [Output],
    /// Where a term may be missing in the equations.
    pub places: &'static [Place],
    /// Parameters that the study estimates.
    pub parameters: &'static [Parameter],
    /// Names, values and units of constants.
    pub constants: &'static [(&'static str, f64, &'static str)],
    /// The equations, as lines of the study file.
    pub equations: &'static str,
    /// Derivatives of the states.
    pub rates: Rates,
    /// Draws experiment 0 (calibration), 1 or 2 (selection).
    pub setup: fn(&mut Draw, usize) -> Setup,
    /// What else effects must know.
    pub traits: Traits,
}

/// Properties of a plant that decide which effects make sense in it.
#[derive(Debug, Clone, Copy)]
pub struct Traits {
    /// Index of a parameter that is a mass which may be lost.
    pub mass: Option<usize>,
    /// Index of a parameter that is the stiffness of the first joint's spring, which may have a gap.
    pub spring: Option<usize>,
    /// Index of the parameter that is the stiffness of a coupling between the first two joints, which may have play.
    pub coupling: Option<usize>,
    /// The first two processes are levels of tanks, the first flowing into the second.
    pub levels: bool,
    /// Processes are temperatures in degC.
    pub thermal: bool,
    /// The equations are linear in states and inputs.
    pub linear: bool,
}

/// None of the properties.
pub const PLAIN: Traits =
    Traits { mass: None, spring: None, coupling: None, levels: false, thermal: false, linear: false };

/// A state that is measured.
#[derive(Debug, Clone, Copy)]
pub struct Output {
    /// Index of the state.
    pub state: usize,
    /// Standard deviation of the white noise, in the unit of the state.
    pub noise: f64,
    /// Step of the quantisation, 0 for none.
    pub lsb: f64,
}

/// A place where the equations may lack a term.
#[derive(Debug, Clone, Copy)]
pub enum Place {
    /// A coordinate of second order.
    Joint {
        /// Index of the position.
        q: usize,
        /// Index of the speed, in whose equation the term stands.
        v: usize,
        /// Position about which springs are symmetric.
        rest: f64,
        /// The position is an angle in rad.
        angle: bool,
        /// The base model has viscous friction here.
        damped: bool,
        /// The base model has a linear spring here.
        sprung: bool,
    },
    /// A state of first order.
    Process {
        /// Index of the state.
        x: usize,
    },
}

impl Place {
    /// Index of the state that names the place.
    pub fn state(&self) -> usize {
        match *self {
            Self::Joint { q, .. } => q,
            Self::Process { x } => x,
        }
    }

    /// Index of the state in whose equation the term stands.
    pub fn equation(&self) -> usize {
        match *self {
            Self::Joint { v, .. } => v,
            Self::Process { x } => x,
        }
    }
}

/// A positive parameter of the base model.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Name in the study file.
    pub name: &'static str,
    /// Unit in the study file.
    pub unit: &'static str,
    /// Value about which true values are drawn.
    pub nominal: f64,
}

/// One experiment before it is simulated.
#[derive(Debug, Clone)]
pub struct Setup {
    /// Sample time, s.
    pub dt: f64,
    /// Number of samples.
    pub samples: usize,
    /// True start values of the states.
    pub start: Vec<f64>,
    /// Value of each input from each sample on (zero-order hold).
    pub inputs: Vec<Vec<f64>>,
}

impl Setup {
    /// Time of the last sample, s.
    pub fn duration(&self) -> f64 {
        self.dt * (self.samples - 1) as f64
    }
}

impl Plant {
    /// The output that measures a state.
    pub fn output_of(&self, state: usize) -> Option<usize> {
        self.outputs.iter().position(|output| output.state == state)
    }

    /// The speed of a state that is the position of a joint.
    pub fn speed_of(&self, state: usize) -> Option<usize> {
        self.places.iter().find_map(|place| match *place {
            Place::Joint { q, v, .. } if q == state => Some(v),
            _ => None,
        })
    }
}
