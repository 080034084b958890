//! The subproblems, each solved by a local solver from points known.

use mops_core::{Halt, Merit, Objective, Oracle, Progress, Solver, SolverOptions};

use super::aim::{Aim, Role, View};
use super::known::{Known, Place};
use crate::multistart::Multistart;
use crate::pareto::certify;
use crate::pattern_search::PatternSearchOptions;
use crate::sqp::SqpOptions;

/// Solves subproblems, and remembers all points.
pub struct Subproblems {
    pub known: Known,
    starts: usize,
    /// The least value of every criterion, and how far the front reaches above it.
    pub ideal: Vec<f64>,
    pub range: Vec<f64>,
    /// Subproblems without a solution.
    pub failed: usize,
}

/// Share of a criterion's size that it may lose while the others are lowered.
const LOSS: f64 = 1e-7;

/// Slack of a criterion, as a share of its range in the subproblem, that is worth another search.
const SLACK: f64 = 1e-4;

/// Where `sqp` stops, in units of the subproblem.
const TOLERANCE: f64 = 1e-9;

/// More tuners than this are too many for a pattern search.
const MOST_POLLED: usize = 10;

impl Subproblems {
    pub fn new(starts: usize) -> Self {
        Self { known: Known::default(), starts, ideal: Vec::new(), range: Vec::new(), failed: 0 }
    }

    /// A study of constraints alone: any point that meets them.
    pub fn feasible(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<Progress, Halt> {
        let aim = Aim { roles: Vec::new(), objective: Objective::Max };
        self.multistart(oracle, &aim, start)
    }

    /// Solves a subproblem from several starts; where no search ends at an optimum of slopes there may be a jump, and a
    /// pattern search follows.
    fn multistart(&mut self, oracle: &mut dyn Oracle, aim: &Aim, start: &[f64]) -> Result<Progress, Halt> {
        let mut view = View::new(oracle, &mut self.known, aim);
        let mut starts =
            Multistart::new(SqpOptions { tolerance: TOLERANCE, ..SqpOptions::default() }.build(), self.starts);
        starts.begin(&mut view, start)?;
        let progress = loop {
            match starts.step(&mut view)? {
                Progress::Continue => {}
                end => break end,
            }
        };
        let Some(best) = view.best().filter(|best| best.scaled.is_some()).map(|best| best.point.clone()) else {
            return Ok(Progress::Stalled);
        };
        if progress == Progress::Converged || best.len() > MOST_POLLED {
            return Ok(progress);
        }
        let mut pattern = PatternSearchOptions { size: 0.02, tolerance: 1e-5, ..Default::default() }.build();
        run(&mut view, pattern.as_mut(), &best)
    }

    /// The least of one criterion, and there the least of the others.
    pub fn least(
        &mut self,
        oracle: &mut dyn Oracle,
        start: &[f64],
        criterion: usize,
        of: usize,
    ) -> Result<Option<Place>, Halt> {
        let role = |k: usize| if k == criterion { Role::Minimised { from: 0.0, per: 1.0 } } else { Role::Free };
        let aim = Aim { roles: (0..of).map(role).collect(), objective: Objective::Max };
        self.multistart(oracle, &aim, start)?;
        let Some(least) = self.best_known(&aim) else {
            self.failed += 1;
            return Ok(None);
        };
        let f = least.criteria[criterion];
        let limit = f + LOSS * f.abs().max(1.0);
        let role = |k: usize| match k == criterion {
            true => Role::AtMost { limit, per: 1.0 },
            false => Role::Minimised { from: 0.0, per: least.criteria[k].abs().max(1e-3) },
        };
        let aim = Aim { roles: (0..of).map(role).collect(), objective: Objective::Sum };
        Ok(Some(self.solve(oracle, &aim, &[least], 0.1)?))
    }

    /// Takes the ranges of the criteria from the ends of the front.
    pub fn measure(&mut self, front: &[Place]) {
        let criteria = front[0].criteria.len();
        let column = |k: usize| front.iter().map(move |place| place.criteria[k]);
        self.ideal = (0..criteria).map(|k| column(k).fold(f64::INFINITY, f64::min)).collect();
        let reach = |k: usize| column(k).fold(f64::NEG_INFINITY, f64::max) - self.ideal[k];
        self.range = (0..criteria).map(|k| if reach(k) > 0.0 { reach(k) } else { 1.0 }).collect();
    }

    /// The best point known for a subproblem.
    fn best_known(&self, aim: &Aim) -> Option<Place> {
        self.known.best_for(aim, 1, 0.0).pop()
    }

    /// Solves a subproblem by `sqp` from each of the starts; the best point known for it in the end.
    pub fn solve(&mut self, oracle: &mut dyn Oracle, aim: &Aim, starts: &[Place], radius: f64) -> Result<Place, Halt> {
        for start in starts {
            let mut solver = SqpOptions { radius, tolerance: TOLERANCE, ..SqpOptions::default() }.build();
            let mut view = View::new(oracle, &mut self.known, aim);
            while_it_pays(&mut view, solver.as_mut(), &start.point)?;
        }
        Ok(self.best_known(aim).unwrap_or_else(|| starts[0].clone()))
    }

    /// The point whose largest weighted scaled value is least.
    pub fn demands(&mut self, oracle: &mut dyn Oracle, criteria: usize) -> Result<Place, Halt> {
        let aim = Aim::chebyshev(&vec![0.0; criteria], &vec![1.0; criteria]);
        let starts = self.known.best_for(&aim, 2, 0.02);
        let found = self.solve(oracle, &aim, &starts, 0.05)?;
        self.without_slack(oracle, &aim, found)
    }

    /// Lowers the criteria that have slack in a min-max problem, while the others stay.
    pub fn without_slack(&mut self, oracle: &mut dyn Oracle, aim: &Aim, place: Place) -> Result<Place, Halt> {
        let worst = aim.merit(&place.criteria).objective;
        let value = |role: &Role, f: f64| match role {
            Role::Minimised { from, per } => (f - from) / per,
            _ => f64::NEG_INFINITY,
        };
        let values: Vec<f64> = aim.roles.iter().zip(&place.criteria).map(|(role, &f)| value(role, f)).collect();
        if values.iter().all(|value| *value >= worst - SLACK) {
            return Ok(place);
        }
        let role = |((role, value), &f): ((&Role, &f64), &f64)| match role {
            Role::Minimised { per, .. } if *value < worst - SLACK => Role::Minimised { from: f, per: *per },
            Role::Minimised { per, .. } => Role::AtMost { limit: f, per: *per },
            other => *other,
        };
        let roles = aim.roles.iter().zip(&values).zip(&place.criteria).map(role).collect();
        let aim = Aim { roles, objective: Objective::Sum };
        self.solve(oracle, &aim, &[place], 0.05)
    }

    /// Looks beyond every point of the front for a better one, which is known from then on.
    pub fn look_beyond(&mut self, oracle: &mut dyn Oracle, front: &[Place]) {
        for place in front {
            let nothing = vec![0.0; place.criteria.len()];
            let aim = Aim::chebyshev(&nothing, &self.range);
            certify(&mut View::new(oracle, &mut self.known, &aim), &place.point);
        }
    }

    /// Replaces points of the front by points known to be better, searched on from there; whether there was one.
    pub fn better(&mut self, oracle: &mut dyn Oracle, front: &mut Vec<Place>) -> Result<bool, Halt> {
        let mut changed = false;
        for i in 0..front.len() {
            let here = front[i].clone();
            let ahead = |other: &&Place| other.dominates(&here, &self.range, 1e-9);
            let gain = |other: &Place| {
                here.criteria.iter().zip(&other.criteria).zip(&self.range).map(|((a, b), r)| (a - b) / r).sum::<f64>()
            };
            let better = self.known.places().iter().filter(ahead).max_by(|a, b| gain(a).total_cmp(&gain(b))).cloned();
            let Some(better) = better else { continue };
            changed = true;
            // As far as it goes along the way from the one to the other.
            let aim = Aim::chebyshev(&better.criteria, &self.range);
            let found = if gain(&better) > 1e-5 { self.solve(oracle, &aim, &[better], 0.05)? } else { better };
            front[i] = found;
        }
        if changed {
            let all = std::mem::take(front);
            for place in all {
                super::insert(front, place);
            }
        }
        Ok(changed)
    }
}

/// Steps of a local solver that must bring at least so much, in units of the subproblem.
const STEPS: usize = 15;
const PAYS: f64 = 1e-4;

/// Runs a solver as long as it brings something: at a kink of a criterion the last digits are many steps away.
fn while_it_pays(view: &mut View<'_>, solver: &mut dyn Solver, start: &[f64]) -> Result<Progress, Halt> {
    solver.begin(view, start)?;
    loop {
        let before = view.best().map_or(Merit::FAILED, |best| best.merit);
        for _ in 0..STEPS {
            match solver.step(view)? {
                Progress::Continue => {}
                end => return Ok(end),
            }
        }
        let after = view.best().map_or(Merit::FAILED, |best| best.merit);
        let gain =
            if before.is_feasible() { before.objective - after.objective } else { before.violation - after.violation };
        if gain < PAYS {
            return Ok(Progress::Stalled);
        }
    }
}

/// Runs a solver to its end.
fn run(view: &mut View<'_>, solver: &mut dyn Solver, start: &[f64]) -> Result<Progress, Halt> {
    solver.begin(view, start)?;
    loop {
        match solver.step(view)? {
            Progress::Continue => {}
            end => return Ok(end),
        }
    }
}
