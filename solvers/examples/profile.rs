//! Data profiles: `profile more-wild pattern-search` prints the share of problems solved within 10, 30 and 100 simplex
//! gradients (`n + 1` evaluations each). Solved to `tau`: `f(x0) - f >= (1 - tau) (f(x0) - f_L)`, where `f_L` is the least
//! value that this solver or one of the others (sqp with exact slopes, cma-es, nelder-mead) finds within 100.
//!
//! Source: J. J. More, S. M. Wild, SIAM J. Optimization 20 (2009) 172-191.

use mops_problems::{Posed, Problem, Slope, measure};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [suite, kind, rest @ ..] = arguments.as_slice() else { panic!("profile SUITE KIND [verbose]") };
    let suite = mops_problems::suites().into_iter().find(|s| s.name == *suite).expect("a suite");
    let problems = (suite.problems)();
    let of = |problem: &Problem, kind: &str, slope: Slope| -> Vec<f64> {
        let kind = mops_solvers::kinds().into_iter().find(|k| k.name == kind).expect("a kind of solver");
        let posed = Posed::new(problem, slope);
        let budget = 100 * (problem.dimension() + 1);
        let found = measure(problem, &posed, &posed.start(), kind.default_choice().make().as_mut(), budget);
        found.history.iter().map(|merit| merit.objective).collect()
    };
    let mut needed = Vec::new();
    for problem in &problems {
        let history = of(problem, kind, Slope::Differences);
        let others = [("sqp", Slope::Exact), ("cma-es", Slope::Differences), ("nelder-mead", Slope::Differences)];
        let values = others.iter().flat_map(|(kind, slope)| of(problem, kind, *slope));
        let least = values.chain(history.iter().copied()).fold(f64::INFINITY, f64::min);
        let gradient = problem.dimension() + 1;
        let to = |tau: f64| {
            let limit = history[0] - (1.0 - tau) * (history[0] - least);
            history.iter().position(|f| *f <= limit).map_or(usize::MAX, |at| (at + 1).div_ceil(gradient))
        };
        needed.push([to(1e-3), to(1e-5)]);
        if !rest.is_empty() {
            let own = history.iter().copied().fold(f64::INFINITY, f64::min);
            println!("{:16} {:?} {own:.6e} {least:.6e} {}", problem.name, needed[needed.len() - 1], history.len());
        }
    }
    #[allow(clippy::cast_precision_loss)]
    let share = |tau: usize, gradients: usize| {
        needed.iter().filter(|needed| needed[tau] <= gradients).count() as f64 / needed.len() as f64
    };
    for (tau, name) in [(0, "1e-3"), (1, "1e-5")] {
        println!("{name}: {:.2} / {:.2} / {:.2}", share(tau, 10), share(tau, 30), share(tau, 100));
    }
}
