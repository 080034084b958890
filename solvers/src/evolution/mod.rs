//! The loop that evolutionary searches for fronts share: parents win tournaments, children are crossed and mutated, and of
//! both the fittest survive. What is fit is the [`Survival`]'s to say. Memory is reused from generation to generation.

mod mating;

use std::cmp::Ordering;

use mops_core::{Evaluation, FEASIBLE, Halt, Objective, Oracle, Progress, Shape, Solver, Stream, Usage};

use crate::start::latin_hypercube;
use crate::variation::Variation;

/// Points, with objectives and violations.
#[derive(Debug, Clone, Default)]
pub struct Pool {
    /// Number of objectives.
    pub m: usize,
    /// Points of the unit box.
    pub points: Vec<Vec<f64>>,
    /// Weighted scaled values to be minimised, `m` per point; infinite for a failed one.
    pub objectives: Vec<f64>,
    /// The largest violation of a constraint; 0 for a feasible point, infinite for a failed one.
    pub violations: Vec<f64>,
}

impl Pool {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.violations.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.violations.is_empty()
    }

    /// Objectives of a point.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.objectives[i * self.m..(i + 1) * self.m]
    }

    /// Takes the values of evaluations; their points are already here.
    fn append(&mut self, shape: &Shape, answers: &[Evaluation]) {
        for answer in answers {
            let violation = answer.merit.violation;
            self.violations.push(if violation <= FEASIBLE { 0.0 } else { violation });
            match &answer.scaled {
                Some(scaled) => self.objectives.extend(
                    shape.rows.iter().zip(scaled).filter(|((u, _), _)| *u == Usage::Minimise).map(|((_, w), s)| w * s),
                ),
                None => self.objectives.extend(std::iter::repeat_n(f64::INFINITY, self.m)),
            }
        }
    }
}

/// Who survives.
pub trait Survival: Send {
    /// Before the first generation; `m` objectives. Returns the number of members.
    fn begin(&mut self, m: usize) -> usize;

    /// Chooses `keep` of the pool, the fittest first where they have an order.
    fn survive(&mut self, pool: &Pool, keep: usize, random: &mut Stream) -> &[u32];

    /// Which of two survivors, by their places among those chosen, wins a tournament.
    fn prefers(&self, a: usize, b: usize) -> Ordering;
}

/// An evolutionary search for a front.
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
    /// Memory for the next generation.
    next: Pool,
    generation: usize,
}

impl<S: Survival> Evolution<S> {
    /// A search of so many generations.
    pub fn new(survival: S, variation: fn(usize) -> Variation, generations: usize) -> Self {
        Self { survival, variation, generations, state: None }
    }
}

impl<S: Survival> Solver for Evolution<S> {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        let objectives = shape.rows.iter().filter(|(usage, _)| *usage == Usage::Minimise).count();
        if shape.objective == Objective::Each && objectives > 0 {
            return Ok(());
        }
        Err("it looks for a front: say `objective = \"each\"` in the study and minimise a criterion, or take `cma-es`"
            .into())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.state = None;
        if start.is_empty() {
            return Ok(());
        }
        let m = oracle.shape().rows.iter().filter(|(usage, _)| *usage == Usage::Minimise).count();
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

    /// Those of the last whole generation.
    fn members(&self) -> &[Vec<f64>] {
        self.state.as_ref().map_or(&[], |state| &state.members.points)
    }
}

impl<S: Survival> Evolution<S> {
    /// Lets the fittest survive; what is left over becomes memory for children.
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

/// Places of the feasible points and of the others, those by their violation.
pub fn by_feasibility(pool: &Pool, feasible: &mut Vec<u32>, infeasible: &mut Vec<u32>) {
    feasible.clear();
    infeasible.clear();
    for (i, &violation) in (0_u32..).zip(&pool.violations) {
        if violation == 0.0 { feasible.push(i) } else { infeasible.push(i) }
    }
    infeasible.sort_by(|&a, &b| pool.violations[a as usize].total_cmp(&pool.violations[b as usize]));
}
