//! Runs a solver of mops under argmin's executor: a problem with argmin's traits, bounds, and CMA-ES with restarts.

use argmin::core::{CostFunction, Error, Executor, State};
use mops::{
    math,
    solvers::{argmin_solver::ArgminSolver, cma_es::CmaEsOptions},
};

/// Rastrigin's function: about `10^n` local minima, with the global minimum 0 at the origin.
struct Rastrigin;

impl CostFunction for Rastrigin {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, x: &Vec<f64>) -> Result<f64, Error> {
        Ok(x.iter().map(|x| x * x + 10.0 * (1.0 - math::cos(std::f64::consts::TAU * x))).sum())
    }
}

/// Returns the best point, its cost, and the number of evaluations of the cost.
pub fn solve() -> Result<(Vec<f64>, f64, u64), Error> {
    let solver = ArgminSolver::new(&CmaEsOptions::default(), &[[-5.12, 4.0]; 3]).with_evaluations(20_000);
    let done = Executor::new(Rastrigin, solver)
        .configure(|state| state.param(vec![3.0; 3]).target_cost(1e-8).counting(true))
        .run()?;
    let state = done.state();
    let best = state.get_best_param().cloned().unwrap_or_default();
    Ok((best, state.get_best_cost(), state.get_func_counts()["cost_count"]))
}

#[allow(dead_code)]
fn main() -> Result<(), Error> {
    let (best, cost, evaluations) = solve()?;
    println!("{cost:.2e} at {best:.5?} after {evaluations} evaluations");
    Ok(())
}
