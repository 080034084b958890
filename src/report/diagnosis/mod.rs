//! Report of a diagnosis: missing effects, errors before and after, evidence by place, candidate effects.

mod errors;
mod places;
mod ranking;
mod residuals;
mod spectrum;
#[cfg(test)]
mod tests;

use maud::{Markup, html};
use mops_outcome::diagnosis::{Diagnosis, Found, Verdict};

use super::figures::Group;
use super::page::{figures, rich, section};
use super::verdict::Tone;
use crate::diagnosis::words;
use crate::numbers::significant;

/// Plots of a diagnosis, in the order of the page.
pub(super) struct Plots {
    /// What is missing over the coordinate that it depends on.
    pub(super) missing: Vec<Group>,
    /// Residuals by experiment.
    pub(super) residuals: Vec<Group>,
    /// Unknown inputs by place.
    pub(super) places: Vec<Group>,
    /// Measurements and predictions by experiment.
    pub(super) predictions: Vec<Group>,
}

impl Plots {
    pub(super) fn of(diagnosis: &Diagnosis) -> Self {
        Self {
            missing: places::dependence(diagnosis).into_iter().collect(),
            residuals: residuals::groups(diagnosis),
            places: places::groups(diagnosis),
            predictions: residuals::predictions(diagnosis),
        }
    }

    pub(super) fn groups(&self) -> impl Iterator<Item = &Group> {
        self.missing.iter().chain(&self.residuals).chain(&self.places).chain(&self.predictions)
    }
}

/// Returns the verdict in words, with its tone.
pub(super) fn verdict(diagnosis: &Diagnosis) -> (Tone, String) {
    (if diagnosis.is_sure { Tone::Good } else { Tone::Mixed }, words::verdict(diagnosis))
}

/// Returns the facts below the verdict: name and value.
pub(super) fn facts(diagnosis: &Diagnosis) -> Vec<(String, String)> {
    let p_value = words::chance(diagnosis.p_value);
    let probability = (format!("Probability {}", words::of_what(diagnosis)), words::probability(diagnosis.probability));
    let probability = (!diagnosis.probability.is_nan()).then_some(probability);
    probability.into_iter().chain([("p-value if nothing is missing".to_owned(), p_value)]).collect()
}

/// Returns the sections of the page, the main findings first.
pub(super) fn sections(diagnosis: &Diagnosis, plots: &Plots) -> Markup {
    let groups = |groups: &[Group]| html! { @for group in groups { (figures(group)) } };
    html! {
        @if let Some(dependence) = &diagnosis.depends_on {
            (section("What is missing", html! {
                p {
                    "Without any formula, what the nominal model lacks depends on " (rich(&words::depends_on(dependence)))
                    ", with a gain in log-evidence of " (significant(dependence.gain, 3)) " nats."
                }
                (groups(&plots.missing))
            }))
        }
        @if diagnosis.changes_study() { (section(changes(diagnosis), missing(diagnosis))) }
        @if !diagnosis.before.is_empty() { (section(if diagnosis.verdict == Verdict::None { "Errors relative to the noise" } else { "Errors before and after" }, errors::table(diagnosis))) }
        @if !plots.residuals.is_empty() {
            (section("Residuals of the nominal model", html! {
                p { (residuals::WHITE_RESIDUALS) }
                (groups(&plots.residuals))
            }))
        }
        @if !diagnosis.evidence.is_empty() {
            (section("Evidence by place", html! {
                (places::table(diagnosis))
                (groups(&plots.places))
            }))
        }
        @if !diagnosis.ranked.is_empty() { (section("Candidate effects", ranking::table(diagnosis))) }
        @if !diagnosis.steps.is_empty() { (section("Steps of the search", ranking::steps(diagnosis))) }
        @if !diagnosis.parameters.is_empty() && diagnosis.verdict != Verdict::None {
            (section("Parameter shifts", ranking::parameters(diagnosis)))
        }
        @if !diagnosis.noticeable.is_empty() { (section("Detection limits", ranking::noticeable(diagnosis))) }
        @if let Some(next) = &diagnosis.next_experiment { (section("Next experiment", html! { p { (rich(next)) } })) }
        @if !plots.predictions.is_empty() { (section("Measured and predicted", groups(&plots.predictions))) }
        @if !diagnosis.notes.is_empty() {
            (section("Notes", html! { ul class="findings" { @for note in &diagnosis.notes { li { (rich(note)) } } } }))
        }
    }
}

/// Returns the title of the section on the changes of the study.
fn changes(diagnosis: &Diagnosis) -> &'static str {
    if diagnosis.found.is_empty() && diagnosis.removed.is_empty() { "Repaired study" } else { "Missing effects" }
}

/// Returns the added effects and the dropped terms.
fn missing(diagnosis: &Diagnosis) -> Markup {
    html! {
        @for found in &diagnosis.found { (effect(found)) }
        @for dropped in &diagnosis.removed {
            p { "The term " (rich(&words::term(dropped))) " of the nominal model is not needed and was dropped." }
        }
        p {
            "The recalibrated study is " code { "repaired.toml" } ", next to this page. Its predictions are in "
            "the folder " code { "predictions" } "."
        }
    }
}

fn effect(found: &Found) -> Markup {
    html! {
        div class="effect" {
            h3 { (found.effect) " " (rich(&words::at(&found.places()))) }
            @if let Some(companion) = found.companion.as_ref().filter(|_| found.places() == found.place) {
                p class="quiet" { "second place: " (rich(&words::at(companion))) }
            }
            p class="formula" { code { (found.formula) } }
            ul class="findings" {
                @for strength in &found.strengths {
                    li { (words::strength(strength)) @if strength.interval95.is_some() { span class="quiet" { ", 95 % interval" } } }
                }
                li {
                    (match words::status(found) { "claimed" => "Claimed", "given" => "Given by the study", _ => "Proposed, not claimed" })
                    @if found.class_probability.is_finite() {
                        ": probability of " (words::class(&found.class)) " here "
                        strong { (words::probability(found.class_probability)) }
                        @if found.probability.is_finite() { ", of this one " (words::probability(found.probability)) }
                    }
                    ". BIC lower by " (significant(found.bic_gain, 3)) "."
                }
                @for text in words::remarks(found) { li { (rich(&text)) } }
            }
        }
    }
}
