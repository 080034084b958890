//! Tables of candidate effects, steps of the search, parameter shifts and detection limits.

use maud::{Markup, html};
use mops_outcome::diagnosis::{Diagnosis, Ranked};

use super::super::page::scrolling;
use super::places::{bar, located};
use crate::diagnosis::words;
use crate::numbers::{number, percent, significant, with_unit};

/// Number of effects in the first table; a collapsed second table has the others.
const SHOWN: usize = 10;

/// Returns the ranking, with marks on indistinguishable effects.
pub(super) fn table(diagnosis: &Diagnosis) -> Markup {
    let (first, others) = diagnosis.ranked.split_at(SHOWN.min(diagnosis.ranked.len()));
    html! {
        p {
            "Candidate effects fitted at each place, together with those already accepted. Absorbed: the part of the effect's "
            "output signature that parameters and initial states can mimic. Without a probability: no set of effects with this "
            "candidate has more evidence than the nominal model and a better forecast."
        }
        (scrolling("Ranking", rows(diagnosis, first)))
        @if !others.is_empty() {
            details {
                summary { (others.len()) " more candidates" }
                (scrolling("Ranking, continued", rows(diagnosis, others)))
            }
        }
    }
}

fn rows(diagnosis: &Diagnosis, ranked: &[Ranked]) -> Markup {
    html! {
        table {
            thead {
                tr {
                    th scope="col" { "effect" }
                    th scope="col" { "place" }
                    th scope="col" { "probability" }
                    th scope="col" {}
                    th scope="col" class="number" { "BIC gain" }
                    th scope="col" { "parameters" }
                    th scope="col" class="number" { "error / noise" }
                    th scope="col" class="number" { "absorbed" }
                    th scope="col" { "result" }
                }
            }
            tbody {
                @for effect in ranked {
                    tr class=[mark(diagnosis, effect).map(|_| "marked")] {
                        th scope="row" { (effect.effect) small { (effect.class) } }
                        td { (effect.place) }
                        td { span class="scaled" { span class="number" { @if effect.probability.is_finite() { (words::probability(effect.probability)) } } (bar(effect.probability)) } }
                        td { @if let Some(mark) = mark(diagnosis, effect) { (mark) } }
                        td class="number" { @if effect.bic_gain.is_finite() { (significant(effect.bic_gain, 4)) } }
                        td { @for (i, strength) in effect.strengths.iter().enumerate() { @if i > 0 { br; } (words::strength(strength)) } }
                        td class="number" { @if effect.normalised.is_finite() { (words::times(effect.normalised)) } }
                        td class="number" { (words::share(effect.absorbed)) }
                        td { (effect.failed.map_or("claimed", words::failed)) }
                    }
                }
            }
        }
    }
}

/// Returns the relation of a candidate to the effects found.
fn mark(diagnosis: &Diagnosis, effect: &Ranked) -> Option<&'static str> {
    let is = |name: &str, place: &str| name == effect.effect && place == effect.place;
    if diagnosis.found.iter().any(|found| is(&found.effect, &found.place)) {
        return Some("added");
    }
    let mut rivals = diagnosis.found.iter().flat_map(|found| &found.indistinguishable);
    let rival = rivals.find(|rival| is(&rival.effect, &rival.place))?;
    Some(match rival.bic_behind {
        behind if behind <= -words::BARE_MENTION => "more likely",
        behind if behind < words::BARE_MENTION => "indistinguishable",
        _ => "not excluded",
    })
}

/// Returns the table of the models along the search.
pub(super) fn steps(diagnosis: &Diagnosis) -> Markup {
    let mut windows: Vec<usize> = diagnosis.steps.iter().map(|step| step.windows).collect();
    windows.dedup();
    html! {
        @if windows.len() > 1 {
            p class="quiet" {
                "Each window has its own initial states. Errors over more windows are therefore smaller, and not comparable with "
                "errors over whole records."
            }
        }
        table {
            thead { tr { th scope="col" { "step" } th scope="col" { "effects in the model" } th scope="col" class="number" { "error / noise" } } }
            tbody {
                @for step in &diagnosis.steps {
                    tr {
                        th scope="row" { (step.did.name()) }
                        td { (step.effects.join(", ")) }
                        td class="number" { (words::times(step.normalised)) @if step.windows > 1 { " in " (step.windows) " windows" } }
                    }
                }
            }
        }
    }
}

/// Returns the table of parameter shifts.
pub(super) fn parameters(diagnosis: &Diagnosis) -> Markup {
    let rows = html! {
        table {
            thead {
                tr {
                    th scope="col" { "parameter" }
                    th scope="col" class="number" { "nominal model" }
                    th scope="col" class="number" { "recalibrated model" }
                    th scope="col" class="number" { "95 % interval" }
                    th scope="col" { "unit" }
                    th scope="col" class="number" { "change" }
                    th scope="col" class="number" { "change / standard error" }
                }
            }
            tbody {
                @for p in &diagnosis.parameters {
                    tr {
                        th scope="row" { (p.name) }
                        td class="number" { (number(p.before)) }
                        td class="number" { strong { (number(p.after)) } }
                        td class="number" { @if let Some([low, high]) = p.interval95 { (significant(low, 4)) " to " (significant(high, 4)) } @else { "not determined" } }
                        td { (p.unit) }
                        td class="number" { @if p.before != 0.0 { (percent(p.after / p.before - 1.0)) } }
                        td class="number" { @if let Some(error) = p.std_error { (significant((p.after - p.before) / error, 2)) } }
                    }
                }
            }
        }
    };
    html! {
        p { "The shift is the bias that the missing effect had caused." }
        (scrolling("Parameters", rows))
    }
}

/// Returns the table of detection limits.
pub(super) fn noticeable(diagnosis: &Diagnosis) -> Markup {
    let rows = html! {
        table {
            thead {
                tr {
                    th scope="col" { "effect" }
                    th scope="col" { "place" }
                    th scope="col" class="number" { "detection limit" }
                }
            }
            tbody {
                @for effect in &diagnosis.noticeable {
                    tr {
                        th scope="row" { (effect.effect) }
                        td { (located(&effect.place)) }
                        td class="number" { (effect.strength.name) " = " (with_unit(effect.strength.value, &effect.strength.unit)) }
                    }
                }
            }
        }
    };
    html! {
        p { "Smallest parameter of each effect that would have been detected. A smaller effect may be present." }
        (scrolling("Detection limits", rows))
    }
}
