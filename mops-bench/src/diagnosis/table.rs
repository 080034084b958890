//! CSV tables of the cases, and of the estimated effect parameters with their true values.

use super::judge::Row;
use super::tool::spelt;

const HEADER: [&str; 19] = [
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
    "failure",
];

/// Returns the cases as CSV.
pub(crate) fn csv(rows: &[Row]) -> String {
    written(&HEADER, rows.iter().map(cells))
}

/// Returns the parameters of true effects that were found as CSV: case, size, parameter, true value, estimate, interval.
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
        format!("{:?}", row.kind).to_lowercase(),
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
            String::new(),
        ]),
        Err(why) => {
            cells.extend(std::iter::repeat_n(String::new(), HEADER.len() - 6));
            cells.push(why.clone());
        }
    }
    cells
}
