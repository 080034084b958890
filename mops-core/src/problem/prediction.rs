//! Criterion values and signals of a problem at given tuners, with the derivatives of signals with respect to the
//! tuners.

use crate::model::{Analysis, Job};
use crate::problem::Problem;
use crate::study::Row;

/// Values of a signal, and its derivatives with respect to every active tuner.
pub type SignalSlopes = (Vec<f64>, Vec<Vec<f64>>);

/// Step of central differences in the unit box: near the cube root of the relative accuracy of simulations.
const STEP: f64 = 1e-4;

impl Problem {
    /// Returns the value of one criterion for given values of all tuners; `None` if the criterion has no value.
    pub fn value_at(&self, row: &Row, tuners: &[f64]) -> Option<f64> {
        let plan = &self.study().jobs[row.job];
        let case = &self.study().cases[plan.case];
        let parameters = self.study().parameters(plan, tuners);
        let request = Job { case, parameters: &parameters, signals: &plan.signals, horizon: plan.horizon };
        let analysis = self.study().analyse(plan.model, &request).ok()?;
        row.value(case, &analysis, &parameters).ok().map(|value| value.number).filter(|number| number.is_finite())
    }

    /// Returns a signal of a job at increasing times, and its derivative with respect to every active tuner, in the
    /// tuner's unit. The derivatives are exact if the model has tangents, else central differences of simulations.
    /// `None` if a simulation fails.
    pub fn signal_slopes(&self, job: usize, tuners: &[f64], signal: &str, times: &[f64]) -> Option<SignalSlopes> {
        let sample = |analysis: &Analysis| Some(analysis.response()?.trace(signal)?.sample(times));
        let plan = &self.study().jobs[job];
        let model = &self.study().models[plan.model].1;
        let along = self.tuner_slopes(tuners);
        let unit = |k: usize| self.study().tuners[self.active()[k]].slope_at(tuners[self.active()[k]]);
        let signals: Vec<usize> = (0..model.interface().signals.len()).collect();
        let parameters = self.study().parameters(plan, tuners);
        let request = Job {
            case: &self.study().cases[plan.case],
            parameters: &parameters,
            signals: &signals,
            horizon: plan.horizon,
        };
        let seeds: Vec<Vec<f64>> = along.iter().map(|along| self.study().parameter_slopes(plan, along)).collect();
        if let Some(Ok((analysis, tangents))) = model.tangents(&request, &seeds) {
            let slopes = tangents
                .iter()
                .enumerate()
                .map(|(k, tangent)| Some(sample(tangent)?.into_iter().map(|slope| slope / unit(k)).collect()));
            return Some((sample(&analysis)?, slopes.collect::<Option<_>>()?));
        }
        let values = sample(&self.analyse_all(job, tuners, None).ok()?)?;
        let slopes = along.iter().enumerate().map(|(k, along)| {
            let moved = |by: f64| -> Option<Vec<f64>> {
                let there: Vec<f64> = tuners.iter().zip(along).map(|(value, slope)| value + by * slope).collect();
                sample(&self.analyse_all(job, &there, None).ok()?)
            };
            let (high, low) = (moved(STEP)?, moved(-STEP)?);
            Some(high.iter().zip(&low).map(|(high, low)| (high - low) / (2.0 * STEP * unit(k))).collect())
        });
        Some((values, slopes.collect::<Option<_>>()?))
    }
}
