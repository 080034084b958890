//! Table of errors before and after, with bars in units of the noise level.

use mops_content::{
    numbers::{number, significant},
    section::{Block, Part},
    table::{Cell, Table, numbers, text},
};
use mops_outcome::diagnosis::Diagnosis;

use crate::diagnosis::errors::lines;
use crate::diagnosis::words::times;

/// Returns an explanation and the table over all experiments and channels.
pub(super) fn blocks(diagnosis: &Diagnosis) -> [Block; 2] {
    let lines = lines(diagnosis);
    let same = lines.iter().all(|line| line.scaled[0].to_bits() == line.scaled[1].to_bits());
    let largest = lines.iter().flat_map(|line| line.scaled).filter(|v| v.is_finite()).fold(1.5, f64::max);
    let mut columns = vec![text("experiment"), text("channel")];
    match same {
        true => columns.extend([numbers("error / noise"), text(""), numbers("RMS")]),
        false => columns.extend([
            numbers("before"),
            numbers("after"),
            text("error / noise"),
            numbers("RMS before"),
            numbers("RMS after"),
        ]),
    }
    columns.extend([numbers("noise"), text("unit")]);
    let rows = lines.iter().map(|line| {
        let mut row = vec![
            Cell::with_remark(&line.experiment.name, line.experiment.role.name()),
            if line.channel.is_some() { line.label().into() } else { Cell::strong(line.label()) },
        ];
        row.extend((!same).then(|| Cell::from(times(line.scaled[0]))));
        row.extend([Cell::strong(times(line.scaled[1])), Cell::new([bars(line.scaled, largest, same)])]);
        if line.channel.is_none() {
            row.push(Cell::default().over(if same { 3 } else { 4 }));
            return row;
        }
        row.extend((!same).then(|| Cell::from(significant(line.raw[0], 3))));
        row.extend([
            significant(line.raw[1], 3).into(),
            if line.noise.is_finite() { number(line.noise) } else { "not known".to_owned() }.into(),
            line.unit.into(),
        ]);
        row
    });
    let table = Table::new("Errors before and after", columns).rows(rows);
    let mut about = vec![Part::text("Root mean square of measured - predicted, in units of the noise level")];
    if !same {
        about.extend([
            Part::text(": "),
            Part::Swatch(false),
            Part::text(" nominal model, "),
            Part::Swatch(true),
            Part::text(" recalibrated model"),
        ]);
    }
    about.push(Part::text(". The line at 1 is the noise level, the best achievable."));
    [Block::Paragraph(about), Block::Table(table)]
}

/// Returns the bars of the errors before and after, one bar if they are equal, and a mark at the noise level.
fn bars(scaled: [f64; 2], largest: f64, same: bool) -> Part {
    let [before, after] = scaled.map(|value| if value.is_finite() { (value / largest).min(1.0) } else { 0.0 });
    Part::Errors { before: (!same).then_some(before), after, noise: 1.0 / largest }
}
