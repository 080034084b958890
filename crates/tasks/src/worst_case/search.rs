//! Search of a box of uncertain parameters for the worst case of every criterion.
//!
//! The search uses ordinary solvers: the uncertain parameters are the tuners, and the only row is the criterion with
//! reversed sign.

use std::sync::Arc;

use mops_core::{
    Demand, Evaluation, Problem, Role, Study, Usage, Watch,
    evaluation::{FEASIBLE, Reading},
    study::Row,
};
use mops_math::stream;
use mops_statistics::{Sampling, draw};

use crate::uncertain::{CoordinateReport, FailedAt, Subject, WorstReport};

use super::climb::{End, Goal, local, whole};
use crate::batches::{Stage, each};
use crate::copies::{Copies, evaluate};
use crate::search::Options;

/// Largest dimension of the box for which all corners are evaluated.
const MOST_CORNERS: usize = 8;

/// Smallest distance between starts in the unit box, if there are enough starts.
const APART: f64 = 0.2;

/// Largest distance in the unit box between ends of searches that count as the same point.
const SAME_PLACE: f64 = 0.02;
/// Largest relative difference in scaled value between ends of searches that count as the same point.
const SAME_VALUE: f64 = 1e-3;

/// Effort of the search of a box.
#[derive(Clone, Copy)]
pub(crate) struct Effort {
    /// Number of samples at which all criteria are evaluated first.
    pub samples: usize,
    /// Number of local searches per criterion.
    pub starts: usize,
}

/// Design, and the box of uncertain parameters around it.
pub(crate) struct Region {
    /// Study over its uncertain parameters, with the rows that are searched.
    study: Study,
    store: Option<Copies>,
    /// Number of tuners that are not uncertain parameters.
    fixed: usize,
    effort: Effort,
}

/// Worst case of a row.
#[derive(Debug, Clone)]
pub(crate) struct Worst {
    /// Criterion of the study.
    pub subject: Subject,
    /// Index of the row in the study over its uncertain parameters.
    pub row: usize,
    /// Index of the case.
    pub case: usize,
    /// Weight in the objective.
    pub weight: f64,
    /// Scaled value: value divided by demand.
    pub scaled: f64,
    /// Values of the uncertain parameters; empty if every simulation failed.
    pub at: Vec<f64>,
    /// Report of the search.
    pub report: WorstReport,
}

impl Worst {
    /// Returns the scaled value; for an equality, its distance from 1.
    pub fn severity(&self) -> f64 {
        severity(self.subject.usage, self.scaled)
    }
}

fn severity(usage: Usage, scaled: f64) -> f64 {
    if usage == Usage::Equality { (scaled - 1.0).abs() } else { scaled }
}

impl Region {
    /// Creates the box around a design, with the rows selected by `wanted`.
    pub fn new(study: &Study, design: &[f64], wanted: impl Fn(&Row) -> bool, effort: Effort) -> Self {
        let over = study.over_uncertain(design);
        let counts = |row: &Row, study: &Study| study.case_of(row).role() == Role::Calibration;
        let rows = over.rows().iter().filter(|row| wanted(row) && counts(row, &over)).cloned().collect();
        let over = over.with_rows(rows);
        Self { fixed: over.tuners().len() - over.uncertain().len(), study: over, store: None, effort }
    }

    /// Adds the store of the study from which the region was derived.
    pub fn keeping(mut self, options: &Options, study: &Study) -> Self {
        self.store = Copies::of(options, study, &self.study, &[]);
        self
    }

    /// Returns the study over its uncertain parameters.
    pub fn study(&self) -> &Study {
        &self.study
    }

    /// Returns the values of the uncertain parameters out of those of all tuners.
    fn uncertain<'v>(&self, tuners: &'v [f64]) -> &'v [f64] {
        &tuners[self.fixed..]
    }

    /// Returns samples of the box: its nominal point, its corners, and a Sobol sequence.
    fn points(&self, problem: &Problem) -> Vec<Vec<f64>> {
        let n = problem.active().len();
        let mut points = vec![problem.start()];
        if n <= MOST_CORNERS {
            points.extend((0..1usize << n).map(|corner| (0..n).map(|j| f64::from((corner >> j & 1) as u8)).collect()));
        }
        let mut random = stream(self.study.seed(), "worst-case");
        points.extend(draw(Sampling::Sobol, self.effort.samples, n, &mut random));
        points
    }

    /// Searches the worst case of every row. Returns them in the order of the rows, or an empty list after a stop
    /// request, and the number of simulations.
    pub fn search(&self, watch: &dyn Watch, stage: Stage<'_>) -> (Vec<Worst>, usize) {
        let every = self.every();
        let points = self.points(&every);
        let middle = stage.from + 0.2 * (stage.to - stage.from);
        let seen =
            each(&points, Stage { to: middle, ..stage }, watch, |point| evaluate(&every, point, self.store.as_ref()));
        let shared = seen.len() * every.simulations();
        if seen.len() < points.len() {
            return (Vec::new(), shared);
        }
        let goals = Goal::all(&self.study, self.store.as_ref());
        // The first search of each goal covers the whole box, from the worst sample.
        let searches: Vec<(usize, bool, Vec<f64>)> = goals
            .iter()
            .enumerate()
            .flat_map(|(g, goal)| {
                let starts = self.starts(goal, &seen);
                let first = starts.first().map(|start| (g, true, start.clone()));
                first.into_iter().chain(starts.into_iter().map(move |start| (g, false, start)))
            })
            .collect();
        let ends = each(&searches, Stage { from: middle, ..stage }, watch, |(g, everywhere, start)| {
            if *everywhere { whole(&goals[*g], start, watch) } else { local(&goals[*g], start, watch) }
        });
        let simulations = shared + ends.iter().map(|end| end.simulations).sum::<usize>();
        if ends.len() < searches.len() {
            return (Vec::new(), simulations);
        }
        let worst = |row: usize| {
            let of_row = searches.iter().zip(&ends).filter(|((g, ..), _)| goals[*g].row == row);
            self.worst(row, &seen, &of_row.map(|(_, end)| end).collect::<Vec<_>>())
        };
        ((0..self.study.rows().len()).map(worst).collect(), simulations)
    }

    /// Returns the problem in which every row is minimised and has a scaled value.
    fn every(&self) -> Problem {
        let mut rows = self.study.rows().to_vec();
        for row in &mut rows {
            row.usage = Usage::Minimise;
            if row.demand == Demand::None {
                row.demand = Demand::AtMost(1.0);
            }
        }
        Problem::new(Arc::new(self.study.clone().with_rows(rows)))
    }

    /// Returns the worst samples, at least [`APART`] from each other if there are enough.
    fn starts(&self, goal: &Goal, seen: &[Evaluation]) -> Vec<Vec<f64>> {
        let sign = if goal.upwards { 1.0 } else { -1.0 };
        let mut known: Vec<(f64, &Vec<f64>)> =
            seen.iter().filter_map(|e| Some((sign * e.readings[goal.row]?.scaled, &e.point))).collect();
        known.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut starts: Vec<&Vec<f64>> = Vec::new();
        for apart in [APART, 0.0] {
            for (_, point) in &known {
                if starts.len() < self.effort.starts && starts.iter().all(|start| distance(start, point) > apart) {
                    starts.push(point);
                }
            }
        }
        starts.into_iter().cloned().collect()
    }

    /// Returns the worst case of a row among the samples and the ends of its searches.
    fn worst(&self, index: usize, seen: &[Evaluation], ends: &[&End]) -> Worst {
        let row = &self.study.rows()[index];
        let nominal = seen[0].readings[index].map_or(f64::NAN, |r| r.value);
        let mut reached: Vec<(f64, f64, &Evaluation)> = Vec::new();
        for evaluation in ends.iter().filter_map(|end| end.evaluation.as_ref()) {
            if let Some(reading) = evaluation.readings[0] {
                reached.push((reading.value, scale(row, reading), evaluation));
            }
        }
        let sampled = seen.iter().filter_map(|e| e.readings[index].map(|r| (r.value, scale(row, r), e)));
        let worst = sampled.chain(reached.iter().copied()).reduce(|worst, next| {
            if severity(row.usage, next.1) > severity(row.usage, worst.1) { next } else { worst }
        });
        let ended = |(_, scaled, place): (f64, f64, &Evaluation)| {
            let alike = |other: f64| (scaled - other).abs() <= SAME_VALUE * scaled.abs().max(1.0);
            let near = |end: &Evaluation| distance(&place.point, &end.point) <= SAME_PLACE;
            reached.iter().filter(|(_, other, end)| alike(*other) && near(end)).count()
        };
        let demanded = row.demand != Demand::None;
        let (value, scaled) = worst.as_ref().map_or((f64::NAN, f64::NAN), |w| (w.0, w.1));
        let failed = self.failed(index, seen, ends);
        let at: Vec<f64> = worst.as_ref().map_or_else(Vec::new, |w| self.uncertain(&w.2.tuners).to_vec());
        let subject = Subject::of(&self.study, row, nominal);
        let report = WorstReport {
            of: subject.clone(),
            value,
            scaled: if demanded { scaled } else { f64::NAN },
            met: !demanded
                || severity(row.usage, scaled) <= if row.usage == Usage::Equality { FEASIBLE } else { 1.0 + FEASIBLE },
            at: self.coordinates(&at),
            starts: ends.len(),
            ended_here: worst.map_or(0, ended),
            simulations: ends.iter().map(|end| end.simulations).sum(),
            failed: failed.len(),
            failure: failed.first().map(|(why, at)| FailedAt { why: why.clone(), at: self.coordinates(at) }),
            slices: Vec::new(),
        };
        Worst { subject, row: index, case: self.study.jobs()[row.job].case, weight: row.weight, scaled, at, report }
    }

    /// Returns the reason and the point of each failed simulation of a row.
    fn failed(&self, index: usize, seen: &[Evaluation], ends: &[&End]) -> Vec<(String, Vec<f64>)> {
        let job = self.study.rows()[index].job;
        let why = |e: &Evaluation| {
            let of_job = e.failures.iter().find(|(of, _)| *of == job);
            of_job.map_or_else(String::new, |(_, failure)| failure.to_string())
        };
        let sampled = seen.iter().filter(|e| e.readings[index].is_none()).map(|e| (why(e), &e.tuners));
        let searched = ends.iter().flat_map(|end| &end.failed).map(|(why, tuners)| (why.clone(), tuners));
        sampled.chain(searched).map(|(why, tuners)| (why, self.uncertain(tuners).to_vec())).collect()
    }

    /// Returns the values of the uncertain parameters with name, unit and bound for a report.
    pub fn coordinates(&self, at: &[f64]) -> Vec<CoordinateReport> {
        let of = |(tuner, &value): (&mops_core::study::Tuner, &f64)| CoordinateReport {
            name: tuner.name.clone(),
            value,
            unit: tuner.unit.to_string(),
            at_bound: tuner.at_bound(value),
        };
        self.study.tuners()[self.fixed..].iter().zip(at).map(of).collect()
    }
}

/// Returns the scaled value, independent of the sign in the problem; without a demand, the value itself.
fn scale(row: &Row, reading: Reading) -> f64 {
    match reading.value {
        // A target that was never reached has a scaled value above 1.
        value if value.is_nan() => reading.scaled.abs(),
        value if row.demand == Demand::None => value,
        value => row.demand.scale(value),
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
