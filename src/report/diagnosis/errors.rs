//! Table of errors before and after, with bars in units of the noise level.

use maud::{Markup, html};
use mops_outcome::diagnosis::Diagnosis;

use super::super::page::scrolling;
use crate::diagnosis::errors::lines;
use crate::diagnosis::words::times;
use crate::numbers::{number, significant};

/// Returns the table over all experiments and channels.
pub(super) fn table(diagnosis: &Diagnosis) -> Markup {
    let lines = lines(diagnosis);
    let same = lines.iter().all(|line| line.scaled[0].to_bits() == line.scaled[1].to_bits());
    let largest = lines.iter().flat_map(|line| line.scaled).filter(|v| v.is_finite()).fold(1.5, f64::max);
    let rows = html! {
        table class="errors" {
            thead {
                tr {
                    th scope="col" { "experiment" }
                    th scope="col" { "channel" }
                    @if same {
                        th scope="col" class="number" { "error / noise" }
                        th scope="col" {}
                        th scope="col" class="number" { "RMS" }
                    } @else {
                        th scope="col" class="number" { "before" }
                        th scope="col" class="number" { "after" }
                        th scope="col" { "error / noise" }
                        th scope="col" class="number" { "RMS before" }
                        th scope="col" class="number" { "RMS after" }
                    }
                    th scope="col" class="number" { "noise" }
                    th scope="col" { "unit" }
                }
            }
            tbody {
                @for line in &lines {
                    tr {
                        th scope="row" { (line.experiment.name) small { (line.experiment.role.name()) } }
                        td { @if line.channel.is_some() { (line.label()) } @else { strong { (line.label()) } } }
                        @if !same { td class="number" { (times(line.scaled[0])) } }
                        td class="number" { strong { (times(line.scaled[1])) } }
                        td { (bars(line.scaled, largest, same)) }
                        @if line.channel.is_some() {
                            @if !same { td class="number" { (significant(line.raw[0], 3)) } }
                            td class="number" { (significant(line.raw[1], 3)) }
                            td class="number" { @if line.noise.is_finite() { (number(line.noise)) } @else { "not known" } }
                            td { (line.unit) }
                        } @else {
                            td colspan=(if same { 3 } else { 4 }) {}
                        }
                    }
                }
            }
        }
    };
    html! {
        p {
            "Root mean square of measured - predicted, in units of the noise level"
            @if !same {
                ": " span class="swatch before" {} " nominal model, " span class="swatch after" {} " recalibrated model"
            }
            ". The line at 1 is the noise level, the best achievable."
        }
        (scrolling("Errors before and after", rows))
    }
}

/// Returns the bars of the errors before and after, one bar if they are equal, and a mark at the noise level.
fn bars(scaled: [f64; 2], largest: f64, same: bool) -> Markup {
    let width =
        |value: f64| format!("width:{:.1}%", if value.is_finite() { 100.0 * (value / largest).min(1.0) } else { 0.0 });
    html! {
        span class="pair" aria-hidden="true" {
            @if !same { span class="before" style=(width(scaled[0])) {} }
            span class="after" style=(width(scaled[1])) {}
            span class="floor" style=(format!("left:{:.1}%", 100.0 / largest)) {}
        }
    }
}
