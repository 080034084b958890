//! The simulation kernel of mops, and its models: one file each.

pub mod equations;
pub mod furuta;
pub mod kernel;
pub mod pid_loop;

use mops_core::ModelKind;

/// Every kind of model. A new one is a file, and a line here.
pub fn kinds() -> Vec<ModelKind> {
    vec![
        ModelKind::of::<pid_loop::PidLoopOptions>(),
        ModelKind::of::<furuta::FurutaOptions>(),
        ModelKind::of::<equations::EquationsOptions>(),
    ]
}

#[cfg(test)]
mod tests;
