//! Page of the report: one HTML file without external resources. Without scripts it has the same content: they make plots and
//! tables interactive.

use maud::{DOCTYPE, Markup, PreEscaped, html};
use mops_core::Task;
use mops_outcome::CalibrationReport;

use super::figures::{Figure, Group};
use super::verdict::{self, Tone};
use super::{
    Report, calibration, chart, criteria, diagnosis, excitation, front, jumps, matrix, robustness, sensitivity, slopes,
    tuners, uncertainty,
};
use crate::numbers::significant;
use crate::plain::plain;

/// Plots of the page, by section.
pub(super) struct Plots {
    pub(super) responses: Vec<Group>,
    /// Sentence on omitted responses.
    pub(super) omitted: Option<String>,
    pub(super) convergence: Option<Group>,
    pub(super) front: Option<Group>,
    pub(super) sweep: Option<Group>,
    pub(super) excitation: Option<Group>,
    pub(super) diagnosis: Option<diagnosis::Plots>,
    pub(super) robustness: Vec<robustness::Section>,
    pub(super) uncertainty: Option<Group>,
}

/// Script that makes tables sortable.
const TABLES: &str = include_str!("tables.js");

/// Wraps HTML into a page in the style of the reports: one file, light and dark scheme, sortable tables.
#[must_use]
pub fn page(title: &str, body: &str) -> String {
    document(title, PreEscaped(body.to_owned())).into_string()
}

/// Returns a page with the common head: one file, light and dark scheme, sortable tables.
pub(super) fn document(title: &str, body: Markup) -> Markup {
    let charts = body.0.contains("class=\"chart\"");
    let whole = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta name="generator" content={ "mops " (env!("CARGO_PKG_VERSION")) };
                title { (title) }
                style { (PreEscaped(super::STYLE)) }
                @if charts { style { (PreEscaped(chart::STYLE)) } }
            }
            body {
                (body)
                script { (PreEscaped(TABLES)) }
                @if charts { @for text in chart::SCRIPTS { script { (PreEscaped(text)) } } }
            }
        }
    };
    // Names from a study are untrusted text, wherever the page shows them.
    PreEscaped(plain(&whole.0).into_owned())
}

/// Returns the page of a report.
pub(super) fn of(report: &Report<'_>, plots: &Plots) -> Markup {
    let outcome = report.outcome;
    let warnings = verdict::warnings(report);
    let body = html! {
        (header(report))
        main {
            @if !warnings.is_empty() {
                (section("Warnings", html! { ul class="warnings" { @for text in &warnings { li { (rich(text)) } } } }))
            }
            @if let (Some(found), Some(plots)) = (report.outcome.found.diagnosis.as_ref(), &plots.diagnosis) {
                (diagnosis::sections(found, plots))
            }
            @for one in &plots.robustness {
                (section(one.title, html! { (one.content) (figures(&one.group)) }))
            }
            @if let (Some(found), Some(group)) = (&outcome.found.trade_offs, &plots.front) {
                (section("Front", html! { (figures(group)) (front::table(report, found)) }))
            }
            @if let Some(group) = &plots.sweep { (section("Sweep", figures(group))) }
            @if let Some(found) = &outcome.found.sensitivity {
                (section(sensitivity::title(found), sensitivity::section(found)))
            }
            @if let Some(found) = &outcome.found.excitation {
                (section("Excitation", html! {
                    (excitation::section(found))
                    @if let Some(group) = &plots.excitation { (figures(group)) }
                }))
            }
            @if let Some(table) = matrix::section(outcome) { (section("Criteria by case", table)) }
            @if !outcome.criteria.is_empty() { (section("Criteria", criteria::table(report))) }
            @if !outcome.tuners.is_empty() && report.outcome.found.diagnosis.as_ref().is_none() { (section("Tuners", tuners::table(report))) }
            @if let Some(found) = &outcome.found.slopes {
                @let one_case = report.problem.study().cases().len() == 1;
                (section("Sensitivities", slopes::section(found, report.best_name(), one_case)))
            }
            @if let Some(found) = &outcome.found.jumps {
                (section("Jumps near the design", jumps::section(found)))
            }
            @if !plots.responses.is_empty() {
                (section("Responses", html! {
                    @if let Some(text) = &plots.omitted { p { (text) } }
                    @for group in &plots.responses { (figures(group)) }
                }))
            }
            @if let Some(group) = &plots.convergence { (section("Convergence", figures(group))) }
            @if let Some(results) = &outcome.calibration {
                (section("Calibration", calibration::section(results)))
                @if let Some(found) = &outcome.found.uncertainty {
                    (section(uncertainty::TITLE, html! {
                        (uncertainty::section(found))
                        @if let Some(group) = &plots.uncertainty { (figures(group)) }
                    }))
                }
                @if results.sensitivity.is_some() || !results.excitation.is_empty() {
                    (section(sensitivity::IDENTIFIABILITY, identifiability(results, plots)))
                }
            }
            @if !outcome.failures.is_empty() { (section("Failures", calibration::failures(&outcome.failures))) }
            (section("Study", html! {
                details {
                    summary { "Study file with its settings" }
                    pre tabindex="0" { code { (report.text) } }
                }
            }))
        }
        footer { "Written by mops " (outcome.mops) ". All numbers are in result.json, the plots in the folder plots." }
        @if plots.front.is_some() { @for text in front::SCRIPTS { script { (PreEscaped(text)) } } }
    };
    document(&format!("{}: {}", outcome.study, task(outcome.task)), body)
}

/// Returns the identifiability of the tuners of a calibration, and the excitation of its inputs.
fn identifiability(results: &CalibrationReport, plots: &Plots) -> Markup {
    html! {
        @if let Some(found) = &results.sensitivity { (sensitivity::section(found)) }
        h3 { "Inputs" }
        @if results.excitation.is_empty() {
            p { "No experiment is driven by an input: all information comes from the initial states." }
        } @else {
            (excitation::inputs(&results.excitation))
            @if let Some(group) = &plots.excitation { (figures(group)) }
        }
    }
}

/// Wraps a table for horizontal scrolling on narrow screens.
pub(super) fn scrolling(name: &str, table: Markup) -> Markup {
    html! { div class="wide" role="region" tabindex="0" aria-label=(name) { (table) } }
}

pub(super) fn section(title: &str, content: Markup) -> Markup {
    let id = title.to_lowercase().replace(' ', "-");
    html! { section aria-labelledby=(id) { h2 id=(id) { (title) } (content) } }
}

fn header(report: &Report<'_>) -> Markup {
    let outcome = report.outcome;
    let (tone, sentence) = verdict::verdict(report);
    let class = match tone {
        Tone::Good => "verdict good",
        Tone::Mixed => "verdict mixed",
        Tone::Bad => "verdict bad",
    };
    html! {
        header {
            p class="task" { (task(outcome.task)) }
            h1 { (outcome.study) }
            p class=(class) { (rich(&sentence)) }
            dl {
                @if let Some(found) = report.outcome.found.diagnosis.as_ref() {
                    @for (name, value) in diagnosis::facts(found) { (fact(&name, &value)) }
                } @else {
                    (fact("Solver", &verdict::solver(outcome)))
                    (fact("Evaluations", &outcome.evaluations.to_string()))
                    @if let Some(reused) = outcome.reused { (fact("Reused evaluations", &reused.to_string())) }
                }
                (fact("Simulations", &outcome.simulations.to_string()))
                (fact("Time", &format!("{} s", significant(outcome.seconds, 3))))
                (fact("Seed", &outcome.seed.to_string()))
            }
            @if report.outcome.found.diagnosis.as_ref().is_none() { dl class="long" {
                (fact("Stopped", verdict::stop(outcome)))
                @if outcome.task == Task::Design && outcome.feasible { (fact("Pareto", verdict::pareto(outcome.pareto))) }
                @if let Some(words) = verdict::end(outcome) { (fact("Optimum", &words)) }
            } }
        }
    }
}

fn fact(name: &str, value: &str) -> Markup {
    html! { div { dt { (name) } dd { (value) } } }
}

fn task(task: Task) -> &'static str {
    match task {
        Task::Design => "Design",
        Task::Pareto => "Pareto front",
        Task::Calibration => "Calibration",
        Task::Excitation => "Excitation",
        Task::Sensitivity => "Sensitivity",
        Task::Sweep => "Sweep",
        Task::Diagnosis => "Diagnosis",
        Task::WorstCase => "Worst case",
        Task::MonteCarlo => "Monte Carlo",
    }
}

pub(super) fn figures(group: &Group) -> Markup {
    html! {
        @if !group.title.is_empty() { h3 { (rich(&group.title)) } }
        @for sentence in &group.about { p { (rich(sentence)) } }
        @if !group.figures.is_empty() {
            div class=(if group.full_width { "figures full" } else { "figures" }) {
                @for one in &group.figures { (figure(one)) }
            }
        }
    }
}

fn figure(figure: &Figure) -> Markup {
    html! {
        figure data-signal=[&figure.on_request] hidden[figure.on_request.is_some()] {
            @for (_, plot) in &figure.plots { (chart::markup(plot)) }
            @if !figure.caption.is_empty() {
                figcaption { @for (i, line) in figure.caption.iter().enumerate() { @if i > 0 { "; " } (rich(line)) } }
            }
        }
    }
}

/// Returns a text as markup; names between backticks become code.
pub(super) fn rich(text: &str) -> Markup {
    let parts: Vec<&str> = text.split('`').collect();
    if parts.len().is_multiple_of(2) {
        return html! { (text) };
    }
    html! { @for (i, part) in parts.iter().enumerate() { @if i % 2 == 1 { code { (part) } } @else { (part) } } }
}
