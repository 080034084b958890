//! `mops data`: summary of a data file.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use mops_core::Diagnostic;
use mops_core::data::DataFile;
use mops_core::identification::{excitation_report, spacing};
use mops_core::math;

use super::findings;
use crate::terminal::{CommandError, number, print, table};

/// Arguments of `mops data`.
#[derive(Args)]
pub(super) struct Arguments {
    /// CSV file, or MATLAB file of level 4 or 5.
    file: PathBuf,
    /// Print the order of persistent excitation of this column as an input.
    #[arg(long, value_name = "COLUMN")]
    excitation: Option<String>,
}

pub(super) fn data(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let file = DataFile::read(&arguments.file)?;
    let names = file.column_names();
    if let Some(column) = &arguments.excitation {
        print(&excitation(&file, column, &arguments.file.display().to_string())?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let time = file.time_column();
    let times = time.as_ref().map(|name| file.column(name)).transpose()?.map(|column| column.values);
    let mut rows = Vec::new();
    let (mut sampling, mut unknown) = (String::new(), Vec::new());
    for name in &names {
        let column = file.column(name)?;
        // N.B.: values are not collected, as a second copy of a large file may not fit in memory.
        let finite = || column.values.iter().copied().filter(|v| v.is_finite());
        let (mut count, mut low, mut high) = (0, f64::INFINITY, f64::NEG_INFINITY);
        finite().for_each(|value| (count, low, high) = (count + 1, low.min(value), high.max(value)));
        if time.as_ref() == Some(name) {
            sampling = sample_time(name, &finite().collect::<Vec<f64>>());
        }
        let noise = noise(column.values, times);
        if noise.is_none() {
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
        text += &format!("no noise estimate for {names}: needs {MIN_DIFFERENCES} groups of four consecutive samples\n");
    }
    for skipped in &file.skipped {
        text += &format!("skipped: {skipped}\n");
    }
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// Formats the order of persistent excitation of a column.
fn excitation(file: &DataFile, name: &str, shown: &str) -> Result<String, Diagnostic> {
    let column = file.column(name)?;
    if let Some(gap) = column.values.iter().position(|v| !v.is_finite()) {
        return Err(Diagnostic::new(format!("`{name}` has a gap at row {}", gap + 1))
            .with_help("fill the gap or cut the file: an input needs a value at every sample"));
    }
    let time = file.time_column();
    let step = match time {
        Some(time) => spacing(file.column(&time)?.values).ok_or_else(|| {
            Diagnostic::new(format!("the samples are not equally spaced in `{time}`"))
                .with_help("resample them in a study: task = \"excitation\" with `sample-time` in [excitation]")
        })?,
        None => f64::NAN,
    };
    let unit = column.unit.unwrap_or("");
    let report = excitation_report(column.values, None, [shown, name, unit], step, None);
    Ok(findings::excitation(&[report]))
}

fn sample_time(name: &str, times: &[f64]) -> String {
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let (Some(least), Some(most)) = (steps.first(), steps.last()) else { return String::new() };
    let median = steps[steps.len() / 2];
    let order = if *least > 0.0 { "" } else { "; not strictly increasing" };
    format!(
        "`{name}` from {} to {}, step {} (median), {} (min), {} (max){order}",
        number(times[0]),
        number(times[times.len() - 1]),
        number(median),
        number(*least),
        number(*most)
    )
}

/// Smallest number of third differences for a noise estimate; its relative error is then about 20 %.
const MIN_DIFFERENCES: u32 = 20;

/// Estimates the standard deviation of white noise on a smooth signal from third differences, whose variance is 20 times that
/// of the noise.
///
/// Empty cells of the column are skipped. A distance of more than 1.5 times the median distance between samples is a gap, and
/// no difference is taken across a gap. Returns `None` with fewer than [`MIN_DIFFERENCES`] differences.
#[allow(clippy::cast_precision_loss)]
fn noise(values: &[f64], times: Option<&[f64]>) -> Option<f64> {
    let times = times.filter(|times| times.len() == values.len());
    let samples = || {
        let at = |row: usize| times.map_or(row as f64, |times| times[row]);
        values.iter().enumerate().filter(|(_, value)| value.is_finite()).map(move |(row, value)| (at(row), *value))
    };
    let mut steps: Vec<f64> = samples().zip(samples().skip(1)).map(|(a, b)| b.0 - a.0).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let longest = 1.5 * steps.get(steps.len() / 2)?;
    let (mut run, mut last, mut count, mut sum) = ([0.0; 4], f64::NEG_INFINITY, 0_u32, 0.0);
    let mut length = 0;
    for (time, value) in samples() {
        length = if time - last <= longest { length + 1 } else { 1 };
        run.rotate_left(1);
        (run[3], last) = (value, time);
        if length >= run.len() {
            count += 1;
            sum += math::powi(run[3] - 3.0 * run[2] + 3.0 * run[1] - run[0], 2);
        }
    }
    (count >= MIN_DIFFERENCES).then(|| (sum / f64::from(count) / 20.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::noise;

    /// Steep ramp with an alternating error of 0.1, whose third differences are 0.8.
    fn ramp(n: i32) -> (Vec<f64>, Vec<f64>) {
        let values = (0..n).map(|i| 5.0 * f64::from(i) + if i % 2 == 0 { 0.1 } else { -0.1 });
        ((0..n).map(f64::from).collect(), values.collect())
    }

    #[test]
    fn noise_is_not_estimated_across_gaps() {
        let expected = (0.64f64 / 20.0).sqrt();
        let near =
            |found: Option<f64>| assert!((found.unwrap() - expected).abs() < 1e-9, "{found:?} is not {expected}");
        let (times, values) = ramp(100);
        near(noise(&values, None));
        let mut holed = values.clone();
        holed[40..51].fill(f64::NAN);
        near(noise(&holed, Some(&times)));
        // The rows themselves are missing.
        let without = |all: &[f64]| [&all[..40], &all[51..]].concat();
        near(noise(&without(&values), Some(&without(&times))));
        assert!(noise(&without(&values), None).unwrap() > 2.0 * expected);
        assert_eq!(noise(&values[..22], None), None);
        assert!(noise(&values[..23], None).is_some());
        // A logger at one fifth of the rate of the file, with an additional gap, with and without times.
        let sparse =
            |of: &dyn Fn(usize) -> f64| (0..500).map(|i| if i % 5 == 2 { of(i / 5) } else { f64::NAN }).collect();
        let rows: Vec<f64> = (0..500).map(|i| 0.01 * f64::from(i)).collect();
        let slow: Vec<f64> = sparse(&|i| if (30..45).contains(&i) { f64::NAN } else { values[i] });
        near(noise(&slow, Some(&rows)));
        near(noise(&slow, None));
    }
}
