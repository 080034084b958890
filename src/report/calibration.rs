//! Tables of a calibration: estimates with their errors, and the fit of every channel.

use maud::{Markup, html};
use mops_outcome::{CalibrationReport, ChannelReport, FailureReport, ParameterReport};

use super::page::scrolling;
use super::sensitivity;
use crate::numbers::{number, percent, significant};

/// Returns the tables of parameters and of experiments.
pub(super) fn section(calibration: &CalibrationReport) -> Markup {
    html! {
        @if !calibration.parameters.is_empty() {
            h3 { "Parameters" }
            p {
                "Standard errors are first-order sandwich estimates, valid for any weights and numbers of samples. Intervals use "
                "Student's t distribution. If residuals are correlated or the model is wrong, their coverage is below 95 %."
            }
            (scrolling("Parameters", parameters(calibration)))
        }
        @if !calibration.experiments.is_empty() {
            h3 { "Experiments" }
            p {
                "RMSE is the root mean square of measured - simulated. RMSE / noise = 1 is the noise level, the best achievable. "
                "A fit of 100 % is exact, a fit of 0 % is no better than the mean."
            }
            (scrolling("Experiments", experiments(calibration)))
        }
    }
}

fn parameters(calibration: &CalibrationReport) -> Markup {
    let sensitivities = calibration.sensitivity.iter().flat_map(|found| &found.tuners);
    let of_parameter = |parameter: &ParameterReport| sensitivities.clone().find(|tuner| tuner.name == parameter.name);
    let relative = |parameter: &ParameterReport| match of_parameter(parameter) {
        Some(tuner) => sensitivity::relative(tuner),
        None => html! { (percent((parameter.std_error / parameter.value).abs())) },
    };
    html! {
        table {
            thead {
                tr {
                    th scope="col" { "parameter" }
                    th scope="col" class="number" { "estimate" }
                    th scope="col" class="number" { "standard error" }
                    th scope="col" class="number" { "relative error" }
                    th scope="col" class="number" { "95 % from" }
                    th scope="col" class="number" { "to" }
                    th scope="col" { "unit" }
                }
            }
            tbody {
                @for parameter in &calibration.parameters {
                    @let known = parameter.std_error.is_finite();
                    tr {
                        th scope="row" { (parameter.name) }
                        td class="number" { strong { (number(parameter.value)) } }
                        @if known {
                            td class="number" { (significant(parameter.std_error, 3)) }
                            td class="number" { (relative(parameter)) }
                            td class="number" { (number(parameter.interval95[0])) }
                            td class="number" { (number(parameter.interval95[1])) }
                        } @else {
                            td colspan="4" class="missed" { "not identifiable from the data" }
                        }
                        td { (parameter.unit) }
                    }
                }
            }
        }
    }
}

fn experiments(calibration: &CalibrationReport) -> Markup {
    html! {
        table {
            thead {
                tr {
                    th scope="col" { "experiment" }
                    th scope="col" { "role" }
                    th scope="col" { "channel" }
                    th scope="col" class="number" { "RMSE" }
                    th scope="col" class="number" { "noise" }
                    th scope="col" { "unit" }
                    th scope="col" class="number" { "RMSE / noise" }
                    th scope="col" class="number" { "fit" }
                }
            }
            tbody {
                @for experiment in &calibration.experiments {
                    @for channel in &experiment.channels {
                        tr {
                            th scope="row" { (experiment.name) }
                            td { (experiment.role.name()) }
                            (channel_cells(channel))
                        }
                    }
                }
            }
        }
    }
}

fn channel_cells(channel: &ChannelReport) -> Markup {
    html! {
        td { (channel.name) }
        td class="number" { (number(channel.rmse)) }
        td class="number" { @if let Some(noise) = channel.noise { (number(noise)) } @else { "not known" } }
        td { (channel.unit) }
        td class="number" { @if let Some(noise) = channel.noise { (significant(channel.rmse / noise, 3)) } }
        td class="number" { @if channel.fit_percent.is_finite() { (format!("{:.1} %", channel.fit_percent)) } @else { "n/a" } }
    }
}

/// Returns the table of failed simulations.
pub(super) fn failures(failures: &[FailureReport]) -> Markup {
    let table = html! {
        table {
            thead {
                tr {
                    th scope="col" { "case" }
                    th scope="col" { "model" }
                    th scope="col" { "failure" }
                    th scope="col" class="number" { "count" }
                }
            }
            tbody {
                @for failure in failures {
                    tr {
                        th scope="row" { (failure.case) }
                        td { (failure.model) }
                        td { (failure.failure) }
                        td class="number" { (failure.count) }
                    }
                }
            }
        }
    };
    scrolling("Failures", table)
}
