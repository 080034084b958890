//! The search of a box of uncertain parameters for the worst of every criterion.
//!
//! Nothing but solvers at the usual seam: the uncertain parameters are the tuners, and the only row is the criterion with
//! its sign reversed.

use std::sync::Arc;

use mops_core::statistics::{Sampling, draw};
use mops_core::{
    Budget, CoordinateReport, Demand, Evaluation, FEASIBLE, FailedAt, Problem, Role, Row, Run, SolverOptions, Study,
    Subject, Usage, Watch, WorstReport, stream,
};
use mops_solvers::cma_es::CmaEsOptions;
use mops_solvers::pattern_search::PatternSearchOptions;
use mops_solvers::sqp::SqpOptions;

use crate::tasks::batches::{Quiet, Stage, each};

/// Corners of the box are all looked at up to this dimension.
const MOST_CORNERS: usize = 8;

/// Starts lie at least this far apart in the unit box, where there are enough of them.
const APART: f64 = 0.2;

/// Searches that end this close, in the unit box and in scaled values, ended at the same place.
const SAME_PLACE: f64 = 0.02;
const SAME_VALUE: f64 = 1e-3;

/// How a box is searched.
#[derive(Clone, Copy)]
pub(in crate::tasks) struct Question {
    /// Points at which all criteria are looked at first.
    pub samples: usize,
    /// Local searches per criterion.
    pub starts: usize,
}

/// A design, and the box around it.
pub(in crate::tasks) struct Region {
    /// The study over its uncertain parameters, with the rows that are searched.
    study: Study,
    /// Number of tuners that are not uncertain parameters.
    fixed: usize,
    question: Question,
}

/// The worst of a row.
#[derive(Debug, Clone)]
pub(in crate::tasks) struct Worst {
    /// The criterion, as the study has it.
    pub subject: Subject,
    /// Its row, by index into those of the study over its uncertain parameters.
    pub row: usize,
    /// The case, by index.
    pub case: usize,
    /// Weight in the objective.
    pub weight: f64,
    /// Its value by its demand.
    pub scaled: f64,
    /// Values of the uncertain parameters; empty where every simulation failed.
    pub at: Vec<f64>,
    /// What the search tells of itself.
    pub report: WorstReport,
}

impl Worst {
    /// How bad it is: the scaled value, of an equality its distance from 1.
    pub fn severity(&self) -> f64 {
        severity(self.subject.usage, self.scaled)
    }
}

fn severity(usage: Usage, scaled: f64) -> f64 {
    if usage == Usage::Equality { (scaled - 1.0).abs() } else { scaled }
}

/// What a search of a criterion in one direction is: upwards, or downwards for the other side of an equality.
struct Goal {
    row: usize,
    problem: Problem,
    upwards: bool,
}

/// Where a search ended.
struct End {
    evaluation: Option<Evaluation>,
    simulations: usize,
    failed: Vec<(String, Vec<f64>)>,
}

impl Region {
    /// The box around a design, and the rows that `wanted` picks.
    pub fn new(study: &Study, design: &[f64], wanted: impl Fn(&Row) -> bool, question: Question) -> Self {
        let mut over = study.over_uncertain(design);
        let counts = |row: &Row, study: &Study| study.case_of(row).role() == Role::Calibration;
        let keep: Vec<bool> = over.rows.iter().map(|row| wanted(row) && counts(row, &over)).collect();
        let mut keep = keep.into_iter();
        over.rows.retain(|_| keep.next().expect("one for every row"));
        Self { fixed: over.tuners.len() - over.tasks.uncertain.len(), study: over, question }
    }

    /// The study over its uncertain parameters.
    pub fn study(&self) -> &Study {
        &self.study
    }

    /// Values of the uncertain parameters among those of all tuners.
    fn uncertain<'v>(&self, tuners: &'v [f64]) -> &'v [f64] {
        &tuners[self.fixed..]
    }

    /// Points that stand for the whole box: its nominal point, its corners, and a Sobol sequence.
    fn points(&self, problem: &Problem) -> Vec<Vec<f64>> {
        let n = problem.active().len();
        let mut points = vec![problem.start()];
        if n <= MOST_CORNERS {
            points.extend((0..1usize << n).map(|corner| (0..n).map(|j| f64::from((corner >> j & 1) as u8)).collect()));
        }
        let mut random = stream(self.study.seed, "worst-case");
        points.extend(draw(Sampling::Sobol, self.question.samples, n, &mut random));
        points
    }

    /// The worst of every row, in their order; fewer where the user ends the search. Also the simulations it took.
    pub fn search(&self, watch: &dyn Watch, stage: Stage<'_>) -> (Vec<Worst>, usize) {
        let every = self.every();
        let middle = stage.from + 0.2 * (stage.to - stage.from);
        let first = Stage { to: middle, ..stage };
        let points = self.points(&every);
        let seen = each(&points, first, watch, |point| every.evaluate(point));
        let shared = seen.len() * every.simulations();
        if seen.len() < points.len() {
            return (Vec::new(), shared);
        }
        let goals = self.goals();
        let searches: Vec<(usize, Option<Vec<f64>>)> = goals
            .iter()
            .enumerate()
            .flat_map(|(g, goal)| {
                let starts = self.starts(goal, &seen);
                // The first search goes over the whole box, from the worst point seen.
                let whole = starts.first().map(|_| (g, None));
                whole.into_iter().chain(starts.into_iter().map(move |start| (g, Some(start))))
            })
            .collect();
        let second = Stage { from: middle, ..stage };
        let ends = each(&searches, second, watch, |(g, start)| match start {
            Some(start) => local(&goals[*g], start, watch),
            None => {
                let starts = self.starts(&goals[*g], &seen);
                whole(&goals[*g], &starts[0], watch)
            }
        });
        if ends.len() < searches.len() {
            return (Vec::new(), shared);
        }
        let simulations = shared + ends.iter().map(|end| end.simulations).sum::<usize>();
        let of_goal = |g: usize| searches.iter().zip(&ends).filter(move |((of, _), _)| *of == g).map(|(_, end)| end);
        let worst = (0..self.study.rows.len()).map(|row| {
            let ends: Vec<&End> = (0..goals.len()).filter(|&g| goals[g].row == row).flat_map(&of_goal).collect();
            self.worst(row, &seen, &ends)
        });
        (worst.collect(), simulations)
    }

    /// The problem in which every row counts and has a scaled value.
    fn every(&self) -> Problem {
        let mut study = self.study.clone();
        for row in &mut study.rows {
            row.usage = Usage::Minimise;
            if row.demand == Demand::None {
                row.demand = Demand::Value(1.0);
            }
        }
        Problem::new(Arc::new(study))
    }

    fn goals(&self) -> Vec<Goal> {
        let one = |row: usize, upwards: bool| {
            let mut study = self.study.clone();
            let mut only = study.rows[row].clone();
            (only.usage, only.weight) = (Usage::Minimise, 1.0);
            if upwards {
                only.demand = reversed(only.demand);
            }
            study.rows = vec![only];
            Goal { row, problem: Problem::new(Arc::new(study)), upwards }
        };
        let rows = self.study.rows.iter().enumerate();
        rows.flat_map(|(i, row)| {
            let down = (row.usage == Usage::Equality).then(|| one(i, false));
            std::iter::once(one(i, true)).chain(down)
        })
        .collect()
    }

    /// The worst points that were seen, apart from each other where there are enough.
    fn starts(&self, goal: &Goal, seen: &[Evaluation]) -> Vec<Vec<f64>> {
        let sign = if goal.upwards { 1.0 } else { -1.0 };
        let mut known: Vec<(f64, &Vec<f64>)> =
            seen.iter().filter_map(|e| Some((sign * e.readings[goal.row]?.scaled, &e.point))).collect();
        known.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut starts: Vec<&Vec<f64>> = Vec::new();
        for apart in [APART, 0.0] {
            for (_, point) in &known {
                if starts.len() < self.question.starts && starts.iter().all(|start| distance(start, point) > apart) {
                    starts.push(point);
                }
            }
        }
        starts.into_iter().cloned().collect()
    }

    /// The worst of a row, of all that was seen and of the ends of its searches.
    fn worst(&self, index: usize, seen: &[Evaluation], ends: &[&End]) -> Worst {
        let row = &self.study.rows[index];
        let nominal = seen[0].readings[index].map_or(f64::NAN, |r| r.value);
        let mut reached: Vec<(f64, f64, &Evaluation)> = Vec::new();
        for evaluation in ends.iter().filter_map(|end| end.evaluation.as_ref()) {
            if let Some(reading) = evaluation.readings[0] {
                reached.push((reading.value, scale(row, reading.value), evaluation));
            }
        }
        let looked = seen.iter().filter_map(|e| e.readings[index].map(|r| (r.value, scale(row, r.value), e)));
        let worst = looked.chain(reached.iter().copied()).reduce(|worst, next| {
            if severity(row.usage, next.1) > severity(row.usage, worst.1) { next } else { worst }
        });
        let ended = |(_, scaled, place): (f64, f64, &Evaluation)| {
            let alike = |other: f64| (scaled - other).abs() <= SAME_VALUE * scaled.abs().max(1.0);
            let near = |end: &Evaluation| distance(&place.point, &end.point) <= SAME_PLACE;
            reached.iter().filter(|(_, other, end)| alike(*other) && near(end)).count()
        };
        let demanded = row.demand != Demand::None;
        let (value, scaled) = worst.as_ref().map_or((f64::NAN, f64::NAN), |w| (w.0, w.1));
        let failed_seen = seen.iter().filter(|e| e.readings[index].is_none());
        let why = |e: &Evaluation| {
            let of_job = e.failures.iter().find(|(job, _)| *job == row.job).or(e.failures.first());
            of_job.map_or_else(String::new, |(_, failure)| failure.to_string())
        };
        let mut failed: Vec<(String, Vec<f64>)> =
            failed_seen.map(|e| (why(e), self.uncertain(&e.tuners).to_vec())).collect();
        failed.extend(
            ends.iter().flat_map(|end| &end.failed).map(|(why, at)| (why.clone(), self.uncertain(at).to_vec())),
        );
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
        Worst { subject, row: index, case: self.study.jobs[row.job].case, weight: row.weight, scaled, at, report }
    }

    /// Values of the uncertain parameters, with what a reader wants to know of each.
    pub fn coordinates(&self, at: &[f64]) -> Vec<CoordinateReport> {
        let of = |(tuner, &value): (&mops_core::Tuner, &f64)| CoordinateReport {
            name: tuner.name.clone(),
            value,
            unit: tuner.unit.to_string(),
            at_bound: tuner.at_bound(value),
        };
        self.study.tuners[self.fixed..].iter().zip(at).map(of).collect()
    }
}

/// The scaled value; the value itself where nothing is demanded.
fn scale(row: &Row, value: f64) -> f64 {
    if row.demand == Demand::None { value } else { row.demand.scale(value) }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The demand by which the scaled value is that of another with its sign reversed.
fn reversed(demand: Demand) -> Demand {
    let (good, bad) = match demand {
        Demand::Value(demand) => (0.0, demand),
        Demand::Pair { good, bad } => (good, bad),
        Demand::None => (0.0, 1.0),
    };
    Demand::Pair { good, bad: 2.0 * good - bad }
}

/// From one start: along slopes, then without them, since the worst case may lie on a jump.
fn local(goal: &Goal, start: &[f64], watch: &dyn Watch) -> End {
    let n = start.len();
    let steps: [(_, usize); 2] = [
        (SqpOptions { radius: 0.25, ..SqpOptions::default() }.build(), 40 * (n + 1)),
        (PatternSearchOptions { size: 0.02, tolerance: 1e-6, ..PatternSearchOptions::default() }.build(), 60 * (n + 1)),
    ];
    let mut end = End { evaluation: None, simulations: 0, failed: Vec::new() };
    for (mut solver, evaluations) in steps {
        let from = end.evaluation.as_ref().map_or_else(|| start.to_vec(), |e| e.point.clone());
        search_once(goal, solver.as_mut(), &from, evaluations, watch, &mut end);
    }
    end
}

/// Over the whole box by CMA-ES, then locally.
fn whole(goal: &Goal, start: &[f64], watch: &dyn Watch) -> End {
    let mut end = End { evaluation: None, simulations: 0, failed: Vec::new() };
    let mut solver = CmaEsOptions { restarts: 0, tolerance: 1e-6, ..CmaEsOptions::default() }.build();
    search_once(goal, solver.as_mut(), start, 80 * (start.len() + 1), watch, &mut end);
    let from = end.evaluation.as_ref().map_or_else(|| start.to_vec(), |e| e.point.clone());
    let polished = local(goal, &from, watch);
    end.simulations += polished.simulations;
    end.failed.extend(polished.failed);
    End { evaluation: polished.evaluation, ..end }
}

fn search_once(
    goal: &Goal,
    solver: &mut dyn mops_core::Solver,
    from: &[f64],
    evaluations: usize,
    watch: &dyn Watch,
    end: &mut End,
) {
    let quiet = Quiet(watch);
    let mut run = Run::new(&goal.problem, Budget { evaluations }, &quiet);
    run.solve(solver, from);
    end.simulations += (run.archive().len() + run.linearisations()) * goal.problem.simulations();
    let why = run.failures().first().map_or_else(String::new, |failure| failure.first.to_string());
    let failed = run.archive().iter().filter(|record| record.merit.objective.is_infinite());
    end.failed.extend(failed.map(|record| (why.clone(), record.tuners.clone())));
    let found = mops_core::Oracle::best(&run).filter(|best| best.scaled.is_some());
    if let Some(found) = found {
        let better = end.evaluation.as_ref().is_none_or(|known| found.merit.is_better_than(&known.merit));
        if better {
            end.evaluation = Some(found.clone());
        }
    }
}
