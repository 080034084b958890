//! Dry friction of coupled joints: the torque balance decides which joints stick and which slide.
//!
//! The equation is `M q'' = f - tau`. `tau_i = T_i` if joint i slides forward, `-T_i` if it slides backward. If the
//! joint is stuck, `q''_i = 0` and `tau_i` is within its limit. The sign function is not smoothed: a stuck joint does
//! not move at all.

use mops_language::Scalar;

/// Contact state of a joint with dry friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contact {
    /// At rest; friction balances the torque up to its limit.
    Stuck,
    /// Sliding forward: speed positive, or about to become positive.
    Forward,
    /// Sliding backward: speed negative, or about to become negative.
    Backward,
}

impl Contact {
    /// Returns 1 for forward, -1 for backward, 0 for stuck.
    #[inline]
    pub fn sign(self) -> f64 {
        match self {
            Self::Stuck => 0.0,
            Self::Forward => 1.0,
            Self::Backward => -1.0,
        }
    }

    pub(crate) fn of(direction: f64) -> Self {
        if direction >= 0.0 { Self::Forward } else { Self::Backward }
    }
}

/// Computes the accelerations and friction torques of all joints for given contacts; `sliding` are the torques of
/// sliding joints.
///
/// Rows and columns of stuck joints are removed from `M q'' = f - tau`. The remaining system is solved by Gaussian
/// elimination, which needs no pivoting because a mass matrix is positive definite.
pub fn balance<S: Scalar, const N: usize>(
    mass: &[[S; N]; N],
    force: &[S; N],
    sliding: &[S; N],
    contact: &[Contact; N],
) -> ([S; N], [S; N]) {
    let stuck = |i: usize| contact[i] == Contact::Stuck;
    let mut matrix = *mass;
    let mut acceleration = *force;
    for i in 0..N {
        acceleration[i] -= sliding[i] * contact[i].sign();
        if stuck(i) {
            acceleration[i] = S::from(0.0);
            for j in 0..N {
                matrix[i][j] = S::from(0.0);
                matrix[j][i] = S::from(0.0);
            }
            matrix[i][i] = S::from(1.0);
        }
    }
    for pivot in 0..N {
        for row in pivot + 1..N {
            let factor = matrix[row][pivot] / matrix[pivot][pivot];
            for column in pivot..N {
                let above = matrix[pivot][column];
                matrix[row][column] -= factor * above;
            }
            let above = acceleration[pivot];
            acceleration[row] -= factor * above;
        }
    }
    for row in (0..N).rev() {
        for column in row + 1..N {
            let known = acceleration[column];
            acceleration[row] -= matrix[row][column] * known;
        }
        acceleration[row] = acceleration[row] / matrix[row][row];
    }
    let torque = std::array::from_fn(|i| {
        if stuck(i) {
            (0..N).fold(force[i], |left, j| left - mass[i][j] * acceleration[j])
        } else {
            sliding[i] * contact[i].sign()
        }
    });
    (acceleration, torque)
}

/// Finds the contacts of joints whose break-away torque equals their sliding torque `limit`; see [`Moment::contacts`].
pub fn contacts<const N: usize>(
    mass: &[[f64; N]; N],
    force: &[f64; N],
    limit: &[f64; N],
    speed: &[f64; N],
) -> [Contact; N] {
    Moment { mass, force, sliding: limit, limit, speed }.contacts(&[Contact::Stuck; N], None)
}

/// State of all joints at one instant.
#[derive(Debug)]
pub struct Moment<'a, const N: usize> {
    /// Mass matrix.
    pub mass: &'a [[f64; N]; N],
    /// Torques on the joints without dry friction.
    pub force: &'a [f64; N],
    /// Friction torques of the joints if they slide, at their current speeds.
    pub sliding: &'a [f64; N],
    /// Break-away torques: a joint at rest sticks up to this torque. At least the sliding torque at rest; 0 for a joint
    /// that never sticks.
    pub limit: &'a [f64; N],
    /// Speeds.
    pub speed: &'a [f64; N],
}

impl<const N: usize> Moment<'_, N> {
    /// Finds the contacts that are consistent with the torques. Moving joints slide in their direction of motion. A
    /// joint at rest is stuck if the torque that this requires is within its limit; else it slides in the direction of
    /// its acceleration. The joint `released` has just exceeded its limit and does not stick again.
    ///
    /// If the break-away torques equal the sliding torques, exactly one choice is consistent for a positive definite
    /// mass matrix. This is a linear complementarity problem with a P-matrix: R. Cottle, J.-S. Pang, R. Stone, The
    /// Linear Complementarity Problem (1992), theorem 3.3.7. If break-away torques are larger, several choices may be
    /// consistent; the one nearest to `wish`, the contacts so far, is returned.
    pub fn contacts(&self, wish: &[Contact; N], released: Option<usize>) -> [Contact; N] {
        const CHOICES: [Contact; 3] = [Contact::Forward, Contact::Backward, Contact::Stuck];
        let resting: Vec<usize> = (0..N).filter(|&i| self.speed[i] == 0.0).collect();
        let moving: [Contact; N] = std::array::from_fn(|i| Contact::of(self.speed[i]));
        let largest = self.limit.iter().chain(self.force).fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
        // Rounding changes the excess of the right choice by about 1e-16 where two choices coincide.
        let rounding = 1e-12 * largest;
        let mut best = (f64::INFINITY, moving);
        #[allow(clippy::cast_possible_truncation, clippy::cast_precision_loss)]
        for code in 0..3_usize.pow(resting.len() as u32) {
            let mut contact = moving;
            let mut digits = code;
            for &i in &resting {
                contact[i] = CHOICES[digits % 3];
                digits /= 3;
            }
            let sticks = |i: usize| contact[i] == Contact::Stuck;
            if resting.iter().any(|&i| sticks(i) && (self.limit[i] == 0.0 || released == Some(i))) {
                continue;
            }
            let (acceleration, torque) = balance(self.mass, self.force, self.sliding, &contact);
            let excess = resting.iter().map(|&i| match contact[i] {
                Contact::Stuck => torque[i].abs() - self.limit[i],
                sliding => -sliding.sign() * acceleration[i] * self.mass[i][i],
            });
            let excess = excess.fold(0.0, f64::max);
            let departures = resting.iter().filter(|&&i| contact[i] != wish[i]).count();
            // Consistent choices are ranked by their departures, fewer than N + 1; all others rank after them.
            let rank = if excess <= rounding { departures as f64 } else { N as f64 + 1.0 + excess / largest };
            if rank < best.0 {
                best = (rank, contact);
            }
        }
        best.1
    }
}
