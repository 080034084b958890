//! First-order tests of optimality: of a point for the objective, and of its Pareto optimality.

mod cone;
mod level;
mod model;

use mops_core::solver::{Optimality, Pareto};
use mops_core::{Evaluation, Oracle, Usage};

use cone::DescentCone;
use level::Level;
use model::{Model, Step, TRIAL_STEP};

/// Lengths at which a direction is tried, in trial steps: along a curved constraint or valley only a short step
/// succeeds.
const LENGTHS: [f64; 2] = [1.0, 0.125];

/// Maximum number of cuts added from trial points.
const MAX_CUTS: usize = 12;

/// Number of cuts after which gradients are sampled around the point.
const CUTS_BEFORE_SAMPLING: usize = 2;

/// Largest number of coordinates along which gradients are sampled. Time and memory grow with its square; with more
/// coordinates, a point at a kink is not shown to be optimal.
const MOST_SAMPLED: usize = 100;

/// Distance of the sampled gradients from the point, in the unit box.
const SAMPLING_RADIUS: f64 = 0.5 * TRIAL_STEP;

/// Distances from a point at which values are compared, in the unit box. Values that are identical to the last bit at
/// the first distance, or equal to within rounding at both, indicate a plateau.
const PLATEAU_REACH: [f64; 2] = [1e-3, 1e-2];

/// Answer to the question whether a direction improves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Answer {
    /// None does, by the derivatives at the point.
    None,
    /// None does, by the derivatives sampled around the point.
    NoneAround,
    /// One does.
    One,
    /// A discontinuity hides the answer.
    Jump,
    /// Predicted improvements do not happen, or values or derivatives are missing.
    Unknown,
}

/// Searches for an improving direction within the bounds and the active constraints.
///
/// A criterion may have kinks of its own (an overshoot is the largest of several peaks), and optima often lie on them.
/// If a trial step does not achieve the predicted decrease, gradients are also evaluated at its end; both linear models
/// (cuts) then count. Source: C. Lemarechal's cutting planes; K. C. Kiwiel, Methods of Descent for Nondifferentiable
/// Optimization (1985).
///
/// A step along a kink stays on the kink, where finite differences average both sides. After a few steps, gradients are
/// therefore sampled on either side along every coordinate. Source: A. A. Goldstein, Mathematical Programming 13 (1977)
/// 14-22; J. V. Burke, A. S. Lewis, M. L. Overton, SIAM Journal on Optimization 15 (2005) 751-779.
fn answer(oracle: &mut dyn Oracle, point: &[f64], model: &mut impl Model) -> Answer {
    let shape = oracle.shape().clone();
    for added in 0..MAX_CUTS {
        let Some(Step { step, is_negligible }) = model.direction(point, &|| !oracle.is_over()) else {
            return Answer::Unknown;
        };
        if is_negligible {
            return if added == 0 { Answer::None } else { Answer::NoneAround };
        }
        let trial = |length: f64| -> Vec<f64> {
            point.iter().zip(&step).map(|(u, d)| (u + length * d).clamp(0.0, 1.0)).collect()
        };
        let Ok(trials) = oracle.evaluate(&LENGTHS.map(trial)) else { return Answer::Unknown };
        if trials.iter().flat_map(|trial| &trial.scaled).any(|values| model.is_improvement(&shape, values)) {
            return Answer::One;
        }
        let Some(farthest) = trials.iter().find(|trial| trial.scaled.is_some()) else { return Answer::Unknown };
        let Ok(Some(beyond)) = oracle.linearise(&farthest.point, 0.1 * TRIAL_STEP) else { return Answer::Unknown };
        if model.add(&shape, point, &beyond) {
            return Answer::Jump;
        }
        if added + 1 == CUTS_BEFORE_SAMPLING && point.len() <= MOST_SAMPLED {
            for beside in sampling_points(point) {
                // A failed simulation gives no information.
                match oracle.linearise(&beside, 0.1 * TRIAL_STEP) {
                    Ok(Some(beside)) => _ = model.add(&shape, point, &beside),
                    Ok(None) => {}
                    Err(_) => return Answer::Unknown,
                }
            }
        }
    }
    Answer::Unknown
}

/// Returns the neighbours of a point on either side along every coordinate, if inside the box.
fn sampling_points(point: &[f64]) -> impl Iterator<Item = Vec<f64>> {
    beside(point, SAMPLING_RADIUS)
}

/// Returns the points at a distance on either side along every coordinate, if inside the box.
fn beside(point: &[f64], distance: f64) -> impl Iterator<Item = Vec<f64>> {
    let moved = move |j: usize, step: f64| {
        let u = point[j] + step;
        (0.0..=1.0).contains(&u).then(|| point.iter().enumerate().map(|(k, v)| if k == j { u } else { *v }).collect())
    };
    (0..point.len()).flat_map(move |j| [distance, -distance].into_iter().filter_map(move |step| moved(j, step)))
}

/// Classifies a point to first order for the objective (of an infeasible point: for the largest violation).
pub fn optimality(oracle: &mut dyn Oracle, point: &[f64]) -> Optimality {
    let shape = oracle.shape().clone();
    if point.is_empty() || shape.spacing.iter().any(|&spacing| spacing > 0.0) {
        return Optimality::NotShown;
    }
    let Ok(Some(at)) = oracle.linearise(point, 0.1 * TRIAL_STEP) else { return Optimality::NotShown };
    let mut level = Level::new(&shape, &at);
    if level.is_flat() {
        return beside_flat(oracle, point, &level);
    }
    match answer(oracle, point, &mut level) {
        Answer::None => Optimality::Stationary,
        Answer::NoneAround => Optimality::Kink,
        Answer::One => Optimality::Descent,
        Answer::Jump => Optimality::Jump,
        Answer::Unknown => Optimality::NotShown,
    }
}

/// Classifies a point without slope by the values around it.
fn beside_flat(oracle: &mut dyn Oracle, point: &[f64], level: &Level) -> Optimality {
    let shape = oracle.shape().clone();
    let [mut near, far] = PLATEAU_REACH.map(|distance| beside(point, distance).collect::<Vec<_>>());
    let nearest = near.len();
    near.extend(far);
    let Ok(answers) = oracle.evaluate(&near) else { return Optimality::NotShown };
    let (near, far) = answers.split_at(nearest);
    let values = |answers: &[Evaluation]| answers.iter().filter_map(|answer| answer.scaled.clone()).collect::<Vec<_>>();
    let (near, far) = (values(near), values(far));
    if near.iter().chain(&far).any(|values| level.is_improvement(&shape, values)) {
        Optimality::Descent
    } else if !near.is_empty() && near.iter().all(|values| level.is_identical(&shape, values))
        || near.iter().chain(&far).all(|values| level.is_equal(&shape, values))
    {
        Optimality::Plateau
    } else {
        Optimality::Stationary
    }
}

/// Result of the test of a point for Pareto optimality.
#[derive(Debug, Clone)]
pub struct Certificate {
    /// Pareto optimality: whether one criterion can be improved without loss in another.
    pub pareto: Pareto,
    /// Trade-off weights of the weighted scaled values to be minimised, at a certified point. Along the front, the
    /// changes of these values multiplied by the weights sum to 0, to first order. The weights follow from the
    /// multipliers and are positive.
    pub weights: Option<Vec<f64>>,
    /// True if a criterion jumps beside the point, so that the test shows nothing.
    pub is_beside_jump: bool,
}

/// Searches for a direction that lowers one criterion and raises none, within the bounds and the active constraints.
///
/// Returns `certified-local` if there is none for all sampled gradients, and `no` if a small step in such a direction
/// is an actual improvement. Returns `not-shown` without gradients, or if only the linear models improve.
pub fn certificate(oracle: &mut dyn Oracle, point: &[f64]) -> Certificate {
    let unknown = Certificate { pareto: Pareto::NotShown, weights: None, is_beside_jump: false };
    let shape = oracle.shape().clone();
    if point.is_empty() || !shape.rows.iter().any(|(usage, _)| *usage == Usage::Minimise) {
        return unknown;
    }
    let Ok(Some(at)) = oracle.linearise(point, 0.1 * TRIAL_STEP) else { return unknown };
    let Some(mut cone) = DescentCone::new(&shape, &at) else { return unknown };
    match answer(oracle, point, &mut cone) {
        Answer::None | Answer::NoneAround if cone.is_whole() => Certificate {
            pareto: Pareto::CertifiedLocal,
            weights: cone.trade_offs(point, &|| !oracle.is_over()),
            ..unknown
        },
        Answer::One => Certificate { pareto: Pareto::No, ..unknown },
        Answer::Jump => Certificate { is_beside_jump: true, ..unknown },
        _ => unknown,
    }
}
