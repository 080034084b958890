use std::collections::HashSet;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use mops_catalogue::catalogue;
use mops_core::{
    Failure, Problem, Study, Value,
    catalogue::CatalogueStudy,
    criterion::Missed,
    run::{Known, RowSlopes, RowValue},
};
use mops_file::StudyFile;

use super::database::{Database, PointRow};
use super::{FILE, Identity, OpenError, Recorder, RunRow, RunState, Start, bytes};

/// Reads a shipped study with settings.
fn file(name: &str, settings: &[&str]) -> StudyFile {
    let catalogue = catalogue();
    let Some(CatalogueStudy::Shipped(shipped)) = catalogue.study(name) else { panic!("{name} is shipped") };
    let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
    mops_file::read_shipped(&catalogue, shipped, &settings).unwrap()
}

#[test]
fn every_shipped_study_measures_as_itself_so_that_its_points_are_stored() {
    for known in catalogue().studies {
        let name = known.name();
        let study = file(name, &[]).study;
        assert!(study.measures_as(&study.clone()), "{name}");
    }
    // Initial states of `tank-level` are expressions without a known number.
    let [one, other] = ["900 cm2", "901 cm2"]
        .map(|area| file("tank-level", &[&format!("models.plant.equations.constants.A1=\"{area}\"")]).study);
    assert!(!one.measures_as(&other));
}

/// Returns a study built in Rust, with settings.
fn built(settings: &[&str]) -> StudyFile {
    use mops_core::{
        Interface, Parameter, StudyBuilder, Variable,
        catalogue::BuiltStudy,
        study::{CriterionBuilder, TunerBuilder},
    };
    use mops_language::Unit;
    let draft = || {
        let model = Interface {
            signals: vec![Variable::new("x", "m", "")],
            parameters: vec![Parameter::new("k", "1/s", ""), Parameter::new("d", "1/s", "").with_default(1.0)],
            horizon: Some(1.0),
            ..Interface::default()
        };
        let model = mops_models::from_fn(model, [1.0], |at, p, dx| dx[0] = (p[1] - p[0]) * at.x[0]);
        let end = mops_criteria::from_fn(["x"], Unit::known("m"), |traces| traces[0].last());
        StudyBuilder {
            models: vec![("m".into(), model.into())],
            tuners: vec![("k".into(), TunerBuilder::new(1.0, 0.1, 10.0))],
            criteria: vec![("end".into(), CriterionBuilder::minimise(end, 10.0))],
            ..StudyBuilder::default()
        }
    };
    let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
    let study = BuiltStudy::new("closure", "", draft);
    mops_file::built(&catalogue(), &study, &settings).unwrap()
}

#[test]
fn every_setting_of_a_study_built_in_rust_makes_another_run() {
    let identity = |settings: &[&str]| {
        let file = built(settings);
        Identity::of(&file, &file.study, file.solver.kind)
    };
    let plain = identity(&[]);
    assert_eq!(plain.refuses_to_continue(&identity(&[])), None);
    assert_eq!(plain.refuses_to_continue(&identity(&["solver.max-evaluations=7"])), None);
    for setting in [
        "study.seed=7",
        "study.objective=\"sum\"",
        "tuners.k.start=2.0",
        "solver.genetic.population=50",
        "monte-carlo.samples=50",
        "sweep.x={ tuner = \"k\", points = 7 }",
        "uncertain.d={ min = 0.5, max = 2.0 }",
    ] {
        let key = setting.split('=').next().unwrap();
        let why = plain.refuses_to_continue(&identity(&[setting])).unwrap_or_default();
        assert!(why.contains(key.split('.').next().unwrap()), "{setting}: {why}");
    }
    let changed = |data: &str, program: &str| {
        let mut file = built(&[]);
        (file.data, file.program) = (vec![("d.csv".to_owned(), data.to_owned())], Some(program.to_owned()));
        Identity::of(&file, &file.study, file.solver.kind)
    };
    let reason = |data: &str, program: &str| changed("1", "1").refuses_to_reuse(&changed(data, program));
    assert_eq!(reason("1", "1"), None);
    assert_eq!(reason("2", "1").as_deref(), Some("a data file has changed"));
    assert!(reason("1", "2").is_some_and(|why| why.starts_with("the program was rebuilt")));
    // A demand reads as in a study file.
    let content = &built(&[]).content;
    assert_eq!(content["criteria"]["end"], serde_json::json!({ "demand": 10.0, "usage": "minimise", "weight": 1.0 }));
}

/// Creates a database in memory with the given points and derivatives of a study.
fn written(study: &Study, points: &[PointRow], slopes: &[(Vec<u64>, f64, Option<RowSlopes>)]) -> Database {
    let file = file("pid-design", &[]);
    let mut database = Database::in_memory().unwrap();
    let run = database.insert_run(&RunRow::of(&Identity::of(&file, &file.study, "auto"))).unwrap();
    database.write(run, study.rows().len(), points, slopes, Some(points.len())).unwrap();
    database
}

fn read(database: &Database, study: &Study) -> super::database::Points {
    database.points(study, &mut |note| note.to_owned().leak()).unwrap()
}

#[test]
fn points_are_read_as_written_bit_by_bit() {
    let study = file("pid-design-multi-case", &[]).study;
    let all = study.rows();
    let rows_of = |job: usize| (0..all.len()).filter(move |&row| all[row].job == job);
    let odd = [0.1 + 0.2, -0.0, f64::MIN_POSITIVE / 3.0, 1e308];
    let value = |(i, row): (usize, usize)| -> RowValue {
        let note = (i == 0).then_some("not settled at the end");
        let missed = (i < 2).then_some(Missed { horizon: (i == 0).then_some(0.1 + 0.2) });
        (row, Ok(Value { number: odd[i % 4], note, missed, ..Value::default() }))
    };
    let failures = [
        Failure::Diverged(1.0 / 3.0),
        Failure::StepLimit(f64::INFINITY, "many instants".into()),
        Failure::StepTooSmall(0.1),
        Failure::EventsAccumulate(0.3, "they come closer".into()),
        Failure::Undefined("a \"word\"".into()),
        Failure::Criterion("none".into()),
        Failure::RecordLimit(1e-3),
    ];
    let mut values: Vec<RowValue> = rows_of(1).enumerate().map(value).collect();
    values.push((rows_of(2).next().unwrap(), Err("never reached 90 %".into())));
    let (last, with_values) = (values.pop().unwrap(), values);
    assert!(with_values.len() >= 2);
    let without: Vec<RowValue> = rows_of(2).map(|row| (row, last.1.clone())).collect();
    // The first job of each point fails in a different way; jobs that were not run are not stored.
    let points: Vec<PointRow> = (failures.iter().enumerate())
        .map(|(i, failure)| PointRow {
            tuners: bytes::key(&[i as f64, -0.0, 1.0 / 3.0]),
            known: Known {
                jobs: [(0, Err(failure.clone())), (1, Ok(with_values.clone())), (2, Ok(without.clone()))][..1 + i % 3]
                    .to_vec(),
            },
        })
        .collect();
    let found = read(&written(&study, &points, &[]), &study);
    assert_eq!(found.len(), points.len());
    for (i, point) in points.iter().enumerate() {
        assert_eq!(found[&bytes::key(&[i as f64, 0.0, 1.0 / 3.0])], point.known);
    }
}

#[test]
fn derivatives_and_missing_derivatives_are_read_as_written() {
    let study = file("pid-design", &[]).study;
    let rows: RowSlopes = vec![(0, vec![(0.1 + 0.2).into(), (-0.0).into()]), (1, vec![1.0.into(), 1e-300.into()])];
    let key = bytes::key(&[1.0, 2.0]);
    let slopes = [(key.clone(), 1e-3, Some(rows.clone())), (key.clone(), 1e-4, None)];
    let found = written(&study, &[], &slopes).slopes().unwrap();
    assert_eq!(found[&(key.clone(), 1e-3_f64.to_bits())], Some(rows));
    assert_eq!(found[&(key, 1e-4_f64.to_bits())], None);
    // Truncated lists are rejected.
    let whole = bytes::of_lists([(3, &[1.0, 2.0][..])].into_iter());
    assert_eq!(bytes::lists(&whole), Some(vec![(3, vec![1.0, 2.0])]));
    assert!((1..whole.len()).all(|end| bytes::lists(&whole[..end]).is_none()));
    assert_eq!(bytes::lists(&[0xff; 16]), None);
}

/// Each entry of study.toml either may change or must not.
#[test]
fn demands_bounds_and_solvers_may_change_and_what_is_simulated_may_not() {
    let identity = |settings: &[&str]| {
        let file = file("pid-design", settings);
        let solver = file.solver.kind;
        Identity::of(&file, &file.study, solver)
    };
    let plain = identity(&[]);
    assert_eq!((plain.refuses_to_continue(&plain), plain.refuses_to_reuse(&plain)), (None, None));
    for way in [
        "criteria.settling.demand=\"9 s\"",
        "criteria.settling.weight=2.0",
        "criteria.settling.usage=\"inequality\"",
        "tuners.k.start=3.0",
        "tuners.k.max=60.0",
        "tuners.k.scale=\"linear\"",
        "tuners.k.active=false",
        "study.seed=7",
        "study.name=\"other\"",
        "solver.genetic.population=50",
    ] {
        let other = identity(&[way]);
        assert_eq!(plain.refuses_to_reuse(&other), None, "{way}");
        let key = way.split('=').next().unwrap();
        let why = plain.refuses_to_continue(&other).unwrap_or_default();
        assert!(why.contains(key) || why.contains("solver"), "{way}: {why}");
    }
    for values in [
        "cases.nominal.b=-4.5",
        "models.loop.pid-loop.horizon=\"50 s\"",
        "models.loop.pid-loop.plant.gain=2.0",
        "criteria.settling.settling-time.band=0.02",
        "tuners.Ti.unit=\"ms\"",
        "cases.more={ a = 0.0, b = -3.0, c = -1.0 }",
        "criteria.more={ overshoot = { signal = \"y\" }, usage = \"monitor\" }",
    ] {
        let other = identity(&[values]);
        assert!(plain.refuses_to_reuse(&other).is_some(), "{values}");
        assert!(plain.refuses_to_continue(&other).is_some(), "{values}");
    }
    // Neither another budget nor another notation of the same number makes another run.
    assert_eq!(plain.refuses_to_continue(&identity(&["solver.max-evaluations=7"])), None);
    assert_eq!(plain.refuses_to_continue(&identity(&["tuners.k.start=4.00"])), None);
}

#[test]
fn stored_values_give_the_evaluation_of_a_simulation_under_any_demand() {
    let problem = |settings: &[&str]| Problem::new(Arc::new(file("pid-design-multi-case", settings).study));
    let (plain, asking) = (problem(&[]), problem(&["criteria.overshoot.demand=0.3"]));
    for place in [0.1, 0.35, 0.5, 0.8] {
        let point = vec![place; plain.active().len()];
        let first = plain.evaluate_keeping(&point, None);
        let known = first.learned.expect("all of it is new");
        for problem in [&plain, &asking] {
            let again = problem.evaluate_keeping(&point, Some(known.clone()));
            assert!(again.learned.is_none());
            assert_eq!(format!("{:?}", again.evaluation), format!("{:?}", problem.evaluate(&point)));
        }
        // The missing half of a half-stored point is simulated.
        let half = Known { jobs: known.jobs.iter().step_by(2).cloned().collect() };
        let again = asking.evaluate_keeping(&point, Some(half.clone()));
        let missing: HashSet<usize> = again.learned.unwrap().jobs.iter().map(|(job, _)| *job).collect();
        assert!(
            missing.len() + half.jobs.len() == known.jobs.len() && half.jobs.iter().all(|(j, _)| !missing.contains(j))
        );
        assert_eq!(format!("{:?}", again.evaluation), format!("{:?}", asking.evaluate(&point)));
    }
}

/// Starts a run of the shipped study in a folder.
fn start_run(folder: &Path, start: &Start) -> Result<Recorder, OpenError> {
    let file = file("pid-design", &[]);
    let identity = Identity::of(&file, &file.study, "auto");
    Recorder::open(folder, start, &file.study, &identity, &RunRow::of(&identity))
}

/// Ends a run after `points` new points.
fn end_run(recorder: Recorder, points: usize, state: RunState) {
    let store = recorder.store();
    let ((), opened) = recorder.run(&(), |_| {
        for i in 0..points {
            let value = Value { number: 0.5, ..Value::default() };
            store.answered(&[i as f64, 1.0, 1.0], Some(Known { jobs: vec![(0, Ok(vec![(0, Ok(value))]))] }));
        }
    });
    assert_eq!(opened.end(state, points), None);
}

/// Leftovers of a run that was killed at its start, one for each stage. The next run starts anew or is resumed.
#[test]
fn a_run_starts_or_is_resumed_wherever_the_last_one_was_killed() {
    type Leave = fn(&Path);
    let connection = |path: &Path| rusqlite::Connection::open(path).unwrap();
    // Leftovers, and the least number of points stored in them.
    let states: [(&str, Leave, usize); 9] = [
        ("nothing", |_| (), 0),
        ("a lock", |folder| fs::write(folder.join("evaluations.lock"), "").unwrap(), 0),
        ("half a draft", |folder| fs::write(folder.join(".new-evaluations.sqlite"), [0; 100]).unwrap(), 0),
        (
            "a draft and its journal",
            |folder| {
                fs::write(folder.join(".new-evaluations.sqlite"), "SQLite format 3\0").unwrap();
                fs::write(folder.join(".new-evaluations.sqlite-journal"), [0xd9; 600]).unwrap();
            },
            0,
        ),
        ("an empty file", |folder| fs::write(folder.join(FILE), "").unwrap(), 0),
        (
            "no tables yet",
            |folder| {
                let database = rusqlite::Connection::open(folder.join(FILE)).unwrap();
                database.execute_batch("PRAGMA journal_mode=WAL; PRAGMA application_id=1836019827;").unwrap();
            },
            0,
        ),
        (
            "no run yet",
            |folder| {
                end_run(start_run(folder, &Start::Fresh).ok().unwrap(), 0, RunState::Running);
                rusqlite::Connection::open(folder.join(FILE)).unwrap().execute("DELETE FROM runs", []).unwrap();
            },
            0,
        ),
        (
            "the end not entered",
            |folder| end_run(start_run(folder, &Start::Fresh).ok().unwrap(), 7, RunState::Running),
            7,
        ),
        (
            "a log that was not taken over",
            |folder| {
                // Copies the files during the run.
                let recorder = start_run(folder, &Start::Fresh).ok().unwrap();
                let store = recorder.store();
                let copy = folder.join("copy");
                fs::create_dir(&copy).unwrap();
                let ((), opened) = recorder.run(&(), |watch| {
                    for i in 0..300 {
                        let value = Value { number: 0.5, ..Value::default() };
                        store.answered(
                            &[f64::from(i), 1.0, 1.0],
                            Some(Known { jobs: vec![(0, Ok(vec![(0, Ok(value))]))] }),
                        );
                    }
                    watch.stage("written so far", 0.5);
                    // The log grows before points are committed.
                    let reader = rusqlite::Connection::open(folder.join(FILE)).unwrap();
                    let written = || reader.query_row("SELECT count(*) FROM points", [], |row| row.get(0));
                    while written().unwrap_or(0) < 256 {
                        std::thread::yield_now();
                    }
                    for end in ["", "-wal"] {
                        fs::copy(folder.join(format!("{FILE}{end}")), copy.join(format!("{FILE}{end}"))).unwrap();
                    }
                });
                drop(opened);
                for end in ["", "-wal"] {
                    fs::rename(copy.join(format!("{FILE}{end}")), folder.join(format!("{FILE}{end}"))).unwrap();
                }
                fs::remove_dir(&copy).unwrap();
            },
            256,
        ),
    ];
    for (what, leave, least) in states {
        let root = tempfile::tempdir().unwrap();
        leave(root.path());
        let recorder = start_run(root.path(), &Start::Resume).unwrap_or_else(|_| panic!("{what}: it is refused"));
        assert!(
            recorder.known() >= least && (least > 0 || recorder.known() == 0),
            "{what}: {} points",
            recorder.known()
        );
        end_run(recorder, 10, RunState::Converged);
        let mut names: Vec<_> = fs::read_dir(root.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, [FILE], "{what}");
        let runs =
            connection(&root.path().join(FILE)).query_row("SELECT count(*) FROM runs", [], |row| row.get::<_, i64>(0));
        assert_eq!(runs.unwrap(), 1 + i64::from(least > 0), "{what}");
    }
}

#[test]
fn a_foreign_database_is_renamed_with_its_log_and_next_to_no_other_log() {
    let root = tempfile::tempdir().unwrap();
    let at = |name: &str| root.path().join(name);
    // State after a killed program: all its data are in the log.
    let other = rusqlite::Connection::open(at("other")).unwrap();
    other.execute_batch("PRAGMA journal_mode=WAL; CREATE TABLE mine (x); INSERT INTO mine VALUES (7);").unwrap();
    for end in ["", "-wal"] {
        fs::copy(at(&format!("other{end}")), at(&format!("{FILE}{end}"))).unwrap();
    }
    // The first name is taken by the log of a removed database.
    fs::copy(at("other-wal"), at("evaluations.previous.sqlite-wal")).unwrap();
    let recorder = start_run(root.path(), &Start::Fresh).ok().unwrap();
    assert!(recorder.note.as_ref().unwrap().contains("evaluations.previous-2.sqlite"), "{:?}", recorder.note);
    end_run(recorder, 3, RunState::Converged);
    assert!(!at("evaluations.sqlite-wal").exists() && at("evaluations.previous.sqlite-wal").exists());
    let mine = rusqlite::Connection::open(at("evaluations.previous-2.sqlite")).unwrap();
    assert_eq!(mine.query_row("SELECT x FROM mine", [], |row| row.get::<_, i64>(0)), Ok(7));
}
