//! The page of a comparison: the responses of several runs over each other.

use maud::{Markup, PreEscaped, html};
use mops_core::{Analysis, Problem};

use super::page::{document, scrolling, section};
use super::plot::{Color, Curve, Plot};
use super::sampling;
use crate::numbers::labelled;

/// A run whose responses are drawn.
pub(crate) struct Responses {
    /// Name in the legends.
    pub(crate) name: String,
    /// The problem.
    pub(crate) problem: Problem,
    /// Values of all its tuners.
    pub(crate) tuners: Vec<f64>,
}

/// A table of a comparison: names, units, then numbers.
pub(crate) struct Rows {
    /// What it is of.
    pub(crate) title: &'static str,
    /// What stands above each column.
    pub(crate) header: Vec<String>,
    /// The lines, as long as the header.
    pub(crate) lines: Vec<Vec<String>>,
}

/// The page: which letter stands for which folder, tables, responses as pictures, sentences on what is not shown.
pub(crate) fn comparison_page(
    names: &[(String, String)],
    tables: &[Rows],
    runs: &[Responses],
    silent: &[String],
) -> String {
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
                @for sentence in silent { p { (sentence) } }
                @if plots.is_empty() { p { "There is no signal over time to draw." } }
                div class="figures" { @for plot in &plots { figure { div class="wide" { (PreEscaped(plot.svg())) } } } }
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

/// A curve, with the plot it belongs to: case, model, signal, and its label.
type Drawn = ([String; 3], String, Curve);

/// A plot for every signal that criteria read, with a curve for every run that has it.
fn plots(runs: &[Responses]) -> Vec<Plot> {
    let drawn: Vec<Drawn> = runs.iter().enumerate().flat_map(|(i, run)| curves(i, run)).collect();
    let mut places: Vec<(&[String; 3], &String)> = Vec::new();
    for (place, label, _) in &drawn {
        if places.iter().all(|(known, _)| *known != place) {
            places.push((place, label));
        }
    }
    let several = places.iter().any(|(place, _)| place[1] != places[0].0[1]);
    let plot = |(place, label): (&[String; 3], &String)| {
        let [case, model, signal] = place;
        let of = if several { format!(" of {model}") } else { String::new() };
        Plot {
            title: format!("{signal}{of} in case {case}"),
            x_label: "time (s)".into(),
            y_label: label.clone(),
            curves: drawn.iter().filter(|(at, ..)| at == place).map(|(_, _, curve)| curve.clone()).collect(),
            ..Plot::default()
        }
    };
    places.into_iter().map(plot).collect()
}

/// The responses of a run; a simulation that fails has none.
fn curves(index: usize, run: &Responses) -> Vec<Drawn> {
    let study = run.problem.study();
    let mut drawn = Vec::new();
    for (job, plan) in study.jobs.iter().enumerate() {
        let (model_name, model) = &study.models[plan.model];
        let Ok(Analysis::Time(response)) = run.problem.analyse_all(job, &run.tuners, None) else { continue };
        for signal in plan.signals.iter().map(|&i| &model.interface().signals[i]) {
            let Some(trace) = response.trace(&signal.name) else { continue };
            let place = [study.cases[plan.case].name.clone(), model_name.clone(), signal.name.clone()];
            let color = Color::Series(index % 6);
            let curve = Curve { name: run.name.clone(), points: sampling::points(trace), color, ..Curve::default() };
            drawn.push((place, labelled(&signal.name, &signal.unit.to_string()), curve));
        }
    }
    drawn
}
