//! Explicit Runge-Kutta method of Dormand and Prince: order 5(4), dense output of order 4.
//!
//! Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition (1993), table
//! II.5.2 (coefficients), section II.6 (dense output); E. Hairer, G. Wanner, Solving Ordinary Differential Equations
//! II, 2nd edition (1996), section IV.2 (largest eigenvalue from the last two stages, which belong to one time).

use mops_core::Plant;
use mops_language::Scalar;

use super::attempt::Attempt;
use super::weights::Weights;
use super::with_inputs::WithInputs;

/// Stages of a step.
pub struct DormandPrince<S> {
    /// Derivatives at the stages.
    pub(super) k: [Vec<S>; 7],
    /// State of the last stage before the new state.
    pub(super) stage: Vec<S>,
}

impl<S: Scalar> DormandPrince<S> {
    /// Attempts a step with `N` states; `N = 0` means any number.
    #[inline(never)] // Inlined into the loop over steps, the stages lack registers, which costs a quarter of their time.
    pub(super) fn attempt_of<P: Plant<S>, const N: usize>(
        &mut self,
        f: &WithInputs<'_, '_, S, P>,
        at: Attempt<'_, S>,
        next: &mut [S],
    ) -> f64 {
        let Attempt { t, h, x, weights } = at;
        let n = if N == 0 { x.len() } else { N };
        let (x, next) = (&x[..n], &mut next[..n]);
        stages(f, (t, h), x, &mut self.k, &mut self.stage[..n], next);
        error_norm(h, x, next, &self.k, weights)
    }
}

/// Returns slices of length `n`, known to the compiler if `n` is.
#[inline(always)]
fn cut<S>([k0, k1, k2, k3, k4, k5, k6]: &[Vec<S>; 7], n: usize) -> [&[S]; 7] {
    [&k0[..n], &k1[..n], &k2[..n], &k3[..n], &k4[..n], &k5[..n], &k6[..n]]
}

/// Computes the six new stages; `k[0]` is given, `k[6]` is the derivative at the new state.
#[rustfmt::skip]
#[inline(always)]
fn stages<S: Scalar, P: Plant<S>>(
    f: &WithInputs<'_, '_, S, P>, (t, h): (f64, f64), x: &[S], k: &mut [Vec<S>; 7], stage: &mut [S], next: &mut [S],
) {
    let n = x.len();
    // Terms in the order of the stages, so that the newest derivative, the last to be available, is added last.
    macro_rules! combine {
        ($target:expr, $($i:literal * $c:expr),+) => {{
            let k = cut(k, n);
            for j in 0..n {
                $target[j] = x[j] $(+ k[$i][j] * (h * ($c)))+;
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

/// Returns the norm of the embedded error estimate.
#[inline(always)]
fn error_norm<S: Scalar>(h: f64, x: &[S], next: &[S], k: &[Vec<S>; 7], weights: &Weights) -> f64 {
    let k = cut(k, x.len());
    let mut norm = weights.norm(h, x.len());
    for j in 0..x.len() {
        let kj = |i: usize| k[i][j].value();
        let error = h
            * (71.0 / 57600.0 * kj(0) - 71.0 / 16695.0 * kj(2) + 71.0 / 1920.0 * kj(3) - 17253.0 / 339_200.0 * kj(4)
                + 22.0 / 525.0 * kj(5)
                - 1.0 / 40.0 * kj(6));
        norm.add(j, error, [x[j].value(), next[j].value(), kj(6)]);
    }
    norm.of_errors()
}

#[rustfmt::skip]
#[inline]
pub(super) fn dense_output<S: Scalar, const N: usize>(h: f64, x: &[S], next: &[S], k: &[Vec<S>; 7], dense: &mut [Vec<S>; 5]) {
    const D: [f64; 7] = [
        -12_715_105_075.0 / 11_282_082_432.0, 0.0, 87_487_479_700.0 / 32_700_410_799.0, -10_690_763_975.0 / 1_880_347_072.0,
        701_980_252_875.0 / 199_316_789_632.0, -1_453_857_185.0 / 822_651_844.0, 69_997_945.0 / 29_380_423.0,
    ];
    let n = if N == 0 { x.len() } else { N };
    let (k, x, next, [d0, d1, d2, d3, d4]) = (cut(k, n), &x[..n], &next[..n], dense);
    let (d0, d1, d2, d3, d4) = (&mut d0[..n], &mut d1[..n], &mut d2[..n], &mut d3[..n], &mut d4[..n]);
    for j in 0..n {
        let (x0, x1) = (x[j], next[j]);
        let (k1, k7) = (k[0][j] * h, k[6][j] * h);
        let difference = x1 - x0;
        let bspl = k1 - difference;
        let sum = k[0][j] * D[0] + k[2][j] * D[2] + k[3][j] * D[3] + k[4][j] * D[4] + k[5][j] * D[5] + k[6][j] * D[6];
        (d0[j], d1[j], d2[j], d3[j], d4[j]) = (x0, difference, bspl, difference - k7 - bspl, sum * h);
    }
}
