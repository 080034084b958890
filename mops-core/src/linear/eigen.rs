//! Eigenvalues of a real matrix.

use nalgebra::DMatrix;

use super::Complex;

/// Iterations after which an eigenvalue counts as not found; ten are many.
const ITERATIONS: usize = 90;

/// The eigenvalues of a square matrix, complex ones as exact conjugate pairs, the one above the real axis first.
///
/// Balancing, reduction to Hessenberg form, QR steps with double shift. Source: B. T. Smith et al., Matrix Eigensystem
/// Routines, EISPACK Guide, 2nd edition (1976), routines `balanc` and `hqr`.
///
/// # Errors
/// An entry that is not finite, or, hardly ever, no convergence.
pub fn eigenvalues(a: &DMatrix<f64>) -> Result<Vec<Complex>, String> {
    if a.iter().any(|x| !x.is_finite()) {
        return Err("a matrix with an entry that is not finite has no eigenvalues".to_owned());
    }
    if a.nrows() == 0 {
        return Ok(Vec::new());
    }
    let mut a = a.clone();
    balance(&mut a);
    let h = if a.nrows() > 2 { a.hessenberg().unpack_h() } else { a };
    quasi_triangular(h).ok_or_else(|| "the eigenvalues were not found: the QR steps do not converge".to_owned())
}

/// Scales rows and columns by powers of two, so that their norms agree: a similarity, without rounding.
pub(super) fn balance(a: &mut DMatrix<f64>) -> Vec<f64> {
    let n = a.nrows();
    let mut scales = vec![1.0; n];
    for _ in 0..100 {
        let mut changed = false;
        for i in 0..n {
            let column: f64 = (0..n).filter(|&j| j != i).map(|j| a[(j, i)].abs()).sum();
            let row: f64 = (0..n).filter(|&j| j != i).map(|j| a[(i, j)].abs()).sum();
            let factor = balancing_factor(row, column);
            if factor != 1.0 {
                changed = true;
                scales[i] *= factor;
                a.row_mut(i).unscale_mut(factor);
                a.column_mut(i).scale_mut(factor);
            }
        }
        if !changed {
            break;
        }
    }
    scales
}

/// The power of two by which a column is multiplied and its row divided; 1 where little would be won.
pub(super) fn balancing_factor(row: f64, column: f64) -> f64 {
    if row == 0.0 || column == 0.0 || !(row + column).is_finite() {
        return 1.0;
    }
    let (mut factor, mut scaled): (f64, f64) = (1.0, column);
    while scaled < row / 2.0 && factor < 1e100 {
        factor *= 2.0;
        scaled *= 4.0;
    }
    while scaled >= row * 2.0 && factor > 1e-100 {
        factor /= 2.0;
        scaled /= 4.0;
    }
    if (scaled + row) / factor < 0.95 * (column + row) { factor } else { 1.0 }
}

/// The eigenvalues of a Hessenberg matrix by QR steps with double shift; `None` without convergence.
fn quasi_triangular(mut h: DMatrix<f64>) -> Option<Vec<Complex>> {
    let n = h.nrows();
    let mut roots = Vec::with_capacity(n);
    let norm = h.iter().map(|x| x.abs()).sum::<f64>();
    // Exceptional shifts are taken off the whole diagonal.
    let mut shifted = 0.0;
    let mut end = n;
    while end > 0 {
        let hi = end - 1;
        let mut iteration = 0;
        loop {
            let lo = decoupled(&mut h, hi, norm);
            let x = h[(hi, hi)];
            if lo == hi {
                roots.push(Complex::new(x + shifted, 0.0));
                end -= 1;
                break;
            }
            let (y, w) = (h[(hi - 1, hi - 1)], h[(hi, hi - 1)] * h[(hi - 1, hi)]);
            if lo == hi - 1 {
                roots.extend(pair(x + shifted, y + shifted, w));
                end -= 2;
                break;
            }
            if iteration == ITERATIONS {
                return None;
            }
            let mut shift = (x, y, w);
            if iteration % 10 == 9 {
                shifted += x;
                (0..=hi).for_each(|i| h[(i, i)] -= x);
                let s = h[(hi, hi - 1)].abs() + h[(hi - 1, hi - 2)].abs();
                shift = (0.75 * s, 0.75 * s, -0.4375 * s * s);
            }
            iteration += 1;
            double_step(&mut h, lo, hi, shift);
        }
    }
    roots.reverse();
    // A pair was pushed upper first; the reversal has turned it.
    for i in 1..n {
        if roots[i].im > 0.0 && roots[i - 1].im < 0.0 && roots[i].conj() == roots[i - 1] {
            roots.swap(i - 1, i);
        }
    }
    Some(roots)
}

/// Start of the block that ends at `hi`: a small subdiagonal entry decouples it, and becomes zero.
fn decoupled(h: &mut DMatrix<f64>, hi: usize, norm: f64) -> usize {
    for lo in (1..=hi).rev() {
        let mut s = h[(lo - 1, lo - 1)].abs() + h[(lo, lo)].abs();
        if s == 0.0 {
            s = norm;
        }
        if h[(lo, lo - 1)].abs() <= f64::EPSILON * s {
            h[(lo, lo - 1)] = 0.0;
            return lo;
        }
    }
    0
}

/// Eigenvalues of a 2 x 2 block with diagonal `y`, `x` and product of the others `w`.
fn pair(x: f64, y: f64, w: f64) -> [Complex; 2] {
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

/// One implicit QR step with two shifts on rows and columns `lo` to `hi`.
fn double_step(h: &mut DMatrix<f64>, lo: usize, hi: usize, (x, y, w): (f64, f64, f64)) {
    let (mut p, mut q, mut r);
    let mut m = hi - 2;
    loop {
        let z = h[(m, m)];
        let (a, b) = (x - z, y - z);
        p = (a * b - w) / h[(m + 1, m)] + h[(m, m + 1)];
        q = h[(m + 1, m + 1)] - z - a - b;
        r = h[(m + 2, m + 1)];
        let s = p.abs() + q.abs() + r.abs();
        (p, q, r) = (p / s, q / s, r / s);
        if m == lo {
            break;
        }
        let small = h[(m, m - 1)].abs() * (q.abs() + r.abs());
        let around = p.abs() * (h[(m - 1, m - 1)].abs() + z.abs() + h[(m + 1, m + 1)].abs());
        if small <= f64::EPSILON * around {
            break;
        }
        m -= 1;
    }
    for i in m + 2..=hi {
        h[(i, i - 2)] = 0.0;
        if i > m + 2 {
            h[(i, i - 3)] = 0.0;
        }
    }
    for k in m..hi {
        let mut scale = 0.0;
        if k > m {
            p = h[(k, k - 1)];
            q = h[(k + 1, k - 1)];
            r = if k + 1 < hi { h[(k + 2, k - 1)] } else { 0.0 };
            scale = p.abs() + q.abs() + r.abs();
            if scale != 0.0 {
                (p, q, r) = (p / scale, q / scale, r / scale);
            }
        }
        let s = (p * p + q * q + r * r).sqrt().copysign(p);
        if s == 0.0 {
            continue;
        }
        if k > m {
            h[(k, k - 1)] = -s * scale;
        } else if lo != m {
            h[(k, k - 1)] = -h[(k, k - 1)];
        }
        p += s;
        let (x, y, z) = (p / s, q / s, r / s);
        (q, r) = (q / p, r / p);
        for j in k..=hi {
            let mut sum = h[(k, j)] + q * h[(k + 1, j)];
            if k + 1 < hi {
                sum += r * h[(k + 2, j)];
                h[(k + 2, j)] -= sum * z;
            }
            h[(k + 1, j)] -= sum * y;
            h[(k, j)] -= sum * x;
        }
        for i in lo..=hi.min(k + 3) {
            let mut sum = x * h[(i, k)] + y * h[(i, k + 1)];
            if k + 1 < hi {
                sum += z * h[(i, k + 2)];
                h[(i, k + 2)] -= sum * r;
            }
            h[(i, k + 1)] -= sum * q;
            h[(i, k)] -= sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::testing::{assert_same_set, c, random};

    #[test]
    fn eigenvalues_of_a_companion_matrix_are_the_roots_of_its_polynomial() {
        // (s + 1)(s + 2)(s^2 + 2 s + 10).
        let a = DMatrix::from_row_slice(4, 4, &[-5., -18., -34., -20., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0.]);
        let roots = eigenvalues(&a).unwrap();
        assert_same_set(&roots, &[c(-1., 0.), c(-2., 0.), c(-1., 3.), c(-1., -3.)], 1e-12);
        assert_eq!(roots.iter().filter(|z| z.im != 0.0).map(|z| z.im).sum::<f64>(), 0.0, "pairs are exact");
    }

    #[test]
    fn a_badly_scaled_matrix_is_balanced_first() {
        // A similarity by 1e8 of [[1, 2], [3, 4]].
        let a = DMatrix::from_row_slice(2, 2, &[1.0, 2e8, 3e-8, 4.0]);
        let exact = (33.0f64).sqrt();
        assert_same_set(&eigenvalues(&a).unwrap(), &[c(2.5 - 0.5 * exact, 0.), c(2.5 + 0.5 * exact, 0.)], 1e-14);
    }

    #[test]
    fn sums_and_products_of_eigenvalues_are_trace_and_determinant() {
        for n in 1..=12 {
            let a = random(n, n, n as u64);
            let roots = eigenvalues(&a).unwrap();
            assert_eq!(roots.len(), n);
            let (sum, product) = (roots.iter().sum::<Complex>(), roots.iter().product::<Complex>());
            assert!((sum - a.trace()).norm() < 1e-12 * n as f64, "{n}: {sum} {}", a.trace());
            assert!((product - a.determinant()).norm() < 1e-11 * (1.0 + product.norm()), "{n}");
        }
    }

    #[test]
    fn cyclic_shifts_and_zero_matrices_converge() {
        // Eigenvalues of a cyclic shift are the roots of unity: plain QR steps stand still on it.
        let n = 6;
        let a = DMatrix::from_fn(n, n, |i, j| if (i + 1) % n == j { 1.0 } else { 0.0 });
        let exact: Vec<Complex> =
            (0..n).map(|k| Complex::from_polar(1.0, std::f64::consts::TAU * k as f64 / n as f64)).collect();
        assert_same_set(&eigenvalues(&a).unwrap(), &exact, 1e-13);
        assert!(eigenvalues(&DMatrix::zeros(3, 3)).unwrap().iter().all(|z| z.norm() == 0.0));
        assert!(eigenvalues(&DMatrix::from_element(1, 1, f64::NAN)).is_err());
    }
}
