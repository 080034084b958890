//! Pareto fronts over seeds: mean and standard deviation of hypervolume and distance for every problem.

use mops::math;

use super::results::{Results, Row};

/// Results of a solver on a problem over all seeds.
pub(crate) struct Spread {
    pub problem: String,
    pub solver: String,
    pub seeds: usize,
    /// Mean and standard deviation of the hypervolume of the members.
    pub hypervolume: [f64; 2],
    /// Mean hypervolume of all evaluated points.
    pub archive: f64,
    /// Mean and standard deviation of the inverted generational distance.
    pub distance: [f64; 2],
    /// Hypervolume of the true front.
    pub known: f64,
    pub evaluations: usize,
}

/// Returns the results of every solver on every problem with a front.
pub(crate) fn spreads(results: &Results) -> Vec<Spread> {
    let mut all: Vec<Spread> = Vec::new();
    for row in &results.rows {
        if !all.iter().any(|spread| spread.problem == row.problem && spread.solver == row.solver) {
            all.extend(of(results, row));
        }
    }
    all
}

fn of(results: &Results, first: &Row) -> Option<Spread> {
    let rows: Vec<&Row> = results.of(&first.solver).filter(|row| row.problem == first.problem).collect();
    let fronts: Vec<_> = rows.iter().filter_map(|row| row.front).collect();
    let known = fronts.first()?.known;
    Some(Spread {
        problem: first.problem.clone(),
        solver: first.solver.clone(),
        seeds: fronts.len(),
        hypervolume: statistics(fronts.iter().map(|front| front.hypervolume)),
        archive: statistics(fronts.iter().map(|front| front.archive))[0],
        distance: statistics(fronts.iter().map(|front| front.distance)),
        known,
        evaluations: first.evaluations,
    })
}

/// Returns mean and standard deviation.
#[allow(clippy::cast_precision_loss)]
fn statistics(values: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
    let count = values.clone().count();
    let mean = values.clone().sum::<f64>() / count as f64;
    let square = values.map(|value| math::powi(value - mean, 2)).sum::<f64>() / (count.max(2) - 1) as f64;
    [mean, square.sqrt()]
}

/// Returns the mean hypervolume of pymoo 0.6.2 under the same conditions, and the inverted generational distance. The
/// latter is `None` if it was not computed with equally many points of the true front.
///
/// Settings: NSGA-II with 100 members and 250 generations for two objectives; NSGA-III with 92 members and 250 (DTLZ1:
/// 400) generations for three; 7 seeds.
pub(crate) fn published(problem: &str) -> Option<(f64, Option<f64>)> {
    const TABLE: [(&str, f64, Option<f64>); 7] = [
        ("ZDT1", 0.869_70, Some(0.0048)),
        ("ZDT2", 0.536_29, Some(0.0048)),
        ("ZDT3", 1.327_61, Some(0.0053)),
        ("ZDT4", 0.864_71, Some(0.0068)),
        ("ZDT6", 0.494_20, Some(0.0083)),
        ("DTLZ1", 0.139_84, None),
        ("DTLZ2", 0.744_09, None),
    ];
    TABLE.iter().find(|(name, _, _)| *name == problem).map(|(_, volume, distance)| (*volume, *distance))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_deviation_are_those_of_a_sample() {
        let [mean, deviation] = statistics([1.0, 2.0, 4.0, 5.0].into_iter());
        assert!((mean - 3.0).abs() < 1e-15 && (deviation - (10.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert_eq!(statistics([2.0].into_iter()), [2.0, 0.0]);
    }
}
