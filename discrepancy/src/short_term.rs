//! Errors over a few periods: each record in windows with start values of their own, everything else held. What drifts out
//! of phase over a long record, or starts elsewhere in every session, is judged apart from what the model lacks.

use rayon::prelude::*;

use crate::fit::Piece;
use crate::repaired::{Calibrated, Prognosis};
use crate::search::{ASTRAY, Search};
use crate::subject::{Measurement, Series};
use crate::windows::cut;
use mops_core::diagnosis::{ExperimentError, WindowErrors};

/// Periods in a window.
///
/// Source: H. G. Bock, Recent advances in parameter identification techniques for ODE, in Numerical Treatment of Inverse
/// Problems (1983) 95, for windows; two to four periods keep the phase and still show slow changes.
const PERIODS: f64 = 4.0;

impl Search<'_> {
    /// Errors of a model on every experiment, over whole records and in windows.
    pub fn errors(&self, model: &Calibrated<'_>) -> Vec<ExperimentError> {
        let whole = model.errors(&self.subject.measurements).into_par_iter().enumerate();
        whole.map(|(index, error)| ExperimentError { in_windows: self.in_windows_of(model, index), ..error }).collect()
    }

    /// The errors of a model on an experiment in windows of [`PERIODS`] periods of its liveliest channel; `None` where the
    /// record has too few periods for two windows, or where a window cannot be simulated.
    #[allow(clippy::cast_precision_loss)]
    fn in_windows_of(&self, model: &Calibrated<'_>, index: usize) -> Option<WindowErrors> {
        let measurement = &self.subject.measurements[index];
        let count = windows_of(measurement);
        if count < 2 {
            return None;
        }
        let windows = cut(index, measurement, self.subject.model.as_ref(), count);
        let mut squares = vec![(0.0, 0_usize); measurement.series.len()];
        let enough = ASTRAY * model.dispersion.square.sqrt();
        for (k, window) in windows.iter().enumerate() {
            let first = window.locals.iter().map(|local| local.start).collect();
            // The first begins as the record does.
            let whole = (k == 0).then(|| self.starts_in(&model.experiments[index], window)).flatten();
            let beginnings = whole.into_iter().chain([first]).collect();
            let (fit, fitted) = self.begun(&model.added, &model.tuners, window, beginnings, enough)?;
            let mut rest = fitted.residuals[0].as_slice();
            for (series, (sum, samples)) in fit.pieces[0].series.iter().zip(&mut squares) {
                let (own, others) = rest.split_at(series.times.len());
                *sum += own.iter().map(|r| r * r).sum::<f64>();
                *samples += own.len();
                rest = others;
            }
        }
        let channels = measurement.series.iter().zip(&squares);
        let channels = channels.map(|(s, (sum, n))| (s.name.clone(), s.noise * (sum / (*n).max(1) as f64).sqrt()));
        let (sum, samples) = squares.iter().fold((0.0, 0), |all, one| (all.0 + one.0, all.1 + one.1));
        Some(WindowErrors {
            count,
            length: measurement.horizon / count as f64,
            channels: channels.collect(),
            normalised: (sum / samples.max(1) as f64).sqrt(),
        })
    }

    /// The start values of a record for a window that begins with it; `None` where one of them is not known.
    fn starts_in(&self, record: &Prognosis, window: &Piece) -> Option<Vec<f64>> {
        let parameters = &self.subject.model.interface().parameters;
        let known = |name: &str| record.starts.iter().find(|(of, _)| of == name).map(|(_, value)| *value);
        window.locals.iter().map(|local| known(&parameters[local.parameter].variable.name)).collect()
    }
}

/// Windows of [`PERIODS`] periods in a record, at most 32.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn windows_of(measurement: &Measurement) -> usize {
    let periods = measurement.series.iter().map(periods).fold(0.0, f64::max);
    (periods / PERIODS).round().min(32.0) as usize
}

/// Periods in a series: half its crossings of the mean, those within three times the noise not counted.
#[allow(clippy::cast_precision_loss)]
fn periods(series: &Series) -> f64 {
    let mean = series.values.iter().sum::<f64>() / series.values.len().max(1) as f64;
    let sides = series.values.iter().map(|v| v - mean).filter(|v| v.abs() > 3.0 * series.noise).map(|v| v > 0.0);
    let sides: Vec<bool> = sides.collect();
    0.5 * sides.windows(2).filter(|pair| pair[0] != pair[1]).count() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use mops_core::math;

    #[test]
    fn periods_are_counted_through_noise_and_offset() {
        let times: Vec<f64> = (0..1000).map(|i| 0.01 * f64::from(i)).collect();
        let chance = |i: usize| ((i * 7919) % 13) as f64 / 6.0 - 1.0;
        let wave = |(i, t): (usize, &f64)| 5.0 + math::sin(2.0 * std::f64::consts::TAU * t) + 0.02 * chance(i);
        let values = times.iter().enumerate().map(wave).collect();
        let series = Series { signal: 0, name: "q".into(), unit: "rad".into(), times, values, noise: 0.02 };
        assert!((periods(&series) - 20.0).abs() <= 0.5, "{}", periods(&series));
        let still = Series { values: vec![5.0; 1000], ..series };
        assert_eq!(periods(&still), 0.0);
    }
}
