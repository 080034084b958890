//! Figures of the documentation: one row per suite and solver in a CSV file, and the Markdown table of such a file.

use serde::{Deserialize, Serialize};

use super::results::Results;

/// Figures of a solver on a suite.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Figure {
    pub suite: String,
    pub solver: String,
    /// `exact`, `differences`, or `own` for studies.
    pub gradients: String,
    /// Relative noise added to all values.
    pub noise: f64,
    /// Number of seeds: 1, 2, ...
    pub seeds: u64,
    /// Number of solved runs; of fronts, the mean relative hypervolume.
    pub solved: f64,
    /// Number of runs with a known solution.
    pub runs: usize,
    /// Median evaluations until solved.
    pub median_evaluations: Option<f64>,
    /// Evaluations of all runs.
    pub evaluations: usize,
    /// Version of mops.
    pub mops: String,
    /// Date, `2026-11-26`.
    pub date: String,
}

/// Returns the figures of a benchmark, one per solver.
#[allow(clippy::cast_precision_loss)]
pub(crate) fn figures(results: &Results, gradients: &str, date: &str) -> Vec<Figure> {
    let of = |solver: &&str| {
        let summary = results.summary(solver);
        let volumes: Vec<f64> =
            results.of(solver).filter_map(|row| row.front.map(|front| front.hypervolume / front.known)).collect();
        let mean = volumes.iter().sum::<f64>() / volumes.len().max(1) as f64;
        Figure {
            suite: results.suite.clone(),
            solver: (*solver).to_owned(),
            gradients: gradients.to_owned(),
            noise: results.noise,
            seeds: results.of(solver).map(|row| row.seed).max().unwrap_or(0),
            solved: if volumes.is_empty() { summary.solved as f64 } else { (1e6 * mean).round() / 1e6 },
            runs: if volumes.is_empty() { summary.judged } else { volumes.len() },
            median_evaluations: summary.median_fine,
            evaluations: results.of(solver).map(|row| row.evaluations).sum(),
            mops: results.mops.clone(),
            date: date.to_owned(),
        }
    };
    results.solvers().iter().map(of).collect()
}

/// Puts figures in place of those of the same suite, solver, gradients and noise, or behind the others.
pub(crate) fn updated(mut known: Vec<Figure>, new: Vec<Figure>) -> Vec<Figure> {
    for figure in new {
        let same = |other: &Figure| {
            (&other.suite, &other.solver, &other.gradients, other.noise.to_bits())
                == (&figure.suite, &figure.solver, &figure.gradients, figure.noise.to_bits())
        };
        match known.iter().position(same) {
            Some(index) => known[index] = figure,
            None => known.push(figure),
        }
    }
    known
}

/// Reads the text of a CSV file of figures.
///
/// # Errors
/// The text is none.
pub(crate) fn read(text: &str) -> Result<Vec<Figure>, csv::Error> {
    csv::Reader::from_reader(text.as_bytes()).deserialize().collect()
}

/// Returns the text of the CSV file.
pub(crate) fn write(figures: &[Figure]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    figures.iter().for_each(|figure| writer.serialize(figure).expect("memory takes every row"));
    String::from_utf8(writer.into_inner().expect("memory is never full")).expect("CSV of strings is UTF-8")
}

/// Returns the figures as a Markdown table.
pub(crate) fn markdown(figures: &[Figure]) -> String {
    let mut text = "| suite | solver | gradients | seeds | solved | median evaluations | evaluations | mops | date |\n\
                    |---|---|---|---|---|---|---|---|---|\n"
        .to_owned();
    for figure in figures {
        let Figure { suite, solver, gradients, noise, seeds, solved, runs, evaluations, mops, date, .. } = figure;
        let noise = if *noise > 0.0 { format!(", noise {noise:e}") } else { String::new() };
        let solved = match figure.is_front() {
            true => format!("hypervolume {:.2} %", 100.0 * solved),
            false => format!("{solved} of {runs}"),
        };
        let median = figure.median_evaluations.map_or_else(String::new, |median| median.to_string());
        text.push_str(&format!(
            "| `{suite}` | `{solver}` | {gradients}{noise} | {seeds} | {solved} | {median} | {evaluations} | {mops} | {date} |\n"
        ));
    }
    text
}

impl Figure {
    /// True if the figure is a mean relative hypervolume.
    fn is_front(&self) -> bool {
        ["zdt", "dtlz", "wfg", "constrained-fronts"].contains(&self.suite.as_str())
    }
}

/// Returns the date of today, UTC.
///
/// Source: H. Hinnant, chrono-Compatible Low-Level Date Algorithms (2013), `civil_from_days`.
pub(crate) fn today() -> String {
    let seconds = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0, |since| since.as_secs());
    mops::terminal::date(i64::try_from(seconds).unwrap_or(0)).split(' ').next().unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(solver: &str, solved: f64) -> Figure {
        Figure {
            suite: "minimax".into(),
            solver: solver.into(),
            gradients: "differences".into(),
            noise: 0.0,
            seeds: 1,
            solved,
            runs: 40,
            median_evaluations: Some(101.5),
            evaluations: 4000,
            mops: "0.2.0".into(),
            date: "2026-11-26".into(),
        }
    }

    #[test]
    fn figures_are_read_as_they_are_written_and_replaced_by_newer_ones() {
        let all = vec![figure("auto", 40.0), figure("sqp", 38.0)];
        assert_eq!(read(&write(&all)).unwrap(), all);
        let newer = updated(all, vec![figure("sqp", 39.0), figure("genetic", 5.0)]);
        let solved: Vec<f64> = newer.iter().map(|figure| figure.solved).collect();
        assert_eq!(solved, [40.0, 39.0, 5.0]);
        assert!(markdown(&newer).contains("| `minimax` | `sqp` | differences | 1 | 39 of 40 | 101.5 | 4000 |"));
    }

    /// The page has the table of the file beside it.
    #[test]
    fn the_table_in_the_documentation_is_that_of_its_file() {
        let page = include_str!("../../../docs/reference/benchmarks.md");
        let figures = read(include_str!("../../../docs/reference/benchmarks.csv")).unwrap();
        assert!(
            page.contains(&markdown(&figures)),
            "replace the table by: mops-bench table docs/reference/benchmarks.csv"
        );
    }
}
