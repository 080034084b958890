//! Order of persistent excitation of a sampled signal.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Largest order that is tested.
const MOST: usize = 200;

/// Number of parts of the record that are evaluated separately.
const PARTS: usize = 16;

/// Largest number of parts that a transient excites: an edge at each of two places, each at the border of two parts.
const TRANSIENT: usize = 4;

/// Smallest number of samples of a record with a result.
const LEAST: usize = 24;

/// Share of the power that counts as zero: the rounding error of four digits.
const ROUNDING: f64 = 1e-8;

/// Share of the power below which a common floor of all directions counts as noise.
const NOISE: f64 = 1e-4;

/// Factor by which a direction must exceed the noise floor.
const CLEAR: f64 = 10.0;

/// Order of persistent excitation: the largest `n` for which the matrix of the signal's empirical covariances
///
/// ```text
/// C_n = lim 1/N sum_t phi(t) phi(t)',    phi(t) = (u(t - 1), ..., u(t - n))
/// ```
///
/// is positive definite. A pulse has order 0, a step 1, a sinusoid 2, a signal of period p at most p, white noise any.
///
/// In a finite record, eigenvalues of order 1/N remain where the limit is zero: the edge of a step excites every order
/// once. Hence the power of `a' phi(t)` in a direction `a` is computed in sixteen equal parts of the record. The four
/// largest are dropped: excitation of at most four parts is a transient. Power counts as zero below a share of 1e-8, or
/// below ten times the noise. The noise is the given one, or a floor below 1e-4 that all directions share.
///
/// N.B.: only rows with a full window enter the sum, as in the least-squares problem itself. A sinusoid thus is
/// singular to rounding at order 3 for every N.
///
/// Source: L. Ljung, System Identification, 2nd edition (1999), definition 13.1; K. J. Astrom, B. Wittenmark, Adaptive
/// Control, 2nd edition (1995), section 2.4.
#[derive(Debug, Clone, PartialEq)]
pub struct Excitation {
    /// Order of persistent excitation.
    pub order: usize,
    /// Largest order tested; an equal order means "at least".
    pub tested: usize,
    /// Mean square `c(0)` of the signal, in its unit squared.
    pub power: f64,
    /// Smallest persistent eigenvalue of `C_order`, relative to the power.
    pub eigenvalue: f64,
    /// Smallest persistent eigenvalue of `C_(order + 1)`, which counts as zero, relative to the power; `None` at the
    /// largest order tested.
    pub next: Option<f64>,
    /// Smallest eigenvalue of `C_(order + 1)` over the whole record from rest, transients included, relative to the
    /// power.
    pub transient: Option<f64>,
    /// Share of the power that counts as zero.
    pub zero: f64,
    /// Orders and smallest persistent eigenvalues relative to the power, for plotting.
    pub spectrum: Vec<(usize, f64)>,
    /// Number of samples.
    pub samples: usize,
}

impl Excitation {
    /// Returns true if the order is only a lower bound.
    pub fn is_at_least(&self) -> bool {
        self.order > 0 && self.order == self.tested
    }

    /// Returns true if that many parameters can be estimated consistently.
    ///
    /// A finite impulse response of length `n` needs order `n`. For more parameters than the largest order tested the
    /// result is undecided and false.
    pub fn suffices(&self, parameters: usize) -> bool {
        self.order >= parameters
    }
}

/// Returns the order of persistent excitation of equally spaced samples.
///
/// `noise` is the standard deviation of the noise in the signal, in its unit, if known. Records of fewer than 24
/// samples have order 0.
#[allow(clippy::cast_precision_loss)]
pub fn excitation(u: &[f64], noise: Option<f64>) -> Excitation {
    let samples = u.len();
    let power = u.iter().map(|v| v * v).sum::<f64>() / samples.max(1) as f64;
    let tested = (samples / 3).min(MOST);
    let nothing = Excitation {
        order: 0,
        tested,
        power,
        eigenvalue: 0.0,
        next: Some(0.0),
        transient: Some(0.0),
        zero: ROUNDING,
        spectrum: Vec::new(),
        samples,
    };
    if samples < LEAST || power == 0.0 || !power.is_finite() {
        return nothing;
    }
    // Normalised by the power in the windows, so that the unit does not matter.
    let rows = samples - tested + 1;
    let within = u[tested - 1..].iter().map(|v| v * v).sum::<f64>() / rows as f64;
    let scale = if within > ROUNDING * power { within.sqrt() } else { power.sqrt() };
    let u: Vec<f64> = u.iter().map(|v| v / scale).collect();
    let part = |i: usize| covariances(&u[i * rows / PARTS..(i + 1) * rows / PARTS + tested - 1], tested);
    let parts: Vec<DMatrix<f64>> = (0..PARTS).map(part).collect();
    let smallest = |n: usize| smallest(&parts, n);

    let floor = smallest((samples / 10).max(3).min(tested));
    let zero = match noise {
        Some(noise) => CLEAR * noise * noise / power,
        None if floor > ROUNDING && floor < NOISE => CLEAR * floor,
        None => ROUNDING,
    }
    .max(ROUNDING);

    let mut spectrum = Vec::new();
    let mut n = 1;
    while n <= tested {
        spectrum.push((n, smallest(n)));
        n = if n < 24 { n + 1 } else { (n + n / 5).max(n + 1) };
    }
    // The smallest eigenvalue never grows with the order, as C_n is a submatrix of C_(n + 1). Bisection therefore finds
    // the first order that fails.
    let order = match spectrum.iter().position(|(_, share)| *share <= zero) {
        Some(0) => 0,
        Some(first) => {
            let (mut good, mut bad) = (spectrum[first - 1].0, spectrum[first].0);
            while bad - good > 1 {
                let middle = usize::midpoint(good, bad);
                if smallest(middle) > zero { good = middle } else { bad = middle }
            }
            good
        }
        None if smallest(tested) > zero => tested,
        None => spectrum.last().map_or(0, |(n, _)| *n),
    };
    let next = (order < tested).then(|| smallest(order + 1));
    Excitation {
        order,
        eigenvalue: if order > 0 { smallest(order) } else { 0.0 },
        next,
        transient: next.map(|_| from_rest(&u, order + 1)),
        zero,
        spectrum,
        ..nothing
    }
}

/// Returns `1/rows sum_t phi(t) phi(t)'` over all full windows of `n` samples.
///
/// Neighbouring entries of a diagonal differ by the terms that enter and leave the sum.
#[allow(clippy::cast_precision_loss)]
fn covariances(u: &[f64], n: usize) -> DMatrix<f64> {
    let rows = u.len() - n + 1;
    let entry = |i: usize, t: usize| u[t + n - 1 - i];
    let mut c = DMatrix::zeros(n, n);
    for lag in 0..n {
        let mut sum: f64 = (0..rows).map(|t| entry(0, t) * entry(lag, t)).sum();
        for i in 0..n - lag {
            if i > 0 {
                sum += entry(i, 0) * entry(i + lag, 0) - entry(i - 1, rows - 1) * entry(i + lag - 1, rows - 1);
            }
            c[(i, i + lag)] = sum / rows as f64;
            c[(i + lag, i)] = sum / rows as f64;
        }
    }
    c
}

/// Returns the smallest eigenvalue of order `n` over all windows, with zeros before the record.
fn from_rest(u: &[f64], n: usize) -> f64 {
    let padded: Vec<f64> = std::iter::repeat_n(0.0, n - 1).chain(u.iter().copied()).collect();
    SymmetricEigen::new(covariances(&padded, n)).eigenvalues.min().max(0.0)
}

/// Returns the persistent part of the smallest eigenvalue of the leading block of order `n`.
#[allow(clippy::cast_precision_loss)]
fn smallest(parts: &[DMatrix<f64>], n: usize) -> f64 {
    let least = |of: &[usize]| -> (f64, DVector<f64>) {
        let sum = of.iter().fold(DMatrix::zeros(n, n), |sum, &i| sum + parts[i].view((0, 0), (n, n)));
        let eigen = SymmetricEigen::new(sum / of.len() as f64);
        let least = eigen.eigenvalues.imin();
        (eigen.eigenvalues[least].max(0.0), eigen.eigenvectors.column(least).into_owned())
    };
    let mut order: Vec<usize> = (0..parts.len()).collect();
    let (all, mut direction) = least(&order);
    let mut powers: Vec<f64>;
    // Weakest direction without the transients, found iteratively because the transients depend on the direction.
    for _ in 0..2 {
        powers = parts.iter().map(|part| (part.view((0, 0), (n, n)) * &direction).dot(&direction)).collect();
        order.sort_by(|&i, &j| powers[j].total_cmp(&powers[i]));
        direction = least(&order[TRANSIENT..]).1;
    }
    powers = parts.iter().map(|part| (part.view((0, 0), (n, n)) * &direction).dot(&direction)).collect();
    powers.sort_by(|a, b| b.total_cmp(a));
    powers[TRANSIENT].max(0.0).min(all)
}

#[cfg(test)]
mod tests {
    use mops_math as math;
    use rand::Rng;

    use super::*;
    use mops_math::stream;

    fn order(u: &[f64]) -> usize {
        excitation(u, None).order
    }

    fn signal(samples: u32, u: impl Fn(u32) -> f64) -> Vec<f64> {
        (0..samples).map(u).collect()
    }

    /// Returns a maximum-length sequence of seven bits, x^7 + x^6 + 1: period 127.
    ///
    /// Source: S. W. Golomb, Shift Register Sequences (1967).
    fn prbs(samples: u32) -> Vec<f64> {
        let mut register = 1u8;
        let mut next = |_| {
            let bit = (register >> 6) ^ (register >> 5) & 1;
            register = (register << 1) | (bit & 1);
            if bit & 1 == 1 { 1.0 } else { -1.0 }
        };
        (0..samples).map(&mut next).collect()
    }

    #[test]
    fn a_pulse_excites_no_order_and_a_step_one_wherever_they_come() {
        for at in [0, 1, 40, 500, 930] {
            assert_eq!(order(&signal(1000, |t| f64::from(u8::from(t == at)))), 0, "pulse at {at}");
        }
        for at in [0, 1, 40, 300, 500] {
            assert_eq!(order(&signal(1000, |t| f64::from(u8::from(t >= at)))), 1, "step at {at}");
        }
        // For a system initially at rest, the edge of a step before the record still excites.
        assert!(excitation(&[1.0; 1000], None).transient.unwrap() > 1e-4);
        // Without the partition of the record, the edge alone would give the step any order.
        let step = excitation(&signal(1000, |t| f64::from(u8::from(t >= 300))), None);
        assert!(step.next.unwrap() < 1e-12 && step.transient.unwrap() > 1e-4, "{step:?}");
    }

    #[test]
    fn a_sinusoid_has_order_two_also_where_it_is_sampled_finely() {
        for w in [0.01, 0.1, 1.0, 2.5] {
            let found = excitation(&signal(3000, |t| math::sin(w * f64::from(t))), None);
            assert_eq!(found.order, 2, "{w}");
            // C_2 = 1/2 (1, cos w; cos w, 1): the smaller eigenvalue is 1/2 (1 - |cos w|), relative to a power of 1/2.
            let exact = 1.0 - math::cos(w).abs();
            assert!((found.eigenvalue / exact - 1.0).abs() < 0.5, "{w}: {} {exact}", found.eigenvalue);
        }
        let two = |t: u32| math::sin(0.3 * f64::from(t)) + 0.2 * math::cos(1.1 * f64::from(t));
        assert_eq!(order(&signal(1000, two)), 4);
        assert_eq!(order(&signal(1000, |t| 3.0 + two(t))), 5);
    }

    #[test]
    fn the_period_of_a_signal_bounds_its_order() {
        assert_eq!(order(&signal(1000, |t| [1.0, -0.3, 0.7, 2.0, 0.1][t as usize % 5])), 5);
        // A square wave of period 6 has odd harmonics only: frequencies 1/6 and 1/2.
        assert_eq!(order(&signal(1000, |t| if t % 6 < 3 { 1.0 } else { -1.0 })), 3);
        assert_eq!(order(&prbs(1000)), 127);
        let found = excitation(&prbs(2000), None);
        // The spectrum of +-1 with period p is 1 + 1/p, and 1/p^2 at frequency 0.
        assert!(found.order == 127 && (found.eigenvalue * 127.0 - 1.0).abs() < 0.1, "{}", found.eigenvalue);
    }

    #[test]
    fn noise_has_any_order_and_does_not_hide_that_of_the_signal_below_it() {
        let mut random = stream(1, "excitation");
        let noise: Vec<f64> = (0..1000).map(|_| random.random::<f64>() - 0.5).collect();
        let white = excitation(&noise, None);
        assert!(white.is_at_least() && white.order == 200, "{white:?}");
        let noisy: Vec<f64> = (0..1000).map(|t| math::sin(0.3 * f64::from(t)) + 0.01 * noise[t as usize]).collect();
        assert_eq!((order(&noisy), excitation(&noisy, Some(0.01 / 12f64.sqrt())).order), (2, 2));
    }

    #[test]
    fn the_unit_of_a_signal_changes_nothing_and_short_or_empty_records_have_order_zero() {
        let wave = signal(500, |t| 1e-9 * math::sin(0.3 * f64::from(t)));
        assert_eq!(order(&wave), 2);
        assert_eq!((order(&[]), order(&[1.0]), order(&[0.0; 100]), order(&[1.0; 23])), (0, 0, 0, 0));
        assert_eq!(order(&[1.0; 24]), 1);
    }

    #[test]
    fn shifted_sums_are_the_covariances() {
        let u = signal(40, |t| math::sin(0.9 * f64::from(t)) + 0.1 * f64::from(t));
        let windows = DMatrix::from_fn(36, 5, |t, i| u[t + 4 - i]);
        assert!((covariances(&u, 5) - windows.tr_mul(&windows) / 36.0).abs().max() < 1e-12);
    }
}
