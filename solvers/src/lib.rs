//! Solvers of mops: one file each, behind one seam ([`mops_core::Solver`]).

mod active_set;
#[cfg(feature = "argmin")]
mod argmin_adapter;
pub mod auto;
pub mod cma_es;
mod definite;
pub mod differential_evolution;
mod directions;
pub mod epigraph;
pub mod evolution;
#[cfg(feature = "argmin")]
pub mod for_argmin;
pub mod genetic;
#[cfg(feature = "argmin")]
pub mod l_bfgs;
pub mod levenberg_marquardt;
mod multistart;
#[cfg(feature = "argmin")]
pub mod nelder_mead;
pub mod nsga2;
pub mod nsga3;
mod own;
mod pareto;
#[cfg(feature = "argmin")]
pub mod particle_swarm;
pub mod pattern_search;
mod penalty;
mod population;
mod quasi_newton;
mod ranking;
mod relay;
mod rows;
mod second_opinion;
pub mod simulated_annealing;
pub mod sqp;
mod start;
mod texture;
mod variation;
pub mod weighted_chebyshev;

use mops_core::SolverKind;

pub use pareto::{Certificate, certificate, certify};

/// Every kind of solver, the default first. A new one is a file, and a line here.
pub fn kinds() -> Vec<SolverKind> {
    vec![
        SolverKind::of::<auto::AutoOptions>(),
        SolverKind::of::<sqp::SqpOptions>(),
        SolverKind::of::<pattern_search::PatternSearchOptions>(),
        SolverKind::of::<cma_es::CmaEsOptions>(),
        SolverKind::of::<differential_evolution::DifferentialEvolutionOptions>(),
        SolverKind::of::<genetic::GeneticOptions>(),
        SolverKind::of::<weighted_chebyshev::WeightedChebyshevOptions>(),
        SolverKind::of::<nsga2::Nsga2Options>(),
        SolverKind::of::<nsga3::Nsga3Options>(),
        SolverKind::of::<levenberg_marquardt::LevenbergMarquardtOptions>(),
        #[cfg(feature = "argmin")]
        SolverKind::of::<nelder_mead::NelderMeadOptions>(),
        #[cfg(feature = "argmin")]
        SolverKind::of::<particle_swarm::ParticleSwarmOptions>(),
        SolverKind::of::<simulated_annealing::SimulatedAnnealingOptions>(),
        #[cfg(feature = "argmin")]
        SolverKind::of::<l_bfgs::LBfgsOptions>(),
    ]
}
