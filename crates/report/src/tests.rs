//! Tests of the whole report of a small study: a first-order lag with a step and an experiment.

use mops_tasks::{Solution, design::Design};

use super::Draw;
use std::sync::Arc;

use mops_content::{
    numbers,
    plot::{Curve, CurveStyle, Level, Plot, ZAxis},
};
use mops_core::{
    Analysis, Case, Criterion, CriterionSpec, Evaluation, Failure, Interface, Job, Model, Oracle, Parameter, Problem,
    Response, Role, Run, Stop, StudyBuilder, StudyError, Trace, Usage, Value, Variable,
    run::{Budget, Record},
    solver::Pareto,
    study::{CaseBuilder, ChannelBuilder, CriterionBuilder, Measured, TunerBuilder},
};
use mops_language::Unit;
use mops_math as math;
use mops_outcome::{CalibrationReport, Ending, Outcome, conclude, criterion_reports};
use mops_tasks::design::{CriterionSlopes, SlopesReport};

use super::Report;

/// First-order lag `T y' + y = 1`, `y(0) = 0`; not defined for `T` above 10 s.
pub(super) struct Lag(Interface);

impl Lag {
    pub(super) fn new() -> Self {
        Self(Interface {
            signals: vec![Variable::new("y", "V", "output")],
            parameters: vec![Parameter::new("T", "s", "time constant")],
            horizon: Some(5.0),
            ..Interface::default()
        })
    }
}

impl Model for Lag {
    fn interface(&self) -> &Interface {
        &self.0
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        let lag = job.parameters[0];
        if lag > 10.0 {
            return Err(Failure::Diverged(0.1));
        }
        let mut trace = Trace::starting_at(0.0, 50);
        let h = job.horizon / 50.0;
        for i in 0..50 {
            trace.push(f64::from(i + 1) * h, Trace::NODES.map(|s| 1.0 - math::exp(-(f64::from(i) + s) * h / lag)));
        }
        Ok(Analysis::Time(Response { traces: vec![("y".into(), trace)], ..Response::default() }))
    }
}

/// Criterion: value of `y` at the end.
#[derive(Clone, Copy)]
struct End;

impl CriterionSpec for End {
    fn bind(&self, _: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        Ok(Box::new(*self))
    }
}

impl Criterion for End {
    fn unit(&self) -> Unit {
        Unit::known("V")
    }

    fn signals(&self) -> Vec<String> {
        vec!["y".into()]
    }

    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        Ok(Value::noted(analysis.trace("y").last(), "not settled at the end"))
    }
}

/// Returns a study with a case and an experiment, and the outcome that a run would write.
fn study(name: &str, start: f64, usage: Usage) -> (Problem, Evaluation, Outcome, Vec<Record>) {
    let times: Vec<f64> = (0..100).map(|i| 0.05 * f64::from(i)).collect();
    let values = times.iter().map(|t| 1.0 - math::exp(-t / 1.3f64) + 0.01 * math::sin(40.0 * t)).collect();
    let channel =
        ChannelBuilder { signal: "y".into(), times, values, noise: Some(0.01.into()), ..ChannelBuilder::default() };
    let measured = Measured { channels: vec![channel], role: Role::Calibration, ..Measured::default() };
    let draft = StudyBuilder {
        name: name.into(),
        models: vec![("lag".into(), Lag::new().into())],
        tuners: vec![("T".into(), TunerBuilder::new(start, 0.1, 20.0))],
        cases: vec![
            CaseBuilder { name: "nominal & more".into(), ..CaseBuilder::default() },
            CaseBuilder { name: "step/1".into(), measured: Some(measured), ..CaseBuilder::default() },
        ],
        criteria: vec![("end".into(), CriterionBuilder::minimise(End, 0.5).used_as(usage))],
        ..StudyBuilder::default()
    };
    let problem = Problem::new(Arc::new(draft.build().unwrap()));
    let best = problem.evaluate_at(&[2.0]);
    let points = [problem.start(), best.point.clone()];
    let mut run = Run::new(&problem, Budget { evaluations: 2 }, &());
    run.evaluate(&points).unwrap();
    let solver = mops_solvers::kinds()[0].default_choice();
    let (mut outcome, _) =
        conclude(&run, &solver, Ending { stop: Stop::Converged, end: None, pareto: Pareto::NotShown, seconds: 0.1 });
    (outcome.solver, outcome.methods) = ("by-hand".into(), vec!["sqp", "pattern-search"]);
    outcome.criteria = criterion_reports(problem.study(), &best);
    (outcome.worst_scaled, outcome.objective) = (best.merit.objective, best.merit.objective);
    (outcome.feasible, outcome.violation) = (best.merit.is_feasible(), best.merit.violation);
    outcome.tuners[0].value = 2.0;
    outcome.calibration = Some(CalibrationReport::default());
    outcome.warnings = vec!["mind the `gap`".into()];
    outcome.failures = Vec::new();
    let archive = run.archive().to_vec();
    drop(run);
    (problem, best, outcome, archive)
}

/// Writes the report of a study; returns its temporary folder and the page.
fn written(name: &str, start: f64, usage: Usage) -> (tempfile::TempDir, String) {
    let (problem, best, outcome, archive) = study(name, start, usage);
    page_of(&problem, &best, &outcome, &archive, "a < b")
}

/// Writes a report; returns its temporary folder and the page.
fn page_of(
    problem: &Problem,
    best: &Evaluation,
    outcome: &Outcome,
    archive: &[Record],
    text: &str,
) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let solution = Solution { outcome, problem, best, archive, front: &[] };
    let report = Report { solution, room: &Design, text };
    report.write(folder.path()).unwrap();
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    (folder, page)
}

#[test]
fn the_page_shows_every_criterion_and_escapes_what_users_write() {
    let (_folder, page) = written("<script>alert(1)</script>", 5.0, Usage::Minimise);
    assert!(!page.contains("<script>alert") && page.contains("&lt;script&gt;alert(1)"));
    assert_eq!(page.matches("<th scope=\"row\">end<small>not settled at the end").count(), 2);
    for text in [
        "nominal &amp; more",
        "mind the <code>gap</code>",
        "a &lt; b",
        "exceeds its demand by 84 %",
        "\u{b1}2 noise, 0.02 V",
    ] {
        assert!(page.contains(text), "{text}");
    }
    assert!(
        !page.contains("http://")
            || page.matches("http://").count() == page.matches("xmlns=\"http://www.w3.org/2000/svg\"").count()
    );
}

#[test]
fn an_infeasible_result_names_the_constraint_and_a_failed_initial_guess_is_reported() {
    let (_folder, page) = written("lag", 15.0, Usage::Inequality);
    assert!(page.contains("No feasible point found: <code>end</code> in case <code>"));
    // The methods of a composite solver are listed; an infeasible point has no Pareto status.
    assert!(page.contains("by-hand: sqp, pattern-search") && !page.contains("<dt>Pareto"));
    assert!(page.contains("No response at the initial guess: the simulation failed (diverged at 0.1000 s)."));
    assert!(page.contains("1 of 2 points have no value"));
}

#[test]
fn a_run_without_a_single_value_still_has_a_page() {
    let (problem, _, mut outcome, mut archive) = study("lag", 15.0, Usage::Minimise);
    archive.truncate(1);
    let best = problem.evaluate_at(&[15.0]);
    (outcome.objective, outcome.violation, outcome.feasible) = (f64::INFINITY, f64::INFINITY, false);
    outcome.criteria = criterion_reports(problem.study(), &best);
    let (_folder, page) = page_of(&problem, &best, &outcome, &archive, "");
    assert!(page.contains("Failed: no point could be evaluated") && page.contains(">no data<"));
}

#[test]
fn every_plot_is_written_twice_under_a_safe_name() {
    let (folder, _page) = written("lag", 5.0, Usage::Minimise);
    let mut names: Vec<String> = std::fs::read_dir(folder.path().join("plots"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".png"))
        .collect();
    names.sort();
    assert_eq!(names, ["convergence.png", "fit-step-1-y.png", "residual-step-1-y.png", "response-nominal-more-y.png"]);
    assert!(folder.path().join("plots/fit-step-1-y.svg").exists());
}

#[test]
fn a_plot_escapes_names_and_skips_non_finite_points() {
    let points = vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, f64::INFINITY), (3.0, 2.0), (f64::NAN, 0.0), (4.0, 1e300)];
    let curve = |style| Curve { name: "a<b & \"c\"".into(), points: points.clone(), style, ..Curve::default() };
    let curves = [CurveStyle::Line, CurveStyle::Dashed, CurveStyle::Dots].map(curve).to_vec();
    let svg = Plot { title: "<script>".into(), curves, ..Plot::default() }.svg();
    assert!(svg.contains("a&lt;b &amp; &quot;c&quot;") && svg.contains("&lt;script&gt;") && !svg.contains("<script"));
    assert!(!svg.contains("NaN") && !svg.contains("inf "));
}

#[test]
fn empty_and_constant_plots_are_drawn() {
    let level = Level { name: "demand".into(), value: 7.0 };
    for values in [vec![], vec![2.0], vec![3.0; 4], vec![0.0; 4], vec![1e-300; 3], vec![f64::NAN; 2]] {
        for log_y in [false, true] {
            let points = values.iter().enumerate().map(|(i, v)| (i as f64, *v)).collect();
            let curves = vec![Curve { points, ..Curve::default() }];
            let plot = Plot { curves, log_y, levels: vec![level.clone()], ..Plot::default() };
            let svg = plot.svg();
            assert!(
                svg.starts_with("<svg") && !svg.contains("NaN") && !svg.contains("inf\""),
                "{values:?} {log_y} {svg}"
            );
            assert!(plot.png().unwrap().starts_with(b"\x89PNG"));
        }
    }
    assert_eq!(numbers::labelled("y", "1"), "y");
}

#[test]
fn cases_and_sensitivities_are_shown_as_shaded_tables() {
    let (problem, best, mut outcome, archive) = study("lag", 5.0, Usage::Minimise);
    let slope = |key: &str, slope| CriterionSlopes { key: key.into(), slopes: vec![slope], sides: None };
    let kink = CriterionSlopes { sides: Some(vec![Some([-3.0, 7.0])]), ..slope("step/1/peak", 2.0) };
    let criteria = vec![slope("nominal & more/end", 25.0), slope("step/1/end", f64::NAN), kink];
    outcome.found.add(SlopesReport { tuners: vec!["T".into()], criteria });
    let (_folder, page) = page_of(&problem, &best, &outcome, &archive, "");
    // Both cases at 1 - exp(-5/2) = 0.9179 for a demand of 0.5.
    assert_eq!(page.matches("data-value=\"1.83").count(), 2 + 2 + 2, "two cells, their worsts, and the worst of all");
    assert!(page.contains("Criteria by case") && page.contains("number shade mixed above"));
    assert!(page.contains(">+0.25</td>") && page.contains("--share:45%"), "a hundredth of the derivative");
    assert!(page.contains("<div>\u{2191} +0.07</div><div>\u{2193} +0.03</div></td>"), "both sides of a kink");
    assert!(page.contains(">n/a</td>"), "an unknown derivative is shown as n/a");
}

#[test]
fn a_z_axis_keeps_the_points_that_a_page_rotates() {
    let dot =
        |x| Curve { points: vec![(x, 2.0 * x)], style: CurveStyle::Dots, front_point: Some(0), ..Curve::default() };
    let z_axis = ZAxis { label: "z (s)".into(), values: vec![vec![0.0], vec![4.0]] };
    let plot = Plot { curves: vec![dot(0.0), dot(1.0)], z_axis: Some(z_axis), ..Plot::default() };
    let svg = plot.svg();
    assert!(svg.contains("data-view=") && svg.contains(">z (s)</text>") && !svg.contains("NaN"));
    assert_eq!(svg.matches("class=\"dot\" data-point=\"0\"").count(), 2);
    let of_all_signs = |sign: f64| svg.contains(&format!("data-space=\"{sign:.4} {sign:.4} {sign:.4}\""));
    assert!(of_all_signs(-1.0) && of_all_signs(1.0), "the ends of the ranges lie in opposite corners: {svg}");
}

#[test]
fn control_characters_never_make_an_svg_invalid() {
    let odd: String = (0..0x20).chain([0x7f, 0x85, 0x202e, 0xfffe, 0xffff]).filter_map(char::from_u32).collect();
    let curves = vec![Curve { name: odd.clone(), points: vec![(0.0, 1.0), (1.0, 2.0)], ..Curve::default() }];
    let levels = vec![Level { name: odd.clone(), value: 1.5 }];
    let (title, x_label, y_label) = (odd.clone(), odd.clone(), odd);
    let svg = Plot { title, x_label, y_label, curves, levels, ..Plot::default() }.svg();
    // XML 1.0, section 2.2.
    let is_valid =
        |c: char| matches!(c, '\t' | '\n' | '\r' | ' '..='\u{d7ff}' | '\u{e000}'..='\u{fffd}' | '\u{10000}'..);
    assert!(svg.chars().all(is_valid), "{svg}");
    assert!(svg.contains("\\u{1}") && svg.contains("\\u{ffff}"));
}
