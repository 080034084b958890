//! Estimates, fit of every channel and uncertainty of a calibration, for a report and the terminal.

use mops_content::{
    figures::{Figure, Group},
    numbers::{labelled, number, percent, precise, significant},
    plot::{Color, Curve, CurveStyle, Plot},
    section::{Block, Section, Tone},
    table::{Cell, Table, numbers, text},
};
use mops_outcome::{CalibrationReport, Outcome, ParameterReport, identification::excitation_words};

use super::{BandReport, BootstrapReport, ProfileReport, UncertaintyReport};
use crate::{excitation, identifiability};

/// Returns the sections on a study with experiments, for a report of any task.
pub fn sections(outcome: &Outcome) -> Vec<Section> {
    let Some(results) = &outcome.calibration else { return Vec::new() };
    let mut sections = vec![estimates(results)];
    sections.extend(outcome.found.get::<UncertaintyReport>().map(uncertainty));
    if results.sensitivity.is_some() || !results.excitation.is_empty() {
        sections.push(identified(results));
    }
    sections
}

/// Returns what the terminal shows of a study with experiments.
pub fn lines(outcome: &Outcome) -> Vec<Block> {
    let Some(results) = &outcome.calibration else { return Vec::new() };
    let mut blocks = Vec::new();
    if let Some(found) = &results.sensitivity {
        blocks.push(Block::Heading(identifiability::IDENTIFIABILITY.to_lowercase()));
        blocks.push(Block::Findings(found.words.clone()));
    }
    if !results.excitation.is_empty() {
        blocks.extend(excitation::lines_of_inputs(&results.excitation, excitation_words(&results.excitation)));
    }
    blocks
}

/// Returns the identifiability of the tuners of a calibration, and the excitation of its inputs.
fn identified(results: &CalibrationReport) -> Section {
    let mut blocks = results.sensitivity.as_ref().map_or_else(Vec::new, identifiability::blocks);
    blocks.push(Block::Heading("Inputs".to_owned()));
    if results.excitation.is_empty() {
        blocks.push(Block::text("No experiment is driven by an input: all information comes from the initial states."));
    } else {
        blocks.push(Block::Findings(excitation_words(&results.excitation)));
        blocks.extend(excitation::of_inputs(&results.excitation));
        blocks.push(Block::Plots(excitation::plots(&results.excitation)));
    }
    Section::new(identifiability::IDENTIFIABILITY, blocks)
}

fn estimates(results: &CalibrationReport) -> Section {
    let mut blocks = Vec::new();
    if !results.parameters.is_empty() {
        blocks.extend([
            Block::Heading("Parameters".to_owned()),
            Block::text(
                "Standard errors are first-order sandwich estimates, valid for any weights and numbers of samples. Intervals use \
                 Student's t distribution. If residuals are correlated or the model is wrong, their coverage is below 95 %.",
            ),
            Block::Table(parameters(results)),
        ]);
    }
    if !results.experiments.is_empty() {
        blocks.extend([
            Block::Heading("Experiments".to_owned()),
            Block::text(
                "RMSE is the root mean square of measured - simulated. RMSE / noise = 1 is the noise level, the best achievable. A \
                 fit of 100 % is exact, a fit of 0 % is no better than the mean.",
            ),
            Block::Table(experiments(results)),
        ]);
    }
    Section::new("Calibration", blocks)
}

fn parameters(results: &CalibrationReport) -> Table {
    let sensitivities = results.sensitivity.iter().flat_map(|found| &found.tuners);
    let relative = |parameter: &ParameterReport| match sensitivities.clone().find(|t| t.name == parameter.name) {
        Some(tuner) => identifiability::relative(tuner),
        None => percent((parameter.std_error / parameter.value).abs()).into(),
    };
    let columns = [
        text("parameter"),
        numbers("estimate"),
        numbers("standard error"),
        numbers("relative error"),
        numbers("95 % from"),
        numbers("to"),
        text("unit"),
    ];
    let rows = results.parameters.iter().map(|parameter| {
        let mut row: Vec<Cell> = vec![parameter.name.clone().into(), Cell::strong(number(parameter.value))];
        if parameter.std_error.is_finite() {
            row.extend([
                significant(parameter.std_error, 3).into(),
                relative(parameter),
                number(parameter.interval95[0]).into(),
                number(parameter.interval95[1]).into(),
            ]);
        } else {
            row.push(Cell::toned(Tone::Bad, "not identifiable from the data").over(4));
        }
        row.push(parameter.unit.clone().into());
        row
    });
    Table::new("Parameters", columns).rows(rows)
}

fn experiments(results: &CalibrationReport) -> Table {
    let columns = [
        text("experiment"),
        text("role"),
        text("channel"),
        numbers("RMSE"),
        numbers("noise"),
        text("unit"),
        numbers("RMSE / noise"),
        numbers("fit"),
    ];
    let channels = results.experiments.iter().flat_map(|e| e.channels.iter().map(move |c| (e, c)));
    let rows = channels.map(|(experiment, channel)| -> Vec<Cell> {
        let fit = channel.fit_percent;
        vec![
            experiment.name.clone().into(),
            experiment.role.name().into(),
            channel.name.clone().into(),
            number(channel.rmse).into(),
            channel.noise.map_or_else(|| "not known".to_owned(), number).into(),
            channel.unit.clone().into(),
            channel.noise.map_or_else(String::new, |noise| significant(channel.rmse / noise, 3)).into(),
            if fit.is_finite() { format!("{fit:.1} %") } else { "n/a".to_owned() }.into(),
        ]
    });
    Table::new("Experiments", columns).rows(rows)
}

fn uncertainty(found: &UncertaintyReport) -> Section {
    let mut blocks = vec![Block::Findings(found.words.clone())];
    if !found.profiles.is_empty() {
        blocks.extend([
            Block::Heading("Likelihood profiles".to_owned()),
            Block::text(
                "One parameter is fixed at a time, and all others are re-estimated. The signed root of the likelihood ratio is a \
                 straight line if the model is linear; if it is curved, the first-order interval is inaccurate. The interval ends where \
                 the root reaches the t quantile. A parameter that is not identifiable has no first-order interval.",
            ),
            Block::Table(profiles(&found.profiles)),
        ]);
    }
    if let Some(bootstrap) = &found.bootstrap {
        blocks.extend([
            Block::Heading("Bootstrap".to_owned()),
            Block::text(format!(
                "Residuals, scaled to the noise level of the standard errors, are resampled in blocks of {} samples, and all estimates \
                 are repeated. This is valid if the correlation time of the residuals is shorter than a block. Intervals are \
                 percentiles of the replicates.",
                lengths(bootstrap)
            )),
            Block::Table(replicates(bootstrap)),
        ]);
    }
    if !found.bands.is_empty() {
        blocks.push(Block::text(
            "The plots of the responses show pointwise first-order bands: for the response, from the uncertainty of the parameters, and \
             for a new measurement, with noise.",
        ));
    }
    blocks.push(Block::Plots(group(found)));
    Section::new("Uncertainty of the estimates", blocks)
}

fn lengths(found: &BootstrapReport) -> String {
    let mut lengths = found.blocks.clone();
    lengths.sort_unstable();
    lengths.dedup();
    lengths.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
}

fn profiles(list: &[ProfileReport]) -> Table {
    let columns = [
        text("parameter"),
        numbers("estimate"),
        numbers("from"),
        numbers("to"),
        numbers("first-order from"),
        numbers("to"),
        text("unit"),
    ];
    let end = |value: f64, why: &str| {
        let shown = if value.is_finite() { number(value) } else { "open".to_owned() };
        if why == "bound" { Cell::with_remark(shown, "bound of the tuner") } else { shown.into() }
    };
    let known = |value: f64| if value.is_finite() { number(value) } else { String::new() };
    let rows = list.iter().map(|one| -> Vec<Cell> {
        let [from, to] = one.linear_interval.map(known);
        vec![
            one.parameter.clone().into(),
            number(one.value).into(),
            end(one.interval[0], one.ends[0]),
            end(one.interval[1], one.ends[1]),
            from.into(),
            to.into(),
            one.unit.clone().into(),
        ]
    });
    Table::new("Profiles", columns).rows(rows)
}

fn replicates(found: &BootstrapReport) -> Table {
    let columns = [
        text("parameter"),
        numbers("estimate"),
        numbers("standard error"),
        numbers("bias"),
        numbers("from"),
        numbers("to"),
        text("unit"),
    ];
    let rows = found.parameters.iter().map(|one| -> Vec<Cell> {
        vec![
            one.parameter.clone().into(),
            number(one.value).into(),
            significant(one.std_error, 3).into(),
            significant(one.bias, 2).into(),
            number(one.interval[0]).into(),
            number(one.interval[1]).into(),
            one.unit.clone().into(),
        ]
    });
    Table::new("Bootstrap", columns).rows(rows)
}

/// Returns the tables and sentences on the uncertainty for the terminal.
pub(super) fn lines_of_uncertainty(found: &UncertaintyReport) -> Vec<Block> {
    let mut blocks = Vec::new();
    if !found.profiles.is_empty() {
        let columns = [
            text("profile"),
            numbers("estimate"),
            numbers("from"),
            numbers("to"),
            numbers("linear from"),
            numbers("to"),
            text("unit"),
        ];
        let rows = found.profiles.iter().map(|p| -> Vec<Cell> {
            let [low, high] = [0, 1].map(|i| match p.ends[i] {
                "open" => "not found".to_owned(),
                "bound" => format!("{} (bound)", precise(p.interval[i])),
                _ => precise(p.interval[i]),
            });
            let [from, to] = p.linear_interval.map(precise);
            [p.parameter.clone(), precise(p.value), low, high, from, to, p.unit.clone()].map(Cell::from).into()
        });
        blocks.push(Block::Table(Table::new("Profiles", columns).rows(rows)));
    }
    if let Some(bootstrap) = &found.bootstrap {
        let columns = [
            text("bootstrap"),
            numbers("estimate"),
            numbers("std. error"),
            numbers("bias"),
            numbers("from"),
            numbers("to"),
            text("unit"),
        ];
        let rows = bootstrap.parameters.iter().map(|p| -> Vec<Cell> {
            let [low, high] = p.interval.map(precise);
            let [error, bias] = [significant(p.std_error, 3), significant(p.bias, 2)];
            [p.parameter.clone(), precise(p.value), error, bias, low, high, p.unit.clone()].map(Cell::from).into()
        });
        blocks.push(Block::Table(Table::new("Bootstrap", columns).rows(rows)));
    }
    blocks.push(Block::Findings(found.words.clone()));
    blocks
}

/// Returns the plots of profiles and of bootstrap distributions.
fn group(found: &UncertaintyReport) -> Group {
    let figures = found.profiles.iter().map(profile);
    let replicates = found.bootstrap.iter().flat_map(|b| &b.parameters).map(|one| {
        let mut sorted = one.draws.clone();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len() as f64;
        let steps =
            sorted.iter().enumerate().flat_map(|(i, &v)| [(v, i as f64 / n), (v, (i + 1) as f64 / n)]).collect();
        let vertical = |name: &str, x: f64, color, style| Curve {
            name: name.into(),
            points: vec![(x, 0.0), (x, 1.0)],
            color,
            style,
            ..Curve::default()
        };
        let mut curves =
            vec![Curve { name: "empirical distribution function".into(), points: steps, ..Curve::default() }];
        curves.push(vertical("estimate", one.value, Color::Start, CurveStyle::Dashed));
        curves.push(vertical("interval", one.interval[0], Color::Demand, CurveStyle::Line));
        curves.push(vertical("", one.interval[1], Color::Demand, CurveStyle::Line));
        let plot = Plot {
            title: format!("Bootstrap of {}", one.parameter),
            x_label: labelled(&one.parameter, &one.unit),
            y_label: "share of replicates".into(),
            curves,
            ..Plot::default()
        };
        Figure { plots: vec![(format!("bootstrap-{}", one.parameter), plot)], ..Figure::default() }
    });
    Group { figures: figures.chain(replicates).collect(), ..Group::default() }
}

fn profile(one: &ProfileReport) -> Figure {
    let line = |name: &str, points: Vec<(f64, f64)>, color, style| Curve {
        name: name.into(),
        points,
        color,
        style,
        ..Curve::default()
    };
    let half = (one.linear_interval[1] - one.value) / one.limit;
    let ends = [one.points.first(), one.points.last()].map(|p| p.map_or(one.value, |p| p.0));
    let first_order = ends.map(|x| (x, (x - one.value) / half)).to_vec();
    let first_order = line("first order", first_order, Color::Start, CurveStyle::Dashed);
    let ends = |y: f64| ends.map(|x| (x, y)).to_vec();
    let mut curves: Vec<Curve> = half.is_finite().then_some(first_order).into_iter().collect();
    curves.extend([
        line("signed root of the likelihood ratio", one.points.clone(), Color::Result, CurveStyle::Line),
        line("", one.points.clone(), Color::Result, CurveStyle::Dots),
        line("t quantile", ends(one.limit), Color::Demand, CurveStyle::Line),
        line("", ends(-one.limit), Color::Demand, CurveStyle::Line),
    ]);
    let plot = Plot {
        title: format!("Profile of {}", one.parameter),
        x_label: labelled(&one.parameter, &one.unit),
        y_label: "signed root of the likelihood ratio".into(),
        curves,
        ..Plot::default()
    };
    Figure { plots: vec![(format!("profile-{}", one.parameter), plot)], ..Figure::default() }
}

/// Centre of a band.
#[derive(Clone, Copy)]
pub enum Around {
    /// Prediction.
    Prediction,
    /// Zero, for residuals.
    Zero,
}

/// Returns the curves of the bands of a channel, for its plot.
pub fn bands(found: &UncertaintyReport, experiment: &str, channel: &str, around: Around) -> Vec<Curve> {
    let Some(band) = found.bands.iter().find(|b| b.experiment == experiment && b.channel == channel) else {
        return Vec::new();
    };
    let percent = significant(100.0 * found.level, 4);
    let curve = |name: String, half: &[f64], sign: f64, color: Color| Curve {
        name,
        points: points(band, half, sign, around),
        color,
        style: CurveStyle::Dashed,
        may_leave: true,
        ..Curve::default()
    };
    let (response, measurement) = (Color::Series(2), Color::Series(3));
    vec![
        curve(format!("{percent} % band of the response"), &band.response, 1.0, response),
        curve(String::new(), &band.response, -1.0, response),
        curve(format!("{percent} % band of measurements"), &band.measurement, 1.0, measurement),
        curve(String::new(), &band.measurement, -1.0, measurement),
    ]
}

fn points(band: &BandReport, half: &[f64], sign: f64, around: Around) -> Vec<(f64, f64)> {
    let middle = |value: f64| match around {
        Around::Prediction => value,
        Around::Zero => 0.0,
    };
    band.times.iter().zip(&band.value).zip(half).map(|((&t, &value), half)| (t, middle(value) + sign * half)).collect()
}
