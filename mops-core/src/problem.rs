//! The weighted min-max problem over the unit box that a study poses.

use std::sync::Arc;

use rand::Rng;
use rayon::prelude::*;

use crate::criterion::{Tangent, Usage, Value};
use crate::demand::Demand;
use crate::evaluation::{Evaluation, Merit, Objective, Reading};
use crate::experiment::Role;
use crate::failure::Failure;
use crate::known::{JobValues, Kept, KeptSlopes, Known, RowSlopes as KnownSlopes, RowValue};
use crate::model::{Analysis, Job};
use crate::random::stream;
use crate::scalar::Dual;
use crate::solver::Shape;
use crate::study::{Row, Study, Task};
use crate::tuner::Tuner;

/// A study as solvers see it: active tuners as coordinates of the unit box, criteria as rows of scaled values.
#[derive(Clone)]
pub struct Problem {
    study: Arc<Study>,
    /// Active tuners, by index.
    active: Vec<usize>,
    /// Values of the tuners that are not active.
    base: Vec<f64>,
    shape: Shape,
    /// Jobs of the problem.
    jobs: Vec<usize>,
    /// Those of them that a solver's points need: the others are only watched.
    counting: Vec<usize>,
}

/// Slopes of the rows and residuals, as in [`crate::Linearisation`].
pub struct Slopes {
    /// Derivative of the scaled value of row `i` along coordinate `j`: `rows[i][j]`; 0 for rows that are only watched.
    pub rows: Vec<Vec<f64>>,
    /// Derivative of residual `i` along coordinate `j`: `residuals[j][i]`.
    pub residuals: Vec<Vec<f64>>,
}

/// A row, by index, with its derivative along every coordinate.
type RowSlopes = (usize, Vec<Value>);

impl Problem {
    /// The problem of the study itself: tuners of the study and of its calibration cases; the other cases are watched.
    pub fn new(study: Arc<Study>) -> Self {
        let base = study.start();
        let active = active(&study);
        Self::with(study, active, base, own_usage)
    }

    /// The problem of one case alone: the tuners of this case (free start values, and all with `per-case = true`) are active,
    /// all else keeps the values in `tuners`. This estimates what is local to an experiment whose data must move no parameter
    /// of the study.
    pub fn of_case(study: Arc<Study>, case: usize, tuners: &[f64]) -> Self {
        let moves = |tuner: &Tuner| tuner.active && tuner.case == Some(case);
        let active = (0..study.tuners.len()).filter(|&i| moves(&study.tuners[i])).collect();
        let mut problem = Self::with(study, active, tuners.to_vec(), |row, study| {
            if study.jobs[row.job].case == case { row.usage } else { Usage::Monitor }
        });
        let here = |job: &usize| problem.study.jobs[*job].case == case;
        problem.jobs.retain(here);
        problem.counting.retain(here);
        problem
    }

    /// Sizes and kinds of the problem of a study, as far as they are known without a simulation: a sum is taken for one of
    /// squares, of one residual.
    pub fn outline(study: &Study) -> Shape {
        let residuals = usize::from(study.objective == Objective::Sum);
        Shape { residuals, ..shape(study, &active(study), own_usage) }
    }

    fn with(study: Arc<Study>, active: Vec<usize>, base: Vec<f64>, usage: impl Fn(&Row, &Study) -> Usage) -> Self {
        let shape = shape(&study, &active, usage);
        let jobs: Vec<usize> = (0..study.jobs.len()).collect();
        let counts = |job: &usize| {
            (study.rows.iter().zip(&shape.rows)).any(|(row, (usage, _))| row.job == *job && *usage != Usage::Monitor)
        };
        let counting = jobs.iter().copied().filter(counts).collect();
        let mut problem = Self { study, active, base, shape, jobs, counting };
        problem.shape.residuals = problem.count_residuals();
        problem
    }

    /// Length of the residual vector, from an evaluation that succeeds: a criterion knows it only once it has seen its
    /// data. Looked for at the start and, where that fails, at some points of the box.
    fn count_residuals(&self) -> usize {
        if self.shape.objective != Objective::Sum {
            return 0;
        }
        let mut random = stream(self.study.seed, "residuals");
        let elsewhere = (0..20).map(|_| self.active.iter().map(|_| random.random()).collect::<Vec<f64>>());
        let mut points = std::iter::once(self.start()).chain(elsewhere);
        let succeeds = points.find_map(|point| Some(self.evaluate(&point)).filter(|e| e.scaled.is_some()));
        succeeds.map_or(0, |evaluation| evaluation.residuals.len())
    }

    /// The problem as what concludes a run sees it: its simulations end only where that is insisted on.
    #[must_use]
    pub fn concluding(&self) -> Self {
        let mut study = Study::clone(&self.study);
        study.cases.iter_mut().for_each(|case| case.cancellation = case.cancellation.patient());
        Self { study: Arc::new(study), ..self.clone() }
    }

    /// Whether its simulations were asked to end.
    pub fn is_cancelled(&self) -> bool {
        self.study.cases.iter().any(|case| case.cancellation.requested().is_some())
    }

    /// The study.
    pub fn study(&self) -> &Arc<Study> {
        &self.study
    }

    /// Sizes and kinds.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Active tuners, as indices into the study's.
    pub fn active(&self) -> &[usize] {
        &self.active
    }

    /// The start values as a point of the unit box.
    pub fn start(&self) -> Vec<f64> {
        self.point_of(&self.base)
    }

    /// The point of the unit box at which the active tuners have the given values.
    pub fn point_of(&self, tuners: &[f64]) -> Vec<f64> {
        self.active.iter().map(|&i| self.study.tuners[i].position_of(tuners[i])).collect()
    }

    /// Values of all tuners at a point of the unit box.
    pub fn tuners_at(&self, point: &[f64]) -> Vec<f64> {
        let mut values = self.base.clone();
        for (&i, &u) in self.active.iter().zip(point) {
            values[i] = self.study.tuners[i].value_at(u);
        }
        self.study.apply_ties(&mut values);
        values
    }

    /// Evaluates a point of the unit box; its simulations run in parallel. Cases that are only watched are left out.
    pub fn evaluate(&self, point: &[f64]) -> Evaluation {
        self.evaluate_tuners(point.to_vec(), self.tuners_at(point), &self.counting)
    }

    /// Evaluates given values of all tuners, which need not lie within their bounds, in every case.
    pub fn evaluate_at(&self, tuners: &[f64]) -> Evaluation {
        self.evaluate_tuners(self.point_of(tuners), tuners.to_vec(), &self.jobs)
    }

    /// Whether something is known of every simulation that the evaluation of a point takes, in `every` case or in those that
    /// count.
    pub fn has_met(&self, known: Option<&Known>, every: bool) -> bool {
        let mut jobs = if every { self.jobs.iter() } else { self.counting.iter() };
        jobs.all(|&job| known.is_some_and(|known| known.job(job).is_some()))
    }

    /// Number of simulations that the evaluation of a point takes.
    pub fn simulations(&self) -> usize {
        self.counting.len()
    }

    /// The analysis of one job with every signal, to look at; `horizon` in s where another is wanted.
    ///
    /// # Errors
    /// The failure of the simulation.
    pub fn analyse_all(&self, job: usize, tuners: &[f64], horizon: Option<f64>) -> Result<Analysis, Failure> {
        let plan = &self.study.jobs[job];
        let model = &self.study.models[plan.model].1;
        let signals: Vec<usize> = (0..model.interface().signals.len()).collect();
        model.analyse(&Job {
            case: &self.study.cases[plan.case],
            parameters: &self.study.parameters(plan, tuners),
            signals: &signals,
            horizon: horizon.unwrap_or(plan.horizon),
        })
    }

    /// A point that was not simulated: no row has a value.
    pub fn unknown(&self, tuners: &[f64]) -> Evaluation {
        self.judge(self.point_of(tuners), tuners.to_vec(), std::iter::empty())
    }

    fn evaluate_tuners(&self, point: Vec<f64>, tuners: Vec<f64>, jobs: &[usize]) -> Evaluation {
        let values: Vec<JobValues> = jobs.par_iter().map(|&job| self.run_job(job, &tuners)).collect();
        self.judge(point, tuners, jobs.iter().copied().zip(values))
    }

    /// The evaluation of a point of which something is known already: only the jobs that are not known are run.
    pub fn evaluate_keeping(&self, point: &[f64], known: Option<Known>) -> Kept {
        self.keep(point.to_vec(), self.tuners_at(point), &self.counting, known)
    }

    /// The same as [`Problem::evaluate_at`], where something is known already.
    pub fn evaluate_at_keeping(&self, tuners: &[f64], known: Option<Known>) -> Kept {
        self.keep(self.point_of(tuners), tuners.to_vec(), &self.jobs, known)
    }

    fn keep(&self, point: Vec<f64>, tuners: Vec<f64>, jobs: &[usize], known: Option<Known>) -> Kept {
        let known = known.unwrap_or_default();
        let values: Vec<(usize, JobValues, bool)> = (jobs.par_iter())
            .map(|&job| match known.job(job).filter(|values| self.suffices(job, values)) {
                Some(values) => (job, values.clone(), false),
                None => (job, self.run_job(job, &tuners), true),
            })
            .collect();
        let keeps_residuals = self.shape.residuals > 0;
        let is_new = |(_, values, new): &&(usize, JobValues, bool)| *new && *values != Err(Failure::Cancelled);
        let learned: Vec<(usize, JobValues)> = (values.iter().filter(is_new))
            .map(|(job, values, _)| (*job, if keeps_residuals { values.clone() } else { without_residuals(values) }))
            .collect();
        let learned = (!learned.is_empty()).then_some(Known { jobs: learned });
        Kept { evaluation: self.judge(point, tuners, values.into_iter().map(|(job, v, _)| (job, v))), learned }
    }

    /// The evaluation of a point, of which everything that counts is known; `None` where it is not.
    pub fn known(&self, tuners: &[f64], known: &Known) -> Option<Evaluation> {
        let of_job = |&job: &usize| Some((job, known.job(job).filter(|values| self.suffices(job, values))?.clone()));
        let values: Vec<(usize, JobValues)> = self.counting.iter().map(of_job).collect::<Option<_>>()?;
        Some(self.judge(self.point_of(tuners), tuners.to_vec(), values.into_iter()))
    }

    /// Whether what is known of a job is all that this problem asks of it.
    fn suffices(&self, job: usize, values: &JobValues) -> bool {
        let Ok(values) = values else { return true };
        let rows = self.study.rows.iter().zip(&self.shape.rows).enumerate().filter(|(_, (row, _))| row.job == job);
        let needs_residuals = |usage: Usage| self.shape.residuals > 0 && usage == Usage::Minimise;
        rows.into_iter().all(|(index, (_, (usage, _)))| match values.iter().find(|(row, _)| *row == index) {
            Some((_, Ok(value))) => !needs_residuals(*usage) || !value.residuals.is_empty(),
            Some((_, Err(_))) => true,
            None => false,
        })
    }

    /// What the values of jobs are worth under the demands of the study.
    fn judge(&self, point: Vec<f64>, tuners: Vec<f64>, jobs: impl Iterator<Item = (usize, JobValues)>) -> Evaluation {
        let study = &self.study;
        let mut readings = vec![None; study.rows.len()];
        let mut residuals = vec![Vec::new(); study.rows.len()];
        let mut failures = Vec::new();
        for (job, result) in jobs {
            match result {
                Ok(values) => {
                    for (row, value) in values {
                        match value {
                            Ok(value) => {
                                readings[row] = Some(study.rows[row].reading(&value));
                                residuals[row] = value.residuals;
                            }
                            Err(why) => {
                                failures.push((job, Failure::Criterion(format!("{}: {why}", study.rows[row].name))))
                            }
                        }
                    }
                }
                Err(failure) => failures.push((job, failure)),
            }
        }
        let scaled = self.scaled(&readings);
        let merit = scaled.as_ref().map_or(Merit::FAILED, |scaled| self.shape.merit(scaled));
        let residuals = if scaled.is_some() { self.residuals(residuals) } else { Vec::new() };
        Evaluation { point, tuners, readings, scaled, residuals, failures, merit }
    }

    /// The values of all rows that read one job. A criterion without a value takes none from the others.
    fn run_job(&self, job: usize, tuners: &[f64]) -> JobValues {
        let study = &self.study;
        let plan = &study.jobs[job];
        let case = &study.cases[plan.case];
        if case.cancellation.requested().is_some() {
            return Err(Failure::Cancelled);
        }
        let parameters = study.parameters(plan, tuners);
        let request = Job { case, parameters: &parameters, signals: &plan.signals, horizon: plan.horizon };
        let analysis = study.models[plan.model].1.analyse(&request)?;
        let rows = study.rows.iter().enumerate().filter(|(_, row)| row.job == job);
        let value = |row: &Row| match row.criterion.value(case, &analysis) {
            Ok(value) if !value.number.is_finite() => Err("its value is not finite".to_owned()),
            other => other,
        };
        // A criterion of a large linear system takes as long as a simulation.
        let unless_cancelled = |(index, row)| match case.cancellation.requested() {
            Some(_) => Err(Failure::Cancelled),
            None => Ok((index, value(row))),
        };
        rows.map(unless_cancelled).collect()
    }

    /// The slopes at an evaluated point, from the tangents of the models; `None` where a model, a criterion or a tuner
    /// has no exact ones. `reach` is the distance within which they are to describe the problem.
    pub fn slopes(&self, at: &Evaluation, reach: f64) -> Option<Slopes> {
        self.scaled_slopes(at, self.row_slopes(at, reach)?)
    }

    /// The same where the derivatives of the rows may be known already.
    pub fn slopes_keeping(
        &self,
        at: &Evaluation,
        reach: f64,
        known: Option<Option<KnownSlopes>>,
    ) -> KeptSlopes<Slopes> {
        let known = known.filter(|known| known.as_ref().is_none_or(|rows| self.suffice(rows)));
        let (rows, new) = known.map_or_else(|| (self.row_slopes(at, reach), true), |known| (known, false));
        // Of derivatives that were cut off nothing is known.
        let learned = (new && (rows.is_some() || !self.is_cancelled())).then(|| rows.clone());
        KeptSlopes { slopes: rows.and_then(|rows| self.scaled_slopes(at, rows)), learned }
    }

    /// Whether known derivatives are all that this problem asks for.
    fn suffice(&self, known: &KnownSlopes) -> bool {
        let n = self.active.len();
        self.shape.rows.iter().enumerate().all(|(index, (usage, _))| {
            match known.iter().find(|(row, _)| *row == index) {
                _ if *usage == Usage::Monitor => true,
                None => false,
                Some((_, along)) => {
                    let needs_residuals = self.shape.residuals > 0 && *usage == Usage::Minimise;
                    along.len() == n && !(needs_residuals && along.iter().any(|slope| slope.residuals.is_empty()))
                }
            }
        })
    }

    /// The derivatives of the rows that count along every coordinate, in the units of their criteria.
    fn row_slopes(&self, at: &Evaluation, reach: f64) -> Option<KnownSlopes> {
        if self.shape.spacing.iter().any(|&spacing| spacing > 0.0) || at.scaled.is_none() {
            return None;
        }
        let moves = self.tuner_slopes(&at.tuners);
        let of_jobs: Vec<Option<Vec<RowSlopes>>> =
            self.counting.par_iter().map(|&job| self.job_slopes(job, &at.tuners, &moves, reach)).collect();
        let mut rows: KnownSlopes = of_jobs.into_iter().collect::<Option<Vec<_>>>()?.into_iter().flatten().collect();
        if self.shape.residuals == 0 {
            rows.iter_mut().flat_map(|(_, along)| along).for_each(|slope| slope.residuals.clear());
        }
        Some(rows)
    }

    /// Slopes of the scaled values and of the weighted residuals.
    fn scaled_slopes(&self, at: &Evaluation, of_rows: KnownSlopes) -> Option<Slopes> {
        let (count, n) = (self.study.rows.len(), self.active.len());
        let mut rows = vec![vec![0.0; n]; count];
        let mut residuals = vec![vec![Vec::new(); count]; n];
        for (row, slopes) in of_rows.into_iter().filter(|(row, _)| self.shape.rows[*row].0 != Usage::Monitor) {
            for (j, slope) in slopes.into_iter().enumerate() {
                rows[row][j] = slope.number * at.readings[row].map_or(f64::NAN, |reading| reading.slope);
                residuals[j][row] = slope.residuals;
            }
        }
        let residuals: Vec<Vec<f64>> = residuals.into_iter().map(|of_rows| self.residuals(of_rows)).collect();
        let finite = rows.iter().chain(&residuals).flatten().all(|slope| slope.is_finite());
        finite.then_some(Slopes { rows, residuals })
    }

    /// The derivative of all tuners along each coordinate of the unit box, ties included.
    pub(crate) fn tuner_slopes(&self, tuners: &[f64]) -> Vec<Vec<f64>> {
        let along = |&active: &usize| {
            let mut duals: Vec<Dual<1>> = tuners.iter().map(|&value| Dual::from(value)).collect();
            duals[active].tangent[0] = self.study.tuners[active].slope_at(tuners[active]);
            self.study.apply_ties(&mut duals);
            duals.iter().map(|dual| dual.tangent[0]).collect()
        };
        self.active.iter().map(along).collect()
    }

    /// The derivative of every row that counts and reads one job, along every coordinate.
    fn job_slopes(&self, job: usize, tuners: &[f64], moves: &[Vec<f64>], reach: f64) -> Option<Vec<RowSlopes>> {
        let study = &self.study;
        let plan = &study.jobs[job];
        let case = &study.cases[plan.case];
        if case.cancellation.requested().is_some() {
            return None;
        }
        let seed = |along: &Vec<f64>| study.parameter_slopes(plan, along);
        let seeds: Vec<Vec<f64>> = moves.iter().map(seed).collect();
        // Start values of other cases move nothing here.
        let moving: Vec<usize> = (0..seeds.len()).filter(|&j| seeds[j].iter().any(|&s| s != 0.0)).collect();
        let wanted: Vec<Vec<f64>> = moving.iter().map(|&j| seeds[j].clone()).collect();
        let parameters = study.parameters(plan, tuners);
        let request = Job { case, parameters: &parameters, signals: &plan.signals, horizon: plan.horizon };
        let (analysis, tangents) = study.models[plan.model].1.tangents(&request, &wanted)?.ok()?;
        let rows = study.rows.iter().zip(&self.shape.rows).enumerate();
        let rows = rows.filter(|(_, (row, (usage, _)))| row.job == job && *usage != Usage::Monitor);
        rows.map(|(index, (row, _))| {
            if case.cancellation.requested().is_some() {
                return None;
            }
            let value = row.criterion.value(case, &analysis).ok()?;
            let still = Value { residuals: vec![0.0; value.residuals.len()], ..Value::default() };
            let mut slopes = vec![still; seeds.len()];
            for (&j, along) in moving.iter().zip(&tangents) {
                let tangent = Tangent { analysis: &analysis, value: &value, along, reach };
                slopes[j] = row.criterion.slope(case, &tangent).ok()?;
            }
            Some((index, slopes))
        })
        .collect()
    }

    fn scaled(&self, readings: &[Option<Reading>]) -> Option<Vec<f64>> {
        self.shape
            .rows
            .iter()
            .zip(readings)
            .map(|((usage, _), reading)| match (usage, reading) {
                (Usage::Monitor, _) => Some(0.0),
                (_, reading) => reading.map(|r| r.scaled),
            })
            .collect()
    }

    /// Residuals of all rows to be minimised, weighted so that their squares sum to the objective; empty if one of the
    /// rows is no sum of squares.
    fn residuals(&self, of_rows: Vec<Vec<f64>>) -> Vec<f64> {
        let mut all = Vec::new();
        if self.shape.objective != Objective::Sum {
            return all;
        }
        for (row, residuals) in of_rows.into_iter().enumerate().filter(|(row, _)| self.is_minimised(*row)) {
            let Some(factor) = self.residual_factor(row).filter(|_| !residuals.is_empty()) else { return Vec::new() };
            all.extend(residuals.into_iter().map(|r| factor * r));
        }
        all
    }

    /// Whether a row enters the objective.
    pub(crate) fn is_minimised(&self, row: usize) -> bool {
        self.shape.rows[row].0 == Usage::Minimise
    }

    /// Factor of the residuals of a row in the residual vector: the root of weight / demand; `None` without such a demand.
    pub(crate) fn residual_factor(&self, row: usize) -> Option<f64> {
        match self.study.rows[row] {
            Row { demand: Demand::AtMost(demand), reversed: false, .. } => {
                Some((self.shape.rows[row].1 / demand).sqrt())
            }
            _ => None,
        }
    }
}

/// The active tuners of a study and of its calibration cases, as indices.
fn active(study: &Study) -> Vec<usize> {
    let counts = |case: Option<usize>| case.is_none_or(|c| study.cases[c].role() == Role::Calibration);
    (0..study.tuners.len()).filter(|&i| study.tuners[i].active && counts(study.tuners[i].case)).collect()
}

/// What a row of a study is for: in cases that are no calibration data it is watched.
fn own_usage(row: &Row, study: &Study) -> Usage {
    if study.case_of(row).role() == Role::Calibration { row.usage } else { Usage::Monitor }
}

/// Sizes and kinds, without residuals.
fn shape(study: &Study, active: &[usize], usage: impl Fn(&Row, &Study) -> Usage) -> Shape {
    let rows = study.rows.iter().map(|row| (usage(row, study), row.weight)).collect();
    let spacing = active.iter().map(|&i| study.tuners[i].spacing()).collect();
    let points = if study.task == Task::Pareto { study.tasks.pareto.points } else { 0 };
    Shape { spacing, rows, objective: study.objective, points, residuals: 0 }
}

/// Values of a job as they are kept where nobody needs the terms of sums of squares.
fn without_residuals(values: &JobValues) -> JobValues {
    let bare = |(row, value): &RowValue| {
        let value = value.as_ref().map(|v| Value { residuals: Vec::new(), ..v.clone() });
        (*row, value.map_err(Clone::clone))
    };
    values.as_ref().map(|values| values.iter().map(bare).collect()).map_err(Clone::clone)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn feasible_points_come_first_then_small_violations_then_failures() {
        let merit = |violation, objective| Merit { violation, objective };
        assert!(merit(0.0, 5.0).is_better_than(&merit(0.1, 1.0)));
        assert!(merit(0.0, 1.0).is_better_than(&merit(1e-7, 2.0)));
        assert!(merit(0.1, 9.0).is_better_than(&merit(0.2, 1.0)));
        assert!(merit(9.0, 9.0).is_better_than(&Merit::FAILED));
        assert!(!Merit::FAILED.is_better_than(&Merit::FAILED));
    }
}
