//! A case: one situation in which every criterion is evaluated.

use crate::cancellation::Cancellation;
use crate::experiment::{Experiment, Input, Role};

/// A set of parameter values, inputs and, in an identification, a measurement.
#[derive(Debug, Clone, Default)]
pub struct Case {
    /// Name, unique in the study.
    pub name: String,
    /// Values of parameters that hold in this case, in the models' units.
    pub parameters: Vec<(String, f64)>,
    /// Inputs that are not zero, by name, in the models' units. In a window of a record they hold what was before at negative
    /// times, for actuators that remember or come late.
    pub inputs: Vec<(String, Input)>,
    /// What was measured.
    pub experiment: Option<Experiment>,
    /// End of the simulation, s; the models' own where absent.
    pub horizon: Option<f64>,
    /// What a clock shows at time 0, s: not 0 in a window of a record, for effects that depend on time.
    pub begins: f64,
    /// Asks the simulations of this case to end.
    pub cancellation: Cancellation,
}

impl Case {
    /// The input of that name, if something drives it.
    pub fn input(&self, name: &str) -> Option<&Input> {
        self.inputs.iter().find(|(key, _)| key == name).map(|(_, input)| input)
    }

    /// What the case is used for: cases without a measurement count as calibration.
    pub fn role(&self) -> Role {
        self.experiment.as_ref().map_or(Role::Calibration, |experiment| experiment.role)
    }
}
