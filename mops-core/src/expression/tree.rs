//! What an expression is once it is read: a tree whose every node knows where it stands in the text.

use std::ops::Range;

use super::functions::Function;
use crate::scalar::Scalar;
use crate::unit::Unit;

/// A part of an expression.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// What it is.
    pub form: Form,
    /// Bytes of the text.
    pub span: Range<usize>,
}

/// The kinds of [`Node`]. A condition stands only where one is expected; the reader checks that.
#[derive(Debug, Clone, PartialEq)]
pub enum Form {
    /// A number, `pi` included.
    Number(f64),
    /// A number with its unit, `20 [degC]`; its value is that in the coherent SI unit.
    Quantity(f64, Unit),
    /// A named quantity.
    Name(String),
    /// A member of a family: `T[i-1]`.
    Member(String, Box<Node>),
    /// The derivative of a quantity with respect to time: `x'`, or `der(x)`.
    Rate(Box<Node>),
    /// `-a`.
    Negative(Box<Node>),
    /// A sum or a product, from left to right: `a - b + c` is `a`, then `- b`, then `+ c`. It is flat, so that its length
    /// takes no stack.
    Chain(Box<Node>, Vec<(Operator, Node)>),
    /// `a ^ b`; `x^2^3` is `x^(2^3)`.
    Power(Box<Node>, Box<Node>),
    /// `f(a, b, ..)`.
    Call(Function, Vec<Node>),
    /// A condition: `a > b`.
    Compare(Comparison, Box<Node>, Box<Node>),
    /// A condition: all of them, `a and b`.
    All(Vec<Node>),
    /// A condition: at least one of them, `a or b`.
    Any(Vec<Node>),
    /// A condition: the opposite.
    Not(Box<Node>),
}

/// Arithmetic between the operands of a [`Form::Chain`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operator {
    /// `a + b`.
    Add,
    /// `a - b`.
    Subtract,
    /// `a * b`.
    Multiply,
    /// `a / b`.
    Divide,
}

impl Operator {
    /// The result for two operands.
    pub fn of<S: Scalar>(self, a: S, b: S) -> S {
        match self {
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide => a / b,
        }
    }
}

/// A comparison of two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Comparison {
    /// `a > b`.
    Greater,
    /// `a >= b`.
    AtLeast,
    /// `a < b`.
    Less,
    /// `a <= b`.
    AtMost,
}

impl Comparison {
    /// Whether it holds.
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
    /// Whether it is a condition, not a number.
    pub fn is_condition(&self) -> bool {
        matches!(self.form, Form::Compare(..) | Form::All(_) | Form::Any(_) | Form::Not(_))
    }

    /// The nodes directly below.
    pub fn children(&self) -> Vec<&Self> {
        match &self.form {
            Form::Number(_) | Form::Quantity(..) | Form::Name(_) => Vec::new(),
            Form::Member(_, a) | Form::Rate(a) | Form::Negative(a) | Form::Not(a) => vec![a],
            Form::Chain(first, rest) => {
                std::iter::once(first.as_ref()).chain(rest.iter().map(|(_, node)| node)).collect()
            }
            Form::Power(a, b) | Form::Compare(_, a, b) => vec![a, b],
            Form::Call(_, nodes) | Form::All(nodes) | Form::Any(nodes) => nodes.iter().collect(),
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
