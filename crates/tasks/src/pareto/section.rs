//! Pareto front: plots over pairs of criteria and of the tuners, and a table of all points.

use mops_content::figures::{Figure, Group};
use mops_content::numbers::{labelled, number, precise, significant};
use mops_content::plot::{Color, Curve, CurveStyle, Level, ParallelAxis, Plot, ZAxis};
use mops_content::section::{Block, Section};
use mops_content::table::{Cell, Table, numbers, text};
use mops_core::problem::FrontObjective;
use mops_core::solver::Pareto;
use mops_core::study::Tuner;
use mops_math as math;
use mops_outcome::Outcome;
use serde_json::{Map, Value};

use super::{FrontCriterion, TradeOffs};
use crate::room::Solution;

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

/// Returns the section of a report.
pub(super) fn of(of: &Solution<'_>, found: &TradeOffs) -> Section {
    Section::new("Front", [Block::Plots(group(of, found)), Block::Table(table(of, found))])
}

/// Returns the plots of the front.
fn group(report: &Solution<'_>, found: &TradeOffs) -> Group {
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
    Group { about: found.words.clone(), figures, ..Group::default() }
}

fn criteria(report: &Solution<'_>, found: &TradeOffs) -> Vec<Quantity> {
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

fn tuners(report: &Solution<'_>) -> Vec<Quantity> {
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

/// Returns the table of all points.
fn table(of: &Solution<'_>, found: &TradeOffs) -> Table {
    let quantities: Vec<Quantity> = criteria(of, found).into_iter().chain(tuners(of)).collect();
    let mut columns = vec![numbers("point")];
    columns.extend(quantities.iter().map(|quantity| numbers(labelled(&quantity.name, &quantity.unit))));
    columns.extend([numbers("worst scaled value"), text("Pareto-optimal"), text("")]);
    #[allow(clippy::cast_precision_loss)]
    let rows = found.points.iter().enumerate().map(|(i, point)| {
        let shown = |value: f64| Cell::from(number(value)).sorted_by(value);
        let mut row = vec![Cell::from((i + 1).to_string()).sorted_by((i + 1) as f64)];
        row.extend(quantities.iter().map(|quantity| shown(quantity.values[i])));
        let pareto = match point.pareto {
            Pareto::CertifiedLocal => "to first order",
            Pareto::NotShown => "not certified",
            Pareto::No => "no",
        };
        row.extend([shown(point.worst_scaled), pareto.into(), marks(found, i).into()]);
        row
    });
    Table { are_points: true, ..Table::new("Points of the front", columns).rows(rows) }
}

/// Returns what is notable of a point.
fn marks(found: &TradeOffs, i: usize) -> String {
    let marks = [(found.nearest == i, "nearest to the demands"), (found.knee == Some(i), "knee")];
    marks.iter().filter(|(is, _)| *is).map(|(_, mark)| *mark).collect::<Vec<_>>().join(", ")
}

/// Returns the points for the terminal, one line each.
pub(super) fn lines(outcome: &Outcome, found: &TradeOffs) -> Vec<Block> {
    let active: Vec<&str> = outcome.tuners.iter().filter(|t| t.active).map(|t| t.name.as_str()).collect();
    let units = |name: &str| outcome.tuners.iter().find(|t| t.name == name).map_or("", |t| t.unit.as_str());
    let with_unit = |name: &str, unit: &str| if unit == "1" { name.to_owned() } else { format!("{name}, {unit}") };
    let mut columns = vec![numbers("")];
    columns.extend(found.criteria.iter().map(|c| numbers(with_unit(&c.key, &c.unit))));
    columns.extend(active.iter().map(|name| numbers(with_unit(name, units(name)))));
    columns.extend([numbers("worst scaled"), text("pareto"), text("")]);
    let rows = outcome.front.iter().zip(&found.points).enumerate().map(|(i, (point, known))| {
        let value = |of: &Map<String, Value>, name: &str| of[name].as_f64().map_or_else(String::new, precise);
        let mut row: Vec<Cell> = vec![(i + 1).to_string().into()];
        row.extend(found.criteria.iter().map(|c| Cell::from(value(&point.objectives, &c.key))));
        row.extend(active.iter().map(|name| Cell::from(value(&point.tuners, name))));
        let pareto = match known.pareto {
            Pareto::CertifiedLocal => "yes, to first order",
            Pareto::NotShown => "not certified",
            Pareto::No => "no",
        };
        row.extend([precise(known.worst_scaled).into(), pareto.into(), marks(found, i).into()]);
        row
    });
    let table = Table::new("Points of the front", columns).rows(rows);
    vec![Block::Heading("front".to_owned()), Block::Table(table), Block::Findings(found.words.clone())]
}
