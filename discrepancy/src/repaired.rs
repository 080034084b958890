//! The repaired model: its parameters from calibration data alone, its errors on every experiment.

use mops_core::math;
use mops_core::{Port, Role};
use nalgebra::DMatrix;

use crate::base;
use crate::fit::{Fit, Fitted, Point};
use crate::profile::{QUANTILE, interval95};
use crate::search::{ASTRAY, Search, Trial};
use crate::subject::{Measurement, Subject};
use crate::variant::{Added, Variant, problem};
use crate::weigh::Dispersion;
use crate::windows::whole;
use mops_core::diagnosis::{ExperimentError, StrengthValue, together};

/// A model that was fitted to calibration data alone, and its predictions everywhere.
pub struct Calibrated<'a> {
    /// Its effects.
    pub added: Vec<Added>,
    /// Values of the tuners of the study.
    pub tuners: Vec<f64>,
    /// Covariance of these, then of the strengths in the order of [`Calibrated::free`].
    pub covariance: DMatrix<f64>,
    /// The problem of fitting it to calibration data.
    pub fit: Fit<'a>,
    /// The solution of that.
    pub fitted: Fitted,
    /// What is left of calibration data.
    pub dispersion: Dispersion,
    /// For each strength that was fitted the effect and its index there.
    pub free: Vec<(usize, usize)>,
    /// For each experiment: predicted outputs by series, and the values of the model's locals.
    pub experiments: Vec<Prognosis>,
}

/// What a model says of an experiment.
pub struct Prognosis {
    /// Predicted samples of each series.
    pub predicted: Vec<Vec<f64>>,
    /// Start values: name of the parameter, value.
    pub starts: Vec<(String, f64)>,
}

impl<'a> Search<'a> {
    /// Fits the effects and the tuners to calibration data, from where a trial over all data ended, and the start values of
    /// the other experiments with these.
    pub fn calibrate(&self, trial: &Trial<'a>, held: &[usize]) -> Option<Calibrated<'a>> {
        let mut calibrated = self.fitted_to_calibration_data(trial, held)?;
        let all = (0..self.subject.measurements.len()).map(|index| self.said(trial, &calibrated, index));
        calibrated.experiments = all.collect::<Option<_>>()?;
        Some(calibrated)
    }

    /// What the trial, fitted to calibration data alone, leaves on the samples of selection data, in units of the noise.
    pub fn left_on_selection_data(&self, trial: &Trial<'a>) -> Option<Vec<f64>> {
        let calibrated = self.fitted_to_calibration_data(trial, &[])?;
        let mut left = Vec::new();
        for (index, m) in self.subject.measurements.iter().enumerate().filter(|(_, m)| m.role == Role::Selection) {
            let said = self.said(trial, &calibrated, index)?;
            for (s, predicted) in m.series.iter().zip(&said.predicted) {
                left.extend(predicted.iter().zip(&s.values).map(|(p, y)| (p - y) / s.noise));
            }
        }
        Some(left)
    }

    /// Fits the effects and the tuners to calibration data; nothing is said of any experiment.
    fn fitted_to_calibration_data(&self, trial: &Trial<'a>, held: &[usize]) -> Option<Calibrated<'a>> {
        let subject = self.subject;
        let pieces = base::pieces(subject, |role| role == Role::Calibration);
        let mut locals = base::first_locals(&pieces);
        for (piece, locals) in pieces.iter().zip(&mut locals) {
            if let Some(known) = locals_of(trial, piece.measurement, piece.locals.len()) {
                *locals = known;
            }
        }
        let tuners = &trial.fitted.point.globals[..subject.globals.len()];
        let (fit, point, variant) = problem(subject, &trial.added, pieces, tuners, locals, held, self.simulations);
        let fitted = fit.solve(point, 80)?;
        let mut added = trial.added.clone();
        let mut free = Vec::new();
        for (index, a) in added.iter_mut().enumerate() {
            a.take(index, &variant, &fit, &fitted.point);
            let strengths = a.candidate.effect.parameters();
            let shared = |k: &usize| strengths[*k].scope == mops_core::Scope::Study && !strengths[*k].fixed;
            free.extend((0..strengths.len()).filter(shared).map(|k| (index, k)));
        }
        let tuners = fitted.point.globals[..subject.globals.len()].to_vec();
        let dispersion = Dispersion::left(&fit, &fitted);
        let covariance = fit.covariance(&fitted, dispersion.weight());
        let experiments = Vec::new();
        Some(Calibrated { added, tuners, covariance, fit, fitted, dispersion, free, experiments })
    }

    /// What a model fitted to calibration data says of an experiment; start values of the others begin where a trial has them.
    fn said(&self, trial: &Trial<'a>, calibrated: &Calibrated<'a>, index: usize) -> Option<Prognosis> {
        let measurement = &self.subject.measurements[index];
        let Calibrated { fit, fitted, added, tuners, .. } = calibrated;
        if let Some(piece) = fit.pieces.iter().position(|p| p.measurement == index) {
            return prognosis(fit, &fitted.point, piece, measurement);
        }
        let enough = ASTRAY * calibrated.dispersion.square.sqrt();
        self.forecast(added, tuners, index, locals_of(trial, index, measurement.locals.len()), enough)
    }

    /// Start values of an experiment with everything else held, and what the model then says; `enough` is what it may leave.
    fn forecast(
        &self,
        added: &[Added],
        tuners: &[f64],
        index: usize,
        from: Option<Vec<f64>>,
        enough: f64,
    ) -> Option<Prognosis> {
        let measurement = &self.subject.measurements[index];
        let piece = whole(index, measurement);
        let first: Vec<f64> = measurement.locals.iter().map(|l| l.start).collect();
        let beginnings = from.into_iter().chain([first]).collect();
        let (fit, fitted) = self.begun(added, tuners, &piece, beginnings, enough)?;
        prognosis(&fit, &fitted.point, 0, measurement)
    }
}

/// The first so many start values of an experiment in a trial over whole records.
fn locals_of(trial: &Trial<'_>, measurement: usize, count: usize) -> Option<Vec<f64>> {
    let piece = trial.fit.pieces.iter().position(|p| p.measurement == measurement && trial.windows == 1)?;
    Some(trial.fitted.point.locals[piece][..count].to_vec())
}

fn prognosis(fit: &Fit<'_>, point: &Point, piece: usize, measurement: &Measurement) -> Option<Prognosis> {
    let residuals = fit.residuals(piece, point)?;
    let mut at = 0;
    let predicted = measurement.series.iter().map(|s| {
        let part = &residuals[at..at + s.times.len()];
        at += s.times.len();
        part.iter().zip(&s.values).map(|(r, y)| y + r * s.noise).collect()
    });
    let predicted = predicted.collect();
    let names = &fit.model.interface().parameters;
    let locals = fit.pieces[piece].locals.iter().zip(&point.locals[piece]);
    let starts = locals.map(|(local, &value)| (names[local.parameter].variable.name.clone(), value)).collect();
    Some(Prognosis { predicted, starts })
}

impl Calibrated<'_> {
    /// Number of unknowns that were fitted; tuners that were held have no variance.
    pub fn unknowns(&self) -> usize {
        self.covariance.diagonal().iter().filter(|&&variance| variance > 0.0).count()
    }

    /// Its errors on every experiment.
    #[allow(clippy::cast_precision_loss)]
    pub fn errors(&self, measurements: &[Measurement]) -> Vec<ExperimentError> {
        let error = |(m, said): (&Measurement, &Prognosis)| {
            let (mut sum, mut count) = (0.0, 0);
            let channels = m.series.iter().zip(&said.predicted).map(|(s, predicted)| {
                let square: f64 = predicted.iter().zip(&s.values).map(|(p, y)| math::powi(p - y, 2)).sum();
                sum += square / math::powi(s.noise, 2);
                count += s.values.len();
                (s.name.clone(), (square / s.values.len().max(1) as f64).sqrt())
            });
            let channels = channels.collect();
            ExperimentError {
                name: m.name.clone(),
                role: m.role,
                channels,
                normalised: (sum / count.max(1) as f64).sqrt(),
                in_windows: None,
            }
        };
        measurements.iter().zip(&self.experiments).map(error).collect()
    }

    /// Its error on the experiments of a role together; `None` where there are none.
    pub fn error_on(&self, role: Role, subject: &Subject) -> Option<f64> {
        together(&self.errors(&subject.measurements), role)
    }

    /// The strengths of an effect, with what the data say of them.
    pub fn strengths(&self, index: usize, variant: &Variant) -> Vec<StrengthValue> {
        let a = &self.added[index];
        let parameters = &mops_core::Model::interface(variant.model.as_ref()).parameters;
        let one = |(k, strength): (usize, &mops_core::EffectParameter)| {
            let place = self.free.iter().position(|&f| f == (index, k)).map(|place| self.tuners.len() + place);
            let (std_error, interval95) = place.map_or((None, None), |place| self.told(place, &a.candidate.port));
            StrengthValue {
                name: strength.name.to_owned(),
                value: a.strengths[k],
                unit: a.candidate.unit(strength, &parameters[variant.first[index] + k].variable.unit),
                std_error,
                interval95,
            }
        };
        a.candidate.effect.parameters().iter().enumerate().map(one).collect()
    }

    /// Standard error and interval of a global that sets a strength at a port, as far as the data tell them.
    fn told(&self, place: usize, port: &Port) -> (Option<f64>, Option<[f64; 2]>) {
        let weight = self.dispersion.weight();
        let error = Some(self.covariance[(place, place)].sqrt()).filter(|error| error.is_finite() && *error > 0.0);
        let global = &self.fit.globals[place];
        if !global.is_stepped() {
            return (error, error.map(|error| interval95(&self.fit, &self.fitted, place, error, weight)));
        }
        let scanned = self.fit.stepped_interval(&self.fitted, place, QUANTILE * QUANTILE * weight);
        // At a sensor samples that stay on their step tell the size of the steps by slopes.
        let told = error.filter(|_| matches!(port, Port::Sensor { .. })).map_or(0.0, |error| QUANTILE * error);
        let value = self.fitted.point.globals[place];
        let [least, most] = [-told, told].map(|by| (value + by).clamp(global.bounds[0], global.bounds[1]));
        (None, scanned.map(|[low, high]| [low.min(least), high.max(most)]))
    }
}
