//! The explicit Runge-Kutta method of Dormand and Prince: order 5(4), dense output of order 4.
//!
//! Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition (1993), table
//! II.5.2 (coefficients), section II.6 (dense output).

use mops_core::{Scalar, Work};

use super::Dynamics;
use super::integrate::{Attempt, Method};
use super::weights::Weights;

/// The stages of a step.
pub(super) struct DormandPrince<X> {
    k: [X; 7],
    stage: X,
}

impl<S: Scalar, D: Dynamics<S>> Method<S, D> for DormandPrince<D::State> {
    const ERROR_ORDER: f64 = 5.0;
    const IS_EXPLICIT: bool = true;

    fn new(_: &D, x: &D::State) -> Self {
        Self { k: std::array::from_fn(|_| x.clone()), stage: x.clone() }
    }

    fn restart(&mut self, f: &D, t: f64, x: &D::State, work: &mut Work) {
        f.derivative(t, x, &mut self.k[0]);
        work.derivatives += 1;
    }

    fn slope(&self) -> &D::State {
        &self.k[0]
    }

    #[inline(never)] // Within the loop over steps the stages run out of registers: a quarter of their time.
    fn attempt(&mut self, f: &D, at: Attempt<'_, D::State>, next: &mut D::State, work: &mut Work) -> f64 {
        let Attempt { t, h, x, weights } = at;
        stages(f, (t, h), x, &mut self.k, &mut self.stage, next);
        work.derivatives += 6;
        error_norm(h, x, next, &self.k, weights)
    }

    #[inline]
    fn advance(&mut self) {
        self.k.swap(0, 6); // First same as last.
    }

    #[inline]
    fn dense(&self, h: f64, x: &D::State, next: &D::State, dense: &mut [D::State; 5]) {
        dense_output(h, x, next, &self.k, dense);
    }
}

/// The six new stages; `k[0]` is given, `k[6]` is the derivative at the new state.
#[rustfmt::skip]
#[inline]
fn stages<S: Scalar, D: Dynamics<S>>(
    f: &D, (t, h): (f64, f64), x: &D::State, k: &mut [D::State; 7], stage: &mut D::State, next: &mut D::State,
) {
    let n = x.as_ref().len();
    // Terms in the order of the stages, so that the newest derivative, which is waited for, comes in last.
    macro_rules! combine {
        ($target:expr, $($i:literal * $c:expr),+) => {{
            let (target, x) = ($target.as_mut(), x.as_ref());
            for j in 0..n {
                target[j] = x[j] $(+ k[$i].as_ref()[j] * (h * ($c)))+;
            }
        }};
    }
    combine!(stage, 0 * (1.0 / 5.0));
    f.derivative(t + h / 5.0, stage, &mut k[1]);
    combine!(stage, 0 * (3.0 / 40.0), 1 * (9.0 / 40.0));
    f.derivative(t + 0.3 * h, stage, &mut k[2]);
    combine!(stage, 0 * (44.0 / 45.0), 1 * (-56.0 / 15.0), 2 * (32.0 / 9.0));
    f.derivative(t + 0.8 * h, stage, &mut k[3]);
    combine!(stage, 0 * (19372.0 / 6561.0), 1 * (-25360.0 / 2187.0), 2 * (64448.0 / 6561.0), 3 * (-212.0 / 729.0));
    f.derivative(t + 8.0 / 9.0 * h, stage, &mut k[4]);
    combine!(stage, 0 * (9017.0 / 3168.0), 1 * (-355.0 / 33.0), 2 * (46732.0 / 5247.0), 3 * (49.0 / 176.0), 4 * (-5103.0 / 18656.0));
    f.derivative(t + h, stage, &mut k[5]);
    combine!(next, 0 * (35.0 / 384.0), 2 * (500.0 / 1113.0), 3 * (125.0 / 192.0), 4 * (-2187.0 / 6784.0), 5 * (11.0 / 84.0));
    f.derivative(t + h, next, &mut k[6]);
}

/// Norm of the embedded error estimate.
#[inline]
fn error_norm<S: Scalar, X: AsRef<[S]>>(h: f64, x: &X, next: &X, k: &[X; 7], weights: &Weights) -> f64 {
    let error = |j: usize| {
        let kj = |i: usize| k[i].as_ref()[j].value();
        h * (71.0 / 57600.0 * kj(0) - 71.0 / 16695.0 * kj(2) + 71.0 / 1920.0 * kj(3) - 17253.0 / 339_200.0 * kj(4)
            + 22.0 / 525.0 * kj(5)
            - 1.0 / 40.0 * kj(6))
    };
    let size = |x: &X, j: usize| x.as_ref()[j].value().abs();
    weights.norm(h, x.as_ref().len(), |j| (error(j), [size(x, j), size(next, j), size(&k[6], j)]))
}

#[rustfmt::skip]
#[inline]
fn dense_output<S: Scalar, X: AsRef<[S]> + AsMut<[S]>>(h: f64, x: &X, next: &X, k: &[X; 7], dense: &mut [X; 5]) {
    const D: [f64; 7] = [
        -12_715_105_075.0 / 11_282_082_432.0, 0.0, 87_487_479_700.0 / 32_700_410_799.0, -10_690_763_975.0 / 1_880_347_072.0,
        701_980_252_875.0 / 199_316_789_632.0, -1_453_857_185.0 / 822_651_844.0, 69_997_945.0 / 29_380_423.0,
    ];
    for j in 0..x.as_ref().len() {
        let (x0, x1) = (x.as_ref()[j], next.as_ref()[j]);
        let (k1, k7) = (k[0].as_ref()[j] * h, k[6].as_ref()[j] * h);
        let difference = x1 - x0;
        let bspl = k1 - difference;
        dense[0].as_mut()[j] = x0;
        dense[1].as_mut()[j] = difference;
        dense[2].as_mut()[j] = bspl;
        dense[3].as_mut()[j] = difference - k7 - bspl;
        let sum = k[0].as_ref()[j] * D[0] + k[2].as_ref()[j] * D[2] + k[3].as_ref()[j] * D[3]
            + k[4].as_ref()[j] * D[4] + k[5].as_ref()[j] * D[5] + k[6].as_ref()[j] * D[6];
        dense[4].as_mut()[j] = sum * h;
    }
}
