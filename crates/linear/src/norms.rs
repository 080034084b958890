//! Peak gain and Hinf norm of a linear system.

use mops_math::complex;
use nalgebra::DMatrix;

use super::bounded_response::{BoundedResponse, Span};
use super::eigen::eigenvalues_of;
use super::search::{highest, maximise};
use super::system::{above, beside};
use super::{Complex, FrequencyResponse, StateSpace, eigenvalues, undecided, zeros};

/// Peak gain over frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Largest singular value of the response.
    pub gain: f64,
    /// Frequency of the peak, rad/s; infinite if the peak is the gain of `D`.
    pub frequency: f64,
}

/// Relative increase from which on a higher gain counts.
const HIGHER: f64 = 1e-10;

/// Returns the Hinf norm: [`peak_gain`] of a stable system.
///
/// # Errors
/// If the system is not stable: the norm is infinite.
pub fn hinf_norm(system: &StateSpace) -> Result<Peak, String> {
    check_stable(system, "Hinf norm")?;
    peak_gain(system)
}

/// Checks that a system is stable beyond rounding errors.
///
/// # Errors
/// If not, with the name of the `norm`.
pub(super) fn check_stable(system: &StateSpace, norm: &str) -> Result<(), String> {
    if !system.is_stable()? {
        return Err(format!("the system is not stable: its {norm} is infinite"));
    }
    match undecided(&system.a)?.first() {
        Some(pole) => Err(format!(
            "stability is undecided: within rounding errors the pole at {:.3e} {:+.3e}i lies on the imaginary axis",
            pole.re, pole.im
        )),
        None => Ok(()),
    }
}

/// Returns the largest singular value of the frequency response over all frequencies, and its frequency. The delay has
/// no influence.
///
/// With one input and one output, an attained gain and bounds over all frequencies close in on the peak. With several,
/// the Hamiltonian matrix of a gain has eigenvalues on the imaginary axis exactly where the response crosses that gain.
/// The response is evaluated between two such frequencies to get the next, higher gain.
///
/// Source: N. A. Bruinsma, M. Steinbuch, A fast algorithm to compute the Hinf norm of a transfer function matrix,
/// Systems and Control Letters 14 (1990) 287-293.
///
/// # Errors
/// If a pole lies on the imaginary axis, where the gain is infinite, or if an entry is not finite.
pub fn peak_gain(system: &StateSpace) -> Result<Peak, String> {
    let Peak { gain, frequency } = peak_on_axis(system)?;
    Ok(Peak { gain, frequency: system.frequency(frequency) })
}

/// Returns the peak with its point `j v` of the imaginary axis as frequency.
fn peak_on_axis(system: &StateSpace) -> Result<Peak, String> {
    let poles = eigenvalues(&system.a)?;
    if poles.iter().any(|p| p.re == 0.0) || !undecided(&system.a)?.is_empty() {
        return Err("a pole lies on the imaginary axis: the gain is infinite there".to_owned());
    }
    let system = StateSpace { delay: 0.0, ..system.clone() };
    let end = Peak { gain: largest_singular_value(&system.d.map(|d| Complex::new(d, 0.0))), frequency: f64::INFINITY };
    if system.b.ncols() == 1 && system.c.nrows() == 1 {
        let (gain, frequency) = highest(&BoundedResponse::new(&system)?, |_, l| complex::norm(l), Span::gain)?;
        return Ok(if end.gain > gain { end } else { Peak { gain, frequency } });
    }
    let response = system.response()?;
    let mut best = end;
    let resonances =
        poles.iter().flat_map(|p| [complex::norm(*p), p.im.abs(), (p.im * p.im - p.re * p.re).max(0.0).sqrt()]);
    for frequency in resonances.chain([0.0]) {
        best = better(best, &response, frequency);
    }
    for _ in 0..40 {
        let level = best.gain * (1.0 + HIGHER);
        if level == 0.0 {
            break;
        }
        let mut passed = level_frequencies(&system, level)?;
        passed.push(0.0);
        passed.sort_by(f64::total_cmp);
        let before = best;
        for pair in passed.windows(2) {
            best = better(best, &response, 0.5 * (pair[0] + pair[1]));
        }
        if best.gain <= level {
            best = before;
            break;
        }
    }
    Ok(polished(best, &response))
}

fn better(best: Peak, response: &FrequencyResponse, frequency: f64) -> Peak {
    let gain = largest_singular_value(&response.on_axis(frequency));
    if gain > best.gain { Peak { gain, frequency } } else { best }
}

/// Refines a peak by golden-section search over +-0.1 % of its frequency.
fn polished(peak: Peak, response: &FrequencyResponse) -> Peak {
    if !peak.frequency.is_finite() || peak.frequency == 0.0 {
        return peak;
    }
    let gain = |frequency: f64| largest_singular_value(&response.on_axis(frequency));
    let frequency = maximise(gain, peak.frequency * (1.0 - 1e-3), peak.frequency * (1.0 + 1e-3));
    better(peak, response, frequency)
}

/// Returns the largest singular value.
pub(super) fn largest_singular_value(m: &DMatrix<Complex>) -> f64 {
    if m.len() == 1 {
        return complex::norm(m[(0, 0)]);
    }
    if m.iter().any(|z| !z.is_finite()) {
        return f64::INFINITY;
    }
    m.clone().singular_values().iter().copied().fold(0.0, f64::max)
}

/// Returns candidate frequencies, not refined, at which a singular value of the response may equal `level`.
///
/// They belong to eigenvalues near the imaginary axis. Rounding moves a double eigenvalue by the square root of the
/// machine precision, hence the wide strip.
pub(super) fn level_frequencies(system: &StateSpace, level: f64) -> Result<Vec<f64>, String> {
    let StateSpace { a, b, c, d, .. } = system;
    let (n, m) = (a.nrows(), b.ncols());
    let near = |z: &Complex| z.im >= 0.0 && z.re.abs() <= 1e-5 * complex::norm(*z);
    let rest = DMatrix::identity(m, m) * (level * level) - d.transpose() * d;
    let Some(r) = rest.clone().try_inverse() else {
        // The level is the high-frequency gain: use the zeros of `G(-s)' G(s) - level^2`.
        let mut product = DMatrix::zeros(2 * n, 2 * n);
        product.view_mut((0, 0), (n, n)).copy_from(a);
        product.view_mut((n, 0), (n, n)).copy_from(&(-(c.transpose() * c)));
        product.view_mut((n, n), (n, n)).copy_from(&-a.transpose());
        let inputs = above(b, &-(c.transpose() * d));
        let outputs = beside(&(d.transpose() * c), &b.transpose());
        return Ok(zeros(&StateSpace::new(product, inputs, outputs, -rest))?
            .iter()
            .filter(|z| near(z))
            .map(|z| z.im)
            .collect());
    };
    let closed = a + b * &r * d.transpose() * c;
    let lower = c.transpose() * (DMatrix::identity(c.nrows(), c.nrows()) + d * &r * d.transpose()) * c;
    let mut hamiltonian = DMatrix::zeros(2 * n, 2 * n);
    // The level is split between both off-diagonal blocks, so that their norms are similar.
    hamiltonian.view_mut((0, 0), (n, n)).copy_from(&closed);
    hamiltonian.view_mut((0, n), (n, n)).copy_from(&(b * r * b.transpose() * level));
    hamiltonian.view_mut((n, 0), (n, n)).copy_from(&(-lower / level));
    hamiltonian.view_mut((n, n), (n, n)).copy_from(&-closed.transpose());
    Ok(eigenvalues_of(&hamiltonian, f64::EPSILON)?.iter().filter(|z| near(z)).map(|z| z.im).collect())
}

#[cfg(test)]
mod tests {
    use mops_math as math;
    use proptest::prelude::*;

    use super::*;
    use crate::TransferFunction;
    use crate::testing::{assert_near, random};

    fn norm(numerator: &[f64], denominator: &[f64]) -> Result<Peak, String> {
        hinf_norm(&TransferFunction::new(numerator.to_vec(), denominator.to_vec()).state_space().unwrap())
    }

    #[test]
    fn the_peak_of_a_resonance_has_its_closed_form() {
        // w^2/(s^2 + 2 z w s + w^2): 1/(2 z sqrt(1 - z^2)) at w sqrt(1 - 2 z^2).
        for (z, w) in [(0.3f64, 2.0f64), (1e-3, 50.0), (1e-6, 1.0), (0.7, 1e3)] {
            let peak = norm(&[w * w], &[1.0, 2.0 * z * w, w * w]).unwrap();
            let exact = 1.0 / (2.0 * z * (1.0 - z * z).sqrt());
            assert_near(peak.gain / exact, 1.0, 1e-9);
            assert_near(peak.frequency, w * (1.0 - 2.0 * z * z).sqrt(), 1e-4 * w);
        }
    }

    #[test]
    fn a_level_that_the_gain_tends_to_is_passed_where_it_is() {
        // |(s^2 + 0.2 s + 2)/(s^2 + 2 s + 1)| = 1 where 3 = 5.96 w^2.
        let system = TransferFunction::new(vec![1.0, 0.2, 2.0], vec![1.0, 2.0, 1.0]).state_space().unwrap();
        let passed = level_frequencies(&system, 1.0).unwrap();
        assert!(passed.iter().any(|w| (w - (3.0f64 / 5.96).sqrt()).abs() < 1e-9), "{passed:?}");
    }

    #[test]
    fn a_gain_that_only_falls_or_only_rises_has_its_peak_at_an_end() {
        assert_eq!(norm(&[3.0], &[1.0, 2.0]).unwrap(), Peak { gain: 1.5, frequency: 0.0 });
        let lead = norm(&[2.0, 1.0], &[1.0, 1.0]).unwrap();
        assert_near(lead.gain, 2.0, 1e-9);
        assert!(lead.frequency > 1e3);
    }

    #[test]
    fn of_two_resonances_the_narrow_higher_one_is_found() {
        // 1/(s^2 + 0.2 s + 1) and a narrow resonance of gain 100 at 37 rad/s.
        let broad = TransferFunction::new(vec![1.0], vec![1.0, 0.2, 1.0]).state_space().unwrap();
        let needle = TransferFunction::new(vec![1e-3 * 37.0 * 37.0], vec![1.0, 2e-5 * 37.0 * 0.5, 37.0 * 37.0]);
        let both = broad.parallel(&needle.state_space().unwrap()).unwrap();
        let peak = hinf_norm(&both).unwrap();
        assert_near(peak.frequency, 37.0, 1e-3);
        assert_near(peak.gain, 100.0, 0.01);
    }

    proptest! {
        #![proptest_config(mops_tiers::property(1_000))]

        #[test]
        fn with_one_input_and_output_the_peak_is_that_of_the_other_method(
            n in 1usize..7, seed in 0u64..1_000_000_000, damping in -4.0f64..0.0, direct in proptest::bool::ANY,
        ) {
            // Poles within up to 1e-4 of the axis; duplicating the output gives a system with two outputs.
            let a = random(n, n, seed);
            let right = eigenvalues(&a).unwrap().iter().map(|z| z.re).fold(f64::NEG_INFINITY, f64::max);
            let a = &a - DMatrix::identity(n, n) * (right + math::powf(10.0, damping));
            let d = random(1, 1, seed + 3) * f64::from(u8::from(direct));
            let (b, c) = (random(n, 1, seed + 1), random(1, n, seed + 2));
            let one = hinf_norm(&StateSpace::new(a.clone(), b.clone(), c.clone(), d.clone())).unwrap();
            let two = hinf_norm(&StateSpace::new(a, b, above(&c, &c), above(&d, &d))).unwrap();
            prop_assert!((one.gain * 2f64.sqrt() / two.gain - 1.0).abs() < 1e-8, "{:?} {:?}", one, two);
        }
    }

    #[test]
    fn with_several_inputs_and_outputs_no_frequency_has_more() {
        let a = random(6, 6, 1) - DMatrix::identity(6, 6) * 1.5;
        let system = StateSpace::new(a, random(6, 2, 2), random(3, 6, 3), random(3, 2, 4) * 0.1);
        let peak = hinf_norm(&system).unwrap();
        let response = system.response().unwrap();
        let on_grid = (0..4000).map(|i| largest_singular_value(&response.at_frequency(0.005 * f64::from(i))));
        let largest = on_grid.fold(0.0, f64::max);
        assert!(largest <= peak.gain * (1.0 + 1e-12) && largest > peak.gain * (1.0 - 1e-5), "{largest} {peak:?}");
    }

    #[test]
    fn an_unstable_system_has_no_norm_and_an_undamped_one_no_peak() {
        assert!(norm(&[1.0], &[1.0, -1.0]).unwrap_err().contains("not stable"));
        assert!(norm(&[1.0], &[1.0, 0.0, 1.0]).is_err());
    }
}
