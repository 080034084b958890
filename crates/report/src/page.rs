//! Page of the report: one HTML file without external resources. Without scripts it has the same content: they make
//! plots and tables interactive.

use maud::{DOCTYPE, Markup, PreEscaped, html};
use mops_content::{
    figures::Group,
    numbers::significant,
    section::{Block, Section, Tone, Verdict},
    table::{Cell, Table, numbers, text as column},
};
use mops_language::plain::plain;
use mops_outcome::FailureReport;
use mops_tasks::verdict;

use super::markup::{self, figures, rich, section};
use super::{Report, chart, criteria, matrix, tuners};

/// Style sheet of all pages.
pub const STYLE: &str = include_str!("style.css");

/// Content of the page by section.
pub(super) struct Content {
    pub(super) findings: Vec<Section>,
    pub(super) details: Vec<Section>,
    pub(super) responses: Vec<Group>,
    /// Sentence on omitted responses.
    pub(super) omitted: Option<String>,
    pub(super) convergence: Option<Group>,
    pub(super) calibration: Vec<Section>,
}

impl Content {
    /// Returns all groups of plots, in the order of their file names.
    pub(super) fn groups(&self) -> impl Iterator<Item = &Group> {
        let sections = self.findings.iter().chain(&self.details).chain(&self.calibration);
        self.responses.iter().chain(&self.convergence).chain(sections.flat_map(Section::groups))
    }
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
                style { (PreEscaped(STYLE)) }
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
pub(super) fn of(report: &Report<'_>, content: &Content) -> Markup {
    let (outcome, of, room) = (report.solution.outcome, &report.solution, report.room);
    let warnings = verdict::warnings(of);
    let has_points = content.findings.iter().flat_map(|section| &section.blocks);
    let has_points = has_points.into_iter().any(|block| matches!(block, Block::Table(table) if table.are_points));
    let body = html! {
        (header(report))
        main {
            @if !warnings.is_empty() {
                (section("Warnings", html! { ul class="warnings" { @for text in &warnings { li { (rich(text)) } } } }))
            }
            @for one in &content.findings { (markup::of(one)) }
            @if let Some(table) = matrix::section(outcome) { (section("Criteria by case", table)) }
            @if !outcome.criteria.is_empty() { (section("Criteria", criteria::table(report))) }
            @if !outcome.tuners.is_empty() && room.has_point() { (section("Tuners", tuners::table(report))) }
            @for one in &content.details { (markup::of(one)) }
            @if !content.responses.is_empty() {
                (section("Responses", html! {
                    @if let Some(text) = &content.omitted { p { (text) } }
                    @for group in &content.responses { (figures(group)) }
                }))
            }
            @if let Some(group) = &content.convergence { (section("Convergence", figures(group))) }
            @for one in &content.calibration { (markup::of(one)) }
            @if !outcome.failures.is_empty() { (section("Failures", failures(&outcome.failures))) }
            (section("Study", html! {
                details {
                    summary { "Study file with its settings" }
                    pre tabindex="0" { code { (report.text) } }
                }
            }))
        }
        footer { "Written by mops " (outcome.mops) ". All numbers are in result.json, the plots in the folder plots." }
        @if has_points { @for text in SCRIPTS { script { (PreEscaped(text)) } } }
    };
    document(&format!("{}: {}", outcome.study, room.title()), body)
}

/// Scripts that rotate a front over three criteria, and that select a point in all plots and in the table.
const SCRIPTS: [&str; 2] = [include_str!("space.js"), include_str!("front.js")];

/// Returns the table of failed simulations.
fn failures(failures: &[FailureReport]) -> Markup {
    let columns = [column("case"), column("model"), column("failure"), numbers("count")];
    let rows = failures.iter().map(|failure| {
        let FailureReport { case, model, failure, count, .. } = failure;
        [case, model, failure, &count.to_string()].map(|text| Cell::from(text.as_str())).to_vec()
    });
    markup::blocks(&[Block::Table(Table::new("Failures", columns).rows(rows))])
}

fn header(report: &Report<'_>) -> Markup {
    let (outcome, of, room) = (report.solution.outcome, report.solution, report.room);
    let Verdict { tone, text } = verdict::verdict(&of, room);
    let class = match tone {
        Tone::Good => "verdict good",
        Tone::Mixed => "verdict mixed",
        Tone::Bad => "verdict bad",
    };
    html! {
        header {
            p class="task" { (room.title()) }
            h1 { (outcome.study) }
            p class=(class) { (rich(&text)) }
            dl {
                @for (name, value) in room.facts(outcome) { (fact(&name, &value)) }
                @if room.has_point() {
                    (fact("Solver", &verdict::solver(outcome)))
                    (fact("Evaluations", &outcome.evaluations.to_string()))
                    @if let Some(reused) = outcome.reused { (fact("Reused evaluations", &reused.to_string())) }
                }
                (fact("Simulations", &outcome.simulations.to_string()))
                (fact("Time", &format!("{} s", significant(outcome.seconds, 3))))
                (fact("Seed", &outcome.seed.to_string()))
            }
            @if room.has_point() { dl class="long" {
                (fact("Stopped", verdict::stop(outcome, room)))
                @if room.has_optimality() && outcome.feasible { (fact("Pareto", verdict::pareto(outcome.pareto))) }
                @if let Some(words) = verdict::end(outcome) { (fact("Optimum", &words)) }
            } }
        }
    }
}

fn fact(name: &str, value: &str) -> Markup {
    html! { div { dt { (name) } dd { (value) } } }
}
