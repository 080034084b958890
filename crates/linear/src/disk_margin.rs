//! Disk margin of feedback loops.

use mops_math as math;
use mops_math::complex;
use nalgebra::{DMatrix, DVector};

use super::norms::{largest_singular_value, level_frequencies};
use super::system::SEVERAL_DELAYED;
use super::{Complex, Loop, StateSpace, eigenvalues, undecided};

/// Relative gap between the largest value found and its bound over all frequencies, before refinement.
const SURE: f64 = 1e-6;

/// Largest number of frequencies examined; some tens are usual.
const MOST: usize = 500;

/// Bound of the logarithms of scales. With one-way coupling the optimal ratio of scales is infinite; at this bound the
/// remaining coupling is below rounding.
const LARGEST_SCALE: f64 = 30.0;

/// Imbalance of the scaled singular vectors at which the scales are optimal. The relative error of the gain is of the
/// order of its square.
const BALANCED: f64 = 1e-7;

/// Imbalance that suffices at frequencies with less than the largest gain.
const NEARLY_BALANCED: f64 = 0.03;

/// Relative error of the gain at which the search for scales ends where the largest singular value is multiple.
const ACCURATE: f64 = 1e-9;

/// Returns the disk margin of a loop transfer function of one or several loops with unity negative feedback: the
/// largest `alpha` for which the closed loop stays stable when each loop is multiplied by a factor of its own,
///
/// ```text
/// f = (1 + (1 - skew)/2 delta)/(1 - (1 + skew)/2 delta),   |delta| < alpha,
/// ```
///
/// with any stable dynamics `delta`. It is `1/max_w mu(S(j w) + (skew - 1)/2)`, with the structured singular value `mu`
/// for one complex number per loop. `mu` is computed by its upper bound with scaled loops, which is exact for up to
/// three loops and else gives a margin that is too small, usually by less than 15 %.
///
/// With one loop, a delay is treated exactly. The maximum is not searched on a grid: the scales that are optimal at one
/// frequency bound `mu` around it, and these ranges cover all frequencies.
///
/// Sources: P. Seiler, A. Packard, P. Gahinet, An introduction to disk margins, IEEE Control Systems Magazine 40(5)
/// (2020) 78-95; C. T. Lawrence, A. L. Tits, P. Van Dooren, A fast algorithm for the computation of an upper bound on
/// the mu-norm, Automatica 36 (2000) 449-456.
///
/// # Errors
/// If the closed loop is not stable, if there are not as many outputs as inputs, or if several loops have a delay.
pub fn disk_margin(of: &StateSpace, skew: f64) -> Result<f64, String> {
    if of.inputs.len() == 1 && of.outputs.len() == 1 {
        return Loop::new(of.clone())?.disk_margin(skew);
    }
    if of.delay > 0.0 {
        return Err(SEVERAL_DELAYED.to_owned());
    }
    let sensitivity = of.sensitivity()?;
    if of.closed_loop_eigenvalues(1.0)?.iter().any(|pole| pole.re >= 0.0) || !undecided(&sensitivity.a)?.is_empty() {
        return Err("the closed loop is not stable".to_owned());
    }
    let m = of.inputs.len();
    let shifted = StateSpace { d: &sensitivity.d + DMatrix::identity(m, m) * (0.5 * (skew - 1.0)), ..sensitivity };
    Ok(1.0 / largest_scaled_gain(&shifted)?)
}

/// Returns the maximum over all frequencies of the upper bound of the structured singular value.
fn largest_scaled_gain(system: &StateSpace) -> Result<f64, String> {
    let response = system.response()?;
    let gain = |frequency: f64, enough: f64| scaled_gain(&response.on_axis(frequency), enough);
    let mut best = (scaled_gain(&system.d.map(|d| Complex::new(d, 0.0)), 0.0).0, f64::INFINITY);
    // Ranges of frequencies in which the bound may exceed the best value.
    let corners: Vec<f64> =
        eigenvalues(&system.a)?.iter().map(|pole| complex::norm(*pole)).filter(|size| *size > 0.0).collect();
    let mut ends = corners.clone();
    ends.extend([0.0, f64::INFINITY]);
    ends.sort_by(f64::total_cmp);
    let mut open: Vec<[f64; 2]> = ends.windows(2).map(|pair| [pair[0], pair[1]]).filter(|[a, b]| a < b).collect();
    for frequency in corners.into_iter().chain([0.0]) {
        let here = gain(frequency, best.0).0;
        if here > best.0 {
            best = (here, frequency);
        }
    }
    for _ in 0..MOST {
        let Some(&range) = open.last() else { break };
        let frequency = middle(range);
        let (here, logarithms) = gain(frequency, best.0);
        if here > best.0 {
            best = (here, frequency);
        }
        if best.0 == 0.0 {
            // The level 0 has no crossings.
            open = open.iter().flat_map(|range| without(*range, &[[0.1 * frequency, 10.0 * frequency]])).collect();
            open.retain(|[low, high]| *high > 1e-100 && *low < 1e100);
            continue;
        }
        let level = best.0 * (1.0 + SURE);
        let scaled = scaled(system, &logarithms);
        let at = scaled.response()?;
        let mut crossings = level_frequencies(&scaled, level)?;
        crossings.extend([0.0, f64::INFINITY]);
        crossings.sort_by(f64::total_cmp);
        // One frequency decides on a range between crossings; those of the poles within guard against crossings that
        // rounding hides.
        let below = |[low, high]: [f64; 2]| {
            let within = ends.iter().copied().filter(|end| *end > low && *end < high && end.is_finite());
            within.chain([middle([low, high])]).all(|w| largest_singular_value(&at.on_axis(w)) <= level)
        };
        let mut covered: Vec<[f64; 2]> =
            crossings.windows(2).map(|pair| [pair[0], pair[1]]).filter(|r| below(*r)).collect();
        // The range shrinks even if rounding hides the crossings.
        covered.push([frequency * (1.0 - SURE), frequency * (1.0 + SURE)]);
        open = open.iter().flat_map(|range| without(*range, &covered)).collect();
    }
    if !open.is_empty() {
        return Err("the disk margin was not found: too many frequencies are close to the worst one".to_owned());
    }
    let (most, at) = best;
    Ok(if at.is_finite() && at > 0.0 { polished(|frequency| gain(frequency, 0.0).0, [at, most]) } else { most })
}

/// Returns the top of a peak from a point close to it, by parabolas through three points.
fn polished(gain: impl Fn(f64) -> f64, [mut at, mut most]: [f64; 2]) -> f64 {
    let mut reach = 1e-3 * at;
    for _ in 0..4 {
        let sides = [gain(at - reach), gain(at + reach)];
        let bend = sides[0] - 2.0 * most + sides[1];
        let vertex = at + 0.5 * reach * (sides[0] - sides[1]) / bend;
        let inside = (bend < 0.0 && (vertex - at).abs() < reach).then(|| [vertex, gain(vertex)]);
        let found = [Some([at - reach, sides[0]]), Some([at + reach, sides[1]]), inside];
        let [next, value] = found.into_iter().flatten().fold([at, most], |a, b| if b[1] > a[1] { b } else { a });
        (at, most) = (next, value);
        reach *= 0.1;
    }
    most
}

/// Returns a frequency within a range that may begin at 0 and end at infinity.
fn middle([low, high]: [f64; 2]) -> f64 {
    match () {
        () if low == 0.0 && high == f64::INFINITY => 1.0,
        () if high == f64::INFINITY => 10.0 * low,
        () if low == 0.0 => 0.1 * high,
        () => low.sqrt() * high.sqrt(),
    }
}

/// Returns what remains of a range outside the covered ones. A remainder that rounding leaves between neighbours is
/// dropped.
fn without(range: [f64; 2], covered: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut rest = vec![range];
    for &[from, to] in covered {
        let parts = |[low, high]: [f64; 2]| [[low, high.min(from)], [low.max(to), high]];
        rest = rest.into_iter().flat_map(parts).filter(|[low, high]| *high > low * (1.0 + 1e-12)).collect();
    }
    rest
}

/// Returns the system with its outputs multiplied, and its inputs divided, by the scales.
fn scaled(system: &StateSpace, logarithms: &[f64]) -> StateSpace {
    let mut system = system.clone();
    for (i, scale) in logarithms.iter().map(|x| math::exp(*x)).enumerate() {
        system.c.row_mut(i).scale_mut(scale);
        system.d.row_mut(i).scale_mut(scale);
        system.b.column_mut(i).unscale_mut(scale);
        system.d.column_mut(i).unscale_mut(scale);
    }
    system
}

/// Minimises the largest singular value of `D M D^-1` over positive diagonal matrices `D`. Returns the minimum and the
/// logarithms of the entries of `D`, in which the logarithm of the value is convex.
///
/// Once the value is below `enough`, nearly optimal scales suffice.
fn scaled_gain(m: &DMatrix<Complex>, enough: f64) -> (f64, Vec<f64>) {
    let n = m.nrows();
    let mut x = vec![0.0; n];
    let Some(mut here) = Gain::of(m, &x) else { return (f64::INFINITY, x) };
    for _ in 0..60 {
        let balanced = if here.value < enough { NEARLY_BALANCED } else { BALANCED };
        if here.imbalance() <= balanced {
            return (here.value, x);
        }
        let mut step = 0.5;
        let next = loop {
            let trial: Vec<f64> =
                (0..n).map(|i| (x[i] + step * here.towards_balance(i)).clamp(-LARGEST_SCALE, LARGEST_SCALE)).collect();
            match Gain::of(m, &trial) {
                Some(next) if next.value < here.value => break Some((next, trial)),
                _ if step < 1e-3 => break None,
                _ => step *= 0.5,
            }
        };
        let Some(next) = next else { break };
        (here, x) = next;
    }
    if here.value < enough {
        return (here.value, x);
    }
    let found = by_cuts(m, &x);
    if found.0 < here.value { found } else { (here.value, x) }
}

/// Largest singular value of a scaled matrix, with the squared magnitudes of the entries of its vectors.
struct Gain {
    value: f64,
    left: Vec<f64>,
    right: Vec<f64>,
}

impl Gain {
    fn of(m: &DMatrix<Complex>, x: &[f64]) -> Option<Self> {
        let scaled = DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)] * math::exp(x[i] - x[j]));
        if scaled.iter().any(|z| !z.is_finite()) {
            return None;
        }
        let svd = scaled.svd(true, true);
        let (u, v) = (svd.u?, svd.v_t?);
        let k = svd.singular_values.imax();
        Some(Self {
            value: svd.singular_values[k],
            left: u.column(k).iter().map(|z| z.norm_sqr()).collect(),
            right: v.row(k).iter().map(|z| z.norm_sqr()).collect(),
        })
    }

    /// Returns the derivatives of the logarithm of the value.
    fn slope(&self) -> Vec<f64> {
        self.left.iter().zip(&self.right).map(|(u, v)| u - v).collect()
    }

    fn imbalance(&self) -> f64 {
        self.slope().iter().fold(0.0, |most, slope| slope.abs().max(most))
    }

    /// Returns the change of the logarithm of a scale after which both vectors have entries of one size, if they do not
    /// change.
    fn towards_balance(&self, i: usize) -> f64 {
        let least = f64::MIN_POSITIVE;
        (0.5 * math::ln((self.right[i] + least) / (self.left[i] + least))).clamp(-3.0, 3.0)
    }
}

/// Minimises the gain where it has kinks: by bisection for two scales, else by the ellipsoid method.
///
/// Source: S. Boyd, L. El Ghaoui, E. Feron, V. Balakrishnan, Linear Matrix Inequalities in System and Control Theory
/// (1994), section 2.3.
fn by_cuts(m: &DMatrix<Complex>, start: &[f64]) -> (f64, Vec<f64>) {
    // One scale is arbitrary: the last one stays 1.
    let k = m.nrows() - 1;
    let all = |free: &DVector<f64>| free.iter().copied().chain([0.0]).collect::<Vec<f64>>();
    let mut x = DVector::from_fn(k, |i, _| start[i] - start[k]);
    let mut best = (f64::INFINITY, all(&x));
    let dimension = f64::from(u32::try_from(k).unwrap_or(u32::MAX));
    let mut shape = DMatrix::identity(k, k) * (4.0 * LARGEST_SCALE * LARGEST_SCALE);
    for _ in 0..1000 * k {
        let Some(here) = Gain::of(m, &all(&x)) else { break };
        if here.value < best.0 {
            best = (here.value, all(&x));
        }
        let slope = DVector::from_iterator(k, here.slope().into_iter().take(k));
        let along = &shape * &slope;
        // Bound of the distance of the logarithm of the gain from its minimum.
        let gap = slope.dot(&along).max(0.0).sqrt();
        if gap <= ACCURATE {
            break;
        }
        let cut = along / gap;
        x -= &cut / (dimension + 1.0);
        if k == 1 {
            shape *= 0.25;
        } else {
            let squared = dimension * dimension;
            shape = (shape - &cut * cut.transpose() * (2.0 / (dimension + 1.0))) * (squared / (squared - 1.0));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{assert_near, random};
    use crate::{TransferFunction, hinf_norm};

    fn system(numerator: &[f64], denominator: &[f64]) -> StateSpace {
        TransferFunction::new(numerator.to_vec(), denominator.to_vec()).state_space().unwrap()
    }

    /// Two loops that do not act on each other.
    fn both(first: &StateSpace, second: &StateSpace) -> StateSpace {
        let (n, m) = (first.order(), second.order());
        let mut a = DMatrix::zeros(n + m, n + m);
        a.view_mut((0, 0), (n, n)).copy_from(&first.a);
        a.view_mut((n, n), (m, m)).copy_from(&second.a);
        let (mut b, mut c) = (DMatrix::zeros(n + m, 2), DMatrix::zeros(2, n + m));
        b.view_mut((0, 0), (n, 1)).copy_from(&first.b);
        b.view_mut((n, 1), (m, 1)).copy_from(&second.b);
        c.view_mut((0, 0), (1, n)).copy_from(&first.c);
        c.view_mut((1, n), (1, m)).copy_from(&second.c);
        StateSpace::new(a, b, c, DMatrix::zeros(2, 2))
    }

    #[test]
    fn the_margin_of_one_loop_is_that_of_the_shifted_sensitivity() {
        let l = system(&[25.0], &[1.0, 10.0, 10.0, 10.0]);
        for skew in [-1.0, 0.0, 1.0] {
            let mut shifted = l.sensitivity().unwrap();
            shifted.d[(0, 0)] += 0.5 * (skew - 1.0);
            assert_near(disk_margin(&l, skew).unwrap(), 1.0 / hinf_norm(&shifted).unwrap().gain, 1e-8);
        }
        // With skew 1 it is the modulus margin 1/Ms.
        let modulus = 1.0 / Loop::new(l.clone()).unwrap().peak_sensitivity().unwrap();
        assert_near(disk_margin(&l, 1.0).unwrap(), modulus, 1e-12);
        // Minimum of |(1 + L)/(1 - L)| 2 on a grid of 4e6 frequencies (NumPy).
        assert_near(disk_margin(&l, 0.0).unwrap(), 0.458_092_547_74, 1e-8);
    }

    #[test]
    fn a_delay_is_exact_with_one_loop_and_refused_with_several() {
        let late = |delay: f64| StateSpace { delay, ..system(&[1.0], &[1.0, 0.0]) };
        // Minimum of 2 |(1 + L)/(1 - L)| over a fine grid, L = exp(-s/2)/s.
        let l = |w: f64| complex::exp(Complex::new(0.0, -0.5 * w)) / Complex::new(0.0, w);
        let on_grid = (1..400_000).map(|i| 1e-4 * f64::from(i));
        let least = on_grid.map(|w| 2.0 * complex::norm((l(w) + 1.0) / (-l(w) + 1.0))).fold(f64::INFINITY, f64::min);
        assert_near(disk_margin(&late(0.5), 0.0).unwrap(), least, 1e-7);
        let several = StateSpace { delay: 0.5, ..both(&system(&[1.0], &[1.0, 0.0]), &system(&[1.0], &[1.0, 1.0])) };
        assert!(disk_margin(&several, 0.0).unwrap_err().contains("delay"));
    }

    #[test]
    fn loops_that_do_not_act_on_each_other_have_the_smaller_margin() {
        let (first, second) = (system(&[25.0], &[1.0, 10.0, 10.0, 10.0]), system(&[2.0], &[1.0, 1.0, 0.0]));
        let least = disk_margin(&first, 0.0).unwrap().min(disk_margin(&second, 0.0).unwrap());
        let mut together = both(&first, &second);
        assert_near(disk_margin(&together, 0.0).unwrap(), least, 1e-9);
        // An action in one direction changes nothing.
        together.c[(1, 0)] = 7.0;
        assert_near(disk_margin(&together, 0.0).unwrap(), least, 1e-6);
    }

    #[test]
    fn a_spinning_body_has_margins_one_loop_at_a_time_but_almost_none_together() {
        // Example of Seiler, Packard, Gahinet (2020): one loop at a time is 1/s. Together, S - T has the largest
        // singular value ((1 + (w + 20)^2)/(1 + w^2))^(1/2), whose square is at most 201 + (201^2 - 1)^(1/2); the
        // scales are equal.
        let a = 10.0;
        let m = |rows: &[f64]| DMatrix::from_row_slice(2, 2, rows);
        let body = StateSpace::new(m(&[0., a, -a, 0.]), m(&[1., 0., 0., 1.]), m(&[1., a, -a, 1.]), m(&[0.; 4]));
        let together = 2.0 / (201.0 + (201.0f64 * 201.0 - 1.0).sqrt()).sqrt();
        assert_near(disk_margin(&body, 0.0).unwrap(), together, 1e-10);
        for one in [0, 1] {
            assert_near(disk_margin(&body.loop_at_a_time(one).unwrap(), 0.0).unwrap(), 2.0, 1e-9);
        }
    }

    /// Largest spectral radius of `M U` over a grid of diagonal phases `U`: a lower bound of mu that needs no scales,
    /// and that is mu where the grid has the worst phases.
    fn lower_bound(m: &DMatrix<Complex>, angles: u32) -> f64 {
        let n = m.nrows();
        let turn = |k: u32| complex::exp(Complex::new(0.0, std::f64::consts::TAU * f64::from(k) / f64::from(angles)));
        let mut most = 0.0f64;
        for k in 0..angles.pow(u32::try_from(n - 1).unwrap()) {
            let phases = [Complex::new(1.0, 0.0), turn(k % angles), turn(k / angles)];
            let turned = DMatrix::from_fn(n, n, |i, j| m[(i, j)] * phases[j]);
            let radius = turned.schur().eigenvalues().unwrap().iter().fold(0.0, |r: f64, z| r.max(complex::norm(*z)));
            most = most.max(radius);
        }
        most
    }

    #[test]
    fn the_margin_is_that_of_the_worst_phases_at_the_worst_frequency() {
        let mut compared = 0;
        for (n, seeds, angles, frequencies, loss) in [(2, 10, 90, 150, 1e-3), (3, 4, 24, 60, 2e-2)] {
            for seed in 0..seeds {
                let a = random(4, 4, seed) - DMatrix::identity(4, 4) * 1.5;
                let l = StateSpace::new(a, random(4, n, seed + 100), random(n, 4, seed + 200), DMatrix::zeros(n, n));
                let Ok(margin) = disk_margin(&l, 0.0) else { continue };
                let mut shifted = l.sensitivity().unwrap();
                shifted.d -= DMatrix::identity(n, n) * 0.5;
                let response = shifted.response().unwrap();
                let at = |w: f64| (lower_bound(&response.at_frequency(w), angles), w);
                let best = |grid: &mut dyn Iterator<Item = f64>| {
                    grid.map(at).fold((0.5, 0.0), |a, b| if b.0 > a.0 { b } else { a })
                };
                let steps = f64::from(frequencies);
                let coarse = best(&mut (0..frequencies).map(|i| 0.01 * math::powf(1e4, f64::from(i) / steps)));
                let width = math::powf(1e4, 1.0 / steps);
                let fine = best(&mut (-20..=20).map(|i| coarse.1 * math::powf(width, f64::from(i) / 20.0)));
                let largest = coarse.0.max(fine.0).max(at(0.0).0);
                assert!(margin <= (1.0 + 1e-9) / largest, "{n} {seed}: {margin} {}", 1.0 / largest);
                assert!(margin >= (1.0 - loss) / largest, "{n} {seed}: {margin} {}", 1.0 / largest);
                compared += 1;
            }
        }
        assert!(compared >= 7, "{compared}");
    }

    #[test]
    fn an_unstable_loop_has_no_margin() {
        let unstable = both(&system(&[9.0], &[1.0, 3.0, 3.0, 1.0]), &system(&[1.0], &[1.0, 1.0]));
        assert_eq!(disk_margin(&unstable, 0.0).unwrap_err(), "the closed loop is not stable");
    }
}
