//! Store of a study, adapted to a problem derived from it. Simulations of the problem are those of the study, some of
//! them at other values of the uncertain parameters.

use std::sync::Arc;

use mops_core::{
    Cancellation, Evaluation, Halt, Problem, Study,
    run::{CachedPoint, Known, RowSlopes, Store},
    study::Scenario,
};

use crate::search::Options;

/// Store for a derived problem. The key of a point is the values of all tuners, followed by those of the uncertain
/// parameters if they are set.
///
/// A part of the problem is the set of its jobs with the same values of the uncertain parameters.
#[derive(Clone)]
pub(super) struct Copies {
    store: Arc<dyn Store>,
    /// Values of the uncertain parameters of each part, see [`Scenario::values`]; empty for the cases of the study
    /// itself.
    parts: Vec<Vec<f64>>,
    /// Tuner to whose value that of an uncertain parameter is relative, if any.
    relative_to: Vec<Option<usize>>,
    /// Part and index in the study of each job of the problem.
    jobs: Vec<(usize, usize)>,
    /// Part and index in the study of each row of the problem.
    rows: Vec<(usize, usize)>,
    /// True if the coordinates of the unit box, and hence the derivatives, are those of the study.
    same_coordinates: bool,
}

impl Copies {
    /// Returns the store of the options for a problem with the study `made`, derived from `study` with these scenarios.
    /// Returns `None` without a store, or if the store belongs to another study.
    pub fn of(options: &Options, study: &Study, made: &Study, scenarios: &[Scenario]) -> Option<Self> {
        let keeping = options.keeping.as_ref().filter(|keeping| keeping.study.measures_as(study))?;
        let mut parts: Vec<Vec<f64>> = Vec::new();
        let mut jobs = Vec::new();
        for job in made.jobs() {
            let scenario = job.case.checked_sub(study.cases().len()).map(|index| &scenarios[index]);
            let case = scenario.map_or(job.case, |scenario| scenario.case);
            let values = scenario.map_or_else(Vec::new, |scenario| scenario.values.clone());
            let part = parts.iter().position(|part| *part == values).unwrap_or(parts.len());
            if part == parts.len() {
                parts.push(values);
            }
            jobs.push((part, study.jobs().iter().position(|of| (of.model, of.case) == (job.model, case))?));
        }
        let rows = made.rows().iter().map(|row| {
            let (part, job) = jobs[row.job];
            let of = |of: &mops_core::study::Row| of.job == job && of.name == row.name;
            Some((part, study.rows().iter().position(of)?))
        });
        let rows = rows.collect::<Option<_>>()?;
        let same_coordinates = made.tuners().len() == study.tuners().len();
        let relative_to = study.uncertain().iter().map(|uncertain| uncertain.tuner).collect();
        Some(Self { store: Arc::clone(&keeping.store), parts, relative_to, jobs, rows, same_coordinates })
    }

    /// Returns the store for a problem with only one of the rows.
    pub fn of_row(&self, row: usize) -> Self {
        Self { rows: vec![self.rows[row]], ..self.clone() }
    }

    fn key(&self, tuners: &[f64], part: usize) -> Vec<f64> {
        let value = |(value, relative): (&f64, &Option<usize>)| relative.map_or(*value, |tuner| value * tuners[tuner]);
        let values = self.parts[part].iter().zip(&self.relative_to).map(value);
        tuners.iter().copied().chain(values).collect()
    }

    /// Returns the row of the problem that corresponds to a row of the study in a part.
    fn row(&self, part: usize, origin: usize) -> Option<usize> {
        self.rows.iter().position(|row| *row == (part, origin))
    }

    /// Converts stored values of a part from the indices of the study to those of the problem.
    fn to_problem(&self, part: usize, known: &Known) -> Known {
        let of = |(job, &(_, origin)): (usize, &(usize, usize))| {
            let values = known.job(origin)?.as_ref().map_err(Clone::clone).map(|values| {
                values.iter().filter_map(|(row, value)| Some((self.row(part, *row)?, value.clone()))).collect()
            });
            Some((job, values))
        };
        let jobs = self.jobs.iter().enumerate().filter(|(_, (of, _))| *of == part);
        Known { jobs: jobs.filter_map(of).collect() }
    }

    /// Converts new values of a part from the indices of the problem to those of the study.
    fn to_study(&self, part: usize, learned: &Known) -> Option<Known> {
        let of_part = learned.jobs.iter().filter(|(job, _)| self.jobs[*job].0 == part);
        let of = |(job, values): &(usize, mops_core::run::JobValues)| {
            let values = values.as_ref().map_err(Clone::clone);
            let values = values.map(|values| values.iter().map(|(row, v)| (self.rows[*row].1, v.clone())).collect());
            (self.jobs[*job].1, values)
        };
        let jobs: Vec<_> = of_part.map(of).collect();
        (!jobs.is_empty()).then_some(Known { jobs })
    }
}

impl Store for Copies {
    fn known(&self, tuners: &[f64]) -> Option<Known> {
        let of = |part: usize| Some(self.to_problem(part, &self.store.known(&self.key(tuners, part))?));
        let jobs: Vec<_> = (0..self.parts.len()).filter_map(of).flat_map(|known| known.jobs).collect();
        (!jobs.is_empty()).then_some(Known { jobs })
    }

    fn answered(&self, tuners: &[f64], learned: Option<Known>) {
        for part in 0..self.parts.len() {
            let (key, learned) = (self.key(tuners, part), learned.as_ref().and_then(|l| self.to_study(part, l)));
            // A part may have no evaluated row.
            if learned.is_some() || self.store.is_known(&key) {
                self.store.answered(&key, learned);
            }
        }
    }

    fn closed(&self) -> Option<&Cancellation> {
        self.store.closed()
    }

    fn known_slopes(&self, tuners: &[f64], reach: f64) -> Option<Option<RowSlopes>> {
        if !self.same_coordinates {
            return None;
        }
        let of = |part: usize| {
            let known = self.store.known_slopes(&self.key(tuners, part), reach)?;
            let made = |(row, slopes)| Some((self.row(part, row)?, slopes));
            Some(known.map(|rows| rows.into_iter().filter_map(made).collect::<RowSlopes>()))
        };
        let parts: Vec<Option<RowSlopes>> = (0..self.parts.len()).map(of).collect::<Option<_>>()?;
        Some(parts.into_iter().collect::<Option<Vec<RowSlopes>>>().map(|parts| parts.concat()))
    }

    fn learned_slopes(&self, tuners: &[f64], reach: f64, slopes: Option<RowSlopes>) {
        // Missing derivatives cannot be assigned to one of several parts.
        if !self.same_coordinates || (slopes.is_none() && self.parts.len() > 1) {
            return;
        }
        for part in 0..self.parts.len() {
            let of_part = |rows: &RowSlopes| {
                let of_part = rows.iter().filter(|(row, _)| self.rows[*row].0 == part);
                of_part.map(|(row, slopes)| (self.rows[*row].1, slopes.clone())).collect()
            };
            self.store.learned_slopes(&self.key(tuners, part), reach, slopes.as_ref().map(of_part));
        }
    }
}

/// Evaluates all cases at given values of all tuners, using stored values where available.
pub(super) fn evaluate_at(problem: &Problem, tuners: &[f64], store: Option<&Copies>) -> Evaluation {
    evaluate_stored((problem, true), tuners, store, |known| problem.evaluate_at_keeping(tuners, known))
}

/// Evaluates a point of the unit box, using stored values where available.
pub(super) fn evaluate(problem: &Problem, point: &[f64], store: Option<&Copies>) -> Evaluation {
    evaluate_stored((problem, false), &problem.tuners_at(point), store, |known| problem.evaluate_keeping(point, known))
}

fn evaluate_stored(
    (problem, every): (&Problem, bool),
    tuners: &[f64],
    store: Option<&Copies>,
    evaluate: impl FnOnce(Option<Known>) -> CachedPoint,
) -> Evaluation {
    let known = store.and_then(|store| store.known(tuners));
    if let Some(end) = store.and_then(|store| store.closed()).filter(|_| !problem.has_met(known.as_ref(), every)) {
        end.request(Halt::Interrupted);
    }
    let CachedPoint { evaluation, learned } = evaluate(known);
    if let Some(store) = store {
        store.answered(tuners, learned);
    }
    evaluation
}
