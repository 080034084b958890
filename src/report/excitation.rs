//! Persistent excitation of the inputs: sentences, a table, eigenvalues over the order; and regressions.

use maud::{Markup, html};
use mops_outcome::{
    ExcitationFindings,
    identification::{ExcitationReport, RegressionReport, excitation_words},
};

use super::figures::{Figure, Group};
use super::page::scrolling;
use super::plot::{Curve, CurveStyle, Level, Plot};
use super::sensitivity::sentences;
use crate::numbers::{number, percent, significant};

/// Returns the findings of the task `excitation`.
pub(super) fn section(found: &ExcitationFindings) -> Markup {
    html! {
        (sentences(found.inputs.iter().map(|input| &input.words)))
        (table(&found.inputs))
        @if !found.regressions.is_empty() {
            h3 { "Regressions" }
            (sentences(found.regressions.iter().map(|r| &r.words)))
            @for regression in &found.regressions { (scrolling(&regression.name, parameters(regression))) }
        }
    }
}

/// Returns the findings on the inputs of a calibration: sentences and a table.
pub(super) fn inputs(inputs: &[ExcitationReport]) -> Markup {
    html! {
        (sentences(excitation_words(inputs).iter()))
        (table(inputs))
    }
}

fn table(inputs: &[ExcitationReport]) -> Markup {
    html! {
        p {
            "An input that is persistently exciting of order n permits consistent estimates of n parameters of a linear model "
            "(impulse response, transfer function): the covariance matrix of n neighbouring samples is positive definite in the "
            "limit. For this model, the sensitivities show which tuners are determined. Initial states are not counted as "
            "parameters, as no input excites them. Transients are not counted as excitation. They may suffice in a short "
            "experiment; the standard errors show it."
        }
        (scrolling("Inputs", html! {
            table {
                thead {
                    tr {
                        th scope="col" { "case" }
                        th scope="col" { "input" }
                        th scope="col" class="number" { "order" }
                        th scope="col" class="number" { "parameters" }
                        th scope="col" { "sufficient for a linear model" }
                        th scope="col" class="number" { "smallest eigenvalue" }
                        th scope="col" class="number" { "next order" }
                        th scope="col" class="number" { "next order with transients" }
                        th scope="col" class="number" { "samples" }
                        th scope="col" class="number" { "sample time" }
                    }
                }
                tbody {
                    @for input in inputs {
                        tr {
                            th scope="row" { (input.case) }
                            td { (input.input) }
                            td class="number" { @if input.at_least { "at least " } strong { (input.order) } }
                            td class="number" { @if let Some(parameters) = input.parameters { (parameters) } }
                            td { @if input.suffices { span class="met" { "yes" } } @else { span class="above" { "no" } } }
                            td class="number" { (percent(input.eigenvalue)) }
                            td class="number" { @if let Some(next) = input.next_eigenvalue { (percent(next)) } }
                            td class="number" { @if let Some(share) = input.transient { (percent(share)) } }
                            td class="number" { (input.samples) }
                            td class="number" { (number(input.sample_time)) " s" }
                        }
                    }
                }
            }
        }))
    }
}

fn parameters(regression: &RegressionReport) -> Markup {
    html! {
        table {
            thead {
                tr {
                    th scope="col" { (regression.name) }
                    th scope="col" class="number" { "least squares" }
                    th scope="col" class="number" { "standard error" }
                    th scope="col" class="number" { "recursive, forgetting " (number(regression.forgetting)) }
                }
            }
            tbody {
                @for (name, value, error, recursive) in &regression.parameters {
                    tr {
                        th scope="row" { (name) }
                        td class="number" { strong { (number(*value)) } }
                        @if error.is_finite() { td class="number" { (significant(*error, 3)) } }
                        @else { td class="missed" { "not determined" } }
                        td class="number" { (number(*recursive)) }
                    }
                }
            }
        }
    }
}

/// Returns a plot for every input: smallest eigenvalue over the order.
pub(super) fn group(inputs: &[ExcitationReport]) -> Group {
    let figure = |input: &ExcitationReport| {
        let points = input.spectrum.iter().map(|&(n, share)| (n as f64, share.max(1e-16))).collect();
        let plot = Plot {
            title: format!("Excitation by {} in {}", input.input, input.case),
            x_label: "order".into(),
            y_label: "smallest eigenvalue / power".into(),
            log_y: true,
            curves: vec![Curve { name: "persistent".into(), points, style: CurveStyle::Dots, ..Curve::default() }],
            levels: vec![Level { name: "counts as zero".into(), value: input.zero }],
            ..Plot::default()
        };
        Figure { plots: vec![(format!("excitation-{}-{}", input.case, input.input), plot)], ..Figure::default() }
    };
    Group { figures: inputs.iter().map(figure).collect(), ..Group::default() }
}
