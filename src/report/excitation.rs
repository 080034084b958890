//! How rich the inputs are: sentences, a table, the eigenvalues over the order; and regressions.

use maud::{Markup, html};
use mops_core::ExcitationFindings;
use mops_core::identification::{ExcitationReport, RegressionReport};

use super::figures::{Figure, Group};
use super::page::scrolling;
use super::plot::{Curve, CurveStyle, Level, Plot};
use super::sensitivity::sentences;
use crate::numbers::{number, percent, significant};

/// The findings of the task.
pub(super) fn section(found: &ExcitationFindings) -> Markup {
    html! {
        (inputs(&found.inputs))
        @if !found.regressions.is_empty() {
            h3 { "Regressions" }
            (sentences(found.regressions.iter().map(|r| &r.words)))
            @for regression in &found.regressions { (scrolling(&regression.name, parameters(regression))) }
        }
    }
}

/// The inputs, in sentences and numbers.
pub(super) fn inputs(inputs: &[ExcitationReport]) -> Markup {
    html! {
        (sentences(inputs.iter().map(|input| &input.words)))
        p {
            "Order n says that n parameters of a linear model (impulse response, transfer function) can be estimated "
            "consistently: the covariances of n neighbouring samples are positive definite in the long run. It is a theorem "
            "on linear models; whether the tuners of this one are determined is told by the sensitivities. Start values are "
            "not counted among the parameters: no input excites them. A finite record leaves traces of what happened only "
            "once; they are not counted. Yet a transient may well do for a short experiment: what it is worth is told by "
            "the standard errors."
        }
        (scrolling("Inputs", html! {
            table {
                thead {
                    tr {
                        th scope="col" { "case" }
                        th scope="col" { "input" }
                        th scope="col" class="number" { "order" }
                        th scope="col" class="number" { "parameters" }
                        th scope="col" { "suffices, if linear" }
                        th scope="col" class="number" { "weakest direction" }
                        th scope="col" class="number" { "next order" }
                        th scope="col" class="number" { "with transients" }
                        th scope="col" class="number" { "samples" }
                        th scope="col" class="number" { "every" }
                    }
                }
                tbody {
                    @for input in inputs {
                        tr {
                            th scope="row" { (input.case) }
                            td { (input.input) }
                            td class="number" { @if input.at_least { "at least " } strong { (input.order) } }
                            td class="number" { @if let Some(parameters) = input.parameters { (parameters) } }
                            td { @if input.suffices { span class="met" { "yes" } } @else { span class="above" { "in the long run, no" } } }
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

/// The eigenvalues over the order, a plot for every input.
pub(super) fn group(inputs: &[ExcitationReport]) -> Group {
    let figure = |input: &ExcitationReport| {
        let points = input.spectrum.iter().map(|&(n, share)| (n as f64, share.max(1e-16))).collect();
        let plot = Plot {
            title: format!("Excitation by {} in {}", input.input, input.case),
            x_label: "order".into(),
            y_label: "smallest eigenvalue / power".into(),
            log_y: true,
            curves: vec![Curve { name: "persisting".into(), points, style: CurveStyle::Dots, ..Curve::default() }],
            levels: vec![Level { name: "zero".into(), value: input.zero }],
            ..Plot::default()
        };
        Figure { plots: vec![(format!("excitation-{}-{}", input.case, input.input), plot)], caption: Vec::new() }
    };
    Group { figures: inputs.iter().map(figure).collect(), ..Group::default() }
}
