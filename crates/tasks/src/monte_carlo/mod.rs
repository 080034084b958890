//! `task = "monte-carlo"`: distribution of the criteria under uncertain parameters.

mod section;

use std::sync::Arc;

use mops_core::{Demand, Evaluation, Problem, Study, Usage, Watch, study::Row, task::MonteCarloTask};
use mops_math::stream;
use mops_statistics::{Sampling, Summary, draw, quantile, quantile_interval, share_interval};

use crate::uncertain::{DistributionReport, MonteCarloReport, QuantileReport, ShareReport, Subject, uncertain_reports};

use mops_content::{
    numbers::{counted, significant},
    section::{Block, Section, Tone, Verdict},
    write_header,
};
use mops_outcome::{BlockKind, Outcome};

use crate::batches::{Stage, each};
use crate::copies::{Copies, evaluate_at};
use crate::room::{Judgement, Origin, OutputFile, OutputNames, Room, Solution, TaskCommand, solve_at};
use crate::search::{Options, SolveError, Solved};
use crate::uncertain::{interrupted, lines_of_parameters};

/// `task = "monte-carlo"`.
pub struct MonteCarlo;

impl Room for MonteCarlo {
    fn title(&self) -> &'static str {
        "Monte Carlo"
    }

    fn perform(&self, study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
        perform(study, options, watch)
    }

    fn command(&self) -> Option<TaskCommand> {
        Some(TaskCommand {
            name: "monte-carlo",
            about: "Sample the uncertain parameters of a study: shares that meet the demands, distributions",
            after_help: "",
            has_solver: true,
            options: &[],
        })
    }

    fn blocks(&self) -> Vec<BlockKind> {
        vec![BlockKind::of::<MonteCarloReport>()]
    }

    fn verdict(&self, of: &Solution<'_>) -> Judgement {
        let found = of.outcome.found.get::<MonteCarloReport>();
        let Some((found, words)) = found.and_then(|found| Some((found, found.words.first()?))) else {
            return Judgement::OfPoint(interrupted());
        };
        if found.criteria.iter().all(|of| of.failed == found.samples) {
            let text = format!("No criterion has a value at any of {}.", counted(found.samples, "sample"));
            return Judgement::OfFindings(Verdict::new(Tone::Bad, text));
        }
        let is_missed = match &found.all {
            Some(all) => all.count < all.of,
            None => found.criteria.iter().flat_map(|of| &of.met).any(|met| met.count < met.of),
        };
        let is_whole = !is_missed && found.criteria.iter().all(|of| of.failed == 0);
        Judgement::OfFindings(Verdict::new(if is_whole { Tone::Good } else { Tone::Mixed }, words))
    }

    fn findings(&self, of: &Solution<'_>) -> Vec<Section> {
        of.outcome.found.get::<MonteCarloReport>().map(section::of).into_iter().collect()
    }

    fn lines(&self, outcome: &Outcome) -> Vec<Block> {
        let Some(found) = outcome.found.get::<MonteCarloReport>() else { return Vec::new() };
        vec![
            Block::Table(lines_of_parameters(&found.parameters)),
            Block::Table(section::lines(found)),
            Block::Findings(found.words.clone()),
        ]
    }

    fn samples_uncertain(&self, _study: &Study) -> bool {
        true
    }

    fn outputs(&self) -> OutputNames {
        OutputNames { files: &["samples.csv"], folders: &[] }
    }

    fn files(&self, of: &Solution<'_>, _origin: &Origin<'_>) -> Vec<OutputFile> {
        let found = of.outcome.found.get::<MonteCarloReport>();
        found.map(|found| OutputFile::new("samples.csv", samples(found))).into_iter().collect()
    }
}

/// Returns one line per sample: uncertain parameters, criteria.
fn samples(found: &MonteCarloReport) -> Vec<u8> {
    const IN_MEMORY: &str = "memory can be written";
    let mut writer = csv::Writer::from_writer(Vec::new());
    let parameters = found.parameters.iter().map(|p| format!("{}[{}]", p.name, p.unit));
    let criteria = found.criteria.iter().map(|c| format!("{}/{}[{}]", c.of.case, c.of.criterion, c.of.unit));
    write_header(&mut writer, parameters.chain(criteria)).expect(IN_MEMORY);
    for (parameters, values) in &found.table {
        writer.write_record(parameters.iter().chain(values).map(f64::to_string)).expect(IN_MEMORY);
    }
    writer.into_inner().expect(IN_MEMORY)
}

fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    let task = study.options::<MonteCarloTask>().cloned().unwrap_or_default();
    let mut solved = solve_at(task.at, study, options, watch)?;
    let over = Arc::new(solved.problem.study().over_uncertain(&solved.best.tuners));
    let problem = Problem::new(Arc::clone(&over));
    let store = Copies::of(options, solved.problem.study(), &over, &[]);
    let uncertain = &over.uncertain();
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
    solved.outcome.found.add(report);
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
        let place = format!("`{}` in case `{}`", of.criterion, of.case);
        if *failed == samples {
            words.push(format!("{place} has no value at any of {}.", counted(samples, "sample")));
            continue;
        }
        let counted_as = if met.is_some() { " and count as missed" } else { "" };
        let failed = if *failed > 0 { format!(" {failed} samples have no value{counted_as}.") } else { String::new() };
        words.push(format!(
            "{place} has the mean {}{unit} and the standard deviation {}{unit}.{demand}{failed}",
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
