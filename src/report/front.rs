//! Pareto front: plots over pairs of criteria and of the tuners, and a table of all points.

use maud::{Markup, html};
use mops_core::{Analysis, Tuner, problem::FrontObjective, solver::Pareto};
use mops_math as math;
use mops_outcome::{FrontCriterion, TradeOffs};

use super::Report;
use super::figures::{Figure, Group};
use super::page::scrolling;
use super::plot::{Color, Curve, CurveStyle, Level, ParallelAxis, Plot, ZAxis};
use super::sampling::{points, within_columns};
use crate::numbers::{labelled, number, significant};

/// Largest number of criteria plotted in pairs.
const MOST_PAIRED: usize = 4;
/// Largest number of tuners with plots.
const MOST_TUNERS: usize = 8;

/// Quantity with a value at every point of the front.
struct Quantity {
    name: String,
    unit: String,
    values: Vec<f64>,
    log: bool,
    demand: Option<f64>,
}

impl Quantity {
    /// Returns the smallest and the largest finite value.
    fn ends(&self) -> [f64; 2] {
        let finite = self.values.iter().copied().filter(|value| value.is_finite());
        finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
    }
}

/// Scripts that rotate a front over three criteria, and that select a point in all plots and in the table.
pub(super) const SCRIPTS: [&str; 2] = [include_str!("space.js"), include_str!("front.js")];

/// Returns the plots of the front; `None` without a front.
pub(super) fn group(report: &Report<'_>) -> Option<Group> {
    let found = report.outcome.found.trade_offs.as_ref()?;
    let (criteria, tuners) = (criteria(report, found), tuners(report));
    let mut figures = Vec::new();
    let mut add = |name: String, plot: Plot| {
        figures.push(Figure { plots: vec![(name, plot)], ..Figure::default() });
    };
    if criteria.len() <= MOST_PAIRED {
        for (k, x) in criteria.iter().enumerate() {
            for y in &criteria[k + 1..] {
                add(format!("front-{}-{}", x.name, y.name), pair(found, x, y));
            }
        }
    }
    if let [x, y, z] = criteria.as_slice() {
        add("front-space".to_owned(), space(found, [x, y, z]));
    }
    if criteria.len() + tuners.len() > 2 {
        add("front-parallel".to_owned(), parallel(found, &criteria, &tuners));
    }
    for tuner in tuners.iter().take(MOST_TUNERS) {
        add(format!("front-{}", tuner.name), pair(found, &criteria[0], tuner));
    }
    Some(Group { about: found.words.clone(), figures, ..Group::default() })
}

fn criteria(report: &Report<'_>, found: &TradeOffs) -> Vec<Quantity> {
    let study = report.problem.study();
    let quantity = |(criterion, objective): (&FrontCriterion, FrontObjective)| Quantity {
        name: criterion.key.replace('/', ", "),
        unit: criterion.unit.clone(),
        values: report.front.iter().map(|at| objective.worst(study, at).map_or(f64::NAN, |(_, r)| r.value)).collect(),
        log: false,
        demand: study.rows()[objective.rows[0]].demand.limit(),
    };
    found.criteria.iter().zip(report.problem.objectives()).map(quantity).collect()
}

fn tuners(report: &Report<'_>) -> Vec<Quantity> {
    let study = report.problem.study();
    let quantity = |(i, tuner): (usize, &Tuner)| Quantity {
        name: tuner.name.clone(),
        unit: tuner.unit.to_string(),
        values: report.front.iter().map(|at| at.tuners[i]).collect(),
        log: tuner.scale == mops_core::study::Scale::Log,
        demand: None,
    };
    study.tuners().iter().enumerate().filter(|(_, tuner)| tuner.active).map(quantity).collect()
}

/// Returns the plot of two quantities: a dot for every point, in other colours at the knee and nearest to the demands.
fn pair(found: &TradeOffs, x: &Quantity, y: &Quantity) -> Plot {
    Plot {
        title: format!("{} over {}", y.name, x.name),
        x_label: labelled(&x.name, &x.unit),
        y_label: labelled(&y.name, &y.unit),
        log_x: x.log,
        log_y: y.log,
        levels: y.demand.map(|value| Level { name: "demand".to_owned(), value }).into_iter().collect(),
        verticals: x.demand.map(|value| Level { value, ..Level::default() }).into_iter().collect(),
        curves: dots(found, x, y).into_iter().map(|(_, curve)| curve).collect(),
        ..Plot::default()
    }
}

/// Returns the dots of a plot, each with the index of its point.
fn dots(found: &TradeOffs, x: &Quantity, y: &Quantity) -> Vec<(usize, Curve)> {
    let one = |i: usize, name: &str, color| {
        let points = vec![(x.values[i], y.values[i])];
        (
            i,
            Curve {
                name: name.to_owned(),
                points,
                style: CurveStyle::Dots,
                color,
                front_point: Some(i),
                ..Curve::default()
            },
        )
    };
    let name = |i| if i == 0 { "Pareto front" } else { "" };
    let mut all: Vec<(usize, Curve)> = (0..x.values.len()).map(|i| one(i, name(i), Color::Result)).collect();
    all.extend(found.knee.map(|i| one(i, "knee", Color::Measured)));
    all.push(one(found.nearest, "nearest to the demands", Color::Demand));
    all
}

/// Returns the plot of three criteria.
fn space(found: &TradeOffs, [x, y, z]: [&Quantity; 3]) -> Plot {
    let dots = dots(found, x, y);
    let z_axis =
        ZAxis { label: labelled(&z.name, &z.unit), values: dots.iter().map(|(i, _)| vec![z.values[*i]]).collect() };
    Plot {
        title: format!("{}, {} and {}", x.name, y.name, z.name),
        x_label: labelled(&x.name, &x.unit),
        y_label: labelled(&y.name, &y.unit),
        curves: dots.into_iter().map(|(_, curve)| curve).collect(),
        z_axis: Some(z_axis),
        ..Plot::default()
    }
}

/// Returns the plot of parallel coordinates: one line per point, each axis from the smallest to the largest value.
fn parallel(found: &TradeOffs, criteria: &[Quantity], tuners: &[Quantity]) -> Plot {
    let all: Vec<&Quantity> = criteria.iter().chain(tuners.iter().take(MOST_TUNERS)).collect();
    let ends: Vec<[f64; 2]> = all.iter().map(|quantity| quantity.ends()).collect();
    let height = |quantity: &Quantity, [low, high]: [f64; 2], i: usize| {
        let drawn = |value: f64| if quantity.log { math::ln(value) } else { value };
        let [low, high] = [low, high].map(drawn);
        if high > low { (drawn(quantity.values[i]) - low) / (high - low) } else { 0.5 }
    };
    #[allow(clippy::cast_precision_loss)]
    let line = |i: usize, color| Curve {
        points: all.iter().zip(&ends).enumerate().map(|(at, (q, ends))| (at as f64, height(q, *ends, i))).collect(),
        color,
        front_point: Some(i),
        ..Curve::default()
    };
    let mut curves: Vec<Curve> = (0..criteria[0].values.len()).map(|i| line(i, Color::Result)).collect();
    let notable =
        [(found.knee, "knee", Color::Measured), (Some(found.nearest), "nearest to the demands", Color::Demand)];
    curves.extend(
        notable.into_iter().filter_map(|(i, name, color)| Some(Curve { name: name.to_owned(), ..line(i?, color) })),
    );
    let axis = |(quantity, ends): (&&Quantity, &[f64; 2])| ParallelAxis {
        name: labelled(&quantity.name, &quantity.unit),
        ends: ends.map(|end| significant(end, 3)),
    };
    Plot {
        title: "Parallel coordinates".to_owned(),
        x_label: "quantity".to_owned(),
        y_label: "from smallest to largest".to_owned(),
        parallel_axes: all.iter().zip(&ends).map(axis).collect(),
        curves,
        ..Plot::default()
    }
}

/// Largest number of responses, over all points and simulations.
const MOST_RESPONSES: usize = 400;
/// Number of columns to which a thin curve is reduced.
const COLUMNS: f64 = 150.0;

/// Returns the analysis of a job at every point of the front; empty beyond [`MOST_RESPONSES`].
pub(super) fn analyses(report: &Report<'_>, job: usize) -> Vec<Option<Analysis>> {
    if report.front.len() * report.problem.study().jobs().len() > MOST_RESPONSES {
        return Vec::new();
    }
    report.front.iter().map(|at| report.problem.analyse_all(job, &at.tuners, None).ok()).collect()
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

/// Returns the table of all points; a script makes its columns sortable and its rows selectable.
pub(super) fn table(report: &Report<'_>, found: &TradeOffs) -> Markup {
    let quantities: Vec<Quantity> = criteria(report, found).into_iter().chain(tuners(report)).collect();
    let rows = html! {
        table class="front" {
            thead {
                tr {
                    th scope="col" class="number" { "point" }
                    @for quantity in &quantities { th scope="col" class="number" { (labelled(&quantity.name, &quantity.unit)) } }
                    th scope="col" class="number" { "worst scaled value" }
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
        p class="hint" hidden {
            "Hover over a point or use the arrow keys; click or press Enter to select it, Escape to deselect. Click a column header "
            "to sort."
            @if found.criteria.len() == 3 { " Drag the box, or press Shift and an arrow key, to rotate it." }
        }
        (scrolling("Points of the front", rows))
    }
}

fn pareto(pareto: Pareto) -> &'static str {
    match pareto {
        Pareto::CertifiedLocal => "to first order",
        Pareto::NotShown => "not certified",
        Pareto::No => "no",
    }
}
