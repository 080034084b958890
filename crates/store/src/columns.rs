//! Conversion between a stored point and the columns of its table.

use mops_core::{
    Failure, Study, Value,
    criterion::Missed,
    run::{JobValues, Known},
};
use rusqlite::Row;
use serde_json::json;

use super::bytes;

/// Columns of a point: criteria, notes, failures.
pub(super) type Columns = (Vec<u8>, Option<String>, Option<String>);

/// Converts the values of a point to columns.
pub(super) fn columns(known: &Known, rows: usize) -> Columns {
    let mut criteria = vec![f64::NAN; rows];
    let mut notes = serde_json::Map::new();
    let mut failures = Vec::new();
    for (job, values) in &known.jobs {
        match values {
            Err(failure) => {
                let (kind, at, why) = match failure {
                    Failure::Diverged(t) => ("diverged", Some(t), None),
                    Failure::StepLimit(t, why) => ("step-limit", Some(t), Some(why)),
                    Failure::StepTooSmall(t) => ("step-too-small", Some(t), None),
                    Failure::EventsAccumulate(t, why) => ("events-accumulate", Some(t), Some(why)),
                    Failure::Undefined(why) => ("undefined", None, Some(why)),
                    Failure::RecordLimit(t) => ("record-limit", Some(t), None),
                    Failure::Criterion(why) => ("criterion", None, Some(why)),
                    Failure::Cancelled => continue,
                };
                // Times are written as text, which preserves every bit, infinities and NaN.
                failures.push(json!({ "job": job, "kind": kind, "at": at.map(f64::to_string), "why": why }));
            }
            Ok(values) => {
                for (row, value) in values {
                    match value {
                        Err(why) => failures.push(json!({ "row": row, "why": why })),
                        Ok(value) => {
                            criteria[*row] = value.number;
                            let missed = value.missed.map(|missed| missed.horizon.map(|h| h.to_string()));
                            match (value.note, missed) {
                                (None, None) => {}
                                (Some(note), None) => drop(notes.insert(row.to_string(), json!(note))),
                                (note, Some(horizon)) => drop(notes.insert(row.to_string(), json!([note, horizon]))),
                            }
                        }
                    }
                }
            }
        }
    }
    let text = |value: serde_json::Value| value.to_string();
    (
        bytes::of_numbers(&criteria),
        (!notes.is_empty()).then(|| text(notes.into())),
        (!failures.is_empty()).then(|| text(failures.into())),
    )
}

/// Converts the columns of a point to its values. A job is known if it failed, or for those of its rows that have a
/// value or a reason for a missing one.
pub(super) fn known(
    row: &Row<'_>,
    study: &Study,
    intern: &mut dyn FnMut(&str) -> &'static str,
) -> rusqlite::Result<Known> {
    let criteria = bytes::numbers(row.get_ref(1)?.as_blob()?);
    let json = |column: usize| -> rusqlite::Result<serde_json::Value> {
        let text = row.get_ref(column)?.as_str_or_null()?;
        Ok(text.and_then(|text| serde_json::from_str(text).ok()).unwrap_or_default())
    };
    let (notes, failures) = (json(2)?, json(3)?);
    let failures = failures.as_array().cloned().unwrap_or_default();
    let of = |key: &str, index: usize| failures.iter().find(|failure| failure[key].as_u64() == Some(index as u64));

    let mut known = Known::default();
    for job in 0..study.jobs().len() {
        if let Some(failure) = of("job", job) {
            known.jobs.push((job, Err(failure_of(failure))));
            continue;
        }
        let mut value = |index: usize| -> Option<Result<Value, String>> {
            if let Some(why) = of("row", index) {
                return Some(Err(why["why"].as_str().unwrap_or_default().to_owned()));
            }
            let number = *criteria.get(index).filter(|number| number.is_finite())?;
            // Either a note, or a note and the horizon if the target was never reached.
            let written = &notes[index.to_string()];
            let missed = written
                .is_array()
                .then(|| Missed { horizon: written[1].as_str().and_then(|horizon| horizon.parse().ok()) });
            let note = written.as_str().or(written[0].as_str()).map(&mut *intern);
            Some(Ok(Value { number, note, missed, ..Value::default() }))
        };
        let rows = (0..study.rows().len()).filter(|&index| study.rows()[index].job == job);
        let values: Vec<_> = rows.filter_map(|index| Some((index, value(index)?))).collect();
        if !values.is_empty() {
            known.jobs.push((job, JobValues::Ok(values)));
        }
    }
    Ok(known)
}

fn failure_of(written: &serde_json::Value) -> Failure {
    let at = written["at"].as_str().and_then(|at| at.parse().ok()).unwrap_or(f64::NAN);
    let why = written["why"].as_str().unwrap_or_default().to_owned();
    match written["kind"].as_str() {
        Some("diverged") => Failure::Diverged(at),
        Some("step-limit") => Failure::StepLimit(at, why),
        Some("step-too-small") => Failure::StepTooSmall(at),
        Some("events-accumulate") => Failure::EventsAccumulate(at, why),
        Some("record-limit") => Failure::RecordLimit(at),
        Some("criterion") => Failure::Criterion(why),
        _ => Failure::Undefined(why),
    }
}
