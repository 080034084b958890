//! Sensitivities of a design and jumps near it, for a report.

use mops_content::numbers::{apart, counted, percent, significant, with_unit};
use mops_content::section::{Block, Part, Section, Tone};
use mops_content::table::{Cell, Table, numbers, text};

use super::{JumpReport, JumpsReport, MovedKind, ON_JUMP, SlopesReport};

/// Returns the sensitivities: a row for every criterion in its case, a column for every tuner.
pub(super) fn sensitivities(found: &SlopesReport, best: &str, one_case: bool) -> Section {
    let steepest = |slopes: &[f64]| slopes.iter().filter(|s| s.is_finite()).fold(0.0_f64, |most, s| most.max(s.abs()));
    let mut columns = vec![text("criterion")];
    columns.extend((!one_case).then(|| text("case")));
    columns.extend(found.tuners.iter().map(numbers));
    let rows = found.criteria.iter().map(|criterion| {
        let (case, name) = criterion.key.split_once('/').unwrap_or(("", &criterion.key));
        let mut row: Vec<Cell> = vec![name.into()];
        row.extend((!one_case).then(|| Cell::from(case)));
        row.extend(criterion.slopes.iter().enumerate().map(|(j, slope)| {
            match criterion.sides.as_ref().and_then(|sides| sides[j]) {
                Some(sides) => both(sides),
                None => shaded(*slope, steepest(&criterion.slopes)),
            }
        }));
        row
    });
    let mut about = format!(
        "First-order change of each scaled value at the {best} when a tuner is increased by 1 % of its range (1 % of its log range for \
         logarithmic tuners). Negative means better. Darker shades mark the tuners with the largest influence on a criterion."
    );
    if found.criteria.iter().any(|criterion| criterion.sides.is_some()) {
        about += " At a kink of a criterion its change is given for an increase (\u{2191}) and for a decrease (\u{2193}) of the tuner; \
                  very large values indicate a jump, such as that of a settling time if the response just touches the band.";
    }
    let table = Table::new("Sensitivities", columns).rows(rows);
    Section::new("Sensitivities", [Block::text(about), Block::Table(table)])
}

fn signed(change: f64) -> String {
    format!("{}{}", if change > 0.0 { "+" } else { "" }, significant(0.01 * change, 3))
}

/// Returns the changes for an increase and for a decrease.
fn both([left, right]: [f64; 2]) -> Cell {
    let parts = [format!("\u{2191} {}", signed(right)), format!("\u{2193} {}", signed(-left))];
    Cell::new(parts.map(Part::Line)).sorted_by(right)
}

fn shaded(slope: f64, steepest: f64) -> Cell {
    let tone = if slope > 0.0 { Tone::Bad } else { Tone::Good };
    let share = if slope.is_finite() && steepest > 0.0 { 0.45 * slope.abs() / steepest } else { 0.0 };
    Cell { shade: Some((tone, share)), value: slope.is_finite().then_some(slope), ..signed(slope).into() }
}

/// Returns the jumps near the design, the nearest first.
pub(super) fn jumps(found: &JumpsReport) -> Section {
    let mut about = format!(
        "Quantities looked at: {} of {}, with {}. Each continuous tuner was moved by 1 % of its range, each constant, inactive tuner and \
         initial value by 1 % of itself (an initial value of 0: of the scale of its state, if it has one), and criteria that then rise \
         by at least 2 % were followed back to where they jump.",
        found.quantities,
        found.quantities + found.left_out.len(),
        counted(found.evaluations, "evaluation")
    );
    if found.found.is_empty() && found.quantities > 0 {
        about += " No jump was found along them.";
    }
    if !found.left_out.is_empty() {
        about += &format!(" Not looked at, for the budget: {}.", found.left_out.join(", "));
    }
    if !found.discrete.is_empty() {
        about += &format!(" Not moved, as their values are discrete: {}.", found.discrete.join(", "));
    }
    let columns = [
        text("quantity"),
        numbers("at the design"),
        numbers("beyond the jump"),
        numbers("distance"),
        text("criterion"),
        numbers("at the design"),
        numbers("beyond the jump"),
        text("demand"),
    ];
    let table = Table::new("Jumps near the design", columns).rows(found.found.iter().map(row));
    let table = (!found.found.is_empty()).then_some(Block::Table(table));
    Section::new("Jumps near the design", std::iter::once(Block::text(about)).chain(table))
}

fn row(jump: &JumpReport) -> Vec<Cell> {
    let unit = if jump.unit == "1" { String::new() } else { format!(" {}", jump.unit) };
    let quantity = |value: f64, other: f64| format!("{}{unit}", apart(value, Some(other), 5));
    let kind = if jump.kind == MovedKind::Initial { " (initial value)" } else { "" };
    vec![
        format!("{}{kind}", jump.name).into(),
        quantity(jump.value, jump.beyond).into(),
        quantity(jump.beyond, jump.value).into(),
        if jump.distance <= ON_JUMP { "none".to_owned() } else { percent(jump.distance) }.into(),
        jump.key.clone().into(),
        with_unit(jump.here, &jump.criterion_unit).into(),
        with_unit(jump.there, &jump.criterion_unit).into(),
        if jump.misses { "missed beyond" } else { "" }.into(),
    ]
}
