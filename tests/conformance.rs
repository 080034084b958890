//! Properties that every solver of the catalogue must have.

#[path = "common/function.rs"]
mod function;

use std::sync::Arc;

use mops::{
    Analysis, Case, Criterion, CriterionBuilder, CriterionSpec, Interface, Objective, SolverKind, Study, StudyBuilder,
    StudyError, TunerBuilder, Unit, Usage, Value, Watch,
    core::{Oracle, Problem, Run, Stop, run::Budget},
};

use function::{End, Function};
use mops_math as math;

/// Study of `f` over the box [-2, 2]^n with the initial guess 1.5 and one usage per value.
fn study(n: usize, usages: &[Usage], f: fn(&[f64]) -> Option<Vec<f64>>) -> Study {
    study_of(Objective::Max, n, usages, f)
}

/// The problem with a scalar objective, and as a multi-objective one. Solvers for fronts accept only the second.
fn problems(n: usize, usages: &[Usage], f: fn(&[f64]) -> Option<Vec<f64>>) -> [Problem; 2] {
    [Objective::Max, Objective::Each].map(|objective| Problem::new(Arc::new(study_of(objective, n, usages, f))))
}

fn study_of(objective: Objective, n: usize, usages: &[Usage], f: fn(&[f64]) -> Option<Vec<f64>>) -> Study {
    draft_of(objective, n, usages, f).build().unwrap()
}

fn draft_of(objective: Objective, n: usize, usages: &[Usage], f: fn(&[f64]) -> Option<Vec<f64>>) -> StudyBuilder {
    let name = |prefix: &str, i: usize| format!("{prefix}{i}");
    let parameters: Vec<String> = (0..n).map(|j| name("x", j)).collect();
    let function = Function::new(&parameters.iter().map(String::as_str).collect::<Vec<_>>(), usages.len(), f);
    StudyBuilder {
        name: "function".into(),
        objective: Some(objective),
        models: vec![("function".into(), function.into())],
        tuners: (0..n).map(|j| (name("x", j), TunerBuilder::new(1.5, -2.0, 2.0))).collect(),
        criteria: usages
            .iter()
            .enumerate()
            .map(|(i, usage)| (name("c", i), CriterionBuilder::minimise(End(name("f", i)), 1.0).used_as(*usage)))
            .collect(),
        ..StudyBuilder::default()
    }
}

/// Sum of squares with its residuals: line `x0 t + x1` against the data `2 t + 0.5`.
#[derive(Clone)]
struct Line;

impl CriterionSpec for Line {
    fn bind(&self, _: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        Ok(Box::new(self.clone()))
    }
}

impl Criterion for Line {
    fn unit(&self) -> Unit {
        Unit::one()
    }
    fn signals(&self) -> Vec<String> {
        vec!["f0".into(), "f1".into()]
    }
    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        let (slope, offset) = (analysis.trace("f0").last(), analysis.trace("f1").last());
        let residual = |i: u32| {
            let t = f64::from(i) / 10.0;
            slope * t + offset - (2.0 * t.min(1.5) + 0.5)
        };
        Ok(Value::sum_of_squares((0..30).map(residual).collect()))
    }
}

/// Least-squares problem in two tuners; simulations fail where `f` has no value.
fn line(f: fn(&[f64]) -> Option<Vec<f64>>) -> Problem {
    let study = StudyBuilder {
        name: "line".into(),
        task: mops::Task::calibration(),
        models: vec![("function".into(), Function::new(&["x0", "x1"], 2, f).into())],
        tuners: ["x0", "x1"].map(|name| (name.into(), TunerBuilder::new(-1.5, -2.0, 2.0))).into(),
        criteria: vec![("line".into(), CriterionBuilder::minimise(Line, 1.0))],
        ..StudyBuilder::default()
    };
    Problem::new(Arc::new(study.build().unwrap()))
}

/// Pairs each problem with the solvers that accept it; solvers for fronts get the second problem only.
fn both(problems: [Problem; 2]) -> Vec<(Arc<Problem>, SolverKind)> {
    let [one, front] = problems.map(Arc::new);
    let ordinary = solvers(&one);
    let mut for_fronts = solvers(&front);
    for_fronts.retain(|kind| kind.name == "auto" || ordinary.iter().all(|known| known.name != kind.name));
    assert!(for_fronts.len() >= 3, "auto and two others compute fronts");
    let with = |problem: &Arc<Problem>, kinds: Vec<SolverKind>| -> Vec<(Arc<Problem>, SolverKind)> {
        kinds.into_iter().map(|kind| (Arc::clone(problem), kind)).collect()
    };
    [with(&one, ordinary), with(&front, for_fronts)].concat()
}

/// Returns every kind of solver that accepts the problem.
fn solvers(problem: &Problem) -> Vec<SolverKind> {
    let mut kinds = mops::catalogue().solvers;
    kinds.retain(|kind| kind.default_choice().make().accepts(problem.shape()).is_ok());
    assert!(kinds.len() >= 4, "most solvers accept an ordinary problem");
    kinds
}

struct Solved {
    stop: Stop,
    best: mops::core::Evaluation,
    points: Vec<Vec<f64>>,
}

fn solve(problem: &Problem, kind: &SolverKind, evaluations: usize, watch: &dyn Watch) -> Solved {
    let mut run = Run::new(problem, Budget { evaluations }, watch);
    let stop = run.solve(kind.default_choice().make().as_mut(), &problem.start());
    let points = run.archive().iter().map(|record| record.tuners.clone()).collect();
    Solved { stop, best: run.best().unwrap().clone(), points }
}

const MINIMISE: &[Usage] = &[Usage::Minimise, Usage::Minimise];

/// Two parabolas that meet at a kink: the minimum of their maximum is 1.25 at (0.5, 0).
fn kink(x: &[f64]) -> Option<Vec<f64>> {
    let rest: f64 = x[1..].iter().map(|x| x * x).sum();
    Some(vec![math::powi(x[0], 2) + rest + 1.0, math::powi(x[0] - 1.0, 2) + rest + 1.0])
}

/// Smooth criterion with the minimum and the minimiser of [`kink`].
fn bowl(x: &[f64]) -> Option<Vec<f64>> {
    let rest: f64 = x[1..].iter().map(|x| x * x).sum();
    Some(vec![math::powi(x[0] - 0.5, 2) + rest + 1.25])
}

/// Pairs a problem with one criterion with every solver that accepts it.
fn alone(n: usize, f: fn(&[f64]) -> Option<Vec<f64>>) -> Vec<(Arc<Problem>, SolverKind)> {
    let problem = Arc::new(Problem::new(Arc::new(study(n, &[Usage::Minimise], f))));
    solvers(&problem).into_iter().map(|kind| (Arc::clone(&problem), kind)).collect()
}

/// Problem with two criteria that meet at a kink, and one with a smooth criterion; both have the minimum 1.25 at (0.5,
/// 0).
fn ordinary(n: usize) -> Vec<(Arc<Problem>, SolverKind)> {
    [both(problems(n, MINIMISE, kink)), alone(n, bowl)].concat()
}

#[test]
fn no_solver_exceeds_its_budget_or_leaves_the_bounds() {
    for budget in [1, 2, 7, 50] {
        for (problem, kind) in ordinary(3) {
            let solved = solve(&problem, &kind, budget, &());
            assert!(solved.points.len() <= budget, "{}: {}", kind.name, solved.points.len());
            assert!(solved.stop != Stop::Budget || solved.points.len() == budget, "{}", kind.name);
            assert!(solved.points.iter().flatten().all(|x| (-2.0..=2.0).contains(x)), "{}", kind.name);
        }
    }
}

#[test]
fn every_solver_approaches_the_minimum_of_two_criteria_and_of_one() {
    for (problem, kind) in ordinary(2) {
        let found = solve(&problem, &kind, 5000, &()).best.merit.objective;
        assert!((1.25 - 1e-9..1.26).contains(&found), "{}: {found}", kind.name);
    }
}

#[test]
fn same_seed_same_bits_for_any_number_of_threads() {
    for (problem, kind) in ordinary(2) {
        let points = [1, 2].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| solve(&problem, &kind, 300, &()).points)
        });
        assert!(points[0] == points[1], "{}", kind.name);
    }
}

#[test]
fn a_problem_with_failures_in_half_of_the_box_is_still_optimised() {
    // The initial guess (1.5, ...) is in the half that fails.
    let two = both(problems(2, MINIMISE, |x| if x[0] + x[1] > 0.9 { None } else { kink(x) }));
    let one = alone(2, |x| if x[0] + x[1] > 0.9 { None } else { bowl(x) });
    for (problem, kind) in [two, one].concat() {
        let solved = solve(&problem, &kind, 5000, &());
        let found = solved.best.merit.objective;
        assert!(found < 1.3, "{}: {found}", kind.name);
    }
}

#[test]
fn a_problem_that_always_fails_terminates_without_a_point() {
    for (problem, kind) in [both(problems(2, MINIMISE, |_| None)), alone(2, |_| None)].concat() {
        let solved = solve(&problem, &kind, 300, &());
        assert!(solved.best.scaled.is_none(), "{}", kind.name);
    }
}

#[test]
fn a_constant_objective_terminates() {
    let two = both(problems(2, MINIMISE, |_| Some(vec![1.0, 1.0])));
    for (problem, kind) in [two, alone(2, |_| Some(vec![1.0]))].concat() {
        assert_eq!(solve(&problem, &kind, 50_000, &()).best.merit.objective, 1.0, "{}", kind.name);
    }
}

#[test]
fn every_solver_solves_a_problem_with_one_tuner() {
    for (problem, kind) in ordinary(1) {
        let found = solve(&problem, &kind, 5000, &()).best.merit.objective;
        assert!((found - 1.25).abs() < 1e-3, "{}: {found}", kind.name);
    }
}

#[test]
fn without_active_tuners_only_the_initial_guess_is_evaluated() {
    let fixed = [Objective::Max, Objective::Each].map(|objective| {
        let mut fixed = study_of(objective, 1, MINIMISE, kink);
        fixed.fix(0);
        Problem::new(Arc::new(fixed))
    });
    for (problem, kind) in both(fixed) {
        let solved = solve(&problem, &kind, 100, &());
        assert_eq!(solved.points, [[1.5]], "{}", kind.name);
    }
}

#[test]
fn feasible_constraints_are_satisfied() {
    // Minimum of |x|^2 with x0 >= 0.8, written as 1.8 - x0 <= 1.
    let usages = [Usage::Minimise, Usage::Inequality];
    let f = |x: &[f64]| Some(vec![x.iter().map(|x| x * x).sum(), 1.8 - x[0]]);
    for (problem, kind) in both(problems(2, &usages, f)) {
        let best = solve(&problem, &kind, 5000, &()).best;
        assert!(best.merit.is_feasible(), "{}: {:?}", kind.name, best.merit);
        assert!(best.merit.objective < 0.70, "{}: {:?}", kind.name, best.merit);
    }
}

#[test]
fn an_infeasible_problem_ends_near_the_smallest_violation() {
    // x0 >= 1.5 and x0 <= 0.5: the smallest violation is 0.5, at x0 = 1.
    let usages = [Usage::Minimise, Usage::Inequality, Usage::Inequality];
    let f = |x: &[f64]| Some(vec![x[1] * x[1], 2.5 - x[0], 0.5 + x[0]]);
    for (problem, kind) in both(problems(2, &usages, f)) {
        let violation = solve(&problem, &kind, 5000, &()).best.merit.violation;
        assert!((0.5 - 1e-9..0.55).contains(&violation), "{}: {violation}", kind.name);
    }
}

#[test]
fn a_discontinuous_criterion_ends_near_its_minimum() {
    let f = |x: &[f64]| {
        let jump = if x[0] < 0.3 { 1.0 } else { 0.0 };
        Some(vec![x[0] * x[0] + x[1] * x[1] + jump, 0.0])
    };
    // As a single criterion this function has a local minimum beyond the discontinuity, in which a local solver may
    // end; here it has none.
    let leads_back = |x: &[f64]| Some(vec![x[1] * x[1] + if x[0] < 0.3 { 2.3 - x[0] } else { x[0] * x[0] }]);
    for (problem, kind) in [both(problems(2, MINIMISE, f)), alone(2, leads_back)].concat() {
        let found = solve(&problem, &kind, 5000, &()).best.merit.objective;
        assert!(found < 0.2, "{}: {found}", kind.name);
    }
}

#[test]
fn scales_of_1e_minus_12_and_1e12_are_no_obstacle() {
    type Values = fn(&[f64]) -> Option<Vec<f64>>;
    fn scaled(by: f64, f: Values, x: &[f64]) -> Option<Vec<f64>> {
        f(x).map(|f| f.iter().map(|f| by * f).collect())
    }
    let small: [Values; 2] = [|x| scaled(1e-12, kink, x), |x| scaled(1e-12, bowl, x)];
    let large: [Values; 2] = [|x| scaled(1e12, kink, x), |x| scaled(1e12, bowl, x)];
    for ([two, one], scale) in [(small, 1e-12), (large, 1e12)] {
        for (problem, kind) in [both(problems(2, MINIMISE, two)), alone(2, one)].concat() {
            let found = solve(&problem, &kind, 5000, &()).best.merit.objective / scale;
            assert!(found < 1.6, "{} at {scale}: {found}", kind.name);
        }
    }
}

#[test]
fn an_interrupted_solver_returns_the_best_point_so_far() {
    struct Impatient;
    impl Watch for Impatient {
        fn wants_stop(&self) -> bool {
            true
        }
    }
    for (problem, kind) in ordinary(2) {
        let solved = solve(&problem, &kind, 5000, &Impatient);
        assert_eq!(solved.stop, Stop::Interrupted, "{}", kind.name);
        assert!(solved.best.scaled.is_some(), "{}", kind.name);
    }
}

#[test]
fn failures_are_counted_in_the_result() {
    let half = study(2, MINIMISE, |x| if x[0] > 0.9 { None } else { kink(x) });
    let outcome = mops::solve(half, &mops::Options::default(), &()).unwrap().outcome;
    assert!(outcome.worst_scaled < 1.2501, "{}", outcome.worst_scaled);
    assert_eq!((outcome.failures.len(), outcome.failures[0].failure.as_str()), (1, "diverged"));
    assert!(outcome.failures[0].count >= 1);
}

#[test]
fn every_kind_of_solver_takes_part() {
    let design = Problem::new(Arc::new(study(2, MINIMISE, kink)));
    let least_squares = line(|x| Some(x.to_vec()));
    let front = Problem::new(Arc::new(study_of(Objective::Each, 2, MINIMISE, kink)));
    let taking_part = [solvers(&design), solvers(&least_squares), solvers(&front)].concat();
    for kind in mops::catalogue().solvers {
        assert!(taking_part.iter().any(|k| k.name == kind.name), "{}", kind.name);
    }
}

#[test]
fn every_solver_finds_the_least_squares_line_of_the_normal_equations() {
    let problem = line(|x| Some(x.to_vec()));
    // The normal equations of the 30 points, solved by hand.
    let points: Vec<(f64, f64)> = (0..30).map(|i| f64::from(i) / 10.0).map(|t| (t, 2.0 * t.min(1.5) + 0.5)).collect();
    let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|&(t, y)| f(t, y)).sum::<f64>();
    let (n, t, tt, y, ty) = (30.0, sum(&|t, _| t), sum(&|t, _| t * t), sum(&|_, y| y), sum(&|t, y| t * y));
    let slope = (n * ty - t * y) / (n * tt - t * t);
    let offset = (y - slope * t) / n;
    let least = sum(&|t, y| math::powi(slope * t + offset - y, 2));
    for kind in solvers(&problem) {
        let best = solve(&problem, &kind, 5000, &()).best;
        assert!(best.merit.objective <= least * 1.001, "{}: {} {least}", kind.name, best.merit.objective);
        assert!(best.merit.objective >= least * (1.0 - 1e-12), "{}", kind.name);
    }
}

#[test]
fn least_squares_problems_respect_budget_and_bounds_reproduce_bits_and_survive_failures() {
    let problem = line(|x| if x[0] < -1.0 && x[1] < 0.0 { None } else { Some(x.to_vec()) });
    for kind in solvers(&problem) {
        for budget in [1, 3, 40] {
            assert!(solve(&problem, &kind, budget, &()).points.len() <= budget, "{}", kind.name);
        }
        let solved = [1, 2].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| solve(&problem, &kind, 2000, &()))
        });
        assert!(solved[0].points == solved[1].points, "{}", kind.name);
        assert!(solved[0].points.iter().flatten().all(|x| (-2.0..=2.0).contains(x)), "{}", kind.name);
        assert!(solved[0].best.merit.objective < 5.7, "{}: {:?}", kind.name, solved[0].best.merit);
    }
}

#[test]
fn a_monitored_criterion_without_a_value_does_not_affect_the_objective() {
    // The second criterion, a monitor, has no value (NaN) for x0 < 1.
    let f = |x: &[f64]| Some(vec![x[0] * x[0], if x[0] < 1.0 { f64::NAN } else { 0.0 }]);
    let problem = Problem::new(Arc::new(study(1, &[Usage::Minimise, Usage::Monitor], f)));
    let evaluation = problem.evaluate(&[0.5]);
    assert_eq!(evaluation.merit.objective, 0.0);
    assert!(evaluation.readings[1].is_none() && evaluation.failures.len() == 1);
}

#[test]
fn an_integer_tuner_with_five_values_ends_at_the_best_without_repeated_evaluations() {
    // The minimum of (x - 1.3)^2 over -2, -1, 0, 1, 2 is at 1.
    let whole = [Objective::Max, Objective::Each].map(|objective| {
        let mut draft = draft_of(objective, 1, &[Usage::Minimise], |x| Some(vec![math::powi(x[0] - 1.3, 2)]));
        draft.tuners[0].1 = TunerBuilder { integer: true, ..TunerBuilder::new(-2.0, -2.0, 2.0) };
        Problem::new(Arc::new(draft.build().unwrap()))
    });
    for (problem, kind) in both(whole) {
        let solved = solve(&problem, &kind, 5000, &());
        assert!(solved.points.len() <= 5, "{}: no value is evaluated twice", kind.name);
        assert_eq!(solved.best.tuners, [1.0], "{}", kind.name);
    }
}

#[test]
fn the_front_of_a_run_has_no_dominated_point() {
    // Two parabolas along x0: the front is 0 <= x0 <= 1 with the rest 0; x0 >= 0.4 cuts off a part.
    let usages = [Usage::Minimise, Usage::Minimise, Usage::Inequality];
    let f = |x: &[f64]| kink(x).map(|f| vec![f[0], f[1], 1.4 - x[0]]);
    let problem = Problem::new(Arc::new(study_of(Objective::Each, 3, &usages, f)));
    let of_fronts = ["auto", "weighted-chebyshev", "nsga2", "nsga3"];
    for kind in solvers(&problem).into_iter().filter(|kind| of_fronts.contains(&kind.name)) {
        let mut run = Run::new(&problem, Budget { evaluations: 5000 }, &());
        run.solve(kind.default_choice().make().as_mut(), &problem.start());
        let front: Vec<&[f64]> = run.front().iter().map(|&i| run.archive()[i].objectives.as_slice()).collect();
        let least = if kind.name.starts_with("nsga") { 50 } else { 30 };
        assert!(front.len() >= least, "{}: {}", kind.name, front.len());
        let better = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| a <= b) && a != b;
        assert!(front.iter().all(|a| !front.iter().any(|b| better(b, a))), "{}", kind.name);
        // On the true front f1 = (sqrt(f0 - 1) - 1)^2 + 1.
        let off = |f: &&[f64]| f[1] - math::powi((f[0] - 1.0).max(0.0).sqrt() - 1.0, 2) - 1.0;
        let mean = front.iter().map(off).sum::<f64>() / front.len() as f64;
        assert!(mean < 0.01, "{}: {mean}", kind.name);
        assert!(front.iter().all(|f| f[0] >= 1.16 - 1e-5), "{}: the constraint is satisfied", kind.name);
    }
}
