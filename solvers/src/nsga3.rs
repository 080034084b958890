//! NSGA-III: Pareto fronts spread along reference directions.

mod normalisation;

use std::cmp::Ordering;

use mops_core::{Solver, SolverOptions, front::FrontSorter};
use mops_math::Stream;
use rand::Rng;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::evolution::{Evolution, Pool, Survival, by_feasibility};
use crate::simplex_lattice;
use crate::variation::Variation;
use normalisation::Normalisation;

/// Reference-point based non-dominated sorting (NSGA-III) for the Pareto front of three or more criteria. Needs
/// `objective = "each"`.
///
/// Members of low rank, which few others dominate, survive; among equal ranks those nearest to reference directions
/// with few members. Feasible points rank before infeasible ones.
///
/// Source: K. Deb, H. Jain, IEEE Transactions on Evolutionary Computation 18 (2014) 577-601; constraints: H. Jain, K.
/// Deb, ibid. 602-622; reference directions: I. Das, J. E. Dennis, SIAM J. Optimization 8 (1998) 631-657.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct Nsga3Options {
    /// Divisions per objective of the lattice of reference directions; 0 for the largest number that gives at most 100
    /// directions.
    #[schemars(range(max = 200))]
    pub divisions: usize,
    /// Number of generations.
    #[schemars(range(min = 1))]
    pub generations: usize,
}

impl Default for Nsga3Options {
    fn default() -> Self {
        Self { divisions: 0, generations: 250 }
    }
}

impl Nsga3Options {
    /// Builds the solver with access to its members.
    pub fn search(&self) -> Evolution<Niching> {
        let survival = Niching { divisions: self.divisions, ..Niching::default() };
        // Large crossover index as in the paper: members of different niches are far apart.
        Evolution::new(
            survival,
            |n| Variation { crossover: 1.0, crossover_index: 30.0, ..Variation::usual(n) },
            self.generations,
        )
    }
}

impl SolverOptions for Nsga3Options {
    const KIND: &'static str = "nsga3";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(self.search())
    }
}

/// Environmental selection by rank, then by niche count.
#[derive(Default)]
pub struct Niching {
    divisions: usize,
    directions: Vec<Vec<f64>>,
    normalisation: Normalisation,
    sorter: FrontSorter,
    feasible: Vec<u32>,
    infeasible: Vec<u32>,
    objectives: Vec<f64>,
    chosen: Vec<u32>,
    violations: Vec<f64>,
}

/// Candidate of the last front: index in the pool, nearest reference direction, and squared distance from that
/// direction.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    member: u32,
    direction: usize,
    distance: f64,
}

impl Survival for Niching {
    fn begin(&mut self, m: usize) -> usize {
        let divisions = if self.divisions > 0 { self.divisions } else { simplex_lattice::max_divisions(m, 100) };
        self.directions = simplex_lattice::reference_directions(m, divisions);
        self.normalisation = Normalisation::new(m);
        // Round up to a multiple of four.
        self.directions.len().div_ceil(4).max(2) * 4
    }

    fn survive(&mut self, pool: &Pool, keep: usize, random: &mut Stream) -> &[u32] {
        by_feasibility(pool, &mut self.feasible, &mut self.infeasible);
        self.objectives.clear();
        for &i in &self.feasible {
            self.objectives.extend_from_slice(pool.row(i as usize));
        }
        let ranks = self.sorter.sort(&self.objectives, pool.m);
        let mut order: Vec<usize> = (0..ranks.len()).collect();
        order.sort_by_key(|&i| ranks[i]);
        let target = keep.min(order.len());
        self.chosen.clear();
        if target > 0 {
            self.normalisation.update(&self.objectives, ranks);
            let last = ranks[order[target - 1]];
            let complete = order.partition_point(|&i| ranks[i] < last);
            let candidates_end = order.partition_point(|&i| ranks[i] <= last);
            self.chosen.extend(order[..complete].iter().map(|&i| self.feasible[i]));
            if candidates_end > target {
                let mut counts = vec![0_usize; self.directions.len()];
                order[..complete].iter().for_each(|&i| counts[self.associate(pool, i).direction] += 1);
                let candidates = order[complete..candidates_end].iter().map(|&i| self.associate(pool, i)).collect();
                fill_niches(&mut self.chosen, target, candidates, &mut counts, random);
            } else {
                self.chosen.extend(order[complete..target].iter().map(|&i| self.feasible[i]));
            }
        }
        let remaining = keep - self.chosen.len();
        self.chosen.extend(self.infeasible.iter().take(remaining));
        self.violations.clear();
        self.violations.extend(self.chosen.iter().map(|&i| pool.violations[i as usize]));
        &self.chosen
    }

    /// Compares violations only.
    fn prefers(&self, a: usize, b: usize) -> Ordering {
        self.violations[a].total_cmp(&self.violations[b])
    }
}

impl Niching {
    /// Finds the reference direction nearest to the `i`-th feasible point.
    fn associate(&self, pool: &Pool, i: usize) -> Candidate {
        let member = self.feasible[i];
        let row = pool.row(member as usize);
        let mut best = Candidate { member, direction: 0, distance: f64::INFINITY };
        for (direction, d) in self.directions.iter().enumerate() {
            let (mut along, mut square) = (0.0, 0.0);
            for k in 0..row.len() {
                let value = self.normalisation.normalised(k, row[k]);
                along += value * d[k];
                square += value * value;
            }
            let distance = square - along * along;
            if distance < best.distance {
                best = Candidate { member, direction, distance };
            }
        }
        best
    }
}

/// Adds candidates until `target` points are chosen, always from a direction with the fewest members: the nearest
/// candidate if that direction is empty, otherwise a random one.
fn fill_niches(
    chosen: &mut Vec<u32>,
    target: usize,
    mut candidates: Vec<Candidate>,
    counts: &mut [usize],
    random: &mut Stream,
) {
    let (mut rarest, mut niche): (Vec<usize>, Vec<usize>) = Default::default();
    while chosen.len() < target {
        let fewest = candidates.iter().map(|c| counts[c.direction]).min().expect("more candidates than places");
        rarest.clear();
        rarest.extend(candidates.iter().map(|c| c.direction).filter(|&direction| counts[direction] == fewest));
        rarest.sort_unstable();
        rarest.dedup();
        let direction = rarest[random.random_range(0..rarest.len())];
        niche.clear();
        niche.extend((0..candidates.len()).filter(|&i| candidates[i].direction == direction));
        let chosen_candidate = if fewest == 0 {
            let nearer = |a: &usize, b: &usize| candidates[*a].distance.total_cmp(&candidates[*b].distance);
            niche.iter().copied().min_by(nearer).expect("the direction has candidates")
        } else {
            niche[random.random_range(0..niche.len())]
        };
        counts[direction] += 1;
        chosen.push(candidates.swap_remove(chosen_candidate).member);
    }
}
