//! What the data or the criteria determine: sentences, standard errors, correlations, eigenvectors.

use mops_content::{
    numbers::{known, number, percent, precise, share, significant},
    section::{Block, Part, Tone},
    table::{Cell, Table, numbers, text},
};
use mops_outcome::identification::{SensitivityReport, TunerSensitivity};

/// Largest number of tuners with tables of correlations and directions.
const MOST_TUNERS: usize = 24;

/// Title of the section on the tuners of a calibration.
pub(crate) const IDENTIFIABILITY: &str = "Identifiability";

/// Returns the title of the section.
pub(crate) fn title(found: &SensitivityReport) -> &'static str {
    if found.of == "residuals" { IDENTIFIABILITY } else { "Sensitivity of the criteria" }
}

/// Returns sentences and tables for a report.
pub(crate) fn blocks(found: &SensitivityReport) -> Vec<Block> {
    let measured = found.of == "residuals";
    let what = if measured { "weighted residuals" } else { "scaled criteria" };
    let columns = if measured {
        "Alone: standard error if all other tuners were known. Factor: increase of the standard error because they are not known. \
         Relative error: share of the value; for initial states, which may be near zero, and for temperatures in degC or degF, share \
         of the range."
    } else {
        "Factor: effect divided by its part that the other tuners cannot compensate; 1 if they compensate nothing."
    };
    let mut blocks = vec![
        Block::Findings(found.words.clone()),
        Block::Heading("Sensitivity to each tuner".to_owned()),
        Block::text(format!(
            "Effect: root of the sum of squared derivatives of the {what}, per relative change of the tuner. {columns}"
        )),
        Block::Table(accuracy(found, measured)),
    ];
    if (2..=MOST_TUNERS).contains(&found.tuners.len()) {
        let slopes =
            if found.slopes == "tangents" { "exact (automatic differentiation)" } else { "central differences" };
        let limit = if measured {
            " A direction is not determined if one standard error along it spans the whole range of a tuner."
        } else {
            ""
        };
        blocks.extend([
            Block::Heading("Correlation of the estimates".to_owned()),
            Block::Table(correlations(found)),
            Block::Heading("Directions".to_owned()),
            Block::text(format!(
                "Eigenvectors of the sensitivity matrix by decreasing eigenvalue, for relative changes of the tuners (relative to the \
                 range for a value of 0). A joint change of the tuners along a direction with a small eigenvalue has little effect. \
                 Derivatives are {slopes}; they resolve singular values down to {} of the largest.{limit}",
                number(found.zero)
            )),
            Block::Table(directions(found)),
        ]);
    }
    blocks
}

/// Returns tables and sentences for the terminal.
pub(crate) fn lines(found: &SensitivityReport) -> Vec<Block> {
    let columns = [
        text("tuner"),
        numbers("value"),
        text("unit"),
        numbers("effect"),
        numbers("std. error"),
        numbers("others fixed"),
        numbers("relative"),
        numbers("inflation"),
        text(""),
    ];
    let rows = found.tuners.iter().map(|t| -> Vec<Cell> {
        let relative = match (share(t.relative_error), t.relative_to) {
            (text, "range") if !text.is_empty() => format!("{text} of range"),
            (text, _) => text,
        };
        let verdict = match t.trust {
            "weak" if t.relative_error > 1.0 => "practically not identifiable",
            trust if trust == "undetermined" || t.std_error.is_finite() => trust,
            _ => "",
        };
        vec![
            t.name.clone().into(),
            precise(t.value).into(),
            t.unit.clone().into(),
            significant(t.effect, 4).into(),
            known(t.std_error).into(),
            known(t.std_error_alone).into(),
            relative.into(),
            known(t.inflation).into(),
            verdict.into(),
        ]
    });
    let tuners = Table::new("Sensitivity to each tuner", columns).rows(rows);
    let largest = found.relative.eigenvalues.first().copied().unwrap_or(1.0);
    let rows =
        found.relative.eigenvalues.iter().zip(&found.relative.eigenvectors).map(|(value, vector)| -> Vec<Cell> {
            let direction = combination(found, vector, 0.1).replace('`', "");
            vec![significant(*value, 5).into(), significant(value / largest, 2).into(), direction.into()]
        });
    let columns = [numbers("eigenvalue"), numbers("share"), text("direction (relative changes)")];
    let directions = Table::new("Directions", columns).rows(rows);
    vec![Block::Table(tuners), Block::Table(directions), Block::Findings(found.words.clone())]
}

fn accuracy(found: &SensitivityReport, measured: bool) -> Table {
    let mut columns = vec![text("tuner"), numbers("value"), text("unit"), numbers("effect")];
    if measured {
        columns.extend([numbers("standard error"), numbers("alone"), numbers("relative error")]);
    }
    columns.extend([numbers("factor"), text("")]);
    let three = |value: f64| if value.is_finite() { significant(value, 3) } else { String::new() };
    let rows = found.tuners.iter().map(|tuner| {
        let mut row: Vec<Cell> = vec![
            tuner.name.clone().into(),
            number(tuner.value).into(),
            tuner.unit.clone().into(),
            significant(tuner.effect, 3).into(),
        ];
        if measured {
            row.extend([three(tuner.std_error).into(), three(tuner.std_error_alone).into(), relative(tuner)]);
        }
        row.extend([three(tuner.inflation).into(), verdict(tuner, measured)]);
        row
    });
    Table::new("Sensitivity to each tuner", columns).rows(rows)
}

/// Returns the relative standard error, with its reference if that is the range.
pub(crate) fn relative(tuner: &TunerSensitivity) -> Cell {
    if !tuner.relative_error.is_finite() {
        return Cell::default();
    }
    let share = percent(tuner.relative_error);
    if tuner.relative_to == "range" { Cell::with_remark(share, "of the range") } else { share.into() }
}

fn verdict(tuner: &TunerSensitivity, measured: bool) -> Cell {
    match tuner.trust {
        "undetermined" => Cell::toned(Tone::Bad, "not determined"),
        _ if !measured => Cell::default(),
        "weak" if tuner.relative_error > 1.0 => Cell::toned(Tone::Bad, "practically not identifiable"),
        "weak" => Cell::toned(Tone::Mixed, "uncertain"),
        _ if tuner.std_error.is_finite() => Cell::toned(Tone::Good, "determined"),
        _ => Cell::default(),
    }
}

fn correlations(found: &SensitivityReport) -> Table {
    let columns = std::iter::once(text("")).chain(found.tuners.iter().map(|tuner| numbers(&tuner.name)));
    let rows = found.tuners.iter().zip(&found.correlations).enumerate().map(|(i, (tuner, row))| {
        let cell = |(j, value): (usize, &f64)| {
            let shown = if value.is_finite() { format!("{value:.2}") } else { String::new() };
            match i == j {
                true => Cell { is_quiet: true, ..shown.into() },
                false if value.abs() > 0.95 => Cell::new([Part::Toned(Tone::Mixed, shown)]),
                false => shown.into(),
            }
        };
        std::iter::once(tuner.name.clone().into()).chain(row.iter().enumerate().map(cell)).collect::<Vec<Cell>>()
    });
    Table::new("Correlation of the estimates", columns).rows(rows)
}

fn directions(found: &SensitivityReport) -> Table {
    let largest = found.relative.eigenvalues.first().copied().unwrap_or(1.0);
    let own_largest = found.eigenvalues.first().copied().unwrap_or(1.0);
    let relative = found.relative.eigenvalues.iter().zip(&found.relative.eigenvectors);
    let own = found.eigenvalues.iter().zip(&found.eigenvectors);
    let columns = [
        numbers("eigenvalue"),
        numbers("/ largest"),
        text("direction, relative changes"),
        numbers("eigenvalue, own units"),
        numbers("/ largest"),
        text("direction, own units"),
    ];
    let rows = relative.zip(own).map(|((value, vector), (own_value, own_vector))| -> Vec<Cell> {
        vec![
            significant(*value, 4).into(),
            significant(value / largest, 2).into(),
            combination(found, vector, 0.01).into(),
            significant(*own_value, 4).into(),
            significant(own_value / own_largest, 2).into(),
            combination(found, own_vector, 0.01).into(),
        ]
    });
    Table { headings: 0, ..Table::new("Directions", columns).rows(rows) }
}

/// Returns an eigenvector as a sum over the tuners; parts below `least` are omitted.
fn combination(found: &SensitivityReport, vector: &[f64], least: f64) -> String {
    let mut text = String::new();
    for (tuner, part) in found.tuners.iter().zip(vector).filter(|(_, part)| part.abs() >= least) {
        let sign = match (text.is_empty(), *part < 0.0) {
            (true, true) => "-",
            (true, false) => "",
            (false, true) => " - ",
            (false, false) => " + ",
        };
        text += &format!("{sign}{} `{}`", significant(part.abs(), 3), tuner.name);
    }
    text
}
