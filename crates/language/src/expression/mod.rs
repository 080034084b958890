//! Arithmetic expressions in study files: `2*Ti`, `sin(x)^2 + 1`, `if(u > 0, a, b)`.

pub mod functions;
mod parse;
mod tree;
pub mod units;

pub use functions::{FUNCTIONS, Function};
pub use parse::{DEEPEST, Equation, SyntaxError, equation, unknown_function};
pub use tree::{Comparison, Form, Node, Operator, REDUCTIONS, Reduction};

use std::collections::HashSet;

use crate::Scalar;
pub use parse::IN_CRITERIA;

/// Expression over named quantities, parsed once and evaluated with values or with tangents.
///
/// Operators are `+ - * / ^` with the usual precedence (`-x^2` is `-(x^2)`), with parentheses, `pi`, and the functions
/// of [`FUNCTIONS`]. Conditions are comparisons `> >= < <=`, combined by `and`, `or`, `not`. A number may have a unit
/// in brackets: `20 [degC]` has the value in the coherent SI unit, 293.15.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    root: Node,
    names: Vec<String>,
}

impl Expression {
    /// Parses an expression.
    ///
    /// # Errors
    /// If the text is not an expression, with the position of the first mistake.
    pub fn parse(text: &str) -> Result<Self, SyntaxError> {
        Self::of(parse::expression(text)?)
    }

    fn of(root: Node) -> Result<Self, SyntaxError> {
        let (mut names, mut seen): (Vec<String>, HashSet<&str>) = Default::default();
        let (mut foreign, mut unknown) = (None, None);
        root.walk(&mut |node| match &node.form {
            Form::Name(name) if seen.insert(name) => names.push(name.clone()),
            Form::Rate(_) | Form::Member(..) | Form::Call(Function::Delay, _) => {
                let why = "derivatives, delays and families of states are allowed in models only";
                foreign = foreign.take().or(Some((node.span.clone(), why)));
            }
            Form::Reduced(..) => {
                foreign = foreign.take().or(Some((node.span.clone(), IN_CRITERIA)));
            }
            Form::Lookup(name, _) => unknown = unknown.take().or(Some((node.span.clone(), name.clone()))),
            _ => {}
        });
        if let Some((span, name)) = unknown {
            return Err(SyntaxError { span: span.start..span.start + name.len(), message: unknown_function(&name) });
        }
        match foreign {
            Some((span, message)) => Err(SyntaxError { span, message: message.to_owned() }),
            None => Ok(Self { root, names }),
        }
    }

    /// Parses an expression with reductions of time responses. In the expression that it returns each reduction is a
    /// name, its own text; the reductions and what they reduce are returned with it.
    ///
    /// # Errors
    /// If the text is not such an expression, with the position of the first mistake.
    pub fn with_reductions(text: &str) -> Result<(Self, Vec<Reduced>), SyntaxError> {
        let mut root = parse::expression(text)?;
        let mut reduced = Vec::new();
        let mut within = Ok(());
        root.replace(&mut |node| {
            let Form::Reduced(reduction, of) = &node.form else { return None };
            let name = text[node.span.clone()].to_owned();
            match Self::of(of.as_ref().clone()) {
                Ok(of) => reduced.push(Reduced { name: name.clone(), reduction: *reduction, of }),
                Err(SyntaxError { span, message }) if message == IN_CRITERIA => {
                    let message = "a reduction gives one number, which is no time response".to_owned();
                    within = Err(SyntaxError { span, message });
                }
                Err(mistake) => within = Err(mistake),
            }
            Some(Form::Name(name))
        });
        within?;
        Ok((Self::of(root)?, reduced))
    }

    /// Returns the root of the expression tree.
    pub fn root(&self) -> &Node {
        &self.root
    }

    /// Returns the names in the expression, each once, in the order of first use. Values are given in this order.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns the value for given values of [`Expression::names`].
    pub fn evaluate<S: Scalar>(&self, values: &[S]) -> S {
        self.root.evaluate(&|name| {
            let index = self.names.iter().position(|known| known == name).expect("parsing collects all names");
            values[index]
        })
    }
}

/// Reduction of a time response in an expression.
#[derive(Debug, Clone, PartialEq)]
pub struct Reduced {
    /// Text of the reduction, by which the expression names it.
    pub name: String,
    /// What the course is reduced to.
    pub reduction: Reduction,
    /// The course.
    pub of: Expression,
}

impl Node {
    /// Returns the value of the node; `lookup` returns the value of a name.
    ///
    /// # Panics
    /// At a derivative, or at a member of a family.
    pub fn evaluate<S: Scalar>(&self, lookup: &impl Fn(&str) -> S) -> S {
        let value = |node: &Self| node.evaluate(lookup);
        match &self.form {
            Form::Number(number) => S::from(*number),
            Form::Quantity(number, unit) => S::from(number * unit.factor() + unit.zero()),
            Form::Name(name) => lookup(name),
            Form::Negative(a) => -value(a),
            Form::Chain(first, rest) => {
                rest.iter().fold(value(first), |result, (operator, node)| operator.of(result, value(node)))
            }
            Form::Power(a, b) => functions::power(value(a), value(b)),
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
            _ => unreachable!("the parser checks that this is a number"),
        }
    }

    /// Returns true if the condition holds.
    fn holds<S: Scalar>(&self, lookup: &impl Fn(&str) -> S) -> bool {
        match &self.form {
            Form::Compare(comparison, a, b) => comparison.holds(a.evaluate(lookup).value(), b.evaluate(lookup).value()),
            Form::All(conditions) => conditions.iter().all(|condition| condition.holds(lookup)),
            Form::Any(conditions) => conditions.iter().any(|condition| condition.holds(lookup)),
            Form::Not(a) => !a.holds(lookup),
            _ => unreachable!("the parser checks that this is a condition"),
        }
    }
}

impl Function {
    /// Returns the value of any function except `if`.
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
            // The delayed value of a constant is the constant.
            Self::Delay => x,
            _ => self.smooth(x).expect("`if` is evaluated by its node, all others are smooth"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dual;

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
    fn a_chain_may_have_any_number_of_operands() {
        let n = 100_000;
        let repeated = |first: &str, more: &str| format!("{first}{}", more.repeat(n));
        let count = f64::from(u32::try_from(n).unwrap());
        assert_eq!(value(&repeated("x", " + x"), &[0.5]), 0.5 * (count + 1.0));
        assert_eq!(value(&repeated("x", "-x"), &[0.5]), 0.5 * (1.0 - count));
        assert_eq!(value(&repeated("x", "-x+x"), &[0.25]), 0.25);
        assert_eq!(value(&repeated("x", "*2/2"), &[3.0]), 3.0);
        assert_eq!(value(&repeated("x", "+2*x^2"), &[1.0]), 1.0 + 2.0 * count);
        assert_eq!(value(&repeated("x", "+(x)"), &[1.0]), count + 1.0);
        assert_eq!(value(&format!("if({}, 1, 2)", repeated("x > 0", " or x < 0")), &[-1.0]), 1.0);
        assert_eq!(value(&format!("if({}, 1, 2)", repeated("x > 0", " and x < 1")), &[0.5]), 1.0);
        assert_eq!(value(&format!("max({})", repeated("x", ", 2*x")), &[3.0]), 6.0);
        let names: String = (0..n).map(|i| format!("+x{i}")).collect();
        assert_eq!(Expression::parse(&names[1..]).unwrap().names().len(), n);
    }

    #[test]
    fn what_is_nested_too_deeply_is_refused_at_its_place() {
        let nests: [(&str, &str); 12] = [
            ("(", ")"),
            ("sin(", ")"),
            ("max(1, ", ")"),
            ("min(", ", 2)"),
            ("-(", ")"),
            ("1 + 2*(", ")"),
            ("x^", ""),
            ("x^-", ""),
            ("x ^ -(", ")"),
            ("if(x > 0, ", ", 1)"),
            ("if(", " > 0, 1, 0)"),
            ("if(not (x > 0 and 1 > ", "), 1, 0)"),
        ];
        for (open, close) in nests {
            let nested = |depth: usize| format!("{}x{}", open.repeat(depth), close.repeat(depth));
            // Each of these opens one or two brackets per level.
            let levels = open.matches(['(', '^']).count();
            assert!(Expression::parse(&nested(DEEPEST / levels)).is_ok(), "{open}");
            // Texts of more than a megabyte are refused because of their length.
            let longest = 1_000_000 / (open.len() + close.len());
            for depth in [DEEPEST / levels + 1, 1000, 10_000, longest] {
                let wrong = Expression::parse(&nested(depth)).unwrap_err();
                assert_eq!(wrong.message, format!("nested more than {DEEPEST} deep"), "{open} {depth}");
                let place = (open.len() * DEEPEST / levels).saturating_sub(open.len());
                assert!((place..=place + 2 * open.len()).contains(&wrong.span.start), "{open}: {:?}", wrong.span);
            }
        }
        // Consecutive operands are not nested.
        assert_eq!(value(&format!("x{}", " + (x)^(2)".repeat(1000)), &[1.0]), 1001.0);
        let wrong = equation(&format!("x' = {}x", "x[".repeat(300))).unwrap_err();
        assert_eq!(wrong.message, format!("nested more than {DEEPEST} deep"));
    }

    #[test]
    fn a_text_longer_than_a_megabyte_and_a_number_beyond_all_numbers_are_refused() {
        let wrong = |text: &str| Expression::parse(text).unwrap_err();
        let long = format!("x{}", "+x".repeat(600_000));
        let found = wrong(&long);
        assert!(found.message.contains("1048576") && found.span == (1 << 20..long.len()), "{found:?}");
        for (text, span) in [("2 + 1e400", 4..9), ("x*1e999", 2..7), ("-1e309", 1..6)] {
            assert_eq!(wrong(text), SyntaxError { span, message: "the number is too large".into() });
        }
        assert_eq!(value("1e308 + 1e-400", &[]), 1e308);
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

    #[test]
    fn operators_of_other_languages_are_named_with_what_is_written_instead() {
        for (text, operator, way_out) in [
            ("JL/N**2", "**", "`^`"),
            ("2 ** x", "**", "`^`"),
            ("if(a > 0 && b > 0, 1, 2)", "&&", "`and`"),
            ("if(a > 0 || b > 0, 1, 2)", "||", "`or`"),
            ("if(a == 0, 1, 2)", "==", "`<=`"),
            ("if(a != 0, 1, 2)", "!=", "`<=`"),
            ("a .* b", ".*", "`*`"),
        ] {
            let mistake = Expression::parse(text).unwrap_err();
            assert!(mistake.message.contains(way_out), "{text}: {}", mistake.message);
            assert_eq!(&text[mistake.span], operator, "{text}");
        }
    }
}
