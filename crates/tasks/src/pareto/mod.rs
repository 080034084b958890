//! `task = "pareto"`: Pareto front of a design.

mod section;
mod trade_offs;

use mops_content::section::{Block, Section, Tone, Verdict};
use mops_core::task::ParetoTask;
use mops_file::edit::settled;
use mops_outcome::BlockKind;
use std::sync::Arc;
use std::time::Instant;

use mops_core::{
    Problem, Run, Stop, Study, Watch,
    run::{Budget, Quiet},
    solver::Pareto,
};
use mops_math as math;
use mops_outcome::{Design, End, Outcome};
use mops_solvers::{Certificate, certificate, optimality};

use crate::DerivativesReport;

pub use trade_offs::{Certified, Exchange, FrontCriterion, FrontPoint, TradeOffs};

use mops_content::numbers::{counted, significant};

use crate::room::{CommandOption, Judgement, Origin, OutputFile, OutputNames, Room, Solution, TaskCommand};
use crate::search::{Extras, Limits, Options, SolveError, Solved, contradiction, linearised, search_within};

/// Explanation and examples of the command.
const HELP: &str = "\
Each criterion with usage minimise is an objective, with the value of its worst case, which has the largest weighted scaled \
value (with --per-case: an objective in every case). The result is the Pareto front: 30 evenly spread non-dominated designs, \
each the solution of an optimisation problem (default solver: weighted-chebyshev).

result.json lists the points as `front`, sorted by the first criterion, and `trade_offs`: the knee, the point nearest to the \
demands, the exchange rates between criteria, and whether each point is certified as Pareto-optimal. report.html plots them; \
select a point with the pointer or the arrow keys.

Examples:
  mops pareto pid-design                      Pareto front of overshoot and settling time
  mops pareto pid-design --points 60          with more points
  mops pick results/pid-design --demand settling=12
                                              afterwards: the point for other demands";

/// `task = "pareto"`.
pub struct Front;

impl Room for Front {
    fn title(&self) -> &'static str {
        "Pareto front"
    }

    fn perform(&self, study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
        perform(study, options, watch)
    }

    fn command(&self) -> Option<TaskCommand> {
        Some(TaskCommand {
            name: "pareto",
            about: "Compute the Pareto front (the non-dominated designs) of a design study",
            after_help: HELP,
            has_solver: true,
            options: &[
                CommandOption {
                    name: "points",
                    value: Some("POINTS"),
                    about: "Number of points [default: [pareto] of the study, or 30]",
                    key: "pareto.points",
                },
                CommandOption {
                    name: "per-case",
                    value: None,
                    about: "Count every criterion as an objective in every case, instead of in its worst case",
                    key: "pareto.per-case",
                },
            ],
        })
    }

    fn blocks(&self) -> Vec<BlockKind> {
        vec![BlockKind::of::<TradeOffs>()]
    }

    fn verdict(&self, of: &Solution<'_>) -> Judgement {
        let found = of.outcome.found.get::<TradeOffs>();
        let Some((found, words)) = found.and_then(|found| Some((found, found.words.first()?))) else {
            return Judgement::OfPoint(Verdict::new(Tone::Bad, "No Pareto front found."));
        };
        let doubts = found.points.iter().enumerate();
        let doubts = doubts.filter_map(|(i, point)| Some(format!("Point {}: {} ", i + 1, point.doubt.as_ref()?)));
        let doubts: String = doubts.collect();
        let is_cut_off = matches!(of.outcome.stop, Stop::Budget | Stop::TimeLimit | Stop::Interrupted);
        let tone = if is_cut_off || !doubts.is_empty() { Tone::Mixed } else { Tone::Good };
        Judgement::OfPoint(Verdict::new(tone, doubts + words))
    }

    fn findings(&self, of: &Solution<'_>) -> Vec<Section> {
        of.outcome.found.get::<TradeOffs>().map(|found| section::of(of, found)).into_iter().collect()
    }

    fn lines(&self, outcome: &Outcome) -> Vec<Block> {
        outcome.found.get::<TradeOffs>().map_or_else(Vec::new, |found| section::lines(outcome, found))
    }

    fn has_convergence(&self, _of: &Solution<'_>) -> bool {
        true
    }

    fn outputs(&self) -> OutputNames {
        OutputNames { files: &["study.toml"], folders: &[] }
    }

    /// The study with its settings, for `mops pick`.
    fn files(&self, _of: &Solution<'_>, origin: &Origin<'_>) -> Vec<OutputFile> {
        let Some(text) = origin.text else { return Vec::new() };
        let text = settled(text, origin.settings, origin.locate).into_text();
        let mut files = origin.data();
        files.push(OutputFile::new("study.toml", text));
        files
    }

    fn written_study(&self) -> Option<&'static str> {
        Some("study.toml")
    }
}

fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    let started = Instant::now();
    // The rest of the budget is for the certificates.
    let searched = options.max_evaluations - options.max_evaluations / CERTIFICATES;
    // Half of it is for the checks of the nearest point, the other half for those of every point.
    let all = searched + (options.max_evaluations - searched) / 2;
    let limits = Limits { planned: searched, searched, all };
    let mut solved = search_within(limits, Extras::default(), study, options, watch)?;
    let problem = &solved.problem;
    // The points of the certificates are not part of the observed search.
    let quiet = Quiet(watch);
    let before = solved.outcome.evaluations;
    let left = options.max_evaluations.saturating_sub(before);
    let mut run = Run::new(problem, Budget { evaluations: left }, &quiet);
    let concluding = problem.concluding();
    let certified = |point: &Design| {
        let at = concluding.evaluate_at(&tuners(problem, point));
        if watch.wants_stop() {
            return Certified { at, pareto: Pareto::NotShown, weights: None, is_beside_jump: false, doubt: None };
        }
        let Certificate { pareto, weights, is_beside_jump } = certificate(&mut run, &at.point);
        Certified { at, pareto, weights, is_beside_jump, doubt: None }
    };
    let mut front: Vec<Certified> =
        if solved.outcome.feasible { solved.outcome.front.iter().map(certified).collect() } else { Vec::new() };
    solved.outcome.evaluations += run.archive().len();
    solved.outcome.simulations += (run.archive().len() + run.linearisations()) * problem.simulations();
    drop(run);
    let left = left.saturating_sub(solved.outcome.evaluations - before);
    let spent = doubt_ends(problem, &mut front, left, watch);
    solved.outcome.evaluations += spent;
    solved.outcome.simulations += spent * problem.simulations();
    if front.iter().any(|point| point.at.is_cancelled()) {
        return Ok(solved);
    }
    if let Some(mut found) = TradeOffs::of(problem, &front) {
        // Of equally near points, the reported one.
        let worst = found.points[found.nearest].worst_scaled;
        let is_reported =
            |&i: &usize| front[i].at.tuners == solved.best.tuners && found.points[i].worst_scaled <= worst;
        found.nearest = (0..front.len()).find(is_reported).unwrap_or(found.nearest);
        found.words = words(problem, &front, &found, solved.outcome.stop);
        solved.outcome.pareto = found.points[found.nearest].pareto;
        solved.outcome.warnings.extend(missing_points(problem, &solved.outcome, front.len()));
        solved.outcome.found.add(found);
    }
    solved.front = front.into_iter().map(|point| point.at).collect();
    solved.outcome.seconds = started.elapsed().as_secs_f64();
    Ok(solved)
}

/// Notes the reasons to doubt the ends of a front as the optima of their criteria: each is examined as the result of a
/// search for the minimum of its criterion alone. Returns the number of evaluated points, at most `budget`.
fn doubt_ends(problem: &Problem, front: &mut [Certified], budget: usize, watch: &dyn Watch) -> usize {
    let quiet = Quiet(watch);
    let shape = problem.shape();
    let mut spent = 0;
    for (k, objective) in problem.objectives().iter().enumerate() {
        let value =
            |point: &Certified| point.at.scaled.as_ref().map_or(f64::INFINITY, |scaled| shape.objectives(scaled)[k]);
        let end = (0..front.len()).min_by(|&a, &b| value(&front[a]).total_cmp(&value(&front[b])));
        let Some(end) = end.filter(|_| !watch.wants_stop()) else { return spent };
        let alone = Problem::new(Arc::new(problem.study().minimising(&objective.rows)));
        let at = alone.concluding().evaluate_at(&front[end].at.tuners);
        let mut probe = Run::new(&alone, Budget { evaluations: budget.saturating_sub(spent) }, &quiet);
        probe.learn(at.clone());
        let point = optimality(&mut probe, &at.point);
        let near = linearised(&at, &mut probe, watch).filter(|(_, is_exact)| *is_exact);
        let derivatives = near.map(|(found, _)| DerivativesReport::of(&alone, &mut probe, &found));
        let end_of_search = End::new(point, at.merit, &[], Stop::Converged, false);
        let contradicted = derivatives.as_ref().and_then(contradiction);
        let doubt = contradicted.into_iter().fold(end_of_search, End::with_contradiction).doubt;
        spent += probe.archive().len();
        front[end].doubt = doubt.or(front[end].doubt.take());
    }
    spent
}

/// Share of the budget kept for the certificates of the points: one part of so many.
const CERTIFICATES: usize = 5;

/// Returns why the front has fewer points than the study asks for; `None` if it has as many.
fn missing_points(problem: &Problem, outcome: &Outcome, found: usize) -> Option<String> {
    let asked = problem.study().options::<ParetoTask>().copied().unwrap_or_default().points;
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
    let value = |tuner: &mops_core::study::Tuner| point.tuners[&tuner.name].as_f64().expect("every tuner has a value");
    problem.study().tuners().iter().map(value).collect()
}

/// Formats the Pareto front as sentences.
fn words(problem: &Problem, front: &[Certified], found: &TradeOffs, stop: Stop) -> Vec<String> {
    let ends = found.criteria.iter().enumerate().map(|(k, criterion)| {
        let [best, worst] = [criterion.best, criterion.worst].map(|value| amount(value, &criterion.unit));
        match criterion.worst.is_finite() {
            true => format!("{} from {best} to {worst}", name(found, k)),
            false => format!("{} from {best} on, and without a value at some points", name(found, k)),
        }
    });
    let mut words = vec![format!(
        "The Pareto front has {}: {}.{}",
        counted(front.len(), "point"),
        ends.collect::<Vec<_>>().join(", "),
        match stop {
            Stop::Budget => " The search was cut off by the budget: other points may dominate these.",
            Stop::TimeLimit => " The search was cut off by the time limit: other points may dominate these.",
            Stop::Interrupted => " The search was interrupted: other points may dominate these.",
            Stop::Converged | Stop::Stalled => "",
        }
    )];
    let place = |i: usize| {
        let at = &front[i].at;
        let of_study = problem.study();
        let tuner = |(tuner, value): (&mops_core::study::Tuner, &f64)| {
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
    let at_jumps = found.points.iter().filter(|point| point.is_beside_jump).count();
    let why =
        if at_jumps > 0 { format!(", {at_jumps} of them as a criterion jumps beside them") } else { String::new() };
    if of(Pareto::NotShown) == found.points.len() {
        let points = counted(found.points.len(), "point");
        words.push(format!("At none of the {points} the first-order Pareto conditions could be checked{why}."));
        return words;
    }
    words.push(format!(
        "{} of {} points satisfy the first-order Pareto conditions; {} could not be checked{why}; at {} a step of a thousandth of the \
         box improves one criterion by more than 0.005 % and worsens no other.",
        of(Pareto::CertifiedLocal),
        found.points.len(),
        of(Pareto::NotShown),
        of(Pareto::No)
    ));
    words
}

/// Formats the exchange rate at a point: the cost, in the second criterion, of a round step of the first one that is
/// small relative to its range over the front.
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
