//! Sensitivities of a design's criteria to its tuners at the reported point, as a shaded table.

use maud::{Markup, html};
use mops_outcome::SlopesReport;

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
                        @for (j, slope) in criterion.slopes.iter().enumerate() {
                            @match criterion.sides.as_ref().and_then(|sides| sides[j]) {
                                Some(sides) => (both(sides)),
                                None => (cell(*slope, steepest(&criterion.slopes))),
                            }
                        }
                    }
                }
            }
        }
    };
    html! {
        p {
            "First-order change of each scaled value at the " (best) " when a tuner is increased by 1 % of its range (1 % of its "
            "log range for logarithmic tuners). Negative means better. Darker shades mark the tuners with the largest influence "
            "on a criterion."
            @if found.criteria.iter().any(|criterion| criterion.sides.is_some()) {
                " At a kink of a criterion its change is given for an increase (\u{2191}) and for a decrease (\u{2193}) of the tuner; very large "
                "values indicate a jump, such as that of a settling time if the response just touches the band."
            }
        }
        (scrolling("Sensitivities", table))
    }
}

/// Returns the changes for an increase and for a decrease.
fn both([left, right]: [f64; 2]) -> Markup {
    let signed = |change: f64| format!("{}{}", if change > 0.0 { "+" } else { "" }, significant(0.01 * change, 3));
    html! {
        td class="number" data-value=(right) { "\u{2191} " (signed(right)) br; "\u{2193} " (signed(-left)) }
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
