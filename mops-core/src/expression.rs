//! Arithmetic expressions in study files: `2*Ti`, `sin(x)^2 + 1`.

use std::ops::Range;

use winnow::ascii::{float, multispace0};
use winnow::combinator::{alt, cut_err, delimited, opt, preceded, repeat, separated};
use winnow::error::{ContextError, StrContext, StrContextValue};
use winnow::prelude::*;
use winnow::token::{one_of, take_while};

use crate::scalar::Scalar;

/// An expression over named quantities, read once and evaluated with values or with tangents.
///
/// Operators `+ - * / ^` with the usual precedence (`-x^2` is `-(x^2)`; the exponent must be a number), parentheses,
/// `pi`, and the functions `sin cos tan tanh exp ln sqrt abs min max`.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    root: Node,
    names: Vec<String>,
}

#[derive(Debug, Clone, PartialEq)]
enum Node {
    Number(f64),
    Name(String),
    Quantity(usize),
    Negative(Box<Node>),
    Binary(Operator, Box<Node>, Box<Node>),
    Power(Box<Node>, f64),
    Call(Function, Vec<Node>),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Function {
    Sin,
    Cos,
    Tan,
    Tanh,
    Exp,
    Ln,
    Sqrt,
    Abs,
    Min,
    Max,
}

/// Name, function, number of arguments.
const FUNCTIONS: [(&str, Function, usize); 10] = [
    ("sin", Function::Sin, 1),
    ("cos", Function::Cos, 1),
    ("tan", Function::Tan, 1),
    ("tanh", Function::Tanh, 1),
    ("exp", Function::Exp, 1),
    ("ln", Function::Ln, 1),
    ("sqrt", Function::Sqrt, 1),
    ("abs", Function::Abs, 1),
    ("min", Function::Min, 2),
    ("max", Function::Max, 2),
];

/// Where an expression is wrong, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SyntaxError {
    /// Bytes of the text.
    pub span: Range<usize>,
    /// One sentence.
    pub message: String,
}

impl Expression {
    /// Reads an expression.
    ///
    /// # Errors
    /// A text that is not an expression, with the place of the first mistake.
    pub fn parse(text: &str) -> Result<Self, SyntaxError> {
        let mut root = delimited(multispace0, sum, multispace0).parse(text).map_err(|error| {
            let from = error.offset();
            let to = (from + 1..=text.len()).find(|&end| text.is_char_boundary(end)).unwrap_or(from);
            let rest: String = text[from..].chars().take(12).collect();
            let wanted: Vec<String> = error
                .inner()
                .context()
                .filter_map(|context| match context {
                    StrContext::Expected(what) => Some(what.to_string()),
                    _ => None,
                })
                .collect();
            let found = if rest.is_empty() { "the expression ends".to_owned() } else { format!("`{rest}` stands") };
            let wanted = if wanted.is_empty() { "an operator or the end".to_owned() } else { wanted.join(", ") };
            SyntaxError { span: from..to, message: format!("{found} where {wanted} is expected") }
        })?;
        let mut names = Vec::new();
        root.number_names(&mut names);
        Ok(Self { root, names })
    }

    /// Names that occur, each once, in the order of their first use; values are given in this order.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The value for given values of [`Expression::names`].
    pub fn evaluate<S: Scalar>(&self, values: &[S]) -> S {
        self.root.evaluate(values)
    }
}

impl Node {
    fn number_names(&mut self, names: &mut Vec<String>) {
        match self {
            Self::Name(name) => {
                let index = names.iter().position(|known| known == name).unwrap_or_else(|| {
                    names.push(name.clone());
                    names.len() - 1
                });
                *self = Self::Quantity(index);
            }
            Self::Negative(a) | Self::Power(a, _) => a.number_names(names),
            Self::Binary(_, a, b) => {
                a.number_names(names);
                b.number_names(names);
            }
            Self::Call(_, arguments) => arguments.iter_mut().for_each(|a| a.number_names(names)),
            Self::Number(_) | Self::Quantity(_) => {}
        }
    }

    fn evaluate<S: Scalar>(&self, values: &[S]) -> S {
        match self {
            Self::Number(number) => S::from(*number),
            Self::Quantity(index) => values[*index],
            Self::Name(_) => unreachable!("names are numbered when the expression is read"),
            Self::Negative(a) => -a.evaluate(values),
            Self::Power(a, exponent) => a.evaluate(values).powf(*exponent),
            Self::Binary(operator, a, b) => {
                let (a, b) = (a.evaluate(values), b.evaluate(values));
                match operator {
                    Operator::Add => a + b,
                    Operator::Subtract => a - b,
                    Operator::Multiply => a * b,
                    Operator::Divide => a / b,
                }
            }
            Self::Call(function, arguments) => {
                let x = arguments[0].evaluate(values);
                let y = || arguments[1].evaluate(values);
                match function {
                    Function::Sin => x.sin(),
                    Function::Cos => x.cos(),
                    Function::Tan => x.sin() / x.cos(),
                    Function::Tanh => x.tanh(),
                    Function::Exp => x.exp(),
                    Function::Ln => x.ln(),
                    Function::Sqrt => x.sqrt(),
                    Function::Abs => x.abs(),
                    Function::Min => Some(y()).filter(|y| y.value() < x.value()).unwrap_or(x),
                    Function::Max => Some(y()).filter(|y| y.value() > x.value()).unwrap_or(x),
                }
            }
        }
    }
}

fn expected(what: &'static str) -> StrContext {
    StrContext::Expected(StrContextValue::Description(what))
}

/// `product (('+' | '-') product)*`
fn sum(input: &mut &str) -> ModalResult<Node> {
    let first = product(input)?;
    chain(input, first, ['+', '-'], product)
}

/// `power (('*' | '/') power)*`
fn product(input: &mut &str) -> ModalResult<Node> {
    let first = signed(input)?;
    chain(input, first, ['*', '/'], signed)
}

fn chain(
    input: &mut &str,
    first: Node,
    operators: [char; 2],
    operand: fn(&mut &str) -> ModalResult<Node>,
) -> ModalResult<Node> {
    let rest: Vec<(char, Node)> =
        repeat(0.., (delimited(multispace0, one_of(operators), multispace0), cut_err(operand))).parse_next(input)?;
    Ok(rest.into_iter().fold(first, |a, (symbol, b)| {
        let operator = match symbol {
            '+' => Operator::Add,
            '-' => Operator::Subtract,
            '*' => Operator::Multiply,
            _ => Operator::Divide,
        };
        Node::Binary(operator, Box::new(a), Box::new(b))
    }))
}

/// `'-'? power`, so that `-x^2` is `-(x^2)`.
fn signed(input: &mut &str) -> ModalResult<Node> {
    let minus = opt((one_of(['-', '+']), multispace0)).parse_next(input)?;
    let node = power(input)?;
    Ok(if matches!(minus, Some(('-', _))) { Node::Negative(Box::new(node)) } else { node })
}

fn power(input: &mut &str) -> ModalResult<Node> {
    let base = operand(input)?;
    let exponent = opt(preceded(
        (multispace0, '^', multispace0),
        cut_err(alt((number, delimited('(', number, ')')))).context(expected("a number as exponent")),
    ))
    .parse_next(input)?;
    Ok(match exponent {
        Some(exponent) => Node::Power(Box::new(base), exponent),
        None => base,
    })
}

fn number(input: &mut &str) -> ModalResult<f64> {
    float.parse_next(input)
}

fn operand(input: &mut &str) -> ModalResult<Node> {
    alt((
        delimited(('(', multispace0), cut_err(sum), (multispace0, cut_err(')').context(expected("`)`")))),
        preceded(winnow::combinator::peek(one_of(('0'..='9', '.'))), number).map(Node::Number),
        name_or_call,
    ))
    .context(expected("a number, a name or `(`"))
    .parse_next(input)
}

fn name_or_call(input: &mut &str) -> ModalResult<Node> {
    let name =
        (one_of(|c: char| c.is_alphabetic() || c == '_'), take_while(0.., |c: char| c.is_alphanumeric() || c == '_'))
            .take()
            .parse_next(input)?;
    let arguments: Option<Vec<Node>> = opt(delimited(
        (multispace0, '(', multispace0),
        separated(1.., cut_err(sum), (multispace0, ',', multispace0)),
        (multispace0, cut_err(')').context(expected("`)`"))),
    ))
    .parse_next(input)?;
    match arguments {
        None if name == "pi" => Ok(Node::Number(std::f64::consts::PI)),
        None => Ok(Node::Name(name.to_owned())),
        Some(arguments) => match FUNCTIONS.iter().find(|(known, _, count)| *known == name && *count == arguments.len())
        {
            Some((_, function, _)) => Ok(Node::Call(*function, arguments)),
            None => {
                let mut error = ContextError::new();
                error
                    .push(expected("one of sin, cos, tan, tanh, exp, ln, sqrt, abs (of one value), min, max (of two)"));
                Err(winnow::error::ErrMode::Cut(error))
            }
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Dual;

    fn value(text: &str, values: &[f64]) -> f64 {
        Expression::parse(text).unwrap_or_else(|e| panic!("{text}: {e:?}")).evaluate(values)
    }

    #[test]
    fn precedence_is_the_usual_one() {
        assert_eq!(value("1 + 2*3 - 4/2", &[]), 5.0);
        assert_eq!(value("-x^2", &[3.0]), -9.0);
        assert_eq!(value("2*(a + b)^-1", &[1.0, 3.0]), 0.5);
        assert_eq!(value("max(x, min(y, 2)) + sin(pi/2)", &[1.0, 5.0]), 3.0);
    }

    #[test]
    fn tangents_go_through() {
        let e = Expression::parse("x^2*y").unwrap();
        let d: Dual<2> = e.evaluate(&[Dual::variable(3.0, 0), Dual::variable(2.0, 1)]);
        assert_eq!((d.value, d.tangent), (18.0, [12.0, 9.0]));
    }

    #[test]
    fn a_mistake_is_shown_where_it_is() {
        assert_eq!(Expression::parse("2*(a + ").unwrap_err().span, 7..7);
        assert_eq!(Expression::parse("2 $ 3").unwrap_err().span, 2..3);
        let error = Expression::parse("a + foo(b)").unwrap_err();
        assert!(error.message.contains("min, max"), "{}", error.message);
    }
}
