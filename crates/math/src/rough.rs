//! Elementary functions of low accuracy, for where no higher one is needed at every step: sums and products alone, with
//! the same bits on every machine.

/// Returns the base-2 logarithm of a normal positive number, to 0.0011. Adds to its exponent a cubic of its mantissa
/// that is exact at powers of 2.
#[inline]
#[must_use]
pub fn log2(x: f64) -> f64 {
    const MANTISSA: u64 = (1 << 52) - 1;
    let bits = x.to_bits();
    #[allow(clippy::cast_precision_loss)]
    let exponent = (bits >> 52) as f64 - 1023.0;
    let m = f64::from_bits(bits & MANTISSA | 1.0f64.to_bits()) - 1.0;
    exponent + m * (1.42 + m * (-0.5717 + m * 0.1517))
}

/// Returns 2 to the power `x`, to 0.012 %: 2 to the floor of `x`, times a cubic of the fractional part that is exact at
/// both ends. `x` lies within the exponent range of normal numbers.
#[inline]
#[must_use]
pub fn exp2(x: f64) -> f64 {
    #[allow(clippy::cast_possible_truncation)]
    let biased = (x + 1023.0) as i32;
    let m = x + 1023.0 - f64::from(biased);
    let power = f64::from_bits(u64::from(biased.unsigned_abs()) << 52);
    power * (1.0 + m * (0.695 + m * (0.2275 + m * 0.0775)))
}
