//! What is wrong with a text that is no TOML, said for those who do not know its grammar.

use std::ops::Range;

use crate::diagnostic::Diagnostic;
use crate::unit::Quantity;

/// The mistake that made the parser give up, and where it is: often before the place where the parser noticed it.
pub(super) fn explain(text: &str, error: &toml::de::Error) -> (Diagnostic, Range<usize>) {
    let found = error.span().unwrap_or(0..text.len());
    if let Some((open, place)) = unclosed(text).filter(|(_, place)| *place <= found.start) {
        let (what, close) = match open {
            '{' => ("table", '}'),
            '[' => ("list or heading", ']'),
            quote => ("text", quote),
        };
        let way_out = format!("put a `{close}` at its end");
        return (
            Diagnostic::new(format!("the {what} that begins here does not end")).with_help(way_out),
            place..place + 1,
        );
    }
    if let Some(place) = value_at(text, found.start) {
        let value = &text[place.clone()];
        if is_decimal_comma(value) {
            let way_out = format!("write {}", value.replace(',', "."));
            return (Diagnostic::new("a decimal comma stands in a number").with_help(way_out), place);
        }
        let value = value.split(',').next().unwrap_or_default().trim_end();
        let place = place.start..place.start + value.len();
        let is_word =
            value.starts_with(char::is_alphabetic) && value.chars().all(|c| c.is_alphanumeric() || "-_ ".contains(c));
        if is_word || Quantity::parse(value).is_ok_and(|quantity| quantity.unit.is_some()) {
            let fact = format!("`{value}` stands there without quotes");
            return (Diagnostic::new(fact).with_help(format!("write \"{value}\"")), place);
        }
    }
    if let Some(bracket) = text[found.start..].chars().next().filter(|c| "}]".contains(*c)) {
        return (
            Diagnostic::new(format!("nothing is open that this `{bracket}` could close")).with_help("remove it"),
            found,
        );
    }
    let word = &text[found.clone()];
    let (fact, way_out) = match error.message().split(", expected").next().unwrap_or_default() {
        "duplicate key" => (format!("`{word}` stands here a second time"), "remove one of the two"),
        "key with no value" => ("a key stands here without a value".to_owned(), "write it as key = value"),
        "missing comma between key-value pairs" | "missing comma between array elements" => {
            ("a comma is missing here".to_owned(), "put one between what stands side by side")
        }
        other => (
            format!("this is not TOML: {}", other.replace('\n', "; ")),
            "correct it where it is marked, or a little before; see https://toml.io",
        ),
    };
    (Diagnostic::new(fact).with_help(way_out), found)
}

/// The bracket or the quote that is never closed, and where it stands.
fn unclosed(text: &str) -> Option<(char, usize)> {
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
                    // What is closed here was never opened, or something inside it is still open.
                    other => return other,
                }
            }
            _ => at += c.len_utf8(),
        }
    }
    open.pop()
}

/// Bytes of the quoted text at the beginning of `rest`; none if it does not end, on its line unless the quote is triple.
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

/// What stands alone after the last `=` before `place`, up to the end of its line, a comment or a closing bracket.
fn value_at(text: &str, place: usize) -> Option<Range<usize>> {
    let line = text[..place].rfind('\n').map_or(0, |end| end + 1);
    let after = line + text[line..place].rfind('=')? + 1;
    let start = after + text[after..].len() - text[after..].trim_start_matches([' ', '\t']).len();
    let end = text[start..].find(['\n', '\r', '#', '}', ']', '=']).map_or(text.len(), |length| start + length);
    let value = text[start..end].trim_end();
    // A key follows on the same line: what is missing is a comma.
    let is_alone = !text[end..].starts_with('=');
    (is_alone && !value.is_empty()).then(|| start..start + value.len())
}

/// `0,10`: digits, one comma, digits.
fn is_decimal_comma(value: &str) -> bool {
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let value = value.strip_prefix(['-', '+']).unwrap_or(value);
    value.split_once(',').is_some_and(|(before, after)| digits(before) && digits(after))
}

#[cfg(test)]
mod tests {
    use toml::de::DeTable;

    use super::*;

    /// The message for a text, and what it marks.
    fn message(text: &str) -> (String, &str) {
        let (diagnostic, place) = explain(text, &DeTable::parse(text).unwrap_err());
        (diagnostic.to_string(), &text[place])
    }

    #[test]
    fn what_is_not_closed_is_marked_where_it_begins() {
        let table = "the table that begins here does not end; put a `}` at its end".to_owned();
        assert_eq!(message("[a]\nb = { c = 1\n\n[d]\ne = 2\n"), (table, "{"));
        let text = "the text that begins here does not end; put a `\"` at its end".to_owned();
        assert_eq!(message("a = \"b # \\\"\nc = { d = '}' }\n"), (text, "\""));
        let list = "the list or heading that begins here does not end; put a `]` at its end".to_owned();
        assert_eq!(message("a = { b = [1, 2 }\n").0, list);
    }

    #[test]
    fn numbers_and_texts_are_shown_as_they_must_be_written() {
        let comma = "a decimal comma stands in a number; write -0.10".to_owned();
        assert_eq!(message("a = { b = -0,10 }"), (comma.clone(), "-0,10"));
        assert_eq!(message("a = -0,10 # about"), (comma, "-0,10"));
        let quotes = |value| format!("`{value}` stands there without quotes; write \"{value}\"");
        for value in ["60 s", "60s", "log", "fast", "name of it"] {
            assert_eq!(message(&format!("a = {{ b = {value}, c = 1 }}")), (quotes(value), value));
        }
    }

    #[test]
    fn everything_else_is_told_as_the_parser_tells_it() {
        assert_eq!(message("a = 1\na = 2").0, "`a` stands here a second time; remove one of the two");
        let comma = "a comma is missing here; put one between what stands side by side";
        assert_eq!(message("a = { b = 4.0 min = 1 }").0, comma);
        assert_eq!(message("a = 1 }").0, "nothing is open that this `}` could close; remove it");
        assert!(message("a = 1 b").0.starts_with("this is not TOML: "));
    }
}
