//! Explanation of TOML syntax errors for users who do not know its grammar.

use std::ops::Range;

use mops_language::{Diagnostic, Quantity};

/// Returns the error that stopped the parser, and its location, which is often before the place where the parser
/// stopped.
pub(super) fn explain(text: &str, error: &toml::de::Error) -> (Diagnostic, Range<usize>) {
    let found = error.span().unwrap_or(0..text.len());
    if let Some((bracket, place)) = unpaired(text).filter(|(_, place)| *place <= found.start) {
        let (fact, way_out) = match bracket {
            '{' => ("the table that starts here is not closed".to_owned(), "put a `}` at its end".to_owned()),
            '[' => ("the list or heading that starts here is not closed".to_owned(), "put a `]` at its end".to_owned()),
            '}' | ']' => (format!("unmatched `{bracket}`"), "remove it".to_owned()),
            quote => ("the string that starts here is not closed".to_owned(), format!("put a `{quote}` at its end")),
        };
        return (Diagnostic::new(fact).with_help(way_out), place..place + 1);
    }
    if let Some(mistake) = unquoted(text, found.start) {
        return mistake;
    }
    if error.message().starts_with("extra assignment") {
        let before = text[..found.start].trim_end();
        let place = before.trim_end_matches(|c: char| c.is_alphanumeric() || "-_".contains(c)).len()..before.len();
        let fact = format!("missing comma before `{}`", &text[place.clone()]);
        return (Diagnostic::new(fact).with_help("put a comma between a value and the next key"), place);
    }
    let word = text.get(found.clone()).unwrap_or_default();
    let (fact, way_out) = match error.message().split(", expected").next().unwrap_or_default() {
        "duplicate key" => (format!("duplicate key `{word}`"), "remove one of the two"),
        "key with no value" => ("key without a value".to_owned(), "write it as key = value"),
        "invalid literal string" | "string values must be quoted" if word.trim().is_empty() => {
            ("missing value".to_owned(), "write it as key = value")
        }
        "extra comma in inline table" | "extra comma in array" => {
            ("missing value before this comma".to_owned(), "add the value, or remove the comma")
        }
        "string values must be quoted" => (
            format!("`{word}` is neither a number nor a quoted string"),
            "put commas between values and quotes around strings",
        ),
        other => (
            format!("invalid TOML: {}", other.replace('\n', "; ")),
            "correct the marked text or the text just before it; see https://toml.io",
        ),
    };
    (Diagnostic::new(fact).with_help(way_out), found)
}

/// Returns the first unmatched bracket or unclosed quote, and its position.
fn unpaired(text: &str) -> Option<(char, usize)> {
    let mut open: Vec<(char, usize)> = Vec::new();
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        match c {
            '#' => at += rest.find('\n').unwrap_or(rest.len()),
            '"' | '\'' => match end_of_text(rest, c) {
                Some(length) => at += length,
                None => return Some((c, at)),
            },
            '{' | '[' => {
                open.push((c, at));
                at += 1;
            }
            '}' | ']' => {
                let opener = if c == '}' { '{' } else { '[' };
                match open.pop() {
                    Some((last, _)) if last == opener => at += 1,
                    // A bracket inside the closed one is still open, or none is open.
                    last => return last.or(Some((c, at))),
                }
            }
            _ => at += c.len_utf8(),
        }
    }
    open.pop()
}

/// Returns the length in bytes of the quoted string at the start of `rest`. `None` if it is not closed, on its line
/// unless the quote is triple.
fn end_of_text(rest: &str, quote: char) -> Option<usize> {
    let triple: String = [quote; 3].iter().collect();
    if let Some(inner) = rest.strip_prefix(&triple) {
        return inner.find(&triple).map(|end| end + 6);
    }
    let mut escaped = false;
    for (at, c) in rest.char_indices().skip(1) {
        match c {
            '\n' => return None,
            _ if escaped => escaped = false,
            '\\' if quote == '"' => escaped = true,
            _ if c == quote => return Some(at + 1),
            _ => {}
        }
    }
    None
}

/// Returns the error for a number with a decimal comma, or for a string without quotes, after the last `=` before
/// `place`.
fn unquoted(text: &str, place: usize) -> Option<(Diagnostic, Range<usize>)> {
    let line = text[..place].rfind('\n').map_or(0, |end| end + 1);
    let after = line + text[line..place].rfind('=')? + 1;
    let start = after + text[after..].len() - text[after..].trim_start_matches([' ', '\t']).len();
    let end = text[start..].find(['\n', '\r', '#', '}', ']', '=']).map_or(text.len(), |length| start + length);
    let mut parts = text[start..end].split(',').map(str::trim_end);
    let (value, next) = (parts.next().unwrap_or_default(), parts.next());

    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    if let Some(decimals) = next.filter(|next| digits(value.trim_start_matches(['-', '+'])) && digits(next)) {
        let fact = Diagnostic::new("decimal comma in a number");
        let end = start + value.len() + 1 + decimals.len();
        return Some((fact.with_help(format!("write {value}.{decimals}")), start..end));
    }
    let is_word = !["true", "false", "inf", "nan"].contains(&value)
        && value.starts_with(char::is_alphabetic)
        && value.chars().all(|c| c.is_alphanumeric() || "-_ ".contains(c));
    let is_quantity = Quantity::parse(value).is_ok_and(|quantity| quantity.unit.is_some());
    // If a key follows, its name is not part of the value: a comma is missing.
    let runs_into_key = next.is_none() && text[end..].starts_with('=');
    ((is_word || is_quantity) && !runs_into_key).then(|| {
        let fact = Diagnostic::new(format!("the string `{value}` needs quotes"));
        (fact.with_help(format!("write \"{value}\"")), start..start + value.len())
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use toml::de::DeTable;

    use super::*;

    /// Returns the message for a text, and the marked part.
    fn message(text: &str) -> (String, &str) {
        let (diagnostic, place) = explain(text, &DeTable::parse(text).unwrap_err());
        (diagnostic.to_string(), &text[place])
    }

    #[test]
    fn unclosed_brackets_and_quotes_are_marked_at_their_start() {
        let table = "the table that starts here is not closed; put a `}` at its end".to_owned();
        assert_eq!(message("[a]\nb = { c = 1\n\n[d]\ne = 2\n"), (table, "{"));
        let text = "the string that starts here is not closed; put a `\"` at its end".to_owned();
        assert_eq!(message("a = \"b # \\\"\nc = { d = '}' }\n"), (text, "\""));
        let list = "the list or heading that starts here is not closed; put a `]` at its end".to_owned();
        assert_eq!(message("a = { b = [1, 2 }\n").0, list);
    }

    #[test]
    fn numbers_and_texts_are_shown_as_they_must_be_written() {
        let comma = "decimal comma in a number; write -0.10".to_owned();
        assert_eq!(message("a = { b = -0,10 }"), (comma.clone(), "-0,10"));
        assert_eq!(message("a = -0,10 # about"), (comma, "-0,10"));
        let quotes = |value| format!("the string `{value}` needs quotes; write \"{value}\"");
        for value in ["60 s", "60s", "log", "fast", "name of it"] {
            assert_eq!(message(&format!("a = {{ b = {value}, c = 1 }}")), (quotes(value), value));
        }
    }

    #[test]
    fn everything_else_is_reported_as_found_by_the_parser() {
        assert_eq!(message("a = 1\na = 2").0, "duplicate key `a`; remove one of the two");
        let comma = "missing comma before `min`; put a comma between a value and the next key".to_owned();
        assert_eq!(message("a = { b = 4.0 min = 1 }"), (comma, "min"));
        assert_eq!(message("a = [1 2]").1, "1 2");
        assert_eq!(message("a = 1 }").0, "unmatched `}`; remove it");
        assert!(message("= 1").0.starts_with("invalid TOML: "));
        assert_eq!(message("a = { b = true, c }").0, "missing value; write it as key = value");
        assert!(message("a = { b = , c = 1 }").0.starts_with("missing value before this comma; "));
        assert_eq!(message("a =").0, "missing value; write it as key = value");
    }

    proptest! {
        #[test]
        fn whatever_is_typed_is_explained_at_a_place_in_it(text in "[ab1 ,.=#\"'{}\\[\\]\\\\\u{b5}\n]{0,40}") {
            if let Err(error) = DeTable::parse(&text) {
                let (_, place) = explain(&text, &error);
                prop_assert!(text.get(place).is_some());
            }
        }
    }
}
