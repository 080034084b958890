//! Worst cases: a table, their responses, and every criterion along every parameter.

use std::sync::Arc;

use maud::{Markup, html};
use mops_core::Problem;
use mops_outcome::robustness::{CoordinateReport, UncertainReport, WorstCaseReport, WorstReport};

use super::super::comparison::bounds;
use super::super::figures::{Figure, Group};
use super::super::page::scrolling;
use super::super::plot::{Color, Curve, CurveStyle, Level, Plot};
use super::super::sensitivity::sentences;
use super::super::{Report, sampling};
use super::{Section, parameters};
use crate::numbers::{labelled, number, significant};

pub(super) fn section(report: &Report<'_>, found: &WorstCaseReport) -> Section {
    let content = html! {
        (sentences(&found.words))
        (parameters(&found.parameters))
        (table(&found.criteria, &found.parameters))
    };
    let mut group = Group::default();
    group.figures.extend(responses(report, found));
    group.figures.extend(found.criteria.iter().flat_map(slices));
    Section { title: "Worst cases", content, group }
}

/// Returns the table of the worst case of every criterion.
pub(super) fn table(list: &[WorstReport], names: &[UncertainReport]) -> Markup {
    let failed = list.iter().any(|worst| worst.failed > 0);
    scrolling(
        "Worst cases",
        html! {
            table {
                thead {
                    tr {
                        th scope="col" { "criterion" }
                        th scope="col" { "case" }
                        th scope="col" class="number" { "demand" }
                        th scope="col" class="number" { "nominal" }
                        th scope="col" class="number" { "worst" }
                        th scope="col" { "unit" }
                        th scope="col" class="number" { "scaled" }
                        th scope="col" { "met" }
                        @for name in names { th scope="col" class="number" { "at " (labelled(&name.name, &name.unit)) } }
                        th scope="col" class="number" { "searches ending here" }
                        @if failed { th scope="col" class="number" { "failed" } }
                    }
                }
                tbody {
                    @for worst in list {
                        tr {
                            th scope="row" { (worst.of.criterion) }
                            td { (worst.of.case) }
                            td class="number" { @if let Some(demand) = worst.of.demand { (number(demand)) } }
                            td class="number" { (number(worst.of.nominal)) }
                            td class="number" { strong { (number(worst.value)) } }
                            td { (worst.of.unit) }
                            td class="number" { @if worst.scaled.is_finite() { (significant(worst.scaled, 4)) } }
                            td { @if worst.of.demand.is_some() {
                                @if worst.met { span class="met" { "yes" } } @else { span class="missed" { "no" } }
                            } }
                            @for i in 0..names.len() { td class="number" { @if let Some(at) = worst.at.get(i) { (coordinate(at)) } } }
                            td class="number" { (worst.ended_here) " of " (worst.starts) }
                            @if failed { td class="number" { @if worst.failed > 0 { span class="missed" { (worst.failed) } } @else { "0" } } }
                        }
                    }
                }
            }
        },
    )
}

fn coordinate(at: &CoordinateReport) -> Markup {
    html! { (number(at.value)) @if let Some(side) = at.at_bound { small { (side) " end" } } }
}

/// Returns plots of the signals that a criterion reads, for nominal parameters and in the worst case.
fn responses(report: &Report<'_>, found: &WorstCaseReport) -> Vec<Figure> {
    let study = report.problem.study().over_uncertain(&report.best.tuners);
    let first = study.tuners().len() - study.tasks().uncertain.len();
    let problem = Problem::new(Arc::new(study.clone()));
    let mut figures = Vec::new();
    for worst in found.criteria.iter().filter(|worst| !worst.at.is_empty()) {
        let of = &worst.of;
        let here = |row: &&mops_core::study::Row| row.name == of.criterion && study.case_of(row).name == of.case;
        let Some(row) = study.rows().iter().find(here) else { continue };
        let mut tuners = study.start();
        let analyses = [
            ("nominal", CurveStyle::Dashed, Color::Start, false),
            ("worst case", CurveStyle::Line, Color::Result, true),
        ]
        .map(|(name, style, color, moved)| {
            if moved {
                tuners[first..].iter_mut().zip(&worst.at).for_each(|(value, at)| *value = at.value);
            }
            (name, style, color, problem.analyse_all(row.job, &tuners, None).ok())
        });
        let signals = &study.models()[study.jobs()[row.job].model].1.interface().signals;
        for signal in row.criterion.signals() {
            let curve = |(name, style, color, analysis): &(&str, CurveStyle, Color, Option<mops_core::Analysis>)| {
                let trace = analysis.as_ref()?.response()?.trace(&signal)?;
                Some(Curve {
                    name: (*name).into(),
                    points: sampling::points(trace),
                    style: *style,
                    color: *color,
                    ..Curve::default()
                })
            };
            let curves: Vec<Curve> = analyses.iter().filter_map(curve).collect();
            let Some(variable) = signals.iter().find(|s| s.name == signal).filter(|_| !curves.is_empty()) else {
                continue;
            };
            let plot = Plot {
                title: format!("{signal} in the worst case of {}", of.criterion),
                x_label: "time (s)".into(),
                y_label: labelled(&signal, &variable.unit.to_string()),
                curves,
                bounds: analyses[1].3.iter().flat_map(|analysis| bounds(&signal, &[row], analysis)).collect(),
                ..Plot::default()
            };
            let name = format!("worst-{}-{}-{signal}", of.case, of.criterion);
            figures.push(Figure { plots: vec![(name, plot)], ..Figure::default() });
        }
    }
    figures
}

/// Returns plots of a criterion along every parameter through its worst case, which is marked.
fn slices(worst: &WorstReport) -> Vec<Figure> {
    let of = &worst.of;
    let one = |(slice, at): (&mops_outcome::robustness::Slice, &CoordinateReport)| {
        let points = slice.x.iter().copied().zip(slice.y.iter().copied()).collect();
        let mark = Curve {
            name: "worst case".into(),
            points: vec![(at.value, worst.value)],
            style: CurveStyle::Dots,
            color: Color::Demand,
            ..Curve::default()
        };
        let plot = Plot {
            title: format!("{} along {} through its worst case", of.criterion, slice.parameter),
            x_label: labelled(&slice.parameter, &slice.unit),
            y_label: labelled(&of.criterion, &of.unit),
            curves: vec![Curve { name: of.criterion.clone(), points, ..Curve::default() }, mark],
            levels: of.demand.iter().map(|&value| Level { name: "demand".into(), value }).collect(),
            ..Plot::default()
        };
        Figure {
            plots: vec![(format!("slice-{}-{}-{}", of.case, of.criterion, slice.parameter), plot)],
            ..Figure::default()
        }
    };
    worst.slices.iter().zip(&worst.at).map(one).collect()
}
