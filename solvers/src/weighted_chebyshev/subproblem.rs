//! Subproblems, each solved by a local solver from known points.

use mops_core::{Halt, Merit, Oracle, Progress, Solver, front};

use super::archive::{Archive, Candidate};
use super::scalarisation::{Role, Scalarisation};
use super::scalarised_problem::ScalarisedProblem;
use crate::multistart::Multistart;
use crate::optimality::certificate;
use crate::pattern_search::PatternSearchOptions;
use crate::sqp::SqpOptions;

/// Solver for subproblems; archives all evaluated points.
pub struct Subproblems {
    pub archive: Archive,
    starts: usize,
    /// Smallest value of every objective on the front, and the range of the front above it.
    pub ideal: Vec<f64>,
    pub range: Vec<f64>,
    /// Number of subproblems without a solution.
    pub failed: usize,
}

/// Permitted relative loss of an objective while the others are minimised.
const ALLOWED_LOSS: f64 = 1e-7;

/// Slack of an objective, relative to its range in the subproblem, above which another search follows.
const SLACK: f64 = 1e-4;

/// Tolerance of `sqp`, in units of the subproblem.
const TOLERANCE: f64 = 1e-9;

/// Maximum number of tuners for a pattern search.
const MAX_POLLED_DIMENSION: usize = 10;

impl Subproblems {
    pub fn new(starts: usize) -> Self {
        Self { archive: Archive::default(), starts, ideal: Vec::new(), range: Vec::new(), failed: 0 }
    }

    /// Searches for a feasible point of a study that has constraints only.
    pub fn find_feasible(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<Progress, Halt> {
        let scalarisation = Scalarisation { roles: Vec::new() };
        self.multistart(oracle, &scalarisation, start)
    }

    /// Solves a subproblem by multistart. If no run converges, the optimum may lie at a discontinuity, and a pattern
    /// search follows.
    fn multistart(
        &mut self,
        oracle: &mut dyn Oracle,
        scalarisation: &Scalarisation,
        start: &[f64],
    ) -> Result<Progress, Halt> {
        let mut problem = ScalarisedProblem::new(oracle, &mut self.archive, scalarisation);
        let mut starts =
            Multistart::new(SqpOptions { tolerance: TOLERANCE, ..SqpOptions::default() }.local(), self.starts)
                .thorough();
        starts.begin(&mut problem, start)?;
        let progress = loop {
            match starts.step(&mut problem)? {
                Progress::Continue => {}
                end => break end,
            }
        };
        let Some(best) = problem.best().filter(|best| best.scaled.is_some()).map(|best| best.point.clone()) else {
            return Ok(Progress::Stalled);
        };
        if progress == Progress::Converged || best.len() > MAX_POLLED_DIMENSION {
            return Ok(progress);
        }
        let mut pattern = PatternSearchOptions { size: 0.02, tolerance: 1e-5, ..Default::default() }.local();
        run(&mut problem, pattern.as_mut(), &best)
    }

    /// Minimises one objective, then the others as far as possible without loss in it.
    pub fn anchor(
        &mut self,
        oracle: &mut dyn Oracle,
        start: &[f64],
        objective: usize,
        of: usize,
    ) -> Result<Option<Candidate>, Halt> {
        let alone =
            |k: usize| if k == objective { Role::Minimised { reference: 0.0, scale: 1.0 } } else { Role::Ignored };
        let scalarisation = Scalarisation { roles: (0..of).map(alone).collect() };
        self.multistart(oracle, &scalarisation, start)?;
        let Some(optimum) = self.best_archived(&scalarisation) else {
            self.failed += 1;
            return Ok(None);
        };
        let f = optimum.objectives[objective];
        let limit = f + ALLOWED_LOSS * f.abs().max(1.0);
        let others = |k: usize| match k == objective {
            true => Role::Limited { limit, scale: 1.0 },
            false => Role::Minimised { reference: 0.0, scale: optimum.objectives[k].abs().max(1e-3) },
        };
        let scalarisation = Scalarisation { roles: (0..of).map(others).collect() };
        let found = self.solve(oracle, &scalarisation, &[optimum], 0.1)?;
        self.remove_slack(oracle, &scalarisation, found).map(Some)
    }

    /// Minimises all objectives but one, in units of their ranges, then the one as far as possible without loss in the
    /// others.
    pub fn opposite(&mut self, oracle: &mut dyn Oracle, objective: usize) -> Result<Candidate, Halt> {
        let role = |(k, (&reference, &scale)): (usize, (&f64, &f64))| match k == objective {
            true => Role::Minimised { reference, scale: scale / MIN_WEIGHT },
            false => Role::Minimised { reference, scale },
        };
        let roles = self.ideal.iter().zip(&self.range).enumerate().map(role).collect();
        let scalarisation = Scalarisation { roles };
        let starts = self.archive.best(&scalarisation, 2, 0.1);
        let found = self.solve(oracle, &scalarisation, &starts, 0.1)?;
        self.remove_slack(oracle, &scalarisation, found)
    }

    /// Sets ideal point and ranges of the objectives from the ends of the front.
    pub fn set_ranges(&mut self, front: &[Candidate]) {
        let objectives: Vec<f64> = front.iter().flat_map(|candidate| candidate.objectives.iter().copied()).collect();
        let ranges = front::ranges(&objectives, front[0].objectives.len());
        self.ideal = ranges.iter().map(|[low, _]| *low).collect();
        self.range = ranges.iter().map(|[low, high]| if high > low { high - low } else { 1.0 }).collect();
    }

    /// Returns the best known point of a subproblem.
    fn best_archived(&self, scalarisation: &Scalarisation) -> Option<Candidate> {
        self.archive.best(scalarisation, 1, 0.0).pop()
    }

    /// Solves a subproblem by `sqp` from each starting point and returns its best known point.
    pub fn solve(
        &mut self,
        oracle: &mut dyn Oracle,
        scalarisation: &Scalarisation,
        starts: &[Candidate],
        radius: f64,
    ) -> Result<Candidate, Halt> {
        for start in starts {
            let mut solver = SqpOptions { radius, tolerance: TOLERANCE, ..SqpOptions::default() }.local();
            let mut problem = ScalarisedProblem::new(oracle, &mut self.archive, scalarisation);
            run_while_improving(&mut problem, solver.as_mut(), &start.point)?;
        }
        Ok(self.best_archived(scalarisation).unwrap_or_else(|| starts[0].clone()))
    }

    /// Returns the point with the smallest maximum of the weighted scaled values.
    pub fn solve_for_demands(&mut self, oracle: &mut dyn Oracle, objectives: usize) -> Result<Candidate, Halt> {
        let scalarisation = Scalarisation::chebyshev(&vec![0.0; objectives], &vec![1.0; objectives]);
        let starts = self.archive.best(&scalarisation, 2, 0.02);
        let found = self.solve(oracle, &scalarisation, &starts, 0.05)?;
        self.remove_slack(oracle, &scalarisation, found)
    }

    /// Minimises the objectives that have slack in a min-max problem, while the others stay. As this is a min-max
    /// problem itself, its slack is removed in turn.
    pub fn remove_slack(
        &mut self,
        oracle: &mut dyn Oracle,
        scalarisation: &Scalarisation,
        candidate: Candidate,
    ) -> Result<Candidate, Halt> {
        let (mut scalarisation, mut candidate) = (scalarisation.clone(), candidate);
        loop {
            let worst = scalarisation.merit(&candidate.objectives).objective;
            let values = scalarisation.scalarised_values(&candidate.objectives);
            let role = |((role, value), &f): ((&Role, f64), &f64)| match role {
                Role::Minimised { scale, .. } if value < worst - SLACK => {
                    Role::Minimised { reference: f, scale: *scale }
                }
                Role::Minimised { scale, .. } => Role::Limited { limit: f, scale: *scale },
                other => *other,
            };
            let roles: Vec<Role> =
                scalarisation.roles.iter().zip(values).zip(&candidate.objectives).map(role).collect();
            if !roles.iter().any(|role| matches!(role, Role::Minimised { .. })) {
                return Ok(candidate);
            }
            scalarisation = Scalarisation { roles };
            candidate = self.solve(oracle, &scalarisation, &[candidate], 0.05)?;
        }
    }

    /// Tests every point of the front for optimality; trial points that dominate it enter the archive.
    pub fn check_optimality(&mut self, oracle: &mut dyn Oracle, front: &[Candidate]) {
        for candidate in front {
            let nothing = vec![0.0; candidate.objectives.len()];
            let scalarisation = Scalarisation::chebyshev(&nothing, &self.range);
            certificate(&mut ScalarisedProblem::new(oracle, &mut self.archive, &scalarisation), &candidate.point);
        }
    }

    /// Replaces points of the front by dominating points of the archive, after a local search. Returns true if there
    /// were any.
    pub fn replace_dominated(&mut self, oracle: &mut dyn Oracle, front: &mut Vec<Candidate>) -> Result<bool, Halt> {
        let mut changed = false;
        for i in 0..front.len() {
            let here = front[i].clone();
            let dominates = |other: &&Candidate| other.dominates(&here, &self.range, 1e-9);
            let gain = |other: &Candidate| {
                here.objectives
                    .iter()
                    .zip(&other.objectives)
                    .zip(&self.range)
                    .map(|((a, b), r)| (a - b) / r)
                    .sum::<f64>()
            };
            let better =
                self.archive.candidates().iter().filter(dominates).max_by(|a, b| gain(a).total_cmp(&gain(b))).cloned();
            let Some(better) = better else { continue };
            changed = true;
            // Improve all objectives together, starting from the dominating point.
            let scalarisation = Scalarisation::chebyshev(&better.objectives, &self.range);
            let found =
                if gain(&better) > 1e-5 { self.solve(oracle, &scalarisation, &[better], 0.05)? } else { better };
            front[i] = found;
        }
        if changed {
            let all = std::mem::take(front);
            for candidate in all {
                super::insert(front, candidate, &self.range);
            }
        }
        Ok(changed)
    }
}

/// Number of solver steps within which the subproblem must improve by at least [`MIN_GAIN`], in its units.
const STEPS_PER_CHECK: usize = 15;
const MIN_GAIN: f64 = 1e-4;

/// Runs a solver while it makes progress: at a kink of a criterion, the last digits need many steps.
fn run_while_improving(
    problem: &mut ScalarisedProblem<'_>,
    solver: &mut dyn Solver,
    start: &[f64],
) -> Result<Progress, Halt> {
    solver.begin(problem, start)?;
    loop {
        let before = problem.best().map_or(Merit::FAILED, |best| best.merit);
        for _ in 0..STEPS_PER_CHECK {
            match solver.step(problem)? {
                Progress::Continue => {}
                end => return Ok(end),
            }
        }
        let after = problem.best().map_or(Merit::FAILED, |best| best.merit);
        let gain =
            if before.is_feasible() { before.objective - after.objective } else { before.violation - after.violation };
        if gain < MIN_GAIN {
            return Ok(Progress::Stalled);
        }
    }
}

/// Runs a solver to its end.
fn run(problem: &mut ScalarisedProblem<'_>, solver: &mut dyn Solver, start: &[f64]) -> Result<Progress, Halt> {
    solver.begin(problem, start)?;
    loop {
        match solver.step(problem)? {
            Progress::Continue => {}
            end => return Ok(end),
        }
    }
}

/// Offset of every weight, which turns directions on the boundary of the simplex inwards.
pub const MIN_WEIGHT: f64 = 0.01;
