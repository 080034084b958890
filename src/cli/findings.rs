//! Text of the findings of tasks and of the identifiability of a calibration, for the terminal.

use mops_core::solver::Pareto;
use mops_outcome::{
    Outcome, SweepReport, TradeOffs,
    identification::{ExcitationReport, RegressionReport, SensitivityReport, excitation_words},
};
use serde_json::{Map, Value};

use super::robustness;
use crate::numbers::significant;
use crate::report::combination;
use crate::terminal::{number, table};

/// Formats the findings other than criteria and tuners; empty if there are none.
pub(super) fn text(outcome: &Outcome) -> String {
    let mut text = String::new();
    let calibration = outcome.calibration.as_ref();
    let inputs = calibration.map(|c| c.excitation.as_slice()).unwrap_or_default();
    if let Some(found) = calibration.and_then(|c| c.sensitivity.as_ref()) {
        text += &format!("\nidentifiability\n{}", sentences(&found.words));
    }
    if let Some(found) = &outcome.found.sensitivity {
        text += &sensitivity(found);
    }
    if let Some(found) = &outcome.found.excitation {
        text += &excitation(&found.inputs, &words_of(&found.inputs));
        text += &found.regressions.iter().map(regression).collect::<String>();
    }
    if !inputs.is_empty() {
        text += &excitation(inputs, &excitation_words(inputs));
    }
    if let Some(found) = &outcome.found.sweep {
        text += &sweep(found);
    }
    text += &robustness::text(&outcome.found);
    if let Some(found) = &outcome.found.trade_offs {
        text += &front(outcome, found);
    }
    text
}

/// Formats the points of a Pareto front, one line each.
fn front(outcome: &Outcome, found: &TradeOffs) -> String {
    let active: Vec<&str> = outcome.tuners.iter().filter(|t| t.active).map(|t| t.name.as_str()).collect();
    let units = |name: &str| outcome.tuners.iter().find(|t| t.name == name).map_or("", |t| t.unit.as_str());
    let with_unit = |name: &str, unit: &str| if unit == "1" { name.to_owned() } else { format!("{name}, {unit}") };
    let mut header = vec![String::new()];
    header.extend(found.criteria.iter().map(|c| with_unit(&c.key, &c.unit)));
    header.extend(active.iter().map(|name| with_unit(name, units(name))));
    header.extend(["worst scaled", "pareto", ""].map(str::to_owned));
    let rows = outcome.front.iter().zip(&found.points).enumerate().map(|(i, (point, known))| {
        let value = |of: &Map<String, Value>, name: &str| of[name].as_f64().map_or_else(String::new, number);
        let mut row = vec![(i + 1).to_string()];
        row.extend(found.criteria.iter().map(|c| value(&point.objectives, &c.key)));
        row.extend(active.iter().map(|name| value(&point.tuners, name)));
        row.push(number(known.worst_scaled));
        row.push(match known.pareto {
            Pareto::CertifiedLocal => "yes, to first order".to_owned(),
            Pareto::NotShown => "not certified".to_owned(),
            Pareto::No => "no".to_owned(),
        });
        let marks = [(found.nearest == i, "nearest to the demands"), (found.knee == Some(i), "knee")];
        row.push(marks.iter().filter(|(is, _)| *is).map(|(_, mark)| *mark).collect::<Vec<_>>().join(", "));
        row
    });
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let numeric: Vec<usize> = (0..header.len() - 2).collect();
    format!("\nfront\n{}\n{}", table(&header, &numeric, rows.collect()), sentences(&found.words))
}

pub(super) fn sentences(words: &[String]) -> String {
    words.iter().map(|words| format!("- {words}\n")).collect()
}

pub(super) fn share(value: f64) -> String {
    if value.abs() < 1e-13 {
        "0 %".to_owned()
    } else if value.is_finite() {
        format!("{} %", significant(100.0 * value, 3))
    } else {
        String::new()
    }
}

pub(super) fn known(value: f64) -> String {
    if value.is_finite() { number(value) } else { String::new() }
}

fn sensitivity(found: &SensitivityReport) -> String {
    let rows = found.tuners.iter().map(|t| {
        vec![
            t.name.clone(),
            number(t.value),
            t.unit.clone(),
            significant(t.effect, 4),
            known(t.std_error),
            known(t.std_error_alone),
            match (share(t.relative_error), t.relative_to) {
                (text, "range") if !text.is_empty() => format!("{text} of range"),
                (text, _) => text,
            },
            known(t.inflation),
            match t.trust {
                "weak" if t.relative_error > 1.0 => "practically not identifiable".to_owned(),
                trust if trust == "undetermined" || t.std_error.is_finite() => trust.to_owned(),
                _ => String::new(),
            },
        ]
    });
    let header = ["tuner", "value", "unit", "effect", "std. error", "others fixed", "relative", "inflation", ""];
    let mut text = format!("\n{}", table(&header, &[1, 3, 4, 5, 6, 7], rows.collect()));
    let largest = found.relative.eigenvalues.first().copied().unwrap_or(1.0);
    let eigen = found.relative.eigenvalues.iter().zip(&found.relative.eigenvectors).map(|(value, vector)| {
        let direction = combination(found, vector, 0.1).replace('`', "");
        vec![significant(*value, 5), significant(value / largest, 2), direction]
    });
    let header = ["eigenvalue", "share", "direction (relative changes)"];
    text += &format!("\n{}\n{}", table(&header, &[0, 1], eigen.collect()), sentences(&found.words));
    text
}

/// Returns the sentence on every input.
pub(super) fn words_of(inputs: &[ExcitationReport]) -> Vec<String> {
    inputs.iter().map(|input| input.words.clone()).collect()
}

/// Formats the excitation of inputs: a line for each, then sentences.
pub(super) fn excitation(inputs: &[ExcitationReport], words: &[String]) -> String {
    let rows = inputs.iter().map(|input| {
        let least = if input.at_least { "at least " } else { "" };
        vec![
            input.case.clone(),
            input.input.clone(),
            format!("{least}{}", input.order),
            input.parameters.map_or_else(String::new, |n| n.to_string()),
            if input.suffices { "yes".to_owned() } else { "no, asymptotically".to_owned() },
            share(input.eigenvalue),
            input.next_eigenvalue.map_or_else(String::new, share),
            input.transient.map_or_else(String::new, share),
            input.samples.to_string(),
            format!("{} s", number(input.sample_time)),
        ]
    });
    let header = [
        "case",
        "input",
        "order",
        "parameters",
        "sufficient, if linear",
        "weakest direction",
        "next order",
        "with transients",
        "samples",
        "sample time",
    ];
    let rows: Vec<Vec<String>> = rows.collect();
    // For a data file alone the number of parameters is unknown.
    let text = if inputs.iter().all(|input| input.parameters.is_none()) {
        let without = |row: Vec<String>| [&row[..3], &row[5..]].concat();
        let header = [&header[..3], &header[5..]].concat();
        table(&header, &[2, 3, 4, 5, 6, 7], rows.into_iter().map(without).collect())
    } else {
        table(&header, &[2, 3, 5, 6, 7, 8, 9], rows)
    };
    format!("\n{text}\n{}", sentences(words))
}

fn regression(found: &RegressionReport) -> String {
    let rows = found
        .parameters
        .iter()
        .map(|(name, value, error, recursive)| vec![name.clone(), number(*value), known(*error), number(*recursive)]);
    let recursive = format!("recursive, forgetting {}", number(found.forgetting));
    let header = [found.name.as_str(), "least squares", "std. error", recursive.as_str()];
    format!("\n{}\n- {}\n", table(&header, &[1, 2, 3], rows.collect()), found.words)
}

fn sweep(found: &SweepReport) -> String {
    format!("\n{}", sentences(&found.words))
}
