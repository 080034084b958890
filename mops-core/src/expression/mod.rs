//! Arithmetic expressions in study files: `2*Ti`, `sin(x)^2 + 1`, `if(u > 0, a, b)`.

pub mod functions;
mod parse;
mod tree;

pub use functions::{FUNCTIONS, Function};
pub use parse::{Equation, SyntaxError, equation};
pub use tree::{Comparison, Form, Node, Operator};

use crate::scalar::Scalar;

/// An expression over named quantities, read once and evaluated with values or with tangents.
///
/// Operators `+ - * / ^` with the usual precedence (`-x^2` is `-(x^2)`), parentheses, `pi`, and the functions of
/// [`FUNCTIONS`]; conditions are comparisons `> >= < <=`, joined by `and`, `or`, `not`.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    root: Node,
    names: Vec<String>,
}

impl Expression {
    /// Reads an expression.
    ///
    /// # Errors
    /// A text that is not an expression, with the place of the first mistake.
    pub fn parse(text: &str) -> Result<Self, SyntaxError> {
        let root = parse::expression(text)?;
        let mut names: Vec<String> = Vec::new();
        let mut foreign = None;
        root.walk(&mut |node| match &node.form {
            Form::Name(name) if !names.contains(name) => names.push(name.clone()),
            Form::Rate(_) | Form::Member(..) => foreign = foreign.take().or(Some(node.span.clone())),
            _ => {}
        });
        match foreign {
            Some(span) => {
                Err(SyntaxError { span, message: "only models have derivatives and families of states".to_owned() })
            }
            None => Ok(Self { root, names }),
        }
    }

    /// Names that occur, each once, in the order of their first use; values are given in this order.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The value for given values of [`Expression::names`].
    pub fn evaluate<S: Scalar>(&self, values: &[S]) -> S {
        self.root.evaluate(&|name| {
            let index = self.names.iter().position(|known| known == name).expect("names were gathered on reading");
            values[index]
        })
    }
}

impl Node {
    /// The value, where `lookup` gives that of every name.
    ///
    /// # Panics
    /// At a derivative, or at a member of a family.
    pub fn evaluate<S: Scalar>(&self, lookup: &impl Fn(&str) -> S) -> S {
        let value = |node: &Self| node.evaluate(lookup);
        match &self.form {
            Form::Number(number) => S::from(*number),
            Form::Name(name) => lookup(name),
            Form::Negative(a) => -value(a),
            Form::Binary(operator, a, b) => match operator {
                Operator::Add => value(a) + value(b),
                Operator::Subtract => value(a) - value(b),
                Operator::Multiply => value(a) * value(b),
                Operator::Divide => value(a) / value(b),
                Operator::Power => functions::power(value(a), value(b)),
            },
            Form::Call(Function::If, arguments) => {
                let pairs = arguments.chunks_exact(2);
                let otherwise = &pairs.remainder()[0];
                let mut chosen = pairs.filter(|pair| pair[0].holds(lookup)).map(|pair| &pair[1]);
                value(chosen.next().unwrap_or(otherwise))
            }
            Form::Call(function, arguments) => {
                let values: Vec<S> = arguments.iter().map(value).collect();
                function.evaluate(&values)
            }
            _ => unreachable!("the reader has checked what stands where a number is expected"),
        }
    }

    /// Whether the condition holds.
    fn holds<S: Scalar>(&self, lookup: &impl Fn(&str) -> S) -> bool {
        match &self.form {
            Form::Compare(comparison, a, b) => comparison.holds(a.evaluate(lookup).value(), b.evaluate(lookup).value()),
            Form::And(a, b) => a.holds(lookup) && b.holds(lookup),
            Form::Or(a, b) => a.holds(lookup) || b.holds(lookup),
            Form::Not(a) => !a.holds(lookup),
            _ => unreachable!("the reader has checked what stands where a condition is expected"),
        }
    }
}

impl Function {
    /// The value of any function but `if`.
    pub fn evaluate<S: Scalar>(self, values: &[S]) -> S {
        use functions::{atan2, max, min, sign, table};
        let x = values[0];
        match self {
            Self::Atan2 => atan2(x, values[1]),
            Self::Abs => x.abs(),
            Self::Sign => sign(x),
            Self::Min => values[1..].iter().fold(x, |a, &b| min(a, b)),
            Self::Max => values[1..].iter().fold(x, |a, &b| max(a, b)),
            Self::Clip => min(max(x, values[1]), values[2]),
            Self::Deadzone => x - min(max(x, values[1]), values[2]),
            Self::Table => table(x, &values[1..]),
            _ => self.smooth(x).expect("`if` is evaluated by its node, all others are smooth"),
        }
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
        assert_eq!(value("2^3^2 - 2^(n + 1)", &[2.0]), 504.0);
        assert_eq!(value("max(x, min(y, 2)) + sin(pi/2)", &[1.0, 5.0]), 3.0);
    }

    #[test]
    fn pieces_are_chosen_by_conditions() {
        let text = "if(x < 0 or x > 10 and not (y > 0), -1, x >= 5, 2, 0.5)";
        let at = |x, y| value(text, &[x, y]);
        assert_eq!(
            [at(-1.0, 0.0), at(11.0, -1.0), at(11.0, 1.0), at(5.0, 0.0), at(1.0, 0.0)],
            [-1.0, -1.0, 2.0, 2.0, 0.5]
        );
        assert_eq!([value("clip(x, -1, 2)", &[3.0]), value("deadzone(x, -1, 2)", &[3.0])], [2.0, 1.0]);
        assert_eq!(value("table(x, 0, 0, 1, 10, 2, 12)", &[1.5]), 11.0);
        assert_eq!(value("origin + android", &[1.0, 2.0]), 3.0);
    }

    #[test]
    fn tangents_go_through() {
        let e = Expression::parse("x^2*y").unwrap();
        let d: Dual<2> = e.evaluate(&[Dual::variable(3.0, 0), Dual::variable(2.0, 1)]);
        assert_eq!((d.value, d.tangent), (18.0, [12.0, 9.0]));
    }

    #[test]
    fn a_mistake_is_shown_where_it_is() {
        let wrong = |text: &str| Expression::parse(text).unwrap_err();
        assert_eq!(wrong("2*(a + ").span, 7..7);
        assert_eq!(wrong("2 $ 3").span, 2..3);
        assert_eq!(wrong("a + (b*c]").span, 8..9);
        assert_eq!(wrong("a + foo(b)").span, 4..7);
        assert!(wrong("a + foo(b)").message.contains("min, max"));
        assert_eq!(wrong("1 + if(a, 2, 3)").span, 7..8);
        assert_eq!(wrong("1 + (a > b)").span, 5..10);
        assert_eq!(wrong("1 + clip(a, 2)").span, 4..14);
        assert_eq!(wrong("1 + x'").span, 4..6);
    }

    #[test]
    fn an_equation_has_two_sides_and_derivatives() {
        let Equation { left, right } = equation("J*w' = k*i - der(b)").unwrap();
        let rates = |node: &Node| {
            let mut spans = Vec::new();
            node.walk(&mut |n| spans.extend(matches!(n.form, Form::Rate(_)).then_some((n.span.start, n.span.end))));
            spans
        };
        assert_eq!((rates(&left.unwrap()), rates(&right)), (vec![(2, 4)], vec![(13, 19)]));
        assert_eq!(equation("T[i-1] - 2*T[i]").unwrap().left, None);
        assert_eq!(equation("a = b = c").unwrap_err().span, 6..7);
    }
}
