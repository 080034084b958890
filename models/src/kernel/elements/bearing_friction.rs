//! Bearing friction.

use mops_core::Failure;
use mops_language::Scalar;

use super::PiecewiseLinear;

/// Dry friction of a bearing. At speed `w` the torque is `-sign(w) T(|w|)`, with `T` linear between the points of a
/// table and extrapolated beyond the last two. At rest friction balances any torque up to `peak T(0)`.
///
/// The contacts of all joints of a mechanism are found together, see [`crate::kernel::friction`].
///
/// Source: Modelica Standard Library 2.2, Mechanics.Rotational.BearingFriction.
#[derive(Debug, Clone)]
pub struct BearingFriction<S> {
    table: PiecewiseLinear<S>,
    peak: S,
}

impl<S: Scalar> BearingFriction<S> {
    /// Creates the friction from a table of torque (N m) over absolute speed (rad/s), which starts at speed 0.
    ///
    /// # Errors
    /// The table does not start at 0, its speeds do not increase, the torque at rest is negative, or `peak` is below 1.
    pub fn new(table: &[[S; 2]], peak: S) -> Result<Self, Failure> {
        let undefined = |fact: String| Err(Failure::Undefined(fact));
        let function = PiecewiseLinear::new(table)?;
        if table[0][0].value() != 0.0 {
            return undefined(format!("a friction table must start at speed 0, found {}", table[0][0].value()));
        }
        if !(0.0..).contains(&table[0][1].value()) {
            return undefined(format!("friction at rest must not be negative, found {}", table[0][1].value()));
        }
        if !(1.0..).contains(&peak.value()) {
            return undefined(format!(
                "the break-away torque must be at least the sliding torque: expected peak >= 1, found {}",
                peak.value()
            ));
        }
        Ok(Self { table: function, peak })
    }

    /// Creates a joint without friction.
    pub fn none() -> Self {
        let table = PiecewiseLinear::new(&[[S::from(0.0); 2]]).expect("a point makes a table");
        Self { table, peak: S::from(1.0) }
    }

    /// Returns the friction torque at `speed` in the direction of motion, N m: positive against the motion. A negative
    /// torque drives the joint.
    #[inline]
    pub fn sliding(&self, speed: S) -> S {
        self.table.at(speed)
    }

    /// Returns the table; its line segments are modes.
    pub fn table(&self) -> &PiecewiseLinear<S> {
        &self.table
    }

    /// Returns the torque up to which the joint sticks, N m.
    pub fn limit(&self) -> S {
        self.table.at(S::from(0.0)) * self.peak
    }

    /// Returns true if the torque passes through speed 0 without jump or kink, so that the direction of motion makes no
    /// difference.
    pub fn is_viscous(&self) -> bool {
        self.table.is_straight() && self.table.at(S::from(0.0)).value() == 0.0
    }

    /// Returns the lowest speed at which the torque becomes negative and friction drives the joint, rad/s.
    pub fn drives_from(&self) -> Option<f64> {
        self.table.becomes_negative(0.0)
    }
}
