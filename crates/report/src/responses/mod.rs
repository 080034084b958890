//! Plots of the responses: signals of every simulation at the initial guess and at the reported point, with
//! measurements.

mod active;
mod cases;
mod inputs;
mod linear;
mod live;
mod of_case;
mod of_model;
mod simulated;

use mops_core::{Analysis, AnalysisKind, Failure};
use rayon::prelude::*;

pub use live::live;

use mops_content::{figures::Group, numbers::counted};

use super::Report;
use super::comparison::Comparison;
use simulated::{Simulated, worst};

/// Largest number of simulations with plots; beyond it, those with the largest scaled values are shown.
const MOST_JOBS: usize = 30;

/// Returns the groups of plots, for at most [`MOST_JOBS`] simulations, and a sentence if some are omitted. Each
/// experiment has a group, and each model a group with all cases. With a Pareto front, each case has a group with the
/// responses of the front.
pub(super) fn groups(report: &Report<'_>) -> (Vec<Group>, Option<String>) {
    let study = report.solution.problem.study();
    let all = study.jobs().len();
    let jobs = shown(report);
    let omitted = (jobs.len() < all).then(|| {
        format!("The {MOST_JOBS} of {} with the largest scaled values are shown.", counted(all, "simulation"))
    });
    let analyse = |job: usize, tuners: &[f64]| -> Result<Analysis, Failure> {
        report.solution.problem.analyse_all(job, tuners, None)
    };
    let simulated: Vec<Simulated> = jobs
        .into_par_iter()
        .map(|job| Simulated {
            job,
            both: Comparison {
                start: analyse(job, &study.start()),
                best: analyse(job, &report.solution.best.tuners),
                best_name: report.best_name(),
            },
        })
        .collect();
    // Linear models have no recordings over time and no responses of fronts.
    let alone = |one: &&Simulated| {
        let plan = &study.jobs()[one.job];
        let over_time = study.models()[plan.model].1.interface().analysis != AnalysisKind::Linear;
        over_time && (!report.solution.front.is_empty() || study.cases()[plan.case].experiment.is_some())
    };
    let mut groups: Vec<Group> = simulated.iter().filter(alone).map(|one| of_case::group(report, one)).collect();
    for model in 0..study.models().len() {
        let of_model = |one: &&Simulated| study.jobs()[one.job].model == model && !alone(one);
        let ones: Vec<&Simulated> = simulated.iter().filter(of_model).collect();
        if !ones.is_empty() {
            groups.push(of_model::group(report, model, &ones));
        }
    }
    (groups, omitted)
}

/// Returns the jobs with plots, in the order of the study.
fn shown(report: &Report<'_>) -> Vec<usize> {
    let mut jobs: Vec<usize> = (0..report.solution.problem.study().jobs().len()).collect();
    if jobs.len() > MOST_JOBS {
        let worst = worst(report);
        jobs.sort_by(|&a, &b| worst[b].total_cmp(&worst[a]));
        jobs.truncate(MOST_JOBS);
        jobs.sort_unstable();
    }
    jobs
}
