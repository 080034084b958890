//! The simulation kernel of mops, and its models: one file each.

pub mod furuta;
pub mod kernel;
mod linear_system;
pub mod pid_loop;
pub mod pid_open_loop;
mod plant;
pub mod state_space;
pub mod transfer_function;

use mops_core::ModelKind;

/// Every kind of model. A new one is a file, and a line here.
pub fn kinds() -> Vec<ModelKind> {
    vec![
        ModelKind::of::<pid_loop::PidLoopOptions>(),
        ModelKind::of::<furuta::FurutaOptions>(),
        ModelKind::of::<pid_open_loop::PidOpenLoopOptions>(),
        ModelKind::of::<transfer_function::TransferFunctionOptions>(),
        ModelKind::of::<state_space::StateSpaceOptions>(),
    ]
}

#[cfg(test)]
mod linear_tests;
#[cfg(test)]
mod tests;
