//! Cases: situations in which every criterion is evaluated.

pub mod band_limited;
mod experiment;
mod input;

pub use experiment::{Channel, Experiment, ResponseData, Role};
pub use input::{Chirp, Hold, Input, PRBS_STAGES};

use crate::cancellation::Cancellation;

/// A set of parameter values, inputs and, in an identification, a measurement.
#[derive(Debug, Clone, Default)]
pub struct Case {
    /// Name, unique in the study.
    pub name: String,
    /// Parameter values of this case, in the units of the models.
    pub parameters: Vec<(String, f64)>,
    /// Inputs that are not zero, by name, in the units of the models. In a window of a record, negative times contain
    /// the input before the window, for actuators with memory or delay.
    pub inputs: Vec<(String, Input)>,
    /// Disturbances of balances, by the state whose equation contains them: external forces, each as the rate that it
    /// adds to the state at the beginning of the simulation, in the unit of that rate. So a disturbance does not depend
    /// on the inertia. Only models with open equations and effects read them; all others refuse them.
    pub disturbances: Vec<(String, Input)>,
    /// Measurement, if there is one.
    pub experiment: Option<Experiment>,
    /// End of the simulation, s; `None` for the horizon of the model.
    pub horizon: Option<f64>,
    /// Clock time at time 0, s: not 0 in a window of a record, for time-dependent effects.
    pub begins: f64,
    /// Cancellation of the simulations of this case.
    pub cancellation: Cancellation,
}

impl Case {
    /// Returns the input with this name, if it is driven.
    pub fn input(&self, name: &str) -> Option<&Input> {
        self.inputs.iter().find(|(key, _)| key == name).map(|(_, input)| input)
    }

    /// Returns the role of the case: cases without a measurement count as calibration.
    pub fn role(&self) -> Role {
        self.experiment.as_ref().map_or(Role::Calibration, |experiment| experiment.role)
    }
}
