//! Main loop of the evolutionary solvers for Pareto fronts: tournament selection, crossover, mutation, and survival of
//! the fittest among parents and children. The trait [`Survival`] defines fitness. Memory is reused between
//! generations.

mod mating;

use std::cmp::Ordering;

use mops_core::{Evaluation, Halt, Objective, Oracle, Progress, Shape, Solver, evaluation::FEASIBLE};
use mops_math::Stream;

use crate::start::latin_hypercube;
use crate::variation::Variation;

/// Points with objectives and violations.
#[derive(Debug, Clone, Default)]
pub struct Pool {
    /// Number of objectives.
    pub m: usize,
    /// Points of the unit box.
    pub points: Vec<Vec<f64>>,
    /// Weighted scaled values to be minimised, `m` per point; infinite for a failed point.
    pub objectives: Vec<f64>,
    /// Largest constraint violation; 0 for a feasible point, infinite for a failed one.
    pub violations: Vec<f64>,
}

impl Pool {
    /// Returns the number of points.
    pub fn len(&self) -> usize {
        self.violations.len()
    }

    /// Returns true if there are no points.
    pub fn is_empty(&self) -> bool {
        self.violations.is_empty()
    }

    /// Returns the objectives of a point.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.objectives[i * self.m..(i + 1) * self.m]
    }

    /// Appends the values of evaluations whose points are already in the pool.
    fn append(&mut self, shape: &Shape, answers: &[Evaluation]) {
        for answer in answers {
            let violation = answer.merit.violation;
            self.violations.push(if violation <= FEASIBLE { 0.0 } else { violation });
            match &answer.scaled {
                Some(scaled) => shape.append_objectives(scaled, &mut self.objectives),
                None => self.objectives.extend(std::iter::repeat_n(f64::INFINITY, self.m)),
            }
        }
    }
}

/// Environmental selection and tournament preference.
pub trait Survival: Send {
    /// Prepares for `m` objectives, before the first generation, and returns the population size.
    fn begin(&mut self, m: usize) -> usize;

    /// Selects `keep` points of the pool, the fittest first if they are ordered.
    fn survive(&mut self, pool: &Pool, keep: usize, random: &mut Stream) -> &[u32];

    /// Compares two survivors, given by their positions in the selection, for a tournament.
    fn prefers(&self, a: usize, b: usize) -> Ordering;
}

/// Evolutionary search for a Pareto front.
pub struct Evolution<S> {
    survival: S,
    variation: fn(usize) -> Variation,
    generations: usize,
    state: Option<State>,
}

struct State {
    random: Stream,
    variation: Variation,
    size: usize,
    members: Pool,
    children: Vec<Vec<f64>>,
    /// Buffer for the next generation.
    next: Pool,
    generation: usize,
}

impl<S: Survival> Evolution<S> {
    /// Creates a search with a number of generations.
    pub fn new(survival: S, variation: fn(usize) -> Variation, generations: usize) -> Self {
        Self { survival, variation, generations, state: None }
    }
}

impl<S: Survival> Solver for Evolution<S> {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        if shape.objective == Objective::Each && shape.objective_count() > 0 {
            return Ok(());
        }
        Err("`nsga2` and `nsga3` search for a Pareto front: set objective = \"each\" in [study] and minimise a criterion, or use `cma-es`"
            .into())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.state = None;
        if start.is_empty() {
            return Ok(());
        }
        let m = oracle.shape().objective_count();
        let size = self.survival.begin(m);
        let mut random = oracle.stream("evolution");
        let mut members = Pool { m, points: latin_hypercube(size, start.len(), &mut random), ..Pool::default() };
        members.points[0].copy_from_slice(start);
        let answers = oracle.evaluate(&members.points)?;
        members.append(oracle.shape(), &answers);
        self.state = Some(State {
            random,
            variation: (self.variation)(start.len()),
            size,
            children: vec![vec![0.0; start.len()]; size],
            next: Pool { m, ..Pool::default() },
            members,
            generation: 0,
        });
        self.select_survivors();
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(state) = &mut self.state else { return Ok(Progress::Converged) };
        if state.generation >= self.generations {
            return Ok(Progress::Stalled);
        }
        state.generation += 1;
        state.mate(&self.survival);
        let answers = oracle.evaluate(&state.children)?;
        state.members.points.append(&mut state.children);
        state.members.append(oracle.shape(), &answers);
        self.select_survivors();
        Ok(Progress::Continue)
    }

    /// Returns the last complete generation.
    fn members(&self) -> &[Vec<f64>] {
        self.state.as_ref().map_or(&[], |state| &state.members.points)
    }
}

impl<S: Survival> Evolution<S> {
    /// Selects the survivors; the memory of the other points is reused for children.
    fn select_survivors(&mut self) {
        let Some(state) = &mut self.state else { return };
        let survivors = self.survival.survive(&state.members, state.size, &mut state.random);
        let (all, next) = (&mut state.members, &mut state.next);
        next.objectives.clear();
        next.violations.clear();
        for &i in survivors {
            let i = i as usize;
            next.objectives.extend_from_slice(&all.objectives[i * all.m..(i + 1) * all.m]);
            next.violations.push(all.violations[i]);
            next.points.push(std::mem::take(&mut all.points[i]));
        }
        state.children.extend(all.points.drain(..).filter(|point| !point.is_empty()));
        std::mem::swap(all, next);
    }
}

/// Splits the pool into feasible and infeasible points, the latter in order of violation.
pub fn by_feasibility(pool: &Pool, feasible: &mut Vec<u32>, infeasible: &mut Vec<u32>) {
    feasible.clear();
    infeasible.clear();
    for (i, &violation) in (0_u32..).zip(&pool.violations) {
        if violation == 0.0 { feasible.push(i) } else { infeasible.push(i) }
    }
    infeasible.sort_by(|&a, &b| pool.violations[a as usize].total_cmp(&pool.violations[b as usize]));
}
