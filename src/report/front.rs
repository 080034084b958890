//! The front: its points over every pair of criteria, the tuners along it, and a table of all of them.

use maud::{Markup, html};
use mops_core::{Analysis, Demand, Pareto, TradeOffs, Tuner};

use super::Report;
use super::figures::{Figure, Group};
use super::numbers::{labelled, number};
use super::page::scrolling;
use super::plot::{Curve, CurveStyle, Ink, Level, Plot};
use super::sampling::{points, within_columns};

/// More criteria than this are not drawn in pairs.
const MOST_PAIRED: usize = 4;
/// More tuners than this are not drawn.
const MOST_TUNERS: usize = 8;

/// A quantity that every point of the front has.
struct Quantity {
    name: String,
    unit: String,
    values: Vec<f64>,
    log: bool,
    demand: Option<f64>,
}

/// The script that selects a point in all pictures and in the table.
pub(super) const SCRIPT: &str = include_str!("front.js");

/// The plots of a front; `None` where none was found.
pub(super) fn group(report: &Report<'_>) -> Option<Group> {
    let found = report.outcome.found.trade_offs.as_ref()?;
    let (criteria, tuners) = (criteria(report, found), tuners(report));
    let mut figures = Vec::new();
    let mut add = |name: String, plot: Plot| {
        figures.push(Figure { plots: vec![(name, plot)], caption: Vec::new() });
    };
    if criteria.len() <= MOST_PAIRED {
        for (k, x) in criteria.iter().enumerate() {
            for y in &criteria[k + 1..] {
                add(format!("front-{}-{}", x.name, y.name), pair(found, x, y));
            }
        }
    }
    if criteria.len() > 2 {
        add("front-parallel".to_owned(), parallel(found, &criteria, &tuners));
    }
    for tuner in tuners.iter().take(MOST_TUNERS) {
        add(format!("front-{}", tuner.name), pair(found, &criteria[0], tuner));
    }
    Some(Group { about: found.words.clone(), figures, ..Group::default() })
}

fn criteria(report: &Report<'_>, found: &TradeOffs) -> Vec<Quantity> {
    let study = report.problem.study();
    let quantity = |k: usize| {
        let criterion = &found.criteria[k];
        let row = study.rows.iter().position(|row| study.key(row) == criterion.key).expect("a row of the study");
        let demand = match study.rows[row].demand {
            Demand::Value(demand) => Some(demand),
            Demand::Pair { bad, .. } => Some(bad),
            Demand::None => None,
        };
        Quantity {
            name: if study.cases.len() > 1 { criterion.key.replace('/', ", ") } else { study.rows[row].name.clone() },
            unit: criterion.unit.clone(),
            values: report.front.iter().map(|at| at.readings[row].map_or(f64::NAN, |r| r.value)).collect(),
            log: false,
            demand,
        }
    };
    (0..found.criteria.len()).map(quantity).collect()
}

fn tuners(report: &Report<'_>) -> Vec<Quantity> {
    let study = report.problem.study();
    let quantity = |(i, tuner): (usize, &Tuner)| Quantity {
        name: tuner.name.clone(),
        unit: tuner.unit.to_string(),
        values: report.front.iter().map(|at| at.tuners[i]).collect(),
        log: tuner.scale == mops_core::Scale::Log,
        demand: None,
    };
    study.tuners.iter().enumerate().filter(|(_, tuner)| tuner.active).map(quantity).collect()
}

/// A dot for every point, and rings of other colours on those worth a look.
fn pair(found: &TradeOffs, x: &Quantity, y: &Quantity) -> Plot {
    let dot = |i: usize| (x.values[i], y.values[i]);
    let one = |i: usize, name: &str, ink| Curve {
        name: name.to_owned(),
        points: vec![dot(i)],
        style: CurveStyle::Dots,
        ink,
        of: Some(i),
        ..Curve::default()
    };
    let mut curves: Vec<Curve> =
        (0..x.values.len()).map(|i| one(i, if i == 0 { "points of the front" } else { "" }, Ink::Result)).collect();
    curves.extend(found.knee.map(|i| one(i, "knee", Ink::Measured)));
    curves.push(one(found.nearest, "nearest to the demands", Ink::Demand));
    Plot {
        title: format!("{} over {}", y.name, x.name),
        x_label: labelled(&x.name, &x.unit),
        y_label: labelled(&y.name, &y.unit),
        log_x: x.log,
        log_y: y.log,
        levels: y.demand.map(|value| Level { name: "demand".to_owned(), value }).into_iter().collect(),
        vertical: x.demand,
        curves,
        ..Plot::default()
    }
}

/// A line for every point across all quantities, each from its least to its largest value.
fn parallel(found: &TradeOffs, criteria: &[Quantity], tuners: &[Quantity]) -> Plot {
    let all: Vec<&Quantity> = criteria.iter().chain(tuners.iter().take(MOST_TUNERS)).collect();
    let height = |quantity: &Quantity, i: usize| {
        let drawn = |value: f64| if quantity.log { value.ln() } else { value };
        let values = || quantity.values.iter().map(|v| drawn(*v)).filter(|v| v.is_finite());
        let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        if high > low { (drawn(quantity.values[i]) - low) / (high - low) } else { 0.5 }
    };
    #[allow(clippy::cast_precision_loss)]
    let line = |i: usize, ink| Curve {
        points: all.iter().enumerate().map(|(at, quantity)| ((at + 1) as f64, height(quantity, i))).collect(),
        ink,
        of: Some(i),
        ..Curve::default()
    };
    let mut curves: Vec<Curve> = (0..criteria[0].values.len()).map(|i| line(i, Ink::Result)).collect();
    let nearest = line(found.nearest, Ink::Demand);
    curves.push(Curve { name: "nearest to the demands".to_owned(), ..nearest });
    let names: Vec<String> = all.iter().enumerate().map(|(at, q)| format!("{} {}", at + 1, q.name)).collect();
    Plot {
        title: "Parallel coordinates".to_owned(),
        x_label: names.join(", "),
        y_label: "least to largest".to_owned(),
        curves,
        ..Plot::default()
    }
}

/// More responses than this of all points are not drawn.
const MOST_RESPONSES: usize = 400;
/// Columns of a thin curve.
const COLUMNS: f64 = 150.0;

/// What a job gives at every point of the front; nothing where there is none, or where there are too many.
pub(super) fn analyses(report: &Report<'_>, job: usize) -> Vec<Option<Analysis>> {
    if report.front.len() * report.problem.study().jobs.len() > MOST_RESPONSES {
        return Vec::new();
    }
    report.front.iter().map(|at| report.problem.analyse_all(job, &at.tuners, None).ok()).collect()
}

/// A signal at every point of the front, as thin curves.
pub(super) fn responses(analyses: &[Option<Analysis>], signal: &str) -> Vec<Curve> {
    let curve = |(i, analysis): (usize, &Option<Analysis>)| {
        let Some(Analysis::Time(response)) = analysis else { return None };
        let (_, trace) = response.traces.iter().find(|(name, _)| name == signal)?;
        let points = within_columns(points(trace), COLUMNS);
        Some(Curve { points, ink: Ink::Start, of: Some(i), may_leave: true, ..Curve::default() })
    };
    let mut curves: Vec<Curve> = analyses.iter().enumerate().filter_map(curve).collect();
    if let Some(first) = curves.first_mut() {
        "other points of the front".clone_into(&mut first.name);
    }
    curves
}

/// All points; the script makes its columns sortable and its rows selectable.
pub(super) fn table(report: &Report<'_>, found: &TradeOffs) -> Markup {
    let quantities: Vec<Quantity> = criteria(report, found).into_iter().chain(tuners(report)).collect();
    let rows = html! {
        table class="front" {
            thead {
                tr {
                    th scope="col" class="number" { "point" }
                    @for quantity in &quantities { th scope="col" class="number" { (labelled(&quantity.name, &quantity.unit)) } }
                    th scope="col" class="number" { "worst scaled" }
                    th scope="col" { "Pareto-optimal" }
                    th scope="col" { "" }
                }
            }
            tbody {
                @for (i, point) in found.points.iter().enumerate() {
                    tr data-point=(i) {
                        th scope="row" class="number" data-value=(i + 1) { (i + 1) }
                        @for quantity in &quantities {
                            td class="number" data-value=(quantity.values[i]) { (number(quantity.values[i])) }
                        }
                        td class="number" data-value=(point.worst_scaled) { (number(point.worst_scaled)) }
                        td { (pareto(point.pareto)) }
                        td {
                            @if found.nearest == i { "nearest to the demands" }
                            @if found.knee == Some(i) { @if found.nearest == i { ", " } "knee" }
                        }
                    }
                }
            }
        }
    };
    html! {
        p class="hint" hidden { "Hover over a point, or move with the arrow keys; a click or Enter keeps it. Click a column to sort." }
        (scrolling("Points of the front", rows))
    }
}

fn pareto(pareto: Pareto) -> &'static str {
    match pareto {
        Pareto::CertifiedLocal => "to first order",
        Pareto::NotShown => "not shown",
        Pareto::No => "no",
    }
}
