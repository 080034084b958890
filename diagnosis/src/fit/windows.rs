//! Multiple shooting: a record cut into windows, each with start values of its own, so that a poor guess neither drifts
//! out of phase nor runs away.
//!
//! Source: H. G. Bock, Recent advances in parameter identification techniques for ODE, in Numerical Treatment of
//! Inverse Problems (1983) 95.

use mops_core::{Case, Model};
use mops_math as math;

use super::residuals::Piece;
use crate::records::{Local, Measurement, Series};

/// The whole experiment as one piece.
pub fn whole(index: usize, measurement: &Measurement) -> Piece {
    Piece {
        measurement: index,
        case: measurement.case.clone(),
        series: measurement.series.clone(),
        horizon: measurement.horizon,
        locals: measurement.locals.clone(),
        fixed: Vec::new(),
    }
}

/// The experiment in `count` windows of equal length; all states with a start value are free in each, but at the
/// beginning of the record only those that are free there or measured.
#[allow(clippy::cast_precision_loss)]
pub fn cut(index: usize, measurement: &Measurement, model: &dyn Model, count: usize) -> Vec<Piece> {
    let length = measurement.horizon / count as f64;
    let window = |k: usize| {
        let (from, to) = (k as f64 * length, (k + 1) as f64 * length);
        // Neighbouring windows share no sample.
        let within = |t: f64| t >= from - 1e-9 * length && (t < to - 1e-9 * length || k + 1 == count);
        let series: Vec<Series> = measurement
            .series
            .iter()
            .map(|s| {
                let kept: Vec<usize> = (0..s.times.len()).filter(|&i| within(s.times[i])).collect();
                Series {
                    times: kept.iter().map(|&i| (s.times[i] - from).max(0.0)).collect(),
                    values: kept.iter().map(|&i| s.values[i]).collect(),
                    ..s.clone()
                }
            })
            .collect();
        let inputs = measurement.case.inputs.iter().map(|(name, input)| (name.clone(), input.since(from)));
        let case = Case { inputs: inputs.collect(), begins: from, ..measurement.case.clone() };
        Piece {
            measurement: index,
            case,
            horizon: series.iter().filter_map(|s| s.times.last().copied()).fold(0.0, f64::max),
            locals: starts(measurement, model, from, length),
            series,
            fixed: Vec::new(),
        }
    };
    (0..count).map(window).filter(|piece| piece.horizon > 0.0).collect()
}

/// Start values of all states at a time, read off the measured signals where that is possible.
fn starts(measurement: &Measurement, model: &dyn Model, at: f64, length: f64) -> Vec<Local> {
    let interface = model.interface();
    let start = |state: &mops_core::model::State| {
        let parameter = interface.parameters.iter().position(|p| p.variable.name == state.start)?;
        let known = measurement.locals.iter().find(|local| local.parameter == parameter);
        let series = |name: &str| measurement.series.iter().find(|s| s.name == name);
        let shown = state.signal.as_deref().and_then(series).map(|s| (local_line(s, at).0, spread(s)));
        let rate = state.rate_of.as_deref().and_then(series).map(|s| {
            let speed = spread(&derivative(s));
            (local_line(s, at).1, speed.max(spread(s) / length))
        });
        let (value, scale) = match (shown, rate, known) {
            (Some(shown), ..) => shown,
            (None, Some(rate), _) => rate,
            (None, None, Some(local)) => (local.start, local.scale),
            (None, None, None) if at == 0.0 => return None,
            // A hidden state has moved on from where the record began.
            (None, None, None) => {
                let started = interface.parameters[parameter].default.unwrap_or(0.0);
                (started, if started == 0.0 { 1.0 } else { started.abs() })
            }
        };
        // Bounds that the study gives are those of the beginning.
        let range = interface.parameters[parameter].range;
        let bounds = known.filter(|_| at == 0.0).map_or(range, |local| local.bounds);
        Some(Local { parameter, bounds, start: value.clamp(bounds[0], bounds[1]), scale: scale.max(1e-9) })
    };
    interface.states.iter().filter_map(start).collect()
}

/// Value and slope at a time, by a straight line through the nearest samples.
#[allow(clippy::cast_precision_loss)]
fn local_line(series: &Series, at: f64) -> (f64, f64) {
    let n = series.times.len();
    let nearest = series.times.partition_point(|&t| t < at).min(n.saturating_sub(1));
    let (from, to) = (nearest.saturating_sub(2), (nearest + 5).min(n));
    let (t, y) = (&series.times[from..to], &series.values[from..to]);
    let count = t.len() as f64;
    let (mt, my) = (t.iter().sum::<f64>() / count, y.iter().sum::<f64>() / count);
    let square: f64 = t.iter().map(|t| math::powi(t - mt, 2)).sum();
    let product: f64 = t.iter().zip(y).map(|(t, y)| (t - mt) * (y - my)).sum();
    let slope = if square > 0.0 { product / square } else { 0.0 };
    (my + slope * (at - mt), slope)
}

/// Root mean square about the mean.
#[allow(clippy::cast_precision_loss)]
fn spread(series: &Series) -> f64 {
    let n = series.values.len().max(1) as f64;
    let mean = series.values.iter().sum::<f64>() / n;
    (series.values.iter().map(|v| math::powi(v - mean, 2)).sum::<f64>() / n).sqrt().max(series.noise)
}

/// Slopes over eight samples.
fn derivative(series: &Series) -> Series {
    let step = 8.min(series.times.len().saturating_sub(1)).max(1);
    let pairs = (0..series.times.len().saturating_sub(step))
        .map(|i| (series.values[i + step] - series.values[i]) / (series.times[i + step] - series.times[i]));
    Series { values: pairs.collect(), ..series.clone() }
}
