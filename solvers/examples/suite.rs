//! Solves a suite with a solver: `suite bbob cma-es 5000` gives every problem 5000 evaluations per variable.

use std::time::Instant;

use mops_core::{Budget, Oracle, Run};
use mops_problems::{Posed, Slope};

#[allow(clippy::cast_precision_loss)]
fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [suite, kind, budget, rest @ ..] = arguments.as_slice() else {
        panic!("suite NAME KIND EVALUATIONS-PER-VARIABLE [SEED]")
    };
    let budget: usize = budget.parse().expect("a number of evaluations");
    let seed = rest.first().map_or(1, |seed| seed.parse().expect("a seed"));
    let suite = mops_problems::suites().into_iter().find(|s| s.name == *suite).expect("a suite");
    let kind = mops_solvers::kinds().into_iter().find(|k| k.name == *kind).expect("a kind of solver");
    let began = Instant::now();
    let (mut solved, mut count) = (0, 0);
    for problem in (suite.problems)() {
        let posed = Posed::new(&problem, Slope::Differences).with_seed(seed);
        let mut run = Run::new(&posed, Budget { evaluations: budget * problem.dimension() }, &());
        let stop = run.solve(kind.default_choice().make().as_mut(), &posed.start());
        let merit = run.best().expect("the start").merit;
        let gap = problem.gap(merit.objective).unwrap_or(f64::NAN);
        let ok = gap <= suite.accuracy && merit.is_feasible();
        let first =
            run.archive().iter().position(|r| problem.gap(r.merit.objective).is_some_and(|g| g <= suite.accuracy));
        count += 1;
        solved += usize::from(ok);
        let at = first.map_or(String::new(), |at| format!(" at {}", at + 1));
        println!("{:24} {:9} {gap:10.2e} {stop:?}{at}", problem.name, if ok { "solved" } else { "-" });
    }
    println!("{solved} of {count} solved, {:.1} s", began.elapsed().as_secs_f64());
}
