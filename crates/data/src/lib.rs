//! Measured data: readers that convert a file to named columns of numbers.

mod calendar;
mod cells;
mod csv;
mod encoding;
mod formulas;
mod header;
mod mat4;
mod mat5;
mod matlab;
mod sources;
mod stamps;
#[cfg(test)]
mod tests;
mod variable;

use std::collections::{HashMap, HashSet};
use std::fmt;
use std::io::ErrorKind;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use mops_language::Unit;
use mops_language::files::read_regular;
use mops_language::{Diagnostic, Source, suggestion};

pub use encoding::Encoding;
pub use formulas::as_text;
pub use sources::{FILE as SOURCES, source_of};
pub use stamps::{Origin, Reference};
pub use variable::Variable;

/// File format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Text with a comma, a semicolon, a tab or blanks between cells.
    Csv,
    /// MATLAB level 4, `save -v4`.
    Mat4,
    /// MATLAB level 5, `save -v6` or `save -v7`.
    Mat5,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Csv => "CSV",
            Self::Mat4 => "MATLAB level 4",
            Self::Mat5 => "MATLAB level 5",
        })
    }
}

/// Data file in memory.
#[derive(Debug, Clone)]
pub struct DataFile {
    /// Path and, for CSV, the text without the byte order mark.
    pub source: Arc<Source>,
    /// Format, detected from the content.
    pub format: Format,
    /// Encoding of a CSV file.
    pub encoding: Encoding,
    /// Lines before the header of a CSV file, which are not read, as a range of bytes.
    pub before: Range<usize>,
    /// Numeric variables, in the order of the file.
    pub variables: Vec<Variable>,
    /// Other variables, as `name: reason`.
    pub skipped: Vec<String>,
    layout: csv::Layout,
    /// Index of each variable by name.
    index: HashMap<String, usize>,
}

/// Column of numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Column<'a> {
    /// Name used in the request.
    pub name: String,
    /// Unit as given in the file.
    pub unit: Option<&'a str>,
    /// One value per sample, finite or NaN; NaN is a gap.
    pub values: &'a [f64],
    /// First stamp of a column of time stamps; see [`Variable::origin`].
    pub origin: Option<Origin>,
}

impl DataFile {
    /// Reads the file at `path`; the format is detected from the content, not from the extension.
    ///
    /// # Errors
    /// If the file cannot be read, has another format, is damaged, or contains no numbers. For CSV also if rows differ
    /// in length, if names repeat, or if a cell in a numeric column is neither a finite number nor a gap.
    pub fn read(path: &Path) -> Result<Self, Diagnostic> {
        let name = path.display().to_string();
        match read_regular(path) {
            Ok(bytes) => Self::parse(&name, bytes),
            Err(error) => {
                let source = Arc::new(Source { name, text: String::new() });
                let sources = path.with_file_name(SOURCES);
                if error.kind() == ErrorKind::NotFound
                    && let Ok(bytes) = read_regular(&sources)
                    && let Some(way_out) = source_of(path, &sources.display().to_string(), bytes)?
                {
                    return Err(Diagnostic::new("the file does not exist").with_help(way_out).at(&source, 0..0));
                }
                let (fact, way_out) = match error.kind() {
                    ErrorKind::NotFound => ("the file does not exist".to_owned(), "check the path"),
                    ErrorKind::IsADirectory => ("the path is a folder".to_owned(), "name a file in it"),
                    ErrorKind::InvalidInput => {
                        (error.to_string(), "name a file; save the output of a pipe to a file first")
                    }
                    _ => (format!("the file cannot be read: {error}"), "check its permissions"),
                };
                Err(Diagnostic::new(fact).with_help(way_out).at(&source, 0..0))
            }
        }
    }

    /// Parses the content of a file; messages use `name` for it.
    ///
    /// # Errors
    /// See [`Self::read`], except for errors of file access.
    pub fn parse(name: &str, bytes: Vec<u8>) -> Result<Self, Diagnostic> {
        let (format, read): (_, fn(&[u8]) -> _) = if mat5::recognises(&bytes) {
            (Format::Mat5, mat5::read)
        } else if mat4::recognises(&bytes) {
            (Format::Mat4, mat4::read)
        } else {
            return Self::parse_text(name, bytes);
        };
        let source = Arc::new(Source { name: name.to_owned(), text: String::new() });
        let (mut variables, skipped) = read(&bytes).map_err(|error| error.at(&source, 0..0))?.finish();
        keep_last_of_each_name(&mut variables);
        if variables.is_empty() {
            let found = skipped.iter().take(5).map(String::as_str).collect::<Vec<_>>().join(", ");
            let found = if found.is_empty() { "nothing".to_owned() } else { found };
            return Err(Diagnostic::new(format!("the {format} file contains no numeric matrix (found: {found})"))
                .with_help("save real, full matrices as separate variables")
                .at(&source, 0..0));
        }
        let index = index_of(&variables);
        let (encoding, before, layout) = (Encoding::Utf8, 0..0, csv::Layout::default());
        Ok(Self { source, format, encoding, before, variables, skipped, layout, index })
    }

    fn parse_text(name: &str, bytes: Vec<u8>) -> Result<Self, Diagnostic> {
        let (source, encoding) = text_source(name, bytes)?;
        let read = csv::read(&source);
        if read.is_err() && name.to_lowercase().ends_with(".mat") {
            return Err(Diagnostic::new("the file is not in MATLAB format, despite its extension")
                .with_help("copy it again, or save it again with `save -v7`")
                .at(&source, 0..0));
        }
        let csv::Content { variables, skipped, layout, before } = read?;
        let index = index_of(&variables);
        Ok(Self { source, format: Format::Csv, encoding, before, variables, skipped, layout, index })
    }

    /// Returns the default time column: `t`, or `time` in any case, or `T` with a time unit (without one, `T` may be a
    /// temperature), or the first column of time stamps, or a name such as `time_s` or `Zeit`.
    pub fn time_column(&self) -> Option<String> {
        let names = self.column_names();
        let is_time = |name: &&String| name.as_str() == "t" || name.eq_ignore_ascii_case("time");
        let has_time_unit = |name: &&String| {
            let unit = self.column(name).ok().and_then(|column| column.unit).map(Unit::parse);
            unit.is_some_and(|unit| unit.is_ok_and(|u| u.is_compatible(&Unit::known("s"))))
        };
        let in_seconds = |name: &&String| name.as_str() == "T" && has_time_unit(name);
        let has_stamps = |name: &&String| self.column(name).is_ok_and(|column| column.origin.is_some());
        let find = |is_one: &dyn Fn(&&String) -> bool| names.iter().find(is_one).cloned();
        find(&is_time)
            .or_else(|| find(&in_seconds))
            .or_else(|| find(&has_stamps))
            .or_else(|| find(&|name| header::is_time(name)))
    }

    /// Returns the error for a file without a time column; the caller adds a location, and what else to do.
    pub fn without_time(&self, otherwise: &str) -> Diagnostic {
        let skipped = || self.skipped.iter().filter_map(|entry| entry.split_once(": "));
        let reason = skipped().find(|(name, _)| header::is_time(name));
        match reason.or_else(|| skipped().find(|(name, _)| header::is_date(name))) {
            Some((column, reason)) => Diagnostic::new(format!(
                "`{column}` of the file is neither a column of numbers nor one of time stamps: {reason}"
            ))
            .with_help(format!("correct the file, or {otherwise}")),
            None => Diagnostic::new("no column of the file is called `t` or `time`").with_help(otherwise),
        }
    }

    /// Returns what a reader of the file should know: another encoding, and lines that are not read.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        if self.encoding != Encoding::Utf8 {
            remarks.push(format!("read as {}", self.encoding));
        }
        let before = &self.source.text[self.before.clone()];
        let mut lines = before.lines().filter(|line| !line.trim().is_empty() && !line.starts_with('#')).peekable();
        if let Some(first) = lines.peek().map(|line| cells::shortened(line)) {
            remarks.push(match lines.count() {
                1 => format!("1 line before the header skipped (`{first}`)"),
                count => format!("{count} lines before the header skipped (from `{first}` on)"),
            });
        }
        remarks
    }

    /// Checks that the times of a time column, in any unit, exist and increase from row `skip` on.
    ///
    /// # Errors
    /// With the place in the file.
    pub fn increases(&self, column: &str, times: &[f64], skip: usize) -> Result<(), Diagnostic> {
        let wrong = |row: usize, message: String, way_out: &str| {
            Err(Diagnostic::new(message).with_help(way_out).at(&self.source, self.span_of(column, row)))
        };
        let used = &times[skip..];
        if let Some(row) = used.iter().position(|t| !t.is_finite()) {
            let fact = format!("sample {} has no value in the time column `{column}`", skip + row + 1);
            return wrong(skip + row, fact, "delete the row; `skip` drops wrong rows at the start");
        }
        let Some(row) = used.windows(2).position(|pair| pair[1] <= pair[0]) else { return Ok(()) };
        let back = used[row] - used[row + 1];
        let fact = format!(
            "the time `{column}` does not increase: sample {} at {} s follows one at {} s",
            skip + row + 2,
            used[row + 1],
            used[row]
        );
        let origin = self.column(column).ok().and_then(|column| column.origin);
        let way_out = match origin.map(|origin| origin.reference) {
            Some(Reference::Midnight) if back > 0.5 * DAY => {
                "times of day start again at midnight: write the date too, such as 2024-05-17T00:00:05, in the same or in another \
                 column"
            }
            Some(Reference::Local) if back > 0.0 && back <= HOUR => {
                "if the clock was set back at the end of daylight saving time, write the zone too, such as \
                 2024-10-27T02:00:00+01:00, or UTC; sort the rows only if they are out of order"
            }
            _ => "sort the rows and delete duplicates; `skip` drops wrong rows at the start",
        };
        wrong(skip + row + 1, fact, way_out)
    }

    /// Returns the column called `name`.
    ///
    /// A vector has its own name, column k (from 1) of a matrix is `Data:3`. An element of a cell array is `Y{2}`, and
    /// its column `Y{2}:1`.
    ///
    /// # Errors
    /// If there is no such column, or if it contains an infinite value. The message names the file but has no location,
    /// so that the caller can point to the name.
    pub fn column(&self, name: &str) -> Result<Column<'_>, Diagnostic> {
        let (variable, k) = self.find(name).ok_or_else(|| self.unknown(name))?;
        let Variable { unit, rows, values, origin, .. } = &self.variables[variable];
        let values = &values[k * rows..(k + 1) * rows];
        if let Some(row) = values.iter().position(|value| value.is_infinite()) {
            let fact = format!("column `{name}` of {} is infinite in row {}", self.source.name, row + 1);
            return Err(Diagnostic::new(fact).with_help("write NaN for a gap"));
        }
        Ok(Column { name: name.to_owned(), unit: unit.as_deref(), values, origin: *origin })
    }

    /// Returns every name that [`Self::column`] accepts, in the order of the file.
    pub fn column_names(&self) -> Vec<String> {
        let names = |Variable { name, columns, .. }: &Variable| match columns {
            1 => vec![name.clone()],
            _ => (1..=*columns).map(|k| format!("{name}:{k}")).collect(),
        };
        self.variables.iter().flat_map(names).collect()
    }

    /// Returns the byte range of a cell in the text of a CSV file, `row` from 0 as in [`Column::values`]. Returns
    /// `0..0` for MATLAB files and for missing cells.
    pub fn span_of(&self, column: &str, row: usize) -> Range<usize> {
        self.find(column).and_then(|(variable, _)| self.layout.span(&self.source.text, variable, row)).unwrap_or(0..0)
    }

    /// Returns true if two names are those of one column.
    pub fn is_same(&self, name: &str, other: &str) -> bool {
        self.find(name).is_some_and(|found| self.find(other) == Some(found))
    }

    /// Returns the indices of the variable and of its column.
    fn find(&self, name: &str) -> Option<(usize, usize)> {
        let index_of = |name: &str| self.index.get(name).copied();
        if let Some(variable) = index_of(name).filter(|&i| self.variables[i].columns == 1) {
            return Some((variable, 0));
        }
        // Label of a column as in the header: `t [ms]`.
        let labelled = header::label(name).and_then(|(name, unit)| {
            let has_unit =
                |&i: &usize| self.variables[i].columns == 1 && self.variables[i].unit.as_deref() == Some(unit);
            index_of(name).or_else(|| index_of(&header::labelled(name, unit))).filter(has_unit)
        });
        if let Some(variable) = labelled {
            return Some((variable, 0));
        }
        let (name, k) = name.rsplit_once(':')?;
        let variable = index_of(name).filter(|&i| self.variables[i].columns > 1)?;
        let k = k.parse::<usize>().ok()?.checked_sub(1)?;
        (k < self.variables[variable].columns).then_some((variable, k))
    }

    fn unknown(&self, name: &str) -> Diagnostic {
        let file = &self.source.name;
        if let Some(Variable { rows, columns, .. }) = self.variables.iter().find(|variable| variable.name == name) {
            return Diagnostic::new(format!("`{name}` of {file} is a matrix with {columns} columns of {rows} samples"))
                .with_help(format!("write `{name}:1` to `{name}:{columns}`"));
        }
        let reason = self.skipped.iter().find_map(|entry| entry.strip_prefix(name)?.strip_prefix(": "));
        if let Some(reason) = reason {
            return Diagnostic::new(format!("`{name}` of {file} is not a column of numbers: {reason}"))
                .with_help(format!("columns of numbers: {}", self.column_names().join(", ")));
        }
        let names = self.column_names();
        Diagnostic::new(format!("no column `{name}` in {file}"))
            .with_help(suggestion(name, names.iter().map(String::as_str)))
    }
}

/// First and last time since 1970 that is taken for one, s: the years 1973 and 2201. In s, these times in ms are 3000
/// years and more.
const SINCE_1970: [f64; 2] = [1e8, 7.3e9];

/// Returns the unit in which a time without a unit is a usual date since 1970, if that is `ms`, `us` or `ns`.
pub fn unit_since_1970(time: f64) -> Option<&'static str> {
    let [first, last] = SINCE_1970;
    let units = [("ms", 1e3), ("us", 1e6), ("ns", 1e9)];
    units.into_iter().find(|(_, factor)| (first * factor..last * factor).contains(&time)).map(|(unit, _)| unit)
}

/// Returns true for a time that no record reaches in s, neither from its start nor from 1970.
pub fn is_beyond_seconds(time: f64) -> bool {
    time >= 1e3 * SINCE_1970[0]
}

/// Returns the indices of variables by name; the first of several with the same name.
fn index_of(variables: &[Variable]) -> HashMap<String, usize> {
    let mut index = HashMap::with_capacity(variables.len());
    for (i, variable) in variables.iter().enumerate() {
        index.entry(variable.name.clone()).or_insert(i);
    }
    index
}

/// Keeps the last of several variables with the same name, as MATLAB does.
fn keep_last_of_each_name(variables: &mut Vec<Variable>) {
    variables.reverse();
    let mut seen = HashSet::new();
    variables.retain(|variable| seen.insert(variable.name.clone()));
    variables.reverse();
}

/// Day and hour, s.
const DAY: f64 = 86_400.0;
const HOUR: f64 = 3600.0;

/// Returns the file as text and its encoding, or an error if it is not text.
fn text_source(name: &str, bytes: Vec<u8>) -> Result<(Arc<Source>, Encoding), Diagnostic> {
    let whole = Arc::new(Source { name: name.to_owned(), text: String::new() });
    if matlab::is_level_7_3(&bytes) {
        return Err(Diagnostic::new("MATLAB level 7.3 (HDF5) is not supported")
            .with_help("save it in MATLAB with `save -v7`")
            .at(&whole, 0..0));
    }
    let binary = || {
        Diagnostic::new("the file is neither CSV nor MATLAB level 4 or 5")
            .with_help("save it as CSV, or in MATLAB with `save -v7`")
            .at(&whole, 0..0)
    };
    let is_utf8 = !bytes.contains(&0) && std::str::from_utf8(&bytes).is_ok();
    if !is_utf8 && let Some((text, encoding)) = encoding::decode(&bytes) {
        return Ok((Arc::new(Source { name: name.to_owned(), text }), encoding));
    }
    if bytes.contains(&0) {
        return Err(binary());
    }
    // Text in another encoding has letters that are not UTF-8, but no control characters.
    let controls = bytes.iter().any(|byte| byte.is_ascii_control() && !byte.is_ascii_whitespace());
    match Source::from_bytes(name, bytes) {
        Ok(source) => Ok((Arc::new(source), Encoding::Utf8)),
        Err(_) if controls => Err(binary()),
        Err(mistake) => Err(mistake),
    }
}
