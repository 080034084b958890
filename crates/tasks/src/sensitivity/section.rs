//! Effects of uncertain parameters: tables and plots of Morris and Sobol.

use mops_content::{
    figures::{Figure, Group},
    numbers::{labelled, significant},
    plot::{Color, Curve, CurveStyle, Plot},
    section::{Block, Section},
    table::{Cell, Table, numbers, text},
};
use mops_core::task::SensitivityMethod;

use crate::uncertain::{self, EffectReport, EffectsReport, Estimated, GlobalSensitivityReport};

/// Returns the section of a report.
pub(super) fn of(found: &GlobalSensitivityReport) -> Section {
    let is_morris = found.method == SensitivityMethod::Morris;
    let about = if is_morris {
        format!(
            "Elementary effects over {} trajectories, each of which moves every parameter once by two thirds of its range. The \
             magnitude is the mean absolute effect per range; in the mean, effects of opposite sign cancel. A standard deviation as \
             large as the magnitude indicates nonlinearity or interactions.",
            found.samples
        )
    } else {
        format!(
            "Sobol indices: first-order share of the variance, and total share with interactions. Brackets contain {} % bootstrap \
             intervals over {} samples. Estimates may be slightly negative.",
            significant(100.0 * found.level, 3),
            found.samples
        )
    };
    let mut blocks = vec![
        Block::Findings(found.words.clone()),
        Block::Table(uncertain::parameters(&found.parameters)),
        Block::text(about),
    ];
    let known: Vec<&EffectsReport> = found.criteria.iter().filter(|c| !c.effects.is_empty()).collect();
    for criterion in &known {
        blocks.push(Block::Heading(format!("{} in case {}", criterion.of.criterion, criterion.of.case)));
        blocks.push(Block::Table(table(criterion, is_morris)));
    }
    let figure = |criterion: &&EffectsReport| if is_morris { plane(criterion) } else { shares(criterion) };
    blocks.push(Block::Plots(Group { figures: known.iter().map(figure).collect(), ..Group::default() }));
    Section::new("Effects of uncertain parameters", blocks)
}

fn bare(value: Option<f64>) -> Cell {
    value.map_or_else(String::new, |v| significant(v, 4)).into()
}

fn table(criterion: &EffectsReport, is_morris: bool) -> Table {
    let with_interval = |share: Option<Estimated>| {
        share.map_or_else(Cell::default, |Estimated { value, interval: [low, high] }| {
            Cell::with_remark(significant(value, 3), format!("[{}, {}]", significant(low, 3), significant(high, 3)))
        })
    };
    let unit = &criterion.of.unit;
    let mut columns = vec![text("parameter")];
    match is_morris {
        true => columns.extend(["magnitude", "mean", "standard deviation"].map(|name| numbers(labelled(name, unit)))),
        false => columns.extend(["first-order", "total"].map(numbers)),
    }
    let row = |effect: &EffectReport| -> Vec<Cell> {
        let mut row = vec![effect.parameter.clone().into()];
        match is_morris {
            true => row.extend([bare(effect.magnitude), bare(effect.mean), bare(effect.deviation)]),
            false => row.extend([with_interval(effect.first), with_interval(effect.total)]),
        }
        row
    };
    Table::new(&criterion.of.criterion, columns).rows(criterion.effects.iter().map(row))
}

/// Returns tables and sentences for the terminal.
pub(super) fn lines(found: &GlobalSensitivityReport) -> Vec<Block> {
    let is_morris = found.method == SensitivityMethod::Morris;
    let estimate = |share: Option<Estimated>| -> Cell {
        share
            .map_or_else(String::new, |Estimated { value, interval: [low, high] }| {
                format!("{} [{}, {}]", significant(value, 3), significant(low, 3), significant(high, 3))
            })
            .into()
    };
    let rows = found.criteria.iter().flat_map(|c| {
        c.effects.iter().map(move |effect| {
            let mut row: Vec<Cell> =
                vec![c.of.case.clone().into(), c.of.criterion.clone().into(), effect.parameter.clone().into()];
            if is_morris {
                row.extend([bare(effect.magnitude), bare(effect.mean), bare(effect.deviation)]);
                row.push(c.of.unit.clone().into());
            } else {
                row.extend([estimate(effect.first), estimate(effect.total)]);
            }
            row
        })
    });
    let mut columns = vec![text("case"), text("criterion"), text("parameter")];
    match is_morris {
        true => columns.extend([numbers("mean |effect|"), numbers("mean"), numbers("std. dev."), text("unit")]),
        false => columns.extend([text("first-order index"), text("total index")]),
    }
    vec![
        Block::Table(uncertain::lines_of_parameters(&found.parameters)),
        Block::Table(Table::new("Effects of uncertain parameters", columns).rows(rows)),
        Block::Findings(found.words.clone()),
    ]
}

/// Returns the plot of standard deviation over magnitude, with a dot for every parameter.
fn plane(criterion: &EffectsReport) -> Figure {
    let dot = |(i, effect): (usize, &EffectReport)| Curve {
        name: effect.parameter.clone(),
        points: vec![(effect.magnitude.unwrap_or(f64::NAN), effect.deviation.unwrap_or(f64::NAN))],
        style: CurveStyle::Dots,
        color: Color::Series(i),
        ..Curve::default()
    };
    let longest = criterion.effects.iter().filter_map(|e| e.magnitude).fold(0.0, f64::max);
    let equal = Curve {
        name: "deviation = magnitude".into(),
        points: vec![(0.0, 0.0), (longest, longest)],
        style: CurveStyle::Dashed,
        color: Color::Faint,
        ..Curve::default()
    };
    let plot = Plot {
        title: format!("Elementary effects on {}", criterion.of.criterion),
        x_label: labelled("magnitude", &criterion.of.unit),
        y_label: labelled("standard deviation", &criterion.of.unit),
        curves: std::iter::once(equal).chain(criterion.effects.iter().enumerate().map(dot)).collect(),
        ..Plot::default()
    };
    Figure {
        plots: vec![(format!("morris-{}-{}", criterion.of.case, criterion.of.criterion), plot)],
        ..Figure::default()
    }
}

/// Returns the plot of Sobol indices with their intervals, parameters numbered along x.
#[allow(clippy::cast_precision_loss)]
fn shares(criterion: &EffectsReport) -> Figure {
    let of = |name: &str, color: Color, aside: f64, pick: fn(&EffectReport) -> Option<Estimated>| {
        let known: Vec<(f64, Estimated)> = criterion
            .effects
            .iter()
            .enumerate()
            .filter_map(|(i, e)| Some(((i + 1) as f64 + aside, pick(e)?)))
            .collect();
        let bar = |(x, share): &(f64, Estimated)| [share.interval[0], share.interval[1], f64::NAN].map(|end| (*x, end));
        let bars = known.iter().flat_map(bar).collect();
        let dots = known.iter().map(|(x, share)| (*x, share.value)).collect();
        [
            Curve { points: bars, color, ..Curve::default() },
            Curve { name: name.into(), points: dots, style: CurveStyle::Dots, color, ..Curve::default() },
        ]
    };
    let mut curves = Vec::new();
    curves.extend(of("first-order", Color::Result, -0.08, |e| e.first));
    curves.extend(of("total", Color::Measured, 0.08, |e| e.total));
    let names: Vec<String> =
        criterion.effects.iter().enumerate().map(|(i, e)| format!("{} {}", i + 1, e.parameter)).collect();
    let plot = Plot {
        title: format!("Sobol indices of {}", criterion.of.criterion),
        x_label: format!("parameter: {}", names.join(", ")),
        y_label: "share of the variance".into(),
        curves,
        x_range: Some([0.5, criterion.effects.len() as f64 + 0.5]),
        ..Plot::default()
    };
    Figure {
        plots: vec![(format!("sobol-{}-{}", criterion.of.case, criterion.of.criterion), plot)],
        ..Figure::default()
    }
}
