//! Where the residual comes from: evidence per place, and the unknown signal there that would explain it.

use maud::{Markup, html};
use mops_discrepancy::{Curve as Points, Diagnosis, Evidence};

use super::super::figures::{Figure, Group};
use super::super::numbers::{labelled, significant};
use super::super::page::{rich, scrolling};
use super::super::plot::{Curve, CurveStyle, Ink, Plot};
use super::super::sampling::thinned;
use crate::diagnosis::words;

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
    let found = |over: &str| {
        let effect = diagnosis.found.iter().find(|f| f.place == evidence.place).map_or("effect", |f| &f.effect);
        let curves = evidence.found.iter().filter(|(name, _)| name == over);
        let mut lines: Vec<Curve> = curves.map(|(_, points)| line(effect, pairs(points), Ink::Result)).collect();
        if let Some(unexplained) = sketched.filter(|u| u.over == over) {
            let points = unexplained.table.iter().map(|&[x, y]| (x, y)).collect();
            lines.push(line("table, linear between its points", points, Ink::Demand));
        }
        lines
    };
    let y_label = labelled("missing signal", &evidence.unit);
    let mut figures = Vec::new();
    for (over, unit, points) in &evidence.over {
        let mut curves = vec![cloud(points)];
        curves.extend(found(over));
        let plot = Plot {
            title: format!("missing signal at {} over {over}", evidence.place),
            x_label: labelled(over, unit),
            y_label: y_label.clone(),
            curves,
            ..Plot::default()
        };
        figures.push(Figure { plots: vec![(format!("missing-{}-{over}", evidence.place), plot)], caption: Vec::new() });
    }
    for (experiment, points) in evidence.over_time.iter().take(MOST_EXPERIMENTS) {
        let mut curves = vec![line("estimated", thinned(pairs(points)), Ink::Measured)];
        curves.extend(found("time"));
        let plot = Plot {
            title: format!("missing signal at {} in {experiment}", evidence.place),
            x_label: "time (s)".into(),
            y_label: y_label.clone(),
            curves,
            ..Plot::default()
        };
        let name = format!("missing-{}-time-{experiment}", evidence.place);
        figures.push(Figure { plots: vec![(name, plot)], caption: Vec::new() });
    }
    let title = format!("The missing signal {}", words::at(&evidence.place));
    Group { title, about: Vec::new(), figures }
}

fn pairs(points: &Points) -> Vec<(f64, f64)> {
    points.x.iter().copied().zip(points.y.iter().copied()).collect()
}

fn line(name: &str, points: Vec<(f64, f64)>, ink: Ink) -> Curve {
    Curve { name: name.into(), points, ink, ..Curve::default() }
}

fn cloud(points: &Points) -> Curve {
    Curve { style: CurveStyle::Dots, ..line("estimated, without any formula", pairs(points), Ink::Measured) }
}

/// A place as it stands in tables.
pub(super) fn named(place: &str) -> Markup {
    rich(&words::at(place))
}
