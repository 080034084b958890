//! Plant given by its transfer function or by matrices, whose entries may be parameters of the model.

use mops_core::{Failure, StudyError};
use mops_language::Scalar;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::{self, Deserializer, Visitor};

/// Transfer function, given by poles and zeros, by coefficients, or by state-space matrices.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub(crate) struct PlantOptions {
    /// Real poles, 1/s.
    poles: Option<Vec<Coefficient>>,
    /// Real zeros, 1/s.
    zeros: Vec<Coefficient>,
    /// Factor `gain` of `gain (s - z1)(s - z2)... / ((s - p1)(s - p2)...)`.
    gain: Option<Coefficient>,
    /// Coefficients of the numerator, in descending powers of s.
    numerator: Option<Vec<Coefficient>>,
    /// Coefficients of the denominator, in descending powers of s.
    denominator: Option<Vec<Coefficient>>,
    /// Matrix `A` of `dx/dt = A x + b u`, `y = c x`, row by row.
    a: Option<Vec<Vec<Coefficient>>>,
    /// Vector `b`.
    b: Option<Vec<Coefficient>>,
    /// Vector `c`.
    c: Option<Vec<Coefficient>>,
}

/// Number, or name of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Coefficient {
    Number(f64),
    Name(String),
}

impl<'de> Deserialize<'de> for Coefficient {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrName;
        impl Visitor<'_> for NumberOrName {
            type Value = Coefficient;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number, or the name of a parameter")
            }
            fn visit_f64<E: de::Error>(self, number: f64) -> Result<Coefficient, E> {
                if number.is_finite() {
                    Ok(Coefficient::Number(number))
                } else {
                    Err(E::custom("a coefficient must be finite"))
                }
            }
            #[allow(clippy::cast_precision_loss)]
            fn visit_i64<E: de::Error>(self, number: i64) -> Result<Coefficient, E> {
                Ok(Coefficient::Number(number as f64))
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<Coefficient, E> {
                Ok(Coefficient::Name(name.to_owned()))
            }
        }
        deserializer.deserialize_any(NumberOrName)
    }
}

impl JsonSchema for Coefficient {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Coefficient".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["number", "string"], "description": "a number, or the name of a parameter" })
    }
}

/// Strictly proper transfer function whose coefficients may be parameters.
#[derive(Debug, Clone)]
pub(crate) struct TransferFunction {
    form: Form,
}

#[derive(Debug, Clone)]
enum Form {
    Roots { poles: Vec<Slot>, zeros: Vec<Slot>, gain: Slot },
    Coefficients { numerator: Vec<Slot>, denominator: Vec<Slot> },
    Matrices { a: Vec<Vec<Slot>>, b: Vec<Slot>, c: Vec<Slot> },
}

/// Number, or index into the parameters named in the plant.
#[derive(Debug, Clone, Copy)]
enum Slot {
    Number(f64),
    Named(usize),
}

impl Slot {
    fn value<S: Scalar>(self, named: &[S]) -> S {
        match self {
            Self::Number(number) => S::from(number),
            Self::Named(index) => named[index],
        }
    }
}

impl TransferFunction {
    /// Checks the plant. Adds to `names` the parameters that the plant names, which must not be `taken`.
    pub fn new(plant: &PlantOptions, taken: &[&str], names: &mut Vec<String>) -> Result<Self, StudyError> {
        let mut slots = |key: &str, list: &[Coefficient]| -> Result<Vec<Slot>, StudyError> {
            list.iter().map(|c| slot(c, taken, names).map_err(|m| m.within(key))).collect()
        };
        let others = [&plant.poles, &plant.numerator, &plant.denominator];
        let is_function = others.iter().any(|other| other.is_some()) || plant.gain.is_some() || !plant.zeros.is_empty();
        if is_function && (plant.a.is_some() || plant.b.is_some() || plant.c.is_some()) {
            return Err(StudyError::here("a plant is given by matrices or by its transfer function, not by both"));
        }
        if let (Some(a), Some(b), Some(c)) = (&plant.a, &plant.b, &plant.c) {
            let n = a.len();
            if n == 0 || a.iter().any(|row| row.len() != n) || b.len() != n || c.len() != n {
                let fact = "expected a square matrix `a`, and as many entries in `b` and `c`";
                return Err(
                    StudyError::here(fact).with_help("for example a = [[0, 1], [-2, -3]], b = [0, 1], c = [1, 0]")
                );
            }
            let a = a.iter().map(|row| slots("a", row)).collect::<Result<_, _>>()?;
            return Ok(Self { form: Form::Matrices { a, b: slots("b", b)?, c: slots("c", c)? } });
        }
        let form = match (&plant.poles, &plant.numerator, &plant.denominator) {
            (Some(poles), None, None) => {
                let gain = plant.gain.clone().unwrap_or(Coefficient::Number(1.0));
                Form::Roots {
                    poles: slots("poles", poles)?,
                    zeros: slots("zeros", &plant.zeros)?,
                    gain: slots("gain", &[gain])?[0],
                }
            }
            (None, Some(numerator), Some(denominator)) => {
                if plant.gain.is_some() || !plant.zeros.is_empty() {
                    return Err(StudyError::here("`gain` and `zeros` require `poles` instead of coefficients"));
                }
                Form::Coefficients {
                    numerator: slots("numerator", numerator)?,
                    denominator: slots("denominator", denominator)?,
                }
            }
            _ => {
                return Err(StudyError::here("expected poles, or numerator and denominator, or a, b and c, of the plant")
                    .with_help("for example plant = { poles = [0.0, -4.0, -1.0], gain = 1.0 }, or { numerator = [1.0], denominator = [1.0, 5.0, 4.0, 0.0] }"));
            }
        };
        let (above, below) = match &form {
            Form::Roots { poles, zeros, .. } => (zeros.len(), poles.len()),
            Form::Coefficients { numerator, denominator } => {
                (numerator.len().saturating_sub(1), denominator.len().saturating_sub(1))
            }
            Form::Matrices { a, .. } => (0, a.len()),
        };
        if above >= below {
            return Err(StudyError::here(format!(
                "expected a strictly proper plant, found order {above} over order {below}"
            ))
            .with_help("add the pole of the actuator or the sensor"));
        }
        Ok(Self { form })
    }

    /// Returns the number of states.
    pub fn order(&self) -> usize {
        match &self.form {
            Form::Roots { poles, .. } => poles.len(),
            Form::Coefficients { denominator, .. } => denominator.len().saturating_sub(1),
            Form::Matrices { a, .. } => a.len(),
        }
    }

    /// Returns the coefficients of numerator and denominator in ascending powers, normalised to a leading 1 of the
    /// denominator, which is omitted.
    pub fn polynomials<S: Scalar>(&self, named: &[S]) -> Result<(Vec<S>, Vec<S>), Failure> {
        let values = |slots: &[Slot]| -> Vec<S> { slots.iter().map(|s| s.value(named)).collect() };
        let (mut numerator, mut denominator) = match &self.form {
            Form::Roots { poles, zeros, gain } => {
                let gain = gain.value(named);
                let numerator = from_roots(&values(zeros)).into_iter().map(|c| gain * c).collect();
                (numerator, from_roots(&values(poles)))
            }
            Form::Coefficients { numerator, denominator } => {
                let (mut above, mut below) = (values(numerator), values(denominator));
                above.reverse();
                below.reverse();
                (above, below)
            }
            Form::Matrices { a, b, c } => {
                let a: Vec<Vec<S>> = a.iter().map(|row| values(row)).collect();
                from_matrices(&a, &values(b), &values(c))
            }
        };
        let leading = denominator.pop().unwrap_or(S::from(0.0));
        if leading.value() == 0.0 {
            return Err(Failure::Undefined("the leading coefficient of the plant's denominator is 0".into()));
        }
        numerator.iter_mut().chain(&mut denominator).for_each(|c| *c = *c / leading);
        numerator.resize(denominator.len(), S::from(0.0));
        Ok((numerator, denominator))
    }
}

fn slot(coefficient: &Coefficient, taken: &[&str], names: &mut Vec<String>) -> Result<Slot, StudyError> {
    match coefficient {
        Coefficient::Number(number) => Ok(Slot::Number(*number)),
        Coefficient::Name(name) if !is_name(name) => {
            let help = "an expression is possible in `transfer-function`, `state-space` and `equations` (with `pid`)";
            Err(StudyError::here(format!("expected a number or the name of a parameter, found `{name}`"))
                .with_help(help))
        }
        Coefficient::Name(name) if taken.contains(&name.as_str()) => {
            Err(StudyError::here(format!("`{name}` is a parameter of the controller"))
                .with_help("give the plant's parameter another name"))
        }
        Coefficient::Name(name) => Ok(Slot::Named(names.iter().position(|known| known == name).unwrap_or_else(|| {
            names.push(name.clone());
            names.len() - 1
        }))),
    }
}

/// Returns true if a text can be the name of a parameter.
fn is_name(text: &str) -> bool {
    let mut letters = text.chars();
    letters.next().is_some_and(|c| c.is_alphabetic() || c == '_') && letters.all(|c| c.is_alphanumeric() || c == '_')
}

/// Returns numerator and denominator, in ascending powers, of `c (s - A)^-1 b`, by the method of Leverrier and Faddeev:
/// the adjugate of `s - A` is a polynomial in s, whose matrices and those of the determinant follow from each other.
///
/// Source: D. K. Faddeev, V. N. Faddeeva, Computational Methods of Linear Algebra (1963).
fn from_matrices<S: Scalar>(a: &[Vec<S>], b: &[S], c: &[S]) -> (Vec<S>, Vec<S>) {
    let n = a.len();
    let zero = S::from(0.0);
    let sum = |count: usize, term: &dyn Fn(usize) -> S| (0..count).fold(zero, |sum, i| sum + term(i));
    let (mut numerator, mut denominator) = (vec![zero; n], vec![zero; n + 1]);
    denominator[n] = S::from(1.0);
    // Matrix of the adjugate at a power of s.
    let mut part: Vec<Vec<S>> =
        (0..n).map(|i| (0..n).map(|j| S::from(f64::from(u8::from(i == j)))).collect()).collect();
    let mut count = 0.0;
    for power in (0..n).rev() {
        count += 1.0;
        numerator[power] = sum(n, &|i| c[i] * sum(n, &|j| part[i][j] * b[j]));
        let mut next: Vec<Vec<S>> =
            (0..n).map(|i| (0..n).map(|j| sum(n, &|k| a[i][k] * part[k][j])).collect()).collect();
        let coefficient = sum(n, &|i| next[i][i]) * (-1.0 / count);
        denominator[power] = coefficient;
        (0..n).for_each(|i| next[i][i] += coefficient);
        part = next;
    }
    (numerator, denominator)
}

/// Returns the coefficients, in ascending powers, of `(s - r1)(s - r2)...`.
pub(crate) fn from_roots<S: Scalar>(roots: &[S]) -> Vec<S> {
    let mut polynomial = vec![S::from(1.0)];
    for &root in roots {
        polynomial.push(S::from(0.0));
        for i in (0..polynomial.len()).rev() {
            let lower = if i > 0 { polynomial[i - 1] } else { S::from(0.0) };
            polynomial[i] = lower - root * polynomial[i];
        }
    }
    polynomial
}
