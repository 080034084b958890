//! The report of a diagnosis: what is missing, what adding it changes, where it comes from, what else it could be.

mod errors;
mod places;
mod ranking;
mod residuals;
mod spectrum;
#[cfg(test)]
mod tests;

use maud::{Markup, html};
use mops_discrepancy::{Diagnosis, Found, Verdict};

use super::figures::Group;
use super::page::{figures, rich, section};
use super::verdict::Tone;
use crate::diagnosis::words;
use crate::numbers::significant;

/// The plots of a diagnosis, in the order of the page.
pub(super) struct Plots {
    /// Residuals, by experiment.
    pub(super) residuals: Vec<Group>,
    /// What would explain them, by place.
    pub(super) places: Vec<Group>,
    /// Measurements and predictions, by experiment.
    pub(super) predictions: Vec<Group>,
}

impl Plots {
    pub(super) fn of(diagnosis: &Diagnosis) -> Self {
        Self {
            residuals: residuals::groups(diagnosis),
            places: places::groups(diagnosis),
            predictions: residuals::predictions(diagnosis),
        }
    }

    pub(super) fn groups(&self) -> impl Iterator<Item = &Group> {
        self.residuals.iter().chain(&self.places).chain(&self.predictions)
    }
}

/// The verdict, and how good it is.
pub(super) fn verdict(diagnosis: &Diagnosis) -> (Tone, String) {
    let tone = if diagnosis.verdict == Verdict::Unexplained { Tone::Mixed } else { Tone::Good };
    (tone, words::verdict(diagnosis))
}

/// Facts below the verdict: name and value.
pub(super) fn facts(diagnosis: &Diagnosis) -> [(String, String); 2] {
    let chance = match diagnosis.p_value {
        p if p.is_finite() && p < 1e-6 => "below 1e-6".to_owned(),
        p => significant(p, 2),
    };
    [
        (format!("Probability {}", words::of_what(diagnosis)), words::probability(diagnosis.probability)),
        ("p-value: nothing missing".to_owned(), chance),
    ]
}

/// The sections of the page, in the order in which they convince.
pub(super) fn sections(diagnosis: &Diagnosis, plots: &Plots) -> Markup {
    let groups = |groups: &[Group]| html! { @for group in groups { (figures(group)) } };
    html! {
        @if !diagnosis.found.is_empty() || !diagnosis.removed.is_empty() { (section("What is missing", missing(diagnosis))) }
        @if !diagnosis.before.is_empty() { (section(if diagnosis.verdict == Verdict::None { "Error beside the noise" } else { "Before and after" }, errors::table(diagnosis))) }
        @if !plots.residuals.is_empty() {
            (section("What the declared model leaves", html! {
                p { (residuals::EXPLAINED) }
                (groups(&plots.residuals))
            }))
        }
        @if !diagnosis.evidence.is_empty() {
            (section("Where it comes from", html! {
                (places::table(diagnosis))
                (groups(&plots.places))
            }))
        }
        @if !diagnosis.ranked.is_empty() { (section("What it could be", ranking::table(diagnosis))) }
        @if !diagnosis.steps.is_empty() { (section("How it was found", ranking::steps(diagnosis))) }
        @if !diagnosis.parameters.is_empty() && diagnosis.verdict != Verdict::None {
            (section("How the parameters moved", ranking::parameters(diagnosis)))
        }
        @if !diagnosis.noticeable.is_empty() { (section("What would have been noticed", ranking::noticeable(diagnosis))) }
        @if let Some(next) = &diagnosis.next_experiment { (section("What to measure next", html! { p { (rich(next)) } })) }
        @if !plots.predictions.is_empty() { (section("Measured and predicted", groups(&plots.predictions))) }
        @if !diagnosis.notes.is_empty() {
            (section("Notes", html! { ul class="findings" { @for note in &diagnosis.notes { li { (rich(note)) } } } }))
        }
    }
}

/// The effects that were added, and the terms that were taken away.
fn missing(diagnosis: &Diagnosis) -> Markup {
    html! {
        @for found in &diagnosis.found { (effect(found)) }
        @for removed in &diagnosis.removed {
            p { "The declared term " (rich(&words::term(removed))) " is not needed, and was taken away." }
        }
        p { "The repaired study stands in " code { "repaired.toml" } " beside this page and runs by itself; what it predicts, in " code { "predictions" } "." }
    }
}

fn effect(found: &Found) -> Markup {
    html! {
        div class="effect" {
            h3 { (found.effect) " " (rich(&words::at(&found.place))) }
            @if let Some(companion) = &found.companion { p class="quiet" { "from " (rich(&words::at(companion))) } }
            p class="formula" { code { (found.formula) } }
            ul class="findings" {
                @for strength in &found.strengths {
                    li { (words::strength(strength)) @if strength.interval95.is_some() { span class="quiet" { ", 95 % interval" } } }
                }
                li { "Probability " strong { (words::probability(found.probability)) } ", " (found.class) ", BIC lower by " (significant(found.bic_gain, 3)) "." }
                @for text in words::remarks(found) { li { (rich(&text)) } }
            }
        }
    }
}
