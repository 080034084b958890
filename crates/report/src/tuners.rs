//! Table of tuners, with their positions within the bounds.

use maud::{Markup, html};
use mops_content::numbers::number;
use mops_core::study::{Scale, Tuner};

use super::Report;
use super::markup::scrolling;

/// Returns the table of all tuners, with their positions within the bounds.
pub(super) fn table(report: &Report<'_>) -> Markup {
    let study = report.solution.problem.study();
    let two = report.solution.outcome.solver != "none";
    let log = study.tuners().iter().any(|t| t.scale == Scale::Log);
    let rows_and_head = html! {
        table {
            thead {
                tr {
                    th scope="col" { "tuner" }
                    @if two { th scope="col" class="number" { "at initial guess" } }
                    th scope="col" class="number" { "at " (report.best_name()) }
                    th scope="col" { "unit" }
                    th scope="col" class="number" { "min" }
                    th scope="col" { "position" }
                    th scope="col" class="number" { "max" }
                    th scope="col" { "remark" }
                }
            }
            tbody {
                @for (now, tuner) in report.solution.outcome.tuners.iter().zip(study.tuners()) {
                    tr {
                        th scope="row" { (now.name) }
                        @if two { td class="number" { (number(now.start)) } }
                        td class="number" { strong { (number(now.value)) } }
                        td { (now.unit) }
                        td class="number" { @if now.bounds[0].is_finite() { (number(now.bounds[0])) } }
                        td { @if now.active { (position(tuner, now.start, now.value)) } }
                        td class="number" { @if now.bounds[1].is_finite() { (number(now.bounds[1])) } }
                        td { (remark(tuner, now.at_bound, |i| &study.tuners()[i].name)) }
                    }
                }
            }
        }
    };
    html! {
        p {
            "Filled mark: value"
            @if two { "; hollow mark: initial guess" }
            @if log { "; positions of logarithmic tuners are on a logarithmic scale" }
            "."
        }
        (scrolling("Tuners", rows_and_head))
    }
}

fn position(tuner: &Tuner, start: f64, value: f64) -> Markup {
    let left = |value: f64| format!("left:{:.1}%", 100.0 * tuner.position_of(value));
    html! {
        span class="range" aria-hidden="true" {
            span class="from" style=(left(start)) {}
            span class="at" style=(left(value)) {}
        }
    }
}

fn remark<'a>(tuner: &Tuner, at_bound: Option<&str>, name: impl Fn(usize) -> &'a String) -> Markup {
    html! {
        @if let Some((_, of)) = &tuner.tie {
            "tied to " (of.iter().map(|&i| name(i).as_str()).collect::<Vec<_>>().join(", "))
        } @else if !tuner.active {
            "fixed"
        } @else if let Some(side) = at_bound {
            span class="missed" { "at " (side) " bound" }
            @if tuner.scale == Scale::Log { span class="quiet" { ", logarithmic" } }
        } @else if tuner.scale == Scale::Log {
            span class="quiet" { "logarithmic" }
        }
    }
}
