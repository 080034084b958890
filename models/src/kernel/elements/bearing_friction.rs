//! The friction of a bearing.

use mops_core::{Failure, Scalar};

use super::PiecewiseLinear;

/// Dry friction of a bearing: while it turns at speed `w` the torque `-sign(w) T(|w|)`, with `T` linear between the
/// points of a table and beyond its last two; at rest whatever holds it, up to `peak T(0)`.
///
/// Which joints are stuck is decided for all joints of a mechanism at once, see [`crate::kernel::friction`].
///
/// Source: Modelica Standard Library 2.2, Mechanics.Rotational.BearingFriction.
#[derive(Debug, Clone)]
pub struct BearingFriction<S> {
    table: PiecewiseLinear<S>,
    peak: S,
}

impl<S: Scalar> BearingFriction<S> {
    /// Friction by a table of torque (N m) over absolute speed (rad/s), which begins at speed 0.
    ///
    /// # Errors
    /// A table that does not begin at 0 or does not run upwards, a negative torque at rest, or a `peak` below 1.
    pub fn new(table: &[[S; 2]], peak: S) -> Result<Self, Failure> {
        let undefined = |fact: String| Err(Failure::Undefined(fact));
        let function = PiecewiseLinear::new(table)?;
        if table[0][0].value() != 0.0 {
            return undefined(format!("a table of friction begins at speed 0, not at {}", table[0][0].value()));
        }
        if !(0.0..).contains(&table[0][1].value()) {
            return undefined(format!("friction at rest is not negative, but {}", table[0][1].value()));
        }
        if !(1.0..).contains(&peak.value()) {
            return undefined(format!("breaking away takes at least the sliding torque: peak = {} < 1", peak.value()));
        }
        Ok(Self { table: function, peak })
    }

    /// A joint without friction.
    pub fn none() -> Self {
        let table = PiecewiseLinear::new(&[[S::from(0.0); 2]]).expect("a point makes a table");
        Self { table, peak: S::from(1.0) }
    }

    /// The torque against the motion at `speed` in the direction of motion, N m. Negative, it drives.
    #[inline]
    pub fn sliding(&self, speed: S) -> S {
        self.table.at(speed)
    }

    /// The table: its lines are modes.
    pub fn table(&self) -> &PiecewiseLinear<S> {
        &self.table
    }

    /// The torque up to which the joint sticks, N m.
    pub fn limit(&self) -> S {
        self.table.at(S::from(0.0)) * self.peak
    }

    /// Whether the torque passes speed 0 without jump or kink, so that the direction of motion makes no difference.
    pub fn is_viscous(&self) -> bool {
        self.table.is_straight() && self.table.at(S::from(0.0)).value() == 0.0
    }

    /// The speed from which on the torque is negative, so that the friction drives instead of braking, rad/s.
    pub fn drives_from(&self) -> Option<f64> {
        self.table.becomes_negative(0.0)
    }
}
