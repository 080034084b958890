//! Tuners as coordinates of the sensitivity matrix.

/// Tuner as a coordinate of the sensitivity matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinate {
    /// Name of the tuner.
    pub name: String,
    /// Value at which the derivatives are evaluated.
    pub value: f64,
    /// Largest minus smallest value; replaces the value if that is 0, or counts from an arbitrary zero.
    pub range: f64,
    /// Change over the whole range at the derivative of the tuner's scale: the range, or `value ln(max/min)` for a
    /// logarithmic tuner.
    pub span: f64,
    /// Unit of value and range.
    pub unit: String,
    /// True if the value counts from an arbitrary zero, such as that of degC, so that a share of it has no meaning.
    pub counts_from_any_zero: bool,
}

impl Coordinate {
    /// Returns true if relative changes are related to the range instead of the value.
    pub fn is_by_range(&self) -> bool {
        self.value == 0.0 || self.counts_from_any_zero
    }

    /// Returns the scale of a relative change: the value, or the range.
    pub fn scale(&self) -> f64 {
        if self.is_by_range() { self.range } else { self.value.abs() }
    }
}

/// Returns dimensionless coordinates with these names and values, for tests.
#[cfg(test)]
pub(crate) fn coordinates(values: &[(&str, f64)]) -> Vec<Coordinate> {
    let of = |(name, value): &(&str, f64)| Coordinate {
        name: (*name).into(),
        value: *value,
        range: value.abs().max(1.0),
        span: value.abs().max(1.0),
        unit: "1".into(),
        counts_from_any_zero: false,
    };
    values.iter().map(of).collect()
}
