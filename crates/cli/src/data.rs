//! `mops data`: summary of a data file.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use mops_content::{
    numbers::FileNames,
    plot::{Color, Curve, Plot},
    sampling::thinned,
};
use mops_data::{DataFile, unit_since_1970};
use mops_diagnosis::noise_of;
use mops_language::Diagnostic;
use mops_outcome::identification::{excitation_report, spacing};
use mops_output::{Inputs, Outputs};
use mops_report::Draw;
use mops_tasks::excitation;

use super::blocks;
use crate::terminal::{CommandError, number, print, table};

/// Arguments of `mops data`.
#[derive(Args)]
pub(super) struct Arguments {
    /// CSV file, or MATLAB file of level 4 or 5.
    file: PathBuf,
    /// Time column [default: `t`, `time`, `Zeit` and the like, or the first column of time stamps].
    #[arg(long, value_name = "COLUMN")]
    time: Option<String>,
    /// Print the order of persistent excitation of this column as an input.
    #[arg(long, value_name = "COLUMN")]
    excitation: Option<String>,
    /// Print mean and standard deviation of every column between two times, in the unit of the time column, at which
    /// the plant is at rest: the noise of the sensors.
    #[arg(long, num_args = 2, value_names = ["FROM", "TO"], allow_negative_numbers = true, conflicts_with = "excitation")]
    rest: Option<Vec<f64>>,
    /// Write a plot of every column over time, as SVG or PNG by the extension: columns.svg gives columns-NAME.svg for
    /// each of several.
    #[arg(long, value_name = "FILE", conflicts_with = "excitation")]
    plot: Option<PathBuf>,
}

pub(super) fn data(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let file = DataFile::read(&arguments.file)?;
    let names = file.column_names();
    let time = match &arguments.time {
        Some(time) => {
            file.column(time)?;
            names.iter().find(|name| file.is_same(name, time)).cloned()
        }
        None => file.time_column(),
    };
    if let Some(column) = &arguments.excitation {
        print(&excitation(&file, time.as_deref(), column, &arguments.file.display().to_string())?)?;
        return Ok(ExitCode::SUCCESS);
    }
    if let Some(rest) = &arguments.rest {
        print(&at_rest(&file, time, [rest[0], rest[1]])?)?;
        return Ok(ExitCode::SUCCESS);
    }
    if let Some(path) = &arguments.plot {
        let mut inputs = Inputs::default();
        inputs.add(&arguments.file, "the data file");
        for written in plot(&file, time, (path, &Outputs::besides(inputs)))? {
            print(&format!("wrote {}\n", written.display()))?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let times = time.as_ref().map(|name| file.column(name)).transpose()?.map(|column| column.values);
    let mut rows = Vec::new();
    let (mut sampling, mut unknown, mut advice) = (String::new(), Vec::new(), Vec::new());
    for name in &names {
        let column = file.column(name)?;
        let finite = || column.values.iter().copied().filter(|v| v.is_finite());
        let (mut count, mut low, mut high) = (0, f64::INFINITY, f64::NEG_INFINITY);
        finite().for_each(|value| (count, low, high) = (count + 1, low.min(value), high.max(value)));
        let is_time = time.as_ref() == Some(name);
        if is_time {
            sampling = sample_time(name, column.unit.unwrap_or("s"), &finite().collect::<Vec<f64>>());
            if let (None, Some(unit)) = (column.unit, finite().next().and_then(unit_since_1970)) {
                advice.push(format!("`{name}`: counts as s, but is probably in {unit} since 1970; see `time-unit`\n"));
            }
        }
        let noise = if is_time || is_switched(column.values) { None } else { noise(column.values, times) };
        if let (Some(times), Some(noise)) = (times, noise) {
            let unit = time.as_ref().and_then(|time| file.column(time).ok()?.unit).unwrap_or("s");
            advice.extend(suspicious_start(name, (times, unit), column.values, noise));
        }
        if noise.is_none() && !is_time {
            unknown.push(format!("`{name}`"));
        }
        rows.push(vec![
            name.clone(),
            column.unit.unwrap_or("").to_owned(),
            column.values.len().to_string(),
            (column.values.len() - count).to_string(),
            number(low),
            number(high),
            finite().next().map_or_else(String::new, number),
            finite().next_back().map_or_else(String::new, number),
            noise.map_or_else(|| "-".to_owned(), number),
        ]);
    }
    let header = ["column", "unit", "rows", "gaps", "min", "max", "first", "last", "noise (est.)"];
    let mut text =
        format!("{}: {}\n\n{}", arguments.file.display(), file.format, table(&header, &[2, 3, 4, 5, 6, 7, 8], rows));
    if !sampling.is_empty() {
        text += &format!("\n{sampling}\n");
    }
    if !unknown.is_empty() {
        let names = unknown.join(", ");
        text += &format!(
            "no noise estimate for {names}: needs seven consecutive samples that are not all equal, and no switching between \
             constant values\n"
        );
    }
    for line in advice {
        text += &line;
    }
    for remark in file.remarks() {
        text += &format!("note: {remark}\n");
    }
    for skipped in &file.skipped {
        text += &format!("skipped: {skipped}\n");
    }
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// Formats the order of persistent excitation of a column.
fn excitation(file: &DataFile, time: Option<&str>, name: &str, shown: &str) -> Result<String, Diagnostic> {
    let column = file.column(name)?;
    if let Some(gap) = column.values.iter().position(|v| !v.is_finite()) {
        return Err(Diagnostic::new(format!("`{name}` has a gap at row {}", gap + 1))
            .with_help("fill the gap or cut the file: an input needs a value at every sample"));
    }
    let step = match time {
        Some(time) => spacing(file.column(time)?.values).ok_or_else(|| {
            Diagnostic::new(format!("the samples are not equally spaced in `{time}`"))
                .with_help("resample them in a study: task = \"excitation\" with `sample-time` in [excitation]")
        })?,
        None => f64::NAN,
    };
    let unit = column.unit.unwrap_or("");
    let report = excitation_report(column.values, None, [shown, name, unit], step, None);
    let reports = [report];
    let words = reports.iter().map(|report| report.words.clone()).collect();
    Ok(blocks::text(&excitation::lines_of_inputs(&reports, words)))
}

/// Largest deviation of a sample from the line through the next two that noise explains, in standard deviations of the
/// noise: with weights 1, -2 and 1 that is `5 sqrt 6`, where 5 is rare for a normal distribution.
const STARTS: f64 = 12.2;

/// Returns advice on the first samples of a column: how many to skip, and from when on it moves.
fn suspicious_start(name: &str, (times, unit): (&[f64], &str), values: &[f64], noise: f64) -> Option<String> {
    let samples: Vec<(f64, f64)> =
        times.iter().zip(values).filter(|(t, v)| t.is_finite() && v.is_finite()).map(|(&t, &v)| (t, v)).collect();
    let off = |k: usize| (samples[k].1 - 2.0 * samples[k + 1].1 + samples[k + 2].1).abs();
    let typical = (3..samples.len().saturating_sub(2).min(13)).map(off).fold(STARTS * noise, f64::max);
    // A wrong sample is far from the line through the next two, which themselves are not.
    if samples.len() >= 8 && off(0) > 3.0 * typical && off(1) <= typical {
        let (first, next) = (number(samples[0].1), number(samples[1].1));
        return Some(format!("`{name}`: the first sample ({first}) lies far from the next one ({next}): skip = 1\n"));
    }
    // Rest at first: the mean of the first samples holds for a tenth of the record.
    let rest = samples.iter().take(10).map(|(_, v)| v).sum::<f64>() / 10.0;
    let moves = samples.iter().position(|(_, v)| (v - rest).abs() > 6.0 * noise)?;
    (noise > 0.0 && moves > (samples.len() / 10).max(20)).then(|| {
        format!(
            "`{name}`: at rest until {} {unit}; `from` can cut that off, and `--rest` measures its noise\n",
            number(samples[moves].0)
        )
    })
}

/// Formats mean and standard deviation of every column between two times.
#[allow(clippy::cast_precision_loss)]
fn at_rest(file: &DataFile, time: Option<String>, [from, to]: [f64; 2]) -> Result<String, Diagnostic> {
    let time = time.ok_or_else(|| file.without_time("name it with `--time`"))?;
    let times = file.column(&time)?.values;
    let mut rows = Vec::new();
    for name in file.column_names().iter().filter(|name| **name != time) {
        let column = file.column(name)?;
        let samples = times.iter().zip(column.values).filter(|(t, v)| (from..=to).contains(*t) && v.is_finite());
        let values: Vec<f64> = samples.map(|(_, &v)| v).collect();
        if values.len() < 2 {
            let fact = format!("`{name}` has {} samples between {} and {}", values.len(), number(from), number(to));
            let all = format!("`{time}` is from {} to {}", number(times[0]), number(times[times.len() - 1]));
            return Err(Diagnostic::new(fact).with_help(all));
        }
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let deviation = (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0)).sqrt();
        // The difference of the means of both halves shows a drift.
        let half = values.len() / 2;
        let of = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let drift = of(&values[half..]) - of(&values[..half]);
        let unit = column.unit.unwrap_or("").to_owned();
        rows.push(vec![name.clone(), unit, values.len().to_string(), number(mean), number(deviation), number(drift)]);
    }
    let header = ["column", "unit", "samples", "mean", "standard deviation", "second half - first"];
    Ok(table(&header, &[2, 3, 4, 5], rows))
}

/// Plots every column over time, each in a file of its own if there are several, and returns the files.
fn plot(
    file: &DataFile,
    time: Option<String>,
    (path, outputs): (&Path, &Outputs),
) -> Result<Vec<PathBuf>, CommandError> {
    let end = path.extension().and_then(|end| end.to_str()).unwrap_or_default();
    if !["svg", "png"].contains(&end) {
        return Err(Diagnostic::new(format!("`{}` is neither .svg nor .png", path.display()))
            .with_help("name a file such as columns.svg")
            .into());
    }
    let mut plots = Vec::new();
    for name in file.column_names().iter().filter(|name| time.as_ref() != Some(name)) {
        let column = file.column(name)?;
        let times = match &time {
            Some(time) => file.column(time)?.values.to_vec(),
            None => (0..column.values.len()).map(|row| row as f64).collect(),
        };
        let of_time = time.as_ref().and_then(|time| file.column(time).ok()?.unit.map(str::to_owned));
        let x_label = match (&time, of_time) {
            (Some(time), Some(unit)) => format!("{time} ({unit})"),
            (Some(time), None) => time.clone(),
            (None, _) => "row".to_owned(),
        };
        let points = thinned(times.iter().copied().zip(column.values.iter().copied()).collect());
        plots.push(Plot {
            title: name.clone(),
            x_label,
            y_label: column.unit.map_or_else(|| name.clone(), |unit| format!("{name} ({unit})")),
            curves: vec![Curve { points, color: Color::Measured, ..Curve::default() }],
            ..Plot::default()
        });
    }
    let several = plots.len() > 1;
    let (mut names_of_files, mut written) = (FileNames::default(), Vec::new());
    for plot in &plots {
        let place = match several {
            true => path.with_file_name(format!(
                "{}-{}.{end}",
                path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default(),
                names_of_files.unique(&plot.title)
            )),
            false => path.to_owned(),
        };
        match end {
            "svg" => outputs.write(&place, plot.svg()),
            _ => plot.png().and_then(|bytes| outputs.write(&place, bytes)),
        }
        .map_err(CommandError::cannot_write(&place))?;
        written.push(place);
    }
    Ok(written)
}

fn sample_time(name: &str, unit: &str, times: &[f64]) -> String {
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let (Some(least), Some(most)) = (steps.first(), steps.last()) else { return String::new() };
    let median = steps[steps.len() / 2];
    let order = if *least > 0.0 { "" } else { "; not strictly increasing" };
    // Seconds since 1970 differ in digits that a rounded number lacks.
    let (first, last) = (times[0], times[times.len() - 1]);
    let ends = match number(first) == number(last) {
        true => format!("{first} on, for {}", number(last - first)),
        false => format!("{} to {}", number(first), number(last)),
    };
    format!(
        "`{name}` ({unit}) from {ends}, step {} (median), {} (min), {} (max){order}",
        number(median),
        number(*least),
        number(*most)
    )
}

/// Smallest jump between two samples, as a part of the range of a column, at which a record is divided: a turn of a
/// wrapped angle, or a placeholder for a missing value.
const JUMP: f64 = 0.8;

/// Smallest step of a signal that switches between constant values, as a part of its range.
const SWITCH: f64 = 0.05;

/// Returns true if a column is constant at most samples and else steps by a considerable part of its range, as an input
/// that a program sets.
fn is_switched(values: &[f64]) -> bool {
    let values: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let mut steps: Vec<f64> =
        values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let Some(median) = steps.get(steps.len() / 2) else { return false };
    2 * steps.len() < values.len() && *median > SWITCH * range(&values)
}

/// Returns the difference of the largest and the smallest value.
fn range(values: &[f64]) -> f64 {
    let (low, high) =
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)));
    high - low
}

/// Estimates the standard deviation of white noise on a smooth signal, in each part of the record between two gaps.
/// Empty cells are skipped; a distance of more than 1.5 times the median distance between samples is a gap, and so is a
/// jump over most of the range. `None` if no part has enough samples.
pub(super) fn noise(values: &[f64], times: Option<&[f64]>) -> Option<f64> {
    let times = times.filter(|times| times.len() == values.len());
    #[allow(clippy::cast_precision_loss)]
    let at = |row: usize| times.map_or(row as f64, |times| times[row]);
    let rows: Vec<usize> = (0..values.len()).filter(|&row| values[row].is_finite() && at(row).is_finite()).collect();
    let (times, values): (Vec<f64>, Vec<f64>) = rows.iter().map(|&row| (at(row), values[row])).unzip();
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let longest = 1.5 * steps.get(steps.len() / 2)?;
    let jump = JUMP * range(&values);
    let jumps = |k: usize| times[k] - times[k - 1] > longest || (values[k] - values[k - 1]).abs() > jump;
    let ends = (1..=times.len()).filter(|&k| k == times.len() || jumps(k));
    let mut start = 0;
    let parts: Vec<(&[f64], &[f64])> = ends
        .map(|end| {
            let part = start..end;
            start = end;
            (&times[part.clone()], &values[part])
        })
        .collect();
    noise_of(&parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_not_estimated_across_gaps_and_wrong_samples_do_not_count() {
        // A fixed sequence that is as good as white, of standard deviation 0.1, on a steep ramp.
        let white = |k: u32| ((f64::from(k * k + 7 * k) * 0.618_033_988_749_894_9).fract() - 0.5) * 0.12f64.sqrt();
        let values: Vec<f64> = (0..400).map(|k| 5.0 * f64::from(k) + white(k)).collect();
        let times: Vec<f64> = (0..400).map(f64::from).collect();
        let near = |found: Option<f64>| assert!((found.unwrap() - 0.1).abs() < 0.03, "{found:?}");
        near(noise(&values, None));
        let mut holed = values.clone();
        holed[140..161].fill(f64::NAN);
        near(noise(&holed, Some(&times)));
        // The rows themselves are missing.
        let without = |all: &[f64]| [&all[..140], &all[161..]].concat();
        near(noise(&without(&values), Some(&without(&times))));
        // A logger at one fifth of the rate of the file, with and without times.
        let slow: Vec<f64> = (0..2000).map(|i| if i % 5 == 2 { values[i / 5] } else { f64::NAN }).collect();
        let rows: Vec<f64> = (0..2000).map(|i| 0.01 * f64::from(i)).collect();
        near(noise(&slow, Some(&rows)));
        near(noise(&slow, None));
        let mut wrong = values;
        wrong[0] = 1e6;
        wrong[250..].iter_mut().for_each(|value| *value += 1e3);
        near(noise(&wrong, None));
        assert_eq!(noise(&wrong[..6], None), None);
    }
}
