//! Identifiability of the tuners, or sensitivity of the criteria: sentences, standard errors, correlations, eigenvectors.

use maud::{Markup, html};
use mops_outcome::identification::{SensitivityReport, TunerSensitivity};

use super::page::{rich, scrolling};
use crate::numbers::{number, percent, significant};

/// Largest number of tuners with tables of correlations and directions.
const MOST_TUNERS: usize = 24;

/// Title of the section on the tuners of a calibration.
pub(super) const IDENTIFIABILITY: &str = "Identifiability";

/// Returns the title of the section.
pub(super) fn title(found: &SensitivityReport) -> &'static str {
    if found.of == "residuals" { IDENTIFIABILITY } else { "Sensitivity of the criteria" }
}

/// Returns sentences as a list, in their order.
pub(super) fn sentences<'a>(words: impl IntoIterator<Item = &'a String>) -> Markup {
    html! { ul class="findings" { @for text in words { li { (rich(text)) } } } }
}

/// Returns sentences and tables.
pub(super) fn section(found: &SensitivityReport) -> Markup {
    let measured = found.of == "residuals";
    html! {
        (sentences(&found.words))
        h3 { "Sensitivity to each tuner" }
        p {
            "Effect: root of the sum of squared derivatives of the "
            (if measured { "weighted residuals" } else { "scaled criteria" }) ", per relative change of the tuner. "
            @if measured {
                "Alone: standard error if all other tuners were known. Factor: increase of the standard error because they are "
                "not known. Relative error: share of the value; for initial states, which may be near zero, and for temperatures in degC or \
                 degF, share of the range."
            } @else {
                "Factor: effect divided by its part that the other tuners cannot compensate; 1 if they compensate nothing."
            }
        }
        (scrolling("Sensitivity to each tuner", accuracy(found, measured)))
        @if (2..=MOST_TUNERS).contains(&found.tuners.len()) {
            h3 { "Correlation of the estimates" }
            (scrolling("Correlation of the estimates", correlations(found)))
            h3 { "Directions" }
            p {
                "Eigenvectors of the sensitivity matrix by decreasing eigenvalue, for relative changes of the tuners (relative "
                "to the range for a value of 0). A joint change of the tuners along a direction with a small eigenvalue has "
                "little effect. Derivatives are "
                (if found.slopes == "tangents" { "exact (automatic differentiation)" } else { "central differences" })
                "; they resolve singular values down to " (number(found.zero)) " of the largest."
                @if measured {
                    " A direction is not determined if one standard error along it spans the whole range of a tuner."
                }
            }
            (scrolling("Directions", directions(found)))
        }
    }
}

fn accuracy(found: &SensitivityReport, measured: bool) -> Markup {
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
                        th scope="col" class="number" { "relative error" }
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

/// Returns the relative standard error, with its reference if that is the range.
pub(super) fn relative(tuner: &TunerSensitivity) -> Markup {
    html! {
        (known(tuner.relative_error, percent))
        @if tuner.relative_to == "range" && tuner.relative_error.is_finite() { small { "of the range" } }
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
                    th scope="col" class="number" { "/ largest" }
                    th scope="col" { "direction, relative changes" }
                    th scope="col" class="number" { "eigenvalue, own units" }
                    th scope="col" class="number" { "/ largest" }
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

/// Returns an eigenvector as a sum over the tuners; parts below `least` are omitted.
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
