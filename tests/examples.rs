//! The examples run, and give what they say.

#[path = "../examples/own_study.rs"]
mod own_study;

#[test]
fn a_study_in_rust_finds_the_best_compromise() {
    let solved = mops::solve(own_study::study().unwrap(), &mops::Options::default(), &()).unwrap();
    let outcome = &solved.outcome;
    assert!(outcome.worst_scaled < 0.6 * outcome.start.worst_scaled, "{}", outcome.worst_scaled);
    // A dense grid over the box, evaluated independently of any solver, has nothing better to offer.
    let steps = 60;
    let points = (0..=steps).flat_map(|i| (0..=steps).map(move |j| [f64::from(i), f64::from(j)]));
    let grid = points.map(|p| solved.problem.evaluate(&p.map(|x| x / f64::from(steps))).merit.objective);
    let best = grid.fold(f64::INFINITY, f64::min);
    assert!(outcome.worst_scaled <= best * 1.001, "{} {best}", outcome.worst_scaled);
}

#[path = "../examples/own_solver.rs"]
mod own_solver;

#[test]
fn a_solver_of_ones_own_finds_what_the_default_one_finds_whatever_the_number_of_threads() {
    let kinds = own_solver::catalogue().solvers;
    let kind = kinds.iter().find(|kind| kind.name == "shrinking-box").expect("it is in the catalogue");
    let solved = |jobs| {
        let options = mops::Options { solver: kind.default_choice(), jobs: Some(jobs), ..mops::Options::default() };
        mops::solve(own_study::study().unwrap(), &options, &()).unwrap().outcome
    };
    let by_default = mops::solve(own_study::study().unwrap(), &mops::Options::default(), &()).unwrap().outcome;
    let (one, four) = (solved(1), solved(4));
    assert!(one.worst_scaled <= 1.0001 * by_default.worst_scaled, "{} {}", one.worst_scaled, by_default.worst_scaled);
    assert_eq!((one.worst_scaled.to_bits(), one.evaluations), (four.worst_scaled.to_bits(), four.evaluations));
    let each = mops::Shape { objective: mops::Objective::Each, ..mops::Shape::default() };
    assert!(kind.default_choice().make().accepts(&each).is_err_and(|why| why.contains("nsga2")));
}

#[path = "../examples/repaired.rs"]
mod repaired;

#[test]
fn a_repaired_study_as_a_program_is_the_calibration_that_its_file_is() {
    let study = repaired::study().unwrap();
    assert_eq!((study.name.as_str(), study.task), ("furuta-swing-repaired", mops::Task::Calibration));
    // Start values are those found, the term that is not needed is no tuner, experiments and criteria are the user's.
    let start = |name: &str| study.tuners.iter().find(|tuner| tuner.name == name).map(|tuner| tuner.start);
    assert_eq!((start("b"), start("bp"), start("ca")), (Some(1.133e-3), None, Some(5e-4)));
    let keys: Vec<String> = study.rows.iter().map(|row| study.key(row)).collect();
    assert_eq!(keys, ["horizontal/phi", "horizontal/theta", "upright/phi", "upright/theta"]);
    assert_eq!(study.cases[1].role(), mops::Role::Validation);
}
