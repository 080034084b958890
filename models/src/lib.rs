//! Simulation kernel and models of mops, one file per model.

pub mod equations;
mod from_fn;
pub mod furuta;
pub mod furuta_2_joint;
pub mod furuta_3_joint;
pub mod furuta_linear;
pub mod furuta_state_feedback;
pub mod kernel;
mod linear_system;
pub mod pid_loop;
pub mod pid_open_loop;
mod rational;
pub mod state_space;
pub mod transfer_function;
mod with_effects;

use mops_core::catalogue::ModelKind;

pub use from_fn::{FnModel, from_fn};
pub use with_effects::{Along, Moment, Sliding, Tick, WithEffects};

/// Returns all kinds of models. To add a model, write its file and add a line here.
pub fn kinds() -> Vec<ModelKind> {
    vec![
        ModelKind::of::<pid_loop::PidLoopOptions>(),
        ModelKind::of::<furuta::FurutaOptions>(),
        ModelKind::of::<pid_open_loop::PidOpenLoopOptions>(),
        ModelKind::of::<transfer_function::TransferFunctionOptions>(),
        ModelKind::of::<state_space::StateSpaceOptions>(),
        ModelKind::of::<furuta_2_joint::Furuta2JointOptions>(),
        ModelKind::of::<furuta_3_joint::Furuta3JointOptions>(),
        ModelKind::of::<furuta_linear::FurutaLinearOptions>(),
        ModelKind::of::<furuta_state_feedback::FurutaStateFeedbackOptions>(),
        ModelKind::of::<equations::EquationsOptions>(),
    ]
}
