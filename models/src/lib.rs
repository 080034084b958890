//! The simulation kernel of mops, and its models: one file each.

pub mod equations;
pub mod furuta;
pub mod furuta_2_joint;
pub mod furuta_3_joint;
pub mod furuta_linear;
pub mod furuta_state_feedback;
pub mod kernel;
pub mod pid_loop;
mod plant;

use mops_core::ModelKind;

/// Every kind of model. A new one is a file, and a line here.
pub fn kinds() -> Vec<ModelKind> {
    vec![
        ModelKind::of::<pid_loop::PidLoopOptions>(),
        ModelKind::of::<furuta::FurutaOptions>(),
        ModelKind::of::<furuta_2_joint::Furuta2JointOptions>(),
        ModelKind::of::<furuta_3_joint::Furuta3JointOptions>(),
        ModelKind::of::<furuta_linear::FurutaLinearOptions>(),
        ModelKind::of::<furuta_state_feedback::FurutaStateFeedbackOptions>(),
        ModelKind::of::<equations::EquationsOptions>(),
    ]
}

#[cfg(test)]
mod tests;
