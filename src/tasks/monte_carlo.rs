//! `task = "monte-carlo"`: distribution of the criteria under uncertain parameters.

use std::sync::Arc;

use mops_core::{
    Demand, Evaluation, Problem, Study, Usage, Watch,
    study::{MonteCarloTask, Row},
};
use mops_math::stream;
use mops_outcome::robustness::{
    DistributionReport, MonteCarloReport, QuantileReport, ShareReport, Subject, uncertain_reports,
};
use mops_statistics::{Sampling, Summary, draw, quantile, quantile_interval, share_interval};

use super::at;
use super::batches::{Stage, each};
use super::copies::{Copies, evaluate_at};
use crate::numbers::significant;
use crate::search::{Options, SolveError, Solved};

pub(super) fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    let task = study.tasks().monte_carlo.clone();
    let mut solved = at(task.at, study, options, watch)?;
    let over = Arc::new(solved.problem.study().over_uncertain(&solved.best.tuners));
    let problem = Problem::new(Arc::clone(&over));
    let store = Copies::of(options, solved.problem.study(), &over, &[]);
    let uncertain = &over.tasks().uncertain;
    let first = over.tuners().len() - uncertain.len();
    let mut random = stream(over.seed(), "monte-carlo");
    let samples: Vec<Vec<f64>> = draw(task.method, task.samples, uncertain.len(), &mut random)
        .into_iter()
        .map(|u| uncertain.iter().zip(u).map(|(uncertain, u)| uncertain.quantile(u)).collect())
        .collect();
    let evaluate = |values: &Vec<f64>| {
        let mut tuners = over.start();
        tuners[first..].copy_from_slice(values);
        evaluate_at(&problem, &tuners, store.as_ref())
    };
    let nominal = evaluate(&over.tuners()[first..].iter().map(|tuner| tuner.start).collect());
    let stage = Stage { what: "sampling", from: 0.0, to: 1.0 };
    let answers = each(&samples, stage, watch, evaluate);
    if answers.len() < samples.len() {
        solved.outcome.stop = watch.halt().into();
    }
    if answers.is_empty() {
        return Ok(solved);
    }
    solved.outcome.simulations += (answers.len() + 1) * over.jobs().len();
    let rows = over.rows().iter().enumerate();
    let criteria: Vec<DistributionReport> =
        rows.map(|(i, row)| distribution(&over, (i, row), &nominal, &answers, &task)).collect();
    let demanded = |row: &Row| row.usage != Usage::Monitor && row.demand != Demand::None;
    let all_met = |e: &&Evaluation| over.rows().iter().enumerate().all(|(i, row)| !demanded(row) || met(row, e, i));
    let all = over
        .rows()
        .iter()
        .any(demanded)
        .then(|| share(answers.iter().filter(all_met).count(), answers.len(), task.level));
    let is_monitored = over.rows().iter().any(|row| row.usage == Usage::Monitor && row.demand != Demand::None);
    let value = |e: &Evaluation, i: usize| e.readings[i].map_or(f64::NAN, |r| r.value);
    let table = samples
        .iter()
        .zip(&answers)
        .map(|(sample, e)| (sample.clone(), (0..over.rows().len()).map(|i| value(e, i)).collect()));
    let report = MonteCarloReport {
        words: words(&criteria, all, &task, (answers.len(), is_monitored)),
        parameters: uncertain_reports(&over),
        samples: answers.len(),
        method: task.method,
        level: task.level,
        failed: answers.iter().filter(|e| e.readings.iter().any(Option::is_none)).count(),
        criteria,
        all,
        table: table.collect(),
    };
    solved.outcome.found.monte_carlo = Some(report);
    Ok(solved)
}

/// Returns true if a sample meets the demand of a row; false if it has no value.
fn met(row: &Row, at: &Evaluation, index: usize) -> bool {
    at.readings[index].is_some_and(|reading| row.is_met(reading.scaled) != Some(false))
}

#[allow(clippy::cast_precision_loss)]
fn share(count: usize, of: usize, level: f64) -> ShareReport {
    ShareReport { count, of, share: count as f64 / of as f64, interval: share_interval(count, of, level) }
}

fn distribution(
    study: &Study,
    (index, row): (usize, &Row),
    nominal: &Evaluation,
    answers: &[Evaluation],
    task: &MonteCarloTask,
) -> DistributionReport {
    let values = answers.iter().filter_map(|e| e.readings[index].map(|r| r.value));
    let mut values: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
    values.sort_by(f64::total_cmp);
    let Summary { mean, deviation, min, max } = Summary::of(&values);
    let one = |&share: &f64| QuantileReport {
        share,
        value: if values.is_empty() { f64::NAN } else { quantile(&values, share) },
        interval: quantile_interval(&values, share, task.level),
    };
    DistributionReport {
        of: Subject::of(study, row, nominal.readings[index].map_or(f64::NAN, |r| r.value)),
        mean,
        deviation,
        min,
        max,
        quantiles: task.quantiles.iter().map(one).collect(),
        met: (row.demand != Demand::None)
            .then(|| share(answers.iter().filter(|e| met(row, e, index)).count(), answers.len(), task.level)),
        failed: answers.len() - values.len(),
    }
}

/// Formats the distributions as sentences.
fn words(
    criteria: &[DistributionReport],
    all: Option<ShareReport>,
    task: &MonteCarloTask,
    (samples, is_monitored): (usize, bool),
) -> Vec<String> {
    let percent = |share: f64| format!("{} %", significant(100.0 * share, 4));
    let estimate = |share: &ShareReport| {
        let [low, high] = share.interval;
        format!(
            "{} of {samples} samples ({}; {} confidence interval {} to {})",
            share.count,
            percent(share.share),
            percent(task.level),
            percent(low),
            percent(high)
        )
    };
    let aside = if is_monitored { " but those of monitored criteria" } else { "" };
    let mut words: Vec<String> =
        all.iter().map(|all| format!("All demands{aside} are met in {}.", estimate(all))).collect();
    for found in criteria {
        let DistributionReport { of, mean, deviation, met, failed, .. } = found;
        let unit = if of.unit == "1" { String::new() } else { format!(" {}", of.unit) };
        let demand = met.as_ref().map_or_else(String::new, |met| format!(" Its demand is met in {}.", estimate(met)));
        let failed =
            if *failed > 0 { format!(" {failed} samples have no value and count as missed.") } else { String::new() };
        words.push(format!(
            "`{}` in case `{}` has the mean {}{unit} and the standard deviation {}{unit}.{demand}{failed}",
            of.criterion,
            of.case,
            significant(*mean, 4),
            significant(*deviation, 3)
        ));
    }
    if task.method != Sampling::Random {
        words.push(
            "The intervals are conservative, as the samples are evenly spread instead of independent.".to_owned(),
        );
    }
    words
}
