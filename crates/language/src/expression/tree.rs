//! Expression tree: every node stores its position in the text.

use std::ops::Range;

use super::functions::Function;
use crate::{Scalar, Unit};

/// Node of an expression tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Kind of the node.
    pub form: Form,
    /// Byte range in the text.
    pub span: Range<usize>,
}

/// Kind of a [`Node`]. Conditions occur only where expected, as the parser checks.
#[derive(Debug, Clone, PartialEq)]
pub enum Form {
    /// Number, including `pi`.
    Number(f64),
    /// Number with its unit, `20 [degC]`, in the coherent SI unit.
    Quantity(f64, Unit),
    /// Named quantity.
    Name(String),
    /// Member of a family: `T[i-1]`.
    Member(String, Box<Node>),
    /// Time derivative of a quantity: `x'`, or `der(x)`.
    Rate(Box<Node>),
    /// Negation `-a`.
    Negative(Box<Node>),
    /// Sum or product, from left to right: `a - b + c` is `a`, then `- b`, then `+ c`. The list is flat, so that its
    /// length uses no stack.
    Chain(Box<Node>, Vec<(Operator, Node)>),
    /// Power `a ^ b`; `x^2^3` is `x^(2^3)`.
    Power(Box<Node>, Box<Node>),
    /// Function call `f(a, b, ..)`.
    Call(Function, Vec<Node>),
    /// Value of a lookup table of the model: `map(x)` or `map(x, y)`.
    Lookup(String, Vec<Node>),
    /// Number to which a time response is reduced: `integral(u^2)`.
    Reduced(Reduction, Box<Node>),
    /// Condition `a > b`.
    Compare(Comparison, Box<Node>, Box<Node>),
    /// Conjunction of conditions, `a and b`.
    All(Vec<Node>),
    /// Disjunction of conditions, `a or b`.
    Any(Vec<Node>),
    /// Negated condition.
    Not(Box<Node>),
}

/// Reduction of a time response to a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reduction {
    /// Value at the start.
    Initial,
    /// Value at the end.
    Final,
    /// Largest value.
    Maximum,
    /// Smallest value.
    Minimum,
    /// Integral over time, s.
    Integral,
    /// Integral divided by the duration.
    Mean,
    /// Square root of the mean square.
    Rms,
}

/// Names of the reductions in expressions.
pub const REDUCTIONS: [(&str, Reduction); 7] = [
    ("initial", Reduction::Initial),
    ("final", Reduction::Final),
    ("maximum", Reduction::Maximum),
    ("minimum", Reduction::Minimum),
    ("integral", Reduction::Integral),
    ("mean", Reduction::Mean),
    ("rms", Reduction::Rms),
];

/// Arithmetic operator between the operands of a [`Form::Chain`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operator {
    /// Sum `a + b`.
    Add,
    /// Difference `a - b`.
    Subtract,
    /// Product `a * b`.
    Multiply,
    /// Quotient `a / b`.
    Divide,
}

impl Operator {
    /// Returns the result for two operands.
    pub fn of<S: Scalar>(self, a: S, b: S) -> S {
        match self {
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide => a / b,
        }
    }
}

/// Comparison of two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Comparison {
    /// Greater than, `a > b`.
    Greater,
    /// At least, `a >= b`.
    AtLeast,
    /// Less than, `a < b`.
    Less,
    /// At most, `a <= b`.
    AtMost,
}

impl Comparison {
    /// Returns true if the comparison holds for these numbers.
    pub fn holds(self, a: f64, b: f64) -> bool {
        match self {
            Self::Greater => a > b,
            Self::AtLeast => a >= b,
            Self::Less => a < b,
            Self::AtMost => a <= b,
        }
    }
}

impl Node {
    /// Returns true for a condition, false for a number.
    pub fn is_condition(&self) -> bool {
        matches!(self.form, Form::Compare(..) | Form::All(_) | Form::Any(_) | Form::Not(_))
    }

    /// Returns the child nodes.
    pub fn children(&self) -> Vec<&Self> {
        match &self.form {
            Form::Number(_) | Form::Quantity(..) | Form::Name(_) => Vec::new(),
            Form::Member(_, a) | Form::Rate(a) | Form::Negative(a) | Form::Not(a) | Form::Reduced(_, a) => vec![a],
            Form::Chain(first, rest) => {
                std::iter::once(first.as_ref()).chain(rest.iter().map(|(_, node)| node)).collect()
            }
            Form::Power(a, b) | Form::Compare(_, a, b) => vec![a, b],
            Form::Call(_, nodes) | Form::Lookup(_, nodes) | Form::All(nodes) | Form::Any(nodes) => {
                nodes.iter().collect()
            }
        }
    }

    /// Replaces the form of every node for which `with` returns one; nodes below these are not visited.
    pub fn replace(&mut self, with: &mut impl FnMut(&Self) -> Option<Form>) {
        if let Some(form) = with(self) {
            self.form = form;
            return;
        }
        match &mut self.form {
            Form::Number(_) | Form::Quantity(..) | Form::Name(_) => {}
            Form::Member(_, a) | Form::Rate(a) | Form::Negative(a) | Form::Not(a) | Form::Reduced(_, a) => {
                a.replace(with)
            }
            Form::Chain(first, rest) => {
                first.replace(with);
                rest.iter_mut().for_each(|(_, node)| node.replace(with));
            }
            Form::Power(a, b) | Form::Compare(_, a, b) => [a, b].into_iter().for_each(|node| node.replace(with)),
            Form::Call(_, nodes) | Form::Lookup(_, nodes) | Form::All(nodes) | Form::Any(nodes) => {
                nodes.iter_mut().for_each(|node| node.replace(with));
            }
        }
    }

    /// Calls `visit` for this node and every node below it, in the order of the text.
    pub fn walk<'n>(&'n self, visit: &mut impl FnMut(&'n Self)) {
        visit(self);
        for child in self.children() {
            child.walk(visit);
        }
    }
}
