//! Columns that are in another file than that of their experiment, or on another time axis.

use std::sync::Arc;

use mops_data::{Origin, Reference};
use mops_language::{Diagnostic, Quantity};

use super::opened::Opened;
use super::table::Table;
use super::time_axis::TimeAxis;
use crate::tree::Node;

/// Keys of a column that is in another file than that of its experiment.
pub(crate) struct Elsewhere<'a> {
    pub file: Option<&'a str>,
    pub time: Option<&'a str>,
    pub unit: Option<&'a str>,
    pub sample_time: Option<&'a Quantity>,
}

impl<'a> Elsewhere<'a> {
    pub fn of(
        file: &'a Option<String>,
        time: &'a Option<String>,
        unit: &'a Option<String>,
        sample_time: &'a Option<Quantity>,
    ) -> Self {
        Self { file: file.as_deref(), time: time.as_deref(), unit: unit.as_deref(), sample_time: sample_time.as_ref() }
    }

    /// Returns the table of the other file or the other time axis, on the clock of `main`; `None` if both are those of
    /// `main`.
    pub fn table(
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
        let mut axis = TimeAxis::new(place, &file, self.time, self.unit, self.sample_time, column)?;
        file.increases(&axis.column, &axis.times, 0)?;
        let between = between(axis.origin, main.axis.origin).map_err(|(fact, way_out)| {
            place.diagnostic(format!("{fact}, so that they have no common clock")).with_help(way_out)
        })?;
        // Rounding must not part samples of both files that belong to one instant.
        let count = main.rows.len().max(2) - 1;
        #[allow(clippy::cast_precision_loss)]
        let close = SAME * (main.axis.at(main.rows.end - 1) - main.axis.at(main.rows.start)) / count as f64;
        let own = axis.times.iter().map(|t| {
            let t = t - (main.axis.zero - between);
            let after = main.axis.first_from(main.driving.clone(), t);
            let near = [after.wrapping_sub(1), after].into_iter().filter(|row| main.driving.contains(row));
            near.map(|row| main.axis.at(row)).find(|known| (known - t).abs() <= close).unwrap_or(t)
        });
        let own: Vec<f64> = own.collect();
        axis = TimeAxis { times: Arc::new(own), zero: 0.0, ..axis };
        let all = 0..axis.times.len();
        let first = axis.first_from(all.clone(), main.axis.at(main.rows.start));
        let last = axis.times.partition_point(|&t| t <= main.axis.at(main.rows.end - 1)).max(first);
        if is_measured && first == last {
            let [from, to] = [main.axis.at(main.rows.start), main.axis.at(main.rows.end - 1)];
            let [begins, ends] = [axis.at(0), axis.at(axis.times.len() - 1)];
            let fact = match (begins > to, ends < from) {
                (true, _) => format!("this file begins {} s after the experiment ends", begins - to),
                (_, true) => format!("this file ends {} s before the experiment begins", from - ends),
                _ => "this file has no sample during the experiment".to_owned(),
            };
            return Err(place
                .diagnostic(fact)
                .with_help("the times of all files are on one clock: correct the time column, or `from` and `to`"));
        }
        Ok(Some(Table { file, rows: first..last, driving: all, axis, end: main.end, past: main.past, is_other: true }))
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
