//! Dry friction of coupled joints: which stick, which slide, decided by the balance of torques.
//!
//! `M q'' = f - tau`, with `tau_i = T_i` where joint i slides forward, `-T_i` backward, and `|tau_i| <= T_i` where it is
//! stuck and `q''_i = 0`. No smoothed sign: a stuck joint stays exactly where it is.

/// How a joint with dry friction moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contact {
    /// At rest, held by a torque up to its limit.
    Stuck,
    /// Speed positive, or about to be.
    Forward,
    /// Speed negative, or about to be.
    Backward,
}

impl Contact {
    /// 1 forward, -1 backward, 0 stuck.
    #[inline]
    pub fn sign(self) -> f64 {
        match self {
            Self::Stuck => 0.0,
            Self::Forward => 1.0,
            Self::Backward => -1.0,
        }
    }

    fn of(direction: f64) -> Self {
        if direction >= 0.0 { Self::Forward } else { Self::Backward }
    }
}

/// Accelerations and the friction torques that hold stuck joints, for given contacts.
///
/// Rows and columns of stuck joints are taken out of `M q'' = f - tau`; what is left is solved by elimination, which
/// needs no pivoting because a mass matrix is positive definite.
pub fn balance<const N: usize>(
    mass: &[[f64; N]; N],
    force: &[f64; N],
    limit: &[f64; N],
    contact: &[Contact; N],
) -> ([f64; N], [f64; N]) {
    let stuck = |i: usize| limit[i] > 0.0 && contact[i] == Contact::Stuck;
    let mut matrix = *mass;
    let mut acceleration = [0.0; N];
    for i in 0..N {
        acceleration[i] = force[i] - limit[i] * contact[i].sign();
        if stuck(i) {
            acceleration[i] = 0.0;
            for j in 0..N {
                matrix[i][j] = 0.0;
                matrix[j][i] = 0.0;
            }
            matrix[i][i] = 1.0;
        }
    }
    for pivot in 0..N {
        for row in pivot + 1..N {
            let factor = matrix[row][pivot] / matrix[pivot][pivot];
            for column in pivot..N {
                matrix[row][column] -= factor * matrix[pivot][column];
            }
            acceleration[row] -= factor * acceleration[pivot];
        }
    }
    for row in (0..N).rev() {
        for column in row + 1..N {
            acceleration[row] -= matrix[row][column] * acceleration[column];
        }
        acceleration[row] /= matrix[row][row];
    }
    let torque = std::array::from_fn(|i| {
        if stuck(i) {
            force[i] - (0..N).map(|j| mass[i][j] * acceleration[j]).sum::<f64>()
        } else {
            limit[i] * contact[i].sign()
        }
    });
    (acceleration, torque)
}

/// The contacts that agree with the torques: joints that move slide the way they move; each of those at rest is stuck if
/// the torque it takes is within its limit, else it slides the way it accelerates.
///
/// For a positive definite mass matrix exactly one choice agrees (a linear complementarity problem with a P-matrix:
/// R. Cottle, J.-S. Pang, R. Stone, The Linear Complementarity Problem (1992), theorem 3.3.7), so that trying all finds it.
pub fn contacts<const N: usize>(
    mass: &[[f64; N]; N],
    force: &[f64; N],
    limit: &[f64; N],
    speed: &[f64; N],
) -> [Contact; N] {
    const CHOICES: [Contact; 3] = [Contact::Stuck, Contact::Forward, Contact::Backward];
    let resting: Vec<usize> = (0..N).filter(|&i| speed[i] == 0.0 && limit[i] > 0.0).collect();
    let moving: [Contact; N] = std::array::from_fn(|i| Contact::of(speed[i]));
    let mut best = (f64::INFINITY, moving);
    #[allow(clippy::cast_possible_truncation)]
    for code in 0..3_usize.pow(resting.len() as u32) {
        let mut contact = moving;
        let mut digits = code;
        for &i in &resting {
            contact[i] = CHOICES[digits % 3];
            digits /= 3;
        }
        let (acceleration, torque) = balance(mass, force, limit, &contact);
        // How far the choice is from agreeing; rounding leaves the right one at about 1e-16 where two of them meet.
        let discord = resting.iter().map(|&i| match contact[i] {
            Contact::Stuck => torque[i].abs() / limit[i] - 1.0,
            sliding => -sliding.sign() * acceleration[i] * mass[i][i] / limit[i],
        });
        let discord = discord.fold(f64::NEG_INFINITY, f64::max).max(0.0);
        if discord < best.0 {
            best = (discord, contact);
        }
        if discord == 0.0 {
            break;
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    const MASS: [[f64; 2]; 2] = [[2.0, 0.5], [0.5, 1.0]];

    #[test]
    fn joints_at_rest_stick_until_the_torque_exceeds_the_limit() {
        let limit = [1.0, 1.0];
        assert_eq!(contacts(&MASS, &[0.9, -0.9], &limit, &[0.0, 0.0]), [Contact::Stuck, Contact::Stuck]);
        assert_eq!(contacts(&MASS, &[1.1, 0.0], &limit, &[0.0, 0.0]), [Contact::Forward, Contact::Stuck]);
        assert_eq!(contacts(&MASS, &[0.0, -1.1], &limit, &[0.0, 0.0])[1], Contact::Backward);
    }

    #[test]
    fn a_joint_that_moves_can_tear_another_loose() {
        // Joint 0 accelerates by about 10/2; through M01 it needs 2.5 of joint 1, more than its limit of 1.
        let contact = contacts(&MASS, &[10.0, 0.0], &[0.0, 1.0], &[1.0, 0.0]);
        assert_eq!(contact, [Contact::Forward, Contact::Backward]);
    }

    #[test]
    fn the_balance_holds_whatever_sticks() {
        for contact in [
            [Contact::Stuck, Contact::Stuck],
            [Contact::Forward, Contact::Stuck],
            [Contact::Backward, Contact::Forward],
        ] {
            let (force, limit) = ([0.7, -0.3], [0.4, 0.6]);
            let (q, tau) = balance(&MASS, &force, &limit, &contact);
            for i in 0..2 {
                let left = MASS[i][0] * q[0] + MASS[i][1] * q[1];
                assert!((left - (force[i] - tau[i])).abs() < 1e-14);
                assert!(contact[i] != Contact::Stuck || q[i] == 0.0);
            }
        }
    }

    #[test]
    fn every_situation_at_rest_has_contacts_that_agree() {
        for i in -20..=20 {
            for j in -20..=20 {
                let force = [f64::from(i) * 0.1, f64::from(j) * 0.1];
                let contact = contacts(&MASS, &force, &[1.0, 0.5], &[0.0, 0.0]);
                let (q, tau) = balance(&MASS, &force, &[1.0, 0.5], &contact);
                for k in 0..2 {
                    match contact[k] {
                        Contact::Stuck => assert!(tau[k].abs() <= [1.0, 0.5][k] + 1e-12),
                        sliding => assert!(sliding.sign() * q[k] >= -1e-12, "{force:?} {contact:?} {q:?}"),
                    }
                }
            }
        }
    }
}
