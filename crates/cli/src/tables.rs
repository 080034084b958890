//! Tables of criteria and tuners on the terminal, and the summary of a run.

use mops_content::numbers::counted;
use mops_core::{Stop, Usage};
use mops_outcome::{CriterionReport, Outcome};
use mops_tasks::Room;

use crate::terminal::{number, table};

/// Formats the criteria at the start values and at another point, side by side.
pub(super) fn criteria(start: &[CriterionReport], best: &[CriterionReport], best_name: &str) -> String {
    criteria_without(&[], start, best, best_name)
}

/// Formats the criteria as [`criteria`], without some columns.
fn criteria_without(
    left_out: &[usize],
    start: &[CriterionReport],
    best: &[CriterionReport],
    best_name: &str,
) -> String {
    let usage = |usage| match usage {
        Usage::Minimise => "minimise",
        Usage::Inequality => "inequality",
        Usage::Equality => "equality",
        Usage::Monitor => "monitor",
    };
    let rows = start.iter().zip(best).map(|(start, best)| {
        let demand = match (best.demand, best.good, best.bad) {
            (Some(demand), ..) if best.at_least => format!("at least {}", number(demand)),
            (Some(demand), ..) => number(demand),
            (None, Some(good), Some(bad)) => format!("{} .. {}", number(good), number(bad)),
            _ => String::new(),
        };
        let met = if best.usage == Usage::Monitor { "" } else { met_text(best) };
        let scaled =
            |report: &CriterionReport| if best.usage == Usage::Monitor { String::new() } else { number(report.scaled) };
        vec![
            best.case.clone(),
            best.name.clone(),
            usage(best.usage).to_owned(),
            demand,
            value_text(start),
            value_text(best),
            best.unit.clone(),
            scaled(start),
            scaled(best),
            met.to_owned(),
            best.note.unwrap_or_default().to_owned(),
        ]
    });
    let header =
        ["case", "criterion", "usage", "demand", "start", best_name, "unit", "scaled start", "scaled", "met", ""];
    match left_out {
        [] => table(&header, &[3, 4, 5, 7, 8], rows.collect()),
        left_out => without(left_out, &header, rows.collect()),
    }
}

/// Returns whether the demand is met, in a word; empty without a demand.
pub(super) fn met_text(criterion: &CriterionReport) -> &'static str {
    match criterion.met {
        Some(true) => "yes",
        Some(false) => "no",
        None => "",
    }
}

/// Formats the value of a criterion, with enough digits to distinguish it from a demand that it misses.
fn value_text(criterion: &CriterionReport) -> String {
    let limit = criterion.demand.or(criterion.bad).filter(|_| criterion.met == Some(false));
    mops_content::numbers::apart(criterion.value, limit, 6)
}

/// Formats a table without some of its columns. Columns that contain only numbers are aligned to the right.
fn without(left_out: &[usize], header: &[&str], mut rows: Vec<Vec<String>>) -> String {
    let kept: Vec<usize> = (0..header.len()).filter(|column| !left_out.contains(column)).collect();
    let header: Vec<&str> = kept.iter().map(|&column| header[column]).collect();
    for row in &mut rows {
        *row = kept.iter().map(|&column| std::mem::take(&mut row[column])).collect();
    }
    let is_number = |text: &String| text.is_empty() || text.parse::<f64>().is_ok();
    let numeric: Vec<usize> =
        (0..header.len()).filter(|&column| rows.iter().all(|row| is_number(&row[column]))).collect();
    table(&header, &numeric, rows)
}

/// Formats the outcome of a run, `is_nominal` if what follows is at other values of uncertain parameters: criteria,
/// tuners, calibration errors, failures, warnings and a summary.
pub(super) fn outcome(outcome: &Outcome, room: &dyn Room, is_nominal: bool) -> String {
    let solved = outcome.solver != "none";
    let best_name = if solved { "optimum" } else { "start" };
    let summed = !room.judges_demands();
    let mut text = String::new();
    if let Some(doubt) = outcome.end.as_ref().and_then(|end| end.doubt.as_ref()) {
        text += &format!("\n{doubt}\n");
    }
    if summed {
        let [now, start] = [outcome.objective, outcome.start.objective].map(number);
        text += &format!("\nobjective (sum of scaled values): {now} (start {start})\n");
    }
    // Without a solver there is only one point; a sum has no demand.
    let left_out: &[usize] = match (solved, summed) {
        (false, _) => &[4, 7],
        (true, true) => &[9],
        (true, false) => &[],
    };
    let table_of_criteria = criteria_without(left_out, &outcome.start.criteria, &outcome.criteria, best_name);
    text += &format!("\n{table_of_criteria}");
    let tuners = outcome.tuners.iter().map(|t| {
        let bound = t.at_bound.map_or_else(String::new, |side| format!("at its {side} bound"));
        let [low, high] = t.bounds.map(number);
        let parameters = outcome.calibration.iter().flat_map(|c| &c.parameters);
        let error =
            parameters.filter(|p| p.name == t.name && p.std_error.is_finite()).map(|p| number(p.std_error)).next();
        vec![
            t.name.clone(),
            number(t.start),
            number(t.value),
            error.unwrap_or_default(),
            t.unit.clone(),
            low,
            high,
            bound,
        ]
    });
    let error = if outcome.calibration.is_some() { "std. error" } else { "" };
    let header = ["tuner", "start", best_name, error, "unit", "min", "max", ""];
    text += "\n";
    text += &if solved {
        table(&header, &[1, 2, 3, 5, 6], tuners.collect())
    } else {
        without(&[1], &header, tuners.collect())
    };
    if let Some(calibration) = &outcome.calibration {
        let channels = calibration.experiments.iter().flat_map(|e| e.channels.iter().map(move |c| (e, c)));
        let rows = channels.map(|(e, c)| {
            let role = format!("{:?}", e.role).to_lowercase();
            let noise = c.noise.map_or_else(String::new, number);
            vec![
                e.name.clone(),
                role,
                c.name.clone(),
                number(c.rmse),
                noise,
                c.unit.clone(),
                format!("{:.2}", c.fit_percent),
            ]
        });
        let header = ["experiment", "role", "channel", "rmse", "noise", "unit", "fit %"];
        text += &format!("\n{}", table(&header, &[3, 4, 6], rows.collect()));
    }
    for failure in &outcome.failures {
        text += &format!(
            "\nmodel {} in case {}: {}, {}; first: {}",
            failure.model,
            failure.case,
            failure.failure,
            counted(failure.count, "time"),
            failure.first
        );
    }
    for warning in &outcome.warnings {
        text += &format!("\nwarning: {warning}");
    }
    if let Some(end) = outcome.end.as_ref().filter(|end| !end.words.is_empty()) {
        text += &format!("\n{}", end.words.join(" "));
    }
    let stop = match outcome.stop {
        Stop::Converged => "converged",
        Stop::Budget => "stopped at the budget",
        Stop::TimeLimit => "stopped at the time limit",
        Stop::Stalled => "stalled",
        Stop::Interrupted => "interrupted",
    };
    let counts = |usage: &[Usage], missed: bool| {
        outcome.criteria.iter().filter(|c| usage.contains(&c.usage) && (!missed || c.met == Some(false))).count()
    };
    let constraints = match (outcome.feasible, counts(&[Usage::Inequality, Usage::Equality], false)) {
        (true, 0) => String::new(),
        (true, _) => "constraints satisfied; ".to_owned(),
        (false, _) if outcome.violation.is_finite() => {
            format!("constraint violated by {} of its demand; ", number(outcome.violation))
        }
        _ => "no point has a value; ".to_owned(),
    };
    let demands = match (summed, counts(&[Usage::Minimise], true)) {
        (true, _) => String::new(),
        _ if counts(&[Usage::Minimise], false) == 0 => "nothing to minimise; ".to_owned(),
        (_, 0) if outcome.feasible => "all demands met; ".to_owned(),
        (_, 0) => "all other demands met; ".to_owned(),
        (_, 1) => "1 demand missed; ".to_owned(),
        (_, n) => format!("{n} demands missed; "),
    };
    let reached = match summed {
        _ if counts(&[Usage::Minimise], false) == 0 => String::new(),
        true => {
            format!("objective {} (start {}); ", number(outcome.objective), number(outcome.start.objective))
        }
        _ if !solved => format!("worst scaled value {}; ", number(outcome.worst_scaled)),
        _ => {
            let [now, start] = [outcome.worst_scaled, outcome.start.worst_scaled].map(number);
            format!("worst scaled value {now} (start {start}); ")
        }
    };
    // The effect of uncertain parameters follows below.
    let nominal = if is_nominal { "without uncertainty: " } else { "" };
    let stop = if solved { stop } else { "start values only, no optimisation" };
    text += &format!(
        "\n{nominal}{constraints}{demands}{reached}{stop}; {}, {}, {:.2} s\n",
        counted(outcome.evaluations, "evaluation"),
        counted(outcome.simulations, "simulation"),
        outcome.seconds
    );
    text
}
