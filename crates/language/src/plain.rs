//! Escaping of control characters, which would move the cursor, clear the screen, end a comment or reverse the text.

use std::borrow::Cow;

/// Escapes control characters, as `\u{1b}`; line ends and tabs stay.
pub fn plain(text: &str) -> Cow<'_, str> {
    escaped(text, |c| c.escape_unicode().to_string())
}

/// Escapes control characters, line ends and tabs, so that the text fits on one line.
pub fn line(text: &str) -> String {
    plain(text).replace('\n', "\\n").replace('\t', "\\t")
}

/// Replaces every control character by the result of `escape`.
pub fn escaped(text: &str, escape: impl Fn(char) -> String) -> Cow<'_, str> {
    if !text.contains(acts) {
        return Cow::Borrowed(text);
    }
    let mut plain = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if acts(c) { plain.push_str(&escape(c)) } else { plain.push(c) }
    }
    Cow::Owned(plain)
}

/// Returns true if a terminal acts on a character instead of showing it, or if XML does not admit it: controls, changes
/// of the text direction, and two code points that are no characters.
/// Source: Unicode 16.0, general category Cc; Unicode Standard Annex 9, section 2; XML 1.0, section 2.2.
pub fn acts(c: char) -> bool {
    (c.is_control() && !matches!(c, '\n' | '\t'))
        || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{200e}' | '\u{200f}' | '\u{61c}')
        || matches!(c, '\u{fffe}' | '\u{ffff}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped_and_others_stay() {
        for (text, shown) in [
            ("\u{1b}]0;title\u{7}", "\\u{1b}]0;title\\u{7}"),
            ("\u{1b}[2J\u{1b}[1;1H", "\\u{1b}[2J\\u{1b}[1;1H"),
            ("a\rb\u{8}\u{b}\u{c}\u{7f}", "a\\u{d}b\\u{8}\\u{b}\\u{c}\\u{7f}"),
            ("\u{9b}31m\u{90}\u{85}", "\\u{9b}31m\\u{90}\\u{85}"),
            ("\0", "\\u{0}"),
            ("\u{202e}cod.exe", "\\u{202e}cod.exe"),
            ("\u{2067}\u{200f}", "\\u{2067}\\u{200f}"),
            ("line\n\tΩ m² 温度 é", "line\n\tΩ m² 温度 é"),
            ("\u{fffe}\u{ffff}\u{fffd}", "\\u{fffe}\\u{ffff}\u{fffd}"),
            ("", ""),
        ] {
            assert_eq!(plain(text), shown);
        }
        assert!(matches!(plain("plain"), Cow::Borrowed(_)));
        let json = escaped("\"a\u{85}\u{7f}\"", |c| format!("\\u{:04x}", u32::from(c)));
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), "a\u{85}\u{7f}");
    }
}
