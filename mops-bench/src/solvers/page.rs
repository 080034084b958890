//! Page of a solver benchmark: plots of profiles or hypervolumes, and the tables of the terminal.

use mops::report::{Color, Curve, CurveStyle, Draw, ParallelAxis, Plot};

use super::plan::ROUGH;
use super::results::{Results, Row};
use super::{Score, data_profile, performance_profile};

/// Number of different colours.
const COLORS: usize = 6;

/// Returns the page from the tables as text and from the named results.
pub(crate) fn page(tables: &str, all: &[(String, &Results)]) -> String {
    let suite = all.first().map_or("", |(_, results)| results.suite.as_str());
    let accuracy = all.first().map_or(0.0, |(_, results)| results.accuracy);
    let rough = |row: &Row| row.to_rough;
    let fine = |row: &Row| row.to_fine;
    // Fronts have hypervolumes instead of solved problems.
    let of_fronts = all.iter().any(|(_, results)| results.rows.iter().any(|row| row.front.is_some()));
    let profiles = || {
        let mut plots = vec![data(all, rough, ROUGH), performance(all, rough, ROUGH)];
        // One pair of plots for each accuracy.
        if accuracy < ROUGH {
            plots.insert(1, data(all, fine, accuracy));
            plots.push(performance(all, fine, accuracy));
        }
        plots
    };
    let plots: Vec<Option<Plot>> = if of_fronts { vec![volumes(all)] } else { profiles() };
    let title = format!("Benchmark of solvers: {suite}");
    let pictures: Vec<String> = plots.iter().flatten().map(Draw::svg).collect();
    let heading = if of_fronts { "Hypervolume" } else { "Profiles" };
    crate::page::page(&title, heading, &pictures, tables, "results.json")
}

/// Plots the hypervolume of every run relative to the true front: one axis per problem, one dot per seed.
#[allow(clippy::cast_precision_loss)]
fn volumes(all: &[(String, &Results)]) -> Option<Plot> {
    let mut problems: Vec<&str> = Vec::new();
    let rows = all.iter().flat_map(|(_, results)| &results.rows);
    let shares: Vec<f64> = rows
        .filter_map(|row| {
            if !problems.contains(&row.problem.as_str()) {
                problems.push(&row.problem);
            }
            row.front.map(|front| front.hypervolume / front.known)
        })
        .collect();
    // All axes start at the same round value.
    let least = shares.iter().copied().fold(1.0, f64::min);
    let from = [0.99, 0.95, 0.9, 0.8, 0.5].into_iter().find(|from| *from <= least).unwrap_or(0.0);
    let height = |share: f64| (share - from) / (1.0 - from);
    let names = all
        .iter()
        .flat_map(|(name, results)| results.solvers().into_iter().map(move |solver| (name, *results, solver)));
    let names: Vec<_> = names.collect();
    let curve = |(index, (name, results, solver)): (usize, &(&String, &Results, &str))| {
        // Solvers are placed next to each other.
        let aside = 0.12 * (index as f64 - 0.5 * (names.len() as f64 - 1.0));
        let point = |row: &Row| {
            let at = problems.iter().position(|problem| *problem == row.problem)?;
            let front = row.front?;
            Some((at as f64 + aside, height(front.hypervolume / front.known)))
        };
        Curve {
            name: named(solver, name),
            points: results.of(solver).filter_map(point).collect(),
            style: CurveStyle::Dots,
            color: Color::Series(index),
            ..Curve::default()
        }
    };
    let ends = [-0.3, problems.len() as f64 - 0.7];
    let rule = |y: f64| Curve { points: ends.map(|x| (x, y)).to_vec(), color: Color::Grid, ..Curve::default() };
    let upright = |name: &&str| ParallelAxis { name: (*name).to_owned(), ends: [from.to_string(), "1".to_owned()] };
    (!shares.is_empty()).then(|| Plot {
        title: "Hypervolume relative to the true front".into(),
        x_label: "problem".into(),
        y_label: "relative hypervolume (one dot per seed)".into(),
        parallel_axes: problems.iter().map(upright).collect(),
        curves: [0.0, 1.0].map(rule).into_iter().chain(names.iter().enumerate().map(curve)).collect(),
        ..Plot::default()
    })
}

/// Returns the label of a solver in named results.
fn named(solver: &str, name: &str) -> String {
    if name.is_empty() { solver.to_owned() } else { format!("{solver}, {name}") }
}

/// Returns the solvers of all results with their labels and scores.
fn scored(all: &[(String, &Results)], count: impl Fn(&Row) -> Option<usize> + Copy) -> Vec<(String, Vec<Score>)> {
    let of = |(name, results): &(String, &Results)| -> Vec<(String, Vec<Score>)> {
        results.solvers().into_iter().map(|solver| (named(solver, name), Score::of(results, solver, count))).collect()
    };
    all.iter().flat_map(of).collect()
}

fn curves(profiles: Vec<(String, Vec<(f64, f64)>)>) -> Option<Vec<Curve>> {
    let ends = profiles.iter().flat_map(|(_, points)| points).map(|(x, _)| *x);
    let [first, last] = ends.fold([f64::INFINITY, 0.0], |[low, high], x| [x.min(low), x.max(high)]);
    let curve = |(index, (name, mut points)): (usize, (String, Vec<(f64, f64)>))| {
        // Extends the curve to the end of the plot; at 0 if nothing is solved.
        if points.is_empty() {
            points.push((first, 0.0));
        }
        let share = points.last().map_or(0.0, |&(_, share)| share);
        points.push((last, share));
        // Lines are dashed when the colours repeat.
        let style = if (index / COLORS).is_multiple_of(2) { CurveStyle::Line } else { CurveStyle::Dashed };
        Curve { name, points, style, color: Color::Series(index), ..Curve::default() }
    };
    (last > 0.0).then(|| profiles.into_iter().enumerate().map(curve).collect())
}

fn data(all: &[(String, &Results)], count: impl Fn(&Row) -> Option<usize> + Copy, accuracy: f64) -> Option<Plot> {
    let scored = scored(all, count).into_iter().map(|(name, scores)| (name, data_profile(&scores)));
    Some(Plot {
        title: format!("Data profile, accuracy {accuracy:e}"),
        x_label: "evaluations / (n + 1)".into(),
        y_label: "share of problems solved".into(),
        curves: curves(scored.collect())?,
        log_x: true,
        ..Plot::default()
    })
}

fn performance(
    all: &[(String, &Results)],
    count: impl Fn(&Row) -> Option<usize> + Copy,
    accuracy: f64,
) -> Option<Plot> {
    let (names, scores): (Vec<String>, Vec<Vec<Score>>) = scored(all, count).into_iter().unzip();
    if names.len() < 2 || scores.iter().any(|of| of.len() != scores[0].len()) {
        return None;
    }
    Some(Plot {
        title: format!("Performance profile, accuracy {accuracy:e}"),
        x_label: "evaluations / those of the best solver".into(),
        y_label: "share of problems solved".into(),
        curves: curves(names.into_iter().zip(performance_profile(&scores)).collect())?,
        log_x: true,
        ..Plot::default()
    })
}
