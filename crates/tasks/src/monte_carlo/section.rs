//! Distributions of the criteria: shares that meet the demands, quantiles, histograms, samples over parameters.

use mops_content::{
    figures::{Figure, Group},
    numbers::{known, labelled, number, share, significant},
    plot::{Color, Curve, CurveStyle, Plot},
    section::{Block, Part, Section},
    table::{Cell, Table, numbers, text},
};
use mops_math as math;

use crate::uncertain::{self, DistributionReport, MonteCarloReport, ShareReport};

/// Largest number of plotted points of an empirical distribution function.
const MOST_POINTS: usize = 400;

/// Largest number of bins of a histogram.
const BINS: usize = 60;

/// Returns the section of a report.
pub(super) fn of(found: &MonteCarloReport) -> Section {
    let figures = found.criteria.iter().enumerate().flat_map(|(i, criterion)| figures(found, criterion, i));
    let about = format!(
        "Brackets contain {} confidence intervals: of quantiles without assumption on the distribution, of shares by Clopper and \
         Pearson. All samples are in samples.csv.",
        percent(found.level)
    );
    let blocks = [
        Block::Findings(found.words.clone()),
        Block::Table(uncertain::parameters(&found.parameters)),
        Block::Table(table(found)),
        Block::text(about),
        Block::Plots(Group { figures: figures.collect(), ..Group::default() }),
    ];
    Section::new("Distributions", blocks)
}

fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share, 4))
}

/// Returns the levels of the quantiles.
fn levels(found: &MonteCarloReport) -> Vec<f64> {
    found.criteria.first().map_or_else(Vec::new, |c| c.quantiles.iter().map(|q| q.share).collect())
}

fn end(value: f64) -> String {
    if value.is_finite() { significant(value, 4) } else { "?".to_owned() }
}

fn table(found: &MonteCarloReport) -> Table {
    let mut columns =
        vec![text("criterion"), text("case"), numbers("nominal"), numbers("mean"), numbers("standard deviation")];
    columns.extend(levels(found).into_iter().map(|level| numbers(format!("{} quantile", percent(level)))));
    columns.extend([text("unit"), numbers("demand met")]);
    columns.extend((found.failed > 0).then(|| numbers("failed")));
    let met = |share: &ShareReport| {
        let [low, high] = share.interval.map(percent);
        Cell::new([Part::Strong(percent(share.share)), Part::Small(format!("[{low}, {high}]"))])
    };
    let rows = found.criteria.iter().map(|c| {
        let mut row: Vec<Cell> = vec![
            c.of.criterion.clone().into(),
            c.of.case.clone().into(),
            number(c.of.nominal).into(),
            Cell::strong(number(c.mean)),
            significant(c.deviation, 3).into(),
        ];
        row.extend(c.quantiles.iter().map(|q| {
            let [low, high] = q.interval.map(end);
            Cell::with_remark(number(q.value), format!("[{low}, {high}]"))
        }));
        row.extend([c.of.unit.clone().into(), c.met.as_ref().map_or_else(Cell::default, met)]);
        row.extend((found.failed > 0).then(|| Cell::from(c.failed.to_string())));
        row
    });
    Table::new("Distributions", columns).rows(rows)
}

/// Returns the table for the terminal.
pub(super) fn lines(found: &MonteCarloReport) -> Table {
    let mut columns = vec![text("case"), text("criterion"), numbers("nominal"), numbers("mean"), numbers("std. dev.")];
    columns.extend(levels(found).into_iter().map(|level| text(percent(level))));
    columns.extend([text("unit"), text("demand met"), text(if found.failed > 0 { "failed" } else { "" })]);
    let rows = found.criteria.iter().map(|c| {
        let mut row: Vec<Cell> = vec![
            c.of.case.clone().into(),
            c.of.criterion.clone().into(),
            known(c.of.nominal).into(),
            known(c.mean).into(),
            known(c.deviation).into(),
        ];
        row.extend(c.quantiles.iter().map(|q| {
            let [low, high] = q.interval.map(end);
            Cell::from(format!("{} [{low}, {high}]", significant(q.value, 4)))
        }));
        let met = c.met.as_ref().map_or_else(String::new, |met| {
            format!("{} [{}, {}]", share(met.share), share(met.interval[0]), share(met.interval[1]))
        });
        let failed = if c.failed > 0 { c.failed.to_string() } else { String::new() };
        row.extend([c.of.unit.clone().into(), met.into(), failed.into()]);
        row
    });
    Table::new("Distributions", columns).rows(rows)
}

/// Returns the histogram, the distribution function, and the samples over every parameter.
fn figures(found: &MonteCarloReport, criterion: &DistributionReport, index: usize) -> Vec<Figure> {
    let mut values: Vec<f64> = found.table.iter().map(|(_, row)| row[index]).filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    if values.len() < 2 || values[0] == values[values.len() - 1] {
        return Vec::new();
    }
    let of = &criterion.of;
    let place = format!("{}-{}", of.case, of.criterion);
    let plots = [
        (format!("histogram-{place}"), histogram(criterion, &values)),
        (format!("distribution-{place}"), ecdf(criterion, &values)),
    ];
    let one = |plot| Figure { plots: vec![plot], ..Figure::default() };
    let mut figures: Vec<Figure> = plots.into_iter().map(one).collect();
    for (j, parameter) in found.parameters.iter().enumerate() {
        let points = found.table.iter().take(4 * MOST_POINTS).map(|(x, y)| (x[j], y[index])).collect();
        let mut curves = vec![Curve { name: "samples".into(), points, style: CurveStyle::Dots, ..Curve::default() }];
        let ends = Some([
            found.table.iter().map(|(x, _)| x[j]).fold(f64::INFINITY, f64::min),
            found.table.iter().map(|(x, _)| x[j]).fold(f64::NEG_INFINITY, f64::max),
        ]);
        curves.extend(of.demand.iter().flat_map(|&demand| {
            ends.map(|ends| Curve {
                name: "demand".into(),
                points: ends.map(|x| (x, demand)).to_vec(),
                color: Color::Demand,
                may_leave: true,
                ..Curve::default()
            })
        }));
        let plot = Plot {
            title: format!("{} over {}", of.criterion, parameter.name),
            x_label: labelled(&parameter.name, &parameter.unit),
            y_label: labelled(&of.criterion, &of.unit),
            curves,
            ..Plot::default()
        };
        figures
            .push(Figure { plots: vec![(format!("samples-{place}-{}", parameter.name), plot)], ..Figure::default() });
    }
    figures
}

/// Returns the histogram, with bins of the width by Freedman and Diaconis.
/// Source: D. Freedman, P. Diaconis, Zeitschrift fuer Wahrscheinlichkeitstheorie 57 (1981) 453-476.
#[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn histogram(criterion: &DistributionReport, sorted: &[f64]) -> Plot {
    let [low, high] = [sorted[0], sorted[sorted.len() - 1]];
    let quartile = |p: f64| mops_statistics::quantile(sorted, p);
    let width = 2.0 * (quartile(0.75) - quartile(0.25)) / math::cbrt(sorted.len() as f64);
    let count = if width > 0.0 { (((high - low) / width).ceil() as usize).clamp(5, BINS) } else { BINS };
    let mut bins = vec![0usize; count];
    for value in sorted {
        bins[(((value - low) / (high - low) * count as f64) as usize).min(count - 1)] += 1;
    }
    let edge = |i: usize| low + (high - low) * i as f64 / count as f64;
    let mut points = vec![(low, 0.0)];
    points.extend(bins.iter().enumerate().flat_map(|(i, &n)| [(edge(i), n as f64), (edge(i + 1), n as f64)]));
    points.push((high, 0.0));
    let highest = bins.iter().copied().max().unwrap_or(1) as f64;
    let mut curves = vec![Curve { name: "samples per bin".into(), points, ..Curve::default() }];
    curves.extend(vertical_lines(criterion, highest));
    Plot {
        title: format!("Histogram of {} in case {}", criterion.of.criterion, criterion.of.case),
        x_label: labelled(&criterion.of.criterion, &criterion.of.unit),
        y_label: "samples".into(),
        curves,
        ..Plot::default()
    }
}

/// Returns vertical lines at the demand and at the nominal value.
fn vertical_lines(criterion: &DistributionReport, top: f64) -> Vec<Curve> {
    let line = |name: &str, x: f64, color: Color, style: CurveStyle| Curve {
        name: name.into(),
        points: vec![(x, 0.0), (x, top)],
        color,
        style,
        may_leave: true,
        ..Curve::default()
    };
    let demand = criterion.of.demand.map(|x| line("demand", x, Color::Demand, CurveStyle::Line));
    let nominal = Some(criterion.of.nominal)
        .filter(|x| x.is_finite())
        .map(|x| line("nominal value", x, Color::Start, CurveStyle::Dashed));
    demand.into_iter().chain(nominal).collect()
}

#[allow(clippy::cast_precision_loss)]
fn ecdf(criterion: &DistributionReport, sorted: &[f64]) -> Plot {
    let n = sorted.len();
    let every = n.div_ceil(MOST_POINTS);
    let kept = (0..n).filter(|i| i % every == 0 || *i + 1 == n);
    let points =
        kept.flat_map(|i| [(sorted[i], i as f64 / n as f64), (sorted[i], (i + 1) as f64 / n as f64)]).collect();
    let mut curves = vec![Curve { name: "empirical distribution function".into(), points, ..Curve::default() }];
    curves.extend(vertical_lines(criterion, 1.0));
    Plot {
        title: format!("Distribution of {} in case {}", criterion.of.criterion, criterion.of.case),
        x_label: labelled(&criterion.of.criterion, &criterion.of.unit),
        y_label: "share of samples".into(),
        curves,
        ..Plot::default()
    }
}
