//! Plots of one simulation: an experiment, or a case with the responses of a Pareto front.

use mops_content::{
    figures::{Figure, Group},
    numbers::with_unit,
    plot::{Color, Curve, Plot},
};
use mops_core::{Variable, study::Row};
use mops_tasks::calibration::{self, Around, UncertaintyReport};

use super::super::comparison::over_time;
use super::super::{Report, criteria, front};
use super::simulated::Simulated;
use super::{active, inputs};

/// Returns the plots of a simulation.
pub(super) fn group(report: &Report<'_>, Simulated { job, both }: &Simulated) -> Group {
    let study = report.solution.problem.study();
    let plan = &study.jobs()[*job];
    let (case, (model_name, model)) = (&study.cases()[plan.case], &study.models()[plan.model]);
    let mut title = match &case.experiment {
        Some(experiment) => format!("Experiment `{}` ({})", case.name, experiment.role.name()),
        None => format!("Case `{}`", case.name),
    };
    // The model is named only if there are several.
    let place = if study.models().len() > 1 {
        title.push_str(&format!(", model `{model_name}`"));
        format!("{}-{model_name}", case.name)
    } else {
        case.name.clone()
    };
    let full_width = report.solution.front.is_empty();
    let mut group = Group { title, about: both.failures(), figures: Vec::new(), full_width };
    if both.start.is_err() && both.best.is_err() && case.experiment.is_none() {
        return group;
    }
    let of_front = front::analyses(report, *job);
    let signals = &model.interface().signals;
    let captions = |signal: &str| -> Vec<String> {
        let of_job = study.rows().iter().enumerate().filter(|(_, row)| row.job == *job);
        of_job
            .filter(|(_, row)| row.criterion.signals().iter().any(|s| s == signal))
            .map(|(i, row)| caption(report, i, row))
            .collect()
    };
    for channel in case.experiment.iter().flat_map(|e| &e.channels) {
        if let Some(signal) = signals.iter().find(|s| s.name == channel.signal) {
            let mut fit = both.fit(channel, signal, &case.name);
            let bands = |around: Around| {
                let found = report.solution.outcome.found.get::<UncertaintyReport>();
                found.map_or_else(Vec::new, |found| calibration::bands(found, &case.name, &signal.name, around))
            };
            fit.curves.extend(bands(Around::Prediction));
            let mut plots = vec![(format!("fit-{place}-{}", signal.name), fit)];
            plots.extend(both.residual(channel, signal, &case.name).map(|mut plot| {
                plot.curves.extend(bands(Around::Zero));
                (format!("residual-{place}-{}", signal.name), plot)
            }));
            group.figures.push(Figure { plots, caption: captions(&signal.name), ..Figure::default() });
        }
    }
    let measured = |signal: &Variable| case.experiment.as_ref().is_some_and(|e| e.channel(&signal.name).is_some());
    for signal in plan.signals.iter().map(|&i| &signals[i]).filter(|s| !measured(s)) {
        let rows: Vec<&Row> = study.rows().iter().filter(|row| row.job == *job).collect();
        let mut plot = both.response(signal, &case.name, &rows);
        plot.curves.splice(0..0, front::responses(&of_front, &signal.name));
        let plots = vec![(format!("response-{place}-{}", signal.name), plot)];
        group.figures.push(Figure { plots, caption: captions(&signal.name), ..Figure::default() });
    }
    for input in inputs::driven(&model.interface().inputs, &[case]) {
        let points = inputs::points(case, &input.name, plan.horizon);
        let curve = Curve { name: input.name.clone(), points, color: Color::Faint, ..Curve::default() };
        let title = format!("input {} in {}", input.name, case.name);
        let plot = Plot { title, curves: vec![curve], supplement: true, ..over_time(input) };
        let plots = vec![(format!("input-{place}-{}", input.name), plot)];
        group.figures.push(Figure { plots, ..Figure::default() });
    }
    active::narrow(&mut group);
    group
}

/// Returns the caption of a criterion: value and demand.
fn caption(report: &Report<'_>, index: usize, row: &Row) -> String {
    let criterion = &report.solution.outcome.criteria[index];
    let mut text = format!("`{}`: {}", row.name, with_unit(criterion.value, &criterion.unit));
    if let Some(demand) = criteria::demand(criterion) {
        text.push_str(&format!(" (demand {demand})"));
    }
    text
}
