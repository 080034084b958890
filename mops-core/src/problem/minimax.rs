//! The minimax problem.

use std::sync::Arc;

use mops_language::Dual;
use mops_math as math;
use mops_math::stream;
use rand::Rng;
use rayon::prelude::*;

use super::known::{CachedGradients, CachedPoint, JobValues, Known, RowSlopes, RowValue, entry};
use super::objectives::FrontObjective;
use crate::case::Role;
use crate::criterion::{Demand, Loss, Tangent, Usage, Value};
use crate::evaluation::{Evaluation, Merit, Objective, Reading};
use crate::failure::{Failure, caught};
use crate::model::{Analysis, Job};
use crate::solver::Shape;
use crate::study::task::ParetoTask;
use crate::study::{Row, Scale, Study, Tuner};

/// The optimisation problem of a study: active tuners as coordinates of the unit box, criteria as rows of scaled
/// values.
#[derive(Clone)]
pub struct Problem {
    pub(super) study: Arc<Study>,
    /// Active tuners, by index.
    active: Vec<usize>,
    /// Values of the tuners that are not active.
    base: Vec<f64>,
    pub(super) shape: Shape,
    /// Jobs of the problem.
    jobs: Vec<usize>,
    /// Jobs needed for the points of a solver: all except monitored ones.
    counting: Vec<usize>,
    /// Rows that read each job of the study.
    rows_of: Arc<Vec<Vec<usize>>>,
}

/// Derivatives of the rows and residuals, as in [`crate::solver::Linearisation`].
pub struct Slopes {
    /// Derivative of the scaled value of row `i` along coordinate `j`: `rows[i][j]`; 0 for monitored rows.
    pub rows: Vec<Vec<f64>>,
    /// Derivative of residual `i` along coordinate `j`: `residuals[j][i]`.
    pub residuals: Vec<Vec<f64>>,
    /// Residuals at the point.
    pub at: Vec<f64>,
}

/// A row, by index, with its value and its derivative along every coordinate.
pub(super) type RowTangent = (usize, Value, Vec<Value>);

impl Problem {
    /// Creates the problem of the study itself: tuners of the study and of its calibration cases. The other cases are
    /// monitored.
    pub fn new(study: Arc<Study>) -> Self {
        let base = study.start();
        let active = active(&study);
        Self::with(study, active, base, own_usage)
    }

    /// Creates the problem of a single case. The tuners of this case (free initial states, and all with
    /// `per-case = true`) are active; all others keep their values in `tuners`. This estimates the local parameters of
    /// an experiment whose data must not influence the parameters of the study.
    pub fn of_case(study: Arc<Study>, case: usize, tuners: &[f64]) -> Self {
        let moves = |tuner: &Tuner| tuner.active && tuner.case == Some(case);
        let active = (0..study.tuners.len()).filter(|&i| moves(&study.tuners[i])).collect();
        let mut problem = Self::with(study, active, tuners.to_vec(), |row, study| {
            if study.jobs[row.job].case == case { row.usage } else { Usage::Monitor }
        });
        problem.shape.local.clear();
        let here = |job: &usize| problem.study.jobs[*job].case == case;
        problem.jobs.retain(here);
        problem.counting.retain(here);
        problem
    }

    /// Returns the dimensions and kinds of the problem of a study, as far as known without a simulation. A sum is
    /// assumed to be a sum of squares with one residual.
    pub fn outline(study: &Study) -> Shape {
        let residuals = usize::from(study.objective == Objective::Sum);
        Shape { residuals, ..shape(study, &active(study), own_usage) }
    }

    fn with(study: Arc<Study>, active: Vec<usize>, base: Vec<f64>, usage: impl Fn(&Row, &Study) -> Usage) -> Self {
        let shape = shape(&study, &active, usage);
        let jobs: Vec<usize> = (0..study.jobs.len()).collect();
        let mut rows_of = vec![Vec::new(); jobs.len()];
        study.rows.iter().enumerate().for_each(|(index, row)| rows_of[row.job].push(index));
        let counts = |job: &usize| rows_of[*job].iter().any(|&row| shape.rows[row].0 != Usage::Monitor);
        let counting = jobs.iter().copied().filter(counts).collect();
        let mut problem = Self { study, active, base, shape, jobs, counting, rows_of: Arc::new(rows_of) };
        problem.shape.residuals = problem.count_residuals();
        problem.shape.noise = problem.noise_of_residuals().unwrap_or(0.0);
        problem
    }

    /// Returns the length of the residual vector, from a successful evaluation: a criterion needs its data to determine
    /// it. The start is tried first, then random points of the box.
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

    /// Returns the sum of squares up to which the residuals are noise, see [`Shape::noise`]; `None` if a noise level is
    /// unknown.
    ///
    /// Each term `a_i e_i^2` with standard normal `e_i` has the mean `a_i` and the variance `2 a_i^2`.
    fn noise_of_residuals(&self) -> Option<f64> {
        if self.shape.residuals == 0 {
            return None;
        }
        let (mut mean, mut variance) = (0.0, 0.0);
        for row in (0..self.study.rows.len()).filter(|&row| self.is_minimised(row)) {
            let samples = self.study.rows[row].criterion.samples(self.study.case_of(&self.study.rows[row]))?;
            // The mean of another loss depends on the distribution of the noise.
            if samples.loss != Loss::Squares {
                return None;
            }
            let unit = self.residual_factor(row)? * samples.noise?;
            for weight in samples.weights {
                let term = math::powi(unit * weight, 2);
                mean += term;
                variance += 2.0 * term * term;
            }
        }
        Some(mean + 3.0 * variance.sqrt())
    }

    /// Returns a copy for concluding a run: only a second, insistent cancellation request ends its simulations.
    #[must_use]
    pub fn concluding(&self) -> Self {
        let mut study = Study::clone(&self.study);
        study.cases.iter_mut().for_each(|case| case.cancellation = case.cancellation.patient());
        Self { study: Arc::new(study), ..self.clone() }
    }

    /// Returns true if cancellation of the simulations was requested.
    pub fn is_cancelled(&self) -> bool {
        self.study.cases.iter().any(|case| case.cancellation.requested().is_some())
    }

    /// Returns the study.
    pub fn study(&self) -> &Arc<Study> {
        &self.study
    }

    /// Returns the dimensions and kinds of the problem.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Returns the objectives of the Pareto front, in the order of [`Shape::objectives`].
    pub fn objectives(&self) -> Vec<FrontObjective> {
        FrontObjective::of_study(&self.study, &self.shape.rows)
    }

    /// Returns the active tuners, as indices into the tuners of the study.
    pub fn active(&self) -> &[usize] {
        &self.active
    }

    /// Returns the initial guess as a point of the unit box.
    pub fn start(&self) -> Vec<f64> {
        self.point_of(&self.base)
    }

    /// Returns the point of the unit box at which the active tuners have the given values.
    pub fn point_of(&self, tuners: &[f64]) -> Vec<f64> {
        self.active.iter().map(|&i| self.study.tuners[i].position_of(tuners[i])).collect()
    }

    /// Returns the values of all tuners at a point of the unit box.
    pub fn tuners_at(&self, point: &[f64]) -> Vec<f64> {
        let mut values = self.base.clone();
        for (&i, &u) in self.active.iter().zip(point) {
            values[i] = self.study.tuners[i].value_at(u);
        }
        self.study.apply_ties(&mut values);
        values
    }

    /// Evaluates a point of the unit box; its simulations run in parallel. Monitored cases are omitted.
    pub fn evaluate(&self, point: &[f64]) -> Evaluation {
        self.evaluate_tuners(point.to_vec(), self.tuners_at(point), &self.counting)
    }

    /// Evaluates given values of all tuners, which may lie outside their bounds, in every case.
    pub fn evaluate_at(&self, tuners: &[f64]) -> Evaluation {
        self.evaluate_tuners(self.point_of(tuners), tuners.to_vec(), &self.jobs)
    }

    /// Returns true if the cache contains a result for every simulation of a point, in `every` case or in those that
    /// count.
    pub fn has_met(&self, known: Option<&Known>, every: bool) -> bool {
        let mut jobs = if every { self.jobs.iter() } else { self.counting.iter() };
        jobs.all(|&job| known.is_some_and(|known| known.job(job).is_some()))
    }

    /// Returns the number of simulations per evaluation of a point.
    pub fn simulations(&self) -> usize {
        self.counting.len()
    }

    /// Analyses one job with all signals, for plots. `horizon` in s replaces the planned one.
    ///
    /// # Errors
    /// Returns the failure of the simulation.
    pub fn analyse_all(&self, job: usize, tuners: &[f64], horizon: Option<f64>) -> Result<Analysis, Failure> {
        let plan = &self.study.jobs[job];
        let model = &self.study.models[plan.model].1;
        let signals: Vec<usize> = (0..model.interface().signals.len()).collect();
        let request = Job {
            case: &self.study.cases[plan.case],
            parameters: &self.study.parameters(plan, tuners),
            signals: &signals,
            horizon: horizon.unwrap_or(plan.horizon),
        };
        self.study.analyse(plan.model, &request)
    }

    /// Returns the evaluation of a point that was not simulated: no row has a value.
    pub fn unknown(&self, tuners: &[f64]) -> Evaluation {
        self.judge(self.point_of(tuners), tuners.to_vec(), std::iter::empty())
    }

    fn evaluate_tuners(&self, point: Vec<f64>, tuners: Vec<f64>, jobs: &[usize]) -> Evaluation {
        let values: Vec<JobValues> = jobs.par_iter().map(|&job| self.run_job(job, &tuners)).collect();
        self.judge(point, tuners, jobs.iter().copied().zip(values))
    }

    /// Evaluates a point with a cache entry: only jobs that are not cached run.
    pub fn evaluate_keeping(&self, point: &[f64], known: Option<Known>) -> CachedPoint {
        self.keep(point.to_vec(), self.tuners_at(point), &self.counting, known)
    }

    /// Evaluates given values of all tuners in every case, as [`Problem::evaluate_at`], with a cache entry.
    pub fn evaluate_at_keeping(&self, tuners: &[f64], known: Option<Known>) -> CachedPoint {
        self.keep(self.point_of(tuners), tuners.to_vec(), &self.jobs, known)
    }

    fn keep(&self, point: Vec<f64>, tuners: Vec<f64>, jobs: &[usize], known: Option<Known>) -> CachedPoint {
        let known = known.unwrap_or_default();
        let values: Vec<(usize, JobValues, bool)> = (jobs.par_iter())
            .map(|&job| match known.job(job).filter(|values| self.suffices(job, values)) {
                Some(values) => (job, values.clone(), false),
                None => (job, self.run_job(job, &tuners), true),
            })
            .collect();
        let is_new = |(_, values, new): &&(usize, JobValues, bool)| *new && *values != Err(Failure::Cancelled);
        let learned: Vec<(usize, JobValues)> =
            (values.iter().filter(is_new)).map(|(job, values, _)| (*job, without_residuals(values))).collect();
        let learned = (!learned.is_empty()).then_some(Known { jobs: learned });
        CachedPoint { evaluation: self.judge(point, tuners, values.into_iter().map(|(job, v, _)| (job, v))), learned }
    }

    /// Returns the evaluation of a point from its cache entry; `None` if the entry is incomplete.
    pub fn known(&self, tuners: &[f64], known: &Known) -> Option<Evaluation> {
        let of_job = |&job: &usize| Some((job, known.job(job).filter(|values| self.suffices(job, values))?.clone()));
        let values: Vec<(usize, JobValues)> = self.counting.iter().map(of_job).collect::<Option<_>>()?;
        Some(self.judge(self.point_of(tuners), tuners.to_vec(), values.into_iter()))
    }

    /// Returns true if the cached values of a job contain everything that this problem needs.
    fn suffices(&self, job: usize, values: &JobValues) -> bool {
        let Ok(values) = values else { return true };
        self.rows_of[job].iter().all(|index| values.iter().any(|(row, _)| row == index))
    }

    /// Rates the values of jobs by the demands of the study.
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

    /// Returns the values of all rows that read one job. A criterion without a value does not affect the others.
    fn run_job(&self, job: usize, tuners: &[f64]) -> JobValues {
        let study = &self.study;
        let plan = &study.jobs[job];
        let case = &study.cases[plan.case];
        if case.cancellation.requested().is_some() {
            return Err(Failure::Cancelled);
        }
        let parameters = study.parameters(plan, tuners);
        let request = Job { case, parameters: &parameters, signals: &plan.signals, horizon: plan.horizon };
        let analysis = study.analyse(plan.model, &request)?;
        let value = |row: &Row| match row.value(case, &analysis, &parameters) {
            Ok(value) if !value.number.is_finite() => Err("its value is not finite".to_owned()),
            other => other,
        };
        // A criterion of a large linear system takes as long as a simulation.
        let unless_cancelled = |&index: &usize| match case.cancellation.requested() {
            Some(_) => Err(Failure::Cancelled),
            None => Ok((index, value(&study.rows[index]))),
        };
        self.rows_of[job].iter().map(unless_cancelled).collect()
    }

    /// Returns the derivatives at an evaluated point, from the tangents of the models. `None` if a model, a criterion
    /// or a tuner has no exact derivatives. `reach` is the distance within which the derivatives are to describe the
    /// problem.
    pub fn slopes(&self, at: &Evaluation, reach: f64) -> Option<Slopes> {
        let of_rows = self.row_slopes(at, reach)?;
        let mut residuals = vec![Vec::new(); self.study.rows.len()];
        let of_rows = of_rows.into_iter().map(|(row, value, slopes)| {
            residuals[row] = value.residuals;
            (row, slopes)
        });
        let of_rows = of_rows.collect();
        self.scaled_slopes(at, of_rows, residuals)
    }

    /// Returns the derivatives at an evaluated point as [`Problem::slopes`], with cached derivatives of the rows. Those
    /// of residuals are not cached.
    pub fn slopes_keeping(
        &self,
        at: &Evaluation,
        reach: f64,
        known: Option<Option<RowSlopes>>,
    ) -> CachedGradients<Slopes> {
        if self.shape.residuals > 0 {
            return CachedGradients { slopes: self.slopes(at, reach), learned: None };
        }
        let known = known.filter(|known| known.as_ref().is_none_or(|rows| self.suffice(rows)));
        let simulated = || {
            let rows = self.row_slopes(at, reach)?;
            Some(rows.into_iter().map(|(row, _, slopes)| (row, slopes)).collect::<RowSlopes>())
        };
        let (rows, new) = known.map_or_else(|| (simulated(), true), |known| (known, false));
        // Derivatives that were cut off are not cached.
        let learned = (new && (rows.is_some() || !self.is_cancelled())).then(|| rows.clone());
        CachedGradients { slopes: rows.and_then(|rows| self.scaled_slopes(at, rows, Vec::new())), learned }
    }

    /// Returns true if cached derivatives contain everything that this problem needs.
    fn suffice(&self, known: &RowSlopes) -> bool {
        let n = self.active.len();
        self.shape.rows.iter().enumerate().all(|(index, (usage, _))| match entry(known, index) {
            _ if *usage == Usage::Monitor => true,
            None => false,
            Some(along) => along.len() == n,
        })
    }

    /// Returns the derivatives of the rows that count along every coordinate, in the units of their criteria.
    fn row_slopes(&self, at: &Evaluation, reach: f64) -> Option<Vec<RowTangent>> {
        if self.shape.spacing.iter().any(|&spacing| spacing > 0.0) || at.scaled.is_none() {
            return None;
        }
        let moves = self.tuner_slopes(&at.tuners);
        let of_jobs: Vec<Option<Vec<RowTangent>>> = self
            .counting
            .par_iter()
            .map(|&job| caught(|| self.job_slopes(job, &at.tuners, &moves, reach)).ok()?)
            .collect();
        let mut rows: Vec<RowTangent> =
            of_jobs.into_iter().collect::<Option<Vec<_>>>()?.into_iter().flatten().collect();
        if self.shape.residuals == 0 {
            rows.iter_mut().flat_map(|(_, _, along)| along).for_each(|slope| slope.residuals.clear());
        }
        Some(rows)
    }

    /// Returns the derivatives of the scaled values and of the weighted residuals, with the residuals of the rows as
    /// `values`.
    fn scaled_slopes(&self, at: &Evaluation, of_rows: RowSlopes, values: Vec<Vec<f64>>) -> Option<Slopes> {
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
        finite.then(|| Slopes { rows, residuals, at: self.residuals(values) })
    }

    /// Returns the derivative of all tuners along each coordinate of the unit box, ties included.
    pub(crate) fn tuner_slopes(&self, tuners: &[f64]) -> Vec<Vec<f64>> {
        let along = |&active: &usize| {
            let mut duals: Vec<Dual<1>> = tuners.iter().map(|&value| Dual::from(value)).collect();
            duals[active].tangent[0] = self.study.tuners[active].slope_at(tuners[active]);
            self.study.apply_ties(&mut duals);
            duals.iter().map(|dual| dual.tangent[0]).collect()
        };
        self.active.iter().map(along).collect()
    }

    /// Returns the derivatives of the counting rows of one job along every coordinate.
    fn job_slopes(&self, job: usize, tuners: &[f64], moves: &[Vec<f64>], reach: f64) -> Option<Vec<RowTangent>> {
        let study = &self.study;
        let plan = &study.jobs[job];
        let case = &study.cases[plan.case];
        if case.cancellation.requested().is_some() {
            return None;
        }
        let seed = |along: &Vec<f64>| study.parameter_slopes(plan, along);
        let seeds: Vec<Vec<f64>> = moves.iter().map(seed).collect();
        // Initial states of other cases do not affect this job.
        let moving: Vec<usize> = (0..seeds.len()).filter(|&j| seeds[j].iter().any(|&s| s != 0.0)).collect();
        let wanted: Vec<Vec<f64>> = moving.iter().map(|&j| seeds[j].clone()).collect();
        let parameters = study.parameters(plan, tuners);
        let request = Job { case, parameters: &parameters, signals: &plan.signals, horizon: plan.horizon };
        let (analysis, tangents) = study.models[plan.model].1.tangents(&request, &wanted)?.ok()?;
        let rows = self.rows_of[job].iter().filter(|index| self.shape.rows[**index].0 != Usage::Monitor);
        rows.map(|&index| {
            let row = &study.rows[index];
            if case.cancellation.requested().is_some() {
                return None;
            }
            let value = row.criterion.value_with(case, &analysis, &parameters).ok()?;
            let still = Value { residuals: vec![0.0; value.residuals.len()], ..Value::default() };
            let mut slopes = vec![still; seeds.len()];
            for (&j, along) in moving.iter().zip(&tangents) {
                let (parameters, seed) = (&parameters[..], &seeds[j][..]);
                let tangent = Tangent { analysis: &analysis, value: &value, along, parameters, seed, reach };
                slopes[j] = row.criterion.slope(case, &tangent).ok()?;
            }
            Some((index, value, slopes))
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

    /// Returns the residuals of all rows to be minimised, weighted so that their squares sum to the objective. Empty if
    /// one of the rows is not a sum of squares.
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

    /// Returns true if a row is part of the objective.
    pub fn is_minimised(&self, row: usize) -> bool {
        self.shape.rows[row].0 == Usage::Minimise
    }

    /// Returns the factor of a row's residuals in the residual vector: the root of weight / demand. `None` without such
    /// a demand.
    pub fn residual_factor(&self, row: usize) -> Option<f64> {
        match self.study.rows[row] {
            Row { demand: Demand::AtMost(demand), reversed: false, .. } => {
                Some((self.shape.rows[row].1 / demand).sqrt())
            }
            _ => None,
        }
    }
}

/// Returns the active tuners of a study and of its calibration cases, as indices.
pub(super) fn active(study: &Study) -> Vec<usize> {
    let counts = |case: Option<usize>| case.is_none_or(|c| study.cases[c].role() == Role::Calibration);
    (0..study.tuners.len()).filter(|&i| study.tuners[i].active && counts(study.tuners[i].case)).collect()
}

/// Returns the usage of a row: monitored in cases that are not calibration data.
pub(super) fn own_usage(row: &Row, study: &Study) -> Usage {
    if study.case_of(row).role() == Role::Calibration { row.usage } else { Usage::Monitor }
}

/// Returns the index of the objective of every minimised row, in the order of the rows.
pub(super) fn groups(objectives: &[FrontObjective]) -> Vec<usize> {
    let rows = objectives.iter().enumerate().flat_map(|(k, objective)| objective.rows.iter().map(move |&row| (row, k)));
    let mut rows: Vec<(usize, usize)> = rows.collect();
    rows.sort_unstable();
    rows.into_iter().map(|(_, objective)| objective).collect()
}

/// Returns the dimensions and kinds of the problem, without residuals.
pub(super) fn shape(study: &Study, active: &[usize], usage: impl Fn(&Row, &Study) -> Usage) -> Shape {
    let rows: Vec<(Usage, f64)> = study.rows.iter().map(|row| (usage(row, study), row.weight)).collect();
    let spacing = active.iter().map(|&i| study.tuners[i].spacing()).collect();
    let points = study.task.options::<ParetoTask>().map_or(0, |pareto| pareto.points);
    let groups = match study.objective {
        Objective::Each => groups(&FrontObjective::of_study(study, &rows)),
        Objective::Max | Objective::Sum => Vec::new(),
    };
    let log_ratio = |tuner: &Tuner| match tuner.scale {
        Scale::Log => math::ln(tuner.bounds[1] / tuner.bounds[0]),
        Scale::Linear => 0.0,
    };
    let log_ratios = active.iter().map(|&i| log_ratio(&study.tuners[i])).collect();
    // Initial guesses from the data are good ones.
    let is_local = |tuner: &Tuner| tuner.case.is_some() && tuner.guessed.contains(&true);
    let local = (0..active.len()).filter(|&j| is_local(&study.tuners[active[j]])).collect();
    Shape { spacing, rows, objective: study.objective, groups, points, residuals: 0, noise: 0.0, local, log_ratios }
}

/// Returns the values of a job without residuals, for a cache that does not need them.
pub(super) fn without_residuals(values: &JobValues) -> JobValues {
    let bare = |(row, value): &RowValue| {
        let value = value.as_ref().map(|v| Value { residuals: Vec::new(), ..v.clone() });
        (*row, value.map_err(Clone::clone))
    };
    values.as_ref().map(|values| values.iter().map(bare).collect()).map_err(Clone::clone)
}
