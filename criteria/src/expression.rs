//! Value of a formula.

use std::borrow::Cow;
use std::sync::Arc;

use mops_core::{
    Analysis, AnalysisKind, Case, Criterion, CriterionOptions, CriterionSpec, Interface, StudyError, Trace, Value,
    Variable,
    criterion::{BindContext, Missed, Other},
};
use mops_language::{
    Expression as Formula, Unit,
    expression::{
        Reduced, Reduction, SyntaxError,
        units::{Dimensions, Measure, Named},
    },
    suggestion,
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::trace;

/// Value of a formula such as `value = "3*rise + integral(u^2)/1 [V2]"`, over other criteria of the study for the same
/// model, parameters of the model, and reductions of signals.
///
/// `initial(x)` and `final(x)` are the values at the start and at the end of the simulation, `maximum(x)` and
/// `minimum(x)` the extrema, `integral(x)` the integral over time, `mean(x)` and `rms(x)` the mean and the root mean
/// square. `x` is a signal, or a formula over signals and parameters. Operators and functions are those of equations.
/// All quantities count in coherent SI units, and dimensions are checked; a number may have a unit, `5 [N m]`. A demand
/// in Hz, rpm or deg/s needs a `unit` of the formula, as 1/s may count cycles or angles.
///
/// Range: any number. Whether less or more is better depends on the study: a demand is an upper limit, `good` and `bad`
/// set either direction. If another criterion in the formula has no value, because its condition was not reached, the
/// formula has none. `from` and `until` restrict the reductions; other criteria keep the parts of the simulation that
/// they read.
///
/// Source: extrema and integrals are those of the piecewise quartic of each signal; a formula over several signals is
/// interpolated by such a quartic within the steps of all of them.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Expression {
    /// The formula.
    pub value: String,
    /// Unit of the value; by default the coherent SI unit.
    pub unit: Option<String>,
}

impl CriterionOptions for Expression {
    const KIND: &'static str = "expression";
}

impl CriterionSpec for Expression {
    fn reads(&self) -> Option<AnalysisKind> {
        None
    }

    fn names(&self) -> Vec<String> {
        Formula::with_reductions(&self.value).map_or_else(|_| Vec::new(), |(formula, _)| formula.names().to_vec())
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        self.bind_in(model, &BindContext::default())
    }

    /// The window restricts the reductions; other criteria have windows of their own.
    fn bind_in(&self, model: &Interface, context: &BindContext<'_>) -> Result<Box<dyn Criterion>, StudyError> {
        let (others, window) = (context.others, context.window.unwrap_or([0.0, f64::INFINITY]));
        let at = |SyntaxError { span, message }: SyntaxError| StudyError::new("value", message).at(span);
        let (formula, reduced) = Formula::with_reductions(&self.value).map_err(at)?;
        let mut dimensions = Dimensions::default();
        let mut measure = |named: Vec<(String, Measure)>, of: &Formula| {
            let found = dimensions.measure(&mut Named(named), of.root());
            let conflict = found.map_err(|c| StudyError::new("value", c.fact).at(c.span).with_help(c.help))?;
            Ok::<_, StudyError>(Unit::coherent(&dimensions.of(&conflict)))
        };
        let declared = |name: &str, unit: &Unit| (name.to_owned(), Measure::declared(name, &coherent(unit)));
        let (mut courses, mut names) = (Vec::new(), Vec::new());
        for Reduced { name, reduction, of } in reduced {
            let sources = of.names().iter().map(|name| course(name, model, others, &self.value));
            let sources: Vec<Course> = sources.collect::<Result<_, _>>()?;
            if !sources.iter().any(|source| matches!(source, Course::Signal(..))) {
                let fact = format!("`{name}` contains no signal, so that it has no time response");
                return Err(unknown(&name, &self.value, &fact, "write the value itself".to_owned()));
            }
            let units = of.names().iter().zip(&sources).map(|(name, source)| declared(name, source.unit()));
            let unit = measure(units.collect(), &of)?;
            let unit = match reduction {
                Reduction::Integral => Unit::product(&[(&unit, 1), (&Unit::known("s"), 1)]),
                _ => unit,
            };
            if model.analysis == AnalysisKind::Linear {
                let place = self.value.find(&name).unwrap_or(0);
                return Err(StudyError::new("value", "a linear system has no time response")
                    .at(place..place + name.len())
                    .with_help("use a model that is simulated"));
            }
            names.push((name.clone(), unit));
            courses.push((reduction, of, sources));
        }
        let mut sources = Vec::new();
        for name in formula.names() {
            sources.push(match names.iter().position(|(known, _)| known == name) {
                Some(index) => Source::Reduced(index),
                None => number(name, model, others, &self.value)?,
            });
        }
        let units = formula.names().iter().zip(&sources).map(|(name, source)| match source {
            Source::Reduced(index) => declared(name, &names[*index].1),
            Source::Criterion(of) => declared(name, &of.unit()),
            Source::Parameter(_, unit) => declared(name, unit),
        });
        let found = measure(units.collect(), &formula)?;
        let unit = match &self.unit {
            None => found.clone(),
            Some(unit) => Unit::parse(unit).map_err(|why| StudyError::new("unit", why))?,
        };
        if !unit.is_compatible(&found) {
            let fact = format!("the value of the formula is in `{found}`, not in `{unit}`");
            return Err(StudyError::new("unit", fact).with_help("give a unit of the same dimension"));
        }
        if unit.zero() != 0.0 {
            let fact = format!("`{unit}` has a zero of its own, but the formula may be a difference");
            return Err(StudyError::new("unit", fact).with_help(format!("give {found}")));
        }
        let unit = unit.of_unknown_kind();
        Ok(Box::new(Bound { formula, sources, courses, unit, window }))
    }
}

fn coherent(unit: &Unit) -> Unit {
    Unit::coherent(unit.dimension())
}

/// Returns a number in the coherent unit.
fn in_coherent(number: f64, unit: &Unit) -> f64 {
    number * unit.factor() + unit.zero()
}

/// Value of a name in the formula.
enum Source {
    /// Reduction, by its index.
    Reduced(usize),
    /// Another criterion.
    Criterion(Arc<dyn Criterion>),
    /// Parameter of the model, by its index, and its unit.
    Parameter(usize, Unit),
}

/// Values of a name over time.
enum Course {
    Signal(String, Unit),
    Parameter(usize, Unit),
}

impl Course {
    fn unit(&self) -> &Unit {
        match self {
            Self::Signal(_, unit) | Self::Parameter(_, unit) => unit,
        }
    }
}

fn parameter(name: &str, model: &Interface) -> Option<(usize, Unit)> {
    let find = |p: &mops_core::Parameter| p.variable.name == name;
    model.parameters.iter().position(find).map(|index| (index, model.parameters[index].variable.unit.clone()))
}

/// Returns the error for a name that the formula cannot contain.
fn unknown(name: &str, text: &str, fact: &str, help: String) -> StudyError {
    let place = text.find(name).unwrap_or(0);
    StudyError::new("value", fact).at(place..place + name.len()).with_help(help)
}

fn number(name: &str, model: &Interface, others: &[Other], text: &str) -> Result<Source, StudyError> {
    if let Some((_, criterion)) = others.iter().find(|(other, _)| other == name) {
        return Ok(Source::Criterion(Arc::clone(criterion)));
    }
    if let Some((index, unit)) = parameter(name, model) {
        return Ok(Source::Parameter(index, unit));
    }
    if model.signals.iter().any(|signal| signal.name == name) {
        let fact = format!("`{name}` is a signal, which has a value at every time");
        return Err(unknown(name, text, &fact, format!("reduce it to a number, such as maximum({name})")));
    }
    let known = others.iter().map(|(other, _)| other.as_str());
    let known: Vec<&str> = known.chain(model.parameters.iter().map(|p| p.variable.name.as_str())).collect();
    let fact = format!("`{name}` is neither another criterion of the model nor one of its parameters");
    Err(unknown(name, text, &fact, suggestion(name, known)))
}

fn course(name: &str, model: &Interface, others: &[Other], text: &str) -> Result<Course, StudyError> {
    if let Some(Variable { name, unit, .. }) = model.signals.iter().find(|signal| signal.name == name) {
        return Ok(Course::Signal(name.clone(), unit.clone()));
    }
    if let Some((index, unit)) = parameter(name, model) {
        return Ok(Course::Parameter(index, unit));
    }
    if others.iter().any(|(other, _)| other == name) {
        let help = "write it outside of the reduction".to_owned();
        return Err(unknown(name, text, &format!("`{name}` is a criterion, which is one number already"), help));
    }
    let known: Vec<&str> = model.signals.iter().map(|signal| signal.name.as_str()).collect();
    let fact = format!("the model has no signal and no parameter `{name}`");
    Err(unknown(name, text, &fact, suggestion(name, known)))
}

struct Bound {
    formula: Formula,
    /// Values of the names in the formula.
    sources: Vec<Source>,
    /// Reductions, what they reduce, and the names in it.
    courses: Vec<(Reduction, Formula, Vec<Course>)>,
    unit: Unit,
    /// Part of the simulation that is reduced, s.
    window: [f64; 2],
}

/// Error of a quartic, relative to the largest value of a formula over time, above which its segment is halved.
const ACCURACY: f64 = 1e-9;

/// Length of a segment, relative to the whole, that is not halved: a kink or a jump of the formula is within it.
const SHORTEST: f64 = 1e-12;

impl Bound {
    /// Returns the part of a trace within the window.
    fn part<'t>(&self, whole: &'t Trace) -> Result<Cow<'t, Trace>, String> {
        let [from, until] = self.window;
        if from <= whole.start() && until >= whole.end() {
            return Ok(Cow::Borrowed(whole));
        }
        if from >= whole.end() {
            return Err(format!("`from` at {from} s is not before the end of the simulation at {} s", whole.end()));
        }
        Ok(Cow::Owned(whole.between(from, until)))
    }

    /// Returns a course, in coherent units.
    fn course(
        &self,
        (formula, names): (&Formula, &[Course]),
        analysis: &Analysis,
        parameters: &[f64],
    ) -> Result<Trace, String> {
        let mut traces: Vec<Option<Cow<'_, Trace>>> = Vec::new();
        for name in names {
            traces.push(match name {
                Course::Signal(signal, _) => Some(self.part(trace(analysis, signal)?)?),
                Course::Parameter(..) => None,
            });
        }
        let [first, rest @ ..] = &traces.iter().flatten().collect::<Vec<_>>()[..] else {
            unreachable!("checked when the study is built");
        };
        let mut knots = first.knots().to_vec();
        for trace in rest {
            knots.extend_from_slice(trace.knots());
            knots.sort_by(f64::total_cmp);
            knots.dedup();
        }
        let value = |t: f64, is_end: bool| {
            let values: Vec<f64> = names
                .iter()
                .zip(&traces)
                .map(|(name, trace)| match (name, trace) {
                    // At the end of a step, the value is that before a jump.
                    (_, Some(trace)) if is_end => in_coherent(trace.before(t), name.unit()),
                    (_, Some(trace)) => in_coherent(trace.at(t), name.unit()),
                    (Course::Parameter(index, unit), None) => in_coherent(parameters[*index], unit),
                    (Course::Signal(..), None) => unreachable!("signals have traces"),
                })
                .collect();
            formula.evaluate(&values)
        };
        let [start, end] = [knots[0], knots[knots.len() - 1]];
        let largest = knots.iter().map(|&t| value(t, false).abs()).fold(0.0, f64::max);
        let mut found = Trace::starting_at(start, knots.len());
        let mut open: Vec<[f64; 2]> = knots.windows(2).rev().map(|pair| [pair[0], pair[1]]).collect();
        while let Some([from, to]) = open.pop() {
            let at = |s: f64| if s == 1.0 { value(to, true) } else { value(from + s * (to - from), false) };
            let nodes = Trace::NODES.map(at);
            let size = nodes.iter().fold(largest, |size, y| size.max(y.abs()));
            let off = Trace::deviation(nodes, Trace::CHECKS.map(at));
            if off > ACCURACY * size && to - from > SHORTEST * (end - start) {
                let middle = 0.5 * (from + to);
                open.extend([[middle, to], [from, middle]]);
            } else if off > ACCURACY * size {
                // Across a jump a quartic would overshoot.
                found.push(to, Trace::NODES.map(|s| nodes[0] + s * (nodes[4] - nodes[0])));
            } else {
                found.push(to, nodes);
            }
        }
        found.jump_at_end(value(end, false));
        Ok(found)
    }
}

fn reduced(reduction: Reduction, course: &Trace) -> f64 {
    let duration = course.end() - course.start();
    match reduction {
        Reduction::Initial => course.first(),
        Reduction::Final => course.last(),
        Reduction::Maximum => course.maximum().0,
        Reduction::Minimum => course.minimum().0,
        Reduction::Integral => course.integral(|_, y| y),
        Reduction::Mean => course.integral(|_, y| y) / duration,
        Reduction::Rms => (course.integral(|_, y| y * y) / duration).sqrt(),
    }
}

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        self.unit.clone()
    }

    fn signals(&self) -> Vec<String> {
        let signal = |course: &Course| if let Course::Signal(name, _) = course { Some(name.clone()) } else { None };
        let own = self.courses.iter().flat_map(|(.., names)| names.iter().filter_map(signal));
        let of_other = |source: &Source| if let Source::Criterion(of) = source { of.signals() } else { Vec::new() };
        own.chain(self.sources.iter().flat_map(of_other)).collect()
    }

    fn suits(&self, case: &Case) -> Result<(), StudyError> {
        let mut others =
            self.sources.iter().filter_map(|s| if let Source::Criterion(of) = s { Some(of) } else { None });
        others.try_for_each(|other| other.suits(case))
    }

    fn value(&self, _: &Case, _: &Analysis) -> Result<Value, String> {
        Err("a formula needs the parameters of the model".to_owned())
    }

    fn value_with(&self, case: &Case, analysis: &Analysis, parameters: &[f64]) -> Result<Value, String> {
        let mut numbers = Vec::new();
        for (reduction, formula, names) in &self.courses {
            numbers.push(reduced(*reduction, &self.course((formula, names), analysis, parameters)?));
        }
        let (mut values, mut missed): (Vec<f64>, Option<f64>) = (Vec::new(), None);
        for source in &self.sources {
            values.push(match source {
                Source::Reduced(index) => numbers[*index],
                Source::Parameter(index, unit) => in_coherent(parameters[*index], unit),
                Source::Criterion(of) => {
                    let value = of.value_with(case, analysis, parameters)?;
                    if let Some(Missed { horizon }) = value.missed {
                        let share = value.number / horizon.unwrap_or(1.0);
                        missed = Some(missed.map_or(share, |known| known.max(share)));
                    }
                    // A criterion in rad/s is one in whatever unit the study shows it.
                    let unit = of.unit();
                    unit.convert(value.number, &coherent(&unit)).expect("the coherent unit has the same dimension")
                }
            });
        }
        if let Some(share) = missed {
            let note = Some("a criterion in the formula was not reached");
            return Ok(Value { number: share, note, missed: Some(Missed { horizon: None }), ..Value::default() });
        }
        let number = self.formula.evaluate(&values);
        Ok(((number - self.unit.zero()) / self.unit.factor()).into())
    }
}
