//! Pole placement by state feedback.

mod complement;
mod deflation;
mod robust;

use mops_math::{complex, stream};
use nalgebra::DMatrix;

use super::controllability::{Scaled, Staircase};
use super::{Complex, eigenvalues};
use rand::Rng;

/// Largest relative distance of a closed-loop pole from its specified value with which a feedback is returned.
///
/// A pole of multiplicity ten in one Jordan block is found with an error of 1/20, the tenth root of the rounding error.
const FARTHEST: f64 = 0.1;

/// Magnitude, relative to the largest pole, below which a pole counts as 0 when distances are compared.
const SMALL: f64 = 1e-8;

/// Ratio of pole movements below which a later candidate is clearly better than the first one.
const FAR_LESS: f64 = 0.1;

/// Relative change of the entries of A and B for [`Placement::sensitivity`].
const CHANGE: f64 = 1e-6;

/// State feedback and the accuracy of its poles.
#[derive(Debug, Clone)]
pub struct Placement {
    /// Gain `K` of the feedback `u = -K x`, inputs x states.
    pub k: DMatrix<f64>,
    /// Computed eigenvalues of `A - B K`, 1/s.
    pub poles: Vec<Complex>,
    /// Largest distance of a pole from its specified value, 1/s, including under perturbations of A and B of rounding
    /// size.
    pub error: f64,
    /// Largest distance of a pole from its specified value when the entries of A and B change by 1e-6 (relative), 1/s.
    pub sensitivity: f64,
    /// Controllability indices, if they allow the repeated poles in (sensitive) Jordan blocks only; `None` otherwise.
    pub defective: Option<Vec<usize>>,
}

/// Returns the feedback `u = -K x` for which the eigenvalues of `A - B K` are `poles`, 1/s.
///
/// With one input `K` is unique. With several inputs the remaining freedom makes the eigenvectors as independent as
/// possible, if the controllability indices allow independent ones. Otherwise, or if the poles are then far less
/// sensitive to the model, poles are placed one after the other. The eigenvalues of `A - B K` are compared with `poles`
/// before a feedback is returned.
///
/// Source: see `robust` and `deflation` for the methods; for which poles allow independent eigenvectors: H. H.
/// Rosenbrock, State-space and Multivariable Theory (1970), chapter 5, theorem 4.2.
///
/// # Errors
/// If the number of poles is not that of the states, a complex pole lacks its conjugate, or a mode is uncontrollable.
/// If rounding alone moves a pole by 10 %, or to the right of the imaginary axis.
pub fn place(a: &DMatrix<f64>, b: &DMatrix<f64>, poles: &[Complex]) -> Result<Placement, String> {
    let n = a.nrows();
    if poles.len() != n {
        return Err(format!("{} poles given, but the system has {n} states", poles.len()));
    }
    let finite = |matrix: &DMatrix<f64>| matrix.iter().all(|x| x.is_finite());
    if !finite(a) || !finite(b) || !poles.iter().all(|p| p.re.is_finite() && p.im.is_finite()) {
        return Err("the system and the poles must be finite".to_owned());
    }
    let poles = paired(poles)?;
    if n == 0 {
        let k = DMatrix::zeros(b.ncols(), 0);
        return Ok(Placement { k, poles: Vec::new(), error: 0.0, sensitivity: 0.0, defective: None });
    }
    let scaled = Scaled::of(a, b);
    let staircase = Staircase::of(&scaled);
    staircase.check()?;
    let indices = staircase.indices();
    let independent = allows_independent(&indices, &poles);
    let relative = |p: Complex| 1.0 / size(p, &poles);
    let candidates = feedbacks(a, b, &scaled, &poles, independent).into_iter().filter_map(|k| {
        let found = eigenvalues(&(a - b * &k)).ok()?;
        // The computed poles may be accurate by chance, so matrices perturbed by rounding are checked too.
        let error = distance(&found, &poles, |_| 1.0).max(moved(a, b, &k, &poles, f64::EPSILON, |_| 1.0));
        let sensitivity = moved(a, b, &k, &poles, CHANGE, |_| 1.0);
        let relative = moved(a, b, &k, &poles, CHANGE, relative);
        Some((relative, Placement { error, poles: found, k, sensitivity, defective: None }))
    });
    // The first candidate is kept unless the poles of another move far less: random perturbations show gross
    // differences only.
    let best = candidates.reduce(|kept, other| if other.0 < FAR_LESS * kept.0 { other } else { kept });
    let (_, mut best) =
        best.ok_or("the poles cannot be placed: the closed-loop eigenvectors are linearly dependent")?;
    let farthest = distance(&best.poles, &poles, relative);
    let unstable = |list: &[Complex]| list.iter().filter(|p| p.re >= 0.0).count();
    if farthest.is_nan() || farthest > FARTHEST || unstable(&best.poles) > unstable(&poles) {
        return Err(format!(
            "the poles cannot be placed: the problem is ill-conditioned, rounding alone moves a pole by {:.3e} 1/s; move \
             repeated poles apart or choose slower ones",
            best.error
        ));
    }
    best.defective = (!independent).then_some(indices);
    Ok(best)
}

/// Returns candidate feedbacks from all methods.
///
/// Gains with independent eigenvectors come first, computed in the given units and in scaled ones.
fn feedbacks(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    scaled: &Scaled,
    poles: &[Complex],
    independent: bool,
) -> Vec<DMatrix<f64>> {
    let (own, other) = (Inputs::of(b), Inputs::of(&scaled.b));
    let mut found = Vec::new();
    if own.reduced.ncols() > 1 && independent {
        found.extend(own.robust(a, poles));
        found.extend(other.robust(&scaled.a, poles).map(|k| scaled.feedback(&k)));
    }
    let ordered = orders(poles);
    let one_by_one = ordered.iter().filter_map(|order| deflation::deflated(&scaled.a, &other.reduced, order));
    found.extend(one_by_one.map(|k| scaled.feedback(&(&other.back * k))));
    found
}

/// Independent combinations of inputs, in which inputs of equal effect are merged: `B back = reduced`.
struct Inputs {
    reduced: DMatrix<f64>,
    back: DMatrix<f64>,
}

impl Inputs {
    /// Computes the combinations from the singular values of B. Both matrices have orthogonal columns.
    fn of(b: &DMatrix<f64>) -> Self {
        let svd = b.clone().svd(true, true);
        let small = f64::EPSILON * b.nrows().max(b.ncols()) as f64 * svd.singular_values.max();
        let kept: Vec<usize> = (0..svd.singular_values.len()).filter(|&i| svd.singular_values[i] > small).collect();
        let (u, v) = (svd.u.expect("the SVD computes U"), svd.v_t.expect("the SVD computes V").transpose());
        let mut reduced = u.select_columns(&kept);
        kept.iter().enumerate().for_each(|(j, &i)| reduced.column_mut(j).scale_mut(svd.singular_values[i]));
        Self { reduced, back: v.select_columns(&kept) }
    }

    /// Returns the feedback to all inputs with independent eigenvectors.
    fn robust(&self, a: &DMatrix<f64>, poles: &[Complex]) -> Option<DMatrix<f64>> {
        let lengths: Vec<f64> = self.reduced.column_iter().map(|column| column.norm()).collect();
        let mut range = self.reduced.clone();
        lengths.iter().enumerate().for_each(|(j, length)| range.column_mut(j).unscale_mut(*length));
        let closed = robust::robust(a, &range, poles)?;
        let mut k = range.transpose() * (a - closed);
        lengths.iter().enumerate().for_each(|(i, length)| k.row_mut(i).unscale_mut(*length));
        Some(&self.back * k)
    }
}

/// Returns orders in which to place the poles one by one.
///
/// They are sorted by ascending and by descending magnitude, each also with repeated copies of a pole deferred to later
/// passes.
fn orders(poles: &[Complex]) -> Vec<Vec<Complex>> {
    let mut rising: Vec<Complex> = poles.iter().copied().filter(|p| p.im >= 0.0).collect();
    rising.sort_by(|a, b| complex::norm(*a).total_cmp(&complex::norm(*b)));
    let falling: Vec<Complex> = rising.iter().rev().copied().collect();
    let dealt = |order: &[Complex]| {
        let round = |i: usize| order[..i].iter().filter(|p| **p == order[i]).count();
        let mut places: Vec<usize> = (0..order.len()).collect();
        places.sort_by_key(|&i| round(i));
        places.into_iter().map(|i| order[i]).collect::<Vec<_>>()
    };
    let mut all = vec![dealt(&rising), dealt(&falling), rising, falling];
    all.dedup();
    all
}

/// Returns true if the closed loop may have independent eigenvectors.
///
/// The degrees of its invariant polynomials must dominate the controllability indices (Rosenbrock). The i-th polynomial
/// has a factor for every pole that is repeated i times or more.
fn allows_independent(indices: &[usize], poles: &[Complex]) -> bool {
    let copies = |p: Complex| poles.iter().filter(|q| **q == p).count();
    let mut distinct: Vec<Complex> = Vec::new();
    poles.iter().for_each(|p| {
        if !distinct.contains(p) {
            distinct.push(*p)
        }
    });
    let (mut degrees, mut sum) = (0, 0);
    indices.iter().enumerate().all(|(i, index)| {
        degrees += distinct.iter().filter(|p| copies(**p) > i).count();
        sum += index;
        degrees >= sum
    })
}

/// Returns the largest weighted distance of the poles from their specified values under random perturbations. The
/// entries of A and B increase or decrease by a relative `change`.
fn moved(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    k: &DMatrix<f64>,
    poles: &[Complex],
    change: f64,
    weight: impl Fn(Complex) -> f64,
) -> f64 {
    let mut stream = stream(0, "placement");
    let mut farthest = 0.0f64;
    for _ in 0..8 {
        let mut changed =
            |m: &DMatrix<f64>| m.map(|x| if stream.random() { x * (1.0 + change) } else { x * (1.0 - change) });
        let closed = changed(a) - changed(b) * k;
        let Ok(found) = eigenvalues(&closed) else { return f64::INFINITY };
        farthest = farthest.max(distance(&found, poles, &weight));
    }
    farthest
}

/// Returns the magnitude to which distances from a pole are related.
fn size(pole: Complex, all: &[Complex]) -> f64 {
    let largest = all.iter().map(|p| complex::norm(*p)).fold(0.0, f64::max);
    if largest > 0.0 { complex::norm(pole).max(SMALL * largest) } else { 1.0 }
}

/// Returns the largest weighted distance between computed and specified poles, paired nearest first.
fn distance(found: &[Complex], poles: &[Complex], weight: impl Fn(Complex) -> f64) -> f64 {
    let n = poles.len();
    let far = |i: usize, j: usize| complex::norm(found[i] - poles[j]) * weight(poles[j]);
    let mut pairs: Vec<(usize, usize)> = (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).collect();
    pairs.sort_by(|a, b| far(a.0, a.1).total_cmp(&far(b.0, b.1)));
    let (mut of_found, mut of_poles, mut largest) = (vec![false; n], vec![false; n], 0.0);
    for (i, j) in pairs {
        if !of_found[i] && !of_poles[j] {
            (of_found[i], of_poles[j], largest) = (true, true, far(i, j));
        }
    }
    largest
}

/// Returns the poles sorted: real poles first, then pairs with the upper one before its exact conjugate.
fn paired(poles: &[Complex]) -> Result<Vec<Complex>, String> {
    let mut sorted: Vec<Complex> = poles.iter().copied().filter(|p| p.im == 0.0).collect();
    let mut lower: Vec<Complex> = poles.iter().copied().filter(|p| p.im < 0.0).collect();
    for upper in poles.iter().filter(|p| p.im > 0.0) {
        let place = lower.iter().position(|p| complex::norm(p.conj() - upper) <= 1e-9 * complex::norm(*upper));
        match place {
            Some(place) => lower.swap_remove(place),
            None => return Err(format!("the pole at {upper} has no conjugate among the others")),
        };
        sorted.extend([*upper, upper.conj()]);
    }
    match lower.first() {
        Some(alone) => Err(format!("the pole at {alone} has no conjugate among the others")),
        None => Ok(sorted),
    }
}

#[cfg(test)]
mod tests;
