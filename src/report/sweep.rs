//! Plot of a sweep: the objective over one tuner as a curve, over two tuners as a surface.

use mops_core::evaluation::FEASIBLE;
use mops_outcome::{SweepAxis, SweepReport};

use super::figures::{Figure, Group};
use super::plot::{Color, Curve, CurveStyle, Plot, Surface};
use super::surface::border;
use crate::numbers::labelled;

/// Returns the plot of a sweep.
pub(super) fn group(sweep: &SweepReport, best_name: &str) -> Group {
    let plot = match &sweep.y {
        Some(y) => surface(sweep, y, best_name),
        None => line(sweep, best_name),
    };
    Group {
        about: sweep.words.clone(),
        figures: vec![Figure { plots: vec![("sweep".into(), plot)], ..Figure::default() }],
        ..Group::default()
    }
}

/// Returns true if the finite values are positive and span more than two decades.
fn spans_decades(sweep: &SweepReport) -> bool {
    let all = || sweep.objective.iter().flatten().copied().filter(|v| v.is_finite());
    let low = all().fold(f64::INFINITY, f64::min);
    low > 0.0 && all().fold(0.0, f64::max) > 100.0 * low
}

fn violated(sweep: &SweepReport) -> bool {
    sweep.violation.iter().flatten().any(|&v| v > FEASIBLE)
}

fn dot(name: &str, [x, y]: [f64; 2], color: Color) -> Curve {
    Curve { name: name.into(), points: vec![(x, y)], style: CurveStyle::Dots, color, ..Curve::default() }
}

fn surface(sweep: &SweepReport, y: &SweepAxis, best_name: &str) -> Plot {
    let surface = Surface {
        label: "objective".into(),
        x: sweep.x.values.clone(),
        y: y.values.clone(),
        values: sweep.objective.clone(),
        log: spans_decades(sweep),
    };
    let mut curves = Vec::new();
    if violated(sweep) {
        let points = border(&surface, &sweep.violation, FEASIBLE);
        curves.push(Curve {
            name: "limit of the feasible region".into(),
            points,
            color: Color::Demand,
            ..Curve::default()
        });
    }
    curves.push(dot("best point of the sweep", [sweep.best[0], sweep.best[1]], Color::Measured));
    curves.push(dot(best_name, [sweep.centre[0], sweep.centre[1]], Color::Demand));
    Plot {
        title: format!("Objective over {} and {}", sweep.x.tuner, y.tuner),
        x_label: labelled(&sweep.x.tuner, &sweep.x.unit),
        y_label: labelled(&y.tuner, &y.unit),
        log_x: sweep.x.log,
        log_y: y.log,
        curves,
        surface: Some(surface),
        ..Plot::default()
    }
}

fn line(sweep: &SweepReport, best_name: &str) -> Plot {
    let points = || sweep.x.values.iter().copied().zip(sweep.objective[0].iter().copied());
    let mut curves = vec![Curve { name: "objective".into(), points: points().collect(), ..Curve::default() }];
    if violated(sweep) {
        let infeasible = |((x, y), v): ((f64, f64), &f64)| if *v > FEASIBLE { (x, y) } else { (x, f64::NAN) };
        let points = points().zip(&sweep.violation[0]).map(infeasible).collect();
        curves.push(Curve { name: "infeasible".into(), points, color: Color::Measured, ..Curve::default() });
    }
    curves.push(dot(best_name, [sweep.centre[0], sweep.centre[2]], Color::Demand));
    Plot {
        title: format!("Objective over {}", sweep.x.tuner),
        x_label: labelled(&sweep.x.tuner, &sweep.x.unit),
        y_label: "objective".into(),
        log_x: sweep.x.log,
        log_y: spans_decades(sweep),
        curves,
        ..Plot::default()
    }
}
