//! NSGA-II: Pareto fronts by non-dominated sorting and crowding.

mod pruning;

use std::cmp::Ordering;

use mops_core::{Solver, SolverOptions, front::FrontSorter};
use mops_math::Stream;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::evolution::{Evolution, Pool, Survival, by_feasibility};
use crate::variation::Variation;
use pruning::Pruning;

/// Non-dominated sorting genetic algorithm (NSGA-II) for the Pareto front of two or three criteria. Needs `objective =
/// "each"`.
///
/// Members of low rank, which few others dominate, survive; among equal ranks those in sparse regions. Feasible points
/// rank before infeasible ones. If the last rank fits only in part, its most crowded members are removed one at a time.
///
/// Source: K. Deb, A. Pratap, S. Agarwal, T. Meyarivan, IEEE Transactions on Evolutionary Computation 6 (2002) 182-197;
/// removal one at a time: S. Kukkonen, K. Deb, IEEE CEC (2006) 1179-1186.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct Nsga2Options {
    /// Population size.
    #[schemars(range(min = 4, max = 1_000_000))]
    pub population: usize,
    /// Number of generations.
    #[schemars(range(min = 1))]
    pub generations: usize,
}

impl Default for Nsga2Options {
    fn default() -> Self {
        Self { population: 100, generations: 250 }
    }
}

impl Nsga2Options {
    /// Builds the solver with access to its members.
    pub fn search(&self) -> Evolution<Crowding> {
        let survival = Crowding { population: self.population.max(4), ..Crowding::default() };
        Evolution::new(survival, Variation::usual, self.generations)
    }
}

impl SolverOptions for Nsga2Options {
    const KIND: &'static str = "nsga2";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(self.search())
    }
}

/// Environmental selection by rank, then by crowding distance.
#[derive(Default)]
pub struct Crowding {
    population: usize,
    sorter: FrontSorter,
    feasible: Vec<u32>,
    infeasible: Vec<u32>,
    objectives: Vec<f64>,
    /// Rank and crowding distance of every point of the pool.
    rank: Vec<u32>,
    distance: Vec<f64>,
    chosen: Vec<u32>,
    /// Rank and crowding distance of the survivors.
    fitness: Vec<(u32, f64)>,
    /// Indices of the feasible points in order of rank, and the offset of each rank.
    by_rank: Vec<u32>,
    offsets: Vec<usize>,
    pruning: Pruning,
}

impl Survival for Crowding {
    fn begin(&mut self, _: usize) -> usize {
        self.population
    }

    fn survive(&mut self, pool: &Pool, keep: usize, _: &mut Stream) -> &[u32] {
        by_feasibility(pool, &mut self.feasible, &mut self.infeasible);
        self.sort(pool);
        self.chosen.clear();
        for rank in 0..self.offsets.len() - 1 {
            let (from, to) = (self.offsets[rank], self.offsets[rank + 1]);
            self.crowding_distances(pool, from, to);
            let remaining = keep - self.chosen.len();
            if to - from > remaining {
                self.pruning.prune(pool, &mut self.by_rank[from..to], remaining, &mut self.distance);
            }
            self.chosen.extend(self.by_rank[from..to].iter().take(remaining));
            if self.chosen.len() == keep {
                break;
            }
        }
        let remaining = keep - self.chosen.len();
        self.chosen.extend(self.infeasible.iter().take(remaining));
        self.fitness.clear();
        self.fitness.extend(self.chosen.iter().map(|&i| (self.rank[i as usize], self.distance[i as usize])));
        &self.chosen
    }

    fn prefers(&self, a: usize, b: usize) -> Ordering {
        let (a, b) = (self.fitness[a], self.fitness[b]);
        a.0.cmp(&b.0).then(b.1.total_cmp(&a.1))
    }
}

impl Crowding {
    /// Ranks the feasible points by dominance; the infeasible ones follow, ordered by violation.
    #[allow(clippy::cast_possible_truncation)]
    fn sort(&mut self, pool: &Pool) {
        self.objectives.clear();
        for &i in &self.feasible {
            self.objectives.extend_from_slice(pool.row(i as usize));
        }
        self.rank.clear();
        self.rank.resize(pool.len(), u32::MAX);
        self.distance.clear();
        self.distance.resize(pool.len(), 0.0);
        let ranks = self.sorter.sort(&self.objectives, pool.m);
        let fronts = ranks.iter().max().map_or(0, |rank| *rank as usize + 1);
        // Counting sort by rank.
        self.offsets.clear();
        self.offsets.resize(fronts + 1, 0);
        ranks.iter().for_each(|rank| self.offsets[*rank as usize + 1] += 1);
        for rank in 0..fronts {
            self.offsets[rank + 1] += self.offsets[rank];
        }
        self.by_rank.clear();
        self.by_rank.resize(ranks.len(), 0);
        for (&i, &rank) in self.feasible.iter().zip(ranks) {
            self.rank[i as usize] = rank;
            let slot = &mut self.offsets[rank as usize];
            self.by_rank[*slot] = i;
            *slot += 1;
        }
        self.offsets.rotate_right(1);
        self.offsets[0] = 0;
        for (later, &i) in (0_u32..).zip(&self.infeasible) {
            self.rank[i as usize] = fronts as u32 + later;
        }
    }

    /// Computes the crowding distances of a front: the mean over the objectives of the gap between the neighbours,
    /// relative to the range of the front; infinite at the ends.
    fn crowding_distances(&mut self, pool: &Pool, from: usize, to: usize) {
        let front = &mut self.by_rank[from..to];
        #[allow(clippy::cast_precision_loss)]
        let share = 1.0 / pool.m as f64;
        for k in 0..pool.m {
            let value = |i: u32| pool.objectives[i as usize * pool.m + k];
            front.sort_unstable_by(|&a, &b| value(a).total_cmp(&value(b)).then(a.cmp(&b)));
            let (first, last) = (front[0], front[front.len() - 1]);
            let range = value(last) - value(first);
            self.distance[first as usize] = f64::INFINITY;
            self.distance[last as usize] = f64::INFINITY;
            if range > 0.0 {
                for near in front.windows(3) {
                    self.distance[near[1] as usize] += share * (value(near[2]) - value(near[0])) / range;
                }
            }
        }
    }
}
