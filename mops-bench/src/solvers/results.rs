//! Results of a solver benchmark, and their summary.

use mops::core::Merit;
use mops_problems::{FrontFound, Slope};
use serde::{Deserialize, Serialize};

use super::plan::Plan;

/// Results of a benchmark, with its settings.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Results {
    /// Version of this layout.
    pub format: u32,
    /// Version of mops.
    pub mops: String,
    pub suite: String,
    /// `exact` or `differences`.
    pub slopes: String,
    /// Accuracy that counts as solved.
    pub accuracy: f64,
    /// Budget as a multiple of n + 1 evaluations for n variables; that of the suite if absent.
    #[serde(default)]
    pub budget: Option<usize>,
    /// Relative noise added to all values.
    pub noise: f64,
    /// True if the benchmark was interrupted before its last run.
    #[serde(default)]
    pub interrupted: bool,
    pub rows: Vec<Row>,
}

/// Run of a solver on a problem.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Row {
    pub problem: String,
    pub solver: String,
    pub seed: u64,
    /// Number of variables.
    pub variables: usize,
    /// Number of objectives and constraints.
    pub rows: usize,
    /// Nearest known minimum.
    pub known: Option<f64>,
    /// Objective of the best point.
    #[serde(deserialize_with = "infinite_where_null")]
    pub reached: f64,
    /// Largest constraint violation at the best point.
    #[serde(deserialize_with = "infinite_where_null")]
    pub violation: f64,
    pub evaluations: usize,
    /// Number of exact linearisations.
    pub linearisations: usize,
    /// Evaluations until within 1e-3 of the known minimum.
    pub to_rough: Option<usize>,
    /// Evaluations until solved.
    pub to_fine: Option<usize>,
    pub solved: bool,
    /// True if the solver reports convergence.
    pub converged: bool,
    /// Time of the whole run, in s.
    pub seconds: f64,
    /// Time outside the functions of the problem, in s.
    pub solver_seconds: f64,
    /// Quality of the Pareto front, if the problem has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub front: Option<Front>,
}

/// Quality of a computed Pareto front.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Front {
    /// Hypervolume of the members of the last generation.
    pub hypervolume: f64,
    /// Hypervolume of all evaluated points.
    pub archive: f64,
    /// Inverted generational distance of the members; infinite without members.
    #[serde(deserialize_with = "infinite_where_null")]
    pub distance: f64,
    /// Hypervolume of the true front.
    pub known: f64,
}

/// Reads a number; `null` means infinity, which JSON lacks.
fn infinite_where_null<'d, D: serde::Deserializer<'d>>(value: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(value)?.unwrap_or(f64::INFINITY))
}

impl From<FrontFound> for Front {
    fn from(found: FrontFound) -> Self {
        let FrontFound { hypervolume, distance, archive, known } = found;
        Self { hypervolume, archive, distance, known }
    }
}

/// Summary of a solver.
pub(crate) struct Summary {
    pub solver: String,
    pub runs: usize,
    /// Number of runs on problems with a known minimum.
    pub judged: usize,
    pub solved: usize,
    /// Number of runs that converged to a point that violates a constraint.
    pub false_claims: usize,
    /// Median evaluations to 1e-3, over successful runs.
    pub median_rough: Option<f64>,
    /// Median evaluations until solved, over solved runs.
    pub median_fine: Option<f64>,
    pub seconds: f64,
    /// Overhead of solver and engine per evaluation, in ns.
    pub nanoseconds: f64,
}

impl Results {
    pub fn new(plan: &Plan, rows: Vec<Row>, interrupted: bool) -> Self {
        Self {
            format: 1,
            mops: env!("CARGO_PKG_VERSION").to_owned(),
            suite: plan.suite.name.to_owned(),
            slopes: if plan.slope == Slope::Exact { "exact" } else { "differences" }.to_owned(),
            accuracy: plan.suite.accuracy,
            budget: plan.budget,
            noise: plan.noise,
            interrupted,
            rows,
        }
    }

    /// Returns the solvers in the order of their rows.
    pub fn solvers(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for row in &self.rows {
            if !names.contains(&row.solver.as_str()) {
                names.push(&row.solver);
            }
        }
        names
    }

    pub fn of<'a>(&'a self, solver: &str) -> impl Iterator<Item = &'a Row> {
        let solver = solver.to_owned();
        self.rows.iter().filter(move |row| row.solver == solver)
    }

    /// Returns the corresponding run in these results. If they have only one solver, its runs are used.
    pub fn same(&self, wanted: &Row) -> Option<&Row> {
        let solvers = self.solvers();
        let solver = if let [only] = solvers[..] { only } else { &wanted.solver };
        self.of(solver).find(|row| row.problem == wanted.problem && row.seed == wanted.seed)
    }

    #[allow(clippy::cast_precision_loss)]
    pub fn summary(&self, solver: &str) -> Summary {
        let rows: Vec<&Row> = self.of(solver).collect();
        let evaluations: usize = rows.iter().map(|row| row.evaluations).sum();
        let own: f64 = rows.iter().map(|row| row.solver_seconds).sum();
        Summary {
            solver: solver.to_owned(),
            runs: rows.len(),
            judged: rows.iter().filter(|row| row.known.is_some()).count(),
            solved: rows.iter().filter(|row| row.solved).count(),
            false_claims: rows
                .iter()
                .filter(|row| row.converged && row.violation > mops::core::evaluation::FEASIBLE)
                .count(),
            median_rough: median(rows.iter().filter_map(|row| row.to_rough)),
            median_fine: median(rows.iter().filter_map(|row| row.to_fine)),
            seconds: rows.iter().map(|row| row.seconds).sum(),
            nanoseconds: 1e9 * own / evaluations.max(1) as f64,
        }
    }
}

/// Returns the median; the mean of the two middle values for an even count.
#[allow(clippy::cast_precision_loss)]
fn median(counts: impl Iterator<Item = usize>) -> Option<f64> {
    let mut counts: Vec<usize> = counts.collect();
    counts.sort_unstable();
    let upper = *counts.get(counts.len() / 2)?;
    let lower = counts[(counts.len() - 1) / 2];
    Some(0.5 * (lower + upper) as f64)
}

/// Finished run, with the merit of every point.
pub(super) struct Done {
    pub(super) row: Row,
    pub(super) history: Vec<Merit>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_an_even_count_is_the_mean_of_the_middle_values() {
        assert_eq!(median([9, 3, 5].into_iter()), Some(5.0));
        assert_eq!(median([9, 3, 6, 5].into_iter()), Some(5.5));
        assert_eq!(median(std::iter::empty()), None);
    }

    #[test]
    fn an_infinite_distance_is_read_as_it_was_written() {
        let front = Front { hypervolume: 0.0, archive: 0.0, distance: f64::INFINITY, known: 1.0 };
        let text = serde_json::to_string(&front).unwrap();
        assert!(text.contains(r#""distance":null"#), "{text}");
        assert!(serde_json::from_str::<Front>(&text).unwrap().distance.is_infinite());
    }
}
