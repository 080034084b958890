//! Particle swarm optimisation of argmin.

use argmin::core::Executor;
use argmin::solver::particleswarm::ParticleSwarm;
use mops_core::{Halt, Oracle, Progress, Shape, Solver, SolverOptions};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::argmin_cost::Cost;

/// Particle swarm optimisation (argmin), a derivative-free global search. It minimises one number per point, the
/// penalised objective, and ends after a number of iterations.
///
/// Source: M. Zambrano-Bigiarini, M. Clerc, R. Rojas, Standard Particle Swarm Optimisation 2011, IEEE CEC (2013).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct ParticleSwarmOptions {
    /// Number of particles.
    #[schemars(range(min = 2, max = 1_000_000))]
    pub particles: usize,
    /// Number of iterations.
    #[schemars(range(min = 1))]
    pub max_iterations: u64,
}

impl Default for ParticleSwarmOptions {
    fn default() -> Self {
        Self { particles: 40, max_iterations: 100 }
    }
}

impl SolverOptions for ParticleSwarmOptions {
    const KIND: &'static str = "particle-swarm";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(Swarm { options: self.clone() })
    }
}

struct Swarm {
    options: ParticleSwarmOptions,
}

impl Solver for Swarm {
    fn accepts(&self, _: &Shape) -> Result<(), String> {
        Ok(())
    }

    fn begin(&mut self, _: &mut dyn Oracle, _: &[f64]) -> Result<(), Halt> {
        Ok(())
    }

    /// Runs argmin to its end in one step.
    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let n = oracle.shape().dimension();
        if n == 0 {
            return Ok(Progress::Converged);
        }
        let random = oracle.stream("particle-swarm");
        // argmin's default factors, without its logarithm, whose last digit depends on the processor.
        let attraction = 0.5 + std::f64::consts::LN_2;
        let Ok(method) = ParticleSwarm::new((vec![0.0; n], vec![1.0; n]), self.options.particles)
            .with_rng_generator(random)
            .with_inertia_factor(0.5 / std::f64::consts::LN_2)
            .and_then(|method| method.with_cognitive_factor(attraction))
            .and_then(|method| method.with_social_factor(attraction))
        else {
            return Ok(Progress::Stalled);
        };
        let cost = Cost::new(oracle, None);
        let run = Executor::new(&cost, method).configure(|state| state.max_iters(self.options.max_iterations)).run();
        match (cost.halt(), run) {
            (Some(halt), _) => Err(halt),
            // A swarm has no optimality test.
            _ => Ok(Progress::Stalled),
        }
    }
}
