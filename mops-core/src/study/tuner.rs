//! Tuners: the quantities a study may change, and their mapping to the unit box of the solvers.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use mops_language::{Expression, Unit};
use mops_math as math;

/// Mapping of the range of a tuner to [0, 1].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// Linear.
    #[default]
    Linear,
    /// Logarithmic; the range excludes zero.
    Log,
}

/// Values a tuner may take between its bounds.
#[derive(Debug, Clone, PartialEq)]
pub enum Grid {
    /// Any value.
    Continuous,
    /// Integers.
    Integer,
    /// Listed values, in increasing order.
    List(Vec<f64>),
}

impl Grid {
    /// Returns true if the grid contains a value.
    pub fn has(&self, value: f64) -> bool {
        match self {
            Self::Continuous => true,
            Self::Integer => value.fract() == 0.0,
            Self::List(values) => values.contains(&value),
        }
    }
}

/// A quantity that the study may change.
#[derive(Debug, Clone)]
pub struct Tuner {
    /// Name in reports; `case/name` for a tuner of one case.
    pub name: String,
    /// Name of the model parameter that the tuner sets.
    pub parameter: String,
    /// Initial guess.
    pub start: f64,
    /// Smallest and largest value.
    pub bounds: [f64; 2],
    /// Mapping of the range to [0, 1].
    pub scale: Scale,
    /// Allowed values between the bounds.
    pub grid: Grid,
    /// Unit of the values and bounds.
    pub unit: Unit,
    /// Case to which the tuner belongs, by index; `None` for the whole study.
    pub case: Option<usize>,
    /// True if a solver may change the tuner.
    pub active: bool,
    /// Tie to other tuners: the expression, and the indices of the tuners in it; `None` for an independent tuner.
    pub tie: Option<(Expression, Vec<usize>)>,
    /// True for a lower and an upper bound guessed from data, as for initial states: such bounds are not limits.
    pub guessed: [bool; 2],
}

/// Part of a tuner's range within which a value is at its bound: above the rounding of positions. In a range of seven
/// decades, optima of ordinary size are not.
const AT_BOUND: f64 = 1e-9;

impl Tuner {
    /// Returns the value at `u` in [0, 1].
    pub fn value_at(&self, u: f64) -> f64 {
        let [min, max] = self.bounds;
        let u = u.clamp(0.0, 1.0);
        let spread = |u: f64| match self.scale {
            // The ends are exact to the bit, despite rounding between them.
            _ if u == 0.0 => min,
            _ if u == 1.0 => max,
            Scale::Linear => min + u * (max - min),
            Scale::Log => min.signum() * math::exp(math::ln(min.abs()) + u * math::ln(max / min)),
        };
        match &self.grid {
            Grid::Continuous => spread(u),
            Grid::Integer => spread(u).round().clamp(min, max),
            Grid::List(values) => values[self.index_at(u, values.len())],
        }
    }

    /// Returns the derivative of [`Tuner::value_at`] at the value `value`, for a continuous tuner.
    pub fn slope_at(&self, value: f64) -> f64 {
        let [min, max] = self.bounds;
        match self.scale {
            Scale::Linear => max - min,
            Scale::Log => value * math::ln(max / min),
        }
    }

    /// Returns the position of `value` in [0, 1], clamped to the bounds.
    pub fn position_of(&self, value: f64) -> f64 {
        let [min, max] = self.bounds;
        let u = match (&self.grid, self.scale) {
            (Grid::List(values), _) => {
                let nearest = (0..values.len())
                    .min_by(|&i, &j| (values[i] - value).abs().total_cmp(&(values[j] - value).abs()))
                    .expect("a list has at least two values");
                #[allow(clippy::cast_precision_loss)]
                return nearest as f64 / (values.len() - 1) as f64;
            }
            (_, Scale::Linear) => (value - min) / (max - min),
            (_, Scale::Log) => math::ln(value / min) / math::ln(max / min),
        };
        u.clamp(0.0, 1.0)
    }

    /// Returns the distance between neighbouring values in the unit box; 0 for a continuous tuner.
    #[allow(clippy::cast_precision_loss)]
    pub fn spacing(&self) -> f64 {
        match &self.grid {
            Grid::Continuous => 0.0,
            Grid::Integer => 1.0 / (self.bounds[1] - self.bounds[0]),
            Grid::List(values) => 1.0 / (values.len() - 1) as f64,
        }
    }

    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    fn index_at(&self, u: f64, count: usize) -> usize {
        (u * (count - 1) as f64).round() as usize
    }

    /// Returns `lower` or `upper` if `value` is at that bound, to within 1e-9 of the range.
    pub fn at_bound(&self, value: f64) -> Option<&'static str> {
        match self.position_of(value) {
            u if u <= AT_BOUND => Some("lower"),
            u if u >= 1.0 - AT_BOUND => Some("upper"),
            _ => None,
        }
    }
}

/// Returns the fact that a share, a ratio or a logarithm of a parameter on a temperature scale has no meaning.
pub(super) fn ratio_of_temperatures(name: &str, unit: &Unit) -> String {
    format!("`{name}` is a temperature in {unit}, of which a share or a ratio depends on the zero of the scale")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tuner(scale: Scale, grid: Grid) -> Tuner {
        Tuner {
            name: "k".into(),
            parameter: "k".into(),
            start: 4.0,
            bounds: [0.1, 50.0],
            scale,
            grid,
            unit: Unit::one(),
            case: None,
            active: true,
            tie: None,
            guessed: [false; 2],
        }
    }

    #[test]
    fn value_and_position_are_inverse() {
        for scale in [Scale::Linear, Scale::Log] {
            let t = tuner(scale, Grid::Continuous);
            for value in [0.1, 0.2, 4.0, 49.0, 50.0] {
                assert!((t.value_at(t.position_of(value)) - value).abs() < 1e-12 * value.max(1.0));
            }
            assert_eq!((t.value_at(0.0), t.value_at(1.0)), (0.1, 50.0));
        }
    }

    #[test]
    fn the_slope_is_that_of_the_value() {
        let negative = Tuner { bounds: [-50.0, -0.1], ..tuner(Scale::Log, Grid::Continuous) };
        for t in [tuner(Scale::Linear, Grid::Continuous), tuner(Scale::Log, Grid::Continuous), negative] {
            let slope = (t.value_at(0.4 + 1e-6) - t.value_at(0.4 - 1e-6)) / 2e-6;
            assert!((t.slope_at(t.value_at(0.4)) - slope).abs() < 1e-6 * slope, "{:?}", t.scale);
        }
    }

    #[test]
    fn a_negative_range_in_the_logarithm_is_the_mirror_of_the_positive_one() {
        let positive = tuner(Scale::Log, Grid::Continuous);
        let negative = Tuner { bounds: [-50.0, -0.1], ..tuner(Scale::Log, Grid::Continuous) };
        for u in [0.0, 0.2, 0.7, 1.0] {
            let mirrored = -positive.value_at(1.0 - u);
            assert!((negative.value_at(u) - mirrored).abs() < 1e-12 * mirrored.abs());
            assert!((negative.position_of(negative.value_at(u)) - u).abs() < 1e-12);
        }
    }

    #[test]
    fn grids_are_kept() {
        let whole = Tuner { bounds: [1.0, 5.0], ..tuner(Scale::Linear, Grid::Integer) };
        assert_eq!((whole.value_at(0.3), whole.spacing()), (2.0, 0.25));
        let wide = Tuner { bounds: [1.0, 100.0], ..tuner(Scale::Log, Grid::Integer) };
        assert_eq!((wide.value_at(wide.position_of(4.0)), wide.value_at(1.0)), (4.0, 100.0));
        let list = Tuner { bounds: [1.0, 47.0], ..tuner(Scale::Linear, Grid::List(vec![1.0, 10.0, 22.0, 47.0])) };
        assert_eq!((list.value_at(0.4), list.position_of(20.0)), (10.0, 2.0 / 3.0));
    }

    #[test]
    fn a_value_at_its_bound_is_reported() {
        let t = tuner(Scale::Linear, Grid::Continuous);
        assert_eq!((t.at_bound(0.1), t.at_bound(25.0), t.at_bound(50.0)), (Some("lower"), None, Some("upper")));
    }
}
