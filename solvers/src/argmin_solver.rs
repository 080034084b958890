//! Solvers of mops for argmin's executor.

use std::collections::HashMap;

use argmin::core::{CostFunction, Error, IterState, KV, Problem, State as _, TerminationReason};
use mops_core::{
    Evaluation, Halt, Merit, Oracle, Progress, Shape, Solver, SolverOptions, Usage,
    solver::{Differences, Linearisation},
};
use mops_math::{Stream, stream};

/// Solver of mops as argmin's `Solver`, for problems with a [`CostFunction`] of real variables in a box.
///
/// An iteration of the executor is one [`Solver::step`], which may evaluate many points. A point whose cost is not
/// finite has failed and ranks below every other point. No point is evaluated twice. Gradients are finite differences.
///
/// ```
/// use argmin::core::{CostFunction, Error, Executor, State};
/// use mops_solvers::argmin_solver::ArgminSolver;
/// use mops_solvers::cma_es::CmaEsOptions;
///
/// struct Rosenbrock;
/// impl CostFunction for Rosenbrock {
///     type Param = Vec<f64>;
///     type Output = f64;
///     fn cost(&self, x: &Vec<f64>) -> Result<f64, Error> {
///         Ok((1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2))
///     }
/// }
///
/// let solver = ArgminSolver::new(&CmaEsOptions::default(), &[[-2.0, 2.0]; 2]).with_evaluations(3000);
/// let done = Executor::new(Rosenbrock, solver).configure(|state| state.param(vec![-1.2, 1.0])).run()?;
/// assert!(done.state().get_best_cost() < 1e-8);
/// # Ok::<(), Error>(())
/// ```
pub struct ArgminSolver {
    solver: Box<dyn Solver>,
    kind: &'static str,
    data: ProblemData,
}

/// Problem data and cached cost values.
struct ProblemData {
    bounds: Vec<[f64; 2]>,
    shape: Shape,
    seed: u64,
    /// Maximum number of evaluated points.
    evaluations: usize,
    noise: f64,
    best: Option<Evaluation>,
    cache: HashMap<Vec<u64>, f64>,
    /// Error returned by the cost function, if any.
    error: Option<Error>,
}

impl ArgminSolver {
    /// Creates a solver from its options and the lower and upper bound of every variable.
    ///
    /// # Panics
    /// If a bound is not finite, or a lower bound exceeds its upper bound.
    pub fn new<S: SolverOptions>(options: &S, bounds: &[[f64; 2]]) -> Self {
        let is_valid = |[low, high]: &[f64; 2]| low.is_finite() && high.is_finite() && low <= high;
        assert!(
            bounds.iter().all(is_valid),
            "every bound must be finite, and no lower bound may exceed its upper bound"
        );
        let shape = Shape { spacing: vec![0.0; bounds.len()], rows: vec![(Usage::Minimise, 1.0)], ..Shape::default() };
        let data = ProblemData {
            bounds: bounds.to_vec(),
            shape,
            seed: 1,
            evaluations: usize::MAX,
            noise: 1e-14,
            best: None,
            cache: HashMap::new(),
            error: None,
        };
        Self { solver: options.build(), kind: S::KIND, data }
    }

    /// Sets the random seed (default: 1).
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.data.seed = seed;
        self
    }

    /// Limits the number of cost evaluations.
    #[must_use]
    pub fn with_evaluations(mut self, evaluations: usize) -> Self {
        self.data.evaluations = evaluations;
        self
    }

    /// Sets the relative noise level of the cost, from which the difference step follows (default: 1e-14).
    #[must_use]
    pub fn with_noise(mut self, noise: f64) -> Self {
        self.data.noise = noise;
        self
    }

    /// Returns the state with the best point so far.
    fn with_best(&self, state: IterState<Vec<f64>, (), (), (), (), f64>) -> IterState<Vec<f64>, (), (), (), (), f64> {
        match &self.data.best {
            Some(best) => state.param(best.tuners.clone()).cost(best.merit.objective),
            None => state,
        }
    }

    /// Returns the reason for termination: an error of the cost function, or the budget.
    fn termination(&mut self) -> Result<TerminationReason, Error> {
        match self.data.error.take() {
            Some(error) => Err(error),
            None => Ok(TerminationReason::SolverExit("evaluation budget exhausted".into())),
        }
    }
}

type State = IterState<Vec<f64>, (), (), (), (), f64>;

impl<O: CostFunction<Param = Vec<f64>, Output = f64>> argmin::core::Solver<O, State> for ArgminSolver {
    fn name(&self) -> &str {
        self.kind
    }

    fn init(&mut self, problem: &mut Problem<O>, mut state: State) -> Result<(State, Option<KV>), Error> {
        self.solver.accepts(&self.data.shape).map_err(Error::msg)?;
        let start =
            state.take_param().ok_or_else(|| Error::msg("no initial guess; add `configure(|s| s.param(..))`"))?;
        if start.len() != self.data.bounds.len() {
            return Err(Error::msg(format!(
                "expected one pair of bounds per variable, found {} variables and {} pairs of bounds",
                start.len(),
                self.data.bounds.len()
            )));
        }
        let start = self.data.point_of(&start);
        self.data.best = None;
        self.data.cache.clear();
        let started = self.solver.begin(&mut ArgminOracle { problem, data: &mut self.data }, &start);
        let state = self.with_best(state);
        Ok(match started {
            Ok(()) => (state, None),
            Err(_) => (state.terminate_with(self.termination()?), None),
        })
    }

    fn next_iter(&mut self, problem: &mut Problem<O>, state: State) -> Result<(State, Option<KV>), Error> {
        let progress = self.solver.step(&mut ArgminOracle { problem, data: &mut self.data });
        let state = self.with_best(state);
        let state = match progress {
            Ok(Progress::Continue) => state,
            Ok(Progress::Converged) => state.terminate_with(TerminationReason::SolverConverged),
            Ok(Progress::Stalled) => {
                state.terminate_with(TerminationReason::SolverExit("no further improvement".into()))
            }
            Err(_) => state.terminate_with(self.termination()?),
        };
        Ok((state, None))
    }
}

impl ProblemData {
    fn point_of(&self, x: &[f64]) -> Vec<f64> {
        let position = |(x, [low, high]): (&f64, &[f64; 2])| {
            if high > low { ((x - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 }
        };
        x.iter().zip(&self.bounds).map(position).collect()
    }

    fn values_at(&self, point: &[f64]) -> Vec<f64> {
        let value = |(u, [low, high]): (&f64, &[f64; 2])| (low + u * (high - low)).clamp(*low, *high);
        point.iter().zip(&self.bounds).map(value).collect()
    }
}

/// Oracle of a mops solver, backed by an argmin problem.
struct ArgminOracle<'a, O> {
    problem: &'a mut Problem<O>,
    data: &'a mut ProblemData,
}

impl<O: CostFunction<Param = Vec<f64>, Output = f64>> ArgminOracle<'_, O> {
    fn cost(&mut self, values: &Vec<f64>) -> Result<f64, Halt> {
        // Adding 0.0 maps -0.0 to 0.0.
        let key: Vec<u64> = values.iter().map(|x| (x + 0.0).to_bits()).collect();
        if let Some(&cost) = self.data.cache.get(&key) {
            return Ok(cost);
        }
        if self.data.cache.len() >= self.data.evaluations {
            return Err(Halt::Budget);
        }
        let cost = self.problem.cost(values).map_err(|error| {
            self.data.error = Some(error);
            Halt::Interrupted
        })?;
        self.data.cache.insert(key, cost);
        Ok(cost)
    }
}

impl<O: CostFunction<Param = Vec<f64>, Output = f64>> Oracle for ArgminOracle<'_, O> {
    fn shape(&self) -> &Shape {
        &self.data.shape
    }

    fn evaluate(&mut self, points: &[Vec<f64>]) -> Result<Vec<Evaluation>, Halt> {
        let mut answers = Vec::with_capacity(points.len());
        for point in points {
            let tuners = self.data.values_at(point);
            let scaled = Some(vec![self.cost(&tuners)?]).filter(|scaled| scaled[0].is_finite());
            let merit = scaled.as_ref().map_or(Merit::FAILED, |scaled| self.data.shape.merit(scaled));
            let (readings, residuals, failures) = (Vec::new(), Vec::new(), Vec::new());
            let answer = Evaluation { point: point.clone(), tuners, readings, scaled, residuals, failures, merit };
            if self.data.best.as_ref().is_none_or(|best| merit.is_better_than(&best.merit)) {
                self.data.best = Some(answer.clone());
            }
            answers.push(answer);
        }
        Ok(answers)
    }

    fn linearise(&mut self, point: &[f64], reach: f64) -> Result<Option<Linearisation>, Halt> {
        Differences::of_noise(self.data.noise).linearise(self, point, reach)
    }

    fn best(&self) -> Option<&Evaluation> {
        self.data.best.as_ref()
    }

    /// argmin counts iterations only.
    fn remaining(&self) -> usize {
        usize::MAX
    }

    fn stream(&self, label: &str) -> Stream {
        stream(self.data.seed, label)
    }
}

#[cfg(test)]
mod tests {
    use argmin::core::Executor;
    use mops_math as math;

    use super::*;
    use crate::nelder_mead::NelderMeadOptions;
    use crate::pattern_search::PatternSearchOptions;
    use crate::sqp::SqpOptions;

    /// `(x - 1)^2 + 2 (y + 3)^2`, undefined for `x > 3`. In the box `[-2, 5]^2` the minimum is 2, at (1, -2).
    struct Bowl;
    impl CostFunction for Bowl {
        type Param = Vec<f64>;
        type Output = f64;

        fn cost(&self, x: &Vec<f64>) -> Result<f64, Error> {
            assert!(x.iter().all(|x| (-2.0..=5.0).contains(x)), "{x:?}");
            Ok(if x[0] > 3.0 { f64::NAN } else { math::powi(x[0] - 1.0, 2) + 2.0 * math::powi(x[1] + 3.0, 2) })
        }
    }

    fn minimise<S: SolverOptions>(options: &S) -> (Vec<f64>, u64) {
        let solver = ArgminSolver::new(options, &[[-2.0, 5.0]; 2]).with_evaluations(2000);
        let done =
            Executor::new(Bowl, solver).configure(|state| state.param(vec![2.5, 4.0]).counting(true)).run().unwrap();
        (done.state().best_param.clone().unwrap(), done.state().get_func_counts()["cost_count"])
    }

    #[test]
    fn solvers_find_a_minimum_on_a_bound() {
        for (x, count) in [
            minimise(&SqpOptions::default()),
            minimise(&PatternSearchOptions::default()),
            minimise(&NelderMeadOptions::default()),
        ] {
            assert!((x[0] - 1.0).abs() < 1e-3 && (x[1] + 2.0).abs() < 1e-3 && count <= 2000, "{x:?} {count}");
        }
    }

    #[test]
    fn an_error_of_the_cost_function_ends_the_run() {
        struct Broken;
        impl CostFunction for Broken {
            type Param = Vec<f64>;
            type Output = f64;

            fn cost(&self, x: &Vec<f64>) -> Result<f64, Error> {
                if x[0] < 0.5 { Err(Error::msg("no sensor")) } else { Ok(x[0]) }
            }
        }
        let solver = ArgminSolver::new(&PatternSearchOptions::default(), &[[0.0, 1.0]]);
        let run = Executor::new(Broken, solver).configure(|state| state.param(vec![0.9])).run();
        assert!(run.err().is_some_and(|error| error.to_string().contains("no sensor")));
    }
}
