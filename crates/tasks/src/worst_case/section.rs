//! Worst cases: a table, their responses, and every criterion along every parameter.

use std::sync::Arc;

use mops_content::{
    figures::{Figure, Group},
    marks::bounds,
    numbers::{known, labelled, number, precise, significant},
    plot::{Color, Curve, CurveStyle, Level, Plot},
    sampling,
    section::{Block, Section, Tone},
    table::{Cell, Table, numbers, text},
};
use mops_core::Problem;

use crate::room::Solution;
use crate::uncertain::{CoordinateReport, UncertainReport, WorstCaseReport, WorstReport, parameters};

/// Returns the section of a report.
pub(super) fn of(of: &Solution<'_>, found: &WorstCaseReport) -> Section {
    let mut group = Group::default();
    group.figures.extend(responses(of, found));
    group.figures.extend(found.criteria.iter().flat_map(slices));
    let blocks = [
        Block::Findings(found.words.clone()),
        Block::Table(parameters(&found.parameters)),
        Block::Table(table(&found.criteria, &found.parameters)),
        Block::Plots(group),
    ];
    Section::new("Worst cases", blocks)
}

/// Returns the table of the worst case of every criterion.
pub(crate) fn table(list: &[WorstReport], names: &[UncertainReport]) -> Table {
    let failed = list.iter().any(|worst| worst.failed > 0);
    let mut columns = vec![
        text("criterion"),
        text("case"),
        numbers("demand"),
        numbers("nominal"),
        numbers("worst"),
        text("unit"),
        numbers("scaled"),
        text("met"),
    ];
    columns.extend(names.iter().map(|name| numbers(format!("at {}", labelled(&name.name, &name.unit)))));
    columns.push(numbers("searches ending here"));
    columns.extend(failed.then(|| numbers("failed")));
    let coordinate = |at: Option<&CoordinateReport>| match at {
        None => Cell::default(),
        Some(at) => match at.at_bound {
            Some(side) => Cell::with_remark(number(at.value), format!("{side} end")),
            None => number(at.value).into(),
        },
    };
    let rows = list.iter().map(|worst| {
        let of = &worst.of;
        let met = match (of.demand, worst.met) {
            (None, _) => Cell::default(),
            (_, true) => Cell::toned(Tone::Good, "yes"),
            (_, false) => Cell::toned(Tone::Bad, "no"),
        };
        let mut row: Vec<Cell> = vec![
            of.criterion.clone().into(),
            of.case.clone().into(),
            of.shown_demand().into(),
            number(of.nominal).into(),
            Cell::strong(number(worst.value)),
            of.unit.clone().into(),
            if worst.scaled.is_finite() { significant(worst.scaled, 4) } else { String::new() }.into(),
            met,
        ];
        row.extend((0..names.len()).map(|i| coordinate(worst.at.get(i))));
        row.push(format!("{} of {}", worst.ended_here, worst.starts).into());
        row.extend(failed.then(|| match worst.failed {
            0 => "0".into(),
            failed => Cell::toned(Tone::Bad, failed.to_string()),
        }));
        row
    });
    Table::new("Worst cases", columns).rows(rows)
}

/// Returns the table of the worst case of every criterion for the terminal.
pub(crate) fn lines(list: &[WorstReport], names: &[UncertainReport]) -> Table {
    let failed = if list.iter().any(|worst| worst.failed > 0) { "failed" } else { "" };
    let mut columns = vec![
        text("case"),
        text("criterion"),
        numbers("nominal"),
        numbers("worst"),
        text("unit"),
        numbers("scaled"),
        text("met"),
    ];
    columns.extend(names.iter().map(|p| {
        numbers(if p.unit == "1" { format!("at {}", p.name) } else { format!("at {} [{}]", p.name, p.unit) })
    }));
    columns.extend([text("searches"), text(failed)]);
    let rows = list.iter().map(|worst| {
        let of = &worst.of;
        let met = match (of.demand, worst.met) {
            (None, _) => "",
            (_, true) => "yes",
            (_, false) => "no",
        };
        let mut row: Vec<Cell> = vec![
            of.case.clone().into(),
            of.criterion.clone().into(),
            known(of.nominal).into(),
            known(worst.value).into(),
            of.unit.clone().into(),
            known(worst.scaled).into(),
            met.into(),
        ];
        let at = |i: usize| worst.at.get(i).map_or_else(String::new, |at| precise(at.value));
        row.extend((0..names.len()).map(|i| Cell::from(at(i))));
        row.push(format!("{} of {}", worst.ended_here, worst.starts).into());
        row.push(if worst.failed > 0 { worst.failed.to_string() } else { String::new() }.into());
        row
    });
    Table::new("Worst cases", columns).rows(rows)
}

/// Returns plots of the signals that a criterion reads, for nominal parameters and in the worst case.
fn responses(solution: &Solution<'_>, found: &WorstCaseReport) -> Vec<Figure> {
    let study = solution.problem.study().over_uncertain(&solution.best.tuners);
    let first = study.tuners().len() - study.uncertain().len();
    let problem = Problem::new(Arc::new(study.clone()));
    let mut figures = Vec::new();
    for worst in found.criteria.iter().filter(|worst| !worst.at.is_empty()) {
        let of = &worst.of;
        let here = |row: &&mops_core::study::Row| row.name == of.criterion && study.case_of(row).name == of.case;
        let Some(row) = study.rows().iter().find(here) else { continue };
        let mut tuners = study.start();
        let analyses = [
            ("nominal", CurveStyle::Dashed, Color::Start, false),
            ("worst case", CurveStyle::Line, Color::Result, true),
        ]
        .map(|(name, style, color, moved)| {
            if moved {
                tuners[first..].iter_mut().zip(&worst.at).for_each(|(value, at)| *value = at.value);
            }
            (name, style, color, problem.analyse_all(row.job, &tuners, None).ok())
        });
        let signals = &study.models()[study.jobs()[row.job].model].1.interface().signals;
        for signal in row.criterion.signals() {
            let curve = |(name, style, color, analysis): &(&str, CurveStyle, Color, Option<mops_core::Analysis>)| {
                let trace = analysis.as_ref()?.response()?.trace(&signal)?;
                Some(Curve {
                    name: (*name).into(),
                    points: sampling::points(trace),
                    style: *style,
                    color: *color,
                    ..Curve::default()
                })
            };
            let curves: Vec<Curve> = analyses.iter().filter_map(curve).collect();
            let Some(variable) = signals.iter().find(|s| s.name == signal).filter(|_| !curves.is_empty()) else {
                continue;
            };
            let plot = Plot {
                title: format!("{signal} in the worst case of {}", of.criterion),
                x_label: "time (s)".into(),
                y_label: labelled(&signal, &variable.unit.to_string()),
                curves,
                bounds: analyses[1].3.iter().flat_map(|analysis| bounds(&signal, &[row], analysis)).collect(),
                ..Plot::default()
            };
            let name = format!("worst-{}-{}-{signal}", of.case, of.criterion);
            figures.push(Figure { plots: vec![(name, plot)], ..Figure::default() });
        }
    }
    figures
}

/// Returns plots of a criterion along every parameter through its worst case, which is marked.
fn slices(worst: &WorstReport) -> Vec<Figure> {
    let of = &worst.of;
    let one = |(slice, at): (&crate::uncertain::Slice, &CoordinateReport)| {
        let points = slice.x.iter().copied().zip(slice.y.iter().copied()).collect();
        let mark = Curve {
            name: "worst case".into(),
            points: vec![(at.value, worst.value)],
            style: CurveStyle::Dots,
            color: Color::Demand,
            ..Curve::default()
        };
        let plot = Plot {
            title: format!("{} along {} through its worst case", of.criterion, slice.parameter),
            x_label: labelled(&slice.parameter, &slice.unit),
            y_label: labelled(&of.criterion, &of.unit),
            curves: vec![Curve { name: of.criterion.clone(), points, ..Curve::default() }, mark],
            levels: of.demand.iter().map(|&value| Level { name: "demand".into(), value }).collect(),
            ..Plot::default()
        };
        Figure {
            plots: vec![(format!("slice-{}-{}-{}", of.case, of.criterion, slice.parameter), plot)],
            ..Figure::default()
        }
    };
    worst.slices.iter().zip(&worst.at).map(one).collect()
}
