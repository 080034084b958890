//! Header of a CSV file: names and units of the columns, as people and instruments write them.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use mops_language::{Diagnostic, Source, Unit};

use super::cells::{cells, first_line, is_value, number, refuse_long_quotes, separator};
use super::formulas::from_text;
use super::stamps::Form;

pub(super) struct Header {
    pub separator: u8,
    /// Name and unit of each column.
    pub names: Vec<(String, Option<String>)>,
    pub span: Range<usize>,
    /// First byte of the rows.
    pub body: usize,
}

impl Header {
    /// Reads the header in the line that starts at `start`.
    pub fn read(source: &Arc<Source>, start: usize) -> Result<Self, Diagnostic> {
        let text = &source.text;
        let separator = separator(text, start);
        let spans: Vec<_> = cells(text, start, separator).collect();
        let span = start..spans.last().expect("every line has a cell").end;
        // A line of numbers and time stamps is a row; the file has no header then.
        let shown = || spans.iter().map(|cell| &text[cell.clone()]);
        let is_gap = |cell: &str| number(cell.as_bytes(), separator).is_some_and(f64::is_nan);
        if shown().all(|cell| is_value(cell, separator)) && !shown().all(is_gap) {
            let names = (1..=spans.len()).map(|k| (k.to_string(), None)).collect();
            return Ok(Self { separator, names, span, body: start });
        }
        refuse_long_quotes(source, start, separator)?;
        let name = |(cell, k): (&Range<usize>, usize)| name_and_unit(&text[cell.clone()], k);
        let mut names: Vec<_> = spans.iter().zip(1..).map(name).collect();
        let mut body = span.end;
        if names.iter().all(|(_, unit)| unit.is_none())
            && let Some((units, end)) = units_below(text, body, separator, names.len())
        {
            names.iter_mut().zip(units).for_each(|((_, unit), below)| *unit = below);
            body = end;
        }
        units_at_ends(&mut names);
        keep_labels_that_differ(&mut names);
        refuse_duplicates(source, &names, &spans)?;
        Ok(Self { separator, names, span, body })
    }

    /// Returns true if the last cell is empty.
    pub fn ends_unnamed(&self, source: &Arc<Source>) -> bool {
        self.names.len() > 1 && source.text[self.span.clone()].ends_with(char::from(self.separator))
    }
}

/// Splits a label into name and unit: `u [N*m]`, or `u (N*m)`, `u / (N*m)` (ISO 80000-1, 7.1.4), `u in N*m` and
/// `u, N*m` if the rest is a unit.
pub(super) fn label(text: &str) -> Option<(&str, &str)> {
    let text = text.trim();
    let within = |open: char, close: char| {
        let (name, unit) = text.strip_suffix(close)?.rsplit_once(open)?;
        Some((name.trim(), unit.trim()))
    };
    let after = |mark: &str| {
        let (name, unit) = text.rsplit_once(mark)?;
        let unit = unit.trim();
        let bare = unit.strip_prefix('(').and_then(|unit| unit.strip_suffix(')')).unwrap_or(unit);
        Some((name.trim(), bare))
    };
    // `trial (2)` and `motor (left)` have no unit.
    let is_unit =
        |text: &str| text.contains(|c: char| c.is_alphabetic() || "%\u{b0}".contains(c)) && is_unit_or_form(text);
    let named = |(name, unit): &(&str, &str)| !name.is_empty() && is_unit(unit);
    let marked = || [" / ", " in ", ", "].into_iter().find_map(|mark| after(mark).filter(named));
    within('[', ']').or_else(marked).or_else(|| within('(', ')').filter(named))
}

/// Returns true for a unit, or the form of time stamps.
fn is_unit_or_form(text: &str) -> bool {
    Unit::parse(text).is_ok() || Form::parse(text).is_some()
}

/// Formats a label that [`label`] can read.
pub(super) fn labelled(name: &str, unit: &str) -> String {
    format!("{name} ({unit})")
}

/// Returns the content of a cell without its quotes.
fn unquoted(cell: &str) -> String {
    let cell = cell.trim();
    let inner = cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"'));
    inner.map_or(cell.to_owned(), |cell| cell.replace("\"\"", "\""))
}

/// Splits a cell of the header into name and unit; an unnamed column gets its number as name.
fn name_and_unit(cell: &str, k: usize) -> (String, Option<String>) {
    let cell = unquoted(cell);
    let cell = from_text(&cell);
    let (name, unit) = label(cell).unwrap_or((cell, ""));
    let (name, unit) = (name.trim(), unit.trim());
    let name = if name.is_empty() { k.to_string() } else { name.to_owned() };
    (name, (!unit.is_empty()).then(|| unit.to_owned()))
}

/// Returns the units in the line below the names, and its end: every cell is a unit, or empty or `-` for none.
fn units_below(text: &str, body: usize, separator: u8, count: usize) -> Option<(Vec<Option<String>>, usize)> {
    let start = body + first_line(&text[body..])?;
    let spans: Vec<_> = cells(text, start, separator).collect();
    let unit = |span: &Range<usize>| {
        let cell = unquoted(&text[span.clone()]);
        let bare = [('[', ']'), ('(', ')')]
            .into_iter()
            .find_map(|(open, close)| cell.strip_prefix(open)?.strip_suffix(close))
            .unwrap_or(&cell)
            .trim();
        match bare {
            "" | "-" | "1" => Some(None),
            unit => is_unit_or_form(unit).then(|| Some(unit.to_owned())),
        }
    };
    let units: Vec<Option<String>> = spans.iter().map(unit).collect::<Option<_>>()?;
    (units.len() == count && units.iter().any(Option::is_some)).then(|| (units, spans.last().map_or(start, |s| s.end)))
}

/// Units that a name may end with after `_`, as in `T_oven_degC`: those that no index looks like.
const AT_ENDS: [&str; 39] = [
    "degC", "degF", "degR", "rad", "deg", "rev", "rpm", "Hz", "kHz", "MHz", "ms", "us", "ns", "mm", "cm", "km", "um",
    "kg", "kN", "Nm", "mNm", "kW", "MW", "mW", "mA", "mV", "kV", "bar", "mbar", "Pa", "kPa", "hPa", "MPa", "Ohm",
    "kOhm", "Wh", "kWh", "Ah", "mAh",
];

/// Units of one letter, which count only if every name of the header ends with a unit, as in `time_s,P_heater_W`: `x_m`
/// may be a measured `x`.
const LETTERS: [&str; 11] = ["s", "h", "m", "g", "V", "A", "W", "N", "J", "K", "L"];

/// Adds the units at the ends of names without one; the names keep them.
fn units_at_ends(names: &mut [(String, Option<String>)]) {
    let end = |name: &str| name.rsplit_once('_').filter(|(stem, _)| !stem.is_empty()).map(|(_, end)| end.to_owned());
    let sure = |name: &str| {
        let end = end(name)?;
        (AT_ENDS.contains(&end.as_str()) || stem_of_time(name).is_some()).then_some(end)
    };
    let letter = |name: &str| end(name).filter(|end| LETTERS.contains(&end.as_str()));
    let all = names.len() > 1
        && names.iter().all(|(name, unit)| unit.is_some() || sure(name).is_some() || letter(name).is_some());
    for (name, unit) in names.iter_mut().filter(|(_, unit)| unit.is_none()) {
        *unit = sure(name).or_else(|| letter(name).filter(|_| all));
    }
}

/// Names of a time column besides `t`, in lower case. `T` may be a temperature.
const TIMES: [&str; 15] = [
    "time",
    "timestamp",
    "time stamp",
    "datetime",
    "date time",
    "elapsed",
    "elapsed time",
    "zeit",
    "zeitstempel",
    "uhrzeit",
    "temps",
    "tiempo",
    "tempo",
    "tijd",
    "tid",
];

/// Returns true for the name of a time column, such as `time_s` or `Zeit`.
pub(super) fn is_time(name: &str) -> bool {
    is_named_time(name) || stem_of_time(name).is_some()
}

fn is_named_time(name: &str) -> bool {
    name == "t" || TIMES.contains(&name.to_lowercase().as_str())
}

/// Words for a date or a day in the name of a column, in lower case.
const DATES: [&str; 17] = [
    "date",
    "dates",
    "datum",
    "fecha",
    "dato",
    "day",
    "days",
    "weekday",
    "tag",
    "tage",
    "wochentag",
    "jour",
    "dag",
    "d\u{ed}a",
    "dia",
    "giorno",
    "ymd",
];

/// Returns true for the name of a column of dates, such as `Date (UTC)` or `Messdatum`.
pub(super) fn is_date(name: &str) -> bool {
    let name = name.to_lowercase();
    let mut words = name.split(|c: char| !c.is_alphabetic());
    words.any(|word| DATES.contains(&word) || word.ends_with("datum"))
}

/// Returns the part before the unit of a name such as `time_s`.
fn stem_of_time(name: &str) -> Option<&str> {
    let (stem, unit) = name.rsplit_once('_')?;
    (is_named_time(stem) && ["s", "ms", "us", "ns", "min", "h"].contains(&unit)).then_some(stem)
}

/// Uses the whole label as name for columns that differ only in their units, such as `motor (V)` and `motor (A)`.
fn keep_labels_that_differ(names: &mut [(String, Option<String>)]) {
    let differs = |(name, unit): &(String, Option<String>)| {
        let count = |unit: Option<&String>| {
            names
                .iter()
                .filter(|other| other.0 == *name && unit.is_none_or(|unit| other.1.as_ref() == Some(unit)))
                .count()
        };
        unit.is_some() && count(unit.as_ref()) < count(None)
    };
    let differs: Vec<bool> = names.iter().map(differs).collect();
    for ((name, unit), _) in names.iter_mut().zip(differs).filter(|(_, differs)| *differs) {
        *name = labelled(name, unit.as_deref().unwrap_or_default());
    }
}

fn refuse_duplicates(
    source: &Arc<Source>,
    names: &[(String, Option<String>)],
    spans: &[Range<usize>],
) -> Result<(), Diagnostic> {
    let mut seen = HashMap::new();
    for (k, (name, _)) in names.iter().enumerate() {
        if let Some(first) = seen.insert(name, k) {
            return Err(Diagnostic::new(format!("columns {} and {} have the same name `{name}`", first + 1, k + 1))
                .with_label("second column")
                .with_help("rename one of them in the header")
                .at(source, spans[k].clone()));
        }
    }
    Ok(())
}

/// Largest number of lines before the header of a file.
const MOST_LINES: usize = 200;

/// Returns the starts of later lines that may be the header, after lines that an instrument or a spreadsheet has
/// written before it: names only, as many as there are cells in the next line, which has numbers. No line before is a
/// row of numbers.
pub(super) fn later_headers(text: &str, first: usize) -> Vec<usize> {
    let mut starts = vec![first];
    while starts.len() <= MOST_LINES {
        let last = starts[starts.len() - 1];
        let Some(end) = text[last..].find(['\n', '\r']) else { break };
        let Some(next) = first_line(&text[last + end..]) else { break };
        starts.push(last + end + next);
    }
    let is_header = |&k: &usize| {
        let lines = Lines { text, starts: &starts, separator: separator(text, starts[k]) };
        lines.is_above_numbers(k) && !lines.has_rival(k) && !(0..k).any(|k| lines.is_row(k))
    };
    (1..starts.len()).filter(is_header).map(|k| starts[k]).collect()
}

/// First lines of a file, without blank lines and comments.
struct Lines<'t> {
    text: &'t str,
    starts: &'t [usize],
    separator: u8,
}

impl Lines<'_> {
    fn cells(&self, line: usize) -> Vec<&str> {
        let start = self.starts.get(line).copied().unwrap_or(self.text.len());
        cells(self.text, start, self.separator).map(|cell| &self.text[cell]).collect()
    }

    fn is_number(&self, cell: &str) -> bool {
        !cell.trim().is_empty() && is_value(cell, self.separator)
    }

    /// Returns true for names, as many as there are cells in the line below, or below the units, which has numbers.
    fn is_above_numbers(&self, line: usize) -> bool {
        let names = self.cells(line);
        let has_numbers = |line: usize| {
            let cells = self.cells(line);
            cells.len() == names.len() && cells.iter().any(|cell| self.is_number(cell))
        };
        let start = self.starts[line];
        let end = start + self.text[start..].find(['\n', '\r']).unwrap_or(self.text.len() - start);
        let has_units = || units_below(self.text, end, self.separator, names.len()).is_some();
        names.len() > 1
            && !names.iter().any(|cell| self.is_number(cell))
            && (has_numbers(line + 1) || (has_units() && has_numbers(line + 2)))
    }

    /// Returns true if the line above has as many names: it may be the header of a file with a damaged row.
    fn has_rival(&self, line: usize) -> bool {
        let looks_like_names = |cells: &[&str]| {
            cells.iter().any(|cell| {
                let (name, unit) = name_and_unit(cell, 1);
                unit.is_some() || is_time(&name)
            })
        };
        let (names, above) = (self.cells(line), self.cells(line - 1));
        above.len() == names.len()
            && above.iter().all(|cell| !cell.trim().is_empty() && !self.is_number(cell))
            && (looks_like_names(&above) || !looks_like_names(&names))
    }

    /// Returns true for a row of numbers.
    fn is_row(&self, line: usize) -> bool {
        let cells = self.cells(line);
        let all = cells.iter().all(|cell| is_value(cell, self.separator));
        cells.len() > 1 && all && cells.iter().any(|cell| self.is_number(cell))
    }
}
