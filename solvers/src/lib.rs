//! Solvers of mops, one file each, behind the trait [`mops_core::Solver`].

mod active_set;
#[cfg(feature = "argmin")]
mod argmin_cost;
#[cfg(feature = "argmin")]
pub mod argmin_solver;
pub mod auto;
mod chaining;
mod cholesky;
pub mod cma_es;
mod confirmation;
pub mod differential_evolution;
pub mod epigraph;
pub mod evolution;
pub mod genetic;
#[cfg(feature = "argmin")]
pub mod l_bfgs;
pub mod levenberg_marquardt;
mod linearised_criteria;
mod local_archive;
mod multimethod;
mod multistart;
#[cfg(feature = "argmin")]
pub mod nelder_mead;
mod noise_detection;
pub mod nsga2;
pub mod nsga3;
mod optimality;
#[cfg(feature = "argmin")]
pub mod particle_swarm;
pub mod pattern_search;
mod penalty;
mod polishing;
mod population;
mod quasi_newton;
mod ranking;
mod simplex_lattice;
pub mod simulated_annealing;
pub mod sqp;
mod start;
mod variation;
pub mod weighted_chebyshev;

use mops_core::catalogue::SolverKind;

/// Names that the definition of a solver needs, to be imported at once.
pub mod prelude {
    pub use mops_core::{
        Evaluation, Halt, Merit, Objective, Oracle, Progress, Shape, Solver, SolverOptions, Stop,
        catalogue::SolverKind, solver::Linearisation,
    };
    pub use mops_math::Stream;
}

pub use optimality::{Certificate, certificate, optimality};
pub use weighted_chebyshev::remove_slack;

/// Returns every kind of solver, the default first. A new kind is one file and one line here.
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
