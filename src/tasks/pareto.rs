//! `task = "pareto"`: Pareto front of a design.

use std::time::Instant;

use mops_core::math;
use mops_core::{
    Budget, Certified, Design, FrontPoint, Outcome, Pareto, Problem, Quiet, Run, Stop, Study, TradeOffs, Watch,
};
use mops_solvers::certificate;

use crate::numbers::significant;
use crate::search::{Options, SolveError, Solved, search};

pub(super) fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    let started = Instant::now();
    // The rest of the budget is for the certificates.
    let searched = options.max_evaluations - options.max_evaluations / CERTIFICATES;
    let mut solved = search(study, &Options { max_evaluations: searched, ..options.clone() }, watch)?;
    let problem = &solved.problem;
    // The points of the certificates are not part of the observed search.
    let quiet = Quiet(watch);
    let left = options.max_evaluations.saturating_sub(solved.outcome.evaluations);
    let mut run = Run::new(problem, Budget { evaluations: left }, &quiet);
    let concluding = problem.concluding();
    let certified = |point: &Design| {
        let at = concluding.evaluate_at(&tuners(problem, point));
        let (pareto, weights) = match watch.wants_stop() {
            true => (Pareto::NotShown, None),
            false => {
                let shown = certificate(&mut run, &at.point);
                (shown.pareto, shown.weights)
            }
        };
        Certified { at, pareto, weights }
    };
    let front: Vec<Certified> =
        if solved.outcome.feasible { solved.outcome.front.iter().map(certified).collect() } else { Vec::new() };
    solved.outcome.evaluations += run.archive().len();
    solved.outcome.simulations += (run.archive().len() + run.linearisations()) * problem.simulations();
    drop(run);
    if front.iter().any(|point| point.at.is_cancelled()) {
        return Ok(solved);
    }
    if let Some(mut found) = TradeOffs::of(problem, &front) {
        // Of equally near points, the reported one.
        let worst = found.points[found.nearest].worst_scaled;
        let is_reported =
            |&i: &usize| front[i].at.tuners == solved.best.tuners && found.points[i].worst_scaled <= worst;
        found.nearest = (0..front.len()).find(is_reported).unwrap_or(found.nearest);
        found.words = words(problem, &front, &found);
        solved.outcome.pareto = found.points[found.nearest].pareto;
        solved.outcome.warnings.extend(missing_points(problem, &solved.outcome, front.len()));
        solved.outcome.found.trade_offs = Some(found);
    }
    solved.front = front.into_iter().map(|point| point.at).collect();
    solved.outcome.seconds = started.elapsed().as_secs_f64();
    Ok(solved)
}

/// Share of the budget kept for the certificates of the points: one part of so many.
const CERTIFICATES: usize = 5;

/// Returns why the front has fewer points than the study asks for; `None` if it has as many.
fn missing_points(problem: &Problem, outcome: &Outcome, found: usize) -> Option<String> {
    let asked = problem.study().tasks().pareto.points;
    let why = match outcome.stop {
        _ if found >= asked => return None,
        Stop::Budget => "the budget was spent before; raise --max-evaluations",
        Stop::TimeLimit => "the time limit was reached before; raise --time-limit, or continue the run (--resume)",
        Stop::Interrupted => "the search was interrupted; continue it (--resume)",
        Stop::Converged | Stop::Stalled => {
            "every further search ended at one of these points, or in a gap of the front"
        }
    };
    Some(format!("{asked} points were asked for, the front has {found}: {why}"))
}

/// Returns the values of all tuners of a point in the result.
fn tuners(problem: &Problem, point: &Design) -> Vec<f64> {
    let value = |tuner: &mops_core::Tuner| point.tuners[&tuner.name].as_f64().expect("every tuner has a value");
    problem.study().tuners().iter().map(value).collect()
}

/// Formats the Pareto front as sentences.
fn words(problem: &Problem, front: &[Certified], found: &TradeOffs) -> Vec<String> {
    let ends = found.criteria.iter().enumerate().map(|(k, criterion)| {
        let [best, worst] = [criterion.best, criterion.worst].map(|value| amount(value, &criterion.unit));
        format!("{} from {best} to {worst}", name(found, k))
    });
    let mut words = vec![format!(
        "The Pareto front has {} points: {}. No point of the front dominates another.",
        front.len(),
        ends.collect::<Vec<_>>().join(", ")
    )];
    let place = |i: usize| {
        let at = &front[i].at;
        let of_study = problem.study();
        let tuner = |(tuner, value): (&mops_core::Tuner, &f64)| {
            format!("`{}` = {}", tuner.name, amount(*value, &tuner.unit.to_string()))
        };
        let active = of_study.tuners().iter().zip(&at.tuners).filter(|(tuner, _)| tuner.active);
        active.map(tuner).collect::<Vec<_>>().join(", ")
    };
    let objectives = problem.objectives();
    let value = |i: usize, k: usize| {
        objectives[k].worst(problem.study(), &front[i].at).map_or(f64::NAN, |(_, reading)| reading.value)
    };
    let values = |i: usize| {
        let criteria = found.criteria.iter().enumerate();
        let values = criteria.map(|(k, c)| format!("{} {}", name(found, k), amount(value(i, k), &c.unit)));
        values.collect::<Vec<_>>().join(", ")
    };
    let nearest = found.nearest;
    words.push(format!(
        "Point {} is nearest to the demands: {}, at {}; worst scaled value {}.{}",
        nearest + 1,
        values(nearest),
        place(nearest),
        significant(found.points[nearest].worst_scaled, 4),
        price(found, nearest)
    ));
    match found.knee {
        Some(knee) if knee == nearest => words.push(format!("Point {} is also the knee of the front.", knee + 1)),
        Some(knee) => words.push(format!(
            "Point {} is the knee of the front (beyond it, improving one criterion costs much of the other): {}, at {}.{}",
            knee + 1,
            values(knee),
            place(knee),
            price(found, knee)
        )),
        None => words.push("The front is concave and has no knee.".to_owned()),
    }
    let of = |pareto: Pareto| found.points.iter().filter(|point: &&FrontPoint| point.pareto == pareto).count();
    words.push(format!(
        "{} of {} points satisfy the first-order Pareto conditions; {} could not be checked; {} have a known improving \
         direction.",
        of(Pareto::CertifiedLocal),
        found.points.len(),
        of(Pareto::NotShown),
        of(Pareto::No)
    ));
    words
}

/// Formats the exchange rate at a point: the cost, in the second criterion, of a round step of the first one that is small
/// relative to its range over the front.
fn price(found: &TradeOffs, i: usize) -> String {
    let (Some(weights), [first, second]) = (&found.points[i].weights, found.criteria.as_slice()) else {
        return String::new();
    };
    let step = math::powf(10.0, math::log10(0.2 * (first.worst - first.best).abs()).floor());
    if !step.is_normal() {
        return String::new();
    }
    let cost = step * (weights[0] / weights[1]).abs();
    format!(
        " Exchange rate: improving {} by {} costs {} of {}.",
        name(found, 0),
        amount(step, &first.unit),
        amount(cost, &second.unit),
        name(found, 1)
    )
}

fn name(found: &TradeOffs, k: usize) -> String {
    format!("`{}`", found.criteria[k].key)
}

fn amount(value: f64, unit: &str) -> String {
    if !value.is_finite() {
        return "not reached".to_owned();
    }
    let number = significant(value, 4);
    if unit == "1" { number } else { format!("{number} {unit}") }
}
