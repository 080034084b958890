//! Real-coded genetic algorithm.

use mops_core::{Halt, Oracle, Progress, Shape, Solver, SolverOptions};
use mops_math::Stream;
use rand::Rng;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::polishing::Polished;
use crate::population::{Next, Population, RestartRule, StagnationMonitor};
use crate::ranking::compare;
use crate::variation::Variation;

/// Real-coded genetic algorithm: tournament selection, simulated binary crossover, polynomial mutation; the better half
/// of parents and children survives. Feasible points rank before infeasible ones.
///
/// Once the members have converged or nothing improves, the population is resampled. Only the best point is kept, and
/// crossover and mutation take finer steps each time. For rough searches and whole numbers; for accurate optima use
/// `cma-es`.
///
/// Source: K. Deb, Multi-Objective Optimization Using Evolutionary Algorithms (2001), sections 4.4 and 4.5 (real-coded
/// operators); K. Deb, Computer Methods in Applied Mechanics and Engineering 186 (2000) 311-338 (constraints).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct GeneticOptions {
    /// Population size.
    #[schemars(range(min = 4, max = 1_000_000))]
    pub population: usize,
    /// Probability that a pair of parents is crossed.
    #[schemars(range(min = 0, max = 1))]
    pub crossover: f64,
    /// Distribution index of the crossover; large values keep children near their parents.
    #[schemars(range(min = 0, max = 1000))]
    pub crossover_index: f64,
    /// Distribution index of the mutation; large values give small steps. A coordinate is mutated with probability `1 /
    /// n`.
    #[schemars(range(min = 0, max = 1000))]
    pub mutation_index: f64,
    /// The population has converged when the values of its members differ by less than this, relative to the objective.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub tolerance: f64,
    /// Number of generations without improvement after which the population is resampled.
    #[schemars(range(min = 1))]
    pub patience: usize,
    /// Maximum number of times that the population is resampled.
    pub restarts: usize,
    /// Whether local searches start from the best points at the end, with a fifth of the budget.
    pub polish: bool,
}

impl Default for GeneticOptions {
    fn default() -> Self {
        Self {
            population: 40,
            crossover: 0.9,
            crossover_index: 15.0,
            mutation_index: 20.0,
            tolerance: 1e-10,
            patience: 40,
            restarts: 20,
            polish: true,
        }
    }
}

impl SolverOptions for GeneticOptions {
    const KIND: &'static str = "genetic";

    fn build(&self) -> Box<dyn Solver> {
        let search = Box::new(Genetic { options: self.clone(), state: None });
        if self.polish { Box::new(Polished::new(Self::KIND, search)) } else { search }
    }
}

/// Solver of the kind `genetic`.
struct Genetic {
    options: GeneticOptions,
    state: Option<State>,
}

struct State {
    random: Stream,
    population: Population,
    /// Buffer for the children.
    children: Vec<Vec<f64>>,
    variation: Variation,
    stagnation: StagnationMonitor,
}

impl Solver for Genetic {
    fn accepts(&self, _: &Shape) -> Result<(), String> {
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.state = None;
        if start.is_empty() {
            return Ok(());
        }
        let options = &self.options;
        let mut random = oracle.stream("genetic");
        let population = Population::sample(oracle, options.population.max(4), Some(start), &mut random)?;
        let GeneticOptions { tolerance, patience, restarts, .. } = *options;
        let stagnation = StagnationMonitor::new(&population, RestartRule { tolerance, patience, restarts });
        let variation = Variation {
            crossover: options.crossover,
            crossover_index: options.crossover_index,
            mutation_index: options.mutation_index,
            ..Variation::usual(start.len())
        };
        // Children are created in pairs.
        let pairs = population.len().div_ceil(2);
        let children = vec![vec![0.0; start.len()]; 2 * pairs];
        self.state = Some(State { random, population, children, variation, stagnation });
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(state) = &mut self.state else { return Ok(Progress::Converged) };
        state.generation(oracle)?;
        match state.stagnation.next(&state.population) {
            Next::Generation => return Ok(Progress::Continue),
            Next::End => return Ok(Progress::Stalled),
            Next::Restart => {}
        }
        let best = state.population.points[0].clone();
        state.population = Population::sample(oracle, state.population.len(), Some(&best), &mut state.random)?;
        // Finer steps around the best point.
        state.variation.mutation_index *= 1.5;
        state.variation.crossover_index *= 1.2;
        Ok(Progress::Continue)
    }
}

impl State {
    /// Creates as many children as members; the better half of all points survives, the best first.
    fn generation(&mut self, oracle: &mut dyn Oracle) -> Result<(), Halt> {
        let size = self.population.len();
        let mut children = std::mem::take(&mut self.children);
        for pair in children.chunks_exact_mut(2) {
            let [a, b] = pair else { continue };
            for child in [&mut *a, &mut *b] {
                let parent = self.tournament_winner();
                child.copy_from_slice(&self.population.points[parent]);
            }
            self.variation.cross(a, b, &mut self.random);
            self.variation.mutate(a, &mut self.random);
            self.variation.mutate(b, &mut self.random);
        }
        let answers = oracle.evaluate(&children[..size])?;
        self.population.points.extend(children.drain(..size));
        self.population.merits.extend(answers.iter().map(|answer| answer.merit));
        let unused = self.population.truncate(size);
        children.extend(unused);
        self.children = children;
        Ok(())
    }

    /// Returns the better of two random members.
    fn tournament_winner(&mut self) -> usize {
        let size = self.population.len();
        let (a, b) = (self.random.random_range(0..size), self.random.random_range(0..size));
        if compare(&self.population.merits[b], &self.population.merits[a]).is_lt() { b } else { a }
    }
}
