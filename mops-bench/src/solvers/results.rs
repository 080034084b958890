//! What a benchmark leaves behind, and what of it one line says.

use mops_problems::{FrontFound, Slope};
use serde::{Deserialize, Serialize};

use super::Plan;

/// All rows, and what they were measured with.
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
    /// Evaluations that a run may take, for every variable and one more; as the suite has it where absent.
    #[serde(default)]
    pub budget: Option<usize>,
    /// Relative noise that was added.
    pub noise: f64,
    /// Whether the user ended it before all runs were made.
    #[serde(default)]
    pub interrupted: bool,
    pub rows: Vec<Row>,
}

/// A run of a solver on a problem.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Row {
    pub problem: String,
    pub solver: String,
    pub seed: u64,
    /// Number of variables.
    pub variables: usize,
    /// Number of objectives and constraints.
    pub rows: usize,
    /// The known minimum that is nearest.
    pub known: Option<f64>,
    /// The best objective.
    #[serde(deserialize_with = "infinite_where_null")]
    pub reached: f64,
    /// Largest violation of a constraint there.
    #[serde(deserialize_with = "infinite_where_null")]
    pub violation: f64,
    pub evaluations: usize,
    /// Exact slopes taken.
    pub linearisations: usize,
    /// Evaluations to 1e-3 of the known minimum.
    pub to_rough: Option<usize>,
    /// Evaluations to the accuracy that counts as solved.
    pub to_fine: Option<usize>,
    pub solved: bool,
    /// Whether the solver says that it has an optimum.
    pub converged: bool,
    /// Time of the whole run in s.
    pub seconds: f64,
    /// Time that was not spent in the problem's functions, in s.
    pub solver_seconds: f64,
    /// The front, where the problem has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub front: Option<Front>,
}

/// How good a front is that was found.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Front {
    /// Hypervolume of the solver's members.
    pub hypervolume: f64,
    /// Hypervolume of all points.
    pub archive: f64,
    /// Inverted generational distance of the members; infinite where there are none.
    #[serde(deserialize_with = "infinite_where_null")]
    pub distance: f64,
    /// Hypervolume of the true front.
    pub known: f64,
}

/// JSON has no infinity: it stands as `null`.
fn infinite_where_null<'d, D: serde::Deserializer<'d>>(value: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(value)?.unwrap_or(f64::INFINITY))
}

impl From<FrontFound> for Front {
    fn from(found: FrontFound) -> Self {
        let FrontFound { hypervolume, distance, archive, known } = found;
        Self { hypervolume, archive, distance, known }
    }
}

/// A solver in one line.
pub(crate) struct Summary {
    pub solver: String,
    pub runs: usize,
    /// Runs on problems with a known minimum.
    pub judged: usize,
    pub solved: usize,
    /// Runs that end with an optimum that violates a constraint.
    pub false_claims: usize,
    /// Median evaluations to 1e-3, of the runs that got there.
    pub median_rough: Option<f64>,
    /// Median evaluations to the accuracy that counts as solved, of the runs that got there.
    pub median_fine: Option<f64>,
    pub seconds: f64,
    /// Solver and engine, per evaluation, in ns.
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

    /// The solvers in the order of their rows.
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

    /// The row of the same run in these results; of another solver where they have but one.
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
            false_claims: rows.iter().filter(|row| row.converged && row.violation > mops::core::FEASIBLE).count(),
            median_rough: median(rows.iter().filter_map(|row| row.to_rough)),
            median_fine: median(rows.iter().filter_map(|row| row.to_fine)),
            seconds: rows.iter().map(|row| row.seconds).sum(),
            nanoseconds: 1e9 * own / evaluations.max(1) as f64,
        }
    }
}

/// The median; between the two in the middle of an even number.
#[allow(clippy::cast_precision_loss)]
fn median(counts: impl Iterator<Item = usize>) -> Option<f64> {
    let mut counts: Vec<usize> = counts.collect();
    counts.sort_unstable();
    let upper = *counts.get(counts.len() / 2)?;
    let lower = counts[(counts.len() - 1) / 2];
    Some(0.5 * (lower + upper) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_median_of_an_even_number_lies_between() {
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
