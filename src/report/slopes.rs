//! Sensitivities of a design's criteria to its tuners at the reported point, as a shaded table.

use maud::{Markup, html};
use mops_core::SlopesReport;

use super::page::scrolling;
use crate::numbers::significant;

/// Returns the table: a row for every criterion in its case, a column for every tuner.
pub(super) fn section(found: &SlopesReport, best: &str, one_case: bool) -> Markup {
    let steepest = |slopes: &[f64]| slopes.iter().filter(|s| s.is_finite()).fold(0.0_f64, |most, s| most.max(s.abs()));
    let name = |key: &str| {
        let (case, criterion) = key.split_once('/').unwrap_or(("", key));
        if one_case { (criterion.to_owned(), None) } else { (criterion.to_owned(), Some(case.to_owned())) }
    };
    let table = html! {
        table {
            thead {
                tr {
                    th scope="col" { "criterion" }
                    @if !one_case { th scope="col" { "case" } }
                    @for tuner in &found.tuners { th scope="col" class="number" { (tuner) } }
                }
            }
            tbody {
                @for criterion in &found.criteria {
                    @let (name, case) = name(&criterion.key);
                    tr {
                        th scope="row" { (name) }
                        @if let Some(case) = case { td { (case) } }
                        @for slope in &criterion.slopes { (cell(*slope, steepest(&criterion.slopes))) }
                    }
                }
            }
        }
    };
    html! {
        p {
            "First-order change of each scaled value at the " (best) " when a tuner is increased by 1 % of its range (1 % of its "
            "log range for logarithmic tuners). Negative means better. Darker shades mark the tuners with the largest influence "
            "on a criterion. At a non-differentiable point the value is one-sided; very large values indicate a discontinuity, "
            "such as that of a settling time if the response just touches the band."
        }
        (scrolling("Sensitivities", table))
    }
}

fn cell(slope: f64, steepest: f64) -> Markup {
    let tone = if slope > 0.0 { "shade bad" } else { "shade good" };
    let share = if slope.is_finite() && steepest > 0.0 { 45.0 * slope.abs() / steepest } else { 0.0 };
    let sign = if slope > 0.0 { "+" } else { "" };
    html! {
        td class={ "number " (tone) } style=(format!("--share:{share:.0}%")) data-value=[slope.is_finite().then_some(slope)] { (sign) (significant(0.01 * slope, 3)) }
    }
}
