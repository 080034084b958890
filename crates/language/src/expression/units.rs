//! Dimensional analysis of expressions, and inference of the units of quantities declared without one.
//!
//! The terms of a sum and the sides of a comparison or of an equation have the same dimension. So do the limits of a
//! `clip` and the branches of an `if`. Arguments of `sin`, `exp` and similar functions are pure numbers. `sqrt` and
//! powers with a constant exponent raise the dimension to a power. The dimension of a quantity declared without a unit
//! is unknown and solved for: every rule is a linear equation between exponents.
//!
//! A number without a unit is a pure number in a product. As a whole term of a sum it counts in the coherent SI unit of
//! the other terms. This is refused if these are declared in other units. For example, 20 added to a temperature in
//! degC may be in degC or in K.
//!
//! Source: A. Kennedy, Programming Languages and Dimensions, University of Cambridge Technical Report 391 (1996),
//! chapter 3 (inference of dimensions by linear equations).

use std::f64::consts::PI;
use std::ops::Range;
use std::rc::Rc;

use mops_math as math;

use super::functions::Function;
use super::tree::{Form, Node, Operator};
use crate::{Unit, unit::Dimension};

/// Partly known dimension: a known one times powers of unknown ones.
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
    /// Returns true if the dimension is known to be that of a pure number.
    fn is_none(&self) -> bool {
        self.unknown.is_empty() && self.known.is_none()
    }

    fn times(mut self, other: &Self, exponent: f64) -> Self {
        self.known = self.known.times(&other.known, exponent);
        for &(unknown, power) in &other.unknown {
            match self.unknown.iter_mut().find(|(known, _)| *known == unknown) {
                Some((_, sum)) => *sum += exponent * power,
                None => self.unknown.push((unknown, exponent * power)),
            }
        }
        // Cancelled exponents keep rounding errors of thirds.
        self.unknown.retain(|(_, power)| power.abs() > 1e-9);
        self
    }
}

/// Classification of an expression as a number without a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Bare {
    /// Not a bare number.
    No,
    /// Zero, which is equal in all units except those of temperature.
    Zero,
    /// Number, with its value if it is a single literal.
    Number(Option<f64>),
}

/// Dimension of an expression, and the unit that results from the declared units in it.
#[derive(Debug, Clone)]
pub struct Measure {
    dimension: Open,
    /// Value of the resulting unit in the coherent one; `None` if the parts disagree.
    factor: Option<f64>,
    /// Number of temperature-scale zeros in the expression: 1 for a temperature in degC, 0 for a difference of two.
    zeros: f64,
    bare: Bare,
    /// True if the expression consists of quantities without a declared unit, and of numbers.
    loose: bool,
    /// First quantity in the expression whose unit is not coherent.
    foreign: Option<Rc<(String, Unit)>>,
}

/// Largest distance from 1 of a factor that counts as one: cm times 1/cm.
const ONE: f64 = 1e-9;

impl Measure {
    /// Returns the measure of a quantity declared in a unit.
    pub fn declared(name: &str, unit: &Unit) -> Self {
        let foreign = (!unit.is_coherent()).then(|| Rc::new((name.to_owned(), unit.clone())));
        Self {
            dimension: (*unit.dimension()).into(),
            factor: Some(unit.factor()),
            zeros: if unit.zero() == 0.0 { 0.0 } else { 1.0 },
            bare: Bare::No,
            loose: false,
            foreign,
        }
    }

    /// Returns the measure of a pure number.
    pub fn pure() -> Self {
        Self::number(Bare::No)
    }

    fn number(bare: Bare) -> Self {
        let dimension = Dimension::NONE.into();
        Self { dimension, factor: Some(1.0), zeros: 0.0, bare, loose: false, foreign: None }
    }

    /// Returns true if the expression consists of quantities without a declared unit.
    pub fn is_loose(&self) -> bool {
        self.loose
    }

    /// Returns the measure of the product with a power of another quantity.
    #[must_use]
    pub fn times(&self, other: &Self, exponent: f64) -> Self {
        let dimension = self.dimension.clone().times(&other.dimension, exponent);
        let power = |factor: f64| if exponent == 1.0 { factor } else { math::powf(factor, exponent) };
        let bare = match (self.bare, other.bare) {
            (Bare::No, _) | (_, Bare::No) => Bare::No,
            (Bare::Zero, _) => Bare::Zero,
            (_, Bare::Zero) if exponent > 0.0 => Bare::Zero,
            _ => Bare::Number(None),
        };
        // A temperature times a pure number remains a temperature; times anything else it is a difference.
        let zeros = |of: &Self, by: &Self| match by.bare {
            Bare::Number(Some(value)) => of.zeros * value,
            _ if by.dimension.is_none() => of.zeros,
            _ => 0.0,
        };
        let loose = |part: &Self| part.loose || part.bare != Bare::No;
        let product = Self {
            factor: self.factor.zip(other.factor).map(|(a, b)| a * power(b)),
            zeros: zeros(self, other) + if exponent == 1.0 { zeros(other, self) } else { 0.0 },
            bare,
            loose: bare == Bare::No && loose(self) && loose(other),
            foreign: self.foreign.clone().or_else(|| other.foreign.clone()),
            dimension,
        };
        // A ratio of lengths is a pure number, for any units of the lengths.
        if product.dimension.is_none() && !self.dimension.is_none() {
            return Self { factor: Some(1.0), foreign: None, ..product };
        }
        product
    }

    /// Returns the measure of the time derivative.
    #[must_use]
    pub fn rate(&self, time: &Self) -> Self {
        Self { zeros: 0.0, ..self.times(time, -1.0) }
    }

    fn is_temperature(&self) -> bool {
        self.zeros.abs() > ONE
    }

    /// Returns true if an added number could be in another unit than the coherent one.
    fn is_foreign(&self) -> bool {
        self.is_temperature() || self.factor.is_none_or(|factor| (factor - 1.0).abs() > ONE)
    }
}

/// Dimensional error at its position in the expression.
#[derive(Debug, Clone)]
pub struct Conflict {
    /// Byte range in the expression.
    pub span: Range<usize>,
    /// Error message, one sentence.
    pub fact: String,
    /// Suggested fix.
    pub help: String,
}

/// Quantities named in an expression.
pub trait Quantities {
    /// Error of a quantity.
    type Error;

    /// Returns the measure of a name, a member of a family or a derivative.
    ///
    /// # Errors
    /// If its definition is wrong.
    fn measure(&mut self, dimensions: &mut Dimensions, node: &Node) -> Result<Measure, Self::Error>;

    /// Returns the value of a named constant.
    fn constant(&self, name: &str) -> Option<f64>;

    /// Records a number and its position that counts in the coherent unit of the neighbouring terms.
    fn counts(&mut self, number: String, place: Range<usize>, dimension: Open);

    /// Converts a conflict in the present expression to an error.
    fn refuse(&self, conflict: Conflict) -> Self::Error;
}

/// Named quantities, for expressions without derivatives, families and constants.
pub struct Named(pub Vec<(String, Measure)>);

impl Quantities for Named {
    type Error = Conflict;

    /// # Panics
    /// At an unknown name.
    fn measure(&mut self, _: &mut Dimensions, node: &Node) -> Result<Measure, Conflict> {
        let Form::Name(name) = &node.form else { unreachable!("the parser accepts names only") };
        Ok(self.0.iter().find(|(known, _)| known == name).expect("names were checked").1.clone())
    }

    fn constant(&self, _: &str) -> Option<f64> {
        None
    }

    fn counts(&mut self, _: String, _: Range<usize>, _: Open) {}

    fn refuse(&self, conflict: Conflict) -> Conflict {
        conflict
    }
}

/// Dimensions of quantities declared without a unit, as inferred so far.
#[derive(Debug, Clone, Default)]
pub struct Dimensions {
    /// Name and inferred dimension of each.
    unknown: Vec<(String, Option<Open>)>,
}

impl Dimensions {
    /// Returns the measure of a quantity without a declared unit; its dimension follows from the terms it is used with.
    pub fn open(&mut self, name: &str) -> Measure {
        self.unknown.push((name.to_owned(), None));
        let dimension = Open { known: Dimension::NONE, unknown: vec![(self.unknown.len() - 1, 1.0)] };
        Measure { dimension, loose: true, ..Measure::pure() }
    }

    /// Returns the dimension of a measure as inferred so far; unknown parts count as a pure number.
    pub fn of(&self, measure: &Measure) -> Dimension {
        self.found(&measure.dimension)
    }

    /// Returns an open dimension as inferred so far; unknown parts count as a pure number.
    pub fn found(&self, dimension: &Open) -> Dimension {
        self.resolved(dimension).known
    }

    fn resolved(&self, open: &Open) -> Open {
        let mut resolved = open.clone();
        // Solved ones refer to others without a cycle, since each is solved in terms of those unknown at that time.
        while let Some(at) = resolved.unknown.iter().position(|&(unknown, _)| self.unknown[unknown].1.is_some()) {
            let (unknown, power) = resolved.unknown.swap_remove(at);
            if let Some(found) = &self.unknown[unknown].1 {
                resolved = resolved.times(found, power);
            }
        }
        resolved
    }

    /// Requires two dimensions to be equal; returns false if that is impossible.
    fn equal(&mut self, a: &Open, b: &Open) -> bool {
        let mut rest = self.resolved(&a.clone().times(b, -1.0));
        let Some((unknown, power)) = rest.unknown.pop() else { return rest.known.is_none() };
        self.unknown[unknown].1 = Some(Open::from(Dimension::NONE).times(&rest, -1.0 / power));
        true
    }

    /// Returns the measure of an expression.
    ///
    /// # Errors
    /// At the first part whose dimension is wrong.
    pub fn measure<Q: Quantities>(&mut self, quantities: &mut Q, node: &Node) -> Result<Measure, Q::Error> {
        Ok(match &node.form {
            // In a sum with an angle, pi is in rad.
            Form::Number(number) if *number == PI => Measure::pure(),
            Form::Number(number) => {
                Measure::number(if *number == 0.0 { Bare::Zero } else { Bare::Number(Some(*number)) })
            }
            Form::Quantity(number, unit) => Measure::declared(&format!("{number} [{unit}]"), unit),
            Form::Name(_) | Form::Member(..) | Form::Rate(_) => quantities.measure(self, node)?,
            Form::Negative(a) => {
                let of = self.measure(quantities, a)?;
                let minus = Measure::number(Bare::Number(Some(-1.0)));
                match of.bare {
                    Bare::Number(value) => Measure { bare: Bare::Number(value.map(|value| -value)), ..of },
                    Bare::Zero => of,
                    Bare::No => Measure { loose: of.loose, ..minus.times(&of, 1.0) },
                }
            }
            Form::Chain(first, rest) => {
                let sums = |operator: &Operator| matches!(operator, Operator::Add | Operator::Subtract);
                if rest.iter().all(|(operator, _)| sums(operator)) {
                    let mut terms =
                        vec![Part { measure: self.measure(quantities, first)?, node: Some(first), sign: 1.0 }];
                    for (operator, node) in rest {
                        let sign = if *operator == Operator::Add { 1.0 } else { -1.0 };
                        terms.push(Part { measure: self.measure(quantities, node)?, node: Some(node), sign });
                    }
                    return self.join(quantities, &terms, true, "terms of a sum must have the same dimension");
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
                self.alike(quantities, &[a, b], "both sides of a comparison must have the same dimension")?;
                Measure::pure()
            }
            Form::All(conditions) | Form::Any(conditions) => {
                for condition in conditions {
                    self.measure(quantities, condition)?;
                }
                Measure::pure()
            }
            Form::Not(condition) => self.measure(quantities, condition)?,
            Form::Reduced(..) | Form::Lookup(..) => unreachable!("they are replaced before"),
        })
    }

    /// Returns the joint measure of parts that must have the same dimension.
    fn alike<Q: Quantities>(&mut self, q: &mut Q, parts: &[&Node], rule: &str) -> Result<Measure, Q::Error> {
        let mut measured = Vec::with_capacity(parts.len());
        for part in parts {
            measured.push(Part { measure: self.measure(q, part)?, node: Some(part), sign: 1.0 });
        }
        self.join(q, &measured, false, rule)
    }

    /// Requires an expression to have the dimension of a quantity outside of it, such as a rate or a state that is
    /// reset.
    ///
    /// # Errors
    /// At the part whose dimension is wrong.
    pub fn fits<Q: Quantities>(
        &mut self,
        quantities: &mut Q,
        what: &Measure,
        node: &Node,
        rule: &str,
    ) -> Result<(), Q::Error> {
        let found = self.measure(quantities, node)?;
        let wanted = Part { measure: what.clone(), node: None, sign: 1.0 };
        let found = Part { measure: found, node: Some(node), sign: 1.0 };
        self.join(quantities, &[wanted, found], false, rule).map(|_| ())
    }

    /// Returns the joint measure of the two sides of an equation.
    ///
    /// # Errors
    /// At the part whose dimension is wrong.
    pub fn equate<Q: Quantities>(&mut self, q: &mut Q, sides: [&Node; 2]) -> Result<Measure, Q::Error> {
        self.alike(q, &sides, "both sides of an equation must have the same dimension")
    }

    /// Returns the joint measure of parts with the same dimension, of a sum or otherwise.
    fn join<Q: Quantities>(
        &mut self,
        q: &mut Q,
        parts: &[Part<'_>],
        is_sum: bool,
        rule: &str,
    ) -> Result<Measure, Q::Error> {
        let mut quantities = parts.iter().filter(|part| part.measure.bare == Bare::No);
        let Some(Part { measure: first, sign, .. }) = quantities.next() else {
            let all_zero = parts.iter().all(|part| part.measure.bare == Bare::Zero);
            return Ok(Measure::number(if all_zero { Bare::Zero } else { Bare::Number(None) }));
        };
        let mut joined = Measure { zeros: sign * first.zeros, ..first.clone() };
        for Part { measure: part, node, sign } in quantities {
            if !self.equal(&joined.dimension, &part.dimension) {
                let span = node.map_or(0..0, |node| node.span.clone());
                return Err(q.refuse(self.unlike(first, part, span, rule)));
            }
            let agree = joined.factor.zip(part.factor).filter(|(a, b)| (a / b - 1.0).abs() < ONE);
            joined.factor = match (part.loose, joined.loose) {
                (true, _) => joined.factor,
                (_, true) => part.factor,
                _ => agree.map(|(a, _)| a),
            };
            joined.zeros = if is_sum {
                joined.zeros + sign * part.zeros
            } else if joined.is_temperature() {
                joined.zeros
            } else {
                part.zeros
            };
            joined.loose &= part.loose;
            joined.foreign = joined.foreign.or_else(|| part.foreign.clone());
        }
        // A temperature in K minus one in degC is a difference: the subtracted zero of the scale belongs to the first
        // one.
        let in_kelvin = parts.iter().any(|part| part.measure.bare == Bare::No && !part.measure.is_temperature());
        if is_sum && joined.zeros < 0.0 && in_kelvin {
            joined.zeros = 0.0;
        }
        let foreign = joined.foreign.clone().filter(|_| joined.is_foreign());
        for Part { measure: part, node, .. } in parts {
            let Some(node) = node else { continue };
            match (&foreign, part.bare) {
                (None, Bare::Number(_)) => {
                    for (number, place) in literals(node) {
                        q.counts(number, place, first.dimension.clone());
                    }
                }
                (Some(foreign), Bare::Number(_)) => return Err(q.refuse(self.beside(&joined, node, foreign))),
                (Some(foreign), Bare::Zero) if joined.is_temperature() => {
                    return Err(q.refuse(self.beside(&joined, node, foreign)));
                }
                (Some(foreign), Bare::No) if part.loose => {
                    let (name, unit) = &**foreign;
                    let fact =
                        format!("a quantity without a declared unit next to {}, which is in {unit}", named(name));
                    let help = format!("declare its unit, such as {unit}");
                    return Err(q.refuse(Conflict { span: node.span.clone(), fact, help }));
                }
                _ => {}
            }
        }
        Ok(joined)
    }

    /// Returns the conflict between two parts of different dimension.
    fn unlike(&self, first: &Measure, part: &Measure, span: Range<usize>, rule: &str) -> Conflict {
        let unit = |measure: &Measure| {
            let open = self.resolved(&measure.dimension);
            let unknown = open.unknown.first().map(|&(unknown, _)| self.unknown[unknown].0.clone());
            let text = open.known.coherent();
            match unknown {
                Some(name) if open.known.is_none() => format!("the unit of `{name}`"),
                Some(name) => format!("{text} times the unit of `{name}`"),
                None => text,
            }
        };
        let fact = match (unit(part).as_str(), unit(first).as_str()) {
            ("1", other) => format!("expected a quantity in {other}, found a pure number"),
            (own, "1") => format!("expected a pure number, found a quantity in {own}"),
            (own, other) => format!("expected a quantity in {other}, found one in {own}"),
        };
        Conflict { span, fact, help: format!("{rule}; write a number with a unit as 9.81 [m/s2]") }
    }

    /// Returns the conflict between a number and a quantity that is not declared in the coherent unit.
    fn beside(&self, joined: &Measure, node: &Node, (name, unit): &(String, Unit)) -> Conflict {
        let fact = format!("a number without a unit next to {}, which is in {unit}", named(name));
        let place = literals(node).into_iter().next();
        let (number, span) = place.unwrap_or_else(|| ("0".to_owned(), node.span.clone()));
        let dimension = self.of(joined);
        let help = if number.starts_with('`') {
            let unit = if joined.is_temperature() { unit.to_string() } else { dimension.coherent() };
            format!("give {number} a unit where it is defined, as in \"3 [{unit}]\"")
        } else if joined.is_temperature() {
            let difference = unit.difference();
            format!("write {number} [{unit}] for a temperature, {number} [{difference}] for a temperature difference")
        } else if dimension.is_none() && unit.dimension().is_none() {
            let pure = if unit.is_angle() { "rad" } else { "1" };
            format!("write {number} [{unit}] or {number} [{pure}]")
        } else {
            let unit = if *unit.dimension() == dimension { unit.to_string() } else { dimension.coherent() };
            format!("write its unit, as in {number} [{unit}]")
        };
        Conflict { span, fact, help }
    }

    fn power<Q: Quantities>(&mut self, q: &mut Q, base: &Node, exponent: &Node) -> Result<Measure, Q::Error> {
        let of = self.measure(q, base)?;
        self.fits(q, &Measure::pure(), exponent, "an exponent must be a pure number")?;
        if let Some(value) = constant(exponent, q) {
            let one = Measure::number(of.bare);
            return Ok(Measure { loose: of.loose, ..one.times(&of, value) });
        }
        if !self.equal(&of.dimension, &Dimension::NONE.into()) {
            let fact = format!("expected a pure number, as the exponent varies, found a quantity in {}", self.of(&of));
            let help = "divide it by a reference value, so that the base of the power is a pure number".to_owned();
            return Err(q.refuse(Conflict { span: base.span.clone(), fact, help }));
        }
        Ok(Measure::pure())
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
            Function::Delay => {
                let time = Node { form: Form::Name("time".to_owned()), span: all[1].span.clone() };
                self.alike(q, &[all[1], &time], "the second argument of `delay` must be a time")?;
                self.measure(q, all[0])?
            }
            Function::Sign => {
                let of = self.measure(q, all[0])?;
                Measure::number(if of.bare == Bare::No { Bare::No } else { Bare::Number(None) })
            }
            Function::Min | Function::Max => {
                self.alike(q, &all, &format!("the arguments of `{}` must have the same dimension", function.name()))?
            }
            Function::Clip | Function::Deadzone => self.alike(
                q,
                &all,
                &format!("the limits of `{}` must have the dimension of its first argument", function.name()),
            )?,
            Function::Atan2 => {
                self.alike(q, &all, "the arguments of `atan2` must have the same dimension")?;
                Measure::pure()
            }
            Function::Table => {
                let places: Vec<&Node> = std::iter::once(all[0]).chain(all[1..].iter().copied().step_by(2)).collect();
                self.alike(q, &places, "the argument and the x of a `table` must have the same dimension")?;
                let values: Vec<&Node> = all[2..].iter().copied().step_by(2).collect();
                self.alike(q, &values, "the y of a `table` must have the same dimension")?
            }
            Function::If => {
                let (otherwise, pairs) = all.split_last().expect("the parser requires three arguments");
                for condition in pairs.iter().step_by(2) {
                    self.measure(q, condition)?;
                }
                let branches: Vec<&Node> =
                    pairs.iter().skip(1).step_by(2).chain(std::iter::once(otherwise)).copied().collect();
                self.alike(q, &branches, "the branches of an `if` must have the same dimension")?
            }
            _ => {
                let of = self.measure(q, all[0])?;
                if !self.equal(&of.dimension, &Dimension::NONE.into()) {
                    let fact =
                        format!("`{}` takes a pure number, found a quantity in {}", function.name(), self.of(&of));
                    let help = "divide it by a reference value, or multiply a time by a frequency".to_owned();
                    return Err(q.refuse(Conflict { span: all[0].span.clone(), fact, help }));
                }
                Measure::number(if of.bare == Bare::No { Bare::No } else { Bare::Number(None) })
            }
        })
    }
}

/// Part of a sum or of a comparison of dimensions; without a node if it is outside of the expression.
struct Part<'n> {
    measure: Measure,
    node: Option<&'n Node>,
    sign: f64,
}

/// Formats a quantity for a sentence; a number with its unit has no name.
fn named(name: &str) -> String {
    if name.contains('[') && name.ends_with(']') && name.starts_with(|c: char| c.is_ascii_digit() || c == '-') {
        return "a number".to_owned();
    }
    format!("`{name}`")
}

/// Returns the numbers of an expression without a unit, as shown to the user, with their positions; 0 is omitted.
fn literals(node: &Node) -> Vec<(String, Range<usize>)> {
    let all = |nodes: Vec<&Node>| nodes.into_iter().flat_map(literals).collect();
    let mut has_names = false;
    node.walk(&mut |node| has_names |= matches!(node.form, Form::Name(_) | Form::Member(..) | Form::Rate(_)));
    match &node.form {
        Form::Number(number) if *number == 0.0 => Vec::new(),
        Form::Name(name) => vec![(format!("`{name}`"), node.span.clone())],
        Form::Call(Function::If, arguments) => {
            let last = arguments.len() - 1;
            all(arguments.iter().enumerate().filter(|(i, _)| i % 2 == 1 || *i == last).map(|(_, node)| node).collect())
        }
        Form::Call(Function::Delay, arguments) => literals(&arguments[0]),
        Form::Call(Function::Table, arguments) => all(arguments.iter().skip(2).step_by(2).collect()),
        _ if has_names => all(node.children()),
        _ => vec![(node.evaluate(&|_: &str| f64::NAN).to_string(), node.span.clone())],
    }
}

/// Returns the value of an expression of numbers and constants.
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
