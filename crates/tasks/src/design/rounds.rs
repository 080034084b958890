//! Design against worst cases: rounds, bounds, added cases.

use mops_content::{
    figures::{Figure, Group},
    numbers::{known, number, precise, significant},
    plot::{Color, Curve, CurveStyle, Plot},
    section::{Block, Part, Section, Tone, Verdict},
    table::{Cell, Table, numbers, text},
};

use crate::uncertain::{AddedReport, RobustReport, lines_of_parameters, parameters};
use crate::worst_case;

/// Returns the verdict; `None` without a round.
pub(super) fn verdict(found: &RobustReport) -> Option<Verdict> {
    let round = found.rounds.get(found.chosen)?;
    let is_violated = round.violation_found > found.tolerance;
    let tone = match (is_violated, found.settled && found.criteria.iter().all(|worst| worst.met)) {
        (true, _) => Tone::Bad,
        (false, true) => Tone::Good,
        (false, false) => Tone::Mixed,
    };
    Some(Verdict::new(tone, found.words.iter().take(2).cloned().collect::<Vec<_>>().join(" ")))
}

/// Returns the section of a report.
pub(super) fn of(found: &RobustReport) -> Section {
    let about = "Each round solves the design for the present cases, then searches the box for worse ones. The worst scaled value over \
                 the present cases is a lower bound on the worst case of any design, if the solution is optimal. It increases as cases \
                 are added. The worst value found in the box is that of the design of the round.";
    let blocks = [
        Block::Findings(found.words.clone()),
        Block::Table(parameters(&found.parameters)),
        Block::Heading("Rounds".to_owned()),
        Block::text(about),
        Block::Table(rounds(found)),
        Block::Heading("Worst cases of the design".to_owned()),
        Block::Table(worst_case::table(&found.criteria, &found.parameters)),
        Block::Plots(Group { figures: vec![bounds(found)], ..Group::default() }),
    ];
    Section::new("Design against worst cases", blocks)
}

fn rounds(found: &RobustReport) -> Table {
    let columns = [
        numbers("round"),
        numbers("cases"),
        numbers("worst over the cases"),
        numbers("worst found in the box"),
        numbers("violation in the box"),
        numbers("evaluations"),
        text("added"),
    ];
    let added = |added: &AddedReport| {
        let how = match added.scaled {
            Some(scaled) => format!("scaled {}", significant(scaled, 4)),
            None => "beyond the edge of a jump".to_owned(),
        };
        let at: Vec<String> = added.at.iter().map(|c| format!("{} = {}", c.name, number(c.value))).collect();
        Part::Line(format!("{}, {how}: {}", added.name, at.join(", ")))
    };
    let rows = found.rounds.iter().enumerate().map(|(i, round)| -> Vec<Cell> {
        let name = (i + 1).to_string();
        vec![
            if i == found.chosen { Cell::with_remark(name, "reported") } else { name.into() },
            round.cases.to_string().into(),
            number(round.for_cases).into(),
            number(round.found).into(),
            significant(round.violation_found.max(0.0), 3).into(),
            round.evaluations.to_string().into(),
            Cell::new(round.added.iter().map(added)),
        ]
    });
    Table::new("Rounds", columns).rows(rows)
}

/// Returns tables and sentences for the terminal.
pub(super) fn lines(found: &RobustReport) -> Vec<Block> {
    let columns = [
        text("round"),
        numbers("cases"),
        numbers("worst of cases"),
        numbers("worst found"),
        numbers("violation found"),
        numbers("evaluations"),
        text("added"),
    ];
    let rows = found.rounds.iter().enumerate().map(|(i, round)| -> Vec<Cell> {
        let added: Vec<&str> = round.added.iter().map(|added| added.name.as_str()).collect();
        vec![
            format!("{}{}", i + 1, if i == found.chosen { " *" } else { "" }).into(),
            round.cases.to_string().into(),
            known(round.for_cases).into(),
            known(round.found).into(),
            if round.violation_found > 0.0 { precise(round.violation_found) } else { String::new() }.into(),
            round.evaluations.to_string().into(),
            added.join(", ").into(),
        ]
    });
    vec![
        Block::Table(lines_of_parameters(&found.parameters)),
        Block::Table(Table::new("Rounds", columns).rows(rows)),
        Block::Table(worst_case::lines(&found.criteria, &found.parameters)),
        Block::Findings(found.words.clone()),
    ]
}

#[allow(clippy::cast_precision_loss)]
fn bounds(found: &RobustReport) -> Figure {
    let curve =
        |name: &str, color: Color, style: CurveStyle, of: &dyn Fn(&crate::uncertain::RoundReport) -> f64| Curve {
            name: name.into(),
            points: found.rounds.iter().enumerate().map(|(i, round)| ((i + 1) as f64, of(round))).collect(),
            color,
            style,
            ..Curve::default()
        };
    let mut curves = vec![
        curve("worst found in the box", Color::Measured, CurveStyle::Line, &|round| round.found),
        curve("", Color::Measured, CurveStyle::Dots, &|round| round.found),
        curve("worst over the present cases", Color::Result, CurveStyle::Line, &|round| round.for_cases),
        curve("", Color::Result, CurveStyle::Dots, &|round| round.for_cases),
    ];
    if found.rounds.iter().any(|round| round.violation_found > 0.0) {
        curves.push(curve("violation found in the box", Color::Demand, CurveStyle::Dashed, &|round| {
            round.violation_found.max(0.0)
        }));
    }
    let plot = Plot {
        title: "Worst scaled value by round".into(),
        x_label: "round".into(),
        y_label: "worst scaled value".into(),
        curves,
        ..Plot::default()
    };
    Figure { plots: vec![("rounds".into(), plot)], ..Figure::default() }
}
