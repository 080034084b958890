//! A run that is asked to end within a simulation keeps what was done before, and nothing of what was cut off.

use std::collections::HashSet;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use mops_core::{
    Analysis, Failure, Halt, Interface, Job, Model, Parameter, Response, StudyBuilder, Trace, Variable,
    run::{Known, RowSlopes},
    study::{CaseBuilder, CriterionBuilder, ModelBuilder, TunerBuilder},
};
use mops_criteria::overshoot::Overshoot;

use super::*;
use crate::solve;

/// `y = s + k^2 s (1 - s)`; at its simulation `last` somebody asks for the end.
struct Watched {
    interface: Interface,
    simulations: AtomicUsize,
    last: usize,
    cancellation: Cancellation,
}

impl Model for Watched {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        // The simulation at whose end the request comes has an answer, for which the criteria come too late.
        if self.simulations.fetch_add(1, Ordering::Relaxed) == self.last {
            self.cancellation.request(Halt::TimeLimit);
        } else if job.case.cancellation.requested().is_some() {
            return Err(Failure::Cancelled);
        }
        let mut y = Trace::starting_at(0.0, 1);
        y.push(1.0, Trace::NODES.map(|s| s + mops_math::powi(job.parameters[0] - 1.0, 2) * s * (1.0 - s)));
        Ok(Analysis::Time(Response { traces: vec![("y".into(), y)], ..Response::default() }))
    }
}

/// Records the points that a run answers.
#[derive(Default)]
struct Recorded(Mutex<Vec<(Vec<u64>, Known)>>);

impl Store for Recorded {
    fn known(&self, _: &[f64]) -> Option<Known> {
        None
    }

    fn answered(&self, tuners: &[f64], learned: Option<Known>) {
        let key = tuners.iter().map(|value| value.to_bits()).collect();
        self.0.lock().unwrap().extend(learned.map(|learned| (key, learned)));
    }

    fn known_slopes(&self, _: &[f64], _: f64) -> Option<Option<RowSlopes>> {
        None
    }

    fn learned_slopes(&self, _: &[f64], _: f64, _: Option<RowSlopes>) {}
}

/// The study, and the request that its model makes at its simulation `last`.
fn study(last: usize, cases: usize) -> (Study, Cancellation) {
    let cancellation = Cancellation::default();
    let model = Watched {
        interface: Interface {
            signals: vec![Variable::new("y", "1", "output")],
            parameters: vec![Parameter::new("k", "1", "gain"), Parameter::new("j", "1", "nothing")],
            horizon: Some(1.0),
            ..Interface::default()
        },
        simulations: AtomicUsize::new(0),
        last,
        cancellation: cancellation.clone(),
    };
    let overshoot = || Overshoot { signal: "y".into(), target: Some(1.0.into()), ..Overshoot::default() };
    let case = |i: u32| CaseBuilder {
        name: format!("case {i}"),
        parameters: vec![("j".into(), f64::from(i).into())],
        ..CaseBuilder::default()
    };
    let study = StudyBuilder {
        name: "watched".into(),
        models: vec![("loop".into(), ModelBuilder::from(model))],
        tuners: vec![("k".into(), TunerBuilder::new(3.0, 0.5, 5.0))],
        cases: (0..u32::try_from(cases).unwrap()).map(case).collect(),
        criteria: vec![("overshoot".into(), CriterionBuilder::minimise(overshoot(), 0.1))],
        ..StudyBuilder::default()
    };
    (study.build().unwrap(), cancellation)
}

#[test]
fn what_is_cut_off_is_no_evaluation_no_failure_and_kept_nowhere() {
    let catalogue = crate::testing::catalogue();
    for kind in ["genetic", "sqp", "pattern-search", "cma-es", "nelder-mead"] {
        let solver = catalogue.solvers.iter().find(|solver| solver.name == kind).unwrap().default_choice();
        for cases in [1, 3] {
            let options = Options { solver: solver.clone(), max_evaluations: 40, ..Options::default() };
            let whole = solve(study(usize::MAX, cases).0, &options, &()).unwrap().archive.len();
            // Each point takes a simulation of every case at least, so that the request comes while it searches.
            for last in [0, 1, 2, whole * cases / 3, whole * cases / 2, whole * cases - 1] {
                let (study, cancellation) = study(last, cases);
                let recorded = Arc::new(Recorded::default());
                let store: Arc<dyn Store> = Arc::<Recorded>::clone(&recorded) as Arc<dyn Store>;
                let keeping = Some(EvaluationStore { study: study.clone(), store, begin: None });
                let solved = solve(study, &Options { keeping, cancellation, ..options.clone() }, &()).unwrap();
                let outcome = &solved.outcome;
                let what = format!("{kind}, {last} of {cases}: {:?} after {}", outcome.stop, outcome.evaluations);
                // A start that was cut off is simulated once more, to have something to report.
                let most = last.max(cases) / cases;
                assert!(outcome.stop == Stop::TimeLimit && (1..=most).contains(&outcome.evaluations), "{what}");
                assert!(outcome.failures.is_empty() && solved.best.scaled.is_some(), "{what}: {:?}", outcome.failures);
                assert!(solved.archive.iter().all(|record| record.merit.objective.is_finite()), "{what}");
                let recorded = recorded.0.lock().unwrap();
                assert!(
                    recorded.iter().all(|(_, known)| known.jobs.iter().all(|(_, values)| values.is_ok())),
                    "{what}"
                );
                let points: HashSet<&Vec<u64>> = recorded.iter().map(|(tuners, _)| tuners).collect();
                assert_eq!(points.len(), outcome.evaluations, "{what}");
            }
        }
    }
}

#[test]
fn a_conclusion_that_is_ended_too_reports_what_is_known() {
    for (last, known) in [(0, false), (40, true)] {
        let (study, cancellation) = study(last, 2);
        cancellation.insist();
        let solver = mops_solvers::kinds().into_iter().find(|kind| kind.name == "genetic").unwrap().default_choice();
        let solved = solve(study, &Options { solver, cancellation, ..Options::default() }, &()).unwrap();
        assert_eq!((solved.best.scaled.is_some(), solved.outcome.evaluations > 0), (known, known));
        assert!(solved.outcome.failures.is_empty() && solved.outcome.stop == Stop::TimeLimit);
    }
}
