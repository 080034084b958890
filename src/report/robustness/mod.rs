//! Results for uncertain parameters: sentences, tables, plots.

mod distributions;
mod effects;
mod rounds;
mod worst;

use maud::{Markup, html};
use mops_outcome::{Outcome, robustness::UncertainReport};

use super::Report;
use super::figures::Group;
use super::page::scrolling;
use super::verdict::Tone;
use crate::numbers::{counted, number, significant};

/// Section of the page: title, content and plots.
pub(super) struct Section {
    pub(super) title: &'static str,
    pub(super) content: Markup,
    pub(super) group: Group,
}

/// Returns the sections of all results for uncertain parameters.
pub(super) fn sections(report: &Report<'_>) -> Vec<Section> {
    let found = &report.outcome.found;
    let robust = found.robust.as_ref().map(rounds::section);
    let worst = found.worst_case.as_ref().map(|found| worst::section(report, found));
    let drawn = found.monte_carlo.as_ref().map(distributions::section);
    let effects = found.global_sensitivity.as_ref().map(effects::section);
    [robust, worst, drawn, effects].into_iter().flatten().collect()
}

/// Returns the verdict in words, with its tone; `None` without results for uncertain parameters.
pub(super) fn verdict(outcome: &Outcome) -> Option<(Tone, String)> {
    let found = &outcome.found;
    if let Some(found) = &found.robust {
        let round = found.rounds.get(found.chosen)?;
        let violated = round.violation_found > found.tolerance;
        let tone = match (violated, found.settled && found.criteria.iter().all(|worst| worst.met)) {
            (true, _) => Tone::Bad,
            (false, true) => Tone::Good,
            (false, false) => Tone::Mixed,
        };
        return Some((tone, found.words.iter().take(2).cloned().collect::<Vec<_>>().join(" ")));
    }
    if let Some(found) = &found.worst_case {
        if found.criteria.is_empty() {
            return Some((Tone::Bad, found.words.join(" ")));
        }
        let demanded = found.criteria.iter().filter(|c| c.of.demand.is_some());
        let tone = if demanded.clone().all(|c| c.met) && found.criteria.iter().all(|c| c.failed == 0) {
            Tone::Good
        } else {
            Tone::Mixed
        };
        let worst = demanded.filter(|c| !c.met).max_by(|a, b| a.scaled.total_cmp(&b.scaled));
        let words = worst.map(|worst| {
            let missed = significant(worst.scaled, 4);
            format!(
                "Demand missed in the box: `{}` in case `{}` has the worst scaled value {missed}.",
                worst.of.criterion, worst.of.case
            )
        });
        let failed: usize = found.criteria.iter().map(|c| c.failed).sum();
        let met = match failed {
            0 => "All demands are met at every evaluated point of the box.".to_owned(),
            _ => format!(
                "{} in the box failed; all demands are met at the other evaluated points.",
                counted(failed, "simulation")
            ),
        };
        return Some((tone, words.unwrap_or(met)));
    }
    if let Some(found) = &found.monte_carlo {
        let missed = match &found.all {
            Some(all) => all.count < all.of,
            None => found.criteria.iter().flat_map(|of| &of.met).any(|met| met.count < met.of),
        };
        let tone = if missed { Tone::Mixed } else { Tone::Good };
        return Some((tone, found.words.first().cloned()?));
    }
    let found = found.global_sensitivity.as_ref()?;
    Some((Tone::Good, found.words.first().cloned()?))
}

/// Returns the table of uncertain parameters.
fn parameters(list: &[UncertainReport]) -> Markup {
    let bound = |value: f64| if value.is_finite() { number(value) } else { String::new() };
    scrolling(
        "Uncertain parameters",
        html! {
            table {
                thead {
                    tr {
                        th scope="col" { "uncertain parameter" }
                        th scope="col" class="number" { "nominal" }
                        th scope="col" class="number" { "from" }
                        th scope="col" class="number" { "to" }
                        th scope="col" { "unit" }
                        th scope="col" { "distribution" }
                    }
                }
                tbody {
                    @for one in list {
                        tr {
                            th scope="row" { (one.name) }
                            td class="number" { (number(one.nominal)) }
                            td class="number" { (bound(one.bounds[0])) }
                            td class="number" { (bound(one.bounds[1])) }
                            td { (one.unit) }
                            td { (one.distribution) }
                        }
                    }
                }
            }
        },
    )
}
