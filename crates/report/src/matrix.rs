//! Criteria by case: a table of scaled values, shaded by the distance from the demand.

use maud::{Markup, html};
use mops_content::numbers::{significant, with_unit};
use mops_core::Usage;
use mops_outcome::{CriterionReport, Outcome};

use super::markup::scrolling;

/// Returns the table: a row for every case, a column for every criterion, and the worst of each. `None` for fewer than
/// two cases with demands.
pub(super) fn section(outcome: &Outcome) -> Option<Markup> {
    let counts = |c: &&CriterionReport| c.demand.is_some() || (c.good.is_some() && c.bad.is_some());
    let all: Vec<&CriterionReport> = outcome.criteria.iter().filter(counts).collect();
    let cases = distinct(all.iter().map(|c| c.case.as_str()));
    let names = distinct(all.iter().map(|c| c.name.as_str()));
    if cases.len() < 2 {
        return None;
    }
    let at = |case: &str, name: &str| all.iter().copied().find(|c| c.case == case && c.name == name);
    let worst =
        |of: &mut dyn Iterator<Item = &CriterionReport>| of.max_by(|a, b| severity(a).total_cmp(&severity(b))).cloned();
    let rows = html! {
        table {
            thead {
                tr {
                    th scope="col" { "case" }
                    @for name in &names { th scope="col" class="number" { (name) } }
                    th scope="col" class="number" { "worst" }
                }
            }
            tbody {
                @for case in &cases {
                    tr {
                        th scope="row" { (case) }
                        @for name in &names { (cell(at(case, name))) }
                        (cell(worst(&mut all.iter().copied().filter(|c| c.case == *case)).as_ref()))
                    }
                }
            }
            tfoot {
                tr {
                    th scope="row" { "worst" }
                    @for name in &names { (cell(worst(&mut all.iter().copied().filter(|c| c.name == *name)).as_ref())) }
                    (cell(worst(&mut all.iter().copied()).as_ref()))
                }
            }
        }
    };
    Some(html! {
        p {
            "Scaled values: at most 1 means the demand is met. Darker shades are farther from 1; missed demands are bold."
        }
        (scrolling("Criteria by case", rows))
    })
}

/// Returns the severity: the scaled value; for an equality, 1 plus its distance from 1; infinite without a value.
fn severity(criterion: &CriterionReport) -> f64 {
    match (criterion.scaled, criterion.usage) {
        (scaled, _) if scaled.is_nan() => f64::INFINITY,
        (scaled, Usage::Equality) => 1.0 + (scaled - 1.0).abs(),
        (scaled, _) => scaled,
    }
}

fn cell(criterion: Option<&CriterionReport>) -> Markup {
    let Some(criterion) = criterion else { return html! { td class="number" {} } };
    if criterion.scaled.is_nan() {
        return html! { td class="number shade bad missed" style="--share:45%" data-value="Infinity" { "no value" } };
    }
    let beyond = severity(criterion) - 1.0;
    let (tone, share) = match criterion.met {
        Some(true) | None => ("number shade good", 40.0 * beyond.abs().min(1.0)),
        _ if matches!(criterion.usage, Usage::Inequality | Usage::Equality) => {
            ("number shade bad missed", 10.0 + 35.0 * beyond.min(1.0))
        }
        _ => ("number shade mixed above", 10.0 + 35.0 * beyond.min(1.0)),
    };
    let of = format!("{} in {}: {}", criterion.name, criterion.case, with_unit(criterion.value, &criterion.unit));
    html! {
        td class=(tone) style=(format!("--share:{share:.0}%")) title=(of) data-value=(criterion.scaled) {
            (significant(criterion.scaled, 3))
        }
    }
}

/// Returns the distinct names, in the order of their first appearance.
fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut found: Vec<&str> = Vec::new();
    for name in names {
        if !found.contains(&name) {
            found.push(name);
        }
    }
    found
}
