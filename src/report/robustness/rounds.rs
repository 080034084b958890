//! Robust design against worst cases: rounds, bounds, added cases.

use maud::{Markup, html};
use mops_outcome::robustness::RobustReport;

use super::super::figures::{Figure, Group};
use super::super::page::scrolling;
use super::super::plot::{Color, Curve, CurveStyle, Plot};
use super::super::sensitivity::sentences;
use super::{Section, parameters, worst};
use crate::numbers::{number, significant};

pub(super) fn section(found: &RobustReport) -> Section {
    let content = html! {
        (sentences(&found.words))
        (parameters(&found.parameters))
        h3 { "Rounds" }
        p {
            "Each round solves the design for the present cases, then searches the box for worse ones. The worst scaled value "
            "over the present cases is a lower bound on the worst case of any design, if the solution is optimal. It increases as "
            "cases are added. The worst value found in the box is that of the design of the round."
        }
        (rounds(found))
        h3 { "Worst cases of the design" }
        (worst::table(&found.criteria, &found.parameters))
    };
    Section {
        title: "Design against worst cases",
        content,
        group: Group { figures: vec![bounds(found)], ..Group::default() },
    }
}

fn rounds(found: &RobustReport) -> Markup {
    scrolling(
        "Rounds",
        html! {
            table {
                thead {
                    tr {
                        th scope="col" class="number" { "round" }
                        th scope="col" class="number" { "cases" }
                        th scope="col" class="number" { "worst over the cases" }
                        th scope="col" class="number" { "worst found in the box" }
                        th scope="col" class="number" { "violation in the box" }
                        th scope="col" class="number" { "evaluations" }
                        th scope="col" { "added" }
                    }
                }
                tbody {
                    @for (i, round) in found.rounds.iter().enumerate() {
                        tr {
                            th scope="row" class="number" { (i + 1) @if i == found.chosen { small { "reported" } } }
                            td class="number" { (round.cases) }
                            td class="number" { (number(round.for_cases)) }
                            td class="number" { (number(round.found)) }
                            td class="number" { (significant(round.violation_found.max(0.0), 3)) }
                            td class="number" { (round.evaluations) }
                            td {
                                @for added in &round.added {
                                    div { (added.name) ", "
                                        @match added.scaled {
                                            Some(scaled) => { "scaled " (significant(scaled, 4)) }
                                            None => { "beyond the edge of a jump" }
                                        }
                                        ": "
                                        @for (j, c) in added.at.iter().enumerate() { @if j > 0 { ", " } (c.name) " = " (number(c.value)) }
                                    }
                                }
                            }
                        }
                    }
                }
            }
        },
    )
}

#[allow(clippy::cast_precision_loss)]
fn bounds(found: &RobustReport) -> Figure {
    let curve = |name: &str,
                 color: Color,
                 style: CurveStyle,
                 of: &dyn Fn(&mops_outcome::robustness::RoundReport) -> f64| Curve {
        name: name.into(),
        points: found.rounds.iter().enumerate().map(|(i, round)| ((i + 1) as f64, of(round))).collect(),
        color,
        style,
        ..Curve::default()
    };
    let mut curves = vec![
        curve("worst found in the box", Color::Measured, CurveStyle::Line, &|round| round.found),
        curve("", Color::Measured, CurveStyle::Dots, &|round| round.found),
        curve("worst over the present cases", Color::Result, CurveStyle::Line, &|round| round.for_cases),
        curve("", Color::Result, CurveStyle::Dots, &|round| round.for_cases),
    ];
    if found.rounds.iter().any(|round| round.violation_found > 0.0) {
        curves.push(curve("violation found in the box", Color::Demand, CurveStyle::Dashed, &|round| {
            round.violation_found.max(0.0)
        }));
    }
    let plot = Plot {
        title: "Worst scaled value by round".into(),
        x_label: "round".into(),
        y_label: "worst scaled value".into(),
        curves,
        ..Plot::default()
    };
    Figure { plots: vec![("rounds".into(), plot)], ..Figure::default() }
}
