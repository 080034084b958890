//! Tasks: what a study is solved or examined for, and the facts that the core needs of each.
//!
//! A task is performed, and its result is shown, above the core.

mod calibration;
mod checks;
mod design;
mod diagnosis;
mod excitation;
mod monte_carlo;
mod pareto;
mod sensitivity;
mod sweep;
mod worst_case;

pub use super::valid::{Place, Task, TaskOptions, TaskSpec};
pub use calibration::{CalibrationTask, Chosen, UncertaintyTask};
pub use design::{DesignTask, RobustTask};
pub use diagnosis::DiagnosisTask;
pub use excitation::{ExcitationQuestion, ExcitationTask, Regression, RegressionOptions};
pub use monte_carlo::MonteCarloTask;
pub use pareto::ParetoTask;
pub use sensitivity::{SensitivityMethod, SensitivityTask};
pub use sweep::{Axis, AxisOptions, SweepTask};
pub use worst_case::WorstCaseTask;
