//! Plots of a model: each signal in all cases.

use mops_content::figures::{Figure, Group};
use mops_content::numbers::counted;
use mops_content::sampling;
use mops_core::{AnalysisKind, Case, Variable};

use super::super::Report;
use super::cases::{COLOURED, Cases, colors};
use super::simulated::Simulated;
use super::{active, inputs, linear};

/// Largest number of curves that a page shows on request.
const MOST_ON_REQUEST: usize = 200;

/// Number of columns of a curve that a page shows on request.
const COLUMNS_ON_REQUEST: f64 = 250.0;

/// Returns the plots of a model.
pub(super) fn group(report: &Report<'_>, model: usize, ones: &[&Simulated]) -> Group {
    let study = report.solution.problem.study();
    let (name, built) = &study.models()[model];
    let cases = Cases { report, model, ones, colors: colors(report, ones) };
    let title = if study.models().len() > 1 { format!("Model `{name}`") } else { String::new() };
    let mut about: Vec<String> = Vec::new();
    for one in ones {
        let of_case = |sentence: String| {
            if ones.len() > 1 { format!("Case `{}`: {sentence}", cases.name(one)) } else { sentence }
        };
        about.extend(one.both.failures().into_iter().map(of_case));
    }
    if ones.len() > COLOURED {
        about.push(format!(
            "Coloured: the {COLOURED} of {} with the largest scaled values.",
            counted(ones.len(), "case")
        ));
    }
    let mut group = Group { title, about, figures: Vec::new(), full_width: true };
    if ones.iter().all(|one| one.both.start.is_err() && one.both.best.is_err()) {
        return group;
    }
    let signals = &built.interface().signals;
    let read = |index: &usize| ones.iter().any(|one| study.jobs()[one.job].signals.contains(index));
    let place = cases.place();
    if built.interface().analysis == AnalysisKind::Linear {
        let outputs: Vec<&Variable> = (0..signals.len()).filter(read).map(|i| &signals[i]).collect();
        group.figures = linear::figures(&cases, &outputs);
        return group;
    }
    for signal in (0..signals.len()).filter(read).map(|i| &signals[i]) {
        let plots = vec![(format!("response-{place}{}", signal.name), cases.response(signal))];
        group.figures.push(Figure { plots, caption: cases.caption(&signal.name), ..Figure::default() });
    }
    let all: Vec<&Case> = ones.iter().map(|one| cases.case(one)).collect();
    for input in inputs::driven(&built.interface().inputs, &all) {
        let plots = vec![(format!("input-{place}{}", input.name), cases.input(input))];
        group.figures.push(Figure { plots, ..Figure::default() });
    }
    let others = (0..signals.len()).filter(|i| !read(i)).take(MOST_ON_REQUEST / ones.len());
    for signal in others.map(|i| &signals[i]) {
        let mut plot = cases.response(signal);
        for curve in &mut plot.curves {
            curve.points = sampling::within_columns(std::mem::take(&mut curve.points), COLUMNS_ON_REQUEST);
        }
        let plots = vec![(String::new(), plot)];
        group.figures.push(Figure { plots, on_request: Some(signal.name.clone()), ..Figure::default() });
    }
    active::narrow(&mut group);
    group
}
