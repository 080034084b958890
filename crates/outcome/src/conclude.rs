//! Conclusion of a run: validation data, standard errors, tables.

use std::sync::Arc;

use mops_core::{
    case::{Channel, Role},
    catalogue::SolverChoice,
    evaluation::Evaluation,
    failure::Failure,
    front,
    model::Analysis,
    problem::Problem,
    run::{Budget, Run},
    solver::{Oracle, Pareto, Stop},
    study::Study,
    task::{CalibrationTask, SensitivityTask},
};
use mops_identification::{Local, Point, Whiteness, local, whiteness};
use mops_math as math;

use crate::identification::{SensitivityReport, excitations, report_of, whiteness_words};
use crate::{
    CalibrationReport, ChannelReport, Design, End, ExperimentReport, FailureReport, Findings, Outcome, ParameterReport,
    StartReport, outcome,
};

/// End of a run, as far as the run itself does not record it.
#[derive(Debug, Clone)]
pub struct Ending {
    /// Reason for stopping.
    pub stop: Stop,
    /// What is known of the best point; `None` if nothing was solved.
    pub end: Option<End>,
    /// Pareto optimality of the result.
    pub pareto: Pareto,
    /// Wall-clock time, s.
    pub seconds: f64,
}

/// Concludes a run: estimates the local tuners of selection and validation experiments, and fills in the outcome.
/// Returns the outcome with the evaluation it reports.
///
/// A cancelled run reports the available results. Remaining simulations run until cancellation is insisted on
/// ([`mops_core::Cancellation::insist`]); a warning reports missing parts.
pub fn conclude(run: &Run<'_>, solver: &SolverChoice, ending: Ending) -> (Outcome, Evaluation) {
    let problem = &run.problem().concluding();
    let study = Arc::clone(problem.study());
    let ended_early = run.problem().is_cancelled();
    let first = || run.archive().first().map_or_else(|| problem.unknown(&study.start()), |_| run.evaluation(0).clone());
    let mut best = run.best().cloned().unwrap_or_else(first);
    let start = whole(problem, first(), ended_early);
    let mut simulations = (run.archive().len() + run.linearisations()) * problem.simulations();
    let mut warnings = study.warnings().to_vec();

    // Cases whose local tuners no criterion determines.
    let mut unknown = Vec::new();
    for case in 0..study.cases().len() {
        if study.cases()[case].role() == Role::Calibration || ending.stop == Stop::Interrupted || ended_early {
            continue;
        }
        let part = Problem::of_case(Arc::clone(&study), case, &best.tuners);
        if part.active().is_empty() {
            continue;
        }
        if part.simulations() == 0 {
            warnings.push(unknown_warning(&part, case));
            unknown.push(case);
            continue;
        }
        let mut run = Run::new(&part, Budget { evaluations: 2000 }, &());
        run.solve(solver.make().as_mut(), &part.start());
        if let Some(found) = run.best().filter(|_| !part.is_cancelled()) {
            best.tuners.clone_from(&found.tuners);
        }
        simulations += (run.archive().len() + run.linearisations()) * part.simulations();
    }
    let best = whole(problem, best, ended_early);
    warnings.extend(bound_warnings(&study, problem, &best));

    let calibration = (study.task().is::<CalibrationTask>() || study.cases().iter().any(|c| c.experiment.is_some()))
        .then(|| {
            let point = if ending.stop == Stop::Interrupted { Point::Elsewhere } else { Point::Minimum };
            let local = local(problem, &best.tuners, point, sensitivity_zero(&study));
            let experiments = experiments(problem, &best, &unknown);
            let mut sensitivity = local.as_ref().map(|local| report_of(problem, &best.tuners, local));
            let shows_noise = |found: &&mut SensitivityReport| found.of == "residuals" && point == Point::Minimum;
            if let Some(found) = sensitivity.as_mut().filter(shows_noise) {
                found.words.extend(findings_on_whiteness(&experiments));
            }
            CalibrationReport {
                parameters: standard_errors(problem, &best, local.as_ref()),
                experiments,
                sensitivity,
                excitation: excitations(&study),
            }
        });
    if problem.is_cancelled() {
        warnings.push(
            "the run was cancelled before the result was complete: values, errors or plots are missing".to_owned(),
        );
    }
    let of_job = |job: usize| (&study.models()[study.jobs()[job].model].0, &study.cases()[study.jobs()[job].case].name);
    if best.merit.objective.is_finite() {
        warnings.extend(best.failures.iter().filter(|(_, failure)| *failure != Failure::Cancelled).map(
            |(job, failure)| {
                let (model, case) = of_job(*job);
                format!("a monitored criterion of {model} in {case} has no value: {failure}")
            },
        ));
    }
    let failures = run
        .failures()
        .iter()
        .map(|failed| FailureReport {
            model: of_job(failed.job).0.clone(),
            case: of_job(failed.job).1.clone(),
            failure: failed.first.kind().to_owned(),
            first: failed.first.to_string(),
            count: failed.count,
        })
        .collect();
    let outcome = Outcome {
        format: 2,
        mops: env!("CARGO_PKG_VERSION"),
        study: study.name().to_owned(),
        task: study.task().name(),
        seed: study.seed(),
        solver: solver.kind.to_owned(),
        methods: Vec::new(),
        run: None,
        stop: ending.stop,
        end: ending.end,
        evaluations: run.archive().len(),
        reused: None,
        simulations,
        seconds: ending.seconds,
        feasible: best.merit.is_feasible(),
        worst_scaled: outcome::worst_scaled(&study, &best),
        objective: best.merit.objective,
        violation: best.merit.violation,
        pareto: ending.pareto,
        tuners: outcome::tuners(&study, &best),
        criteria: outcome::criterion_reports(&study, &best),
        start: StartReport::of(&study, &start),
        front: front_points(run, &best),
        calibration,
        found: Findings::default(),
        failures,
        warnings,
    };
    (outcome, best)
}

/// Returns the share of the largest singular value that counts as zero, if the study gives one.
fn sensitivity_zero(study: &Study) -> Option<f64> {
    study.options::<SensitivityTask>().and_then(|task| task.zero)
}

/// Returns the evaluation in every case. A cancelled run keeps the available evaluation if no more can be simulated.
fn whole(problem: &Problem, known: Evaluation, ended_early: bool) -> Evaluation {
    // Without any simulation so far, none will follow.
    if ended_early && (known.readings.iter().all(Option::is_some) || known.readings.iter().all(Option::is_none)) {
        return known;
    }
    let all = problem.evaluate_at(&known.tuners);
    if all.is_cancelled() { known } else { all }
}

/// Maximum number of points of a Pareto front in a result.
const LONGEST_FRONT: usize = 200;

/// Returns the points of the Pareto front in order of the first criterion, thinned evenly if there are many. For a
/// single design, returns the design itself.
fn front_points(run: &Run<'_>, best: &Evaluation) -> Vec<Design> {
    let problem = run.problem();
    let front = run.front();
    let Some(m) = front.first().map(|&i| run.archive()[i].objectives.len()) else {
        return vec![outcome::design(problem, best)];
    };
    let row = |i: usize| run.archive()[i].objectives.as_slice();
    let objectives_of =
        |points: &[usize]| -> Vec<f64> { points.iter().flat_map(|&i| row(i).iter().copied()).collect() };
    let distinct: Vec<usize> = front::distinct(&objectives_of(&front), m).into_iter().map(|i| front[i]).collect();
    let objectives = objectives_of(&distinct);
    let most = if run.shape().points > 0 { run.shape().points + m + 1 } else { LONGEST_FRONT };
    let mut kept: Vec<usize> = front::thinned(&objectives, m, most).into_iter().map(|i| distinct[i]).collect();
    // The reported point is part of the front.
    let reported = run.archive().iter().position(|record| record.tuners == best.tuners);
    kept.extend(reported.filter(|i| front.contains(i) && !kept.contains(i)));
    kept.sort_by(|&a, &b| front::compare(row(a), row(b)));
    kept.into_iter().map(|i| outcome::design(problem, run.evaluation(i))).collect()
}

/// Returns a number with six significant digits, to hide rounding errors.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

fn bound_warnings(study: &Study, problem: &Problem, best: &Evaluation) -> Vec<String> {
    let at_bound = |&i: &usize| {
        let tuner = &study.tuners()[i];
        let side = tuner.at_bound(best.tuners[i])?;
        Some(format!(
            "`{}` is at its {side} bound {}: the optimum may depend on this bound",
            tuner.name,
            tuner.unit.amount(rounded(tuner.bounds[usize::from(side == "upper")]))
        ))
    };
    problem.active().iter().filter_map(at_bound).collect()
}

/// Confidence level of the parameter intervals of a calibration.
const LEVEL: f64 = 0.95;

/// Returns the standard errors of the active tuners, to first order ([`mops_identification::Covariance`]), and their
/// intervals by Student's t. NaN if the data do not determine a tuner.
fn standard_errors(problem: &Problem, best: &Evaluation, local: Option<&Local>) -> Vec<ParameterReport> {
    let study = problem.study();
    let report = |(k, &i): (usize, &usize)| {
        let tuner = &study.tuners()[i];
        let value = best.tuners[i];
        let spread = local.map(|local| local.spread(k));
        let half = spread.map_or(f64::NAN, |spread| spread.half_width(LEVEL));
        ParameterReport {
            name: tuner.name.clone(),
            value,
            std_error: spread.map_or(f64::NAN, |spread| spread.deviation),
            // Values beyond a bound are excluded a priori.
            interval95: [value - half, value + half].map(|end| end.clamp(tuner.bounds[0], tuner.bounds[1])),
            unit: tuner.unit.to_string(),
        }
    };
    problem.active().iter().enumerate().map(report).collect()
}

/// Returns a warning that no criterion of a case determines its local tuners.
fn unknown_warning(part: &Problem, case: usize) -> String {
    let study = part.study();
    let local: Vec<String> = part.active().iter().map(|&i| format!("`{}`", study.tuners()[i].name)).collect();
    format!(
        "no criterion of `{}` determines its local tuners {}: they keep their initial guess, and the errors of `{0}` are not \
         reported; add a criterion to minimise, such as `fit`",
        study.cases()[case].name,
        local.join(", ")
    )
}

/// Returns the fit of every experiment; those in `unknown` have no errors.
fn experiments(problem: &Problem, best: &Evaluation, unknown: &[usize]) -> Vec<ExperimentReport> {
    let study = problem.study();
    let mut reports = Vec::new();
    for (index, case) in study.cases().iter().enumerate() {
        let Some(experiment) = &case.experiment else { continue };
        let mut channels = Vec::new();
        for (job, _) in study.jobs().iter().enumerate().filter(|(_, plan)| plan.case == index) {
            let analysis = problem.analyse_all(job, &best.tuners, None).ok().filter(|_| !unknown.contains(&index));
            let signals = &study.models()[study.jobs()[job].model].1.interface().signals;
            for channel in &experiment.channels {
                if let Some(signal) = signals.iter().find(|s| s.name == channel.signal) {
                    channels.push(channel_report(channel, &signal.unit.to_string(), analysis.as_ref()));
                }
            }
        }
        reports.push(ExperimentReport { name: case.name.clone(), role: experiment.role, channels });
    }
    reports
}

/// Returns the findings on the whiteness of the residuals of the calibration channels, as sentences.
fn findings_on_whiteness(experiments: &[ExperimentReport]) -> Vec<String> {
    let fitted = experiments.iter().filter(|experiment| experiment.role == Role::Calibration);
    let channels = fitted.flat_map(|experiment| experiment.channels.iter().map(move |channel| (experiment, channel)));
    let found: Vec<(&str, &str, Whiteness)> =
        channels.filter_map(|(e, c)| Some((c.name.as_str(), e.name.as_str(), c.whiteness?))).collect();
    whiteness_words(&found)
}

fn channel_report(channel: &Channel, unit: &str, analysis: Option<&Analysis>) -> ChannelReport {
    let simulated = analysis.map(|a| a.trace(&channel.signal).sample(&channel.times));
    let n = channel.values.len();
    #[allow(clippy::cast_precision_loss)]
    let mean = channel.values.iter().sum::<f64>() / n as f64;
    let spread: f64 = channel.values.iter().map(|v| math::powi(v - mean, 2)).sum();
    let residuals: Option<Vec<f64>> = simulated.map(|s| channel.values.iter().zip(&s).map(|(a, b)| a - b).collect());
    let squares = residuals.as_ref().map_or(f64::NAN, |residuals| residuals.iter().map(|e| e * e).sum());
    #[allow(clippy::cast_precision_loss)]
    let rmse = (squares / n as f64).sqrt();
    ChannelReport {
        name: channel.signal.clone(),
        rmse,
        noise: channel.noise,
        fit_percent: 100.0 * (1.0 - (squares / spread).sqrt()),
        unit: unit.to_owned(),
        whiteness: residuals.and_then(|residuals| whiteness(&residuals)),
    }
}
