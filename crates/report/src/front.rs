//! Responses at the points of a Pareto front.

use mops_content::{
    plot::{Color, Curve},
    sampling::{points, within_columns},
};
use mops_core::Analysis;

use super::Report;

/// Largest number of responses, over all points and simulations.
const MOST_RESPONSES: usize = 400;
/// Number of columns to which a thin curve is reduced.
const COLUMNS: f64 = 150.0;

/// Returns the analysis of a job at every point of the front; empty beyond [`MOST_RESPONSES`].
pub(super) fn analyses(report: &Report<'_>, job: usize) -> Vec<Option<Analysis>> {
    if report.solution.front.len() * report.solution.problem.study().jobs().len() > MOST_RESPONSES {
        return Vec::new();
    }
    report.solution.front.iter().map(|at| report.solution.problem.analyse_all(job, &at.tuners, None).ok()).collect()
}

/// Returns a signal at every point of the front, as thin curves.
pub(super) fn responses(analyses: &[Option<Analysis>], signal: &str) -> Vec<Curve> {
    let curve = |(i, analysis): (usize, &Option<Analysis>)| {
        let Some(Analysis::Time(response)) = analysis else { return None };
        let (_, trace) = response.traces.iter().find(|(name, _)| name == signal)?;
        let points = within_columns(points(trace), COLUMNS);
        Some(Curve { points, color: Color::Start, front_point: Some(i), may_leave: true, ..Curve::default() })
    };
    let mut curves: Vec<Curve> = analyses.iter().enumerate().filter_map(curve).collect();
    if let Some(first) = curves.first_mut() {
        "other Pareto points".clone_into(&mut first.name);
    }
    curves
}
