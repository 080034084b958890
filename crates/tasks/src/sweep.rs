//! `task = "sweep"`: objective over one or two tuners.

use mops_content::{
    contour::border,
    figures::{Figure, Group},
    numbers::{labelled, significant},
    plot::{Color, Curve, CurveStyle, Plot, Surface},
    section::{Block, Section, Tone, Verdict},
};
use mops_core::{
    Merit, Oracle, Problem, Run, Study, Watch,
    evaluation::FEASIBLE,
    run::Budget,
    study::Scale,
    task::{Axis, SweepTask},
};
use mops_outcome::{BlockKind, Outcome, finding};
use schemars::JsonSchema;
use serde::Serialize;

use crate::room::{Judgement, Room, Solution, TaskCommand, solve_at};
use crate::search::{Options, SolveError, Solved};

/// Objective over one or two tuners.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SweepReport {
    /// Findings as sentences; names are in backticks.
    pub words: Vec<String>,
    /// Tuner along x.
    pub x: SweepAxis,
    /// Tuner along y, if there is one.
    pub y: Option<SweepAxis>,
    /// Objective: one row per value of y (a single one without y), with one number per value of x; null if a simulation
    /// failed.
    pub objective: Vec<Vec<f64>>,
    /// Largest constraint violation, in scaled values, in the same layout.
    pub violation: Vec<Vec<f64>>,
    /// Value of x, value of y (null without y) and objective at the best point of the sweep.
    pub best: [f64; 3],
    /// Value of x, value of y (null without y) and objective at the centre of the sweep.
    pub centre: [f64; 3],
}

/// A swept tuner.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SweepAxis {
    /// Name.
    pub tuner: String,
    /// Unit of the values.
    pub unit: String,
    /// True if the values are evenly spaced in the logarithm.
    pub log: bool,
    /// Values of the tuner.
    pub values: Vec<f64>,
}

finding!(SweepReport, "sweep", "Objective over one or two tuners.");

/// `task = "sweep"`.
pub struct Sweep;

/// Share of the points, those with the lowest objective, that count as the valley.
const VALLEY: f64 = 0.05;

impl Room for Sweep {
    fn title(&self) -> &'static str {
        "Sweep"
    }

    fn perform(&self, study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
        perform(study, options, watch)
    }

    fn command(&self) -> Option<TaskCommand> {
        Some(TaskCommand {
            name: "sweep",
            about: "Vary one or two tuners of a study over a grid, as its table [sweep] says",
            after_help: "",
            has_solver: true,
            options: &[],
        })
    }

    fn blocks(&self) -> Vec<BlockKind> {
        vec![BlockKind::of::<SweepReport>()]
    }

    fn verdict(&self, of: &Solution<'_>) -> Judgement {
        let found = of.outcome.found.get::<SweepReport>();
        Judgement::OfPoint(match found.and_then(|sweep| Some((sweep, sweep.words.first()?))) {
            Some((sweep, words)) => {
                let has_value = sweep.best[2].is_finite();
                Verdict::new(if has_value { Tone::Good } else { Tone::Bad }, words)
            }
            None => Verdict::new(Tone::Bad, "No sweep: the run was interrupted."),
        })
    }

    fn findings(&self, of: &Solution<'_>) -> Vec<Section> {
        let found = of.outcome.found.get::<SweepReport>();
        found.map(|sweep| Section::new("Sweep", [Block::Plots(group(sweep, of.best_name()))])).into_iter().collect()
    }

    fn lines(&self, outcome: &Outcome) -> Vec<Block> {
        outcome.found.get::<SweepReport>().map(|sweep| Block::Findings(sweep.words.clone())).into_iter().collect()
    }

    fn has_convergence(&self, _of: &Solution<'_>) -> bool {
        false
    }

    fn not_solved(&self) -> &'static str {
        "Not solved: the tuners that are not swept are at the initial guess"
    }

    fn stores_points(&self, _study: &Study) -> bool {
        true
    }
}

fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    let task = study.options::<SweepTask>().cloned().expect("a study with this task has its options");
    let mut solved = solve_at(task.at, study, options, watch)?;
    let problem = &solved.problem;
    let axes = task.axes(problem.study()).expect("checked when the study was built");
    let values: Vec<Vec<f64>> = axes.iter().map(|axis| spread(problem, axis)).collect();
    let coordinate = |axis: &Axis| {
        problem
            .active()
            .iter()
            .position(|&i| i == axis.tuner)
            .expect("only active tuners of calibration data are swept")
    };
    let coordinates: Vec<usize> = axes.iter().map(coordinate).collect();
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
    let of = |axis: Option<&Axis>| axis.map_or(f64::NAN, |axis| solved.best.tuners[axis.tuner]);
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
    solved.outcome.found.add(report);
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

/// Returns the plot of a sweep: the objective over one tuner as a curve, over two tuners as a surface.
fn group(sweep: &SweepReport, best_name: &str) -> Group {
    let plot = match &sweep.y {
        Some(y) => surface(sweep, y, best_name),
        None => line(sweep, best_name),
    };
    Group {
        about: sweep.words.clone(),
        figures: vec![Figure { plots: vec![("sweep".into(), plot)], ..Figure::default() }],
        ..Group::default()
    }
}

/// Returns true if the finite values are positive and span more than two decades.
fn spans_decades(sweep: &SweepReport) -> bool {
    let all = || sweep.objective.iter().flatten().copied().filter(|v| v.is_finite());
    let low = all().fold(f64::INFINITY, f64::min);
    low > 0.0 && all().fold(0.0, f64::max) > 100.0 * low
}

fn violated(sweep: &SweepReport) -> bool {
    sweep.violation.iter().flatten().any(|&v| v > FEASIBLE)
}

fn dot(name: &str, [x, y]: [f64; 2], color: Color) -> Curve {
    Curve { name: name.into(), points: vec![(x, y)], style: CurveStyle::Dots, color, ..Curve::default() }
}

fn surface(sweep: &SweepReport, y: &SweepAxis, best_name: &str) -> Plot {
    let surface = Surface {
        label: "objective".into(),
        x: sweep.x.values.clone(),
        y: y.values.clone(),
        values: sweep.objective.clone(),
        log: spans_decades(sweep),
    };
    let mut curves = Vec::new();
    if violated(sweep) {
        let points = border(&surface, &sweep.violation, FEASIBLE);
        curves.push(Curve {
            name: "limit of the feasible region".into(),
            points,
            color: Color::Demand,
            ..Curve::default()
        });
    }
    curves.push(dot("best point of the sweep", [sweep.best[0], sweep.best[1]], Color::Measured));
    curves.push(dot(best_name, [sweep.centre[0], sweep.centre[1]], Color::Demand));
    Plot {
        title: format!("Objective over {} and {}", sweep.x.tuner, y.tuner),
        x_label: labelled(&sweep.x.tuner, &sweep.x.unit),
        y_label: labelled(&y.tuner, &y.unit),
        log_x: sweep.x.log,
        log_y: y.log,
        curves,
        surface: Some(surface),
        ..Plot::default()
    }
}

fn line(sweep: &SweepReport, best_name: &str) -> Plot {
    let points = || sweep.x.values.iter().copied().zip(sweep.objective[0].iter().copied());
    let mut curves = vec![Curve { name: "objective".into(), points: points().collect(), ..Curve::default() }];
    if violated(sweep) {
        let infeasible = |((x, y), v): ((f64, f64), &f64)| if *v > FEASIBLE { (x, y) } else { (x, f64::NAN) };
        let points = points().zip(&sweep.violation[0]).map(infeasible).collect();
        curves.push(Curve { name: "infeasible".into(), points, color: Color::Measured, ..Curve::default() });
    }
    curves.push(dot(best_name, [sweep.centre[0], sweep.centre[2]], Color::Demand));
    Plot {
        title: format!("Objective over {}", sweep.x.tuner),
        x_label: labelled(&sweep.x.tuner, &sweep.x.unit),
        y_label: "objective".into(),
        log_x: sweep.x.log,
        log_y: spans_decades(sweep),
        curves,
        ..Plot::default()
    }
}
