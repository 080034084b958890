//! Encodings of text files: UTF-8, UTF-16 and Windows-1252, which contains Latin-1.

use std::fmt;

/// Encoding of a text file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// UTF-8, with or without a byte order mark.
    Utf8,
    /// UTF-16, little or big endian.
    Utf16,
    /// Windows-1252; equal to Latin-1 (ISO 8859-1) for all printable characters of the latter.
    Windows1252,
}

impl fmt::Display for Encoding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Utf8 => "UTF-8",
            Self::Utf16 => "UTF-16",
            Self::Windows1252 => "Latin-1 (Windows-1252)",
        })
    }
}

/// Characters of the bytes 0x80 to 0x9f; 0 where there is none. Source: WHATWG, Encoding Standard, index windows-1252.
const BEYOND_LATIN_1: [u16; 32] = [
    0x20ac, 0, 0x201a, 0x0192, 0x201e, 0x2026, 0x2020, 0x2021, 0x02c6, 0x2030, 0x0160, 0x2039, 0x0152, 0, 0x017d, 0, 0,
    0x2018, 0x2019, 0x201c, 0x201d, 0x2022, 0x2013, 0x2014, 0x02dc, 0x2122, 0x0161, 0x203a, 0x0153, 0, 0x017e, 0x0178,
];

/// Decodes a text in an encoding other than UTF-8; `None` if it is binary or damaged.
pub(super) fn decode(bytes: &[u8]) -> Option<(String, Encoding)> {
    if let Some(is_big) = utf16(bytes) {
        let unit = |pair: &[u8]| {
            let pair = [pair[0], pair[1]];
            if is_big { u16::from_be_bytes(pair) } else { u16::from_le_bytes(pair) }
        };
        let pairs = bytes.chunks_exact(2);
        let is_whole = pairs.remainder().is_empty();
        let text = String::from_utf16(&pairs.map(unit).collect::<Vec<_>>()).ok()?;
        let is_text = is_whole && !text.contains(|c: char| c.is_control() && !c.is_whitespace());
        return is_text.then(|| (text.trim_start_matches('\u{feff}').to_owned(), Encoding::Utf16));
    }
    // A byte order mark promises UTF-8.
    if bytes.starts_with(b"\xef\xbb\xbf") {
        return None;
    }
    let letter = |byte: &u8| match byte {
        0x80..=0x9f => char::from_u32(BEYOND_LATIN_1[usize::from(byte - 0x80)].into()).filter(|c| *c != '\0'),
        byte if byte.is_ascii_control() && !byte.is_ascii_whitespace() => None,
        byte => Some(char::from(*byte)),
    };
    let text: Option<String> = bytes.iter().map(letter).collect();
    text.map(|text| (text, Encoding::Windows1252))
}

/// Bytes that are looked at to recognise UTF-16 without a byte order mark.
const HEAD: usize = 512;

/// Returns true for UTF-16 with the high byte first, false for the low byte first; `None` if the text is not UTF-16.
fn utf16(bytes: &[u8]) -> Option<bool> {
    if bytes.starts_with(b"\xfe\xff") || bytes.starts_with(b"\xff\xfe") {
        return Some(bytes[0] == 0xfe);
    }
    // Digits, separators and most letters have a high byte of zero, and no byte of text is zero otherwise.
    let head = &bytes[..bytes.len().min(HEAD) & !1];
    let zeros = |first: usize| head.iter().skip(first).step_by(2).filter(|byte| **byte == 0).count();
    let (even, odd, most) = (zeros(0), zeros(1), head.len() * 9 / 20);
    match (even, odd) {
        (0, odd) if odd > most => Some(false),
        (even, 0) if even > most => Some(true),
        _ => None,
    }
}
