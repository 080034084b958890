//! Common parts of models that are linear systems: matrices over the scalar, their tangents, and expressions as
//! entries.

use std::fmt;

use mops_core::{
    Analysis, AnalysisKind, Failure, Instant, Interface, Job, Parameter, Plant, StudyError, Variable,
    model::WithTangents,
    plant::{Breaks, Memory, Past},
};
use mops_language::{
    DIRECTIONS, Dual, Dual7, Expression, Quantity, Scalar, Unit,
    expression::units::{Conflict, Dimensions, Measure, Named},
};
use mops_linear::StateSpace;
use nalgebra::DMatrix;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::{self, Deserializer, Visitor};

use crate::kernel::elements::delay::{Delay, pass_delays, remember_delays};
use crate::kernel::{PlantModel, Simulated, Tolerance};

/// Matrix, row by row.
pub(crate) type Rows<S> = Vec<Vec<S>>;

/// Linear system over the scalar.
pub(crate) struct Matrices<S> {
    pub a: Rows<S>,
    pub b: Rows<S>,
    pub c: Rows<S>,
    pub d: Rows<S>,
    /// Delay of the inputs, s, if there is one.
    pub delay: Option<S>,
    pub states: Vec<String>,
}

/// Model that is a linear system.
pub(crate) trait LinearSystem {
    /// Returns the system for given parameters.
    fn matrices<S: Scalar>(&self, parameters: &[S]) -> Result<Matrices<S>, Failure>;

    /// Returns the names of the inputs and of the outputs.
    fn channels(&self) -> [Vec<String>; 2];
}

/// A linear system as a plant that is simulated from rest.
pub(crate) struct InTime<G> {
    of: G,
    interface: Interface,
    states: Vec<Variable>,
}

impl<G: LinearSystem + Send + Sync> InTime<G> {
    /// Returns the model of a linear system with this interface and these states, simulated over time until the horizon
    /// (s).
    pub fn model(of: G, interface: &Interface, states: &[String], horizon: f64) -> Simulated<Self> {
        let interface = Interface { analysis: AnalysisKind::Time, horizon: Some(horizon), ..interface.clone() };
        let states = states.iter().map(|name| Variable::new(name, "1", "state of the system")).collect();
        Simulated::new(Self { of, interface, states })
    }
}

impl<G: LinearSystem + Send + Sync> PlantModel for InTime<G> {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
        let matrices = self.of.matrices(parameters)?;
        let Some(delay) = matrices.delay else { return Ok(Delayed { matrices, inputs: Vec::new() }) };
        if !(delay.value() > 0.0 && delay.value().is_finite()) {
            let fact = format!("expected a delay above 0 s for a simulation, found {} s", delay.value());
            return Err(Failure::Undefined(fact));
        }
        let inputs = self.interface.inputs.iter().map(|_| Delay::new(delay, S::from(0.0))).collect();
        Ok(Delayed { matrices, inputs })
    }

    fn states(&self) -> Vec<Variable> {
        self.states.clone()
    }
}

/// Linear system over time, with the delays of its inputs; none without a delay.
struct Delayed<S> {
    matrices: Matrices<S>,
    inputs: Vec<Delay<S>>,
}

impl<S: Scalar> Delayed<S> {
    /// Returns the products of rows with the state and with the inputs.
    fn sum(&self, [of_state, of_input]: [&[S]; 2], at: &Instant<'_, S>) -> S {
        let direct = product(of_state, at.x);
        if self.inputs.is_empty() {
            return direct + product(of_input, at.u);
        }
        of_input.iter().zip(&self.inputs).fold(direct, |sum, (b, input)| sum + *b * input.at(at.t))
    }
}

impl<S: Scalar> Plant<S> for Delayed<S> {
    fn start(&self) -> Vec<S> {
        vec![S::from(0.0); self.matrices.a.len()]
    }

    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        let Matrices { a, b, .. } = &self.matrices;
        for (dx, (a, b)) in dx.iter_mut().zip(a.iter().zip(b)) {
            *dx = self.sum([a, b], at);
        }
    }

    fn signal(&self, signal: usize, at: &Instant<'_, S>) -> S {
        self.sum([&self.matrices.c[signal], &self.matrices.d[signal]], at)
    }

    fn longest_step(&self) -> f64 {
        self.inputs.iter().map(Delay::longest_step).fold(f64::INFINITY, f64::min)
    }

    fn breaks(&self) -> Option<&dyn Breaks<S>> {
        (!self.inputs.is_empty()).then_some(self as _)
    }

    fn breaks_mut(&mut self) -> Option<&mut dyn Breaks<S>> {
        (!self.inputs.is_empty()).then_some(self as _)
    }

    fn memory(&self) -> Option<&dyn Memory<S>> {
        (!self.inputs.is_empty()).then_some(self as _)
    }

    fn memory_mut(&mut self) -> Option<&mut dyn Memory<S>> {
        (!self.inputs.is_empty()).then_some(self as _)
    }
}

impl<S: Scalar> Breaks<S> for Delayed<S> {
    fn next(&self, t: f64) -> f64 {
        self.inputs.iter().map(|delay| delay.next_break(t)).fold(f64::INFINITY, f64::min)
    }

    fn pass(&mut self, at: &Instant<'_, S>, x: &mut [S]) -> S {
        pass_delays(self, |system| &mut system.inputs, |_, _| {}, at, x)
    }
}

impl<S: Scalar> Memory<S> for Delayed<S> {
    fn begin(&mut self, at: &Instant<'_, S>, _: &mut [S]) {
        let past = self.past(at);
        self.hold(&past);
    }

    fn remember(&mut self, over: &Past<'_, S>) -> bool {
        remember_delays(&mut self.inputs, &Tolerance::default(), over)
    }

    fn delays(&self) -> Vec<f64> {
        self.inputs.iter().map(|delay| delay.time().value()).collect()
    }

    fn past(&self, at: &Instant<'_, S>) -> Vec<S> {
        at.u[..self.inputs.len()].to_vec()
    }

    fn delayed(&self, t: f64) -> Vec<S> {
        self.inputs.iter().map(|delay| delay.at(t)).collect()
    }

    fn hold(&mut self, past: &[S]) {
        self.inputs.iter_mut().zip(past).for_each(|(delay, &past)| delay.hold(past));
    }
}

fn product<S: Scalar>(row: &[S], column: &[S]) -> S {
    row.iter().zip(column).fold(S::from(0.0), |sum, (a, b)| sum + *a * *b)
}

/// Returns the end of the simulation of a linear system, if it is to be simulated over time.
pub(crate) fn horizon(given: Option<&Quantity>) -> Result<Option<f64>, StudyError> {
    let Some(given) = given else { return Ok(None) };
    given.to(&Unit::known("s")).map(Some).map_err(|why| StudyError::new("horizon", why))
}

/// Analyses a linear system; implements [`mops_core::Model::analyse`].
pub(crate) fn analyse(model: &impl LinearSystem, job: &Job<'_>) -> Result<Analysis, Failure> {
    let matrices = model.matrices(job.parameters)?;
    let system = part(model, &matrices, |x: f64| x);
    let all = [&system.a, &system.b, &system.c, &system.d];
    if !all.iter().all(|m| m.iter().all(|x| x.is_finite())) {
        return Err(Failure::Undefined("an entry of the system is not finite".into()));
    }
    if !(system.delay >= 0.0 && system.delay.is_finite()) {
        return Err(Failure::Undefined(format!("expected a delay of at least 0 s, found {} s", system.delay)));
    }
    Ok(Analysis::Linear(system))
}

/// Computes the tangents of a linear system; implements [`mops_core::Model::tangents`].
pub(crate) fn tangents(model: &impl LinearSystem, job: &Job<'_>, seeds: &[Vec<f64>]) -> Result<WithTangents, Failure> {
    let mut tangents = Vec::with_capacity(seeds.len());
    for seeds in seeds.chunks(DIRECTIONS) {
        let parameter = |(i, &value): (usize, &f64)| {
            let tangent = std::array::from_fn(|direction| seeds.get(direction).map_or(0.0, |seed| seed[i]));
            Dual { value, tangent }
        };
        let parameters: Vec<Dual7> = job.parameters.iter().enumerate().map(parameter).collect();
        let matrices = model.matrices(&parameters)?;
        let along = |direction: usize| part(model, &matrices, |x: Dual7| x.tangent[direction]);
        tangents.extend((0..seeds.len()).map(|direction| Analysis::Linear(along(direction))));
    }
    Ok((analyse(model, job)?, tangents))
}

/// Returns the values of a system over the scalar, or its derivative in one direction.
fn part<S: Scalar>(model: &impl LinearSystem, m: &Matrices<S>, take: impl Fn(S) -> f64) -> StateSpace {
    let [inputs, outputs] = model.channels();
    let n = m.states.len();
    let matrix = |rows: &Rows<S>, shape: [usize; 2]| DMatrix::from_fn(shape[0], shape[1], |i, j| take(rows[i][j]));
    StateSpace {
        a: matrix(&m.a, [n, n]),
        b: matrix(&m.b, [n, inputs.len()]),
        c: matrix(&m.c, [outputs.len(), n]),
        d: matrix(&m.d, [outputs.len(), inputs.len()]),
        states: m.states.clone(),
        inputs,
        outputs,
        delay: m.delay.map_or(0.0, take),
        period: None,
    }
}

/// Returns the controllable canonical form of a transfer function. Coefficients are in ascending powers. The
/// denominator omits its leading 1; the numerator has at most one coefficient more.
pub(crate) fn canonical<S: Scalar>(
    numerator: &[S],
    denominator: &[S],
    states: Vec<String>,
    delay: Option<S>,
) -> Matrices<S> {
    let (n, zero) = (denominator.len(), S::from(0.0));
    let above = |i: usize| numerator.get(i).copied().unwrap_or(zero);
    let direct = above(n);
    let mut a = vec![vec![zero; n]; n];
    for i in 0..n {
        if i + 1 < n {
            a[i][i + 1] = S::from(1.0);
        }
        a[n - 1][i] = -denominator[i];
    }
    let b = (0..n).map(|i| vec![S::from(if i + 1 == n { 1.0 } else { 0.0 })]).collect();
    let c = vec![(0..n).map(|i| above(i) - direct * denominator[i]).collect()];
    Matrices { a, b, c, d: vec![vec![direct]], delay, states }
}

/// Number, or expression of parameters: `-4.0`, `"-k/m"`.
#[derive(Debug, Clone)]
pub(crate) struct Entry(pub Expression);

impl<'de> Deserialize<'de> for Entry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrExpression;
        impl Visitor<'_> for NumberOrExpression {
            type Value = Entry;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number, or an expression of parameters")
            }
            fn visit_f64<E: de::Error>(self, number: f64) -> Result<Entry, E> {
                if number.is_finite() {
                    self.visit_str(&format!("{number:?}"))
                } else {
                    Err(E::custom("an entry must be finite"))
                }
            }
            #[allow(clippy::cast_precision_loss)]
            fn visit_i64<E: de::Error>(self, number: i64) -> Result<Entry, E> {
                self.visit_f64(number as f64)
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<Entry, E> {
                Expression::parse(text).map(Entry).map_err(|wrong| E::custom(wrong.message))
            }
        }
        deserializer.deserialize_any(NumberOrExpression)
    }
}

impl JsonSchema for Entry {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Entry".into()
    }
    fn inline_schema() -> bool {
        true
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["number", "string"] })
    }
}

/// Expression, with the indices of its names among the parameters.
#[derive(Debug, Clone)]
pub(crate) struct Bound {
    expression: Expression,
    places: Vec<usize>,
}

impl Bound {
    /// Binds an entry; new names are added to the parameters.
    pub fn new(entry: &Entry, names: &mut Vec<String>) -> Self {
        let place = |name: &String| {
            names.iter().position(|known| known == name).unwrap_or_else(|| {
                names.push(name.clone());
                names.len() - 1
            })
        };
        Self { places: entry.0.names().iter().map(place).collect(), expression: entry.0.clone() }
    }

    /// Binds a delay, which is not negative where it depends on no parameter.
    pub fn delay(entry: &Entry, names: &mut Vec<String>) -> Result<Self, StudyError> {
        let bound = Self::new(entry, names);
        let value: Option<f64> = bound.places.is_empty().then(|| bound.value(&[]));
        match value.filter(|value| !(*value >= 0.0 && value.is_finite())) {
            None => Ok(bound),
            Some(value) => Err(StudyError::new("delay", format!("expected a delay of at least 0 s, found {value} s"))),
        }
    }

    /// Binds all entries of a list.
    pub fn all(entries: &[Entry], names: &mut Vec<String>) -> Vec<Self> {
        entries.iter().map(|entry| Self::new(entry, names)).collect()
    }

    /// Returns the value for given parameters.
    pub fn value<S: Scalar>(&self, parameters: &[S]) -> S {
        let values: Vec<S> = self.places.iter().map(|&i| parameters[i]).collect();
        self.expression.evaluate(&values)
    }
}

/// Converts the values of parameters to coherent units, which expressions use.
pub(crate) fn coherent<S: Scalar>(parameters: &[Parameter], values: &[S]) -> Vec<S> {
    let coherent = |(parameter, value): (&Parameter, &S)| {
        let unit = &parameter.variable.unit;
        if unit.is_coherent() { *value } else { *value * unit.factor() + S::from(unit.zero()) }
    };
    parameters.iter().zip(values).map(coherent).collect()
}

/// Units by name; all other names are pure numbers.
pub(crate) struct Units<'a>(pub &'a [(String, String)]);

impl Units<'_> {
    /// Checks that every name is one of the `parameters` or `signals`, that every unit is valid, and that all entries
    /// have consistent dimensions. Coefficients are in SI units, so signals must be in SI units, too.
    pub fn check<'e>(
        &self,
        parameters: &[String],
        signals: &[String],
        entries: impl IntoIterator<Item = &'e Bound>,
        delay: Option<&Bound>,
    ) -> Result<(), StudyError> {
        let known: Vec<&str> = parameters.iter().chain(signals).map(String::as_str).collect();
        for (name, unit) in self.0 {
            let wrong = |fact: String, help: String| StudyError::new(name, fact).with_help(help).within("units");
            if !known.contains(&name.as_str()) {
                let help = mops_language::suggestion(name, known.iter().copied());
                return Err(wrong(format!("the system has no parameter, input or output `{name}`"), help));
            }
            let unit = Unit::parse(unit)
                .map_err(|why| wrong(why, "for example units = { k = \"N/m\", m = \"kg\" }".to_owned()))?;
            if signals.contains(name) && !unit.is_coherent() {
                let si = if unit.is_angle() { "rad".to_owned() } else { unit.dimension().coherent() };
                let help = format!("declare it in {si}: coefficients are in SI units");
                return Err(wrong(format!("expected an SI unit for `{name}` of a linear system, found {unit}"), help));
            }
        }
        let mut dimensions = Dimensions::default();
        let measure = |name: &String| match self.0.iter().find(|(known, _)| known == name) {
            Some((_, unit)) => Measure::declared(name, &Unit::known(unit)),
            None => dimensions.open(name),
        };
        let mut named = Named(parameters.iter().cloned().zip(parameters.iter().map(measure)).collect());
        let wrong = |Conflict { fact, help, .. }: Conflict| {
            StudyError::new("units", format!("in an entry of the system {fact}")).with_help(help)
        };
        for entry in entries {
            dimensions.measure(&mut named, entry.expression.root()).map_err(wrong)?;
        }
        let Some(delay) = delay else { return Ok(()) };
        let second = Measure::declared("delay", &Unit::known("s"));
        dimensions.fits(&mut named, &second, delay.expression.root(), "a delay must be a time").map_err(wrong)
    }

    /// Returns the unit of a name, as text.
    pub fn of(&self, name: &str) -> &str {
        self.0.iter().find(|(known, _)| known == name).map_or("1", |(_, unit)| unit)
    }

    /// Returns the parameters of these names.
    pub fn parameters(&self, names: &[String]) -> Vec<Parameter> {
        names.iter().map(|name| Parameter::new(name, self.of(name), "parameter of the system")).collect()
    }
}
