//! `task = "sensitivity"` with `method = "morris"` or `"sobol"`: global sensitivity to the uncertain parameters.

use mops_core::task::SensitivityTask;
use std::sync::Arc;

use mops_core::{Problem, Study, Watch, study::Row, task::SensitivityMethod};
use mops_math::stream;
use mops_statistics::{MOST_DIMENSIONS, elementary_effects, radial, trajectories, variance_shares};

use crate::uncertain::{EffectReport, EffectsReport, Estimated, GlobalSensitivityReport, Subject, uncertain_reports};

use mops_content::numbers::significant;

use crate::batches::{Stage, each};
use crate::copies::{Copies, evaluate_at};
use crate::search::{Options, Solved};

/// Default number of trajectories of the Morris method.
const TRAJECTORIES: usize = 20;
/// Default number of samples of the Sobol method.
const SAMPLES: usize = 512;

/// Confidence level of the intervals.
const LEVEL: f64 = 0.95;
/// Number of bootstrap samples for the intervals.
const REPLICATES: usize = 500;

/// Adds the global sensitivities at the design. A sample counts only if all its points have a value.
pub(super) fn add(solved: &mut Solved, options: &Options, watch: &dyn Watch) {
    let task = solved.problem.study().options::<SensitivityTask>().copied().unwrap_or_default();
    let over = Arc::new(solved.problem.study().over_uncertain(&solved.best.tuners));
    let problem = Problem::new(Arc::clone(&over));
    let store = Copies::of(options, solved.problem.study(), &over, &[]);
    let inputs = over.uncertain().len();
    let first = over.tuners().len() - inputs;
    let mut random = stream(over.seed(), "global-sensitivity");
    let (points, samples) = match task.method {
        SensitivityMethod::Morris => {
            let samples = task.samples.unwrap_or(TRAJECTORIES);
            (trajectories(samples, inputs, &mut random), samples)
        }
        _ => {
            let samples = task.samples.unwrap_or(SAMPLES);
            (radial(samples, inputs, &mut random), samples)
        }
    };
    let evaluate = |u: &Vec<f64>| -> Vec<Option<f64>> {
        let mut tuners = over.start();
        for ((value, uncertain), &u) in tuners[first..].iter_mut().zip(over.uncertain()).zip(u) {
            *value = uncertain.quantile(u);
        }
        evaluate_at(&problem, &tuners, store.as_ref()).readings.iter().map(|reading| reading.map(|r| r.value)).collect()
    };
    let stage = Stage { what: "sampling", from: 0.0, to: 1.0 };
    let answers = each(&points, stage, watch, |of_sample| of_sample.iter().map(evaluate).collect::<Vec<_>>());
    if answers.len() < points.len() {
        solved.outcome.stop = watch.halt().into();
    }
    let nominal = evaluate_at(&problem, &over.start(), store.as_ref());
    let simulations = (answers.iter().map(Vec::len).sum::<usize>() + 1) * over.jobs().len();
    solved.outcome.simulations += simulations;
    let sound = |row: usize| {
        let whole = points.iter().zip(&answers).filter(move |(_, a)| a.iter().all(|values| values[row].is_some()));
        whole.map(move |(p, a)| {
            (p.clone(), a.iter().map(|values| values[row].expect("checked above")).collect::<Vec<f64>>())
        })
    };
    let criteria = over.rows().iter().enumerate().map(|(i, row)| {
        let (points, values): (Vec<_>, Vec<_>) = sound(i).unzip();
        let of = Subject::of(&over, row, nominal.readings[i].map_or(f64::NAN, |r| r.value));
        EffectsReport { of, effects: effects(&over, (i, row), task.method, &points, &values) }
    });
    let criteria: Vec<EffectsReport> = criteria.collect();
    let failed = answers.iter().filter(|a| a.iter().flatten().any(Option::is_none)).count();
    let mut report = GlobalSensitivityReport {
        words: Vec::new(),
        method: task.method,
        parameters: uncertain_reports(&over),
        samples: answers.len(),
        failed,
        simulations,
        level: LEVEL,
        criteria,
    };
    report.words = words(&report, 2 * inputs > MOST_DIMENSIONS, samples);
    solved.outcome.found.add(report);
}

fn effects(
    study: &Study,
    (index, row): (usize, &Row),
    method: SensitivityMethod,
    points: &[Vec<Vec<f64>>],
    values: &[Vec<f64>],
) -> Vec<EffectReport> {
    let empty = |parameter: &str| EffectReport {
        parameter: parameter.to_owned(),
        mean: None,
        magnitude: None,
        deviation: None,
        first: None,
        total: None,
    };
    let names = study.uncertain().iter().map(|uncertain| empty(&uncertain.name));
    if values.len() < 3 {
        return Vec::new();
    }
    if method == SensitivityMethod::Morris {
        let found = elementary_effects(points, values);
        let one = |(report, e): (EffectReport, mops_statistics::ElementaryEffect)| EffectReport {
            mean: Some(e.mean),
            magnitude: Some(e.magnitude),
            deviation: Some(e.deviation),
            ..report
        };
        return names.zip(found).map(one).collect();
    }
    let mut random = stream(study.seed(), &format!("bootstrap {index} {}", row.name));
    let found = variance_shares(values, LEVEL, REPLICATES, &mut random).unwrap_or_default();
    let one = |(report, shares): (EffectReport, mops_statistics::VarianceShares)| EffectReport {
        first: Some(Estimated { value: shares.first, interval: shares.first_interval }),
        total: Some(Estimated { value: shares.total, interval: shares.total_interval }),
        ..report
    };
    names.zip(found).map(one).collect()
}

/// Formats the sensitivities as sentences.
fn words(report: &GlobalSensitivityReport, random: bool, asked: usize) -> Vec<String> {
    let mut words = Vec::new();
    for found in &report.criteria {
        let place = format!("`{}` in case `{}`", found.of.criterion, found.of.case);
        if found.effects.is_empty() {
            words.push(format!("{place} has a value at too few of {asked} samples for sensitivities."));
            continue;
        }
        let size = |e: &EffectReport| e.magnitude.or(e.total.map(|t| t.value)).unwrap_or(0.0);
        let mut sorted: Vec<&EffectReport> = found.effects.iter().collect();
        sorted.sort_by(|a, b| size(b).total_cmp(&size(a)));
        let Some(strongest) = sorted.first().filter(|e| size(e) > 0.0) else {
            words.push(format!("{place} does not depend on the uncertain parameters."));
            continue;
        };
        let unit = if found.of.unit == "1" { String::new() } else { format!(" {}", found.of.unit) };
        words.push(match strongest.total {
            Some(_) if found.effects.len() == 1 => {
                format!("`{}` is the only uncertain parameter, and {place} depends on it.", strongest.parameter)
            }
            Some(total) => {
                let first = || found.effects.iter().filter_map(|e| e.first);
                let [together, least] =
                    [1.0 - first().map(|f| f.value).sum::<f64>(), 1.0 - first().map(|f| f.interval[1]).sum::<f64>()];
                // What the intervals of the shares leave open is no interaction.
                let rest = if least > 0.0 {
                    format!(
                        "; interactions between parameters account for {}, at least {}",
                        percent(together),
                        percent(least)
                    )
                } else {
                    String::new()
                };
                format!(
                    "`{}` accounts for {} of the variance of {place} ({} confidence interval {} to {}), interactions included{rest}.",
                    strongest.parameter,
                    percent(total.value.min(1.0)),
                    percent(report.level),
                    percent(total.interval[0].max(0.0)),
                    percent(total.interval[1].min(1.0))
                )
            }
            None => format!(
                "`{}` has the largest effect on {place}: {}{unit} over its range on average.",
                strongest.parameter,
                significant(size(strongest), 3)
            ),
        });
        let weak: Vec<String> = sorted
            .iter()
            .filter(|e| size(e) < 0.01 * if e.total.is_some() { 1.0 } else { size(strongest) })
            .map(|e| format!("`{}`", e.parameter))
            .collect();
        if !weak.is_empty() {
            words.push(format!("Negligible effect on {place}: {}.", weak.join(", ")));
        }
    }
    if report.failed > 0 {
        words.push(format!("{} of {asked} samples were discarded: a simulation or a criterion failed.", report.failed));
    }
    if random && report.method == SensitivityMethod::Sobol {
        words.push("The samples are random, as the Sobol sequence has too few dimensions.".to_owned());
    }
    words
}

fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share, 3))
}
