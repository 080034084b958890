//! Where the residual comes from: evidence per place, and the unknown signal there that would explain it.

use maud::{Markup, html};
use mops_discrepancy::{Curve as Points, Diagnosis, Evidence};

use super::super::figures::{Figure, Group};
use super::super::page::{rich, scrolling};
use super::super::plot::{Color, Curve, CurveStyle, Plot};
use super::super::sampling::thinned;
use crate::diagnosis::words;
use crate::numbers::{labelled, significant};

/// Signals of more places than this are not drawn.
const MOST_PLACES: usize = 3;
/// Experiments whose signal is drawn over time.
const MOST_EXPERIMENTS: usize = 2;

/// The evidence of every place, with bars.
pub(super) fn table(diagnosis: &Diagnosis) -> Markup {
    let largest = diagnosis.evidence.iter().map(|e| e.evidence).filter(|e| e.is_finite()).fold(1e-9, f64::max);
    let rows = html! {
        table {
            thead {
                tr {
                    th scope="col" { "place" }
                    th scope="col" { "evidence" }
                    th scope="col" class="number" { "ln likelihood gained" }
                    th scope="col" class="number" { "explains" }
                    th scope="col" class="number" { "degrees of freedom" }
                }
            }
            tbody {
                @for place in &diagnosis.evidence {
                    tr {
                        th scope="row" { (place.place) @if acted(diagnosis, &place.place) { small { "an effect was added here" } } }
                        td { (bar(place.evidence / largest)) }
                        td class="number" { (significant(place.evidence, 3)) }
                        td class="number" { (words::share(place.share)) }
                        td class="number" { (significant(place.freedom, 3)) }
                    }
                }
            }
        }
    };
    html! {
        p {
            "A free signal was let in at one place at a time and estimated by smoothing, the model staying the constraint. The "
            "place that explains the residual best, with the fewest degrees of freedom, is where something acts. The signal is a "
            "picture for people: the verdict does not rest on it."
        }
        (scrolling("Evidence by place", rows))
    }
}

/// A bar of this share of its room.
pub(super) fn bar(share: f64) -> Markup {
    let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
    html! { span class="share" aria-hidden="true" { span style=(format!("width:{:.1}%", 100.0 * share)) {} } }
}

fn acted(diagnosis: &Diagnosis, place: &str) -> bool {
    diagnosis.found.iter().any(|found| found.place == place)
}

/// The places that are drawn: where effects were added, then the best ones.
pub(super) fn groups(diagnosis: &Diagnosis) -> Vec<Group> {
    let (at_effects, others): (Vec<&Evidence>, Vec<&Evidence>) =
        diagnosis.evidence.iter().partition(|e| acted(diagnosis, &e.place));
    // Where effects explain it all, other places are of no interest.
    let most = if at_effects.is_empty() { 1 } else { at_effects.len() };
    at_effects.into_iter().chain(others).take(most.min(MOST_PLACES)).map(|e| group(diagnosis, e)).collect()
}

fn group(diagnosis: &Diagnosis, evidence: &Evidence) -> Group {
    let sketched = diagnosis.unexplained.as_ref().filter(|u| u.place == evidence.place);
    let effects: Vec<&str> =
        diagnosis.found.iter().filter(|f| f.place == evidence.place).map(|f| f.effect.as_str()).collect();
    let effects = effects.join(" and ");
    let y_label = labelled("missing signal", &evidence.unit);
    // The estimate, and what the effects make of it.
    let both = |points: &Points, drawn: fn(&str, &[f64], &[f64], Color) -> Curve| {
        let mut curves = vec![drawn("estimated, without any formula", &points.x, &points.estimated, Color::Measured)];
        if !points.found.is_empty() {
            curves.push(drawn(&effects, &points.x, &points.found, Color::Result));
        }
        curves
    };
    let figure = |key: &str, title: String, x_label: String, curves| {
        let plot = Plot { title, x_label, y_label: y_label.clone(), curves, ..Plot::default() };
        Figure { plots: vec![(format!("missing-{}-{key}", evidence.place), plot)], caption: Vec::new() }
    };
    let mut figures = Vec::new();
    for (over, unit, points) in &evidence.over {
        let mut curves = both(points, dots);
        if let Some(unexplained) = sketched.filter(|u| u.over == *over) {
            let [x, y] = [0, 1].map(|k| unexplained.table.iter().map(|point| point[k]).collect::<Vec<f64>>());
            curves.push(line("table, linear between its points", &x, &y, Color::Demand));
        }
        let title = format!("missing signal at {} over {over}", evidence.place);
        figures.push(figure(over, title, labelled(over, unit), curves));
    }
    for (experiment, points) in evidence.over_time.iter().take(MOST_EXPERIMENTS) {
        let title = format!("missing signal at {} in {experiment}", evidence.place);
        figures.push(figure(&format!("time-{experiment}"), title, "time (s)".into(), both(points, line)));
    }
    let title = format!("The missing signal {}", words::at(&evidence.place));
    let drawn = evidence.over.iter().any(|(_, _, points)| !points.found.is_empty());
    let about = if drawn {
        vec![format!(
            "Estimated about the repaired model with {effects} taken away and everything else held; where the formula is the \
             right one, the estimate follows it."
        )]
    } else {
        Vec::new()
    };
    Group { title, about, figures }
}

fn dots(name: &str, x: &[f64], y: &[f64], color: Color) -> Curve {
    let points = x.iter().copied().zip(y.iter().copied()).collect();
    Curve { name: name.into(), points, color, style: CurveStyle::Dots, ..Curve::default() }
}

fn line(name: &str, x: &[f64], y: &[f64], color: Color) -> Curve {
    let dots = dots(name, x, y, color);
    Curve { points: thinned(dots.points), style: CurveStyle::Line, ..dots }
}

/// A place as it stands in tables.
pub(super) fn named(place: &str) -> Markup {
    rich(&words::at(place))
}
