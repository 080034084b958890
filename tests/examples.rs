//! The examples run and give the stated results.

use mops_math as math;

#[path = "../examples/own_study.rs"]
mod own_study;

#[test]
fn a_study_in_rust_reaches_the_optimum_of_a_dense_grid() {
    let solved = mops::solve(own_study::study().unwrap(), &mops::Options::default(), &()).unwrap();
    let outcome = &solved.outcome;
    assert!(outcome.worst_scaled < 0.6 * outcome.start.worst_scaled, "{}", outcome.worst_scaled);
    // A dense grid over the box, evaluated without a solver, has no better point.
    let steps = 60;
    let points = (0..=steps).flat_map(|i| (0..=steps).map(move |j| [f64::from(i), f64::from(j)]));
    let grid = points.map(|p| solved.problem.evaluate(&p.map(|x| x / f64::from(steps))).merit.objective);
    let best = grid.fold(f64::INFINITY, f64::min);
    assert!(outcome.worst_scaled <= best * 1.001, "{} {best}", outcome.worst_scaled);
}

#[test]
fn reported_gradients_at_the_optimum_agree_with_finite_differences() {
    let solved = mops::solve(own_study::study().unwrap(), &mops::Options::default(), &()).unwrap();
    let found = solved.outcome.found.get::<mops::tasks::design::SlopesReport>().expect("a design has gradients");
    assert_eq!(found.tuners, ["k", "d"]);
    let keys: Vec<&str> = found.criteria.iter().map(|criterion| criterion.key.as_str()).collect();
    let row = keys.iter().position(|key| key.ends_with("/shaking")).expect("the criterion is in the study");
    // Finite differences of the smooth criterion.
    let at = solved.problem.point_of(&solved.best.tuners);
    let shaking = |j: usize, step: f64| {
        let mut point = at.clone();
        point[j] += step;
        solved.problem.evaluate(&point).scaled.expect("the simulation succeeds")[row]
    };
    for (j, slope) in found.criteria[row].slopes.iter().enumerate() {
        let difference = (shaking(j, 1e-4) - shaking(j, -1e-4)) / 2e-4;
        assert!((slope - difference).abs() < 1e-4 * difference.abs().max(0.1), "{slope} {difference}");
    }
}

#[path = "../examples/plugin/src/shrinking_box.rs"]
mod shrinking_box;

#[test]
fn a_user_defined_solver_reaches_the_optimum_of_the_default_one_for_any_number_of_threads() {
    let kind = mops::SolverKind::of::<shrinking_box::ShrinkingBoxOptions>();
    let solved = |jobs| {
        let options = mops::Options { solver: kind.default_choice(), jobs: Some(jobs), ..mops::Options::default() };
        mops::solve(own_study::study().unwrap(), &options, &()).unwrap().outcome
    };
    let by_default = mops::solve(own_study::study().unwrap(), &mops::Options::default(), &()).unwrap().outcome;
    let (one, four) = (solved(1), solved(4));
    assert!(one.worst_scaled <= 1.0001 * by_default.worst_scaled, "{} {}", one.worst_scaled, by_default.worst_scaled);
    assert_eq!((one.worst_scaled.to_bits(), one.evaluations), (four.worst_scaled.to_bits(), four.evaluations));
    let each = mops::core::Shape { objective: mops::Objective::Each, ..mops::core::Shape::default() };
    assert!(kind.default_choice().make().accepts(&each).is_err_and(|why| why.contains("nsga2")));
}

#[path = "../examples/repaired.rs"]
mod repaired;

#[test]
fn an_exported_repaired_study_equals_the_calibration_in_its_file() {
    let study = repaired::study().unwrap();
    assert_eq!((study.name(), study.task().name()), ("furuta-swing-repaired", "calibration"));
    // Initial guesses are the estimates, the dropped term is no tuner, experiments and criteria are those of the user.
    let start = |name: &str| study.tuners().iter().find(|tuner| tuner.name == name).map(|tuner| tuner.start);
    assert_eq!((start("b"), start("bp"), start("ca")), (Some(1.133e-3), None, Some(5e-4)));
    let keys: Vec<String> = study.rows().iter().map(|row| study.key(row)).collect();
    assert_eq!(keys, ["horizontal/phi", "horizontal/theta", "upright/phi", "upright/theta"]);
    assert_eq!(study.cases()[1].role(), mops::core::Role::Validation);
}

#[path = "../examples/argmin_executor.rs"]
mod argmin_executor;

#[test]
fn the_executor_of_argmin_runs_a_solver_to_the_global_minimum() {
    let (best, cost, evaluations) = argmin_executor::solve().unwrap();
    assert!(cost <= 1e-8 && best.iter().all(|x| x.abs() < 1e-4), "{cost} {best:?}");
    assert!(evaluations <= 20_000, "{evaluations}");
}

/// Files of the recordings, by name, with the columns that each of them has.
struct AnyRecording;

impl mops::language::files::Files for AnyRecording {
    fn read(&self, path: &str) -> std::io::Result<Vec<u8>> {
        let columns: &[&str] = match path {
            "FurutaData.mat" => &["phi", "theta"],
            swing if swing.starts_with("swing") || swing.starts_with("validation") => &["theta"],
            _ => &["position", "velocity", "torque"],
        };
        let row = |i: u32| {
            let t = f64::from(i) * 0.05;
            let values: String = (0..columns.len()).map(|k| format!(",{}", math::cos((1.0 + k as f64) * t))).collect();
            format!("{t}{values}\n")
        };
        let rows: String = (0..=800).map(row).collect();
        Ok(format!("time,{}\n{rows}", columns.join(",")).into_bytes())
    }

    fn show(&self, path: &str) -> String {
        path.to_owned()
    }
}

#[test]
fn studies_of_recordings_have_the_declared_roles_of_experiments() {
    for (name, text, roles) in [
        ("furuta-lund", include_str!("../examples/recordings/furuta-lund.toml"), [1, 0, 0]),
        ("furuta-lund-blocks", include_str!("../examples/recordings/furuta-lund-blocks.toml"), [2, 1, 2]),
        ("pendulum-multiarm", include_str!("../examples/recordings/pendulum-multiarm.toml"), [9, 3, 6]),
        ("pendulum-dfki", include_str!("../examples/recordings/pendulum-dfki.toml"), [3, 0, 1]),
    ] {
        let read = mops::file::read(&mops::catalogue(), "study.toml", text, &[], &AnyRecording);
        let study = read.unwrap_or_else(|mistake| panic!("{name}: {mistake}")).study;
        assert_eq!(study.name(), name);
        let of = |role| study.cases().iter().filter(|case| case.role() == role).count();
        assert_eq!(
            [mops::core::Role::Calibration, mops::core::Role::Selection, mops::core::Role::Validation].map(of),
            roles,
            "{name}"
        );
    }
}

/// A study of closures: `x' = -k x`, and the logarithm of `x` at the end by a closure that may panic.
fn closures(names: [&str; 2], rate: fn(f64) -> f64, end: fn(f64) -> f64) -> mops::StudyBuilder {
    use mops::prelude::*;
    let interface = Interface {
        signals: names.map(|name| Variable::new(name, "1", "state")).to_vec(),
        parameters: vec![Parameter::new("k", "1/s", "rate")],
        horizon: Some(1.0),
        ..Interface::default()
    };
    let decay = mops::models::from_fn(interface, [1.0, 0.0], move |at, p, dx| dx[0] = -rate(p[0]) * at.x[0]);
    let last = mops::criteria::from_fn([names[0]], Unit::one(), move |traces| end(traces[0].last()));
    StudyBuilder {
        name: "closures".into(),
        models: vec![("decay".into(), decay.into())],
        tuners: vec![("k".into(), TunerBuilder::new(1.0, 0.5, 2.0))],
        criteria: vec![("last".into(), CriterionBuilder::minimise(last, 1.0))],
        ..StudyBuilder::default()
    }
}

fn no_small(value: f64) -> f64 {
    assert!(value > 0.2, "{value} is too small");
    value
}

fn no_large(value: f64) -> f64 {
    assert!(value < 1.5, "{value} is too large");
    value
}

#[test]
fn a_panic_of_a_closure_is_a_failure_of_its_point_that_names_the_model_or_criterion() {
    let failures = |rate, end| {
        let study = closures(["x", "y"], rate, end).build().unwrap();
        let problem = mops::core::Problem::new(std::sync::Arc::new(study));
        [[0.0], [1.0]].map(|point| problem.evaluate(&point).failures.pop().map(|(_, failure)| failure.to_string()))
    };
    let [none, criterion] = failures(|k| k, no_small);
    assert_eq!((none, criterion.as_deref().unwrap().split("0.13").next()), (None, Some("last: panicked: ")));
    let [none, model] = failures(no_large, |x| x);
    assert_eq!((none, model.as_deref()), (None, Some("model `decay` panicked: 2 is too large")));
    // The run goes on and finds the best point without a failure.
    let study = closures(["x", "y"], no_large, |x| x).build().unwrap();
    let outcome = mops::solve(study, &mops::Options::default(), &()).unwrap().outcome;
    assert!((outcome.tuners[0].value - 1.5).abs() < 0.05, "{}", outcome.tuners[0].value);
    assert_eq!((outcome.failures[0].model.as_str(), outcome.failures[0].case.as_str()), ("decay", "nominal"));
    // A run without any point ends with the failure.
    let study = closures(["x", "y"], |k| no_large(9.0 * k), |x| x).build().unwrap();
    let options = mops::Options { max_evaluations: 5, ..mops::Options::default() };
    let solved = mops::solve(study, &options, &()).unwrap();
    assert_eq!((solved.best.failures.len(), &solved.outcome.failures[0].failure[..]), (1, "model undefined"));
}

#[test]
fn a_panic_of_the_function_that_builds_a_study_is_an_error_that_names_the_study() {
    let broken = mops::BuiltStudy::new("broken", "", || panic!("no data"));
    let error = mops::file::built(&mops::catalogue(), &broken, &[]).err().unwrap();
    assert_eq!(error.message, "the function that builds the study `broken` panicked: no data");
}

#[test]
fn a_model_with_two_signals_of_one_name_is_refused() {
    let error = closures(["x", "x"], |k| k, |x| x).build().err().unwrap();
    assert!(error.to_string().starts_with("models.decay.signals.x: duplicate name `x`"), "{error}");
}
