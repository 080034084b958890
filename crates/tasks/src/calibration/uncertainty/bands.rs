//! Linearised prediction bands of a calibrated model.

use mops_identification::noise::Spread;
use mops_math as math;

use crate::calibration::BandReport;

use super::calibrated::Calibrated;

/// Largest number of times of a band.
const MOST_TIMES: usize = 400;

/// Returns the prediction band of every measured channel: `t` times the standard deviation `(g' C g)^(1/2)` of the
/// prediction. `g` is the gradient of the prediction with respect to the tuners, `C` their covariance, `t` the quantile
/// of the t distribution.
///
/// The band of a new measurement also includes the noise. Initial states estimated on validation data count as known
/// there.
///
/// Source: G. A. F. Seber, C. J. Wild, Nonlinear Regression (1989), section 5.1 (linearised prediction intervals).
pub(super) fn bands(calibrated: &Calibrated<'_>, tuners: &[f64]) -> Vec<BandReport> {
    let problem = calibrated.problem;
    let study = problem.study();
    let mut bands = Vec::new();
    for (job, plan) in study.jobs().iter().enumerate() {
        let case = &study.cases()[plan.case];
        let signals = &study.models()[plan.model].1.interface().signals;
        for channel in case.experiment.iter().flat_map(|experiment| &experiment.channels) {
            let Some(signal) = signals.iter().find(|s| s.name == channel.signal) else { continue };
            let every = channel.times.len().div_ceil(MOST_TIMES);
            let last = channel.times.len() - 1;
            let kept: Vec<usize> = (0..=last).filter(|i| i % every == 0 || *i == last).collect();
            let times: Vec<f64> = kept.iter().map(|&i| channel.times[i]).collect();
            let Some((value, slopes)) = problem.signal_slopes(job, tuners, &channel.signal, &times) else { continue };
            let Ok(analysis) = problem.analyse_all(job, tuners, None) else { continue };
            let fitted = analysis.trace(&channel.signal).sample(&channel.times);
            let noise = channel.noise.unwrap_or_else(|| rms(&channel.values, &fitted));
            let spread = |i: usize| {
                let slopes: Vec<f64> = slopes.iter().map(|along| along[i]).collect();
                calibrated.covariance.spread(&slopes)
            };
            let spreads: Vec<Spread> = (0..times.len()).map(spread).collect();
            let measured = |spread: &Spread| Spread { deviation: math::hypot(spread.deviation, noise), ..*spread };
            bands.push(BandReport {
                experiment: case.name.clone(),
                channel: channel.signal.clone(),
                unit: signal.unit.to_string(),
                times,
                value,
                response: spreads.iter().map(|spread| spread.half_width(calibrated.level)).collect(),
                measurement: spreads.iter().map(|spread| measured(spread).half_width(calibrated.level)).collect(),
            });
        }
    }
    bands
}

#[allow(clippy::cast_precision_loss)]
fn rms(measured: &[f64], fitted: &[f64]) -> f64 {
    (measured.iter().zip(fitted).map(|(y, f)| math::powi(y - f, 2)).sum::<f64>() / measured.len() as f64).sqrt()
}
