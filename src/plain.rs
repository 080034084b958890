//! Text whose characters are all shown: none moves a cursor, clears a screen, ends a comment or turns what is read around.

use std::borrow::Cow;

/// The text with control characters written out, as `\u{1b}`; line ends and tabs stay.
pub(crate) fn plain(text: &str) -> Cow<'_, str> {
    escaped(text, |c| c.escape_unicode().to_string())
}

/// The same in one line: line ends and tabs are written out too.
pub(crate) fn line(text: &str) -> String {
    plain(text).replace('\n', "\\n").replace('\t', "\\t")
}

/// The text with what `escape` writes for every character that acts.
pub(crate) fn escaped(text: &str, escape: impl Fn(char) -> String) -> Cow<'_, str> {
    if !text.contains(acts) {
        return Cow::Borrowed(text);
    }
    let mut plain = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if acts(c) { plain.push_str(&escape(c)) } else { plain.push(c) }
    }
    Cow::Owned(plain)
}

/// Whether a terminal acts on a character instead of showing it: controls, and what turns the direction of the text.
/// Source: Unicode 16.0, general category Cc; Unicode Standard Annex 9, section 2.
pub(crate) fn acts(c: char) -> bool {
    (c.is_control() && !matches!(c, '\n' | '\t'))
        || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{200e}' | '\u{200f}' | '\u{61c}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn controls_are_written_out_and_all_else_stays() {
        for (text, shown) in [
            ("\u{1b}]0;title\u{7}", "\\u{1b}]0;title\\u{7}"),
            ("\u{1b}[2J\u{1b}[1;1H", "\\u{1b}[2J\\u{1b}[1;1H"),
            ("a\rb\u{8}\u{b}\u{c}\u{7f}", "a\\u{d}b\\u{8}\\u{b}\\u{c}\\u{7f}"),
            ("\u{9b}31m\u{90}\u{85}", "\\u{9b}31m\\u{90}\\u{85}"),
            ("\0", "\\u{0}"),
            ("\u{202e}cod.exe", "\\u{202e}cod.exe"),
            ("\u{2067}\u{200f}", "\\u{2067}\\u{200f}"),
            ("line\n\tΩ m² 温度 é", "line\n\tΩ m² 温度 é"),
            ("", ""),
        ] {
            assert_eq!(plain(text), shown);
        }
        assert!(matches!(plain("plain"), Cow::Borrowed(_)));
        let json = escaped("\"a\u{85}\u{7f}\"", |c| format!("\\u{:04x}", u32::from(c)));
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), "a\u{85}\u{7f}");
    }
}
