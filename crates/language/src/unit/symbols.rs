//! Symbols of units.

use std::f64::consts::PI;

use super::dimension::Dimension;

/// Kind of angle count of a symbol: frequencies count cycles or angles, which differ by 2 pi.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Turning {
    /// Neither angles nor cycles.
    No,
    /// Angles: rad, deg, rev.
    Angle,
    /// Cycles: Hz.
    Cycle,
}

/// Symbol of a unit.
#[derive(Debug)]
pub(super) struct Symbol {
    pub symbol: &'static str,
    pub dimension: Dimension,
    /// Value in coherent SI units.
    pub factor: f64,
    /// Zero of a temperature scale, in K.
    pub zero: f64,
    pub turning: Turning,
}

const fn symbol(symbol: &'static str, exponents: [i8; 7], factor: f64) -> Symbol {
    let mut dimension = [0.0; 7];
    let mut i = 0;
    while i < 7 {
        dimension[i] = exponents[i] as f64;
        i += 1;
    }
    Symbol { symbol, dimension: Dimension(dimension), factor, zero: 0.0, turning: Turning::No }
}

const fn angle(symbol: Symbol) -> Symbol {
    Symbol { turning: Turning::Angle, ..symbol }
}

const fn cycle(symbol: Symbol) -> Symbol {
    Symbol { turning: Turning::Cycle, ..symbol }
}

const fn scale(symbol: Symbol, zero: f64) -> Symbol {
    Symbol { zero, ..symbol }
}

/// Known symbols. Source: BIPM, The International System of Units, 9th edition (2019); degF and degR: NIST Special
/// Publication 811 (2008), appendix B.8.
#[rustfmt::skip]
pub(super) const SYMBOLS: &[Symbol] = &[
    //                          m  kg   s   A  K mol dB
    symbol("1",                [0,  0,  0,  0, 0, 0, 0], 1.0),
    angle(symbol("rad",        [0,  0,  0,  0, 0, 0, 0], 1.0)),
    angle(symbol("deg",        [0,  0,  0,  0, 0, 0, 0], PI / 180.0)),
    angle(symbol("rev",        [0,  0,  0,  0, 0, 0, 0], 2.0 * PI)),
    symbol("%",                [0,  0,  0,  0, 0, 0, 0], 0.01),
    symbol("dB",               [0,  0,  0,  0, 0, 0, 1], 1.0),
    symbol("m",                [1,  0,  0,  0, 0, 0, 0], 1.0),
    symbol("g",                [0,  1,  0,  0, 0, 0, 0], 1e-3),
    symbol("s",                [0,  0,  1,  0, 0, 0, 0], 1.0),
    symbol("min",              [0,  0,  1,  0, 0, 0, 0], 60.0),
    symbol("h",                [0,  0,  1,  0, 0, 0, 0], 3600.0),
    symbol("A",                [0,  0,  0,  1, 0, 0, 0], 1.0),
    symbol("K",                [0,  0,  0,  0, 1, 0, 0], 1.0),
    scale(symbol("degC",       [0,  0,  0,  0, 1, 0, 0], 1.0), 273.15),
    scale(symbol("degF",       [0,  0,  0,  0, 1, 0, 0], 5.0 / 9.0), 459.67 * 5.0 / 9.0),
    symbol("degR",             [0,  0,  0,  0, 1, 0, 0], 5.0 / 9.0),
    symbol("mol",              [0,  0,  0,  0, 0, 1, 0], 1.0),
    cycle(symbol("Hz",         [0,  0, -1,  0, 0, 0, 0], 1.0)),
    angle(symbol("rpm",        [0,  0, -1,  0, 0, 0, 0], 2.0 * PI / 60.0)),
    symbol("N",                [1,  1, -2,  0, 0, 0, 0], 1.0),
    symbol("Pa",              [-1,  1, -2,  0, 0, 0, 0], 1.0),
    symbol("bar",             [-1,  1, -2,  0, 0, 0, 0], 1e5),
    symbol("J",                [2,  1, -2,  0, 0, 0, 0], 1.0),
    symbol("W",                [2,  1, -3,  0, 0, 0, 0], 1.0),
    symbol("C",                [0,  0,  1,  1, 0, 0, 0], 1.0),
    symbol("V",                [2,  1, -3, -1, 0, 0, 0], 1.0),
    symbol("Ohm",              [2,  1, -3, -2, 0, 0, 0], 1.0),
    symbol("S",               [-2, -1,  3,  2, 0, 0, 0], 1.0),
    symbol("F",               [-2, -1,  4,  2, 0, 0, 0], 1.0),
    symbol("H",                [2,  1, -2, -2, 0, 0, 0], 1.0),
    symbol("Wb",               [2,  1, -2, -1, 0, 0, 0], 1.0),
    symbol("T",                [0,  1, -2, -1, 0, 0, 0], 1.0),
    symbol("L",                [3,  0,  0,  0, 0, 0, 0], 1e-3),
    symbol("l",                [3,  0,  0,  0, 0, 0, 0], 1e-3),
    angle(symbol("\u{b0}",     [0,  0,  0,  0, 0, 0, 0], PI / 180.0)),
    scale(symbol("\u{b0}C",    [0,  0,  0,  0, 1, 0, 0], 1.0), 273.15),
    scale(symbol("\u{b0}F",    [0,  0,  0,  0, 1, 0, 0], 5.0 / 9.0), 459.67 * 5.0 / 9.0),
    symbol("Wh",               [2,  1, -2,  0, 0, 0, 0], 3600.0),
    symbol("Ah",               [0,  0,  1,  1, 0, 0, 0], 3600.0),
    symbol("d",                [0,  0,  1,  0, 0, 0, 0], 86400.0),
    symbol("day",              [0,  0,  1,  0, 0, 0, 0], 86400.0),
    symbol("ohm",              [2,  1, -3, -2, 0, 0, 0], 1.0),
    symbol("\u{3a9}",          [2,  1, -3, -2, 0, 0, 0], 1.0),
    symbol("\u{2126}",         [2,  1, -3, -2, 0, 0, 0], 1.0),
    symbol("Nm",               [2,  1, -2,  0, 0, 0, 0], 1.0),
];

const PREFIXES: &[(&str, f64)] = &[
    ("p", 1e-12),
    ("n", 1e-9),
    ("u", 1e-6),
    ("\u{b5}", 1e-6),
    ("\u{3bc}", 1e-6),
    ("m", 1e-3),
    ("c", 1e-2),
    ("d", 1e-1),
    ("h", 1e2),
    ("k", 1e3),
    ("M", 1e6),
    ("G", 1e9),
    ("T", 1e12),
];

/// Returns the symbol of this text, and the factor of its prefix. Temperature scales take no prefix.
pub(super) fn find(text: &str) -> Option<(&'static Symbol, f64)> {
    let find = |name: &str| SYMBOLS.iter().find(|known| known.symbol == name);
    let prefixed = || {
        PREFIXES.iter().find_map(|(prefix, factor)| {
            let symbol = find(text.strip_prefix(prefix)?)?;
            (symbol.zero == 0.0).then_some((symbol, *factor))
        })
    };
    find(text).map(|symbol| (symbol, 1.0)).or_else(prefixed)
}
