//! Dimensions: exponents of the base units.

use std::fmt;

/// Exponents of m, kg, s, A, K, mol, and of the decibel (a unit of its own, as it is not a ratio).
///
/// Exponents may be fractions, as in `V^0.5/s`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Dimension(pub(super) [f64; 7]);

/// Symbols of the coherent base units and the indices of their exponents, in writing order.
const BASE: [(&str, usize); 7] = [("kg", 1), ("m", 0), ("s", 2), ("A", 3), ("K", 4), ("mol", 5), ("dB", 6)];

/// Coherent units with special names, in writing order.
///
/// Source: BIPM, The International System of Units, 9th edition (2019), table 4.
const NAMED: [(&str, [f64; 7]); 10] = [
    ("V", [2.0, 1.0, -3.0, -1.0, 0.0, 0.0, 0.0]),
    ("N m", [2.0, 1.0, -2.0, 0.0, 0.0, 0.0, 0.0]),
    ("N", [1.0, 1.0, -2.0, 0.0, 0.0, 0.0, 0.0]),
    ("Pa", [-1.0, 1.0, -2.0, 0.0, 0.0, 0.0, 0.0]),
    ("W", [2.0, 1.0, -3.0, 0.0, 0.0, 0.0, 0.0]),
    ("Ohm", [2.0, 1.0, -3.0, -2.0, 0.0, 0.0, 0.0]),
    ("H", [2.0, 1.0, -2.0, -2.0, 0.0, 0.0, 0.0]),
    ("F", [-2.0, -1.0, 4.0, 2.0, 0.0, 0.0, 0.0]),
    ("C", [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]),
    ("S", [-2.0, -1.0, 3.0, 2.0, 0.0, 0.0, 0.0]),
];

/// Difference below which exponents are equal: thirds add up to integers except for rounding.
const SAME: f64 = 1e-9;

impl Dimension {
    /// Dimension of a pure number.
    pub const NONE: Self = Self([0.0; 7]);
    /// Dimension of a time.
    pub const TIME: Self = Self([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);

    /// Returns true for the dimension of a pure number.
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// Returns true for a product of powers of m, kg, s and K, other than that of a pure number.
    pub(super) fn is_mechanical_or_thermal(&self) -> bool {
        !self.is_none() && [3, 5, 6].into_iter().all(|other: usize| self.0[other].abs() < SAME)
    }

    /// Returns the dimension of the product with the power `exponent` of a quantity of dimension `other`.
    #[must_use]
    pub fn times(mut self, other: &Self, exponent: f64) -> Self {
        for (sum, power) in self.0.iter_mut().zip(other.0) {
            *sum += exponent * power;
        }
        self
    }

    /// Returns the text of the coherent SI unit: a named unit with few additional base units.
    pub fn coherent(&self) -> String {
        // A name that requires division by a mass is penalised: m/s2, not N/kg.
        let cost = |rest: &Self| rest.0.iter().map(|e| e.abs()).sum::<f64>() + 2.0 * rest.0[1].abs();
        let plain = (self.0.iter().map(|e| e.abs()).sum(), String::new(), *self);
        let named = NAMED.iter().flat_map(|(symbol, dimension)| {
            let of = |(power, text): (f64, &str)| {
                let rest = self.times(&Self(*dimension), -power);
                // Names of two symbols take no exponent.
                let symbol = if symbol.contains(' ') && power != 1.0 { None } else { Some(format!("{symbol}{text}")) };
                symbol.map(|symbol| (cost(&rest) + power.max(1.0), symbol, rest))
            };
            [(1.0, ""), (2.0, "2"), (0.5, "^0.5")].into_iter().filter_map(of).collect::<Vec<_>>()
        });
        // First of the cheapest candidates: base units alone unless a name is shorter.
        let (_, symbol, rest) = named.fold(plain, |best, other| if other.0 < best.0 - SAME { other } else { best });
        let part = |(symbol, exponent): (&str, f64)| {
            if (exponent - 1.0).abs() < SAME { symbol.to_owned() } else { format!("{symbol}{}", rounded(exponent)) }
        };
        let powers = |sign: f64| {
            let exponents = BASE.iter().map(|&(symbol, place)| (symbol, sign * rest.0[place]));
            exponents.filter(|(_, exponent)| *exponent > SAME).map(part).collect::<Vec<_>>()
        };
        let above: Vec<String> = Some(symbol).filter(|s| !s.is_empty()).into_iter().chain(powers(1.0)).collect();
        let above = if above.is_empty() { "1".to_owned() } else { above.join(" ") };
        powers(-1.0).into_iter().fold(above, |text, factor| format!("{text}/{factor}"))
    }
}

/// Formats an exponent as in a unit: `2`, `^0.5`, `^(2/3)`.
fn rounded(exponent: f64) -> String {
    let whole = exponent.round();
    if (exponent - whole).abs() < SAME {
        return format!("{whole}");
    }
    let over = |n: &f64| (exponent * n - (exponent * n).round()).abs() < SAME;
    match [2.0, 4.0, 5.0, 10.0, 3.0, 6.0, 7.0, 9.0].into_iter().find(over) {
        Some(n) if n == 3.0 || n == 6.0 || n == 7.0 || n == 9.0 => format!("^({}/{n})", (exponent * n).round()),
        _ => format!("^{}", (exponent * 1e6).round() / 1e6),
    }
}

impl PartialEq for Dimension {
    fn eq(&self, other: &Self) -> bool {
        self.0.iter().zip(other.0).all(|(a, b)| (a - b).abs() < SAME)
    }
}

impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.coherent())
    }
}
