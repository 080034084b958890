//! Differential evolution with adaptive parameters (SHADE).

use mops_core::{Halt, Merit, Oracle, Progress, Shape, Solver, SolverOptions};
use mops_math as math;
use mops_math::Stream;
use rand::Rng;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::polishing::Polished;
use crate::population::{Next, Population, RestartRule, StagnationMonitor};
use crate::ranking::compare;

/// Differential evolution with success-history based parameter adaptation (SHADE). A derivative-free global search,
/// strong on separable problems.
///
/// A whole generation is evaluated in parallel. The population is resampled once its members have converged or nothing
/// improves. The method uses two numbers per point: the objective and the largest violation.
///
/// Source: R. Tanabe, A. Fukunaga, Success-history based parameter adaptation for differential evolution, IEEE CEC
/// (2013) 71-78, with a memory of six entries as in L-SHADE, IEEE CEC (2014) 1658-1665.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct DifferentialEvolutionOptions {
    /// Population size; 0 for ten per tuner, at least 20 and at most 100.
    #[schemars(range(max = 1_000_000))]
    pub population: usize,
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

impl Default for DifferentialEvolutionOptions {
    fn default() -> Self {
        Self { population: 0, tolerance: 1e-10, patience: 200, restarts: 20, polish: true }
    }
}

impl SolverOptions for DifferentialEvolutionOptions {
    const KIND: &'static str = "differential-evolution";

    fn build(&self) -> Box<dyn Solver> {
        let search = Box::new(DifferentialEvolution { options: self.clone(), state: None });
        if self.polish { Box::new(Polished::new(Self::KIND, search)) } else { search }
    }
}

/// Solver of the kind `differential-evolution`.
struct DifferentialEvolution {
    options: DifferentialEvolutionOptions,
    state: Option<State>,
}

struct State {
    random: Stream,
    population: Population,
    /// Buffer for the trial vectors.
    trials: Vec<Vec<f64>>,
    /// Archive of parents replaced by better trial vectors.
    archive: Vec<Vec<f64>>,
    history: SuccessHistory,
    stagnation: StagnationMonitor,
}

impl Solver for DifferentialEvolution {
    fn accepts(&self, _: &Shape) -> Result<(), String> {
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.state = None;
        if start.is_empty() {
            return Ok(());
        }
        let mut random = oracle.stream("differential-evolution");
        let population = Population::sample(oracle, self.size(start.len()), Some(start), &mut random)?;
        let DifferentialEvolutionOptions { tolerance, patience, restarts, .. } = self.options;
        let stagnation = StagnationMonitor::new(&population, RestartRule { tolerance, patience, restarts });
        let trials = population.points.clone();
        self.state =
            Some(State { random, population, trials, archive: Vec::new(), history: SuccessHistory::new(), stagnation });
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let n = oracle.shape().dimension();
        let size = self.size(n);
        let Some(state) = &mut self.state else { return Ok(Progress::Converged) };
        state.generation(oracle)?;
        match state.stagnation.next(&state.population) {
            Next::Generation => return Ok(Progress::Continue),
            Next::End => return Ok(Progress::Stalled),
            Next::Restart => {}
        }
        state.population = Population::sample(oracle, size, None, &mut state.random)?;
        state.archive.clear();
        state.history = SuccessHistory::new();
        Ok(Progress::Continue)
    }
}

impl DifferentialEvolution {
    fn size(&self, n: usize) -> usize {
        if self.options.population > 0 { self.options.population.max(5) } else { (10 * n).clamp(20, 100) }
    }
}

impl State {
    /// Evaluates one trial vector per member and selects the survivors.
    fn generation(&mut self, oracle: &mut dyn Oracle) -> Result<(), Halt> {
        let size = self.population.len();
        let order = self.population.order();
        let mut factors = Vec::with_capacity(size);
        let mut trials = std::mem::take(&mut self.trials);
        for (member, trial) in trials.iter_mut().enumerate() {
            let drawn = self.history.draw(&mut self.random);
            self.mutate_and_cross(trial, member, &order, drawn);
            factors.push(drawn);
        }
        let answers = oracle.evaluate(&trials)?;
        let mut successes = Vec::with_capacity(size);
        for (member, (trial, answer)) in trials.iter_mut().zip(&answers).enumerate() {
            let (before, merit) = (self.population.merits[member], answer.merit);
            let comparison = compare(&merit, &before);
            if comparison.is_gt() {
                continue;
            }
            // After this swap, `trial` contains the parent.
            std::mem::swap(&mut self.population.points[member], trial);
            self.population.merits[member] = merit;
            if comparison.is_lt() {
                successes.push((factors[member], improvement(&before, &merit)));
                if self.archive.len() < size {
                    self.archive.push(trial.clone());
                } else {
                    let slot = self.random.random_range(0..size);
                    std::mem::swap(&mut self.archive[slot], trial);
                }
            }
        }
        self.trials = trials;
        self.history.update(&successes);
        Ok(())
    }

    /// Writes `x + F (x_p - x) + F (x_1 - x_2)`, crossed with `x`, to `trial`. `x_p` is drawn from the best members: a
    /// random share of up to 20 %, at least two. `x_2` may come from the archive.
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    fn mutate_and_cross(&mut self, trial: &mut [f64], member: usize, order: &[usize], [factor, rate]: [f64; 2]) {
        let size = self.population.len();
        let random = &mut self.random;
        let elite = 2.max((random.random_range(0.0..0.2) * size as f64) as usize);
        let best = order[random.random_range(0..elite)];
        let first = loop {
            let drawn = random.random_range(0..size);
            if drawn != member {
                break drawn;
            }
        };
        let second = loop {
            let drawn = random.random_range(0..size + self.archive.len());
            if drawn != member && drawn != first {
                break drawn;
            }
        };
        let points = &self.population.points;
        let other = if second < size { &points[second] } else { &self.archive[second - size] };
        let x = &points[member];
        let forced = random.random_range(0..x.len());
        let coordinate = |j: usize| {
            if j != forced && random.random::<f64>() >= rate {
                return x[j];
            }
            let mutant = x[j] + factor * (points[best][j] - x[j] + points[first][j] - other[j]);
            // Midpoint between the parent and the violated face.
            if mutant < 0.0 {
                0.5 * x[j]
            } else if mutant > 1.0 {
                0.5 * (1.0 + x[j])
            } else {
                mutant
            }
        };
        trial.iter_mut().zip((0..x.len()).map(coordinate)).for_each(|(place, value)| *place = value);
    }
}

/// Returns the improvement of a merit.
fn improvement(before: &Merit, after: &Merit) -> f64 {
    let improvement = if after.is_feasible() && before.is_feasible() {
        before.objective - after.objective
    } else {
        before.violation - after.violation
    };
    if improvement.is_finite() && improvement > 0.0 { improvement } else { f64::MIN_POSITIVE }
}

/// Means of the successful scale factors and crossover rates.
#[derive(Debug, Clone)]
struct SuccessHistory {
    means: [[f64; 2]; 6],
    next: usize,
}

impl SuccessHistory {
    fn new() -> Self {
        Self { means: [[0.5, 0.5]; 6], next: 0 }
    }

    fn draw(&self, random: &mut Stream) -> [f64; 2] {
        let [factor, rate] = self.means[random.random_range(0..self.means.len())];
        // Cauchy distribution around `factor`, normal distribution around `rate`.
        let factor = loop {
            let drawn = factor + 0.1 * math::tan(std::f64::consts::PI * random.random::<f64>());
            if drawn > 0.0 {
                break drawn.min(1.0);
            }
        };
        let rate = rate + 0.1 * math::normal(random);
        [factor, rate.clamp(0.0, 1.0)]
    }

    /// Stores the weighted Lehmer mean of the successful factors and the weighted mean of the successful rates.
    fn update(&mut self, successes: &[([f64; 2], f64)]) {
        let largest = successes.iter().map(|(_, improvement)| *improvement).fold(0.0, f64::max);
        if successes.is_empty() || largest <= 0.0 {
            return;
        }
        let sum = |f: &dyn Fn(&[f64; 2]) -> f64| {
            successes.iter().map(|(s, improvement)| improvement / largest * f(s)).sum::<f64>()
        };
        let factor = sum(&|[factor, _]| factor * factor) / sum(&|[factor, _]| *factor);
        let rate = sum(&|[_, rate]| *rate) / sum(&|_| 1.0);
        self.means[self.next] = [factor, rate];
        self.next = (self.next + 1) % self.means.len();
    }
}
