//! Residuals of the nominal and the recalibrated model: time series, spectrum, autocorrelation.

use mops_content::{
    figures::{Figure, Group},
    numbers::{labelled, with_unit},
    plot::{Band, Color, Curve, CurveStyle, Level, Plot},
    sampling::thinned,
};
use mops_core::Role;
use mops_outcome::diagnosis::{Diagnosis, Prediction};

use super::spectrum::{autocorrelation, band, even, spectrum};

/// Largest number of experiments with plots.
const MOST: usize = 4;

/// Properties of the residuals of a correct model.
pub(super) const WHITE_RESIDUALS: &str = "If nothing is missing, the residuals are white: 95 % of them lie within twice the \
    noise level, their spectrum is flat, and 95 % of their autocorrelation lies within the band.";

/// Returns the experiments with plots: the first of each role, then the first of the others.
fn shown(diagnosis: &Diagnosis) -> Vec<&[Prediction]> {
    let all: Vec<&[Prediction]> = diagnosis.predictions.chunk_by(|a, b| a.experiment == b.experiment).collect();
    let first = |role| all.iter().position(|channels| channels[0].role == role);
    let mut chosen: Vec<usize> =
        [Role::Calibration, Role::Selection, Role::Validation].into_iter().filter_map(first).collect();
    let others: Vec<usize> = (0..all.len()).filter(|i| !chosen.contains(i)).collect();
    chosen.extend(others.into_iter().take(MOST.saturating_sub(chosen.len())));
    chosen.sort_unstable();
    chosen.into_iter().map(|i| all[i]).collect()
}

fn title(channels: &[Prediction]) -> String {
    format!("Experiment `{}` ({})", channels[0].experiment, channels[0].role.name())
}

/// Returns a group for every experiment, with a column of plots for every channel. The first group includes spectrum
/// and autocorrelation.
pub(super) fn groups(diagnosis: &Diagnosis) -> Vec<Group> {
    let all = diagnosis.predictions.chunk_by(|a, b| a.experiment == b.experiment).count();
    let shown = shown(diagnosis);
    let omitted = (all > shown.len()).then(|| format!("{} of {all} experiments are shown.", shown.len()));
    let group = |(i, channels): (usize, &&[Prediction])| Group {
        title: title(channels),
        about: omitted.iter().filter(|_| i == 0).cloned().collect(),
        // Spectra and autocorrelations of other experiments are similar.
        figures: channels.iter().map(|channel| figure(channel, i == 0)).collect(),
        full_width: true,
    };
    shown.iter().enumerate().map(group).collect()
}

fn difference(prediction: &Prediction, model: &[f64]) -> Vec<f64> {
    prediction.measured.iter().zip(model).map(|(measured, model)| measured - model).collect()
}

/// Returns the curves of the nominal model and, on top, of the recalibrated model; one curve if they are equal.
fn of_models(before: Vec<(f64, f64)>, after: Vec<(f64, f64)>, style: CurveStyle) -> Vec<Curve> {
    let curve = |name: &str, points, color| Curve { name: name.into(), points, style, color, ..Curve::default() };
    if before == after {
        return vec![curve("nominal model", before, Color::Result)];
    }
    vec![curve("nominal model", before, Color::Measured), curve("recalibrated model", after, Color::Result)]
}

fn figure(prediction: &Prediction, with_spectrum: bool) -> Figure {
    let Prediction { experiment, signal, times, unit, noise, .. } = prediction;
    let place = format!("{experiment}-{signal}");
    let [before, after] = [&prediction.before, &prediction.after].map(|model| difference(prediction, model));
    let over_time = |values: &[f64]| times.iter().copied().zip(values.iter().copied()).collect();
    let mut plots = vec![(
        format!("left-{place}"),
        Plot {
            title: format!("residual of {signal}"),
            x_label: "time (s)".into(),
            y_label: labelled(signal, unit),
            curves: of_models(over_time(&before), over_time(&after), CurveStyle::Dots),
            bands: vec![Band {
                name: format!("\u{b1}2 noise, {}", with_unit(2.0 * noise, unit)),
                range: [-2.0 * noise, 2.0 * noise],
            }],
            ..Plot::default()
        },
    )];
    let evenly = |values: &[f64]| even(times, values).filter(|_| with_spectrum);
    if let (Some((step, before)), Some((_, after))) = (evenly(&before), evenly(&after)) {
        plots.push((
            format!("spectrum-{place}"),
            Plot {
                title: format!("spectrum of the residual of {signal}"),
                x_label: "frequency (Hz)".into(),
                y_label: "power / noise power".into(),
                log_x: true,
                log_y: true,
                curves: of_models(spectrum(step, &before, *noise), spectrum(step, &after, *noise), CurveStyle::Line),
                levels: vec![Level { name: "noise".into(), value: 1.0 }],
                ..Plot::default()
            },
        ));
        let width = band(before.len());
        plots.push((
            format!("autocorrelation-{place}"),
            Plot {
                title: format!("autocorrelation of the residual of {signal}"),
                x_label: "lag (s)".into(),
                y_label: "autocorrelation".into(),
                curves: of_models(autocorrelation(step, &before), autocorrelation(step, &after), CurveStyle::Line),
                bands: vec![Band { name: "95 % of white residuals".into(), range: [-width, width] }],
                ..Plot::default()
            },
        ));
    }
    Figure { plots, ..Figure::default() }
}

/// Returns a group for every experiment with plots: the measurement and the predictions of both models.
pub(super) fn predictions(diagnosis: &Diagnosis) -> Vec<Group> {
    let plot = |p: &Prediction| {
        let points = |values: &[f64]| thinned(p.times.iter().copied().zip(values.iter().copied()).collect());
        let mut curves = vec![Curve {
            name: "measured".into(),
            points: points(&p.measured),
            style: CurveStyle::Dots,
            color: Color::Start,
            ..Curve::default()
        }];
        curves.extend(of_models(points(&p.before), points(&p.after), CurveStyle::Line));
        let plot = Plot {
            title: format!("{} in experiment {}", p.signal, p.experiment),
            x_label: "time (s)".into(),
            y_label: labelled(&p.signal, &p.unit),
            curves,
            ..Plot::default()
        };
        Figure { plots: vec![(format!("predicted-{}-{}", p.experiment, p.signal), plot)], ..Figure::default() }
    };
    let group = |channels: &[Prediction]| Group {
        title: title(channels),
        about: Vec::new(),
        figures: channels.iter().map(plot).collect(),
        full_width: true,
    };
    shown(diagnosis).into_iter().map(group).collect()
}
