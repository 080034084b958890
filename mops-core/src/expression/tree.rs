//! What an expression is once it is read: a tree whose every node knows where it stands in the text.

use std::ops::Range;

use super::functions::Function;

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
    /// A named quantity.
    Name(String),
    /// A member of a family: `T[i-1]`.
    Member(String, Box<Node>),
    /// The derivative of a quantity with respect to time: `x'`, or `der(x)`.
    Rate(Box<Node>),
    /// `-a`.
    Negative(Box<Node>),
    /// `a + b` and the like.
    Binary(Operator, Box<Node>, Box<Node>),
    /// `f(a, b, ..)`.
    Call(Function, Vec<Node>),
    /// A condition: `a > b`.
    Compare(Comparison, Box<Node>, Box<Node>),
    /// A condition: both.
    And(Box<Node>, Box<Node>),
    /// A condition: one or both.
    Or(Box<Node>, Box<Node>),
    /// A condition: the opposite.
    Not(Box<Node>),
}

/// Arithmetic between two numbers.
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
    /// `a ^ b`; `x^2^3` is `x^(2^3)`.
    Power,
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
        matches!(self.form, Form::Compare(..) | Form::And(..) | Form::Or(..) | Form::Not(_))
    }

    /// The nodes directly below.
    pub fn children(&self) -> Vec<&Self> {
        match &self.form {
            Form::Number(_) | Form::Name(_) => Vec::new(),
            Form::Member(_, a) | Form::Rate(a) | Form::Negative(a) | Form::Not(a) => vec![a],
            Form::Binary(_, a, b) | Form::Compare(_, a, b) | Form::And(a, b) | Form::Or(a, b) => vec![a, b],
            Form::Call(_, arguments) => arguments.iter().collect(),
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
