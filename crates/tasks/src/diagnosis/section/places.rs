//! Evidence by place, and the course of what is missing there.

use mops_content::{
    figures::{Figure, Group},
    numbers::{labelled, significant},
    plot::{Color, Curve, CurveStyle, Plot},
    sampling::thinned,
    section::{Block, Part},
    table::{Cell, Table, numbers, text},
};
use mops_outcome::diagnosis::{Curve as Points, Diagnosis, LatentInput};

use crate::diagnosis::words;

/// Largest number of places with plots.
const MOST_PLACES: usize = 3;
/// Largest number of experiments plotted over time.
const MOST_EXPERIMENTS: usize = 2;

/// Returns an explanation and the table of evidence by place.
pub(super) fn blocks(diagnosis: &Diagnosis) -> [Block; 2] {
    let largest = diagnosis.places.iter().map(|place| place.gain).filter(|gain| gain.is_finite()).fold(1e-9, f64::max);
    let columns = [text("place"), text("depends on"), text("evidence"), numbers("gain (nats)")];
    let rows = diagnosis.places.iter().map(|curve| -> Vec<Cell> {
        let place =
            curve.other.as_ref().map_or_else(|| curve.place.clone(), |other| format!("{} with {other}", curve.place));
        vec![
            if has_effect(diagnosis, &curve.place) { Cell::with_remark(place, "effect added") } else { place.into() },
            curve.coordinate.as_str().into(),
            Cell::new([Part::Bar((curve.gain / largest).max(0.0))]),
            significant(curve.gain, 3).into(),
        ]
    });
    let about = "At each place in turn a free curve over each coordinate was added to the nominal model: a force at a balance, or a \
                 change of an input. The gain in log-evidence of the best curve of a place says how well what is missing is described \
                 as acting there. At sensors there is no such curve.";
    [Block::text(about), Block::Table(Table::new("Evidence by place", columns).rows(rows))]
}

/// Returns true if an effect was added at the place.
fn has_effect(diagnosis: &Diagnosis, place: &str) -> bool {
    diagnosis.found.iter().any(|found| found.place == place)
}

/// Returns the plots of what is missing at the places that have a course of it.
pub(super) fn groups(diagnosis: &Diagnosis) -> Vec<Group> {
    diagnosis.latent.iter().take(MOST_PLACES).map(|latent| group(diagnosis, latent)).collect()
}

/// Returns the plot of what is missing over the coordinate that it depends on: the free curve, and the estimated input
/// at the place with the formulas of the effects found there.
pub(super) fn dependence(diagnosis: &Diagnosis) -> Option<Group> {
    let dependence = diagnosis.depends_on.as_ref()?;
    let [x, y] = [0, 1].map(|k| dependence.curve.iter().map(|point| point[k]).collect::<Vec<f64>>());
    let latent = diagnosis.latent.iter().find(|latent| latent.place == dependence.place && dependence.other.is_none());
    let points = latent.and_then(|latent| latent.over.iter().find(|(name, ..)| *name == dependence.coordinate));
    let points = points.map(|(.., points)| points);
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

fn group(diagnosis: &Diagnosis, latent: &LatentInput) -> Group {
    let effects: Vec<&str> =
        diagnosis.found.iter().filter(|f| f.place == latent.place).map(|f| f.effect.as_str()).collect();
    let effects = effects.join(" and ");
    let y_label = labelled("missing", &latent.unit);
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
        Figure { plots: vec![(format!("missing-{}-{key}", latent.place), plot)], ..Figure::default() }
    };
    let mut figures = Vec::new();
    for (over, unit, points) in &latent.over {
        let curves = curves_of(points, dots);
        let title = format!("what is missing at {} over {over}", latent.place);
        figures.push(figure(over, title, labelled(over, unit), curves));
    }
    for (experiment, points) in latent.over_time.iter().take(MOST_EXPERIMENTS) {
        let title = format!("what is missing at {} in {experiment}", latent.place);
        figures.push(figure(&format!("time-{experiment}"), title, "time (s)".into(), curves_of(points, line)));
    }
    let title = format!("What is missing {}", words::at(&latent.place));
    let with_formula = latent.over.iter().any(|(_, _, points)| !points.found.is_empty());
    let about = if with_formula {
        vec![format!(
            "Component-plus-residual plots of the recalibrated model. Over time: the formula of {effects}, and the formula plus \
             the smooth remainder. Over a coordinate: the formula, and the free curve that describes the data best in its \
             place, all parameters fixed. If the formula is correct, the estimate follows it."
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
