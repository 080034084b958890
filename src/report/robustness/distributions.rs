//! Distributions of the criteria: shares that meet the demands, quantiles, histograms, samples over parameters.

use maud::{Markup, html};
use mops_math as math;
use mops_outcome::robustness::{DistributionReport, MonteCarloReport, ShareReport};

use super::super::figures::{Figure, Group};
use super::super::page::scrolling;
use super::super::plot::{Color, Curve, CurveStyle, Plot};
use super::super::sensitivity::sentences;
use super::{Section, parameters};
use crate::numbers::{labelled, number, significant};

/// Largest number of plotted points of an empirical distribution function.
const MOST_POINTS: usize = 400;

/// Largest number of bins of a histogram.
const BINS: usize = 60;

pub(super) fn section(found: &MonteCarloReport) -> Section {
    let content = html! {
        (sentences(&found.words))
        (parameters(&found.parameters))
        (table(found))
        p {
            "Brackets contain " (percent(found.level)) " confidence intervals: of quantiles without assumption on the "
            "distribution, of shares by Clopper and Pearson. All samples are in samples.csv."
        }
    };
    let figures = found.criteria.iter().enumerate().flat_map(|(i, criterion)| figures(found, criterion, i));
    Section { title: "Distributions", content, group: Group { figures: figures.collect(), ..Group::default() } }
}

fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share, 4))
}

fn table(found: &MonteCarloReport) -> Markup {
    let shares: Vec<f64> =
        found.criteria.first().map_or_else(Vec::new, |c| c.quantiles.iter().map(|q| q.share).collect());
    let end = |value: f64| if value.is_finite() { significant(value, 4) } else { "?".to_owned() };
    scrolling(
        "Distributions",
        html! {
            table {
                thead {
                    tr {
                        th scope="col" { "criterion" }
                        th scope="col" { "case" }
                        th scope="col" class="number" { "nominal" }
                        th scope="col" class="number" { "mean" }
                        th scope="col" class="number" { "standard deviation" }
                        @for share in &shares { th scope="col" class="number" { (percent(*share)) " quantile" } }
                        th scope="col" { "unit" }
                        th scope="col" class="number" { "demand met" }
                        @if found.failed > 0 { th scope="col" class="number" { "failed" } }
                    }
                }
                tbody {
                    @for c in &found.criteria {
                        tr {
                            th scope="row" { (c.of.criterion) }
                            td { (c.of.case) }
                            td class="number" { (number(c.of.nominal)) }
                            td class="number" { strong { (number(c.mean)) } }
                            td class="number" { (significant(c.deviation, 3)) }
                            @for q in &c.quantiles {
                                td class="number" { (number(q.value)) small { "[" (end(q.interval[0])) ", " (end(q.interval[1])) "]" } }
                            }
                            td { (c.of.unit) }
                            td class="number" { @if let Some(met) = &c.met { (share(met)) } }
                            @if found.failed > 0 { td class="number" { (c.failed) } }
                        }
                    }
                }
            }
        },
    )
}

fn share(share: &ShareReport) -> Markup {
    html! { strong { (percent(share.share)) } small { "[" (percent(share.interval[0])) ", " (percent(share.interval[1])) "]" } }
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
