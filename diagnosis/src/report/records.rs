//! What a fitted model predicts for every record, and its errors.

use mops_core::Role;
use mops_math as math;
use mops_outcome::diagnosis::{ExperimentError, ParameterMove, Prediction, WindowErrors};

use super::parameters::interval;
use crate::estimation::CLEARLY;
use rayon::prelude::*;

use crate::fit::{Fit, Point, cut, whole};
use crate::records::{Measurement, Series, Subject};
use crate::selection::{FittedSet, with_free_starts};

/// Periods in a window of a record. Source: H. G. Bock, Recent advances in parameter identification techniques for ODE,
/// in Numerical Treatment of Inverse Problems (1983) 95, for windows; two to four periods keep the phase and still show
/// slow changes.
const WINDOW_PERIODS: f64 = 4.0;

/// Largest number of windows of a record. Basis: an assumption.
const MOST_WINDOWS: f64 = 32.0;

/// A record as a model predicts it.
struct Predicted {
    /// Predicted samples of each series; not finite if the record cannot be simulated.
    samples: Vec<Vec<f64>>,
    /// Initial states: name of the parameter, value.
    starts: Vec<(String, f64)>,
}

/// A model with its parameters from least squares on the calibration records, and what it predicts for every record,
/// initial states fitted.
pub struct Records<'s, 'a> {
    set: &'s FittedSet<'a>,
    all: Vec<Predicted>,
}

impl<'s, 'a> Records<'s, 'a> {
    /// Simulates every record of the study.
    pub fn new(set: &'s FittedSet<'a>) -> Self {
        let subject = set.fit.subject;
        let of = |index: usize| {
            let m = &subject.measurements[index];
            if let Some(piece) = set.fit.pieces.iter().position(|p| p.measurement == index) {
                return predicted(&set.fit, &set.least_squares.point, piece, m);
            }
            let (fit, point) = with_free_starts(set, &set.least_squares.point, vec![whole(index, m)])?;
            predicted(&fit, &point, 0, m)
        };
        let lost = |index: usize| Predicted {
            samples: subject.measurements[index].series.iter().map(|s| vec![f64::NAN; s.values.len()]).collect(),
            starts: Vec::new(),
        };
        let all = (0..subject.measurements.len()).into_par_iter().map(|k| of(k).unwrap_or_else(|| lost(k))).collect();
        Self { set, all }
    }

    fn subject(&self) -> &'a Subject {
        self.set.fit.subject
    }

    /// Returns the errors of every record, over the whole of it and in windows.
    pub fn errors(&self) -> Vec<ExperimentError> {
        let of = |index: usize| ExperimentError { in_windows: self.in_windows(index), ..self.error(index) };
        (0..self.all.len()).into_par_iter().map(of).collect()
    }

    #[allow(clippy::cast_precision_loss)]
    fn error(&self, index: usize) -> ExperimentError {
        let m = &self.subject().measurements[index];
        let (mut sum, mut count) = (0.0, 0);
        let channels = m.series.iter().zip(&self.all[index].samples).map(|(s, predicted)| {
            let square: f64 = predicted.iter().zip(&s.values).map(|(p, y)| math::powi(p - y, 2)).sum();
            sum += square / math::powi(s.noise, 2);
            count += s.values.len();
            (s.name.clone(), (square / s.values.len().max(1) as f64).sqrt())
        });
        let channels = channels.collect();
        let normalised = (sum / count.max(1) as f64).sqrt();
        ExperimentError { name: m.name.clone(), role: m.role, channels, normalised, in_windows: None }
    }

    /// Returns the sum of squared errors in noises over all records of a role; `None` if there are none.
    #[allow(clippy::cast_precision_loss)]
    pub fn sum_of_squares(&self, role: Role) -> Option<f64> {
        let of_role = self.subject().measurements.iter().enumerate().filter(|(_, m)| m.role == role);
        let of = |(index, m): (usize, &Measurement)| {
            let count: usize = m.series.iter().map(|s| s.values.len()).sum();
            math::powi(self.error(index).normalised, 2) * count as f64
        };
        let squares: Vec<f64> = of_role.map(of).collect();
        (!squares.is_empty()).then(|| squares.iter().sum())
    }

    /// Returns the errors of a record in windows of a few periods of its liveliest channel, each with initial states of
    /// its own; `None` if it has too few periods for two, or a window cannot be simulated.
    #[allow(clippy::cast_precision_loss)]
    fn in_windows(&self, index: usize) -> Option<WindowErrors> {
        let (subject, m) = (self.subject(), &self.subject().measurements[index]);
        let count = windows_of(m);
        if count < 2 {
            return None;
        }
        let windows = cut(index, m, subject.model.as_ref(), count);
        let residuals = |window| {
            let (fit, point) = with_free_starts(self.set, &self.set.least_squares.point, vec![window])?;
            Some((fit.residuals(0, &point)?, fit.pieces[0].series.iter().map(|s| s.times.len()).collect()))
        };
        let all: Vec<(Vec<f64>, Vec<usize>)> = windows.into_par_iter().map(residuals).collect::<Option<_>>()?;
        let mut squares = vec![(0.0, 0_usize); m.series.len()];
        for (residuals, counts) in &all {
            let mut rest = residuals.as_slice();
            for (count, (sum, samples)) in counts.iter().zip(&mut squares) {
                let (own, others) = rest.split_at(*count);
                *sum += own.iter().map(|r| r * r).sum::<f64>();
                *samples += own.len();
                rest = others;
            }
        }
        let rms = |&(sum, samples): &(f64, usize)| (sum / samples.max(1) as f64).sqrt();
        let channels = m.series.iter().zip(&squares).map(|(s, own)| (s.name.clone(), s.noise * rms(own))).collect();
        let total = squares.iter().fold((0.0, 0), |all, one| (all.0 + one.0, all.1 + one.1));
        Some(WindowErrors { count, length: m.horizon / count as f64, channels, normalised: rms(&total) })
    }

    /// Returns the measured samples with what this model and a repaired one predict.
    pub fn predictions(&self, after: &Self) -> Vec<Prediction> {
        let of = |(index, m): (usize, &Measurement)| {
            let one = |(k, s): (usize, &Series)| Prediction {
                experiment: m.name.clone(),
                role: m.role,
                signal: s.name.clone(),
                unit: s.unit.clone(),
                noise: s.noise,
                times: s.times.clone(),
                measured: s.values.clone(),
                before: self.all[index].samples[k].clone(),
                after: after.all[index].samples[k].clone(),
            };
            m.series.iter().enumerate().map(one).collect::<Vec<_>>()
        };
        self.subject().measurements.iter().enumerate().flat_map(of).collect()
    }

    /// Returns the initial states of every record: record, parameter, value. Those of effects carry the names that
    /// these have in the report.
    pub fn starts(&self, names: &[String]) -> Vec<(String, String, f64)> {
        // The augmented model numbers its effects from 1: `+1.start1`.
        let renamed = |name: &String| {
            let (number, own) = name.strip_prefix('+')?.split_once('.')?;
            Some(format!("{}.{own}", names.get(number.parse::<usize>().ok()?.checked_sub(1)?)?))
        };
        let of = |(m, predicted): (&Measurement, &Predicted)| {
            let one =
                |(name, value): &(String, f64)| (m.name.clone(), renamed(name).unwrap_or_else(|| name.clone()), *value);
            predicted.starts.iter().map(one).collect::<Vec<_>>()
        };
        self.subject().measurements.iter().zip(&self.all).flat_map(of).collect()
    }

    /// Returns how the parameters of the study differ between this model and a repaired one.
    pub fn moves(&self, after: &Self) -> Vec<ParameterMove> {
        let point = |records: &Self| records.set.least_squares.point.globals.clone();
        let (then, now) = (point(self), point(after));
        let likeliest = after.set.likeliest().map(|(_, likeliest)| likeliest);
        let one = |(k, &tuner): (usize, &usize)| {
            let tuner = &self.subject().study.tuners()[tuner];
            ParameterMove {
                name: tuner.name.clone(),
                unit: tuner.unit.to_string(),
                before: then[k],
                after: now[k],
                std_error: likeliest.map(|likeliest| likeliest.deviations[k]).filter(|error| *error > 0.0),
                interval95: likeliest.and_then(|likeliest| interval(&after.set.fit.globals[k], now[k], likeliest, k)),
                at_bound: tuner.at_bound(now[k]).is_some(),
            }
        };
        self.subject().globals.iter().enumerate().map(one).collect()
    }

    /// Returns true if a parameter of the study is at a bound, without the terms that were removed.
    pub fn is_at_bound(&self, removed: &[usize]) -> bool {
        let subject = self.subject();
        let values = &self.set.least_squares.point.globals;
        let is_at_bound = |k: usize| subject.study.tuners()[subject.globals[k]].at_bound(values[k]).is_some();
        (0..subject.globals.len()).any(|k| !removed.contains(&k) && is_at_bound(k))
    }

    /// Returns a note for each parameter of the study at a bound in this model or a repaired one, without the terms
    /// that the repaired one has not.
    pub fn at_bounds(&self, after: &Self, removed: &[usize]) -> Vec<String> {
        let subject = self.subject();
        let one = |k: usize| {
            let tuner = &subject.study.tuners()[subject.globals[k]];
            let side = |records: &Self| tuner.at_bound(records.set.least_squares.point.globals[k]);
            let (side, of) = match (side(self), side(after)) {
                (Some(side), Some(_)) => (side, "of the declared and of the repaired model"),
                (Some(side), None) => (side, "of the declared model"),
                (None, Some(side)) => (side, "of the repaired model"),
                (None, None) => return None,
            };
            let bound = tuner.unit.amount(tuner.bounds[usize::from(side == "upper")]);
            Some(format!("`{}` {of} is at its {side} bound {bound}: widen its range if it may lie beyond", tuner.name))
        };
        (0..subject.globals.len()).filter(|k| !removed.contains(k)).filter_map(one).collect()
    }
}

fn predicted(fit: &Fit<'_>, point: &Point, piece: usize, m: &Measurement) -> Option<Predicted> {
    let residuals = fit.residuals(piece, point)?;
    let of = |(s, own): (&Series, &[f64])| own.iter().zip(&s.values).map(|(r, y)| y + r * s.noise).collect();
    let samples = Series::with_parts(&m.series, &residuals).map(of).collect();
    let names = &fit.model.interface().parameters;
    let locals = fit.pieces[piece].locals.iter().zip(&point.locals[piece]);
    let starts = locals.map(|(local, &value)| (names[local.parameter].variable.name.clone(), value)).collect();
    Some(Predicted { samples, starts })
}

/// Returns the number of windows of [`WINDOW_PERIODS`] periods in a record.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn windows_of(measurement: &Measurement) -> usize {
    let periods = measurement.series.iter().map(periods).fold(0.0, f64::max);
    (periods / WINDOW_PERIODS).round().min(MOST_WINDOWS) as usize
}

/// Returns the number of periods in a series: half its crossings of the mean, without those within the noise.
#[allow(clippy::cast_precision_loss)]
fn periods(series: &Series) -> f64 {
    let mean = series.values.iter().sum::<f64>() / series.values.len().max(1) as f64;
    let sides = series.values.iter().map(|v| v - mean).filter(|v| v.abs() > CLEARLY * series.noise).map(|v| v > 0.0);
    let sides: Vec<bool> = sides.collect();
    0.5 * sides.windows(2).filter(|pair| pair[0] != pair[1]).count() as f64
}

#[cfg(test)]
mod tests;
