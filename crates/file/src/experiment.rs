//! Experiments of a study file: from the columns of a data file to channels and inputs.

mod elsewhere;
mod opened;
mod table;
mod time_axis;

use mops_core::{
    case::Input,
    study::{CaseBuilder, Free, Measured, matches_pattern},
};
use mops_language::{
    Diagnostic, Quantity, Unit,
    entries::Short,
    files::{Files, OutsideFolder},
};

use super::columns::entry;
use super::frequency;
use super::sections::{ExperimentSection, InputTable, RecordedInput};
use super::tree::Node;
use elsewhere::Elsewhere;
use opened::Opened;
use table::{Table, read_shift};
use time_axis::TimeAxis;

/// Reads an experiment and its data: several experiments from several files, or if it is divided into windows.
pub(super) fn read(name: &str, node: &Node<'_>, files: &dyn Files) -> Result<Vec<CaseBuilder>, Diagnostic> {
    let section: ExperimentSection = node.read()?;
    let opened = Opened::new(files);
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
    let file = Opened::new(files).open(place, "path", path)?;
    let keys = Elsewhere::of(&None, &column.time, &column.time_unit, &column.sample_time);
    let axis = TimeAxis::new(place, &file, keys.time, keys.unit, keys.sample_time, &column.column)?;
    file.increases(&axis.column, &axis.times, 0)?;
    let rows = 0..axis.times.len();
    let table =
        Table { file, driving: rows.clone(), rows, axis, end: f64::INFINITY, past: f64::INFINITY, is_other: true };
    let shift = read_shift(place, column.shift.as_ref())?;
    let last = table.axis.at(table.rows.end - 1) + shift;
    if last < 0.0 {
        let fact = format!("`{}` ends {} s before the simulation starts at 0 s", column.column, -last);
        return Err(place.diagnostic(fact).with_help("correct `shift`, or the time column"));
    }
    let (input, unit, _) = table.sampled(place, column, shift, table.rows.clone())?;
    Ok((input, unit))
}
