//! Experiments of a study file: from the columns of a data file to channels and inputs.

use std::io::ErrorKind;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use super::sections::{ChannelTable, ExperimentSection, InputTable};
use super::tree::Node;
use super::{Files, UNIT_HELP, at_key, frequency, read_seconds, read_unit};
use crate::data::{Column, DataFile, SOURCES, source_of};
use crate::diagnostic::{Diagnostic, Source};
use crate::experiment::Input;
use crate::study::{CaseBuilder, ChannelBuilder, Free, Measured};
use crate::unit::{Quantity, Unit};

/// Reads an experiment and its data file.
pub(super) fn read(name: String, node: &Node<'_>, files: &dyn Files) -> Result<CaseBuilder, Diagnostic> {
    let section: ExperimentSection = node.read()?;
    let file = open(node, &section.file, files)?;
    if section.frequency.is_some() || !section.responses.0.is_empty() {
        return frequency::read(name, node, section, &file);
    }
    let table = Table::new(node, &section, &file)?;

    let mut channels = Vec::new();
    for (signal, channel) in &section.channels.0 {
        let place = entry(node, "channels", signal);
        channels.push(table.channel(&place, signal, &channel.0)?);
    }
    let (mut inputs, mut warnings) = (Vec::new(), Vec::new());
    for (input, column) in &section.inputs.0 {
        let place = entry(node, "inputs", input);
        let (values, unit) = table.input(&place, &column.0)?;
        if column.0.hold.is_none() && values.looks_smooth() {
            warnings.push(format!(
                "input `{input}` of `{name}` looks smooth, but is constant between its samples: use hold = \"first\" for \
                 linear interpolation, \"band-limited\" for an input filtered before sampling, or \
                 hold = \"zero\" to confirm and suppress this warning"
            ));
        }
        inputs.push((input.clone(), values, unit));
    }
    let free = section.free.0.into_iter().map(|(state, given)| Free {
        state,
        start: given.start,
        min: given.min,
        max: given.max,
    });
    Ok(CaseBuilder {
        name,
        parameters: section.parameters.0,
        inputs,
        horizon: None,
        measured: Some(Measured { channels, responses: Vec::new(), role: section.role, free: free.collect() }),
        warnings,
    })
}

pub(super) fn entry<'t>(node: &Node<'t>, table: &str, key: &str) -> Node<'t> {
    node.child(table).and_then(|table| table.child(key)).expect("it was just read")
}

fn open(node: &Node<'_>, path: &str, files: &dyn Files) -> Result<DataFile, Diagnostic> {
    let shown = files.show(path);
    let error = match files.read(path) {
        Ok(bytes) => return DataFile::parse(&shown, bytes),
        Err(error) => error,
    };
    let mut way_out = None;
    let why = match error.kind() {
        ErrorKind::NotFound => {
            let sources = Path::new(path).with_file_name(SOURCES).to_string_lossy().into_owned();
            if let Ok(bytes) = files.read(&sources) {
                way_out = source_of(Path::new(&shown), &files.show(&sources), bytes)?;
            }
            format!("no data file `{shown}`")
        }
        ErrorKind::IsADirectory => format!("`{shown}` is a folder, not a data file"),
        _ => format!("the data file `{shown}` cannot be read: {error}"),
    };
    let place = node.child("file").expect("it was just read");
    Err(place
        .diagnostic(why)
        .with_help(way_out.as_deref().unwrap_or("paths are relative to the folder of the study file")))
}

/// The part of a data file that an experiment uses, with its time.
struct Table<'f> {
    file: &'f DataFile,
    /// Name of the time column.
    time: String,
    /// Times of all rows, s, in the time of the study.
    times: Vec<f64>,
    /// Rows used for measurements.
    rows: Range<usize>,
    /// Rows that inputs may be taken from.
    driving: Range<usize>,
}

impl<'f> Table<'f> {
    fn new(node: &Node<'_>, section: &ExperimentSection, file: &'f DataFile) -> Result<Self, Diagnostic> {
        let place = node.child("time").unwrap_or_else(|| node.child("file").expect("it was just read"));
        let time = match &section.time {
            Some(time) => time.clone(),
            None => file.time_column().ok_or_else(|| {
                place
                    .diagnostic("no column of the file is called `t` or `time`".to_owned())
                    .with_help(format!("set time = \"...\" to one of {}", file.column_names().join(", ")))
            })?,
        };
        let column = column_at(&place, file, &time)?;
        let unit = match (&section.time_unit, column.unit) {
            (Some(unit), _) => read_unit(node, "time-unit", unit)?,
            (None, Some(unit)) => unit_of_header(&place, file, &time, unit, "time-unit")?,
            (None, None) => Unit::known("s"),
        };
        let factor = unit.factor_to(&Unit::known("s")).ok_or_else(|| {
            let place = node.child("time-unit").unwrap_or(place);
            place
                .diagnostic(format!("the time column `{time}` is in `{unit}`, which is not a unit of time"))
                .with_help("set time-unit = \"s\"")
        })?;
        let times: Vec<f64> = column.values.iter().map(|t| t * factor).collect();
        let skip = section.skip.min(times.len());
        check_times(file, &time, &times, skip)?;

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
        let origin = if section.reset_time == Some(false) { 0.0 } else { times[first] };
        let times: Vec<f64> = times.iter().map(|t| t - origin).collect();
        Ok(Self { file, time, times, rows: first..last, driving: skip..last })
    }

    /// Returns the rows used for an input whose time stamps are shifted: from the last one before the start of the simulation at 0 s,
    /// which may precede the first measurement. `None` if the file starts after that.
    fn driven(&self, shift: f64) -> Option<Range<usize>> {
        let Range { start, end } = self.driving;
        let before = self.times[start..end].partition_point(|&t| t + shift <= 0.0);
        before.checked_sub(1).map(|row| start + row..end)
    }

    fn channel(&self, place: &Node<'_>, signal: &str, table: &ChannelTable) -> Result<ChannelBuilder, Diagnostic> {
        let (values, unit) =
            self.values(place, &table.column, table.unit.as_deref(), table.scale, table.offset.as_ref())?;
        Ok(ChannelBuilder {
            signal: signal.to_owned(),
            times: self.times[self.rows.clone()].to_vec(),
            values: values[self.rows.clone()].to_vec(),
            noise: table.noise.as_ref().map(|noise| in_unit_of_column(noise, unit.as_ref())),
            unit,
        })
    }

    fn input(&self, place: &Node<'_>, table: &InputTable) -> Result<(Input, Option<Unit>), Diagnostic> {
        let (values, unit) =
            self.values(place, &table.column, table.unit.as_deref(), table.scale, table.offset.as_ref())?;
        let shift = read_seconds(place, "shift", table.shift.as_ref())?.unwrap_or(0.0);
        let Some(rows) = self.driven(shift) else {
            let first = self.times[self.driving.start] + shift;
            let fact = format!("the simulation starts at 0 s, but `{}` is unknown before {first} s", table.column);
            return Err(place
                .diagnostic(fact)
                .with_help("omit `reset-time = false` to start at the first sample, or record the input from 0 s on"));
        };
        let times = self.times[rows.clone()].iter().map(|t| t + shift).collect();
        let values = values[rows.clone()].to_vec();
        if let Some(gap) = values.iter().position(|v| !v.is_finite()) {
            let fact = format!(
                "the input column `{}` has a missing sample at {} s",
                table.column,
                self.times[rows.start + gap]
            );
            return Err(self
                .at(&table.column, rows.start + gap, &fact)
                .unwrap_or_else(|| place.diagnostic(fact))
                .with_help("an input has no missing samples: add the sample, or cut it off with `from` and `to`"));
        }
        Ok((Input::Sampled { times, values, hold: table.hold.unwrap_or_default() }, unit))
    }

    fn values(
        &self,
        place: &Node<'_>,
        name: &str,
        unit: Option<&str>,
        scale: Option<f64>,
        offset: Option<&Quantity>,
    ) -> Result<(Vec<f64>, Option<Unit>), Diagnostic> {
        let at = place.child("column").unwrap_or_else(|| place.clone());
        let column = column_at(&at, self.file, name)?;
        let time_rows = self.file.column(&self.time)?.values.len();
        if column.values.len() != time_rows {
            return Err(at
                .diagnostic(format!(
                    "`{name}` has {} samples, but the time column `{}` has {time_rows}",
                    column.values.len(),
                    self.time
                ))
                .with_help("set the matching time column with `time`, if necessary in a separate experiment"));
        }
        let unit = match (unit, column.unit) {
            (Some(unit), _) => Some(read_unit(place, "unit", unit)?),
            (None, Some(unit)) => Some(unit_of_header(&at, self.file, name, unit, "unit")?),
            (None, None) => None,
        };
        let scale = scale.unwrap_or(1.0);
        let offset = match (offset, &unit) {
            (None, _) => 0.0,
            (Some(q), Some(unit)) => q.to(&unit.difference()).map_err(|why| {
                at_key(place, "offset", why).with_help(format!("a number without a unit is in `{unit}`"))
            })?,
            (Some(q), None) => q.number,
        };
        Ok((column.values.iter().map(|v| scale * v + offset).collect(), unit))
    }

    /// Returns an error located in a cell of a CSV file.
    fn at(&self, column: &str, row: usize, fact: &str) -> Option<Diagnostic> {
        let span = self.file.span_of(column, row);
        (span != (0..0)).then(|| Diagnostic::new(fact).at(&self.file.source, span))
    }
}

/// Returns the quantity of a channel with the unit of its column if it has none, as for `offset`.
fn in_unit_of_column(quantity: &Quantity, unit: Option<&Unit>) -> Quantity {
    Quantity { unit: quantity.unit.clone().or(unit.cloned()), ..quantity.clone() }
}

/// Returns a column; an error for a missing one has the location in the study.
pub(super) fn column_at<'f>(place: &Node<'_>, file: &'f DataFile, name: &str) -> Result<Column<'f>, Diagnostic> {
    file.column(name).map_err(|error| {
        let located = place.diagnostic(error.message);
        Diagnostic { help: error.help, ..located }
    })
}

/// Returns the unit of a column from the header of the file; `key` overrides it in the study.
pub(super) fn unit_of_header(
    place: &Node<'_>,
    file: &DataFile,
    column: &str,
    unit: &str,
    key: &str,
) -> Result<Unit, Diagnostic> {
    Unit::parse(unit).map_err(|_| {
        let name = &file.source.name;
        place
            .diagnostic(format!("unknown unit `{unit}` of `{column}` in the header of {name}"))
            .with_help(format!("set {key} = \"...\" here; {UNIT_HELP}"))
    })
}

/// Checks that the times from row `skip` on exist and increase.
fn check_times(file: &DataFile, column: &str, times: &[f64], skip: usize) -> Result<(), Diagnostic> {
    let wrong = |row: usize, message: String, way_out: &str| {
        let source: &Arc<Source> = &file.source;
        Err(Diagnostic::new(message).with_help(way_out).at(source, file.span_of(column, row)))
    };
    let used = &times[skip..];
    if let Some(row) = used.iter().position(|t| !t.is_finite()) {
        let fact = format!("sample {} has no value in the time column `{column}`", skip + row + 1);
        return wrong(skip + row, fact, "delete the row; `skip` drops wrong rows at the start");
    }
    match used.windows(2).position(|pair| pair[1] <= pair[0]) {
        Some(row) => wrong(
            skip + row + 1,
            format!(
                "the time `{column}` does not increase: sample {} at {} s follows one at {} s",
                skip + row + 2,
                used[row + 1],
                used[row]
            ),
            "sort the rows and delete duplicates; `skip` drops wrong rows at the start",
        ),
        None => Ok(()),
    }
}
