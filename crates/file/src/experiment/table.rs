//! The part of a data file that an experiment uses: its channels and inputs.

use std::ops::Range;
use std::sync::Arc;

use mops_core::{
    case::{Hold, Input},
    study::ChannelBuilder,
};
use mops_data::DataFile;
use mops_language::{Diagnostic, Quantity, Unit, entries::Short};

use super::time_axis::TimeAxis;
use crate::columns::{column_at, entry, unit_of_header};
use crate::reading::{at_key, read_seconds, read_unit};
use crate::sections::{ChannelTable, ExperimentSection, InputTable, RecordedInput};
use crate::tree::Node;

/// Returns the time by which a column is moved, s.
pub(crate) fn read_shift(place: &Node<'_>, shift: Option<&Quantity>) -> Result<f64, Diagnostic> {
    let shift = read_seconds(place, "shift", shift)?.unwrap_or(0.0);
    match shift.is_finite() {
        true => Ok(shift),
        false => Err(at_key(place, "shift", format!("`shift` must be finite, not {shift} s")).with_help("give a time")),
    }
}

/// Returns the largest time by which channels are moved to later times, s.
fn ahead(node: &Node<'_>, section: &ExperimentSection) -> Result<f64, Diagnostic> {
    let mut most = 0.0f64;
    for (signal, Short(channel)) in &section.channels.0 {
        let place = entry(node, "channels", signal);
        most = most.max(read_shift(&place, channel.shift.as_ref())?);
    }
    Ok(most)
}

/// The part of a data file that an experiment uses, with its time.
pub(crate) struct Table {
    pub file: Arc<DataFile>,
    /// Time axis, in the time of the study.
    pub axis: TimeAxis,
    /// Rows used for measurements.
    pub rows: Range<usize>,
    /// Rows that inputs may be taken from.
    pub driving: Range<usize>,
    /// Time of the last measurement in the study, s: inputs are needed until then.
    pub end: f64,
    /// Time before the start for which inputs are kept, s.
    pub past: f64,
    /// True if the file or its time axis is not that of the experiment.
    pub is_other: bool,
}

/// Time before a window for which inputs are kept, relative to its length.
const PAST: f64 = 2.0;

impl Table {
    pub fn new(node: &Node<'_>, section: &ExperimentSection, file: Arc<DataFile>) -> Result<Self, Diagnostic> {
        let columns = section.channels.0.iter().map(|(_, Short(channel))| &channel.column);
        let inputs = section.inputs.0.iter().map(|(_, RecordedInput(input))| &input.column);
        let inputs = inputs.filter(|column| !column.is_empty());
        let column = columns.chain(inputs).next();
        let (time, unit) = (section.time.as_deref(), section.time_unit.as_deref());
        let column = column.map_or("", String::as_str);
        let mut axis = TimeAxis::new(node, &file, time, unit, section.sample_time.as_ref(), column)?;
        let times = Arc::clone(&axis.times);
        let skip = section.skip.min(times.len());
        file.increases(&axis.column, &times, skip)?;

        let from = read_seconds(node, "from", section.from.as_ref())?;
        let to = read_seconds(node, "to", section.to.as_ref())?;
        let first = from.map_or(0, |from| times[skip..].partition_point(|&t| t < from)) + skip;
        let last = to.map_or(times.len(), |to| times[skip..].partition_point(|&t| t <= to) + skip);
        if first + 2 > last {
            let few = |rows: usize| rows < 2;
            let key = match (few(times.len() - skip), few(times.len() - first)) {
                (true, _) if skip > 0 => "skip",
                (_, true) if from.is_some() => "from",
                _ if to.is_some() => "to",
                _ => "file",
            };
            let left = if first + 1 == last { "one" } else { "none" };
            let all = format!("{} samples, from {} to {} s", times.len(), times[0], times[times.len() - 1]);
            return Err(at_key(
                node,
                key,
                format!("expected at least two samples of `{}`, found {left}", file.source.name),
            )
            .with_help(format!("the file has {all}")));
        }
        axis.zero = if section.reset_time == Some(false) { 0.0 } else { times[first] };
        let end = axis.at(last - 1) + ahead(node, section)?;
        Ok(Self {
            file,
            axis,
            rows: first..last,
            driving: skip..times.len(),
            end,
            past: f64::INFINITY,
            is_other: false,
        })
    }

    /// Returns the windows into which an experiment is divided, each from its own time 0 on; the whole table without
    /// windows.
    pub fn windows(self, node: &Node<'_>, section: &ExperimentSection) -> Result<Vec<Self>, Diagnostic> {
        let Some(length) = read_seconds(node, "windows", section.windows.as_ref())? else { return Ok(vec![self]) };
        let place = node.child("windows").expect("it was just read");
        if section.reset_time == Some(false) {
            let place = node.child("reset-time").expect("it was just read");
            return Err(place
                .key_diagnostic("`reset-time = false` excludes `windows`, which start at their own time 0".to_owned())
                .with_help("remove one of them"));
        }
        let ahead = ahead(node, section)?;
        let mut steps: Vec<f64> = self.axis.times[self.rows.clone()].windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let step = steps[steps.len() / 2];
        if length.is_nan() || length < step {
            let fact = format!("a window of {length} s has less than two samples, which are {step} s apart");
            return Err(place.diagnostic(fact).with_help("choose a longer time"));
        }
        let mut windows = Vec::new();
        let mut first = self.rows.start;
        // Half a nanosecond covers the rounding of sample times.
        const CLOSE: f64 = 5e-10;
        while first + 1 < self.rows.end {
            let start = self.axis.at(first);
            let next = self.axis.first_from(first..self.rows.end, start + length - CLOSE);
            // A pause that is longer than a window ends one.
            let pause = (first + 1..self.rows.end).find(|&row| self.axis.at(row) - self.axis.at(row - 1) > length);
            let end = (next + 1).min(self.rows.end);
            let is_paused = pause.is_some_and(|pause| pause < end);
            let end = pause.map_or(end, |pause| pause.min(end));
            let covers = self.axis.at(end - 1) - start;
            if end < first + 2 && !is_paused {
                let fact = format!("a window of {length} s at {} s has less than two samples", self.axis.times[first]);
                return Err(place.diagnostic(fact).with_help("choose a longer time"));
            }
            if covers >= 0.5 * length && end >= first + 2 {
                let axis = TimeAxis { zero: self.axis.times[first], ..self.axis.clone() };
                let (file, driving) = (Arc::clone(&self.file), self.driving.clone());
                let end_time = covers + ahead;
                let past = PAST * length;
                windows.push(Self { file, axis, rows: first..end, driving, end: end_time, past, is_other: false });
            }
            // The last sample of a window is the first of the next one, but for a pause.
            first = if is_paused { end } else { next };
        }
        if windows.is_empty() {
            let all = self.axis.at(self.rows.end - 1) - self.axis.at(self.rows.start);
            let fact = format!("a window of {length} s is more than twice as long as the record of {all} s");
            return Err(place.diagnostic(fact).with_help("choose a shorter time"));
        }
        Ok(windows)
    }

    /// Returns the rows used for an input whose time stamps are shifted: from the last one before the start of the
    /// simulation at 0 s, which may precede the first measurement, to those after its end that interpolation needs.
    /// `None` if the file starts later.
    pub fn driven(&self, shift: f64) -> Option<Range<usize>> {
        let before = self.axis.times[self.driving.clone()].partition_point(|t| t - self.axis.zero + shift <= 0.0);
        let start = self.driving.start + before.checked_sub(1)?;
        let end = self.axis.first_from(self.driving.clone(), self.end - shift);
        // Band-limited interpolation uses three samples on either side.
        Some(start..(end + 3).min(self.driving.end).max(start + 1))
    }

    pub fn channel(&self, place: &Node<'_>, signal: &str, table: &ChannelTable) -> Result<ChannelBuilder, Diagnostic> {
        let (values, unit) =
            self.values(place, &table.column, table.unit.as_deref(), table.scale, table.offset.as_ref())?;
        let shift = read_shift(place, table.shift.as_ref())?;
        // A shifted sample before the start of the simulation has no counterpart in it.
        let rows = self.rows.clone().filter(|&row| shift == 0.0 || self.axis.at(row) + shift >= 0.0);
        let (times, values) = rows.map(|row| (self.axis.at(row) + shift, values[row])).unzip();
        Ok(ChannelBuilder {
            signal: signal.to_owned(),
            times,
            values,
            noise: table.noise.as_ref().map(|noise| in_unit_of_column(noise, unit.as_ref())),
            unit,
            unwrap: table.unwrap,
        })
    }

    /// Returns an input, its unit, and the number of missing samples.
    pub fn input(&self, place: &Node<'_>, table: &InputTable) -> Result<(Input, Option<Unit>, usize), Diagnostic> {
        let shift = read_shift(place, table.shift.as_ref())?;
        let Some(rows) = self.driven(shift) else {
            let first = self.axis.at(self.driving.start) + shift;
            let fact = format!("the simulation starts at 0 s, but `{}` is unknown before {first} s", table.column);
            let help = match self.is_other || shift != 0.0 {
                true => {
                    "the times of all files are on one clock: correct `shift`, or start the experiment later with `from`"
                }
                false => "omit `reset-time = false` to start at the first sample, or record the input from 0 s on",
            };
            return Err(place.diagnostic(fact).with_help(help));
        };
        let last = self.axis.at(self.driving.end - 1) + shift;
        if last < 0.0 {
            let fact = format!("`{}` ends {} s before the experiment starts", table.column, -last);
            let help = "the times of all files are on one clock: correct `shift`, or the time column";
            return Err(place.diagnostic(fact).with_help(help));
        }
        self.sampled(place, table, shift, rows)
    }

    /// Returns the last time of an input from another file and the end of the experiment, if the input ends before by
    /// more than its mean time between samples.
    pub fn ends_early(&self, input: &Input) -> Option<(f64, f64)> {
        let Input::Sampled { times, .. } = input else { return None };
        let last = *times.last()?;
        #[allow(clippy::cast_precision_loss)]
        let step = (last - times[0]) / (times.len().max(2) - 1) as f64;
        (self.is_other && last + 1.5 * step < self.end).then_some((last, self.end))
    }

    /// Returns an input from these rows; under zero-order hold, missing samples are left out.
    pub fn sampled(
        &self,
        place: &Node<'_>,
        table: &InputTable,
        shift: f64,
        mut rows: Range<usize>,
    ) -> Result<(Input, Option<Unit>, usize), Diagnostic> {
        let (values, unit) =
            self.values(place, &table.column, table.unit.as_deref(), table.scale, table.offset.as_ref())?;
        let hold = table.hold.unwrap_or_default();
        if hold == Hold::Zero {
            // The value at the start may be older.
            while rows.start > self.driving.start && !values[rows.start].is_finite() {
                rows.start -= 1;
            }
        }
        let is_missing = |&row: &usize| !values[row].is_finite();
        let needed = rows.clone();
        // Samples before the start count for what remembers them; a gap ends what is known.
        if hold != Hold::BandLimited {
            let earlier = self.axis.first_from(self.driving.clone(), -self.past - shift).min(rows.start);
            let gap = (earlier..rows.start).rev().find(|row| hold != Hold::Zero && is_missing(row));
            rows.start = gap.map_or(earlier, |gap| gap + 1);
            rows.start += (rows.start..needed.start).take_while(is_missing).count();
        }
        if let Some(row) = needed.clone().find(is_missing).filter(|&row| hold != Hold::Zero || row == rows.start) {
            let fact = format!("the input column `{}` has a missing sample at {} s", table.column, self.axis.at(row));
            let help = match hold {
                Hold::Zero => "the first sample is needed: cut the record with `from`, or drop samples with `skip`",
                _ => "add the sample, cut it off with `from` and `to`, or use hold = \"zero\", which keeps the value",
            };
            return Err(self.at(&table.column, row, &fact).unwrap_or_else(|| place.diagnostic(fact)).with_help(help));
        }
        let kept = rows.clone().filter(|row| !is_missing(row));
        let (times, kept): (Vec<f64>, Vec<f64>) = kept.map(|row| (self.axis.at(row) + shift, values[row])).unzip();
        let missing = needed.filter(is_missing).count();
        Ok((Input::Sampled { times, values: kept, hold }, unit, missing))
    }

    pub fn values(
        &self,
        place: &Node<'_>,
        name: &str,
        unit: Option<&str>,
        scale: Option<f64>,
        offset: Option<&Quantity>,
    ) -> Result<(Vec<f64>, Option<Unit>), Diagnostic> {
        let at = place.child("column").unwrap_or_else(|| place.clone());
        let column = column_at(&at, &self.file, name)?;
        let time_rows = self.axis.times.len();
        if column.values.len() != time_rows {
            return Err(at
                .diagnostic(format!(
                    "`{name}` has {} samples, but the time{} has {time_rows}",
                    column.values.len(),
                    if self.axis.column.is_empty() { String::new() } else { format!(" column `{}`", self.axis.column) }
                ))
                .with_help("set the matching time column of this table with `time`"));
        }
        let unit = match (unit, column.unit) {
            (Some(unit), _) => Some(read_unit(place, "unit", unit)?),
            (None, Some(unit)) => Some(unit_of_header(&at, &self.file, name, unit, "unit")?),
            (None, None) => None,
        };
        let scale = scale.unwrap_or(1.0);
        if scale == 0.0 || !scale.is_finite() {
            let fact = format!("`scale` must be finite and not 0, and is {scale}");
            return Err(at_key(place, "scale", fact).with_help("give the factor from the column to the signal"));
        }
        let offset = match (offset, &unit) {
            (None, _) => 0.0,
            (Some(q), Some(unit)) => q.to(&unit.difference()).map_err(|why| {
                at_key(place, "offset", why).with_help(format!("a number without a unit is in `{unit}`"))
            })?,
            (Some(Quantity { number, unit: None }), None) => *number,
            (Some(Quantity { unit: Some(given), .. }), None) => {
                let fact = format!("the offset is in `{given}`, but the column `{name}` has no unit");
                return Err(at_key(place, "offset", fact).with_help("set `unit` to that of the column"));
            }
        };
        Ok((column.values.iter().map(|v| scale * v + offset).collect(), unit))
    }

    /// Returns an error located in a cell of a CSV file.
    pub fn at(&self, column: &str, row: usize, fact: &str) -> Option<Diagnostic> {
        let span = self.file.span_of(column, row);
        (span != (0..0)).then(|| Diagnostic::new(fact).at(&self.file.source, span))
    }
}

/// Returns the quantity of a channel with the unit of its column if it has none, as for `offset`.
pub(crate) fn in_unit_of_column(quantity: &Quantity, unit: Option<&Unit>) -> Quantity {
    Quantity { unit: quantity.unit.clone().or(unit.cloned()), ..quantity.clone() }
}
