//! `mops check`: reads a study and its data without running anything.

use mops_content::section::Block;
use mops_tasks::uncertain::lines_of_parameters;

use super::blocks;
use std::process::ExitCode;

use clap::Args;
use mops_core::{
    Case, Catalogue, Demand, Parameter, Study,
    case::{Channel, Experiment},
    study::{Grid, JobPlan, ParameterSource, Scale},
};
use mops_tasks::{suits, uncertain::uncertain_reports};

use super::families::folded;
use super::places::places;
use super::study::{StudyArguments, open};
use crate::terminal::{CommandError, number, print, table};

/// Arguments of `mops check`.
#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
}

pub(super) fn check(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let file = open(catalogue, &arguments.study)?;
    let study = &file.study;
    // A study without criteria is right, but has nothing to solve: a warning says so.
    if !study.rows().is_empty() {
        suits(study, &file.solver).map_err(|why| file.locate(&why.0))?;
    }
    let mut text = format!("{}: ok\n\n", study.name());
    let start = study.start();
    let tuners = study.tuners().iter().zip(&start).map(|(t, &start)| {
        let [low, high] = t.bounds.map(|bound| if bound.is_finite() { number(bound) } else { String::new() });
        let kind = match (&t.tie, t.active, &t.grid, t.scale) {
            (Some(_), ..) => "tied".to_owned(),
            (_, false, ..) => "inactive".to_owned(),
            (_, _, Grid::Integer, _) => "integer".to_owned(),
            (_, _, Grid::List(values), _) => {
                format!("one of {}", values.iter().map(|v| number(*v)).collect::<Vec<_>>().join(", "))
            }
            (_, _, _, Scale::Log) => "log".to_owned(),
            _ => String::new(),
        };
        vec![t.name.clone(), number(start), low, high, t.unit.to_string(), kind]
    });
    text += &table(&["tuner", "start", "min", "max", "unit", ""], &[1, 2, 3], folded(tuners.collect(), 0));
    let rows = study.rows().iter().map(|row| {
        let plan = &study.jobs()[row.job];
        let usage = format!("{:?}", row.usage).to_lowercase();
        vec![study.key(row), study.models()[plan.model].0.clone(), usage, demand(row.demand), row.unit.to_string()]
    });
    text += &section(&["criterion", "model", "usage", "demand", "unit"], &[3], rows.collect());
    text += &section(
        &["experiment", "role", "channel", "samples", "until", "noise", "unit"],
        &[3, 4, 5],
        study.cases().iter().flat_map(|case| channels(study, case)).collect(),
    );
    text += &section(&["case", "fixed parameter", "value", "unit"], &[2], fixed(study));
    if !study.uncertain().is_empty() {
        let reports = uncertain_reports(&study.over_uncertain(&start));
        text += &blocks::text(&[Block::Table(lines_of_parameters(&reports))]);
    }
    let models = study.models().iter().map(|(name, model)| vec![name.clone(), places(model.interface())]);
    text += &section(&["model", "places for effects"], &[], models.filter(|row| !row[1].is_empty()).collect());
    for warning in study.warnings() {
        text += &format!("\nwarning: {warning}\n");
    }
    for note in study.notes() {
        text += &format!("\nnote: {note}\n");
    }
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// Formats a table after an empty line; returns an empty text if there are no rows.
fn section(header: &[&str], right: &[usize], rows: Vec<Vec<String>>) -> String {
    if rows.is_empty() { String::new() } else { format!("\n{}", table(header, right, rows)) }
}

/// Returns one row for each measured channel of the experiment of a case.
fn channels(study: &Study, case: &Case) -> Vec<Vec<String>> {
    let signals = || study.models().iter().flat_map(|(_, model)| &model.interface().signals);
    let of = |experiment: &Experiment| {
        let one = |(k, channel): (usize, &Channel)| {
            let once = |text: &str| if k == 0 { text.to_owned() } else { String::new() };
            let until = channel.times.last().map_or_else(String::new, |end| format!("{} s", number(*end)));
            vec![
                once(&case.name),
                once(experiment.role.name()),
                channel.signal.clone(),
                channel.values.len().to_string(),
                until,
                channel.noise.map_or_else(|| "not given".to_owned(), number),
                signals()
                    .find(|s| s.name == channel.signal)
                    .map_or_else(String::new, |s| s.unit.difference().to_string()),
            ]
        };
        experiment.channels.iter().enumerate().map(one).collect()
    };
    case.experiment.as_ref().map_or_else(Vec::new, of)
}

/// Returns one row for each parameter that is not a tuner; equal values in all cases share a row.
fn fixed(study: &Study) -> Vec<Vec<String>> {
    let of_job = |job: &JobPlan| {
        let names = &study.models()[job.model].1.interface().parameters;
        let one = |(p, source): (&Parameter, &ParameterSource)| match source {
            ParameterSource::Constant(value) => {
                Some(vec![p.variable.name.clone(), number(*value), p.variable.unit.to_string()])
            }
            ParameterSource::Tuner { .. } => None,
        };
        names.iter().zip(&job.parameters).filter_map(one).collect::<Vec<_>>()
    };
    let of_jobs: Vec<Vec<Vec<String>>> = study.jobs().iter().map(of_job).collect();
    let everywhere = |row: &&Vec<String>| of_jobs.len() > 1 && of_jobs.iter().all(|rows| rows.contains(row));
    let row = |case: &str, row: &Vec<String>| [&[case.to_owned()], row.as_slice()].concat();
    let alike = of_jobs.first().into_iter().flatten().filter(everywhere).map(|r| row("all", r));
    let own =
        study.jobs().iter().zip(&of_jobs).flat_map(|(job, rows)| {
            rows.iter().filter(|r| !everywhere(r)).map(|r| row(&study.cases()[job.case].name, r))
        });
    folded(alike.chain(own).collect(), 1)
}

fn demand(demand: Demand) -> String {
    match demand {
        Demand::AtMost(value) => number(value),
        Demand::AtLeast(value) => format!("at least {}", number(value)),
        Demand::Pair { good, bad } => format!("{} .. {}", number(good), number(bad)),
        Demand::None => String::new(),
    }
}
