//! What it could be: every effect that was tried; what the data cannot tell apart; parameters; what would have been noticed.

use maud::{Markup, html};
use mops_discrepancy::{Diagnosis, Ranked};

use super::super::page::scrolling;
use super::places::{bar, named};
use crate::diagnosis::words;
use crate::numbers::{number, percent, significant, with_unit};

/// Effects in the table; the others stand below it, to be opened.
const SHOWN: usize = 10;

/// The ranking, with what cannot be told apart marked.
pub(super) fn table(diagnosis: &Diagnosis) -> Markup {
    let (first, others) = diagnosis.ranked.split_at(SHOWN.min(diagnosis.ranked.len()));
    html! {
        p {
            "The effects that were fitted at places of the model, each beside those that were in by then. Absorbed is the share of "
            "its trace in the outputs that parameters and start values can take over. Strengths here are from all data that choose "
            "between effects; those of what was found, above, from calibration data alone."
        }
        (scrolling("Ranking", rows(diagnosis, first)))
        @if !others.is_empty() {
            details {
                summary { (others.len()) " more that were tried" }
                (scrolling("Ranking, the others", rows(diagnosis, others)))
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
                    th scope="col" { "strengths" }
                    th scope="col" class="number" { "error / noise" }
                    th scope="col" class="number" { "absorbed" }
                }
            }
            tbody {
                @for effect in ranked {
                    tr class=[mark(diagnosis, effect).map(|_| "marked")] {
                        th scope="row" { (effect.effect) small { (effect.class) } }
                        td { (effect.place) }
                        td { span class="scaled" { span class="number" { (words::probability(effect.probability)) } (bar(effect.probability)) } }
                        td { @if let Some(mark) = mark(diagnosis, effect) { (mark) } }
                        td class="number" { @if effect.bic_gain.is_finite() { (significant(effect.bic_gain, 4)) } }
                        td { @for (i, strength) in effect.strengths.iter().enumerate() { @if i > 0 { br; } (words::strength(strength)) } }
                        td class="number" { @if effect.normalised.is_finite() { (words::times(effect.normalised)) } }
                        td class="number" { (words::share(effect.absorbed)) }
                    }
                }
            }
        }
    }
}

/// How an effect stands to those found.
fn mark(diagnosis: &Diagnosis, effect: &Ranked) -> Option<&'static str> {
    let is = |name: &str, place: &str| name == effect.effect && place == effect.place;
    if diagnosis.found.iter().any(|found| is(&found.effect, &found.place)) {
        return Some("added");
    }
    let mut rivals = diagnosis.found.iter().flat_map(|found| &found.indistinguishable);
    let rival = rivals.find(|rival| is(&rival.effect, &rival.place))?;
    Some(match rival.bic_behind {
        behind if behind <= -words::BARE_MENTION => "likelier",
        behind if behind < words::BARE_MENTION => "cannot be told apart",
        _ => "not excluded",
    })
}

/// The models that the search passed through.
pub(super) fn steps(diagnosis: &Diagnosis) -> Markup {
    let mut windows: Vec<usize> = diagnosis.steps.iter().map(|step| step.windows).collect();
    windows.dedup();
    html! {
        @if windows.len() > 1 {
            p class="quiet" { "Windows have start values of their own: errors in more of them are smaller, and not to be compared with those of whole records." }
        }
        table {
            thead { tr { th scope="col" { "step" } th scope="col" { "effects in the model" } th scope="col" class="number" { "error, times the noise" } } }
            tbody {
                @for step in &diagnosis.steps {
                    tr {
                        th scope="row" { (step.did) }
                        td { (step.effects.join(", ")) }
                        td class="number" { (words::times(step.normalised)) @if step.windows > 1 { " in " (step.windows) " windows" } }
                    }
                }
            }
        }
    }
}

/// What the parameters had absorbed.
pub(super) fn parameters(diagnosis: &Diagnosis) -> Markup {
    let rows = html! {
        table {
            thead {
                tr {
                    th scope="col" { "parameter" }
                    th scope="col" class="number" { "declared model" }
                    th scope="col" class="number" { "repaired model" }
                    th scope="col" class="number" { "standard error" }
                    th scope="col" { "unit" }
                    th scope="col" class="number" { "change" }
                    th scope="col" class="number" { "in standard errors" }
                }
            }
            tbody {
                @for p in &diagnosis.parameters {
                    tr {
                        th scope="row" { (p.name) }
                        td class="number" { (number(p.before)) }
                        td class="number" { strong { (number(p.after)) } }
                        td class="number" { @if let Some(error) = p.std_error { (significant(error, 3)) } @else { "not determined" } }
                        td { (p.unit) }
                        td class="number" { @if p.before != 0.0 { (percent(p.after / p.before - 1.0)) } }
                        td class="number" { @if let Some(error) = p.std_error { (significant((p.after - p.before) / error, 2)) } }
                    }
                }
            }
        }
    };
    html! {
        p { "What a parameter moved by is what it had taken over of the missing effect." }
        (scrolling("Parameters", rows))
    }
}

/// The smallest strengths that would have been noticed.
pub(super) fn noticeable(diagnosis: &Diagnosis) -> Markup {
    let rows = html! {
        table {
            thead {
                tr {
                    th scope="col" { "effect" }
                    th scope="col" { "place" }
                    th scope="col" class="number" { "noticed from" }
                }
            }
            tbody {
                @for effect in &diagnosis.noticeable {
                    tr {
                        th scope="row" { (effect.effect) }
                        td { (named(&effect.place)) }
                        td class="number" { (effect.strength.name) " = " (with_unit(effect.strength.value, &effect.strength.unit)) }
                    }
                }
            }
        }
    };
    html! {
        p { "A verdict of nothing is worth what it would have taken to change it: a weaker effect may be there." }
        (scrolling("Noticeable strengths", rows))
    }
}
