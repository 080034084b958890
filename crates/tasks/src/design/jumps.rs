//! Look for jumps of the criteria near the design: how near, in what, what comes beyond, and how to design against it.

use super::searched::is_robust;
use std::sync::Arc;

use mops_core::{
    Problem, Run, Stop, Study, Watch,
    run::{Budget, Quiet},
    solver::Pareto,
    study::Tuner,
};

use crate::design::{JUMPS_WITHIN, JumpReport, JumpsReport, MovedKind, ON_JUMP};

use mops_content::numbers::{apart, percent, significant, with_unit};

use crate::search::{Options, Solved};

/// Share of the evaluations of a run that the look for jumps may add: one part of so many.
const SHARE: usize = 20;

/// Distance along a tuner, in the unit box, within which the design counts as beside a jump: that of the tests of
/// optimality.
const BESIDE: f64 = 1e-3;

/// Adds what is known of jumps near the design of a study to its result. A design against worst cases is looked at in
/// the cases of the study: those that were added lie on the edge of the box.
pub(super) fn add(solved: &mut Solved, study: Study, options: &Options, watch: &dyn Watch) {
    let spent = solved.outcome.evaluations;
    let budget = (spent / SHARE).min(options.max_evaluations.saturating_sub(spent));
    let is_cut_off = matches!(solved.outcome.stop, Stop::Interrupted | Stop::TimeLimit);
    if watch.wants_stop() || is_cut_off || solved.best.scaled.is_none() {
        return;
    }
    watch.stage("looking for jumps near the design", 0.0);
    let is_robust = is_robust(&study);
    let problem = Problem::new(Arc::new(study));
    let at = problem.evaluate_at(&solved.best.tuners);
    let quiet = Quiet(watch);
    let mut probe = Run::new(&problem, Budget { evaluations: budget }, &quiet).keeping(options.store(&problem));
    probe.learn(at.clone());
    // The points of earlier rounds were rated without the worst cases of later ones.
    let archive = if is_robust { &[][..] } else { &solved.archive };
    let found = JumpsReport::of(&problem, &mut probe, &at, archive, budget);
    drop(probe);
    let outcome = &mut solved.outcome;
    outcome.evaluations += found.evaluations;
    outcome.simulations += found.evaluations * problem.simulations();
    if let Some(end) = outcome.end.take() {
        let is_beside = found.is_beside(BESIDE);
        let end = if is_beside { end.beside_jump(false) } else { end };
        if is_beside && outcome.pareto == Pareto::CertifiedLocal {
            outcome.pareto = Pareto::NotShown;
        }
        let cliff = found.cliff().map(|jump| sentence(jump, &found, problem.study().tuners()));
        let mut end = cliff.into_iter().fold(end, mops_outcome::End::with_jump);
        end.words.extend(not_looked_at(&found));
        outcome.end = Some(end);
    }
    outcome.found.add(found);
}

/// Returns a sentence on a jump beyond which a demand is missed, with the way out.
fn sentence(jump: &JumpReport, found: &JumpsReport, tuners: &[Tuner]) -> String {
    let (case, criterion) = jump.key.split_once('/').unwrap_or(("", &jump.key));
    let quantity = match jump.kind {
        MovedKind::Tuner => format!("tuner `{}`", jump.name),
        MovedKind::Constant => format!("`{}`", jump.name),
        MovedKind::Initial => format!("initial value `{}`", jump.name),
    };
    let of = match jump.kind {
        MovedKind::Tuner => "of its range ",
        MovedKind::Constant | MovedKind::Initial => "",
    };
    let here = apart(jump.value, Some(jump.beyond), 4);
    let there = apart(jump.beyond, Some(jump.value), 4);
    let unit = if jump.unit == "1" { String::new() } else { format!(" {}", jump.unit) };
    let beyond =
        if jump.there.is_nan() { "has no value".to_owned() } else { format!("is {}", amount(jump.there, jump)) };
    let mut text = format!(
        "Beside a jump: with {quantity} at {there}{unit} instead of {here}{unit} ({}{of}away), `{criterion}` in case `{case}` {beyond} \
         instead of {}, and its demand is missed.",
        if jump.distance <= ON_JUMP { "less than 0.001 % ".to_owned() } else { percent(jump.distance) + " " },
        amount(jump.here, jump),
    );
    if let Some(away) = &found.away {
        let values: Vec<String> =
            away.tuners.iter().map(|(name, value)| format!("`{name}` = {}", significant(*value, 5))).collect();
        text += &format!(
            " Of the evaluated points that meet it 1 % farther as well, the best has the objective {}: {}.",
            significant(away.objective, 4),
            values.join(", ")
        );
    }
    let other = found.found.iter().filter(|of| of.misses && of.key == jump.key && of.name != jump.name);
    let mut others: Vec<String> = Vec::new();
    for name in other.map(|of| format!("`{}`", of.name)) {
        if !others.contains(&name) {
            others.push(name);
        }
    }
    if !others.is_empty() {
        text += &format!(" It jumps along {} as well.", listed(&others));
    }
    let first = if jump.is_fixed {
        format!(
            "declare `{} = {{ unit = \"{}\", default = {} }}` under `parameters` instead of `constants`, ",
            jump.name,
            jump.unit,
            significant(jump.value, 6)
        )
    } else {
        String::new()
    };
    if let Some(line) = line(jump, tuners) {
        text += &format!(" To design against it, {first}add `[robust]` and, under [uncertain], `{line}`.");
    }
    text
}

/// Returns the line of a study that makes a quantity uncertain by 1 %; `None` where no tolerance is a part of the
/// value: near 0, and for a tuner of one case.
fn line(jump: &JumpReport, tuners: &[Tuner]) -> Option<String> {
    if jump.kind == MovedKind::Tuner || jump.is_tuner {
        let tuner = tuners.iter().find(|tuner| tuner.name == jump.name && tuner.case.is_none())?;
        let size = if jump.is_tuner { jump.value.abs() } else { tuner.slope_at(jump.value).abs() };
        let tolerance = JUMPS_WITHIN * size / jump.value.abs();
        return (tolerance < 1.0).then(|| format!("{} = {{ tolerance = {} }}", jump.name, significant(tolerance, 2)));
    }
    let size = (jump.beyond - jump.value).abs() / jump.distance;
    let quantity = |value: f64| {
        let number = significant(value, 6);
        if jump.unit == "1" { number } else { format!("\"{number} {}\"", jump.unit) }
    };
    let [low, high] = [-JUMPS_WITHIN, JUMPS_WITHIN].map(|part| quantity(jump.value + part * size));
    Some(format!("{} = {{ min = {low}, max = {high} }}", jump.name))
}

/// Returns a line on what was not looked at; `None` if all was.
fn not_looked_at(found: &JumpsReport) -> Option<String> {
    let listed = |names: &[String]| {
        let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
        (!names.is_empty()).then(|| listed(&names))
    };
    let beyond_budget = listed(&found.left_out)
        .map(|all| format!("Jumps along {all} were not looked for: the look has a twentieth of the evaluations."));
    let discrete = listed(&found.discrete).map(|all| format!("Not moved, as their values are discrete: {all}."));
    let both: Vec<String> = beyond_budget.into_iter().chain(discrete).collect();
    (!both.is_empty()).then(|| both.join(" "))
}

/// Lists names, at most four of them.
fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] if first.len() < 4 => format!("{} and {last}", first.join(", ")),
        _ => format!("{} and {} others", names[..3].join(", "), names.len() - 3),
    }
}

fn amount(value: f64, jump: &JumpReport) -> String {
    with_unit(value, &jump.criterion_unit)
}
