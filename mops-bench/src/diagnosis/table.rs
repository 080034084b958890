//! CSV tables of the cases, and of the estimated effect parameters with their true values.

use mops::core::Role;

use super::judge::Row;
use super::tool::{Answer, Dependence, RecordError, spelt};

const HEADER: &[&str] = &[
    "case",
    "missing",
    "size",
    "effects",
    "places",
    "verdict",
    "first",
    "place",
    "decision right",
    "first right",
    "in set",
    "set size",
    "place right",
    "probability",
    "probability of first",
    "p value",
    "seconds",
    "simulations",
    "plant",
    "background",
    "background at",
    "background share",
    "background ratio",
    "background time",
    "truth struck out",
    "named",
    "named at",
    "name right",
    "class and place right",
    "claimed",
    "class probability",
    "depends on",
    "coordinate and place right",
    "remaining",
    "calibration before",
    "calibration after",
    "selection before",
    "selection after",
    "validation before",
    "validation after",
    "failure",
];

/// Returns the cases as CSV.
pub(crate) fn csv(rows: &[Row]) -> String {
    written(HEADER, rows.iter().map(cells))
}

/// Returns the parameters of true effects that were found as CSV: case, size, parameter, true value, estimate,
/// interval.
pub(crate) fn strengths(rows: &[Row]) -> String {
    let lines = rows.iter().flat_map(|row| {
        row.judgement.covered.iter().map(|c| {
            let numbers = [c.truth, c.value, c.interval[0], c.interval[1]].map(|number| number.to_string());
            let named = [row.name.clone(), row.size.to_string(), c.name.clone()];
            named.into_iter().chain(numbers).chain([c.covers().to_string()]).collect()
        })
    });
    written(&["case", "size", "strength", "truth", "value", "from", "to", "truth inside"], lines)
}

fn written(header: &[&str], lines: impl Iterator<Item = Vec<String>>) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(header).expect("memory can be written to");
    for line in lines {
        writer.write_record(line).expect("memory can be written to");
    }
    String::from_utf8(writer.into_inner().expect("memory can be written to")).expect("it was made of texts")
}

fn cells(row: &Row) -> Vec<String> {
    let joined = |pick: fn(&(String, String)) -> &String| {
        row.truth.iter().map(|named| pick(named).as_str()).collect::<Vec<_>>().join("+")
    };
    let mut cells = vec![
        row.name.clone(),
        row.kind.name().to_owned(),
        row.size.to_string(),
        joined(|named| &named.0),
        joined(|named| &named.1),
    ];
    let (first, judged) = (row.answer.as_ref().ok().and_then(|a| a.first()).cloned(), &row.judgement);
    let (effect, place) = first.unwrap_or_default();
    match &row.answer {
        Ok(a) => cells.extend([
            spelt(a.verdict).to_owned(),
            effect,
            a.unexplained_at.clone().filter(|_| place.is_empty()).unwrap_or(place),
            judged.decision.to_string(),
            judged.first.to_string(),
            judged.in_set.to_string(),
            a.set.len().to_string(),
            judged.place.to_string(),
            a.probability.to_string(),
            a.found.first().map_or_else(String::new, |(_, p)| p.to_string()),
            format!("{:e}", a.p_value),
            format!("{:.3}", a.seconds),
            a.simulations.to_string(),
        ]),
        Err(_) => cells.extend(std::iter::repeat_n(String::new(), 13)),
    }
    cells.extend(background(row));
    match &row.answer {
        Ok(answer) => cells.extend(statements(row, answer).into_iter().chain([String::new()])),
        Err(why) => {
            cells.extend(std::iter::repeat_n(String::new(), HEADER.len() - cells.len() - 1));
            cells.push(why.clone());
        }
    }
    cells
}

fn background(row: &Row) -> Vec<String> {
    let mut cells = vec![row.plant.clone()];
    match &row.background {
        Some(background) => cells.extend([
            background.source.to_owned(),
            background.at.clone(),
            format!("{:.4}", background.share),
            format!("{:.1}", background.ratio),
            background.time.map_or_else(String::new, |time| format!("{time:.4}")),
        ]),
        None => cells.extend(std::iter::repeat_n(String::new(), 5)),
    }
    cells.push(row.is_struck_out.to_string());
    cells
}

fn statements(row: &Row, answer: &Answer) -> Vec<String> {
    let stated = &row.judgement.stated;
    let joined = |texts: Vec<String>| texts.join("+");
    let dependence = |found: &Option<Dependence>| {
        found.as_ref().map_or_else(String::new, |d| format!("{} at {}", d.coordinate, d.places.join(" and ")))
    };
    let error = |role: Role, error: fn(&RecordError) -> f64| {
        joined(answer.records.iter().filter(|r| r.role == role).map(|r| format!("{:.4}", error(r))).collect())
    };
    let mut cells = vec![
        joined(answer.found.iter().map(|(named, _)| named.0.clone()).collect()),
        joined(answer.found.iter().map(|(named, _)| named.1.clone()).collect()),
        stated.name.to_string(),
        joined(stated.entries.iter().map(bool::to_string).collect()),
        joined(answer.statements.iter().map(|statement| statement.claimed.to_string()).collect()),
        joined(answer.statements.iter().map(|statement| format!("{:.4}", statement.probability)).collect()),
        dependence(&answer.depends_on),
        stated.coordinate_and_place.map_or_else(String::new, |right| right.to_string()),
        dependence(&answer.remaining),
    ];
    for role in [Role::Calibration, Role::Selection, Role::Validation] {
        cells.extend([error(role, |record| record.before), error(role, |record| record.after)]);
    }
    cells
}
