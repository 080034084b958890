//! Time axis of a data file.

use std::ops::Range;
use std::sync::Arc;

use mops_data::{DataFile, Origin, is_beyond_seconds, unit_since_1970};
use mops_language::{Diagnostic, Quantity, Unit};

use crate::columns::{column_at, unit_of_header};
use crate::reading::{read_seconds, read_unit};
use crate::tree::Node;

/// Time axis of a data file.
#[derive(Clone)]
pub(crate) struct TimeAxis {
    /// Name of the time column; empty if the samples are counted.
    pub column: String,
    /// Times of all rows in the file, s.
    pub times: Arc<Vec<f64>>,
    /// Time in the file that is time 0 of the study, s.
    pub zero: f64,
    /// Time stamp of time 0 in the file, if the file has time stamps.
    pub origin: Option<Origin>,
}

impl TimeAxis {
    /// Reads the time column, or counts samples. `column` is one of the columns that were sampled then.
    pub fn new(
        node: &Node<'_>,
        file: &DataFile,
        time: Option<&str>,
        time_unit: Option<&str>,
        sample_time: Option<&Quantity>,
        column: &str,
    ) -> Result<Self, Diagnostic> {
        if let Some(step) = read_seconds(node, "sample-time", sample_time)? {
            let place = node.child("sample-time").expect("it was just read");
            if let Some(time) = node.child("time") {
                return Err(time
                    .key_diagnostic("both `time` and `sample-time` are given".to_owned())
                    .with_help("remove one of them"));
            }
            if !(step > 0.0 && step.is_finite()) {
                return Err(place.diagnostic(format!("`sample-time` must be above 0 s, and is {step} s")));
            }
            refuse_other_rate(&place, file, step)?;
            let rows = file.column(column).map_or(file.variables[0].rows, |column| column.values.len());
            let times = Arc::new((0..rows).map(|row| row as f64 * step).collect());
            return Ok(Self { column: String::new(), times, zero: 0.0, origin: None });
        }
        let at = ["time", "file", "files", "path"].iter().find_map(|key| node.child(key));
        let place = at.unwrap_or_else(|| node.clone());
        let time = match time {
            Some(time) => time.to_owned(),
            None => file.time_column().ok_or_else(|| {
                let names = file.column_names().join(", ");
                let otherwise =
                    format!("set time = \"...\" to one of {names}, or sample-time = \"...\" if none is the time");
                let Diagnostic { message, help, .. } = file.without_time(&otherwise);
                Diagnostic { help, ..place.diagnostic(message) }
            })?,
        };
        let column = column_at(&place, file, &time)?;
        let unit = match (time_unit, column.unit) {
            (Some(unit), _) => read_unit(node, "time-unit", unit)?,
            (None, Some(unit)) => unit_of_header(&place, file, &time, unit, "time-unit")?,
            (None, None) => {
                if let Some(first) = column.values.iter().find(|t| is_beyond_seconds(**t)) {
                    let fact =
                        format!("the time column `{time}` has no unit, and its values are no dates as s since 1970");
                    let way_out = match unit_since_1970(*first) {
                        Some(unit) => format!("set time-unit = \"{unit}\", for times in {unit} since 1970"),
                        None => "set `time-unit`, or write time stamps such as 2024-05-17T10:30:00".to_owned(),
                    };
                    return Err(place.diagnostic(fact).with_help(way_out));
                }
                Unit::known("s")
            }
        };
        if let (Some(_), Some(given)) = (time_unit, column.unit)
            && Unit::parse(given).is_ok_and(|given| given.factor_to(&unit).is_some_and(|factor| factor != 1.0))
        {
            let place = node.child("time-unit").unwrap_or(place);
            return Err(place
                .diagnostic(format!("the header of `{time}` has the unit `{given}`, not `{unit}`"))
                .with_help("remove `time-unit`, or correct the header"));
        }
        let factor = unit.factor_to(&Unit::known("s")).ok_or_else(|| {
            let place = node.child("time-unit").unwrap_or(place);
            place
                .diagnostic(format!("the time column `{time}` is in `{unit}`, which is not a unit of time"))
                .with_help("set time-unit = \"s\"")
        })?;
        let times = Arc::new(column.values.iter().map(|t| t * factor).collect());
        Ok(Self { times, zero: 0.0, origin: column.origin, column: time })
    }

    /// Returns the time of a row in the study, s.
    pub fn at(&self, row: usize) -> f64 {
        self.times[row] - self.zero
    }

    /// Returns the first row of a range whose time, in the study, is not below `t`.
    pub fn first_from(&self, rows: Range<usize>, t: f64) -> usize {
        rows.start + self.times[rows].partition_point(|time| time - self.zero < t)
    }
}

/// Refuses a sample time that contradicts the time column of the file, if there is one.
fn refuse_other_rate(place: &Node<'_>, file: &DataFile, step: f64) -> Result<(), Diagnostic> {
    let Some(name) = file.time_column() else { return Ok(()) };
    let column = file.column(&name)?;
    let unit = column.unit.map_or_else(|| Ok(Unit::known("s")), Unit::parse);
    let factor = unit.ok().and_then(|unit| unit.factor_to(&Unit::known("s")));
    let mut steps: Vec<f64> =
        column.values.windows(2).map(|pair| pair[1] - pair[0]).filter(|s| s.is_finite()).collect();
    steps.sort_by(f64::total_cmp);
    let Some((median, factor)) = steps.get(steps.len() / 2).zip(factor) else { return Ok(()) };
    let found = median * factor;
    if (found - step).abs() <= 0.01 * step {
        return Ok(());
    }
    // Without the rounding of differences of times.
    let found = (found / step * 1e9).round() * 1e-9 * step;
    let fact = format!("the sample time is {step} s, but `{name}` of the file increases by {found} s");
    Err(place.diagnostic(fact).with_help(format!("remove `sample-time`, to use `{name}`, or correct it")))
}
