//! What the data, or the criteria, tell of the tuners: sentences, trust, correlations, eigenvectors.

use maud::{Markup, html};
use mops_core::identification::{SensitivityReport, TunerSensitivity};

use super::page::{rich, scrolling};
use crate::numbers::{number, percent, significant};

/// More tuners than this make tables that nobody reads.
const MOST_TUNERS: usize = 24;

/// The title of the section.
pub(super) fn title(found: &SensitivityReport) -> &'static str {
    if found.of == "residuals" { "What the data can tell" } else { "What the criteria can tell" }
}

/// Sentences in their order.
pub(super) fn sentences<'a>(words: impl IntoIterator<Item = &'a String>) -> Markup {
    html! { ul class="findings" { @for text in words { li { (rich(text)) } } } }
}

/// All that was found.
pub(super) fn section(found: &SensitivityReport) -> Markup {
    let measured = found.of == "residuals";
    html! {
        (sentences(&found.words))
        h3 { "Which tuners can be trusted" }
        p {
            "The effect is the change of the " (if measured { "weighted residuals" } else { "scaled criteria" })
            ", root of their sum of squares, for a change of the tuner by its own value. "
            @if measured {
                "Alone is the standard error if all other tuners were known; the factor is what not knowing them costs. Relative "
                "errors are shares of the value; of start values, which may well be near zero, shares of the range."
            } @else {
                "The factor is how much of that effect the other tuners can undo: 1 is none."
            }
        }
        (scrolling("Which tuners can be trusted", trust(found, measured)))
        @if (2..=MOST_TUNERS).contains(&found.tuners.len()) {
            h3 { "Correlation of the estimates" }
            (scrolling("Correlation of the estimates", correlations(found)))
            h3 { "Directions" }
            p {
                "Eigenvectors of the sensitivity matrix, strongest first, in shares of the tuners' values (of the "
                "range, where a value is 0). Along a direction with "
                "a small eigenvalue the tuners may move together and hardly change anything. Slopes are "
                (if found.slopes == "tangents" { "exact (tangents of the simulation)" } else { "central differences" })
                "; they do not resolve singular values below " (number(found.zero)) " of the largest."
                @if measured {
                    " A direction along which one standard error moves a tuner through its whole range is not determined."
                }
            }
            (scrolling("Directions", directions(found)))
        }
    }
}

fn trust(found: &SensitivityReport, measured: bool) -> Markup {
    html! {
        table {
            thead {
                tr {
                    th scope="col" { "tuner" }
                    th scope="col" class="number" { "value" }
                    th scope="col" { "unit" }
                    th scope="col" class="number" { "effect" }
                    @if measured {
                        th scope="col" class="number" { "standard error" }
                        th scope="col" class="number" { "alone" }
                        th scope="col" class="number" { "relative" }
                    }
                    th scope="col" class="number" { "factor" }
                    th scope="col" { "" }
                }
            }
            tbody {
                @for tuner in &found.tuners {
                    tr {
                        th scope="row" { (tuner.name) }
                        td class="number" { (number(tuner.value)) }
                        td { (tuner.unit) }
                        td class="number" { (significant(tuner.effect, 3)) }
                        @if measured {
                            td class="number" { (known(tuner.std_error, |v| significant(v, 3))) }
                            td class="number" { (known(tuner.std_error_alone, |v| significant(v, 3))) }
                            td class="number" { (relative(tuner)) }
                        }
                        td class="number" { (known(tuner.inflation, |v| significant(v, 3))) }
                        td { (verdict(tuner, measured)) }
                    }
                }
            }
        }
    }
}

/// The standard error as a share, with what it is a share of where that is not the value.
pub(super) fn relative(tuner: &TunerSensitivity) -> Markup {
    html! {
        (known(tuner.relative_error, percent))
        @if tuner.relative_to == "range" && tuner.relative_error.is_finite() { small { "of its range" } }
    }
}

fn known(value: f64, text: impl Fn(f64) -> String) -> String {
    if value.is_finite() { text(value) } else { String::new() }
}

fn verdict(tuner: &TunerSensitivity, measured: bool) -> Markup {
    match tuner.trust {
        "undetermined" => html! { span class="missed" { "not determined" } },
        _ if !measured => html! {},
        "weak" if tuner.relative_error > 1.0 => html! { span class="missed" { "practically not identifiable" } },
        "weak" => html! { span class="above" { "uncertain" } },
        _ if tuner.std_error.is_finite() => html! { span class="met" { "determined" } },
        _ => html! {},
    }
}

fn correlations(found: &SensitivityReport) -> Markup {
    html! {
        table {
            thead { tr { th {} @for tuner in &found.tuners { th scope="col" class="number" { (tuner.name) } } } }
            tbody {
                @for (i, (tuner, row)) in found.tuners.iter().zip(&found.correlations).enumerate() {
                    tr {
                        th scope="row" { (tuner.name) }
                        @for (j, value) in row.iter().enumerate() {
                            td class={ "number" @if i != j && value.abs() > 0.95 { " above" } @else if i == j { " quiet" } } {
                                @if value.is_finite() { (format!("{value:.2}")) }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn directions(found: &SensitivityReport) -> Markup {
    let largest = found.relative.eigenvalues.first().copied().unwrap_or(1.0);
    let own_largest = found.eigenvalues.first().copied().unwrap_or(1.0);
    let rows = found.relative.eigenvalues.iter().zip(&found.relative.eigenvectors);
    let own = found.eigenvalues.iter().zip(&found.eigenvectors);
    html! {
        table {
            thead {
                tr {
                    th scope="col" class="number" { "eigenvalue" }
                    th scope="col" class="number" { "of the largest" }
                    th scope="col" { "direction, relative" }
                    th scope="col" class="number" { "in own units" }
                    th scope="col" class="number" { "of the largest" }
                    th scope="col" { "direction, own units" }
                }
            }
            tbody {
                @for ((value, vector), (own_value, own_vector)) in rows.zip(own) {
                    tr {
                        td class="number" { (significant(*value, 4)) }
                        td class="number" { (significant(value / largest, 2)) }
                        td { (rich(&combination(found, vector, 0.01))) }
                        td class="number" { (significant(*own_value, 4)) }
                        td class="number" { (significant(own_value / own_largest, 2)) }
                        td { (rich(&combination(found, own_vector, 0.01))) }
                    }
                }
            }
        }
    }
}

/// An eigenvector as a sum; parts below `least` are left out.
pub(crate) fn combination(found: &SensitivityReport, vector: &[f64], least: f64) -> String {
    let mut text = String::new();
    for (tuner, part) in found.tuners.iter().zip(vector).filter(|(_, part)| part.abs() >= least) {
        let sign = match (text.is_empty(), *part < 0.0) {
            (true, true) => "-",
            (true, false) => "",
            (false, true) => " - ",
            (false, false) => " + ",
        };
        text += &format!("{sign}{} `{}`", significant(part.abs(), 3), tuner.name);
    }
    text
}
