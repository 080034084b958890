//! Plots of the responses: the signals of every simulation at the initial guess and at the reported point, with measurements.

use mops_core::{AnalysisKind, Row, Variable};

use super::Report;
use super::bode;
use super::comparison::Comparison;
use super::front;
use super::plot::Plot;
use super::uncertainty::{self, Around};
use crate::numbers::{counted, with_unit};

/// Largest number of simulations with plots; beyond it, those with the largest scaled values are shown.
const MOST_JOBS: usize = 30;

/// Group of plots with a heading.
#[derive(Debug, Default)]
pub(super) struct Group {
    pub(super) title: String,
    /// Sentences above the plots.
    pub(super) about: Vec<String>,
    pub(super) figures: Vec<Figure>,
}

/// Column of plots, each with its file name, and the lines of the caption.
#[derive(Debug)]
pub(super) struct Figure {
    pub(super) plots: Vec<(String, Plot)>,
    pub(super) caption: Vec<String>,
}

/// Returns a group for every simulation, at most [`MOST_JOBS`], and a sentence if some are omitted.
pub(super) fn responses(report: &Report<'_>) -> (Vec<Group>, Option<String>) {
    let study = report.problem.study();
    let mut jobs: Vec<usize> = (0..study.jobs().len()).collect();
    let all = jobs.len();
    if all > MOST_JOBS {
        let worst = |job: usize| {
            let of_job = study.rows().iter().zip(&report.best.readings).filter(|(row, _)| row.job == job);
            of_job.map(|(_, reading)| reading.map_or(f64::INFINITY, |r| r.scaled)).fold(f64::NEG_INFINITY, f64::max)
        };
        jobs.sort_by(|&a, &b| worst(b).total_cmp(&worst(a)));
        jobs.truncate(MOST_JOBS);
        jobs.sort_unstable();
    }
    let omitted = (all > MOST_JOBS).then(|| {
        format!("The {MOST_JOBS} of {} with the largest scaled values are shown.", counted(all, "simulation"))
    });
    (jobs.into_iter().map(|job| of_job(report, job)).collect(), omitted)
}

fn of_job(report: &Report<'_>, job: usize) -> Group {
    let study = report.problem.study();
    let plan = &study.jobs()[job];
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
    let both = Comparison {
        start: report.problem.analyse_all(job, &study.start(), None),
        best: report.problem.analyse_all(job, &report.best.tuners, None),
        best_name: report.best_name(),
    };
    let about = both.failures();
    let mut group = Group { title, about, figures: Vec::new() };
    if both.start.is_err() && both.best.is_err() && case.experiment.is_none() {
        return group;
    }
    let of_front = front::analyses(report, job);
    let signals = &model.interface().signals;
    let captions = |signal: &str| -> Vec<String> {
        let of_job = study.rows().iter().enumerate().filter(|(_, row)| row.job == job);
        of_job
            .filter(|(_, row)| row.criterion.signals().iter().any(|s| s == signal))
            .map(|(i, row)| caption(report, i, row))
            .collect()
    };
    for channel in case.experiment.iter().flat_map(|e| &e.channels) {
        if let Some(signal) = signals.iter().find(|s| s.name == channel.signal) {
            let mut fit = both.fit(channel, signal, &case.name);
            let bands = |around: Around| {
                let found = report.outcome.found.uncertainty.as_ref();
                found.map_or_else(Vec::new, |found| uncertainty::bands(found, &case.name, &signal.name, around))
            };
            fit.curves.extend(bands(Around::Prediction));
            let mut plots = vec![(format!("fit-{place}-{}", signal.name), fit)];
            plots.extend(both.residual(channel, signal, &case.name).map(|mut plot| {
                plot.curves.extend(bands(Around::Zero));
                (format!("residual-{place}-{}", signal.name), plot)
            }));
            group.figures.push(Figure { plots, caption: captions(&signal.name) });
        }
    }
    let measured = |signal: &Variable| case.experiment.as_ref().is_some_and(|e| e.channel(&signal.name).is_some());
    for signal in plan.signals.iter().map(|&i| &signals[i]).filter(|s| !measured(s)) {
        if model.interface().analysis == AnalysisKind::Linear {
            let of_inputs = bode::compared(&both.start, (&both.best, both.best_name), &signal.name, &case.name);
            let plots = of_inputs.into_iter().map(|(name, plot)| (format!("{place}-{name}"), plot)).collect();
            group.figures.push(Figure { plots, caption: captions(&signal.name) });
            continue;
        }
        let rows: Vec<&Row> = study.rows().iter().filter(|row| row.job == job).collect();
        let mut plot = both.response(signal, &case.name, &rows);
        plot.curves.splice(0..0, front::responses(&of_front, &signal.name));
        let plots = vec![(format!("response-{place}-{}", signal.name), plot)];
        group.figures.push(Figure { plots, caption: captions(&signal.name) });
    }
    group
}

/// Returns the caption of a criterion: value and demand.
fn caption(report: &Report<'_>, index: usize, row: &Row) -> String {
    let criterion = &report.outcome.criteria[index];
    let mut text = format!("`{}`: {}", row.name, with_unit(criterion.value, &criterion.unit));
    if let Some(demand) = super::criteria::demand(criterion) {
        text.push_str(&format!(" (demand {demand})"));
    }
    text
}
