//! QR steps with implicit double shift on a Hessenberg matrix.

use nalgebra::{ComplexField, DMatrix};

use super::Complex;
use crate::math;

/// Number of steps without a new eigenvalue after which an exceptional shift is used. Source: LAPACK, `dlahqr`.
pub(super) const EXCEPTIONAL: usize = 10;

/// Number of steps without a new eigenvalue after which a subdiagonal entry counts as zero relative to the whole
/// matrix.
///
/// This is a perturbation of rounding size, though not relative to the neighbours. Three exceptional shifts have failed
/// by then.
pub(super) const LENIENT: usize = 3 * EXCEPTIONAL + 1;

/// Number of steps without a new eigenvalue after which the iteration fails.
pub(super) const MOST: usize = 300;

/// Returns the eigenvalues of a real Hessenberg matrix, or `None` without convergence. Entries below the subdiagonal
/// are ignored.
///
/// Source: LAPACK 3.12, description of `dlahqr`; B. T. Smith et al., Matrix Eigensystem Routines, EISPACK Guide, 2nd
/// edition (1976), `hqr`.
pub(super) fn hessenberg_eigenvalues(mut h: DMatrix<f64>) -> Option<Vec<Complex>> {
    let mut roots = Vec::with_capacity(h.nrows());
    let norm = h.norm();
    let (mut end, mut step) = (h.nrows(), 0);
    while end > 0 {
        let hi = end - 1;
        let lo = decoupled(&mut h, hi, if step >= LENIENT { norm } else { 0.0 });
        if lo + 1 >= hi {
            let found = if lo == hi { vec![Complex::new(h[(hi, hi)], 0.0)] } else { pair(&h, lo).to_vec() };
            roots.extend(found.into_iter().rev());
            (end, step) = (lo, 0);
            continue;
        }
        step += 1;
        if step > MOST {
            return None;
        }
        let shifts = shifts(&h, lo, hi, step);
        let start = start(&h, lo, hi, shifts);
        double_step(&mut h, lo, hi, start);
    }
    roots.reverse();
    Some(roots)
}

/// Returns the start of the block of a Hessenberg matrix that ends at `hi`.
///
/// A negligible subdiagonal entry decouples the block and is set to zero. Entries that are small relative to `norm`
/// count too.
pub(super) fn decoupled<T: ComplexField<RealField = f64>>(h: &mut DMatrix<T>, hi: usize, norm: f64) -> usize {
    for lo in (1..=hi).rev() {
        if negligible(h, lo, hi) || h[(lo, lo - 1)].clone().norm1() <= f64::EPSILON * norm {
            h[(lo, lo - 1)] = T::zero();
            return lo;
        }
    }
    0
}

/// Returns true if the subdiagonal entry in row `k` is negligible relative to its neighbours.
///
/// The test relates its product with the entry across the diagonal to the difference of the diagonal entries.
///
/// Source: M. Ahues, F. Tisseur, A new deflation criterion for the QR algorithm, LAPACK Working Note 122 (1997).
fn negligible<T: ComplexField<RealField = f64>>(h: &DMatrix<T>, k: usize, hi: usize) -> bool {
    let size = |i: usize, j: usize| h[(i, j)].clone().norm1();
    let below = size(k, k - 1);
    let tiny = f64::MIN_POSITIVE * (hi + 1) as f64 / f64::EPSILON;
    if below <= tiny {
        return true;
    }
    let mut around = size(k - 1, k - 1) + size(k, k);
    if around == 0.0 {
        // Zero diagonal: the neighbouring entries give the scale.
        around += if k >= 2 { size(k - 1, k - 2) } else { 0.0 };
        around += if k < hi { size(k + 1, k) } else { 0.0 };
    }
    if below > f64::EPSILON * around {
        return false;
    }
    let above = size(k - 1, k);
    let (large, small) = (below.max(above), below.min(above));
    let difference = (h[(k - 1, k - 1)].clone() - h[(k, k)].clone()).norm1();
    let (most, least) = (size(k, k).max(difference), size(k, k).min(difference));
    let sum = most + large;
    small * (large / sum) <= tiny.max(f64::EPSILON * (least * (most / sum)))
}

/// Returns the two shifts of a step, both real or a conjugate pair.
fn shifts(h: &DMatrix<f64>, lo: usize, hi: usize, step: usize) -> [Complex; 2] {
    let at = |i: usize, j: usize| h[(i, j)];
    // Exceptional shifts alternate between the lower and the upper end. Source: LAPACK, `dlahqr`.
    let exceptional = |diagonal: f64, s: f64| [0.75 * s + diagonal, -0.4375 * s, s, 0.75 * s + diagonal];
    let [a, b, c, d] = if step.is_multiple_of(2 * EXCEPTIONAL) {
        exceptional(at(hi, hi), at(hi, hi - 1).abs() + at(hi - 1, hi - 2).abs())
    } else if step.is_multiple_of(EXCEPTIONAL) {
        exceptional(at(lo, lo), at(lo + 1, lo).abs() + at(lo + 2, lo + 1).abs())
    } else {
        [at(hi - 1, hi - 1), at(hi - 1, hi), at(hi, hi - 1), at(hi, hi)]
    };
    let s = a.abs() + b.abs() + c.abs() + d.abs();
    if s == 0.0 {
        return [Complex::new(0.0, 0.0); 2];
    }
    let [a, b, c, d] = [a, b, c, d].map(|x| x / s);
    let half = 0.5 * (a + d);
    let determinant = (a - half) * (d - half) - b * c;
    let root = determinant.abs().sqrt();
    if determinant >= 0.0 {
        let shift = Complex::new(half * s, root * s);
        return [shift, shift.conj()];
    }
    // Two real shifts: the one nearer to the last entry, twice.
    let (first, second) = (half + root, half - root);
    let nearer = if (first - d).abs() <= (second - d).abs() { first } else { second };
    [Complex::new(nearer * s, 0.0); 2]
}

/// Returns the start row of the step and the first column of `(H - first)(H - second)` there, up to a factor.
///
/// The step can start where the two adjacent subdiagonal entries together are small.
fn start(h: &DMatrix<f64>, lo: usize, hi: usize, [first, second]: [Complex; 2]) -> (usize, [f64; 3]) {
    let mut m = hi - 2;
    loop {
        let (z, below) = (h[(m, m)], h[(m + 1, m)]);
        let s = (z - second.re).abs() + second.im.abs() + below.abs();
        let b = below / s;
        let v = [
            b * h[(m, m + 1)] + (z - first.re) * ((z - second.re) / s) - first.im * (second.im / s),
            b * (z + h[(m + 1, m + 1)] - first.re - second.re),
            b * h[(m + 2, m + 1)],
        ];
        let size: f64 = v.iter().map(|x| x.abs()).sum();
        let v = if size > 0.0 { v.map(|x| x / size) } else { [1.0, 0.0, 0.0] };
        if m == lo {
            return (m, v);
        }
        let around = h[(m - 1, m - 1)].abs() + z.abs() + h[(m + 1, m + 1)].abs();
        if h[(m, m - 1)].abs() * (v[1].abs() + v[2].abs()) <= f64::EPSILON * v[0].abs() * around {
            return (m, v);
        }
        m -= 1;
    }
}

/// Performs one implicit step on rows and columns `lo` to `hi`: reflections chase a bulge down from row `m`.
fn double_step(h: &mut DMatrix<f64>, lo: usize, hi: usize, (m, column): (usize, [f64; 3])) {
    for k in m..hi {
        let rows = (hi - k + 1).min(3);
        let mut v = if k > m { [h[(k, k - 1)], h[(k + 1, k - 1)], 0.0] } else { column };
        if k > m && rows == 3 {
            v[2] = h[(k + 2, k - 1)];
        }
        if rows == 2 {
            v[2] = 0.0;
        }
        let (beta, factor) = reflection(&mut v);
        if k > m {
            h[(k, k - 1)] = beta;
            (1..rows).for_each(|i| h[(k + i, k - 1)] = 0.0);
        } else if m > lo {
            h[(k, k - 1)] *= 1.0 - factor;
        }
        for j in k..=hi {
            let sum: f64 = (0..rows).map(|i| v[i] * h[(k + i, j)]).sum();
            (0..rows).for_each(|i| h[(k + i, j)] -= factor * v[i] * sum);
        }
        for i in lo..=hi.min(k + 3) {
            let sum: f64 = (0..rows).map(|j| v[j] * h[(i, k + j)]).sum();
            (0..rows).for_each(|j| h[(i, k + j)] -= factor * v[j] * sum);
        }
    }
}

/// Replaces `x` by the vector `v`, with a first entry of 1, of the reflection `1 - factor v v^T` that maps `x` to
/// `(beta, 0, 0)`. Returns `beta` and `factor`.
fn reflection(x: &mut [f64; 3]) -> (f64, f64) {
    let rest = math::hypot(x[1], x[2]);
    if rest == 0.0 {
        let beta = x[0];
        *x = [1.0, 0.0, 0.0];
        return (beta, 0.0);
    }
    let beta = -math::hypot(x[0], rest).copysign(x[0]);
    let (factor, divisor) = ((beta - x[0]) / beta, x[0] - beta);
    *x = [1.0, x[1] / divisor, x[2] / divisor];
    (beta, factor)
}

/// Returns the eigenvalues of the 2 x 2 block at row `k`.
fn pair(h: &DMatrix<f64>, k: usize) -> [Complex; 2] {
    let (y, x, w) = (h[(k, k)], h[(k + 1, k + 1)], h[(k + 1, k)] * h[(k, k + 1)]);
    let p = 0.5 * (y - x);
    let q = p * p + w;
    let root = q.abs().sqrt();
    if q >= 0.0 {
        let z = p + root.copysign(p);
        [x + z, if z == 0.0 { x + z } else { x - w / z }].map(|re| Complex::new(re, 0.0))
    } else {
        [Complex::new(x + p, root), Complex::new(x + p, -root)]
    }
}
