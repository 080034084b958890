//! Dimensions of expressions: what every part measures, and what the quantities measure that are declared without a unit.
//!
//! The terms of a sum, the sides of a comparison or of an equation, the limits of a `clip` and the branches of an `if` measure
//! the same; arguments of `sin`, `exp` and their like are pure numbers; `sqrt` and powers with a constant exponent raise the
//! dimension. A quantity that is declared without a unit has an unknown dimension, which is solved for: every rule is a linear
//! equation between exponents.
//!
//! A number without a unit is a pure number in a product. As a whole term of a sum it counts in the coherent SI unit of the
//! others, which is refused where these are declared in other units: nobody could tell whether 20 beside a temperature in degC
//! is in degC or in K.
//!
//! Source: A. Kennedy, Programming Languages and Dimensions, University of Cambridge Technical Report 391 (1996), chapter 3
//! (inference of dimensions by linear equations).

use std::ops::Range;
use std::rc::Rc;

use super::functions::Function;
use super::tree::{Form, Node, Operator};
use crate::math;
use crate::unit::{Dimension, Unit};

/// A dimension, as far as it is known: a known one times powers of unknown ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Open {
    known: Dimension,
    unknown: Vec<(usize, f64)>,
}

impl From<Dimension> for Open {
    fn from(known: Dimension) -> Self {
        Self { known, unknown: Vec::new() }
    }
}

impl Open {
    fn times(mut self, other: &Self, exponent: f64) -> Self {
        self.known = self.known.times(&other.known, exponent);
        for &(unknown, power) in &other.unknown {
            match self.unknown.iter_mut().find(|(known, _)| *known == unknown) {
                Some((_, sum)) => *sum += exponent * power,
                None => self.unknown.push((unknown, exponent * power)),
            }
        }
        // What cancels leaves roundings of thirds behind.
        self.unknown.retain(|(_, power)| power.abs() > 1e-9);
        self
    }
}

/// How a quantity that is made of numbers alone stands beside others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Bare {
    /// It is no such quantity.
    No,
    /// It is 0, which is the same in all units.
    Zero,
    /// It is a number.
    Number,
}

/// What an expression measures, and the unit that the units declared in it make.
#[derive(Debug, Clone)]
pub struct Measure {
    dimension: Open,
    /// The value of the declared unit in the coherent one; `None` where the parts do not agree.
    factor: Option<f64>,
    /// Whether it is a temperature on a scale with a zero of its own.
    shifted: bool,
    bare: Bare,
    /// Whether its unit was not declared.
    loose: bool,
    /// The first quantity in it whose unit is not coherent.
    foreign: Option<Rc<(String, Unit)>>,
}

/// Factors closer than this are one: cm times 1/cm.
const ONE: f64 = 1e-9;

impl Measure {
    /// That of a quantity declared in a unit.
    pub fn declared(name: &str, unit: &Unit) -> Self {
        let foreign = (!unit.is_coherent()).then(|| Rc::new((name.to_owned(), unit.clone())));
        Self {
            dimension: (*unit.dimension()).into(),
            factor: Some(unit.factor()),
            shifted: unit.zero() != 0.0,
            bare: Bare::No,
            loose: false,
            foreign,
        }
    }

    /// That of a pure number.
    pub fn pure() -> Self {
        Self::number(Bare::No)
    }

    fn number(bare: Bare) -> Self {
        let dimension = Dimension::NONE.into();
        Self { dimension, factor: Some(1.0), shifted: false, bare, loose: false, foreign: None }
    }

    /// Whether the unit of something in it was not declared.
    pub fn is_loose(&self) -> bool {
        self.loose
    }

    /// That of the product with a power of another quantity.
    #[must_use]
    pub fn times(&self, other: &Self, exponent: f64) -> Self {
        let dimension = self.dimension.clone().times(&other.dimension, exponent);
        let power = |factor: f64| if exponent == 1.0 { factor } else { math::powf(factor, exponent) };
        let bare = match (self.bare, other.bare) {
            (Bare::No, _) | (_, Bare::No) => Bare::No,
            (Bare::Zero, _) => Bare::Zero,
            (_, Bare::Zero) if exponent > 0.0 => Bare::Zero,
            _ => Bare::Number,
        };
        Self {
            dimension,
            factor: self.factor.zip(other.factor).map(|(a, b)| a * power(b)),
            shifted: self.shifted && other.bare != Bare::No
                || other.shifted && self.bare != Bare::No && exponent == 1.0,
            bare,
            loose: self.loose || other.loose,
            foreign: self.foreign.clone().or_else(|| other.foreign.clone()),
        }
    }

    /// That of its rate.
    #[must_use]
    pub fn rate(&self, time: &Self) -> Self {
        Self { shifted: false, ..self.times(time, -1.0) }
    }

    /// Whether a number beside it could be in another unit than the coherent one.
    fn is_foreign(&self) -> bool {
        self.shifted || self.factor.is_none_or(|factor| (factor - 1.0).abs() > ONE)
    }
}

/// What does not fit, at its place in the expression.
#[derive(Debug, Clone)]
pub struct Conflict {
    /// Bytes of the expression.
    pub span: Range<usize>,
    /// One sentence.
    pub fact: String,
    /// The way out.
    pub help: String,
}

/// The quantities that an expression names.
pub trait Quantities {
    /// An error in one of them.
    type Error;

    /// What a name, a member of a family or a derivative measures.
    ///
    /// # Errors
    /// What is wrong with its definition.
    fn measure(&mut self, dimensions: &mut Dimensions, node: &Node) -> Result<Measure, Self::Error>;

    /// The value of a named constant.
    fn constant(&self, name: &str) -> Option<f64>;

    /// Takes note of a number that counts in the coherent unit of its neighbours.
    fn counts(&mut self, number: &Node, dimension: Open);

    /// The error for what does not fit in the present expression.
    fn refuse(&self, conflict: Conflict) -> Self::Error;
}

/// The dimensions of quantities that were declared without a unit, as they are found.
#[derive(Debug, Clone, Default)]
pub struct Dimensions {
    /// Name, and what it was found to be.
    unknown: Vec<(String, Option<Open>)>,
}

impl Dimensions {
    /// A quantity without a unit; its dimension is found by what it stands beside.
    pub fn open(&mut self, name: &str) -> Measure {
        self.unknown.push((name.to_owned(), None));
        let dimension = Open { known: Dimension::NONE, unknown: vec![(self.unknown.len() - 1, 1.0)] };
        Measure { dimension, loose: true, ..Measure::pure() }
    }

    /// The dimension of what was measured, with all that is known by now; what is still open counts as a pure number.
    pub fn of(&self, measure: &Measure) -> Dimension {
        self.found(&measure.dimension)
    }

    /// An open dimension, with all that is known by now; what is still open counts as a pure number.
    pub fn found(&self, dimension: &Open) -> Dimension {
        self.resolved(dimension).known
    }

    fn resolved(&self, open: &Open) -> Open {
        let mut sum = Open::from(open.known);
        for &(unknown, power) in &open.unknown {
            match &self.unknown[unknown].1 {
                Some(found) => sum = sum.times(&self.resolved(found), power),
                None => sum = sum.times(&Open { known: Dimension::NONE, unknown: vec![(unknown, 1.0)] }, power),
            }
        }
        sum
    }

    /// Asks for one dimension; whether that can be.
    fn equal(&mut self, a: &Open, b: &Open) -> bool {
        let mut rest = self.resolved(&a.clone().times(b, -1.0));
        let Some((unknown, power)) = rest.unknown.pop() else { return rest.known.is_none() };
        self.unknown[unknown].1 = Some(Open::from(Dimension::NONE).times(&rest, -1.0 / power));
        true
    }

    /// What an expression measures.
    ///
    /// # Errors
    /// The first part that does not fit.
    pub fn measure<Q: Quantities>(&mut self, quantities: &mut Q, node: &Node) -> Result<Measure, Q::Error> {
        Ok(match &node.form {
            Form::Number(number) => Measure::number(if *number == 0.0 { Bare::Zero } else { Bare::Number }),
            Form::Quantity(_, unit) => Measure { dimension: (*unit.dimension()).into(), ..Measure::pure() },
            Form::Name(_) | Form::Member(..) | Form::Rate(_) => quantities.measure(self, node)?,
            Form::Negative(a) => self.measure(quantities, a)?,
            Form::Chain(first, rest) => {
                let sums = |operator: &Operator| matches!(operator, Operator::Add | Operator::Subtract);
                if rest.iter().all(|(operator, _)| sums(operator)) {
                    let parts: Vec<&Node> =
                        std::iter::once(&**first).chain(rest.iter().map(|(_, node)| node)).collect();
                    return self.alike(quantities, &parts, "the terms of a sum measure the same");
                }
                let mut product = self.measure(quantities, first)?;
                for (operator, factor) in rest {
                    let exponent = if *operator == Operator::Divide { -1.0 } else { 1.0 };
                    product = product.times(&self.measure(quantities, factor)?, exponent);
                }
                product
            }
            Form::Power(base, exponent) => self.power(quantities, base, exponent)?,
            Form::Call(function, arguments) => self.call(quantities, *function, arguments)?,
            Form::Compare(_, a, b) => {
                self.alike(quantities, &[a, b], "the sides of a comparison measure the same")?;
                Measure::pure()
            }
            Form::All(conditions) | Form::Any(conditions) => {
                for condition in conditions {
                    self.measure(quantities, condition)?;
                }
                Measure::pure()
            }
            Form::Not(condition) => self.measure(quantities, condition)?,
        })
    }

    /// What parts that measure the same measure.
    fn alike<Q: Quantities>(&mut self, q: &mut Q, parts: &[&Node], rule: &str) -> Result<Measure, Q::Error> {
        let mut measures = Vec::with_capacity(parts.len());
        for part in parts {
            measures.push((self.measure(q, part)?, Some(*part)));
        }
        self.join(q, &measures, rule)
    }

    /// Asks that an expression measures what a quantity measures that is not part of it: a rate, a state that is reset.
    ///
    /// # Errors
    /// The part that does not fit.
    pub fn fits<Q: Quantities>(
        &mut self,
        quantities: &mut Q,
        what: &Measure,
        node: &Node,
        rule: &str,
    ) -> Result<(), Q::Error> {
        let found = self.measure(quantities, node)?;
        self.join(quantities, &[(what.clone(), None), (found, Some(node))], rule).map(|_| ())
    }

    /// What the two sides of an equation measure.
    ///
    /// # Errors
    /// The part that does not fit.
    pub fn equate<Q: Quantities>(&mut self, q: &mut Q, sides: [&Node; 2]) -> Result<Measure, Q::Error> {
        self.alike(q, &sides, "the sides of an equation measure the same")
    }

    fn join<Q: Quantities>(
        &mut self,
        q: &mut Q,
        parts: &[(Measure, Option<&Node>)],
        rule: &str,
    ) -> Result<Measure, Q::Error> {
        let Some((first, _)) = parts.iter().find(|(part, _)| part.bare == Bare::No) else {
            let all_zero = parts.iter().all(|(part, _)| part.bare == Bare::Zero);
            return Ok(Measure::number(if all_zero { Bare::Zero } else { Bare::Number }));
        };
        let (mut joined, mut foreign) = (first.clone(), None);
        for (part, node) in parts.iter().filter(|(part, _)| part.bare == Bare::No) {
            if !self.equal(&joined.dimension, &part.dimension) {
                let span = node.map_or(0..0, |node| node.span.clone());
                return Err(q.refuse(self.unlike(first, part, span, rule)));
            }
            if !part.loose && part.is_foreign() {
                foreign = foreign.or_else(|| part.foreign.clone());
            }
            let agree = joined.factor.zip(part.factor).filter(|(a, b)| (a / b - 1.0).abs() < ONE);
            joined.factor = if part.loose {
                joined.factor
            } else if joined.loose {
                part.factor
            } else {
                agree.map(|(a, _)| a)
            };
            joined.shifted |= part.shifted;
            joined.loose &= part.loose;
            joined.foreign = joined.foreign.or_else(|| part.foreign.clone());
        }
        for (part, node) in parts {
            let Some(node) = node else { continue };
            let Some(foreign) = &foreign else {
                if part.bare == Bare::Number {
                    q.counts(node, first.dimension.clone());
                }
                continue;
            };
            let silent = match part.bare {
                Bare::Number => false,
                Bare::Zero => !joined.shifted,
                Bare::No => !(part.loose && matches!(node.form, Form::Name(_) | Form::Member(..))),
            };
            if !silent {
                return Err(q.refuse(self.beside(part, node, foreign)));
            }
        }
        Ok(joined)
    }

    /// Two parts that do not measure the same.
    fn unlike(&self, first: &Measure, part: &Measure, span: Range<usize>, rule: &str) -> Conflict {
        let unit = |measure: &Measure| {
            let open = self.resolved(&measure.dimension);
            let unknown = open.unknown.first().map(|&(unknown, _)| self.unknown[unknown].0.clone());
            let text = open.known.coherent();
            unknown.map_or(text.clone(), |name| format!("{text} times the unit of `{name}`"))
        };
        let fact = match (unit(part).as_str(), unit(first).as_str()) {
            ("1", other) => format!("expected a quantity in {other}, found a pure number"),
            (own, "1") => format!("expected a pure number, found a quantity in {own}"),
            (own, other) => format!("expected a quantity in {other}, found one in {own}"),
        };
        Conflict { span, fact, help: format!("{rule}; a number with a unit is written 9.81 [m/s2]") }
    }

    /// A number beside a quantity that is declared in another than the coherent unit.
    fn beside(&self, part: &Measure, node: &Node, (name, unit): &(String, Unit)) -> Conflict {
        let span = node.span.clone();
        let neighbour = format!("beside `{name}` in {unit} ");
        if part.bare == Bare::No {
            let fact = format!("{neighbour}stands a quantity that is declared without a unit");
            return Conflict { span, fact, help: format!("declare its unit, such as {unit}") };
        }
        let fact = format!("{neighbour}stands a number without a unit");
        let number = node.evaluate(&|_: &str| f64::NAN);
        let help = format!("write its unit: {number} [{unit}]");
        Conflict { span, fact, help }
    }

    fn power<Q: Quantities>(&mut self, q: &mut Q, base: &Node, exponent: &Node) -> Result<Measure, Q::Error> {
        let of = self.measure(q, base)?;
        self.fits(q, &Measure::pure(), exponent, "an exponent is a pure number")?;
        if let Some(value) = constant(exponent, q) {
            let one = Measure::number(of.bare);
            return Ok(Measure { loose: of.loose, ..one.times(&of, value) });
        }
        if !self.equal(&of.dimension, &Dimension::NONE.into()) {
            let fact = format!("expected a pure number, as the exponent varies, found a quantity in {}", self.of(&of));
            let help = "divide it by a reference value, so that the base of the power is a pure number".to_owned();
            return Err(q.refuse(Conflict { span: base.span.clone(), fact, help }));
        }
        Ok(Measure { loose: false, ..Measure::number(of.bare) })
    }

    fn call<Q: Quantities>(&mut self, q: &mut Q, function: Function, arguments: &[Node]) -> Result<Measure, Q::Error> {
        let all: Vec<&Node> = arguments.iter().collect();
        Ok(match function {
            Function::Sqrt => {
                let of = self.measure(q, all[0])?;
                let one = Measure::number(of.bare);
                Measure { loose: of.loose, ..one.times(&of, 0.5) }
            }
            Function::Abs => self.measure(q, all[0])?,
            Function::Sign => {
                let of = self.measure(q, all[0])?;
                Measure::number(of.bare)
            }
            Function::Min | Function::Max => {
                self.alike(q, &all, &format!("the arguments of `{}` measure the same", function.name()))?
            }
            Function::Clip | Function::Deadzone => {
                self.alike(q, &all, &format!("the limits of `{}` measure what it limits", function.name()))?
            }
            Function::Atan2 => {
                self.alike(q, &all, "the arguments of `atan2` measure the same")?;
                Measure::pure()
            }
            Function::Table => {
                let places: Vec<&Node> = std::iter::once(all[0]).chain(all[1..].iter().copied().step_by(2)).collect();
                self.alike(q, &places, "the x of a `table` measure the same")?;
                let values: Vec<&Node> = all[2..].iter().copied().step_by(2).collect();
                self.alike(q, &values, "the y of a `table` measure the same")?
            }
            Function::If => {
                let (otherwise, pairs) = all.split_last().expect("the reader asks for three arguments");
                for condition in pairs.iter().step_by(2) {
                    self.measure(q, condition)?;
                }
                let branches: Vec<&Node> =
                    pairs.iter().skip(1).step_by(2).chain(std::iter::once(otherwise)).copied().collect();
                self.alike(q, &branches, "the branches of an `if` measure the same")?
            }
            _ => {
                let of = self.measure(q, all[0])?;
                if !self.equal(&of.dimension, &Dimension::NONE.into()) {
                    let fact =
                        format!("`{}` takes a pure number, found a quantity in {}", function.name(), self.of(&of));
                    let help = "divide it by a reference value, or multiply a time by a frequency".to_owned();
                    return Err(q.refuse(Conflict { span: all[0].span.clone(), fact, help }));
                }
                Measure::number(if of.bare == Bare::No { Bare::No } else { Bare::Number })
            }
        })
    }
}

/// The value of an expression of numbers and constants.
fn constant<Q: Quantities>(node: &Node, quantities: &Q) -> Option<f64> {
    let mut fixed = true;
    node.walk(&mut |node| {
        fixed &= match &node.form {
            Form::Name(name) => quantities.constant(name).is_some(),
            Form::Member(..) | Form::Rate(_) => false,
            _ => true,
        };
    });
    fixed.then(|| node.evaluate(&|name: &str| quantities.constant(name).unwrap_or(f64::NAN)))
}
