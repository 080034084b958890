//! Table of criteria, with bars that mark the demand.

use maud::{Markup, html};
use mops_content::numbers::{apart, number, significant, with_unit};
use mops_core::Usage;
use mops_outcome::CriterionReport;

use super::Report;
use super::markup::{parts, scrolling};

/// Returns the demand of a criterion, with its unit; `None` without a demand.
pub(super) fn demand(criterion: &CriterionReport) -> Option<String> {
    match (criterion.demand, criterion.good, criterion.bad) {
        (Some(demand), _, _) if criterion.at_least => Some(format!("at least {}", with_unit(demand, &criterion.unit))),
        (Some(demand), _, _) => Some(with_unit(demand, &criterion.unit)),
        (None, Some(good), Some(bad)) => {
            let side = if good > bad { "at least" } else { "at most" };
            Some(format!("{side} {}, good {}", with_unit(bad, &criterion.unit), number(good)))
        }
        _ => None,
    }
}

/// Returns the table of all criteria in all cases, at the initial guess and at the reported point.
pub(super) fn table(report: &Report<'_>) -> Markup {
    let (outcome, best) = (report.solution.outcome, report.best_name());
    let models = report.solution.problem.study().models().len() > 1;
    let cases = report.solution.problem.study().cases().len() > 1;
    // Without a solver there is only one point. The sum of a calibration has no demand.
    let (two, demands) = (outcome.solver != "none", report.room.judges_demands());
    let shape = report.solution.problem.shape();
    let rows = outcome.criteria.iter().zip(&outcome.start.criteria).zip(&shape.rows);
    let rows_and_head = html! {
        table {
            thead {
                tr {
                    th scope="col" { "criterion" }
                    @if cases { th scope="col" { "case" } }
                    @if models { th scope="col" { "model" } }
                    th scope="col" { "usage" }
                    th scope="col" class="number" { "demand" }
                    @if two { th scope="col" class="number" { "at initial guess" } }
                    th scope="col" class="number" { "at " (best) }
                    th scope="col" { "unit" }
                    @if two { th scope="col" class="number" { "scaled at initial guess" } }
                    th scope="col" { "scaled at " (best) }
                    @if demands { th scope="col" { "met" } }
                }
            }
            tbody {
                @for ((now, start), (usage, weight)) in rows {
                    @let demanded = demand(now).is_some();
                    tr {
                        th scope="row" { (now.name) @if let Some(note) = now.note { small { (note) } } }
                        @if cases { td { (now.case) } }
                        @if models { td { (now.model) } }
                        td { (usage_name(now.usage, *usage)) @if *weight != 1.0 { small { "weight " (number(*weight)) } } }
                        td class="number" { @if demanded { (limit(now)) } @else { "none" } }
                        @if two { td class="number" { (distinct_from_demand(start)) } }
                        td class="number" { strong { (distinct_from_demand(now)) } }
                        td { (now.unit) }
                        @if two { td class="number" { @if demanded { (scaled_number(start.scaled)) } } }
                        td { @if demanded { (scaled(now)) } }
                        @if demands { td { @if demanded { (met(now)) } } }
                    }
                }
            }
        }
    };
    html! {
        p {
            (parts(&report.room.about_criteria(outcome)))
        }
        (scrolling("Criteria", rows_and_head))
    }
}

/// Returns the value of a criterion, with enough digits to distinguish it from a missed demand.
fn distinct_from_demand(criterion: &CriterionReport) -> String {
    let limit = criterion.demand.or(criterion.bad).filter(|_| criterion.met == Some(false));
    apart(criterion.value, limit, 5)
}

/// Returns the demand without its unit, which has a separate column.
fn limit(criterion: &CriterionReport) -> Markup {
    match (criterion.demand, criterion.good, criterion.bad) {
        (None, Some(good), Some(bad)) => html! { (number(bad)) small { "good: " (number(good)) } },
        (demand, _, _) => html! {
            @if criterion.at_least { "at least " }
            (number(demand.unwrap_or(f64::NAN)))
        },
    }
}

/// Returns the usage of a criterion in words. Criteria of data that are not calibration data are only reported.
fn usage_name(declared: Usage, effective: Usage) -> &'static str {
    match (declared, effective) {
        (Usage::Monitor, _) => "report only",
        (_, Usage::Monitor) => "report only: not calibration data",
        (Usage::Minimise, _) => "minimise",
        (Usage::Inequality, _) => "constraint",
        (Usage::Equality, _) => "equality",
    }
}

/// Returns the scaled value, with a bar from 0 to 2 that marks the demand.
fn scaled(criterion: &CriterionReport) -> Markup {
    let share = if criterion.scaled.is_nan() { 0.0 } else { 50.0 * criterion.scaled.clamp(0.0, 2.0) };
    html! {
        span class="scaled" {
            span class="number" { (scaled_number(criterion.scaled)) }
            span class={ "bar " (tone(criterion)) } aria-hidden="true" { span style={ "width:" (format!("{share:.1}")) "%" } {} }
        }
    }
}

fn met(criterion: &CriterionReport) -> Markup {
    match (criterion.scaled.is_nan(), criterion.met) {
        (_, None) => html! {},
        (true, _) => html! { span class="missed" { "no value" } },
        (_, Some(met)) => html! { span class=(tone(criterion)) { @if met { "met" } @else { "not met" } } },
    }
}

/// Formats a scaled value to four digits; rounding errors around 0 become 0.
fn scaled_number(scaled: f64) -> String {
    if scaled.abs() < 1e-9 { "0".to_owned() } else { significant(scaled, 4) }
}

/// Returns the CSS class of a criterion: a missed demand is an error only for a constraint.
fn tone(criterion: &CriterionReport) -> &'static str {
    match (criterion.met, criterion.usage) {
        (Some(true) | None, _) => "met",
        (_, Usage::Inequality | Usage::Equality) => "missed",
        _ => "above",
    }
}
