//! Data and performance profiles.
//!
//! Source: J. J. More, S. M. Wild, Benchmarking derivative-free optimization algorithms, SIAM Journal on Optimization
//! 20 (2009) 172-191; E. D. Dolan, J. J. More, Mathematical Programming 91 (2002) 201-213.

use super::results::{Results, Row};

/// Score of a run: evaluations until solved, and evaluations of one simplex gradient.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Score {
    pub evaluations: Option<usize>,
    pub simplex: usize,
}

impl Score {
    /// Returns the scores of a solver, one per run.
    pub fn of(results: &Results, solver: &str, count: impl Fn(&Row) -> Option<usize>) -> Vec<Self> {
        results.of(solver).map(|row| Self { evaluations: count(row), simplex: row.variables + 1 }).collect()
    }
}

/// Returns the data profile: share of runs solved within a number of simplex gradients (`n + 1` evaluations), as the
/// corners of a step function.
#[allow(clippy::cast_precision_loss)]
pub(crate) fn data_profile(scores: &[Score]) -> Vec<(f64, f64)> {
    let spent = |score: &Score| score.evaluations.map(|count| count as f64 / score.simplex as f64);
    staircase(scores.iter().map(spent).collect())
}

/// Returns the performance profile of every solver: share of runs solved within a multiple of the evaluations of the
/// best solver.
#[allow(clippy::cast_precision_loss)]
pub(crate) fn performance_profile(solvers: &[Vec<Score>]) -> Vec<Vec<(f64, f64)>> {
    let runs = solvers.iter().map(Vec::len).min().unwrap_or(0);
    let best: Vec<Option<usize>> =
        (0..runs).map(|run| solvers.iter().filter_map(|scores| scores[run].evaluations).min()).collect();
    let ratio = |(score, best): (&Score, &Option<usize>)| Some(score.evaluations? as f64 / (*best)?.max(1) as f64);
    solvers.iter().map(|scores| staircase(scores.iter().zip(&best).map(ratio).collect())).collect()
}

/// Returns the corners of the empirical distribution of numbers, some of which are missing.
#[allow(clippy::cast_precision_loss)]
fn staircase(numbers: Vec<Option<f64>>) -> Vec<(f64, f64)> {
    let all = numbers.len().max(1) as f64;
    let mut known: Vec<f64> = numbers.into_iter().flatten().collect();
    known.sort_by(f64::total_cmp);
    let mut corners = Vec::with_capacity(2 * known.len());
    for (index, number) in known.into_iter().enumerate() {
        corners.push((number, index as f64 / all));
        corners.push((number, (index + 1) as f64 / all));
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scores(counts: &[Option<usize>]) -> Vec<Score> {
        counts.iter().map(|&evaluations| Score { evaluations, simplex: 2 }).collect()
    }

    #[test]
    fn a_data_profile_counts_simplex_gradients() {
        let profile = data_profile(&scores(&[Some(8), None, Some(2), Some(4)]));
        assert_eq!(profile, [(1.0, 0.0), (1.0, 0.25), (2.0, 0.25), (2.0, 0.5), (4.0, 0.5), (4.0, 0.75)]);
    }

    #[test]
    fn a_performance_profile_compares_with_the_best() {
        let profiles = performance_profile(&[scores(&[Some(10), None]), scores(&[Some(30), Some(5)])]);
        assert_eq!(profiles[0], [(1.0, 0.0), (1.0, 0.5)]);
        assert_eq!(profiles[1], [(1.0, 0.0), (1.0, 0.5), (3.0, 0.5), (3.0, 1.0)]);
    }
}
