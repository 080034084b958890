//! Responses of one point for the live page of a run.

use mops_content::{
    figures::{Figure, Group},
    marks::bounds,
    plot::{Bound, Color, Curve, CurveStyle, Plot},
    sampling,
};
use mops_core::{Problem, study::Row};
use serde_json::Value;

use super::super::chart;
use super::super::comparison::{over_time, trace};
use super::active;

/// Largest number of simulations shown during a run.
const MOST: usize = 6;

/// Key of a plot: model, experiment if any, signal.
type Key = (usize, Option<usize>, usize);

/// Returns the data of a plot for every signal that criteria read, with all cases of a model in one plot and a plot for
/// each experiment; at most six simulations. Failed simulations and linear models have no curves.
pub fn live(problem: &Problem, tuners: &[f64]) -> Vec<Value> {
    let study = problem.study();
    let mut plots: Vec<(Key, Plot)> = Vec::new();
    for (job, plan) in study.jobs().iter().enumerate().take(MOST) {
        let (case, model) = (&study.cases()[plan.case], &study.models()[plan.model].1);
        let analysis = problem.analyse_all(job, tuners, None);
        for &index in &plan.signals {
            let signal = &model.interface().signals[index];
            let Some(trace) = trace(&analysis, &signal.name) else { continue };
            let experiment = case.experiment.as_ref().map(|_| plan.case);
            let key = (plan.model, experiment, index);
            let at = plots.iter().position(|(known, _)| *known == key).unwrap_or_else(|| {
                let of = if experiment.is_some() { format!(" in experiment {}", case.name) } else { String::new() };
                plots.push((key, Plot { title: format!("{}{of}", signal.name), ..over_time(signal) }));
                plots.len() - 1
            });
            let plot = &mut plots[at].1;
            let channel = case.experiment.as_ref().and_then(|experiment| experiment.channel(&signal.name));
            if let Some(channel) = channel {
                plot.curves.push(Curve {
                    name: "measured".into(),
                    points: channel.times.iter().copied().zip(channel.values.iter().copied()).collect(),
                    style: CurveStyle::Dots,
                    color: Color::Measured,
                    ..Curve::default()
                });
            }
            let name = if channel.is_some() { "simulated" } else { &case.name };
            let color = if channel.is_some() { Color::Result } else { Color::Series(plan.case) };
            plot.curves.push(Curve { name: name.into(), points: sampling::points(trace), color, ..Curve::default() });
            let rows: Vec<&Row> = study.rows().iter().filter(|row| row.job == job).collect();
            let new: Vec<Bound> = analysis.iter().flat_map(|analysis| bounds(&signal.name, &rows, analysis)).collect();
            new.into_iter().for_each(|bound| {
                if !plot.bounds.contains(&bound) {
                    plot.bounds.push(bound);
                }
            });
        }
    }
    let figure = |(_, plot)| Figure { plots: vec![(String::new(), plot)], ..Figure::default() };
    let mut group = Group { figures: plots.into_iter().map(figure).collect(), ..Group::default() };
    active::narrow(&mut group);
    group.figures.iter().flat_map(|figure| &figure.plots).map(|(_, plot)| chart::data(plot)).collect()
}
