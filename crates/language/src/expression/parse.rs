//! Parser from text to [`Node`]s.
//!
//! ```text
//! equation    = expression ('=' expression)?
//! expression  = conjunction ('or' conjunction)*          conditions bind less than numbers
//! conjunction = negation ('and' negation)*
//! negation    = 'not'? comparison
//! comparison  = sum (('>=' | '<=' | '>' | '<') sum)?
//! sum         = product (('+' | '-') product)*
//! product     = signed (('*' | '/') signed)*
//! signed      = ('-' | '+')? power
//! power       = operand ('^' signed)?
//! operand     = '(' expression ')' | number ('[' unit ']')? | '"' number unit '"' | name '(' expression (',' expression)* ')' | name ('[' sum ']')? "'"?
//! ```

use std::ops::Range;

use winnow::ascii::{float, multispace0};
use winnow::combinator::{alt, cut_err, delimited, fail, opt, peek, preceded, repeat, separated};
use winnow::error::{ContextError, ErrMode, StrContext, StrContextValue};
use winnow::prelude::*;
use winnow::stream::{LocatingSlice, Stateful};
use winnow::token::{one_of, take_while};

use super::functions::{FUNCTIONS, Function};
use super::tree::{Comparison, Form, Node, Operator, REDUCTIONS};
use crate::Unit;

/// Syntax error: its position and cause.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SyntaxError {
    /// Byte range in the text.
    pub span: Range<usize>,
    /// Error message, one sentence.
    pub message: String,
}

/// Equation `left = right`, or a single expression.
#[derive(Debug, Clone, PartialEq)]
pub struct Equation {
    /// Left side of the `=`, if any.
    pub left: Option<Node>,
    /// Right side, or the expression.
    pub right: Node,
}

/// Largest nesting depth of brackets, functions, indices and exponents, each of which uses stack.
pub const DEEPEST: usize = 200;

/// Longest text, in bytes. It allows a sum of half a million terms, which takes some 100 MB after parsing.
const LONGEST: usize = 1 << 20;

/// Marker of the error of a text that is nested too deeply.
const TOO_DEEP: StrContext = StrContext::Label("too deep");

/// Text and current nesting depth of the parser.
type Input<'t> = Stateful<LocatingSlice<&'t str>, usize>;

/// Parsed form before the check: functions by name, conditions anywhere.
enum Raw {
    Number(f64),
    Quantity(f64, String, Range<usize>),
    Name(String),
    Member(String, Box<Spanned>),
    Rate(Box<Spanned>),
    Negative(Box<Spanned>),
    Chain(Box<Spanned>, Vec<(Operator, Spanned)>),
    Power(Box<Spanned>, Box<Spanned>),
    Compare(Comparison, Box<Spanned>, Box<Spanned>),
    All(Vec<Spanned>),
    Any(Vec<Spanned>),
    Not(Box<Spanned>),
    Call(String, Range<usize>, Vec<Spanned>),
}

struct Spanned {
    raw: Raw,
    span: Range<usize>,
}

impl Spanned {
    fn binary(a: Self, b: Self, make: impl FnOnce(Box<Self>, Box<Self>) -> Raw) -> Self {
        let span = a.span.start..b.span.end;
        Self { raw: make(Box::new(a), Box::new(b)), span }
    }
}

/// Parses an expression that is a number.
pub fn expression(text: &str) -> Result<Node, SyntaxError> {
    if let Some(quantity) = quantity_alone(text) {
        return Ok(quantity);
    }
    let raw = run(text, delimited(multispace0, disjunction, multispace0))?;
    number_of(raw)
}

/// Parses an equation, or an expression that is a number.
///
/// # Errors
/// If the text is neither, with the position of the first mistake.
pub fn equation(text: &str) -> Result<Equation, SyntaxError> {
    if let Some(right) = quantity_alone(text) {
        return Ok(Equation { left: None, right });
    }
    let right = opt(preceded('=', cut_err((multispace0, disjunction, multispace0))));
    let (_, first, _, second) = run(text, (multispace0, disjunction, multispace0, right))?;
    let equation = match second {
        Some((_, right, _)) => Equation { left: Some(number_of(first)?), right: number_of(right)? },
        None => Equation { left: None, right: number_of(first)? },
    };
    for side in equation.left.iter().chain([&equation.right]) {
        let mut reduced = None;
        side.walk(&mut |node| {
            if matches!(node.form, Form::Reduced(..)) {
                reduced = reduced.take().or(Some(node.span.clone()));
            }
        });
        if let Some(span) = reduced {
            return Err(SyntaxError { span, message: IN_CRITERIA.to_owned() });
        }
    }
    Ok(equation)
}

/// Parses a text that is only a number with a unit, as elsewhere in a study: `20 degC`.
///
/// A blank separates the two: `1/s` is one divided by a quantity `s`.
fn quantity_alone(text: &str) -> Option<Node> {
    let (number, unit) = text.trim().split_once(char::is_whitespace)?;
    let is_unit = unit.trim_start().starts_with(|c: char| c.is_alphabetic() || c == '%') || unit.starts_with("1/");
    if !number.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) || !is_unit {
        return None;
    }
    let (number, unit) = (number.parse::<f64>().ok()?, Unit::parse(unit).ok()?);
    if is_too_large(number, &unit) {
        return None;
    }
    let start = text.len() - text.trim_start().len();
    Some(Node { form: Form::Quantity(number, unit), span: start..start + text.trim().len() })
}

/// Returns true if a number in a unit exceeds the number range.
fn is_too_large(number: f64, unit: &Unit) -> bool {
    !(number * unit.factor() + unit.zero()).is_finite()
}

fn run<'t, T>(text: &'t str, mut parser: impl Parser<Input<'t>, T, ErrMode<ContextError>>) -> Result<T, SyntaxError> {
    if text.len() > LONGEST {
        let message = format!("the expression has {} bytes, more than the limit of {LONGEST}", text.len());
        return Err(SyntaxError { span: text.floor_char_boundary(LONGEST)..text.len(), message });
    }
    parser.parse(Stateful { input: LocatingSlice::new(text), state: 0 }).map_err(|error| {
        let from = error.offset();
        let to = (from + 1..=text.len()).find(|&end| text.is_char_boundary(end)).unwrap_or(from);
        if error.inner().context().any(|context| *context == TOO_DEEP) {
            return SyntaxError { span: from..to, message: format!("nested more than {DEEPEST} deep") };
        }
        if let Some((span, message)) = foreign(text, from) {
            return SyntaxError { span, message };
        }
        let rest: String = text[from..].chars().take(12).collect();
        let wanted: Vec<String> = error
            .inner()
            .context()
            .filter_map(|context| match context {
                StrContext::Expected(what) => Some(what.to_string()),
                _ => None,
            })
            .collect();
        let found = if rest.is_empty() { "the end of the expression".to_owned() } else { format!("`{rest}`") };
        let word = text[from..].split(|c: char| !c.is_alphabetic() && c != '%').next().unwrap_or_default();
        if text[..from].trim_end().ends_with(|c: char| c.is_ascii_digit())
            && Unit::parse(word).is_ok()
            && !word.is_empty()
        {
            let message = format!("expected a unit in brackets, as in 20 [{word}], or an operator");
            return SyntaxError { span: from..from + word.len(), message };
        }
        let wanted = if wanted.is_empty() { "an operator or the end".to_owned() } else { wanted.join(", ") };
        SyntaxError { span: from..to, message: format!("expected {wanted}, found {found}") }
    })
}

/// Operators of other languages, and what is written here instead.
const FOREIGN: [(&str, &str); 6] = [
    ("**", "a power is written with `^`, as in x^2"),
    ("&&", "conditions are joined by `and`"),
    ("||", "conditions are joined by `or`"),
    ("==", "numbers are compared by `<`, `<=`, `>` or `>=`"),
    ("!=", "numbers are compared by `<`, `<=`, `>` or `>=`"),
    (".*", "a product is written with `*`"),
];

/// Returns the place and the message if the text at a mistake is an operator of another language.
fn foreign(text: &str, from: usize) -> Option<(Range<usize>, String)> {
    // The mistake may be at the second character.
    let starts = [from, from.saturating_sub(1)].into_iter().filter(|start| text.is_char_boundary(*start));
    starts.into_iter().find_map(|start| {
        let (operator, way_out) = FOREIGN.iter().find(|(operator, _)| text[start..].starts_with(operator))?;
        Some((start..start + operator.len(), format!("`{operator}` is no operator here: {way_out}")))
    })
}

/// Checks that the parsed form is a number, and so are its parts where required; looks up the functions.
fn number_of(raw: Spanned) -> Result<Node, SyntaxError> {
    let node = checked(raw)?;
    if node.is_condition() {
        return Err(SyntaxError { span: node.span, message: "expected a number, found a condition".to_owned() });
    }
    Ok(node)
}

fn condition_of(raw: Spanned) -> Result<Node, SyntaxError> {
    let node = checked(raw)?;
    if !node.is_condition() {
        let message = "expected a condition such as `x > 0`, found a number".to_owned();
        return Err(SyntaxError { span: node.span, message });
    }
    Ok(node)
}

fn checked(Spanned { raw, span }: Spanned) -> Result<Node, SyntaxError> {
    let number = |raw: Box<Spanned>| number_of(*raw).map(Box::new);
    let conditions = |raw: Vec<Spanned>| raw.into_iter().map(condition_of).collect::<Result<_, _>>();
    let form = match raw {
        Raw::Number(value) if value.is_infinite() => {
            return Err(SyntaxError { span, message: "the number is too large".to_owned() });
        }
        Raw::Number(value) => Form::Number(value),
        Raw::Quantity(number, unit, place) => {
            let unit = Unit::parse(&unit).map_err(|message| SyntaxError { span: place, message })?;
            if is_too_large(number, &unit) {
                return Err(SyntaxError { span, message: "the number is too large".to_owned() });
            }
            Form::Quantity(number, unit)
        }
        Raw::Name(name) if name == "pi" => Form::Number(std::f64::consts::PI),
        Raw::Name(name) => Form::Name(name),
        Raw::Member(name, index) => Form::Member(name, number(index)?),
        Raw::Rate(of) => Form::Rate(number(of)?),
        Raw::Negative(a) => Form::Negative(number(a)?),
        Raw::Chain(first, rest) => {
            let rest = rest.into_iter().map(|(operator, operand)| Ok((operator, number_of(operand)?)));
            Form::Chain(number(first)?, rest.collect::<Result<_, SyntaxError>>()?)
        }
        Raw::Power(a, b) => Form::Power(number(a)?, number(b)?),
        Raw::Compare(comparison, a, b) => Form::Compare(comparison, number(a)?, number(b)?),
        Raw::All(all) => Form::All(conditions(all)?),
        Raw::Any(any) => Form::Any(conditions(any)?),
        Raw::Not(a) => Form::Not(condition_of(*a).map(Box::new)?),
        Raw::Call(name, place, arguments) => call(&name, place, &span, arguments)?,
    };
    Ok(Node { form, span })
}

/// Returns the message for a function that does not exist.
pub fn unknown_function(name: &str) -> String {
    let names: Vec<&str> = FUNCTIONS.iter().map(|(name, ..)| *name).collect();
    format!("unknown function `{name}`; known: {}", names.join(", "))
}

fn call(name: &str, place: Range<usize>, span: &Range<usize>, arguments: Vec<Spanned>) -> Result<Form, SyntaxError> {
    let wrong = |span: Range<usize>, message: String| Err(SyntaxError { span, message });
    if name == "der" {
        let [of] = <[Spanned; 1]>::try_from(arguments)
            .map_err(|_| SyntaxError { span: span.clone(), message: "`der` takes one argument".to_owned() })?;
        let of = number_of(of)?;
        return match of.form {
            Form::Name(_) | Form::Member(..) => Ok(Form::Rate(Box::new(of))),
            _ => wrong(of.span, "`der` takes the name of a state".to_owned()),
        };
    }
    if let Some((_, reduction)) = REDUCTIONS.iter().find(|(known, _)| *known == name) {
        let [of] = <[Spanned; 1]>::try_from(arguments)
            .map_err(|_| SyntaxError { span: span.clone(), message: format!("`{name}` takes one argument") })?;
        return Ok(Form::Reduced(*reduction, Box::new(number_of(of)?)));
    }
    let Some(&(_, function, least, most)) = FUNCTIONS.iter().find(|(known, ..)| *known == name) else {
        // A lookup table, if the model has one of this name.
        return match arguments.len() {
            1 | 2 => Ok(Form::Lookup(name.to_owned(), arguments.into_iter().map(number_of).collect::<Result<_, _>>()?)),
            _ => wrong(place, unknown_function(name)),
        };
    };
    let count = arguments.len();
    let fits = match function {
        Function::If | Function::Table => count % 2 == 1,
        _ => true,
    };
    if count < least || count > most || !fits {
        let wanted = match function {
            Function::If => "a condition, a value and the value otherwise".to_owned(),
            Function::Table => "x, then x and y of at least two points".to_owned(),
            Function::Clip | Function::Deadzone => "x, the lower and the upper limit".to_owned(),
            Function::Min | Function::Max => "two values or more".to_owned(),
            Function::Delay => "a quantity and a time".to_owned(),
            _ => format!("{least} value{}", if least == 1 { "" } else { "s" }),
        };
        return wrong(span.clone(), format!("`{name}` takes {wanted}, not {count}"));
    }
    if function == Function::Table {
        let places: Vec<_> = arguments.iter().skip(1).step_by(2).map(|x| (literal(x), x.span.clone())).collect();
        for pair in places.windows(2) {
            let [(Some(a), _), (Some(b), at)] = pair else { continue };
            if b <= a {
                return wrong(at.clone(), format!("the x of a `table` must rise, but {b} follows {a}"));
            }
        }
    }
    let checked = arguments.into_iter().enumerate().map(|(i, argument)| {
        let is_condition = function == Function::If && i % 2 == 0 && i + 1 < count;
        if is_condition { condition_of(argument) } else { number_of(argument) }
    });
    Ok(Form::Call(function, checked.collect::<Result<_, _>>()?))
}

/// Returns the value of an argument that is a literal number.
fn literal(argument: &Spanned) -> Option<f64> {
    match &argument.raw {
        Raw::Number(number) => Some(*number),
        Raw::Quantity(number, unit, _) => Unit::parse(unit).ok().map(|unit| number * unit.factor() + unit.zero()),
        Raw::Negative(of) => literal(of).map(|number| -number),
        _ => None,
    }
}

fn expected(what: &'static str) -> StrContext {
    StrContext::Expected(StrContextValue::Description(what))
}

fn word<'t>(word: &'static str) -> impl Parser<Input<'t>, (), ErrMode<ContextError>> {
    move |input: &mut Input<'t>| {
        (multispace0, word, peek(winnow::combinator::not(one_of(is_letter))), multispace0).void().parse_next(input)
    }
}

fn is_letter(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Parses a nested part, one level deeper.
fn nested<'t>(
    inner: fn(&mut Input<'t>) -> ModalResult<Spanned>,
) -> impl Parser<Input<'t>, Spanned, ErrMode<ContextError>> {
    move |input: &mut Input<'t>| {
        if input.state == DEEPEST {
            return cut_err(fail.context(TOO_DEEP)).parse_next(input);
        }
        input.state += 1;
        let found = cut_err(inner).parse_next(input);
        input.state -= 1;
        found
    }
}

fn disjunction(input: &mut Input<'_>) -> ModalResult<Spanned> {
    let first = conjunction(input)?;
    let rest: Vec<Spanned> = repeat(0.., preceded(word("or"), cut_err(conjunction))).parse_next(input)?;
    Ok(joined(first, rest, Raw::Any))
}

fn conjunction(input: &mut Input<'_>) -> ModalResult<Spanned> {
    let first = negation(input)?;
    let rest: Vec<Spanned> = repeat(0.., preceded(word("and"), cut_err(negation))).parse_next(input)?;
    Ok(joined(first, rest, Raw::All))
}

fn joined(first: Spanned, rest: Vec<Spanned>, make: fn(Vec<Spanned>) -> Raw) -> Spanned {
    let Some(last) = rest.last() else { return first };
    let span = first.span.start..last.span.end;
    Spanned { raw: make(std::iter::once(first).chain(rest).collect()), span }
}

fn negation(input: &mut Input<'_>) -> ModalResult<Spanned> {
    let (not, span) = opt(word("not")).with_span().parse_next(input)?;
    let inner = comparison(input)?;
    Ok(match not {
        Some(()) => Spanned { span: span.start..inner.span.end, raw: Raw::Not(Box::new(inner)) },
        None => inner,
    })
}

fn comparison(input: &mut Input<'_>) -> ModalResult<Spanned> {
    let first = sum(input)?;
    let symbol = alt((
        ">=".value(Comparison::AtLeast),
        "<=".value(Comparison::AtMost),
        '>'.value(Comparison::Greater),
        '<'.value(Comparison::Less),
    ));
    let second = opt((delimited(multispace0, symbol, multispace0), cut_err(sum))).parse_next(input)?;
    Ok(match second {
        Some((comparison, second)) => Spanned::binary(first, second, |a, b| Raw::Compare(comparison, a, b)),
        None => first,
    })
}

fn sum(input: &mut Input<'_>) -> ModalResult<Spanned> {
    let first = product(input)?;
    chain(input, first, ['+', '-'], product)
}

fn product(input: &mut Input<'_>) -> ModalResult<Spanned> {
    let first = signed(input)?;
    chain(input, first, ['*', '/'], signed)
}

fn chain(
    input: &mut Input<'_>,
    first: Spanned,
    operators: [char; 2],
    operand: fn(&mut Input<'_>) -> ModalResult<Spanned>,
) -> ModalResult<Spanned> {
    let rest: Vec<(char, Spanned)> =
        repeat(0.., (delimited(multispace0, one_of(operators), multispace0), cut_err(operand))).parse_next(input)?;
    let Some((_, last)) = rest.last() else { return Ok(first) };
    let span = first.span.start..last.span.end;
    let operator = |symbol: char| match symbol {
        '+' => Operator::Add,
        '-' => Operator::Subtract,
        '*' => Operator::Multiply,
        _ => Operator::Divide,
    };
    let rest = rest.into_iter().map(|(symbol, operand)| (operator(symbol), operand)).collect();
    Ok(Spanned { raw: Raw::Chain(Box::new(first), rest), span })
}

/// Parses a signed power: `-x^2` is `-(x^2)`, and `-5 [degC]` is a temperature below 0 degC.
fn signed(input: &mut Input<'_>) -> ModalResult<Spanned> {
    let (sign, span) = opt((one_of(['-', '+']), multispace0)).with_span().parse_next(input)?;
    let inner = power(input)?;
    Ok(match sign {
        Some(('-', _)) => {
            let span = span.start..inner.span.end;
            let raw = match inner.raw {
                Raw::Quantity(number, unit, place) => Raw::Quantity(-number, unit, place),
                _ => Raw::Negative(Box::new(inner)),
            };
            Spanned { span, raw }
        }
        _ => inner,
    })
}

fn power(input: &mut Input<'_>) -> ModalResult<Spanned> {
    let base = operand(input)?;
    let exponent = opt(preceded((multispace0, '^', multispace0), nested(signed))).parse_next(input)?;
    Ok(match exponent {
        Some(exponent) => Spanned::binary(base, exponent, Raw::Power),
        None => base,
    })
}

fn operand(input: &mut Input<'_>) -> ModalResult<Spanned> {
    alt((bracketed, number, quoted, name_or_call, fail.context(expected("a number, a name or `(`")))).parse_next(input)
}

/// Parses a number with an optional unit in brackets.
fn number(input: &mut Input<'_>) -> ModalResult<Spanned> {
    let (value, span): (f64, _) = preceded(peek(one_of(('0'..='9', '.'))), float).with_span().parse_next(input)?;
    let unit = take_while(1.., |c: char| c != ']' && c != '[').with_span();
    let unit = opt(preceded((multispace0, '['), cut_err((unit, ']'.context(expected("`]` after a unit"))))));
    let (unit, end) = unit.with_span().parse_next(input)?;
    Ok(match unit {
        Some(((unit, place), _)) => {
            let unit: &str = unit;
            Spanned { raw: Raw::Quantity(value, unit.to_owned(), place), span: span.start..end.end }
        }
        None => Spanned { raw: Raw::Number(value), span },
    })
}

/// Parses a quantity in quotation marks: `"50 ms"`, or with apostrophes.
fn quoted(input: &mut Input<'_>) -> ModalResult<Spanned> {
    let quote = one_of(['"', '\'']).parse_next(input)?;
    let inner = (cut_err(float.context(expected("a number with a unit"))), multispace0);
    let unit = take_while(1.., |c: char| c != quote).with_span();
    let end = cut_err(quote.context(expected("a closing quotation mark")));
    let (((value, _), (unit, place), _), span): (((f64, _), (&str, _), _), _) =
        (inner, cut_err(unit.context(expected("a unit"))), end).with_span().parse_next(input)?;
    Ok(Spanned { raw: Raw::Quantity(value, unit.to_owned(), place), span: span.start - 1..span.end })
}

fn bracketed(input: &mut Input<'_>) -> ModalResult<Spanned> {
    delimited(('(', multispace0), nested(disjunction), (multispace0, cut_err(')').context(expected("`)`"))))
        .parse_next(input)
}

fn name_or_call(input: &mut Input<'_>) -> ModalResult<Spanned> {
    let (name, span) = (one_of(|c: char| c.is_alphabetic() || c == '_'), take_while(0.., is_letter))
        .take()
        .with_span()
        .parse_next(input)?;
    let name: &str = name;
    let arguments: Option<(Vec<Spanned>, Range<usize>)> = opt(delimited(
        (multispace0, '(', multispace0),
        separated(1.., nested(disjunction), (multispace0, ',', multispace0)),
        (multispace0, cut_err(')').context(expected("`)`"))),
    )
    .with_span())
    .parse_next(input)?;
    if let Some((arguments, end)) = arguments {
        return Ok(Spanned { span: span.start..end.end, raw: Raw::Call(name.to_owned(), span, arguments) });
    }
    let index = opt(delimited(('[', multispace0), nested(sum), (multispace0, cut_err(']').context(expected("`]`")))))
        .with_span()
        .parse_next(input)?;
    let quantity = match index {
        (Some(index), end) => Spanned { span: span.start..end.end, raw: Raw::Member(name.to_owned(), Box::new(index)) },
        (None, _) => Spanned { span, raw: Raw::Name(name.to_owned()) },
    };
    let (prime, end) = opt('\'').with_span().parse_next(input)?;
    Ok(match prime {
        Some(_) => Spanned { span: quantity.span.start..end.end, raw: Raw::Rate(Box::new(quantity)) },
        None => quantity,
    })
}

/// Message for a reduction in an expression that has none.
pub const IN_CRITERIA: &str = "a time response is reduced to a number in criteria only";
