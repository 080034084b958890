//! Page of a comparison: tables and responses of several runs.

use maud::{Markup, html};
use mops_content::{
    numbers::labelled,
    plot::{Color, Curve, Plot},
    sampling,
};
use mops_core::{Analysis, Problem};

use super::chart;
use super::markup::{scrolling, section};
use super::page::document;

/// Run with responses to plot.
pub struct Responses {
    /// Name in the legends.
    pub name: String,
    /// Problem of the run.
    pub problem: Problem,
    /// Values of all tuners.
    pub tuners: Vec<f64>,
}

/// Table of a comparison: names, units, then numbers.
pub struct Rows {
    /// Title.
    pub title: &'static str,
    /// Header of each column.
    pub header: Vec<String>,
    /// Lines, each with one cell per column.
    pub lines: Vec<Vec<String>>,
}

/// Returns the page: folder of each letter, tables, responses as plots, and sentences on omitted responses.
pub fn comparison_page(names: &[(String, String)], tables: &[Rows], runs: &[Responses], omitted: &[String]) -> String {
    let plots = plots(runs);
    let body = html! {
        header {
            p class="task" { "Comparison" }
            h1 { "Runs side by side" }
            dl class="long" { @for (letter, name) in names { div { dt { (letter) } dd { (name) } } } }
        }
        main {
            @for rows in tables {
                (section(rows.title, scrolling(rows.title, table(rows))))
            }
            (section("Responses", html! {
                @for sentence in omitted { p { (sentence) } }
                @if plots.is_empty() { p { "No signals over time." } }
                div class="figures full" { @for plot in &plots { figure { (chart::markup(plot)) } } }
            }))
        }
        footer { "Written by mops " (env!("CARGO_PKG_VERSION")) "." }
    };
    document("Comparison of runs", body).into_string()
}

fn table(rows: &Rows) -> Markup {
    let class = |column: usize| (column >= 2).then_some("number");
    html! {
        table {
            thead { tr { @for (i, head) in rows.header.iter().enumerate() { th scope="col" class=[class(i)] { (head) } } } }
            tbody {
                @for line in &rows.lines {
                    tr {
                        @for (i, cell) in line.iter().enumerate() {
                            @if i == 0 { th scope="row" { (cell) } } @else { td class=[class(i)] { (cell) } }
                        }
                    }
                }
            }
        }
    }
}

/// Curve with its plot (case, model, signal) and the label of the y axis.
type PlottedCurve = ([String; 3], String, Curve);

/// Returns a plot for every signal that criteria read, with a curve for every run that has the signal.
fn plots(runs: &[Responses]) -> Vec<Plot> {
    let drawn: Vec<PlottedCurve> = runs.iter().enumerate().flat_map(|(i, run)| curves(i, run)).collect();
    let mut keys: Vec<(&[String; 3], &String)> = Vec::new();
    for (key, label, _) in &drawn {
        if keys.iter().all(|(known, _)| *known != key) {
            keys.push((key, label));
        }
    }
    let several = keys.iter().any(|(key, _)| key[1] != keys[0].0[1]);
    let plot = |(key, label): (&[String; 3], &String)| {
        let [case, model, signal] = key;
        let of = if several { format!(" of {model}") } else { String::new() };
        Plot {
            title: format!("{signal}{of} in case {case}"),
            x_label: "time (s)".into(),
            y_label: label.clone(),
            curves: drawn.iter().filter(|(at, ..)| at == key).map(|(_, _, curve)| curve.clone()).collect(),
            ..Plot::default()
        }
    };
    keys.into_iter().map(plot).collect()
}

/// Returns the responses of a run; a failed simulation has none.
fn curves(index: usize, run: &Responses) -> Vec<PlottedCurve> {
    let study = run.problem.study();
    let mut drawn = Vec::new();
    for (job, plan) in study.jobs().iter().enumerate() {
        let (model_name, model) = &study.models()[plan.model];
        let Ok(Analysis::Time(response)) = run.problem.analyse_all(job, &run.tuners, None) else { continue };
        for signal in plan.signals.iter().map(|&i| &model.interface().signals[i]) {
            let Some(trace) = response.trace(&signal.name) else { continue };
            let key = [study.cases()[plan.case].name.clone(), model_name.clone(), signal.name.clone()];
            let color = Color::Series(index % 6);
            let curve = Curve { name: run.name.clone(), points: sampling::points(trace), color, ..Curve::default() };
            drawn.push((key, labelled(&signal.name, &signal.unit.to_string()), curve));
        }
    }
    drawn
}
