//! `task = "sweep"`: objective over one or two tuners.

use mops_core::{
    Merit, Oracle, Problem, Run, Study, Watch,
    run::Budget,
    study::{Axis, Scale},
};
use mops_outcome::{SweepAxis, SweepReport};

use super::at;
use crate::numbers::significant;
use crate::search::{Options, SolveError, Solved};

/// Share of the points, those with the lowest objective, that count as the valley.
const VALLEY: f64 = 0.05;

pub(super) fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    let task = study.tasks().sweep.clone().expect("a study with this task defines the sweep");
    let mut solved = at(task.at, study, options, watch)?;
    let problem = &solved.problem;
    let axes: Vec<&Axis> = std::iter::once(&task.x).chain(&task.y).collect();
    let values: Vec<Vec<f64>> = axes.iter().map(|axis| spread(problem, axis)).collect();
    let coordinate = |axis: &Axis| {
        problem
            .active()
            .iter()
            .position(|&i| i == axis.tuner)
            .expect("only active tuners of calibration data are swept")
    };
    let coordinates: Vec<usize> = axes.iter().map(|axis| coordinate(axis)).collect();
    let centre = problem.point_of(&solved.best.tuners);
    let moved = |x: f64, y: Option<f64>| {
        let mut point = centre.clone();
        for ((&at, axis), value) in coordinates.iter().zip(&axes).zip([Some(x), y].into_iter().flatten()) {
            point[at] = problem.study().tuners()[axis.tuner].position_of(value);
        }
        point
    };
    let rows: Vec<Option<f64>> = values.get(1).map_or(vec![None], |ys| ys.iter().map(|&y| Some(y)).collect());

    let mut run = Run::new(problem, Budget { evaluations: usize::MAX }, watch).keeping(options.store(problem));
    let mut merits: Vec<Vec<Merit>> = Vec::new();
    for &y in &rows {
        let points: Vec<Vec<f64>> = values[0].iter().map(|&x| moved(x, y)).collect();
        match run.evaluate(&points) {
            Ok(answers) => merits.push(answers.into_iter().map(|e| e.merit).collect()),
            Err(_) => {
                solved.outcome.stop = watch.halt().into();
                break;
            }
        }
    }
    // Points of a row that was cut off are not counted.
    let complete = merits.iter().map(Vec::len).sum();
    merits.resize(rows.len(), vec![Merit::FAILED; values[0].len()]);
    let points = run.archive().to_vec();
    let simulations = points.len() * problem.simulations();
    drop(run);

    let mut best = (Merit::FAILED, [f64::NAN; 3]);
    for (row, &y) in merits.iter().zip(&rows) {
        for (&merit, &x) in row.iter().zip(&values[0]) {
            if merit.is_better_than(&best.0) {
                best = (merit, [x, y.unwrap_or(f64::NAN), merit.objective]);
            }
        }
    }
    let of = |axis: Option<&&Axis>| axis.map_or(f64::NAN, |axis| solved.best.tuners[axis.tuner]);
    let finite = |value: f64| if value.is_finite() { value } else { f64::NAN };
    let pick = |f: fn(&Merit) -> f64| merits.iter().map(|row| row.iter().map(|m| finite(f(m))).collect()).collect();
    let mut axes_report = axes.iter().zip(&values).map(|(axis, values)| {
        let tuner = &problem.study().tuners()[axis.tuner];
        let log = tuner.scale == Scale::Log;
        SweepAxis { tuner: tuner.name.clone(), unit: tuner.unit.to_string(), log, values: values.clone() }
    });
    let mut report = SweepReport {
        words: Vec::new(),
        x: axes_report.next().expect("there is an x"),
        y: axes_report.next(),
        objective: pick(|m| m.objective),
        violation: pick(|m| m.violation),
        best: best.1,
        centre: [of(axes.first()), of(axes.get(1)), solved.best.merit.objective],
    };
    drop(axes_report);
    report.words = words(&report, complete);
    solved.archive.extend(points.iter().cloned());
    solved.outcome.evaluations += points.len();
    solved.outcome.simulations += simulations;
    solved.outcome.found.sweep = Some(report);
    Ok(solved)
}

/// Returns the values along an axis, equally spaced on the scale of the tuner.
#[allow(clippy::cast_precision_loss)]
fn spread(problem: &Problem, axis: &Axis) -> Vec<f64> {
    let tuner = &problem.study().tuners()[axis.tuner];
    let [from, to] = axis.range.map(|value| tuner.position_of(value));
    let last = (axis.points - 1) as f64;
    (0..axis.points).map(|i| tuner.value_at(from + (to - from) * i as f64 / last)).collect()
}

/// Formats the sweep as sentences.
fn words(sweep: &SweepReport, complete: usize) -> Vec<String> {
    let number = |value: f64| significant(value, 4);
    let place = |[x, y, _]: [f64; 3]| {
        let along = |axis: &SweepAxis, value: f64| {
            let unit = if axis.unit == "1" { String::new() } else { format!(" {}", axis.unit) };
            format!("`{}` = {}{unit}", axis.tuner, number(value))
        };
        let y = sweep.y.as_ref().map_or_else(String::new, |axis| format!(", {}", along(axis, y)));
        along(&sweep.x, x) + &y
    };
    let all: Vec<f64> = sweep.objective.iter().flatten().copied().filter(|v| v.is_finite()).collect();
    let asked = sweep.objective.iter().map(Vec::len).sum::<usize>();
    if all.is_empty() {
        let why = match complete < asked {
            true => "The sweep was cut off before a point had a value.",
            false => "No point of the sweep could be simulated.",
        };
        return vec![why.to_owned()];
    }
    let highest = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let lowest = all.iter().copied().fold(f64::INFINITY, f64::min);
    let mut words = vec![format!(
        "The best point of the sweep is {} with objective {}; the objective ranges from {} to {}.",
        place(sweep.best),
        number(sweep.best[2]),
        number(lowest),
        number(highest)
    )];
    let mut sorted = all.clone();
    sorted.sort_by(f64::total_cmp);
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let level = sorted[(sorted.len() as f64 * VALLEY) as usize];
    let low = |row: usize, column: usize| sweep.objective[row][column] <= level;
    let columns: Vec<usize> =
        (0..sweep.x.values.len()).filter(|&c| (0..sweep.objective.len()).any(|r| low(r, c))).collect();
    let rows: Vec<usize> =
        (0..sweep.objective.len()).filter(|&r| (0..sweep.x.values.len()).any(|c| low(r, c))).collect();
    let range = |axis: &SweepAxis, of: &[usize]| {
        let [from, to] = [of.first(), of.last()].map(|i| number(axis.values[*i.expect("the lowest point is low")]));
        format!("`{}` from {from} to {to}", axis.tuner)
    };
    let along_y = sweep.y.as_ref().map_or_else(String::new, |y| format!(" and {}", range(y, &rows)));
    words.push(format!(
        "The 5 % of points with the lowest objective, up to {}, span {}{along_y}.",
        number(level),
        range(&sweep.x, &columns)
    ));
    let failed = complete - all.len();
    if failed > 0 {
        words.push(format!("{failed} of {complete} points have no value: a simulation failed."));
    }
    if complete < asked {
        words.push(format!("{} of {asked} points are missing: the sweep was cut off.", asked - complete));
    }
    words
}
