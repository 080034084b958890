//! Experiments of a study file: from the columns of a data file to channels and inputs.

use std::cell::RefCell;
use std::io::ErrorKind;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use mops_core::{
    case::{Hold, Input},
    study::{CaseBuilder, ChannelBuilder, Free, Measured, matches_pattern},
};
use mops_data::{DataFile, Origin, Reference, SOURCES, is_beyond_seconds, source_of, unit_since_1970};
use mops_language::{Diagnostic, Quantity, Unit, entries::Short, files::OutsideFolder};

use super::columns::{column_at, entry, unit_of_header};
use super::frequency;
use super::reading::{at_key, read_seconds, read_unit};
use super::sections::{ChannelTable, ExperimentSection, InputTable, RecordedInput};
use super::tree::Node;
use mops_language::files::Files;

/// Reads an experiment and its data: several experiments from several files, or if it is divided into windows.
pub(super) fn read(name: &str, node: &Node<'_>, files: &dyn Files) -> Result<Vec<CaseBuilder>, Diagnostic> {
    let section: ExperimentSection = node.read()?;
    let opened = Opened { files, known: RefCell::default() };
    let mut found = Vec::new();
    for (own, path) in paths(name, node, &section, files)? {
        let key = if section.file.is_some() { "file" } else { "files" };
        let file = opened.open(node, key, &path)?;
        if section.frequency.is_some() || !section.responses.0.is_empty() {
            if let Some((key, place)) =
                ["windows", "sample-time"].iter().find_map(|key| node.child(key).map(|place| (key, place)))
            {
                let fact = format!("`{key}` is for signals over time, not for frequency responses");
                return Err(place.key_diagnostic(fact).with_help("remove it"));
            }
            found.push(frequency::read(own, node, &section, &file)?);
            continue;
        }
        let table = Table::new(node, &section, file)?;
        let windows = table.windows(node, &section)?;
        for (index, table) in windows.iter().enumerate() {
            let own = if section.windows.is_some() { format!("{own}-{}", index + 1) } else { own.clone() };
            found.push(experiment(own, node, &section, table, &opened)?);
        }
    }
    share_warnings(&mut found, name);
    Ok(found)
}

/// Replaces warnings that differ only in the name of the experiment by one: on all, `NAME-*`, or on the first and the
/// number of others.
fn share_warnings(found: &mut [CaseBuilder], name: &str) {
    let all = format!("`{name}-*`");
    let common = |case: &CaseBuilder, text: &str| text.replace(&format!("`{}`", case.name), &all);
    let texts: Vec<Vec<String>> =
        found.iter().map(|case| case.warnings.iter().map(|text| common(case, text)).collect()).collect();
    let count = |text: &String| texts.iter().filter(|texts| texts.contains(text)).count();
    let total = found.len();
    let mut shown: Vec<&String> = Vec::new();
    for (case, texts) in found.iter_mut().zip(&texts) {
        let own = std::mem::take(&mut case.warnings);
        for (warning, text) in own.into_iter().zip(texts) {
            if count(text) == 1 {
                case.warnings.push(warning);
            } else if !shown.contains(&text) {
                let others = count(text) - 1;
                let some = format!("`{}` and {others} other experiments", case.name);
                case.warnings.push(if others + 1 == total { text.clone() } else { text.replace(&all, &some) });
                shown.push(text);
            }
        }
    }
}

/// Returns names and data files of the experiments of a table.
fn paths(
    name: &str,
    node: &Node<'_>,
    section: &ExperimentSection,
    files: &dyn Files,
) -> Result<Vec<(String, String)>, Diagnostic> {
    let pattern = match (&section.file, &section.files) {
        (Some(file), None) => return Ok(vec![(name.to_owned(), file.clone())]),
        (None, Some(pattern)) => pattern,
        (None, None) => {
            return Err(node
                .key_diagnostic("`file` is missing".to_owned())
                .with_help("add file = \"...\", or files = \"swing_*.csv\" for several"));
        }
        (Some(_), Some(_)) => {
            let place = node.child("files").expect("it was just read");
            return Err(place.key_diagnostic("both `file` and `files` are given".to_owned()).with_help("remove one"));
        }
    };
    let (folder, wanted) = pattern.rsplit_once('/').unwrap_or(("", pattern));
    let place = node.child("files").expect("it was just read");
    let mut names = files.list(folder).map_err(|error| {
        let shown = files.show(folder);
        let help = match OutsideFolder::is_reason_of(&error) {
            true => OutsideFolder::HELP,
            false => {
                "paths are relative to the folder of the study file; `*` stands for text in the name of a file only"
            }
        };
        place.diagnostic(format!("the folder `{shown}` cannot be read: {error}")).with_help(help)
    })?;
    names.retain(|name| matches_pattern(wanted, name));
    names.sort();
    if names.is_empty() {
        let fact = format!("no data file matches `{}`", files.show(pattern));
        return Err(place.diagnostic(fact).with_help("`*` stands for any text in the name of a file"));
    }
    let path = |file: String| {
        let stem = file.rsplit_once('.').map_or(file.as_str(), |(stem, _)| stem).to_owned();
        let path = if folder.is_empty() { file.clone() } else { format!("{folder}/{file}") };
        (format!("{name}-{stem}"), path)
    };
    Ok(names.into_iter().map(path).collect())
}

fn experiment(
    name: String,
    node: &Node<'_>,
    section: &ExperimentSection,
    table: &Table,
    opened: &Opened<'_>,
) -> Result<CaseBuilder, Diagnostic> {
    let mut channels = Vec::new();
    for (signal, Short(channel)) in &section.channels.0 {
        let place = entry(node, "channels", signal);
        let keys = Elsewhere::of(&channel.file, &channel.time, &channel.time_unit, &channel.sample_time);
        let other = keys.table(&place, &channel.column, table, opened, true)?;
        channels.push(other.as_ref().unwrap_or(table).channel(&place, signal, channel)?);
    }
    let (mut inputs, mut warnings) = (Vec::new(), opened.remarks(section, table));
    for (input, RecordedInput(column)) in &section.inputs.0 {
        let place = entry(node, "inputs", input);
        if let Some(value) = constant(&place, column)? {
            inputs.push((input.clone(), Input::Constant(value.number), value.unit));
            continue;
        }
        let keys = Elsewhere::of(&column.file, &column.time, &column.time_unit, &column.sample_time);
        let other = keys.table(&place, &column.column, table, opened, false)?;
        let source = other.as_ref().unwrap_or(table);
        let (values, unit, missing) = source.input(&place, column)?;
        warnings.extend(source.ends_early(&values).map(|(last, end)| {
            format!(
                "input `{input}` of `{name}` ends at {last} s, and the experiment at {end} s: its last value is kept"
            )
        }));
        if missing > 0 {
            warnings.push(format!(
                "input `{input}` of `{name}` has {missing} missing samples: the value before each is kept"
            ));
        }
        if column.hold.is_none() && values.looks_smooth() {
            warnings.push(format!(
                "input `{input}` of `{name}` looks smooth, but is constant between its samples: use hold = \"first\" for \
                 linear interpolation, \"band-limited\" for an input filtered before sampling, or \
                 hold = \"zero\" to confirm and suppress this warning"
            ));
        }
        inputs.push((input.clone(), values, unit));
    }
    let free = section.free.0.iter().map(|(state, given)| Free {
        state: state.clone(),
        start: given.start.clone(),
        min: given.min.clone(),
        max: given.max.clone(),
    });
    Ok(CaseBuilder {
        name,
        parameters: section.parameters.0.clone(),
        inputs,
        horizon: None,
        measured: Some(Measured {
            channels,
            responses: Vec::new(),
            role: section.role,
            free: free.collect(),
            unused: opened.unused(section, table),
        }),
        warnings,
    })
}

/// Returns the value of a constant input, or `None` for a recorded one.
fn constant(place: &Node<'_>, table: &InputTable) -> Result<Option<Quantity>, Diagnostic> {
    let Some(value) = &table.constant else {
        if table.column.is_empty() {
            let fact = "the input has neither a column nor a constant value".to_owned();
            return Err(place.diagnostic(fact).with_help("write column = \"...\", or constant = 0"));
        }
        return Ok(None);
    };
    if let Ok(entries) = place.entries()
        && let Some((key, other)) = entries.iter().find(|(key, _)| key != "constant")
    {
        let fact = format!("`{key}` is for a recorded input, and this one is constant");
        return Err(other.key_diagnostic(fact).with_help("remove one of them"));
    }
    if !value.number.is_finite() {
        return Err(place.diagnostic(format!("expected a finite value, found {}", value.number)));
    }
    Ok(Some(value.clone()))
}

/// Reads an input of a case from a data file, and the unit of its column.
pub(super) fn recorded(
    place: &Node<'_>,
    path: &str,
    column: &InputTable,
    files: &dyn Files,
) -> Result<(Input, Option<Unit>), Diagnostic> {
    let file = Opened { files, known: RefCell::default() }.open(place, "path", path)?;
    let keys = Elsewhere::of(&None, &column.time, &column.time_unit, &column.sample_time);
    let clock = Clock::new(place, &file, keys.time, keys.unit, keys.sample_time, &column.column)?;
    file.increases(&clock.column, &clock.times, 0)?;
    let rows = 0..clock.times.len();
    let table =
        Table { file, driving: rows.clone(), rows, clock, end: f64::INFINITY, past: f64::INFINITY, is_other: true };
    let shift = read_shift(place, column.shift.as_ref())?;
    let last = table.clock.at(table.rows.end - 1) + shift;
    if last < 0.0 {
        let fact = format!("`{}` ends {} s before the simulation starts at 0 s", column.column, -last);
        return Err(place.diagnostic(fact).with_help("correct `shift`, or the time column"));
    }
    let (input, unit, _) = table.sampled(place, column, shift, table.rows.clone())?;
    Ok((input, unit))
}

/// Data files that an experiment has opened.
struct Opened<'a> {
    files: &'a dyn Files,
    known: RefCell<Vec<(String, Arc<DataFile>)>>,
}

impl Opened<'_> {
    /// Returns what a reader of the files of an experiment should know.
    fn remarks(&self, section: &ExperimentSection, main: &Table) -> Vec<String> {
        let of = |file: &DataFile| {
            let name = format!("`{}`", file.source.name);
            file.remarks().into_iter().map(move |remark| format!("{name}: {remark}")).collect::<Vec<_>>()
        };
        self.of(section, main).iter().flat_map(|(file, _)| of(file)).collect()
    }

    /// Returns the columns of the files of an experiment that it does not use, with their units.
    fn unused(&self, section: &ExperimentSection, main: &Table) -> Vec<String> {
        let mut unused = Vec::new();
        for (file, used) in self.of(section, main) {
            for name in file.column_names() {
                let unit = file.column(&name).ok().and_then(|column| column.unit.map(|unit| format!(" [{unit}]")));
                if !used.iter().any(|used| file.is_same(used, &name)) {
                    unused.push(format!("{name}{}", unit.unwrap_or_default()));
                }
            }
        }
        unused
    }

    /// Returns the files of an experiment, with the columns that it uses.
    fn of(&self, section: &ExperimentSection, main: &Table) -> Vec<(Arc<DataFile>, Vec<String>)> {
        let mut files = vec![(Arc::clone(&main.file), vec![main.clock.column.clone()])];
        let channels = section.channels.0.iter().map(|(_, Short(c))| (&c.file, &c.column, &c.time));
        let inputs = section.inputs.0.iter().map(|(_, RecordedInput(u))| (&u.file, &u.column, &u.time));
        for (path, column, time) in channels.chain(inputs) {
            let known = self.known.borrow();
            let other = path.as_ref().and_then(|path| known.iter().find(|(own, _)| own == path));
            let file = other.map_or(&main.file, |(_, file)| file);
            let at = files.iter().position(|(own, _)| Arc::ptr_eq(own, file)).unwrap_or_else(|| {
                files.push((Arc::clone(file), file.time_column().into_iter().collect()));
                files.len() - 1
            });
            files[at].1.push(column.clone());
            files[at].1.extend(time.clone());
        }
        files
    }

    /// Opens the file that a key of a table names.
    fn open(&self, node: &Node<'_>, key: &str, path: &str) -> Result<Arc<DataFile>, Diagnostic> {
        if let Some((_, file)) = self.known.borrow().iter().find(|(known, _)| known == path) {
            return Ok(Arc::clone(file));
        }
        let file = Arc::new(open(node, key, path, self.files)?);
        self.known.borrow_mut().push((path.to_owned(), Arc::clone(&file)));
        Ok(file)
    }
}

fn open(node: &Node<'_>, key: &str, path: &str, files: &dyn Files) -> Result<DataFile, Diagnostic> {
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
        _ if OutsideFolder::is_reason_of(&error) => {
            way_out = Some(OutsideFolder::HELP.to_owned());
            format!("the data file `{shown}` cannot be read: {error}")
        }
        _ => format!("the data file `{shown}` cannot be read: {error}"),
    };
    let place = node.child(key).expect("it was just read");
    Err(place
        .diagnostic(why)
        .with_help(way_out.as_deref().unwrap_or("paths are relative to the folder of the study file")))
}

/// Time axis of a data file.
#[derive(Clone)]
struct Clock {
    /// Name of the time column; empty if the samples are counted.
    column: String,
    /// Times of all rows in the file, s.
    times: Arc<Vec<f64>>,
    /// Time in the file that is time 0 of the study, s.
    zero: f64,
    /// Time stamp of time 0 in the file, if the file has time stamps.
    origin: Option<Origin>,
}

impl Clock {
    /// Reads the time column, or counts samples. `column` is one of the columns that were sampled then.
    fn new(
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
    fn at(&self, row: usize) -> f64 {
        self.times[row] - self.zero
    }

    /// Returns the first row of a range whose time, in the study, is not below `t`.
    fn first_from(&self, rows: Range<usize>, t: f64) -> usize {
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

/// Keys of a column that is in another file than that of its experiment.
struct Elsewhere<'a> {
    file: Option<&'a str>,
    time: Option<&'a str>,
    unit: Option<&'a str>,
    sample_time: Option<&'a Quantity>,
}

impl<'a> Elsewhere<'a> {
    fn of(
        file: &'a Option<String>,
        time: &'a Option<String>,
        unit: &'a Option<String>,
        sample_time: &'a Option<Quantity>,
    ) -> Self {
        Self { file: file.as_deref(), time: time.as_deref(), unit: unit.as_deref(), sample_time: sample_time.as_ref() }
    }

    /// Returns the table of the other file or the other time axis, on the clock of `main`; `None` if both are those of
    /// `main`.
    fn table(
        &self,
        place: &Node<'_>,
        column: &str,
        main: &Table,
        opened: &Opened<'_>,
        is_measured: bool,
    ) -> Result<Option<Table>, Diagnostic> {
        if self.file.is_none() && self.time.is_none() && self.sample_time.is_none() {
            return Ok(None);
        }
        let file = match self.file {
            Some(path) => opened.open(place, "file", path)?,
            None => Arc::clone(&main.file),
        };
        let mut clock = Clock::new(place, &file, self.time, self.unit, self.sample_time, column)?;
        file.increases(&clock.column, &clock.times, 0)?;
        let between = between(clock.origin, main.clock.origin).map_err(|(fact, way_out)| {
            place.diagnostic(format!("{fact}, so that they have no common clock")).with_help(way_out)
        })?;
        // Rounding must not part samples of both files that belong to one instant.
        let count = main.rows.len().max(2) - 1;
        #[allow(clippy::cast_precision_loss)]
        let close = SAME * (main.clock.at(main.rows.end - 1) - main.clock.at(main.rows.start)) / count as f64;
        let own = clock.times.iter().map(|t| {
            let t = t - (main.clock.zero - between);
            let after = main.clock.first_from(main.driving.clone(), t);
            let near = [after.wrapping_sub(1), after].into_iter().filter(|row| main.driving.contains(row));
            near.map(|row| main.clock.at(row)).find(|known| (known - t).abs() <= close).unwrap_or(t)
        });
        let own: Vec<f64> = own.collect();
        clock = Clock { times: Arc::new(own), zero: 0.0, ..clock };
        let all = 0..clock.times.len();
        let first = clock.first_from(all.clone(), main.clock.at(main.rows.start));
        let last = clock.times.partition_point(|&t| t <= main.clock.at(main.rows.end - 1)).max(first);
        if is_measured && first == last {
            let [from, to] = [main.clock.at(main.rows.start), main.clock.at(main.rows.end - 1)];
            let [begins, ends] = [clock.at(0), clock.at(clock.times.len() - 1)];
            let fact = match (begins > to, ends < from) {
                (true, _) => format!("this file begins {} s after the experiment ends", begins - to),
                (_, true) => format!("this file ends {} s before the experiment begins", from - ends),
                _ => "this file has no sample during the experiment".to_owned(),
            };
            return Err(place
                .diagnostic(fact)
                .with_help("the times of all files are on one clock: correct the time column, or `from` and `to`"));
        }
        Ok(Some(Table { file, rows: first..last, driving: all, clock, end: main.end, past: main.past, is_other: true }))
    }
}

/// Returns the time from the first stamp of the file of the experiment to that of another file, s.
///
/// # Errors
/// If their times count from different instants: the fact and the way out.
fn between(own: Option<Origin>, of_main: Option<Origin>) -> Result<f64, (String, &'static str)> {
    let (own, of_main) = match (own, of_main) {
        (Some(own), Some(of_main)) => (own, of_main),
        (None, None) => return Ok(0.0),
        (own, _) => {
            let [with, without] = if own.is_some() { OF_BOTH } else { [OF_BOTH[1], OF_BOTH[0]] };
            let fact = format!("{with} has time stamps, but {without} has not");
            return Err((fact, "give both the same kind of time"));
        }
    };
    let only = |wanted: Reference| {
        let [this, main] = OF_BOTH;
        format!("only the time stamps of {} have", if own.reference == wanted { this } else { main })
    };
    match (own.reference, of_main.reference) {
        (a, b) if a == b =>
        {
            #[allow(clippy::cast_precision_loss)]
            Ok((own.nanoseconds - of_main.nanoseconds) as f64 * 1e-9)
        }
        (Reference::Midnight, of_other) | (of_other, Reference::Midnight) => {
            Err((format!("{} dates", only(of_other)), "give both the same kind of time"))
        }
        _ => Err((
            format!("{} a zone", only(Reference::Universal)),
            "write the zone of the other stamps too, such as 2024-06-01T02:00:00+02:00, or Z for universal time",
        )),
    }
}

/// Names of the two files of a comparison.
const OF_BOTH: [&str; 2] = ["this file", "the file of the experiment"];

/// Distance of two samples of different files, relative to the mean time between samples, up to which they belong to
/// one instant.
const SAME: f64 = 1e-6;

/// Returns the time by which a column is moved, s.
fn read_shift(place: &Node<'_>, shift: Option<&Quantity>) -> Result<f64, Diagnostic> {
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
struct Table {
    file: Arc<DataFile>,
    /// Time axis, in the time of the study.
    clock: Clock,
    /// Rows used for measurements.
    rows: Range<usize>,
    /// Rows that inputs may be taken from.
    driving: Range<usize>,
    /// Time of the last measurement in the study, s: inputs are needed until then.
    end: f64,
    /// Time before the start for which inputs are kept, s.
    past: f64,
    /// True if the file or its time axis is not that of the experiment.
    is_other: bool,
}

/// Time before a window for which inputs are kept, relative to its length.
const PAST: f64 = 2.0;

impl Table {
    fn new(node: &Node<'_>, section: &ExperimentSection, file: Arc<DataFile>) -> Result<Self, Diagnostic> {
        let columns = section.channels.0.iter().map(|(_, Short(channel))| &channel.column);
        let inputs = section.inputs.0.iter().map(|(_, RecordedInput(input))| &input.column);
        let inputs = inputs.filter(|column| !column.is_empty());
        let column = columns.chain(inputs).next();
        let (time, unit) = (section.time.as_deref(), section.time_unit.as_deref());
        let column = column.map_or("", String::as_str);
        let mut clock = Clock::new(node, &file, time, unit, section.sample_time.as_ref(), column)?;
        let times = Arc::clone(&clock.times);
        let skip = section.skip.min(times.len());
        file.increases(&clock.column, &times, skip)?;

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
        clock.zero = if section.reset_time == Some(false) { 0.0 } else { times[first] };
        let end = clock.at(last - 1) + ahead(node, section)?;
        Ok(Self {
            file,
            clock,
            rows: first..last,
            driving: skip..times.len(),
            end,
            past: f64::INFINITY,
            is_other: false,
        })
    }

    /// Returns the windows into which an experiment is divided, each from its own time 0 on; the whole table without
    /// windows.
    fn windows(self, node: &Node<'_>, section: &ExperimentSection) -> Result<Vec<Self>, Diagnostic> {
        let Some(length) = read_seconds(node, "windows", section.windows.as_ref())? else { return Ok(vec![self]) };
        let place = node.child("windows").expect("it was just read");
        if section.reset_time == Some(false) {
            let place = node.child("reset-time").expect("it was just read");
            return Err(place
                .key_diagnostic("`reset-time = false` excludes `windows`, which start at their own time 0".to_owned())
                .with_help("remove one of them"));
        }
        let ahead = ahead(node, section)?;
        let mut steps: Vec<f64> =
            self.clock.times[self.rows.clone()].windows(2).map(|pair| pair[1] - pair[0]).collect();
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
            let start = self.clock.at(first);
            let next = self.clock.first_from(first..self.rows.end, start + length - CLOSE);
            // A pause that is longer than a window ends one.
            let pause = (first + 1..self.rows.end).find(|&row| self.clock.at(row) - self.clock.at(row - 1) > length);
            let end = (next + 1).min(self.rows.end);
            let is_paused = pause.is_some_and(|pause| pause < end);
            let end = pause.map_or(end, |pause| pause.min(end));
            let covers = self.clock.at(end - 1) - start;
            if end < first + 2 && !is_paused {
                let fact = format!("a window of {length} s at {} s has less than two samples", self.clock.times[first]);
                return Err(place.diagnostic(fact).with_help("choose a longer time"));
            }
            if covers >= 0.5 * length && end >= first + 2 {
                let clock = Clock { zero: self.clock.times[first], ..self.clock.clone() };
                let (file, driving) = (Arc::clone(&self.file), self.driving.clone());
                let end_time = covers + ahead;
                let past = PAST * length;
                windows.push(Self { file, clock, rows: first..end, driving, end: end_time, past, is_other: false });
            }
            // The last sample of a window is the first of the next one, but for a pause.
            first = if is_paused { end } else { next };
        }
        if windows.is_empty() {
            let all = self.clock.at(self.rows.end - 1) - self.clock.at(self.rows.start);
            let fact = format!("a window of {length} s is more than twice as long as the record of {all} s");
            return Err(place.diagnostic(fact).with_help("choose a shorter time"));
        }
        Ok(windows)
    }

    /// Returns the rows used for an input whose time stamps are shifted: from the last one before the start of the
    /// simulation at 0 s, which may precede the first measurement, to those after its end that interpolation needs.
    /// `None` if the file starts later.
    fn driven(&self, shift: f64) -> Option<Range<usize>> {
        let before = self.clock.times[self.driving.clone()].partition_point(|t| t - self.clock.zero + shift <= 0.0);
        let start = self.driving.start + before.checked_sub(1)?;
        let end = self.clock.first_from(self.driving.clone(), self.end - shift);
        // Band-limited interpolation uses three samples on either side.
        Some(start..(end + 3).min(self.driving.end).max(start + 1))
    }

    fn channel(&self, place: &Node<'_>, signal: &str, table: &ChannelTable) -> Result<ChannelBuilder, Diagnostic> {
        let (values, unit) =
            self.values(place, &table.column, table.unit.as_deref(), table.scale, table.offset.as_ref())?;
        let shift = read_shift(place, table.shift.as_ref())?;
        // A shifted sample before the start of the simulation has no counterpart in it.
        let rows = self.rows.clone().filter(|&row| shift == 0.0 || self.clock.at(row) + shift >= 0.0);
        let (times, values) = rows.map(|row| (self.clock.at(row) + shift, values[row])).unzip();
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
    fn input(&self, place: &Node<'_>, table: &InputTable) -> Result<(Input, Option<Unit>, usize), Diagnostic> {
        let shift = read_shift(place, table.shift.as_ref())?;
        let Some(rows) = self.driven(shift) else {
            let first = self.clock.at(self.driving.start) + shift;
            let fact = format!("the simulation starts at 0 s, but `{}` is unknown before {first} s", table.column);
            let help = match self.is_other || shift != 0.0 {
                true => {
                    "the times of all files are on one clock: correct `shift`, or start the experiment later with `from`"
                }
                false => "omit `reset-time = false` to start at the first sample, or record the input from 0 s on",
            };
            return Err(place.diagnostic(fact).with_help(help));
        };
        let last = self.clock.at(self.driving.end - 1) + shift;
        if last < 0.0 {
            let fact = format!("`{}` ends {} s before the experiment starts", table.column, -last);
            let help = "the times of all files are on one clock: correct `shift`, or the time column";
            return Err(place.diagnostic(fact).with_help(help));
        }
        self.sampled(place, table, shift, rows)
    }

    /// Returns the last time of an input from another file and the end of the experiment, if the input ends before by
    /// more than its mean time between samples.
    fn ends_early(&self, input: &Input) -> Option<(f64, f64)> {
        let Input::Sampled { times, .. } = input else { return None };
        let last = *times.last()?;
        #[allow(clippy::cast_precision_loss)]
        let step = (last - times[0]) / (times.len().max(2) - 1) as f64;
        (self.is_other && last + 1.5 * step < self.end).then_some((last, self.end))
    }

    /// Returns an input from these rows; under zero-order hold, missing samples are left out.
    fn sampled(
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
            let earlier = self.clock.first_from(self.driving.clone(), -self.past - shift).min(rows.start);
            let gap = (earlier..rows.start).rev().find(|row| hold != Hold::Zero && is_missing(row));
            rows.start = gap.map_or(earlier, |gap| gap + 1);
            rows.start += (rows.start..needed.start).take_while(is_missing).count();
        }
        if let Some(row) = needed.clone().find(is_missing).filter(|&row| hold != Hold::Zero || row == rows.start) {
            let fact = format!("the input column `{}` has a missing sample at {} s", table.column, self.clock.at(row));
            let help = match hold {
                Hold::Zero => "the first sample is needed: cut the record with `from`, or drop samples with `skip`",
                _ => "add the sample, cut it off with `from` and `to`, or use hold = \"zero\", which keeps the value",
            };
            return Err(self.at(&table.column, row, &fact).unwrap_or_else(|| place.diagnostic(fact)).with_help(help));
        }
        let kept = rows.clone().filter(|row| !is_missing(row));
        let (times, kept): (Vec<f64>, Vec<f64>) = kept.map(|row| (self.clock.at(row) + shift, values[row])).unzip();
        let missing = needed.filter(is_missing).count();
        Ok((Input::Sampled { times, values: kept, hold }, unit, missing))
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
        let column = column_at(&at, &self.file, name)?;
        let time_rows = self.clock.times.len();
        if column.values.len() != time_rows {
            return Err(at
                .diagnostic(format!(
                    "`{name}` has {} samples, but the time{} has {time_rows}",
                    column.values.len(),
                    if self.clock.column.is_empty() {
                        String::new()
                    } else {
                        format!(" column `{}`", self.clock.column)
                    }
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
    fn at(&self, column: &str, row: usize, fact: &str) -> Option<Diagnostic> {
        let span = self.file.span_of(column, row);
        (span != (0..0)).then(|| Diagnostic::new(fact).at(&self.file.source, span))
    }
}

/// Returns the quantity of a channel with the unit of its column if it has none, as for `offset`.
fn in_unit_of_column(quantity: &Quantity, unit: Option<&Unit>) -> Quantity {
    Quantity { unit: quantity.unit.clone().or(unit.cloned()), ..quantity.clone() }
}
