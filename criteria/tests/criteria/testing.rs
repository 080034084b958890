//! Closed forms as simulations, for the tests of all criteria.

use mops_core::{
    Analysis, AnalysisKind, Case, Criterion, CriterionSpec, Interface, Response, Role, Trace, Value, Variable,
    case::{Channel, Experiment},
    criterion::Tangent,
};
use mops_language::Quantity;
use mops_linear::TransferFunction;
use mops_math as math;

/// Returns the signals of the model of all tests.
pub fn signals() -> Vec<Variable> {
    [("y", "m"), ("u", "V"), ("phi", "rad")].map(|(name, unit)| Variable::new(name, unit, "")).to_vec()
}

/// Returns the model of all tests of a criterion: signals over time, or a system from `u` in V to `y` in V.
fn model(reads: AnalysisKind) -> Interface {
    match reads {
        AnalysisKind::Time => Interface { signals: signals(), ..Interface::default() },
        AnalysisKind::Linear => channel("V", "V"),
    }
}

/// Returns a linear model from `u` to `y`, in these units.
pub fn channel(from: &str, to: &str) -> Interface {
    Interface {
        signals: vec![Variable::new("y", to, "")],
        inputs: vec![Variable::new("u", from, "")],
        analysis: AnalysisKind::Linear,
        ..Interface::default()
    }
}

/// Returns a linear system given by its transfer function, coefficients of descending powers.
pub fn linear(numerator: &[f64], denominator: &[f64]) -> Analysis {
    linear_delayed(numerator, denominator, 0.0)
}

/// Returns a linear system with a delay, given by its transfer function.
pub fn linear_delayed(numerator: &[f64], denominator: &[f64], delay: f64) -> Analysis {
    let function = TransferFunction { numerator: numerator.to_vec(), denominator: denominator.to_vec(), delay };
    Analysis::Linear(function.state_space().expect("it is a system"))
}

/// Returns a function over [0, `end`] as a trace of `segments` equal segments.
pub fn sampled(end: f64, segments: u32, f: impl Fn(f64) -> f64) -> Trace {
    let mut trace = Trace::starting_at(0.0, segments as usize);
    let knot = |i: u32| end * f64::from(i) / f64::from(segments);
    for i in 0..segments {
        let (from, to) = (knot(i), knot(i + 1));
        trace.push(to, Trace::NODES.map(|s| f(from + s * (to - from))));
    }
    trace
}

/// Returns an analysis in which every signal has this trace.
pub fn analysis(trace: &Trace) -> Analysis {
    let traces = signals().into_iter().map(|signal| (signal.name, trace.clone())).collect();
    Analysis::Time(Response { traces, ..Response::default() })
}

/// Returns a function over [0, `end`] as an analysis, in segments of about 0.01 s.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
pub fn simulated(end: f64, f: impl Fn(f64) -> f64) -> Analysis {
    analysis(&sampled(end, (end / 0.01).ceil() as u32, f))
}

/// Returns the step response of `1/(s^2 + 2 damping s + 1)`, underdamped.
pub fn second_order(damping: f64) -> impl Fn(f64) -> f64 {
    let frequency = (1.0 - damping * damping).sqrt();
    move |t| {
        let (sin, cos) = math::sin_cos(frequency * t);
        1.0 - math::exp(-damping * t) * (cos + damping / frequency * sin)
    }
}

/// Returns a case with a measurement of `y`.
pub fn measured(times: &[f64], values: &[f64], noise: Option<f64>) -> Case {
    let channel = Channel { signal: "y".into(), times: times.to_vec(), values: values.to_vec(), noise };
    Case {
        experiment: Some(Experiment { channels: vec![channel], role: Role::Calibration, ..Experiment::default() }),
        ..Case::default()
    }
}

/// Returns a quantity as written by a user.
pub fn quantity(text: &str) -> Quantity {
    Quantity::parse(text).expect("a quantity")
}

/// Binds the criterion to the model of all tests.
pub fn bound(spec: &dyn CriterionSpec) -> Box<dyn Criterion> {
    spec.bind(&model(spec.reads().unwrap_or_default())).expect("the options are right")
}

/// Returns the value of a criterion.
pub fn value(spec: &dyn CriterionSpec, analysis: &Analysis) -> Value {
    value_in(&Case::default(), spec, analysis)
}

/// Returns the value of a criterion in a case.
pub fn value_in(case: &Case, spec: &dyn CriterionSpec, analysis: &Analysis) -> Value {
    bound(spec).value(case, analysis).expect("it is defined")
}

/// Returns the reason why a criterion has no value.
pub fn undefined(spec: &dyn CriterionSpec, analysis: &Analysis) -> String {
    undefined_in(&Case::default(), spec, analysis)
}

/// Returns the reason why a criterion has no value in a case.
pub fn undefined_in(case: &Case, spec: &dyn CriterionSpec, analysis: &Analysis) -> String {
    bound(spec).value(case, analysis).expect_err("it is not defined")
}

/// Returns the mistake in the options of a criterion.
pub fn mistake(spec: &dyn CriterionSpec) -> String {
    spec.bind(&model(spec.reads().unwrap_or_default())).err().expect("the options are wrong").to_string()
}

/// Asserts that two numbers agree within `tolerance`.
#[track_caller]
pub fn assert_near(number: f64, expected: f64, tolerance: f64) {
    assert!((number - expected).abs() <= tolerance, "{number} is not {expected} within {tolerance}");
}

/// Returns a linear model with the inputs `u1` and `u2` and the signals `y1` and `y2`, all in V.
pub fn two_by_two() -> Interface {
    let variables = |names: [&str; 2]| names.map(|name| Variable::new(name, "V", "")).to_vec();
    Interface {
        signals: variables(["y1", "y2"]),
        inputs: variables(["u1", "u2"]),
        analysis: AnalysisKind::Linear,
        ..Interface::default()
    }
}

/// Asserts that the slope of a criterion is the difference of its values, for `1 - exp(-t)` moved along `t exp(-t)`.
#[track_caller]
pub fn assert_slope(case: &Case, spec: &dyn CriterionSpec, end: f64) {
    let at = |by: f64| simulated(end, move |t| 1.0 - math::exp(-t) + by * t * math::exp(-t));
    let along = simulated(end, |t| t * math::exp(-t));
    let (analysis, criterion) = (at(0.0), bound(spec));
    let of = |analysis: &Analysis| criterion.value(case, analysis).expect("it is defined");
    let value = of(&analysis);
    let tangent =
        Tangent { analysis: &analysis, value: &value, along: &along, parameters: &[], seed: &[], reach: 1e-4 };
    let slope = criterion.slope(case, &tangent).expect("it has a slope");
    let [down, up] = [-1e-4, 1e-4].map(|by| of(&at(by)));
    let difference = |a: f64, b: f64| (a - b) / 2e-4;
    let exact = difference(up.number, down.number);
    assert!((slope.number - exact).abs() < 1e-5 * (1.0 + exact.abs()), "{} is not {exact}", slope.number);
    assert_eq!(slope.residuals.len(), value.residuals.len());
    for (slope, (up, down)) in slope.residuals.iter().zip(up.residuals.iter().zip(&down.residuals)) {
        let exact = difference(*up, *down);
        assert!((slope - exact).abs() < 1e-5 * (1.0 + exact.abs()), "{slope} is not {exact}");
    }
}
