//! Table of the jumps of criteria near a design.

use maud::{Markup, html};
use mops_outcome::{JumpReport, JumpsReport, MovedKind};

use super::page::scrolling;
use crate::numbers::{apart, counted, percent, with_unit};

/// Returns the table of jumps, the nearest first; a sentence if there are none.
pub(super) fn section(found: &JumpsReport) -> Markup {
    let table = html! {
        table {
            thead {
                tr {
                    th scope="col" { "quantity" }
                    th scope="col" class="number" { "at the design" }
                    th scope="col" class="number" { "beyond the jump" }
                    th scope="col" class="number" { "distance" }
                    th scope="col" { "criterion" }
                    th scope="col" class="number" { "at the design" }
                    th scope="col" class="number" { "beyond the jump" }
                    th scope="col" { "demand" }
                }
            }
            tbody { @for jump in &found.found { (row(jump)) } }
        }
    };
    html! {
        p {
            "Quantities looked at: " (found.quantities) " of " (found.quantities + found.left_out.len()) ", with "
            (counted(found.evaluations, "evaluation")) ". Each continuous tuner was moved by 1 % of its range, each constant, inactive tuner "
            "and initial value by 1 % of itself (an initial value of 0: of the scale of its state, if it has one), and criteria that then "
            "rise by at least 2 % were followed back to where they jump."
            @if found.found.is_empty() && found.quantities > 0 { " No jump was found along them." }
            @if !found.left_out.is_empty() { " Not looked at, for the budget: " (found.left_out.join(", ")) "." }
            @if !found.discrete.is_empty() { " Not moved, as their values are discrete: " (found.discrete.join(", ")) "." }
        }
        @if !found.found.is_empty() { (scrolling("Jumps near the design", table)) }
    }
}

fn row(jump: &JumpReport) -> Markup {
    let unit = if jump.unit == "1" { String::new() } else { format!(" {}", jump.unit) };
    let quantity = |value: f64, other: f64| format!("{}{unit}", apart(value, Some(other), 5));
    let distance = if jump.distance <= mops_outcome::ON_JUMP { "none".to_owned() } else { percent(jump.distance) };
    html! {
        tr {
            th scope="row" { (jump.name) @if jump.kind == MovedKind::Initial { " (initial value)" } }
            td class="number" { (quantity(jump.value, jump.beyond)) }
            td class="number" { (quantity(jump.beyond, jump.value)) }
            td class="number" { (distance) }
            td { (jump.key) }
            td class="number" { (with_unit(jump.here, &jump.criterion_unit)) }
            td class="number" { (with_unit(jump.there, &jump.criterion_unit)) }
            td { @if jump.misses { "missed beyond" } }
        }
    }
}
