//! Plots of a linear model: Bode plots in all cases, with margins and the Nyquist curve of a loop transfer function,
//! and the movement of the poles with each tuner.

use mops_content::{
    figures::Figure,
    numbers::significant,
    plot::{Color, Curve, CurveStyle, Level, Plot},
};
use mops_core::{Analysis, Failure, Variable, case::ResponseData};
use mops_linear::{Complex, Crossing, Loop, StateSpace, zeros};
use mops_math as math;
use mops_math::complex;

use super::super::bode::{FrequencyCurve, bode, unwrapped};
use super::super::nyquist::nyquist;
use super::cases::Cases;
use super::simulated::Simulated;

/// Largest number of tuners with a plot of the poles.
const MOST_TUNERS: usize = 6;
/// Number of values of a tuner in a plot of the poles.
const VALUES: u32 = 120;

/// Number of values without poles after which the sweeps of a model end: a search for an equilibrium that does not
/// exist takes long.
const MOST_FAILURES: u32 = 3;
/// Gain, relative to the largest one, below which a corner frequency is not shown: -60 dB.
const SMALL: f64 = 1e-3;

/// Returns the figures of a model: Bode plots from every input to the outputs, then the poles.
pub(super) fn figures(cases: &Cases<'_>, outputs: &[&Variable]) -> Vec<Figure> {
    let mut figures = Vec::new();
    let Some(system) = cases.ones.iter().find_map(|one| of(&one.both.best).or(of(&one.both.start))) else {
        return figures;
    };
    let place = cases.place();
    for output in outputs {
        let Some(row) = system.outputs.iter().position(|name| *name == output.name) else { continue };
        for (column, input) in system.inputs.iter().enumerate() {
            let is_cut = is_cut(cases);
            if is_cut && column != row {
                continue;
            }
            let others = if is_cut && system.inputs.len() > 1 { ", other loops closed" } else { "" };
            let name = format!("{}/{input}{others}", output.name);
            let [magnitude, phase] = frequency_responses(cases, (column, row), &cases.title(&name));
            let mut plots = vec![
                (format!("{place}magnitude-{}-{input}", output.name), magnitude),
                (format!("{place}phase-{}-{input}", output.name), phase),
            ];
            if let Some(plot) = nyquist_curve(cases, (column, row), &cases.title(&name)) {
                plots.push((format!("{place}nyquist-{}-{input}", output.name), plot));
            }
            figures.push(Figure { plots, caption: cases.caption(&output.name), ..Figure::default() });
        }
    }
    let tuners = cases.report.solution.problem.study().tuners().len();
    let mut failures = 0;
    let moving = (0..tuners).filter_map(|tuner| poles(cases, tuner, &mut failures)).take(MOST_TUNERS);
    figures.extend(
        moving.map(|(name, plot)| Figure { plots: vec![(format!("{place}poles-{name}"), plot)], ..Figure::default() }),
    );
    figures
}

fn of(analysis: &Result<Analysis, Failure>) -> Option<&StateSpace> {
    analysis.as_ref().ok()?.linear()
}

/// Returns true if the system is the loop transfer function of cut loops.
fn is_cut(cases: &Cases<'_>) -> bool {
    let study = cases.report.solution.problem.study();
    study.models()[study.jobs()[cases.ones[0].job].model].1.interface().is_cut
}

/// Returns the system from an input to an output. Of several cut loops, the others are closed.
fn channel(cases: &Cases<'_>, system: &StateSpace, (input, output): (usize, usize)) -> Option<StateSpace> {
    if is_cut(cases) { system.loop_at_a_time(input).ok() } else { Some(system.channel(input, output)) }
}

/// Returns true if the model is a cut loop, or a criterion of the case reads the channel as loop transfer function.
fn is_loop(cases: &Cases<'_>, one: &Simulated, channel: &StateSpace) -> bool {
    if is_cut(cases) {
        return true;
    }
    let rows = cases.report.solution.problem.study().rows();
    let ends = [channel.inputs[0].clone(), channel.outputs[0].clone()];
    let mut of_case = rows.iter().filter(|row| row.job == one.job);
    of_case.any(|row| row.criterion.feedback_channel().as_ref() == Some(&ends))
}

/// Returns the loop of a channel if a criterion closes it.
fn closed(cases: &Cases<'_>, one: &Simulated, channel: &StateSpace) -> Option<Loop> {
    is_loop(cases, one, channel).then(|| Loop::new(channel.clone()).ok())?
}

/// Returns the Bode plots of a channel in all cases, with the margins if there is one case.
fn frequency_responses(cases: &Cases<'_>, (input, output): (usize, usize), name: &str) -> [Plot; 2] {
    let mut responses = Vec::new();
    let mut window: Option<[f64; 2]> = None;
    let mut margins = [Vec::new(), Vec::new()];
    for at_start in [true, false] {
        for (index, one) in cases.ones.iter().enumerate() {
            let analysis = if at_start { &one.both.start } else { &one.both.best };
            let Some(channel) = of(analysis).and_then(|system| channel(cases, system, (input, output))) else {
                continue;
            };
            let Ok(response) = FrequencyCurve::of(&channel) else { continue };
            let closed = closed(cases, one, &channel);
            if !at_start || of(&one.both.best).is_none() {
                let [low, high] = decades(&channel, &response, closed.as_ref());
                let [a, b] = window.unwrap_or([low, high]);
                window = Some([a.min(low), b.max(high)]);
            }
            if !at_start && cases.ones.len() == 1 {
                margins = closed.as_ref().map_or_else(Default::default, marks);
            }
            responses.push((cases.curve(index, Vec::new(), at_start), response));
        }
    }
    let drawn: Vec<(Curve, &FrequencyCurve)> =
        responses.iter().map(|(curve, response)| (curve.clone(), response)).collect();
    let [mut magnitude, mut phase] = bode(name, &drawn);
    for one in cases.ones {
        let measured = cases.case(one).experiment.iter().flat_map(|experiment| &experiment.responses);
        let output = of(&one.both.best).map(|system| &system.outputs[output]);
        for data in measured.filter(|data| Some(&data.signal) == output) {
            let [of_magnitude, of_phase] = measurement(data, phase.curves.last());
            magnitude.curves.push(of_magnitude);
            phase.curves.push(of_phase);
        }
    }
    let [on_magnitude, on_phase] = margins;
    if !on_magnitude.is_empty() || !on_phase.is_empty() {
        // The critical levels: 0 dB, and -180 deg or its equivalent nearest to the crossing.
        let crossing = on_phase.first().or(on_magnitude.first()).map_or(f64::NAN, |level: &Level| level.value);
        let points = phase.curves.last().map_or(&[][..], |curve| &curve.points);
        let there = points.iter().find(|p| p.0 >= crossing).map_or(-180.0, |p| p.1);
        let critical = 360.0 * ((there + 180.0) / 360.0).round() - 180.0;
        let ends = window.unwrap_or([1.0, 10.0]);
        let level = |y: f64| Curve {
            points: ends.map(|x| (x, y)).to_vec(),
            color: Color::Faint,
            style: CurveStyle::Dashed,
            ..Curve::default()
        };
        magnitude.curves.insert(0, level(0.0));
        phase.curves.insert(0, level(critical));
    }
    (magnitude.window, phase.window) = (window, window);
    (magnitude.verticals, phase.verticals) = (on_magnitude, on_phase);
    [magnitude, phase]
}

/// Returns the marks of the margins of a stable loop: on the magnitude at the phase crossover, on the phase at the gain
/// crossover.
fn marks(of: &Loop) -> [Vec<Level>; 2] {
    let Ok([of_phase, of_gain]) = of.critical() else { return Default::default() };
    if !of.is_stable() {
        return Default::default();
    }
    let line = |crossing: Option<Crossing>, name: &dyn Fn(Complex) -> String| -> Vec<Level> {
        let finite = crossing.filter(|crossing| crossing.frequency > 0.0 && crossing.frequency.is_finite());
        finite.iter().map(|c| Level { name: name(c.response), value: c.frequency }).collect()
    };
    let gain = |response| format!("gain margin {} dB", significant(-20.0 * math::log10(complex::norm(response)), 4));
    let turn =
        |response: Complex| format!("phase margin {} deg", significant(complex::arg(-response).to_degrees().abs(), 4));
    [line(of_gain, &gain), line(of_phase, &turn)]
}

/// Returns the range of frequencies that matter, rad/s: a decade beyond the crossovers of a loop, or beyond the corners
/// of a system with a gain of at least [`SMALL`] of the largest one.
fn decades(system: &StateSpace, response: &FrequencyCurve, closed: Option<&Loop>) -> [f64; 2] {
    let crossings = closed.map_or_else(Vec::new, |of| {
        let phase = of.critical().into_iter().flatten().flatten();
        of.gain_crossovers.iter().copied().chain(phase).map(|crossing| crossing.frequency).collect()
    });
    let positive = |frequency: &f64| *frequency > 0.0 && frequency.is_finite();
    let mut matter: Vec<f64> = crossings.into_iter().filter(positive).collect();
    if matter.is_empty() {
        let corners =
            [system.poles().unwrap_or_default(), system.in_seconds(zeros(system).unwrap_or_default())].concat();
        let largest = response.values.iter().map(|g| complex::norm(*g)).fold(0.0, f64::max);
        let gain = |omega: f64| {
            let at = response.omegas.partition_point(|&x| x < omega).min(response.omegas.len() - 1);
            complex::norm(response.values[at])
        };
        let corners = corners.iter().map(|z| complex::norm(*z)).filter(positive);
        matter = corners.filter(|&omega| gain(omega) >= SMALL * largest).collect();
    }
    let whole = [response.omegas[0], response.omegas[response.omegas.len() - 1]];
    let [low, high] =
        [matter.iter().copied().fold(f64::INFINITY, f64::min), matter.iter().copied().fold(0.0, f64::max)];
    if low > high { whole } else { [(0.1 * low).max(whole[0]), (10.0 * high).min(whole[1])] }
}

/// Returns the curves of a measured response. Its phase is shifted by whole turns to that of the model.
fn measurement(data: &ResponseData, model: Option<&Curve>) -> [Curve; 2] {
    let values: Vec<Complex> = data.values.iter().map(|[re, im]| Complex::new(*re, *im)).collect();
    let phases = unwrapped(&values);
    let near = |omega: f64| model.and_then(|curve| curve.points.iter().find(|p| p.0 >= omega)).map_or(0.0, |p| p.1);
    let turns = match (data.frequencies.first(), phases.first()) {
        (Some(omega), Some(first)) => 360.0 * ((near(*omega) - first) / 360.0).round(),
        _ => 0.0,
    };
    let curve = |points| Curve {
        name: "measured".into(),
        points,
        style: CurveStyle::Dots,
        color: Color::Measured,
        ..Curve::default()
    };
    let decibel = values.iter().map(|g| 20.0 * math::log10(complex::norm(*g)));
    [
        curve(data.frequencies.iter().copied().zip(decibel).collect()),
        curve(data.frequencies.iter().copied().zip(phases.iter().map(|phase| phase + turns)).collect()),
    ]
}

/// Returns the Nyquist curve of the case whose loop has the largest sensitivity.
fn nyquist_curve(cases: &Cases<'_>, (input, output): (usize, usize), name: &str) -> Option<Plot> {
    let loops = cases.ones.iter().filter_map(|one| {
        let channel = channel(cases, of(&one.both.best)?, (input, output))?;
        let closed = closed(cases, one, &channel)?;
        let peak = closed.peak_sensitivity().ok();
        Some((peak, channel, cases.name(one)))
    });
    // An unstable loop has no sensitivity and comes first.
    let rank = |peak: Option<f64>| peak.unwrap_or(f64::INFINITY);
    let (peak, channel, case) = loops.max_by(|a, b| rank(a.0).total_cmp(&rank(b.0)))?;
    let response = FrequencyCurve::of(&channel).ok()?;
    let name = if cases.ones.len() > 1 { format!("{name} in case {case}") } else { name.to_owned() };
    Some(nyquist(&response, peak, &name))
}

/// Returns the poles of the first case while a tuner moves from its lower to its upper bound, with the name of the
/// tuner. For a loop transfer function, the poles are those of the closed loop. `None` if the tuner is fixed or moves
/// no pole.
fn poles(cases: &Cases<'_>, tuner: usize, failures: &mut u32) -> Option<(String, Plot)> {
    let (problem, one) = (&cases.report.solution.problem, cases.ones[0]);
    let moved = &problem.study().tuners()[tuner];
    if !moved.active || moved.tie.is_some() || moved.bounds.iter().any(|bound| !bound.is_finite()) {
        return None;
    }
    let poles_of = |system: &StateSpace| -> Option<Vec<Complex>> {
        let single = system.inputs.len() == 1 && system.outputs.len() == 1;
        if !((single || is_cut(cases)) && is_loop(cases, one, system)) {
            return system.poles().ok();
        }
        // A loop with a delay has infinitely many poles.
        if system.delay > 0.0 { None } else { system.complementary_sensitivity().ok()?.poles().ok() }
    };
    let at = |position: f64, failures: &mut u32| -> Option<Vec<Complex>> {
        if *failures == MOST_FAILURES || problem.is_cancelled() {
            return None;
        }
        let mut tuners = cases.report.solution.best.tuners.clone();
        tuners[tuner] = moved.value_at(position);
        problem.study().apply_ties(&mut tuners);
        let analysis = problem.analyse_all(one.job, &tuners, None);
        let poles = analysis.ok().and_then(|analysis| poles_of(analysis.linear()?));
        *failures += u32::from(poles.is_none());
        poles
    };
    let here = poles_of(of(&one.both.best)?)?;
    let [first, last] = [at(0.0, failures)?, at(1.0, failures)?];
    if first == last {
        return None;
    }
    let cloud: Vec<Complex> =
        (0..=VALUES).filter_map(|i| at(f64::from(i) / f64::from(VALUES), failures)).flatten().collect();
    // Far poles would compress the others.
    let size = 3.0 * here.iter().map(|z| complex::norm(*z)).fold(0.0, f64::max);
    let points = |all: &mut dyn Iterator<Item = Complex>| -> Vec<(f64, f64)> {
        all.filter(|z| complex::norm(*z) <= size).map(|z| (z.re, z.im)).collect()
    };
    let curve = |name: String, all: &mut dyn Iterator<Item = Complex>, style, color| Curve {
        name,
        points: points(all),
        style,
        color,
        ..Curve::default()
    };
    let [low, high] = moved.bounds.map(|bound| significant(bound, 3));
    let plot = Plot {
        title: format!("poles over {}", cases.title(&moved.name)),
        x_label: "real part (1/s)".into(),
        y_label: "imaginary part (1/s)".into(),
        curves: vec![
            curve(
                format!("{} from {low} to {high}", moved.name),
                &mut cloud.into_iter(),
                CurveStyle::Dots,
                Color::Start,
            ),
            curve("at the lower bound".into(), &mut first.into_iter(), CurveStyle::Crosses, Color::Measured),
            curve(one.both.best_name.into(), &mut here.into_iter(), CurveStyle::Crosses, Color::Result),
        ],
        equal: true,
        x_range: Some([0.0, 0.0]),
        verticals: vec![Level::default()],
        ..Plot::default()
    };
    Some((moved.name.clone(), plot))
}
