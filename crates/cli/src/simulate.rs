//! `mops simulate`: simulates the models of a study once at given values.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use mops_content::{
    numbers::{FileNames, counted},
    plot::{Color, Curve, Plot},
    sampling::points,
    write_header,
};
use mops_core::{Analysis, Catalogue, Failure, Problem, Response, Study, Usage, study::JobPlan};
use mops_language::{Diagnostic, Quantity, suggestion};
use mops_output::Outputs;
use mops_report::Draw;

use super::families::{folded, runs, spelled};
use super::study::{StudyArguments, home, open, outputs};
use super::tables::criteria;
use crate::terminal::{CommandError, Limit, cancel_after, number, print, table};

/// Arguments of `mops simulate`.
#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    /// Value of a tuner instead of its start value: --at k=5.48 --at "Ti=4.67 s".
    #[arg(long = "at", value_name = "TUNER=VALUE")]
    at: Vec<String>,
    /// Simulate this case only.
    #[arg(long)]
    case: Option<String>,
    /// Number of equally spaced samples in the CSV file.
    #[arg(long, default_value_t = 1001, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    samples: u32,
    #[command(flatten)]
    limit: Limit,
    /// Folder for CSV files and plots; without it, no files are written.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(super) fn simulate(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let file = open(catalogue, &arguments.study)?;
    let outputs = outputs(&home(catalogue, &arguments.study), &file);
    let mut study = file.study;
    study.cancelled_by(&cancel_after(arguments.limit));
    let tuners = values(&study, &arguments.at)?;
    if let Some(case) = &arguments.case {
        let names = study.cases().iter().map(|c| c.name.as_str());
        if !names.clone().any(|name| name == case) {
            return Err(Diagnostic::new(format!("the study has no case `{case}`"))
                .with_help(suggestion(case, names))
                .into());
        }
    }
    let problem = Problem::new(Arc::new(study));
    let study = problem.study();
    let wanted = |case: &str| arguments.case.as_ref().is_none_or(|only| only == case);
    let (names, mut taken) = names(study, &wanted);
    if let Some(folder) = &arguments.out {
        for path in names.iter().flatten().map(|name| folder.join(format!("{name}.csv"))) {
            outputs.check(&path).map_err(CommandError::cannot_write(&path))?;
        }
    }
    let start = problem.evaluate_at(&study.start());
    let here = problem.evaluate_at(&tuners);
    let pick = |evaluation| {
        let mut reports = mops_outcome::criterion_reports(study, evaluation);
        reports.retain(|report| wanted(&report.case));
        reports
    };
    print(&criteria(&pick(&start), &pick(&here), "here"))?;
    let failures = || here.failures.iter().filter(|(job, _)| wanted(&study.cases()[study.jobs()[*job].case].name));
    let criteria = failures().filter(|(_, why)| matches!(why, Failure::Criterion(_)));
    // A monitored criterion demands nothing.
    let lacks = |row: usize| study.rows()[row].usage != Usage::Monitor && here.readings[row].is_none();
    let of_wanted = |row: usize| wanted(&study.cases()[study.jobs()[study.rows()[row].job].case].name);
    let mut failed = failures().any(|(_, why)| !matches!(why, Failure::Criterion(_)))
        || (0..study.rows().len()).any(|row| of_wanted(row) && lacks(row));
    for (job, why) in criteria {
        print(&format!("no value in case {}: {why}\n", study.cases()[study.jobs()[*job].case].name))?;
    }
    for (job, plan) in study.jobs().iter().enumerate() {
        let (model, case) = (&study.models()[plan.model].0, &study.cases()[plan.case].name);
        let Some(name) = &names[job] else { continue };
        match problem.analyse_all(job, &tuners, None) {
            Err(failure) => {
                failed = true;
                print(&format!("\n{model} in case {case}: {failure}\n"))?;
            }
            Ok(Analysis::Linear(system)) => {
                print(&format!("\n{model} in case {case}: linear system with {} states\n", system.states.len()))?;
            }
            Ok(Analysis::Time(response)) => {
                print(&format!("\n{model} in case {case}\n\n{}", summary(study, plan.model, &response)))?;
                if let Some(folder) = &arguments.out {
                    let run = Simulated { name, study, model: plan.model, response: &response };
                    run.write((folder, &outputs), arguments.samples, &mut taken)?;
                }
            }
        }
    }
    if let Some(folder) = &arguments.out {
        print(&format!("\nCSV files and plots are in {}\n", folder.display()))?;
    }
    if failed {
        Err(CommandError::Failure("a simulation failed or a criterion has no value".into()))
    } else {
        Ok(ExitCode::SUCCESS)
    }
}

/// Returns the values of all tuners: the start values, overridden by the command line.
fn values(study: &Study, given: &[String]) -> Result<Vec<f64>, CommandError> {
    let mut values = study.start();
    for text in given {
        let (name, value) = text
            .split_once('=')
            .ok_or_else(|| Diagnostic::new(format!("`--at {text}` has no value")).with_help("write --at k=5.48"))?;
        let names = study.tuners().iter().map(|t| t.name.as_str());
        let index = study.tuners().iter().position(|t| t.name == name.trim()).ok_or_else(|| {
            Diagnostic::new(format!("the study has no tuner `{}`", name.trim()))
                .with_help(suggestion(name.trim(), names))
        })?;
        let quantity = Quantity::parse(value).map_err(|why| Diagnostic::new(format!("`--at {text}`: {why}")))?;
        values[index] =
            quantity.to(&study.tuners()[index].unit).map_err(|why| Diagnostic::new(format!("`--at {text}`: {why}")))?;
    }
    for (tuner, &value) in study.tuners().iter().zip(&values) {
        let [low, high] = tuner.bounds;
        let on_grid = tuner.tie.is_some()
            || !tuner.active
            || (tuner.value_at(tuner.position_of(value)) - value).abs() <= 1e-9 * (1.0 + value.abs());
        if !on_grid {
            print(&format!(
                "note: {} = {} is outside its bounds [{}, {}] or off its grid\n",
                tuner.name,
                number(value),
                number(low),
                number(high)
            ))?;
        }
    }
    study.apply_ties(&mut values);
    Ok(values)
}

fn summary(study: &Study, model: usize, response: &Response) -> String {
    let units = &study.models()[model].1.interface().signals;
    let rows = response.traces.iter().zip(units).map(|((name, trace), signal)| {
        let ((high, high_at), (low, low_at)) = (trace.maximum(), trace.minimum());
        vec![
            name.clone(),
            signal.unit.to_string(),
            number(trace.first()),
            number(low),
            number(low_at),
            number(high),
            number(high_at),
            number(trace.last()),
        ]
    });
    let header = ["signal", "unit", "start", "min", "at s", "max", "at s", "end"];
    let mut text = table(&header, &[2, 3, 4, 5, 6, 7], folded(rows.collect(), 0));
    let work = response.work;
    let [steps, derivatives] =
        [(work.steps, "step"), (work.derivatives, "derivative")].map(|(n, noun)| counted(n, noun));
    text += &format!("\n{steps}, {} rejected, {derivatives}\n", work.rejected);
    if work.rough > 0 {
        text += &format!("accuracy limited by rounding in {}\n", counted(work.rough, "step"));
    }
    for event in response.events.iter().take(20) {
        text += &format!("{:>12} s  {}\n", number(event.time), event.what);
    }
    if response.events.len() > 20 {
        text += &format!("and {} more events\n", response.events.len() - 20);
    }
    text
}

/// Returns the names of the CSV files of the wanted simulations, one for every job, and the generator of further names.
fn names(study: &Study, wanted: &dyn Fn(&str) -> bool) -> (Vec<Option<String>>, FileNames) {
    let mut names = FileNames::default();
    let of = |plan: &JobPlan| {
        let (model, case) = (&study.models()[plan.model].0, &study.cases()[plan.case].name);
        wanted(case).then(|| names.unique(&format!("{model}-{case}")))
    };
    (study.jobs().iter().map(of).collect(), names)
}

/// Simulation with the name of its CSV file.
struct Simulated<'a> {
    name: &'a str,
    study: &'a Study,
    model: usize,
    response: &'a Response,
}

impl Simulated<'_> {
    /// Writes samples and plots; the plots have names that are not `taken`.
    fn write(
        &self,
        (folder, outputs): (&Path, &Outputs),
        samples: u32,
        taken: &mut FileNames,
    ) -> Result<(), CommandError> {
        let Self { name, study, model, response } = self;
        std::fs::create_dir_all(folder).map_err(CommandError::cannot_write(folder))?;
        let end = response.traces.first().map_or(0.0, |(_, trace)| trace.end());
        let times: Vec<f64> = (0..samples).map(|i| end * f64::from(i) / f64::from(samples - 1)).collect();
        let units = &study.models()[*model].1.interface().signals;
        let columns: Vec<Vec<f64>> = response.traces.iter().map(|(_, trace)| trace.sample(&times)).collect();
        let path = folder.join(format!("{name}.csv"));
        let written = outputs.write_csv(&path, |writer| {
            let names = response.traces.iter().zip(units).map(|((name, _), s)| format!("{name}[{}]", s.unit));
            write_header(writer, ["t[s]".to_owned()].into_iter().chain(names))?;
            for (i, t) in times.iter().enumerate() {
                writer.write_record([t].into_iter().chain(columns.iter().map(|c| &c[i])).map(f64::to_string))?;
            }
            Ok(())
        });
        written.map_err(CommandError::cannot_write(&path))?;
        let signals: Vec<&str> = response.traces.iter().map(|(signal, _)| signal.as_str()).collect();
        for family in runs(&signals) {
            let (first, last) = (family.start, family.end - 1);
            let (signal, variable) = (spelled(signals[first], signals[last]), &units[first]);
            let curve = |(i, place): (usize, usize)| Curve {
                name: signals[place].to_owned(),
                points: points(&response.traces[place].1),
                color: if first == last { Color::Result } else { Color::Series(i) },
                ..Curve::default()
            };
            let plot = Plot {
                title: if variable.about.is_empty() { signal.clone() } else { format!("{signal}: {}", variable.about) },
                x_label: "time (s)".into(),
                y_label: format!("{signal} ({})", variable.unit),
                curves: spread(first, last).into_iter().enumerate().map(curve).collect(),
                ..Plot::default()
            };
            let file =
                if first == last { signal } else { signals[first].split('[').next().unwrap_or_default().to_owned() };
            let file = taken.unique(&format!("{name}-{file}"));
            let [svg, png] = ["svg", "png"].map(|end| folder.join(format!("{file}.{end}")));
            outputs.write(&svg, plot.svg()).map_err(CommandError::cannot_write(&svg))?;
            plot.png().and_then(|bytes| outputs.write(&png, bytes)).map_err(CommandError::cannot_write(&png))?;
        }
        Ok(())
    }
}

/// Returns at most six evenly spread indices from `first` to `last`, ends included.
fn spread(first: usize, last: usize) -> Vec<usize> {
    let steps = (last - first).clamp(1, 5);
    let mut places: Vec<usize> = (0..=steps).map(|i| first + i * (last - first) / steps).collect();
    places.dedup();
    places
}
