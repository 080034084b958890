//! What models share that are linear systems from the start: matrices over the scalar, their tangents, expressions in them.

use std::fmt;

use mops_core::expression::units::{Conflict, Dimensions, Measure, Named};
use mops_core::{
    Along, Analysis, DIRECTIONS, Dual, Expression, Failure, Job, Mistake, Parameter, Scalar, StateSpace, Unit,
    WithTangents,
};
use nalgebra::DMatrix;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::{self, Deserializer, Visitor};

/// A matrix, row by row.
pub(crate) type Rows<S> = Vec<Vec<S>>;

/// A linear system over the scalar.
pub(crate) struct Matrices<S> {
    pub a: Rows<S>,
    pub b: Rows<S>,
    pub c: Rows<S>,
    pub d: Rows<S>,
    /// Delay of the inputs, s.
    pub delay: S,
    pub states: Vec<String>,
}

/// A model that is a linear system.
pub(crate) trait LinearSystem {
    /// The system for given parameters.
    fn matrices<S: Scalar>(&self, parameters: &[S]) -> Result<Matrices<S>, Failure>;

    /// Names of the inputs and of the outputs.
    fn channels(&self) -> [Vec<String>; 2];
}

/// [`mops_core::Model::analyse`] of a linear system.
pub(crate) fn analyse(model: &impl LinearSystem, job: &Job<'_>) -> Result<Analysis, Failure> {
    let matrices = model.matrices(job.parameters)?;
    let system = part(model, &matrices, |x: f64| x);
    let all = [&system.a, &system.b, &system.c, &system.d];
    if !all.iter().all(|m| m.iter().all(|x| x.is_finite())) {
        return Err(Failure::Undefined("an entry of the system is not finite".into()));
    }
    if !(system.delay >= 0.0 && system.delay.is_finite()) {
        return Err(Failure::Undefined(format!("a delay must not be negative, but is {} s", system.delay)));
    }
    Ok(Analysis::Linear(system))
}

/// [`mops_core::Model::tangents`] of a linear system.
pub(crate) fn tangents(model: &impl LinearSystem, job: &Job<'_>, seeds: &[Vec<f64>]) -> Result<WithTangents, Failure> {
    let mut tangents = Vec::with_capacity(seeds.len());
    for seeds in seeds.chunks(DIRECTIONS) {
        let parameter = |(i, &value): (usize, &f64)| {
            let tangent = std::array::from_fn(|direction| seeds.get(direction).map_or(0.0, |seed| seed[i]));
            Dual { value, tangent }
        };
        let parameters: Vec<Along> = job.parameters.iter().enumerate().map(parameter).collect();
        let matrices = model.matrices(&parameters)?;
        let along = |direction: usize| part(model, &matrices, |x: Along| x.tangent[direction]);
        tangents.extend((0..seeds.len()).map(|direction| Analysis::Linear(along(direction))));
    }
    Ok((analyse(model, job)?, tangents))
}

/// The values of a system over the scalar, or its derivative along one direction.
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
        delay: take(m.delay),
    }
}

/// A transfer function in controllable canonical form: `A` by rows, `B`, `C`, `D`; coefficients of rising powers, those of
/// the denominator without the leading 1, those of the numerator at most one more.
pub(crate) fn canonical<S: Scalar>(numerator: &[S], denominator: &[S], states: Vec<String>, delay: S) -> Matrices<S> {
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

/// A number, or an expression of parameters: `-4.0`, `"-k/m"`.
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

/// An expression, bound to the places of its names among the parameters.
#[derive(Debug, Clone)]
pub(crate) struct Bound {
    expression: Expression,
    places: Vec<usize>,
}

impl Bound {
    /// Binds an entry; names that are new are added to the parameters.
    pub fn new(entry: &Entry, names: &mut Vec<String>) -> Self {
        let place = |name: &String| {
            names.iter().position(|known| known == name).unwrap_or_else(|| {
                names.push(name.clone());
                names.len() - 1
            })
        };
        Self { places: entry.0.names().iter().map(place).collect(), expression: entry.0.clone() }
    }

    /// All entries of a list.
    pub fn all(entries: &[Entry], names: &mut Vec<String>) -> Vec<Self> {
        entries.iter().map(|entry| Self::new(entry, names)).collect()
    }

    /// The value for given parameters.
    pub fn value<S: Scalar>(&self, parameters: &[S]) -> S {
        let values: Vec<S> = self.places.iter().map(|&i| parameters[i]).collect();
        self.expression.evaluate(&values)
    }
}

/// The values of parameters in coherent units, in which expressions compute.
pub(crate) fn coherent<S: Scalar>(parameters: &[Parameter], values: &[S]) -> Vec<S> {
    let coherent = |(parameter, value): (&Parameter, &S)| {
        let unit = &parameter.variable.unit;
        if unit.is_coherent() { *value } else { *value * unit.factor() + S::from(unit.zero()) }
    };
    parameters.iter().zip(values).map(coherent).collect()
}

/// Units by name: those that are not named are pure numbers.
pub(crate) struct Units<'a>(pub &'a [(String, String)]);

impl Units<'_> {
    /// Checks that every name is one of the `parameters` or `signals`, every unit a unit, and that every entry has a dimension.
    /// Coefficients are in SI units, so that signals must be, too.
    pub fn check<'e>(
        &self,
        parameters: &[String],
        signals: &[String],
        entries: impl IntoIterator<Item = &'e Bound>,
        delay: Option<&Bound>,
    ) -> Result<(), Mistake> {
        let known: Vec<&str> = parameters.iter().chain(signals).map(String::as_str).collect();
        for (name, unit) in self.0 {
            let wrong = |fact: String, help: String| Mistake::new(name, fact).with_help(help).within("units");
            if !known.contains(&name.as_str()) {
                let help = mops_core::suggestion(name, known.iter().copied());
                return Err(wrong(format!("there is no parameter, input or output `{name}`"), help));
            }
            let unit =
                Unit::parse(unit).map_err(|why| wrong(why, "as in units = { k = \"N/m\", m = \"kg\" }".to_owned()))?;
            if signals.contains(name) && !unit.is_coherent() {
                let si = if unit.is_angle() { "rad".to_owned() } else { unit.dimension().coherent() };
                let help = format!("declare it in {si}: coefficients are in SI units");
                return Err(wrong(format!("`{name}` of a linear system must be in an SI unit, found {unit}"), help));
            }
        }
        let mut dimensions = Dimensions::default();
        let measure = |name: &String| match self.0.iter().find(|(known, _)| known == name) {
            Some((_, unit)) => Measure::declared(name, &Unit::known(unit)),
            None => dimensions.open(name),
        };
        let mut named = Named(parameters.iter().cloned().zip(parameters.iter().map(measure)).collect());
        let wrong = |Conflict { fact, help, .. }: Conflict| {
            Mistake::new("units", format!("in an entry of the system {fact}")).with_help(help)
        };
        for entry in entries {
            dimensions.measure(&mut named, entry.expression.root()).map_err(wrong)?;
        }
        let Some(delay) = delay else { return Ok(()) };
        let second = Measure::declared("delay", &Unit::known("s"));
        dimensions.fits(&mut named, &second, delay.expression.root(), "a delay is a time").map_err(wrong)
    }

    /// The unit of a name, as text.
    pub fn of(&self, name: &str) -> &str {
        self.0.iter().find(|(known, _)| known == name).map_or("1", |(_, unit)| unit)
    }

    /// Parameters of these names.
    pub fn parameters(&self, names: &[String]) -> Vec<Parameter> {
        names.iter().map(|name| Parameter::new(name, self.of(name), "parameter of the system")).collect()
    }
}
