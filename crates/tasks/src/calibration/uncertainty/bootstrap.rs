//! Moving-block bootstrap of a calibration: residuals are resampled in blocks, and all tuners are estimated again.

use mops_core::{Role, Study, Watch, criterion::Loss, task::UncertaintyTask};
use mops_math as math;
use mops_math::{Stream, stream};
use mops_statistics::{Summary, moving_blocks, quantile};

use crate::calibration::{BootstrapParameter, BootstrapReport};

use mops_solvers::levenberg_marquardt::LevenbergMarquardtOptions;

use super::calibrated::{Calibrated, fixed_at, refit};
use crate::batches::{Stage, each};

/// Measured channel of calibration data.
struct Measured {
    case: usize,
    channel: usize,
    /// Response of the calibrated model.
    fitted: Vec<f64>,
    /// Centred residuals (measured minus fitted), scaled to the noise level of the standard errors. The centre of a
    /// robust loss is its location, about which the scores of the residuals cancel.
    residuals: Vec<f64>,
    /// Length of a block.
    block: usize,
}

/// Returns the estimates of all replicates and the number of simulations. A replicate is `y* = fitted + e*`, where `e*`
/// consists of blocks of the residuals with arbitrary start.
///
/// Residuals of a fitted model are smaller than the noise; they are scaled to the variance used for the standard
/// errors. Consecutive channels of an experiment with equal numbers of samples and equal block lengths use the same
/// blocks, which preserves their correlation.
///
/// Source: H. R. Kuensch, Annals of Statistics 17 (1989) 1217-1241 (moving blocks); B. Efron, R. J. Tibshirani, An
/// Introduction to the Bootstrap (1993), sections 9.4 and 13.3 (residuals, percentile intervals); A. C. Davison, D. V.
/// Hinkley, Bootstrap Methods and their Application (1997), section 6.2 (scaled residuals).
///
/// # Errors
/// If the residuals cannot be resampled; the error is the reason as a sentence.
pub(super) fn bootstrap(
    calibrated: &Calibrated<'_>,
    task: &UncertaintyTask,
    watch: &dyn Watch,
) -> Result<(BootstrapReport, usize), String> {
    let problem = calibrated.problem;
    let study = problem.study();
    let measured = measured(calibrated, task)?;
    let numbers: Vec<usize> = (0..task.bootstrap).collect();
    let stage = Stage { what: "bootstrap replicates", from: 0.0, to: 1.0 };
    let found = each(&numbers, stage, watch, |number| {
        let mut random = stream(study.seed(), &format!("bootstrap {number}"));
        let mut replicate = fixed_at(problem, &calibrated.best.tuners, None);
        resample(&mut replicate, &measured, &mut random);
        refit(replicate, LevenbergMarquardtOptions::default().local(), watch)
    });
    let simulations = found.iter().map(|(_, cost)| cost).sum();
    let estimates: Vec<&Vec<f64>> = found.iter().filter_map(|(found, _)| found.as_ref()).map(|e| &e.tuners).collect();
    if estimates.len() < 2 {
        return Err(
            "the bootstrap has no result: the replicates could not be estimated, or it was interrupted".to_owned()
        );
    }
    let tail = 0.5 * (1.0 - calibrated.level);
    let one = |&index: &usize| {
        let draws: Vec<f64> = estimates.iter().map(|tuners| tuners[index]).collect();
        let mut sorted = draws.clone();
        sorted.sort_by(f64::total_cmp);
        let Summary { mean, deviation, .. } = Summary::of(&draws);
        let (tuner, value) = (&study.tuners()[index], calibrated.best.tuners[index]);
        BootstrapParameter {
            parameter: tuner.name.clone(),
            unit: tuner.unit.to_string(),
            value,
            bias: mean - value,
            std_error: deviation,
            interval: [quantile(&sorted, tail), quantile(&sorted, 1.0 - tail)],
            draws,
        }
    };
    let report = BootstrapReport {
        replicates: estimates.len(),
        failed: found.len() - estimates.len(),
        blocks: measured.iter().map(|m| m.block).collect(),
        parameters: problem.active().iter().map(one).collect(),
    };
    Ok((report, simulations))
}

#[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn measured(calibrated: &Calibrated<'_>, task: &UncertaintyTask) -> Result<Vec<Measured>, String> {
    let problem = calibrated.problem;
    let study = problem.study();
    let mut all = Vec::new();
    for (job, plan) in study.jobs().iter().enumerate() {
        let case = &study.cases()[plan.case];
        let Some(experiment) = case.experiment.as_ref().filter(|e| e.role == Role::Calibration) else { continue };
        if !experiment.responses.is_empty() {
            return Err(format!(
                "no bootstrap: `{}` is a frequency response, whose residuals cannot be resampled in blocks",
                case.name
            ));
        }
        let Ok(analysis) = problem.analyse_all(job, &calibrated.best.tuners, None) else { continue };
        for (index, channel) in experiment.channels.iter().enumerate() {
            let of_channel = |m: &Measured| m.case == plan.case && m.channel == index;
            let trace = analysis.response().and_then(|response| response.trace(&channel.signal));
            let Some(trace) = trace.filter(|_| !all.iter().any(of_channel)) else { continue };
            let fitted = trace.sample(&channel.times);
            let raw: Vec<f64> = channel.values.iter().zip(&fitted).map(|(y, f)| y - f).collect();
            let noise = calibrated.covariance.noise();
            let (loss, unit) = noise.loss_of_channel(plan.case, &channel.signal).unwrap_or((Loss::Squares, 1.0));
            let deviations: Vec<f64> = raw.iter().map(|e| e / unit).collect();
            let centre = loss.location(&deviations);
            let scale =
                scale(&deviations, centre, loss, noise.of_channel(plan.case, &channel.signal).map(|s| s / unit));
            let usual = math::cbrt(raw.len() as f64).ceil() as usize;
            let block = task.block.unwrap_or(usual).clamp(1, raw.len());
            let residuals = deviations.into_iter().map(|e| scale * unit * (e - centre)).collect();
            all.push(Measured { case: plan.case, channel: index, fitted, residuals, block });
        }
    }
    Ok(all)
}

/// Returns the factor that scales centred residuals to the standard deviation of the noise; 1 if the noise is unknown.
/// With a robust loss it is that of `psi / mean psi'`, as in the covariance of the estimates.
#[allow(clippy::cast_precision_loss)]
fn scale(residuals: &[f64], centre: f64, loss: Loss, noise: Option<f64>) -> f64 {
    let (mut squares, mut change) = (0.0, 0.0);
    for [score, slope] in residuals.iter().map(|e| loss.score(e - centre)) {
        (squares, change) = (squares + score * score, change + slope);
    }
    let size = (squares * residuals.len() as f64).sqrt() / change;
    noise.filter(|noise| noise.is_finite() && size > 0.0).map_or(1.0, |noise| noise / size)
}

/// Replaces the measurements of the experiments by fitted values plus resampled residuals.
fn resample(study: &mut Study, measured: &[Measured], random: &mut Stream) {
    let mut order: Vec<usize> = Vec::new();
    let mut before: Option<(usize, usize, usize)> = None;
    for of in measured {
        let n = of.residuals.len();
        let drawn = (of.case, n, of.block);
        if before != Some(drawn) {
            order = moving_blocks(n, of.block, random);
            before = Some(drawn);
        }
        let errors = order.iter().map(|&i| of.residuals[i]);
        let values = of.fitted.iter().zip(errors).map(|(fitted, error)| fitted + error).collect();
        study.set_samples(of.case, of.channel, values);
    }
}
