//! Definition of a plant: names, sizes, equations and excitation.

use crate::draw::Draw;

/// `rates(x, u, p, w, dx)` writes the derivatives of the states.
pub type Rates = fn(&[f64], &[f64], &[f64], &[f64], &mut [f64]);

/// Plant `E(x) x' = f(x, u; p) + w` with a term `w` at each place, 0 in the baseline model.
#[derive(Debug)]
pub struct Plant {
    /// Name, in kebab case.
    pub name: &'static str,
    /// Names and units of the states.
    pub states: &'static [(&'static str, &'static str)],
    /// Names and units of the inputs.
    pub inputs: &'static [(&'static str, &'static str)],
    /// Measured outputs.
    pub outputs: &'static [Output],
    /// Places where the equations may lack a term.
    pub places: &'static [Place],
    /// Parameters estimated by the study.
    pub parameters: &'static [Parameter],
    /// Names, values and units of constants.
    pub constants: &'static [(&'static str, f64, &'static str)],
    /// Equations, as lines of the study file.
    pub equations: &'static str,
    /// Derivatives of the states.
    pub rates: Rates,
    /// Draws experiment 0 (calibration), 1 or 2 (selection).
    pub setup: fn(&mut Draw, usize) -> Setup,
    /// Further properties needed by effects.
    pub traits: Traits,
}

/// Properties of a plant that decide which effects make sense in it.
#[derive(Debug, Clone, Copy)]
pub struct Traits {
    /// Index of a mass parameter that may decrease.
    pub mass: Option<usize>,
    /// Index of the stiffness parameter of the first joint's spring, which may have backlash.
    pub spring: Option<usize>,
    /// Index of the stiffness parameter of a coupling between the first two joints, which may have backlash.
    pub coupling: Option<usize>,
    /// True if the first two processes are levels of tanks, the first flowing into the second.
    pub levels: bool,
    /// True if processes are temperatures in degC.
    pub thermal: bool,
    /// True if the equations are linear in states and inputs.
    pub linear: bool,
    /// States that no measurement determines: index, guess of the initial value, lower and upper bound.
    pub unmeasured: &'static [(usize, [f64; 3])],
    /// Sampled controller of the plant.
    pub sampled: Option<&'static Sampled>,
}

/// Sampled controller, whose memory are the last states of the plant; it is 0 at the start.
#[derive(Debug)]
pub struct Sampled {
    /// Number of states that are memory.
    pub memory: usize,
    /// Samples of the record from one instant to the next.
    pub every: usize,
    /// Time from an instant to the change of the memory, in sample times of the record: 0.5, so that it is a whole
    /// number of steps.
    pub delay: f64,
    /// Writes the next values of the memory; without terms at places.
    pub next: Rates,
}

/// None of the properties.
pub const PLAIN: Traits = Traits {
    mass: None,
    spring: None,
    coupling: None,
    levels: false,
    thermal: false,
    linear: false,
    unmeasured: &[],
    sampled: None,
};

/// Measured state.
#[derive(Debug, Clone, Copy)]
pub struct Output {
    /// Index of the state.
    pub state: usize,
    /// Standard deviation of the white noise, in the unit of the state.
    pub noise: f64,
    /// Quantisation step, 0 for none.
    pub lsb: f64,
}

/// Place where the equations may lack a term.
#[derive(Debug, Clone, Copy)]
pub enum Place {
    /// Second-order coordinate.
    Joint {
        /// Index of the position.
        q: usize,
        /// Index of the speed, whose equation contains the term.
        v: usize,
        /// Position about which springs are symmetric.
        rest: f64,
        /// True if the position is an angle in rad.
        angle: bool,
        /// True if the baseline model has viscous friction here.
        damped: bool,
        /// True if the baseline model has a linear spring here.
        sprung: bool,
    },
    /// First-order state.
    Process {
        /// Index of the state.
        x: usize,
    },
}

impl Place {
    /// Returns the index of the state that names the place.
    pub fn state(&self) -> usize {
        match *self {
            Self::Joint { q, .. } => q,
            Self::Process { x } => x,
        }
    }

    /// Returns the index of the state whose equation contains the term.
    pub fn equation(&self) -> usize {
        match *self {
            Self::Joint { v, .. } => v,
            Self::Process { x } => x,
        }
    }
}

/// Positive parameter of the baseline model.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Name in the study file.
    pub name: &'static str,
    /// Unit in the study file.
    pub unit: &'static str,
    /// Value around which true values are drawn.
    pub nominal: f64,
}

/// Experiment before its simulation.
#[derive(Debug, Clone)]
pub struct Setup {
    /// Sample time, s.
    pub dt: f64,
    /// Number of samples.
    pub samples: usize,
    /// True initial state.
    pub start: Vec<f64>,
    /// Value of each input from each sample on (zero-order hold).
    pub inputs: Vec<Vec<f64>>,
}

impl Setup {
    /// Returns the time of the last sample, s.
    pub fn duration(&self) -> f64 {
        self.dt * (self.samples - 1) as f64
    }
}

impl Plant {
    /// Returns the number of states that are not the memory of a controller.
    pub fn continuous(&self) -> usize {
        self.states.len() - self.traits.sampled.map_or(0, |sampled| sampled.memory)
    }

    /// Returns the output that measures a state.
    pub fn output_of(&self, state: usize) -> Option<usize> {
        self.outputs.iter().position(|output| output.state == state)
    }

    /// Returns the speed that belongs to the position of a joint.
    pub fn speed_of(&self, state: usize) -> Option<usize> {
        self.places.iter().find_map(|place| match *place {
            Place::Joint { q, v, .. } if q == state => Some(v),
            _ => None,
        })
    }
}
