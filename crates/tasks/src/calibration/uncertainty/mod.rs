//! Uncertainty of calibrated parameters beyond standard errors, `[uncertainty]`: profiles, bootstrap, prediction bands.

mod bands;
mod bootstrap;
mod calibrated;
mod profile;

use mops_core::Watch;
use mops_core::task::CalibrationTask;
use mops_identification::Covariance;
use mops_solvers::levenberg_marquardt::LevenbergMarquardtOptions;

use crate::calibration::UncertaintyReport;

use mops_content::numbers::significant;
use profile::Profiles;

use crate::search::Solved;
use calibrated::Calibrated;

/// Adds the uncertainty analyses that the study requests.
pub(super) fn add(solved: &mut Solved, watch: &dyn Watch) {
    let Some(task) = solved.problem.study().options::<CalibrationTask>().and_then(|task| task.uncertainty.clone())
    else {
        return;
    };
    if watch.wants_stop() {
        return;
    }
    let problem = &solved.problem;
    // N.B.: the residuals of the calibration data alone.
    let best = problem.evaluate(&problem.point_of(&solved.best.tuners));
    let least_squares =
        problem.shape().residuals > 0 && LevenbergMarquardtOptions::default().local().accepts(problem.shape()).is_ok();
    let covariance = Covariance::at(problem, &best.tuners).filter(|_| least_squares && best.scaled.is_some());
    if watch.wants_stop() {
        solved.outcome.stop = watch.halt().into();
        return;
    }
    let Some(covariance) = covariance else {
        let why = "the uncertainty of the estimates cannot be computed: the objective is not a sum of squares, a simulation \
                   failed, or there are too few samples";
        solved.outcome.warnings.push(why.to_owned());
        return;
    };
    let calibrated = Calibrated { problem, best: &best, covariance, level: task.level };
    let mut report = UncertaintyReport {
        words: Vec::new(),
        level: task.level,
        profiles: Vec::new(),
        bootstrap: None,
        bands: Vec::new(),
    };
    let Profiles { profiles, mut simulations, better } = profile::profiles(&calibrated, &task.profile, watch);
    report.profiles = profiles;
    if let Some(better) = better {
        solved.outcome.warnings.push(format!(
            "profiling found a better fit, with objective {} instead of {}: solve again with more starts",
            significant(better, 5),
            significant(best.merit.objective, 5)
        ));
    }
    if task.bootstrap > 0 {
        match bootstrap::bootstrap(&calibrated, &task, watch) {
            Ok((found, cost)) => {
                report.bootstrap = Some(found);
                simulations += cost;
            }
            Err(why) => solved.outcome.warnings.push(why),
        }
    }
    if task.bands {
        report.bands = bands::bands(&calibrated, &solved.best.tuners);
    }
    report.words = words(&report, &calibrated);
    if watch.wants_stop() {
        solved.outcome.stop = watch.halt().into();
    }
    solved.outcome.simulations += simulations;
    solved.outcome.found.add(report);
}

/// Formats the findings as sentences.
fn words(report: &UncertaintyReport, calibrated: &Calibrated<'_>) -> Vec<String> {
    let mut words = Vec::new();
    let percent = format!("{} %", significant(100.0 * report.level, 4));
    let unit = |unit: &str| if unit == "1" { String::new() } else { format!(" {unit}") };
    for found in &report.profiles {
        let [low, high] =
            found.interval.map(|end| if end.is_finite() { significant(end, 5) } else { "an open end".into() });
        let [below, above] = [0, 1].map(|i| (found.interval[i] - found.value).abs());
        let skewed = below.is_finite() && above.is_finite() && (below > 1.2 * above || above > 1.2 * below);
        let remark = match found.ends {
            ["data", "data"] if skewed => ", which is asymmetric: prefer it to the standard error",
            ["data", "data"] => "",
            ends if ends.contains(&"open") => {
                "; an end was not found, because simulations failed or the run was interrupted"
            }
            ["bound", "bound"] => "; both ends are bounds of the tuner, not determined by the data",
            ["bound", _] => "; the lower end is a bound of the tuner, not determined by the data",
            _ => "; the upper end is a bound of the tuner, not determined by the data",
        };
        words.push(format!(
            "`{}`: {percent} profile likelihood interval from {low} to {high}{}{remark}.",
            found.parameter,
            unit(&found.unit)
        ));
    }
    if let Some(found) = &report.bootstrap {
        let failed =
            if found.failed > 0 { format!("; {} could not be estimated", found.failed) } else { String::new() };
        words.push(format!("{} bootstrap replicates{failed}.", found.replicates));
    }
    if calibrated.covariance.left_out > 0 && !report.bands.is_empty() {
        words.push(format!(
            "The bands ignore {} unidentifiable directions of the tuners: predictions far from these data may be worse.",
            calibrated.covariance.left_out
        ));
    }
    words
}
