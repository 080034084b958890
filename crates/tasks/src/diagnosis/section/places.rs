//! Evidence by place, and the unknown input at a place that would explain the residuals.

use mops_content::{
    figures::{Figure, Group},
    numbers::{labelled, significant},
    plot::{Color, Curve, CurveStyle, Plot},
    sampling::thinned,
    section::{Block, Part},
    table::{Cell, Table, numbers, text},
};
use mops_outcome::diagnosis::{Curve as Points, Diagnosis, Evidence};

use crate::diagnosis::words;

/// Largest number of places with plots.
const MOST_PLACES: usize = 3;
/// Largest number of experiments plotted over time.
const MOST_EXPERIMENTS: usize = 2;

/// Returns an explanation and the table of evidence by place.
pub(super) fn blocks(diagnosis: &Diagnosis) -> [Block; 2] {
    let largest = diagnosis.evidence.iter().map(|e| e.evidence).filter(|e| e.is_finite()).fold(1e-9, f64::max);
    let columns = [
        text("place"),
        text("evidence"),
        numbers("ln Bayes factor"),
        numbers("explained share"),
        numbers("degrees of freedom"),
    ];
    let rows = diagnosis.evidence.iter().map(|place| -> Vec<Cell> {
        vec![
            if has_effect(diagnosis, &place.place) {
                Cell::with_remark(&place.place, "effect added")
            } else {
                place.place.clone().into()
            },
            Cell::new([Part::Bar(place.evidence / largest)]),
            significant(place.evidence, 3).into(),
            words::share(place.share).into(),
            significant(place.freedom, 3).into(),
        ]
    });
    let about = "At each place in turn an unknown input was added and estimated by a smoother subject to the model equations. A missing \
                 effect most likely acts where the evidence is largest: the input explains most of the residual with few degrees of \
                 freedom. The input is an illustration only; the verdict does not use it.";
    [Block::text(about), Block::Table(Table::new("Evidence by place", columns).rows(rows))]
}

/// Returns true if an effect was added at the place.
fn has_effect(diagnosis: &Diagnosis, place: &str) -> bool {
    diagnosis.found.iter().any(|found| found.place == place)
}

/// Returns the plots of places: those with added effects; without any, the place with the largest evidence.
pub(super) fn groups(diagnosis: &Diagnosis) -> Vec<Group> {
    let (at_effects, others): (Vec<&Evidence>, Vec<&Evidence>) =
        diagnosis.evidence.iter().partition(|e| has_effect(diagnosis, &e.place));
    let most = if at_effects.is_empty() { 1 } else { at_effects.len() };
    at_effects.into_iter().chain(others).take(most.min(MOST_PLACES)).map(|e| group(diagnosis, e)).collect()
}

/// Returns the plot of what is missing over the coordinate that it depends on: the free curve, and the estimated input at the
/// place with the formulas of the effects found there.
pub(super) fn dependence(diagnosis: &Diagnosis) -> Option<Group> {
    let dependence = diagnosis.depends_on.as_ref()?;
    let [x, y] = [0, 1].map(|k| dependence.curve.iter().map(|point| point[k]).collect::<Vec<f64>>());
    // A level is the position of a store.
    let over = if dependence.coordinate == "level" { "position" } else { dependence.coordinate.as_str() };
    let evidence = diagnosis.evidence.iter().find(|e| e.place == dependence.place && dependence.other.is_none());
    let points = evidence.and_then(|e| e.over.iter().find(|(name, ..)| name == over)).map(|(.., points)| points);
    let mut curves = Vec::new();
    if let Some(points) = points {
        curves.push(dots("estimated input", &points.x, &points.estimated, Color::Measured));
        if !points.found.is_empty() {
            curves.push(dots("formula of the effects found", &points.x, &points.found, Color::Result));
        }
    }
    curves.push(line("free curve", &x, &y, Color::Demand));
    let plot = Plot {
        title: format!("What is missing, over {dependence}"),
        x_label: labelled(&dependence.coordinate, &dependence.unit),
        y_label: labelled("missing", &dependence.signal_unit),
        curves,
        ..Plot::default()
    };
    let figure = Figure { plots: vec![("missing".to_owned(), plot)], ..Figure::default() };
    Some(Group { figures: vec![figure], ..Group::default() })
}

fn group(diagnosis: &Diagnosis, evidence: &Evidence) -> Group {
    let effects: Vec<&str> =
        diagnosis.found.iter().filter(|f| f.place == evidence.place).map(|f| f.effect.as_str()).collect();
    let effects = effects.join(" and ");
    let y_label = labelled("unknown input", &evidence.unit);
    // The estimate, and the formulas of the effects found.
    let curves_of = |points: &Points, curve: fn(&str, &[f64], &[f64], Color) -> Curve| {
        let mut curves = vec![curve("estimate without a formula", &points.x, &points.estimated, Color::Measured)];
        if !points.found.is_empty() {
            curves.push(curve(&effects, &points.x, &points.found, Color::Result));
        }
        curves
    };
    let figure = |key: &str, title: String, x_label: String, curves| {
        let plot = Plot { title, x_label, y_label: y_label.clone(), curves, ..Plot::default() };
        Figure { plots: vec![(format!("missing-{}-{key}", evidence.place), plot)], ..Figure::default() }
    };
    let mut figures = Vec::new();
    for (over, unit, points) in &evidence.over {
        let curves = curves_of(points, dots);
        let title = format!("unknown input at {} over {over}", evidence.place);
        figures.push(figure(over, title, labelled(over, unit), curves));
    }
    for (experiment, points) in evidence.over_time.iter().take(MOST_EXPERIMENTS) {
        let title = format!("unknown input at {} in {experiment}", evidence.place);
        figures.push(figure(&format!("time-{experiment}"), title, "time (s)".into(), curves_of(points, line)));
    }
    let title = format!("Unknown input {}", words::at(&evidence.place));
    let with_formula = evidence.over.iter().any(|(_, _, points)| !points.found.is_empty());
    let about = if with_formula {
        vec![format!(
            "Component-plus-residual plot: the input is estimated for the recalibrated model without {effects}, with all \
             other parameters fixed. If the formula is correct, the estimate follows it."
        )]
    } else {
        Vec::new()
    };
    Group { title, about, figures, ..Group::default() }
}

fn dots(name: &str, x: &[f64], y: &[f64], color: Color) -> Curve {
    let points = x.iter().copied().zip(y.iter().copied()).collect();
    Curve { name: name.into(), points, color, style: CurveStyle::Dots, ..Curve::default() }
}

fn line(name: &str, x: &[f64], y: &[f64], color: Color) -> Curve {
    let dots = dots(name, x, y, color);
    Curve { points: thinned(dots.points), style: CurveStyle::Line, ..dots }
}
