//! Solvers of mops: one file each, behind one seam ([`mops_core::Solver`]).

mod active_set;
mod argmin_adapter;
pub mod auto;
pub mod epigraph;
pub mod levenberg_marquardt;
mod multistart;
pub mod nelder_mead;
mod pareto;
pub mod particle_swarm;
pub mod pattern_search;
mod penalty;
mod rows;
pub mod sqp;
mod start;

use mops_core::SolverKind;

pub use pareto::certify;

/// Every kind of solver, the default first. A new one is a file, and a line here.
pub fn kinds() -> Vec<SolverKind> {
    vec![
        SolverKind::of::<auto::AutoOptions>(),
        SolverKind::of::<sqp::SqpOptions>(),
        SolverKind::of::<pattern_search::PatternSearchOptions>(),
        SolverKind::of::<levenberg_marquardt::LevenbergMarquardtOptions>(),
        SolverKind::of::<nelder_mead::NelderMeadOptions>(),
        SolverKind::of::<particle_swarm::ParticleSwarmOptions>(),
    ]
}
