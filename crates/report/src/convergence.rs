//! Convergence: objective and constraint violation of the best point over the evaluations.

use mops_core::{Merit, Objective, Study, Usage, evaluation::FEASIBLE, run::Record};
use serde_json::Value;

use super::chart;
use mops_content::{
    figures::{Figure, Group},
    numbers::counted,
    plot::{Color, Curve, CurveStyle, Level, Plot},
};

/// Returns the plots of objective and violation over the evaluations.
pub(super) fn group(study: &Study, archive: &[Record]) -> Group {
    let failed = archive.iter().filter(|r| r.merit.objective.is_infinite()).count();
    let mut about = Vec::new();
    if failed > 0 {
        about.push(format!(
            "{} of {} have no value, because a simulation or a criterion failed.",
            failed,
            counted(archive.len(), "point")
        ));
    }
    let best = improvements(archive);
    let feasible = Merit::is_feasible;
    let first_feasible = best.iter().find(|(_, merit)| feasible(merit));
    let constrained = study.rows().iter().any(|row| matches!(row.usage, Usage::Inequality | Usage::Equality));
    if constrained {
        about.push(match first_feasible {
            Some((1, _)) => "The initial guess satisfies all constraints.".to_owned(),
            Some((at, _)) => format!("The first feasible point is number {at}."),
            None => "No point is feasible.".to_owned(),
        });
    }
    let all = archive.iter().enumerate().map(|(i, r)| ((i + 1) as f64, r.merit.objective)).collect();
    let points = Curve {
        name: "all points".into(),
        points: all,
        style: CurveStyle::Dots,
        color: Color::Start,
        may_leave: true,
        ..Curve::default()
    };
    let mut plot = objective(study, &best, archive.len(), 100.0);
    plot.curves.insert(0, points);
    let mut plots = vec![("convergence".to_owned(), plot)];
    if best.iter().any(|(_, merit)| merit.violation.is_finite() && !feasible(merit)) {
        plots.push(("convergence-violation".to_owned(), violation(&best, archive.len())));
    }
    let figures = plots.into_iter().map(|plot| Figure { plots: vec![plot], ..Figure::default() }).collect();
    Group { about, figures, ..Group::default() }
}

/// Returns the data of the plot of the objective for the live page of a run, from the improvements so far: number of
/// evaluations and merit. Empty without one.
#[must_use]
pub fn live(study: &Study, best: &[(usize, Merit)], evaluations: usize) -> Vec<Value> {
    if best.is_empty() {
        return Vec::new();
    }
    vec![chart::data(&objective(study, best, evaluations.max(2), 20.0))]
}

/// Returns the evaluations, counted from 1, at which the best point improved, with its merit from then on.
fn improvements(archive: &[Record]) -> Vec<(usize, Merit)> {
    let mut best: Vec<(usize, Merit)> = Vec::new();
    for (i, record) in archive.iter().enumerate() {
        if best.last().is_none_or(|(_, merit)| record.merit.is_better_than(merit)) {
            best.push((i + 1, record.merit));
        }
    }
    best
}

/// Returns the plot of the objective at the best point; its axis is logarithmic if the values span more than this
/// factor.
fn objective(study: &Study, best: &[(usize, Merit)], evaluations: usize, factor: f64) -> Plot {
    let name = match study.objective() {
        Objective::Max | Objective::Each => "worst scaled criterion",
        Objective::Sum => "sum of weighted scaled criteria",
    };
    // The objective of an infeasible point may be low because constraints are violated, so its colour differs.
    let split = best.iter().position(|(_, merit)| merit.is_feasible()).unwrap_or(best.len());
    let end = best.get(split).map_or(evaluations, |(at, _)| *at);
    let before = steps(&best[..split], end, |m| m.objective);
    let after = steps(&best[split..], evaluations, |m| m.objective);
    let curves = vec![
        Curve { name: "best so far, infeasible".into(), points: before, color: Color::Measured, ..Curve::default() },
        Curve { name: "best so far".into(), points: after, ..Curve::default() },
    ];
    // A worst scaled value of 1 is the demand only without weights.
    let weighted = study.rows().iter().any(|row| row.usage == Usage::Minimise && row.weight != 1.0);
    let demanded = study.task().chooses_tuners() && study.objective() == Objective::Max && !weighted;
    let levels = if demanded { vec![Level { name: "demand".into(), value: 1.0 }] } else { Vec::new() };
    Plot {
        title: "Objective at the best point".into(),
        x_label: "evaluations".into(),
        x_range: Some([1.0, evaluations as f64]),
        y_label: name.into(),
        log_y: spans(factor, best.iter().map(|(_, merit)| merit.objective)),
        curves,
        levels,
        ..Plot::default()
    }
}

fn violation(best: &[(usize, Merit)], evaluations: usize) -> Plot {
    // A feasible point has no violation, and a logarithmic axis cannot show zero: the line ends there.
    let split = best.iter().position(|(_, merit)| merit.is_feasible());
    let end = split.map_or(evaluations, |at| best[at].0);
    let infeasible = &best[..split.unwrap_or(best.len())];
    let points = steps(infeasible, end, |m| m.violation);
    let values = infeasible.iter().map(|(_, merit)| merit.violation).filter(|v| *v > FEASIBLE);
    Plot {
        title: "Largest constraint violation at the best point".into(),
        x_label: "evaluations".into(),
        x_range: Some([1.0, evaluations as f64]),
        y_label: "scaled violation".into(),
        log_y: spans(100.0, values),
        curves: vec![Curve {
            name: "best so far, infeasible".into(),
            points,
            color: Color::Measured,
            ..Curve::default()
        }],
        ..Plot::default()
    }
}

/// Returns a staircase: each value until the next improvement.
fn steps(best: &[(usize, Merit)], end: usize, value: impl Fn(&Merit) -> f64) -> Vec<(f64, f64)> {
    let mut points = Vec::new();
    for (i, (at, merit)) in best.iter().enumerate() {
        let until = best.get(i + 1).map_or(end, |(next, _)| *next);
        points.extend([(*at as f64, value(merit)), (until as f64, value(merit))]);
    }
    points
}

/// Returns true if the finite values are positive and span more than a factor.
fn spans(factor: f64, values: impl Iterator<Item = f64>) -> bool {
    let range = values.filter(|v| v.is_finite()).map(|v| [v, v]).reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]);
    range.is_some_and(|[low, high]| low > 0.0 && high > factor * low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_point_is_kept_until_a_better_one_is_found() {
        let record = |violation, objective| Record {
            tuners: vec![],
            values: vec![],
            objectives: vec![],
            merit: Merit { violation, objective },
        };
        let archive = [
            record(0.5, 1.0),
            record(f64::INFINITY, f64::INFINITY),
            record(0.0, 3.0),
            record(0.0, 4.0),
            record(0.0, 2.0),
        ];
        let best = improvements(&archive);
        assert_eq!(best.iter().map(|(at, _)| *at).collect::<Vec<_>>(), [1, 3, 5]);
        assert_eq!(steps(&best[1..], 5, |m| m.objective), [(3.0, 3.0), (5.0, 3.0), (5.0, 2.0), (5.0, 2.0)]);
        assert!(spans(100.0, [1.0, 1e3, f64::INFINITY].into_iter()) && !spans(100.0, [-1.0, 1e3].into_iter()));
    }
}
