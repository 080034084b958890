//! Demands: scaling of criterion values, and validity of demands.

use super::{Missed, Sense, Value};

/// Scaling of a criterion value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Demand {
    /// Upper limit, positive: the value is divided by it.
    AtMost(f64),
    /// Lower limit, not 0.
    AtLeast(f64),
    /// Scaled value 0 at `good` and 1 at `bad`, in either direction.
    Pair {
        /// Scaled value 0.
        good: f64,
        /// Scaled value 1.
        bad: f64,
    },
    /// No demand: the criterion is only monitored, and its scaled value is NaN.
    None,
}

/// A scaled value, and its derivative with respect to the number of the criterion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaled {
    /// Scaled value; at most 1 if the demand is met.
    pub value: f64,
    /// Derivative of the scaled value.
    pub slope: f64,
}

impl Demand {
    /// Returns the scaled value of a number. The formulas for `c` are `c/d` for at most `d`, `1 + (d - c)/|d|` for at
    /// least `d`, and `(c - good)/(bad - good)` for a pair.
    pub fn scale(&self, value: f64) -> f64 {
        match *self {
            Self::AtMost(demand) => value / demand,
            Self::AtLeast(demand) => 1.0 + (demand - value) / demand.abs(),
            Self::Pair { good, bad } => (value - good) / (bad - good),
            Self::None => f64::NAN,
        }
    }

    /// Returns the derivative of [`Demand::scale`].
    pub fn slope(&self) -> f64 {
        match *self {
            Self::AtMost(demand) => 1.0 / demand,
            Self::AtLeast(demand) => -1.0 / demand.abs(),
            Self::Pair { good, bad } => 1.0 / (bad - good),
            Self::None => f64::NAN,
        }
    }

    /// Returns the scaled value of a criterion. A missed criterion counts as `max(1, h/d) (1 + e/(e + b))` for a time
    /// at most `d` with the horizon `h`. Any other missed criterion counts as `1 + e/(e + b)`. Both exceed 1;
    /// [`Missed`] defines `e` and `b`.
    pub fn scaled(&self, value: &Value) -> Scaled {
        let unit = match (value.missed, *self) {
            (_, Self::None) => return Scaled { value: f64::NAN, slope: f64::NAN },
            (None, _) => return Scaled { value: self.scale(value.number), slope: self.slope() },
            // The number is `h (1 + e/(e + b))`.
            (Some(Missed { horizon: Some(h) }), Self::AtMost(demand)) => h.min(demand),
            (Some(Missed { horizon }), _) => horizon.unwrap_or(1.0),
        };
        Scaled { value: value.number / unit, slope: 1.0 / unit }
    }

    /// Returns the demand with its values mapped, such as to another unit.
    #[must_use]
    pub fn map(&self, value: impl Fn(f64) -> f64) -> Self {
        match *self {
            Self::AtMost(demand) => Self::AtMost(value(demand)),
            Self::AtLeast(demand) => Self::AtLeast(value(demand)),
            Self::Pair { good, bad } => Self::Pair { good: value(good), bad: value(bad) },
            Self::None => Self::None,
        }
    }

    /// Returns the value that scales to 1.
    pub fn limit(&self) -> Option<f64> {
        match *self {
            Self::AtMost(demand) | Self::AtLeast(demand) => Some(demand),
            Self::Pair { bad, .. } => Some(bad),
            Self::None => None,
        }
    }

    /// Returns true if larger values scale to smaller ones.
    pub fn asks_for_more(&self) -> bool {
        match *self {
            Self::AtLeast(_) => true,
            Self::Pair { good, bad } => good > bad,
            Self::AtMost(_) | Self::None => false,
        }
    }

    /// Returns the demand for one number `d` of a criterion with this sense. `None` if the sense needs more than a
    /// number, or if the number is 0 or has the wrong sign. `equal` demands the number itself.
    pub fn of(number: f64, sense: Sense, equal: bool) -> Option<Self> {
        match sense {
            _ if !number.is_finite() || number == 0.0 => None,
            Sense::More if !equal || number < 0.0 => Some(Self::AtLeast(number)),
            Sense::Target if !equal => None,
            _ if number > 0.0 => Some(Self::AtMost(number)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_demand_scales_by_its_sense_and_a_pair_either_way_round() {
        assert_eq!(Demand::AtMost(0.1).scale(0.05), 0.05 / 0.1);
        let margin = Demand::Pair { good: 12.0, bad: 6.0 };
        assert_eq!((margin.scale(12.0), margin.scale(6.0), margin.scale(3.0)), (0.0, 1.0, 1.5));
        let at_least = Demand::AtLeast(6.0);
        assert_eq!((at_least.scale(6.0), at_least.scale(9.0), at_least.scale(0.0)), (1.0, 0.5, 2.0));
        let negative = Demand::AtLeast(-4.0);
        assert_eq!((negative.scale(-4.0), negative.scale(0.0), negative.scale(-8.0)), (1.0, 0.0, 2.0));
    }

    #[test]
    fn slopes_are_those_of_the_scaled_values() {
        for demand in [Demand::AtMost(3.0), Demand::AtLeast(-2.0), Demand::Pair { good: 1.0, bad: 5.0 }] {
            assert!((demand.scale(2.0) - demand.scale(1.0) - demand.slope()).abs() < 1e-15, "{demand:?}");
        }
    }

    #[test]
    fn a_missed_criterion_meets_no_demand_whatever_the_horizon() {
        let settling = |distance| Value::missed(Some(5.0), distance, 0.02, "not settled at the end");
        for (demand, least) in [(1.0, 5.0), (5.0, 1.0), (10.0, 1.0)] {
            let scaled = |distance| Demand::AtMost(demand).scaled(&settling(distance)).value;
            assert!(scaled(0.0) > least * (1.0 + 1e-6) && scaled(0.1) > scaled(0.05), "{demand}");
            let exact = least * (1.0 + 0.1 / 0.12);
            assert!((scaled(0.1) - exact).abs() < 1e-12 && scaled(f64::INFINITY) == least * 2.0, "{demand}");
        }
        let pair = Demand::Pair { good: 1.0, bad: 30.0 };
        assert!((pair.scaled(&settling(0.02)).value - 1.5).abs() < 1e-12);
        let crossing = Value::missed(None, 0.5, 0.5, "no crossing");
        for demand in [Demand::AtMost(3.0), Demand::AtLeast(3.0), Demand::Pair { good: 5.0, bad: 3.0 }] {
            assert_eq!(demand.scaled(&crossing).value, 1.5);
        }
    }
}
