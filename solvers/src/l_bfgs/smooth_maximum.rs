//! Smooth approximation of a min-max problem, over the whole space.

use std::f64::consts::PI;
use std::sync::Mutex;

use argmin::core::{CostFunction, Error, Gradient};
use mops_core::{Halt, Oracle};
use mops_math as math;

use crate::linearised_criteria::{LinearModel, LinearisedCriteria};

/// Criteria combined into one smooth function and its gradient.
///
/// The objectives are combined by `KS(f) = max f + ln(sum exp(p (f - max f))) / p`; the violations and zero likewise.
pub struct SmoothProblem<'a> {
    state: Mutex<State<'a>>,
    sharpness: f64,
    /// Scale factor of the objective.
    objective_scale: f64,
}

struct State<'a> {
    oracle: &'a mut dyn Oracle,
    halt: Option<Halt>,
    /// Last point with its value and gradient.
    cache: Option<CacheEntry>,
    /// Last point that did not fail.
    last_success: Vec<f64>,
    /// Function value at the last point that did not fail.
    last_success_value: f64,
}

struct CacheEntry {
    v: Vec<f64>,
    value: f64,
    gradient: Vec<f64>,
}

/// Penalty weight of the violation.
const PENALTY: f64 = 10.0;

/// Minimum distance of a starting point from a face: on a face the change of variables has zero derivative.
const FACE_MARGIN: f64 = 1e-4;

/// Slope of the cost of a failed point, per unit of distance from the last point that did not fail.
const FAILURE_SLOPE: f64 = 100.0;

/// Returns the point of the unit box for the transformed variables.
pub fn point_of(v: &[f64]) -> Vec<f64> {
    v.iter().map(|v| (0.5 * (1.0 - math::cos(PI * v))).clamp(0.0, 1.0)).collect()
}

impl<'a> SmoothProblem<'a> {
    /// Creates the problem near a point; `None` if that point fails.
    ///
    /// # Errors
    /// When the run ends: budget exhausted, or interrupted by the user.
    pub fn new(oracle: &'a mut dyn Oracle, start: &[f64], sharpness: f64) -> Result<Option<Self>, Halt> {
        let at = oracle.evaluate(&[start.to_vec()])?.pop().expect("one point, one answer");
        let Some(scaled) = &at.scaled else { return Ok(None) };
        let objective_scale = LinearisedCriteria::from_values(oracle.shape(), scaled).objective_scale();
        let state = State { oracle, halt: None, cache: None, last_success: start.to_vec(), last_success_value: 0.0 };
        Ok(Some(Self { state: Mutex::new(state), sharpness, objective_scale }))
    }

    /// Returns the transformed variables of a point of the box.
    pub fn variables_of(&self, point: &[f64]) -> Vec<f64> {
        point.iter().map(|u| math::acos(1.0 - 2.0 * u.clamp(FACE_MARGIN, 1.0 - FACE_MARGIN)) / PI).collect()
    }

    /// Returns the reason why the run ended, if it did.
    pub fn halt(&self) -> Option<Halt> {
        self.state.lock().expect("no thread panics while holding the lock").halt
    }

    /// Evaluates function value and gradient, with a cache for the last point; an error once the run has ended.
    fn evaluate<T>(&self, v: &[f64], select: impl Fn(&CacheEntry) -> T) -> Result<T, Error> {
        let mut state = self.state.lock().expect("no thread panics while holding the lock");
        if let Some(entry) = state.cache.as_ref().filter(|entry| entry.v == v) {
            return Ok(select(entry));
        }
        if state.halt.is_some() || v.iter().any(|v| !v.is_finite()) {
            return Err(Error::msg("no evaluation: the run has ended, or a variable is not finite"));
        }
        let point = point_of(v);
        let found = state.oracle.linearise(&point, 1.0).map_err(|halt| {
            state.halt = Some(halt);
            Error::msg("the run has ended")
        })?;
        let (value, point_gradient) = match found {
            Some(at) => {
                let mut criteria = LinearisedCriteria::from_linearisation(state.oracle.shape(), &at);
                criteria.scale_objective(self.objective_scale);
                let (value, gradient) = self.penalised_objective(&criteria);
                (state.last_success, state.last_success_value) = (point.clone(), value);
                (value, gradient)
            }
            None => self.failure_barrier(&state, &point),
        };
        let gradient =
            point_gradient.iter().zip(v).map(|(gradient, v)| gradient * 0.5 * PI * math::sin(PI * v)).collect();
        let entry = CacheEntry { v: v.to_vec(), value, gradient };
        let answer = select(&entry);
        state.cache = Some(entry);
        Ok(answer)
    }

    /// Returns a value and gradient that lead back from a failed point.
    fn failure_barrier(&self, state: &State<'_>, point: &[f64]) -> (f64, Vec<f64>) {
        let away: Vec<f64> = point.iter().zip(&state.last_success).map(|(a, b)| a - b).collect();
        let distance = away.iter().map(|d| d * d).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let gradient = away.iter().map(|d| FAILURE_SLOPE * d / distance).collect();
        (state.last_success_value + FAILURE_SLOPE * distance, gradient)
    }

    /// Computes the penalised objective and its gradient.
    fn penalised_objective(&self, criteria: &LinearisedCriteria) -> (f64, Vec<f64>) {
        let (mut value, mut gradient) = self.smooth_maximum(criteria.objectives.clone());
        if !(criteria.inequalities.is_empty() && criteria.equalities.is_empty()) {
            let none = LinearModel { value: 0.0, gradient: vec![0.0; gradient.len()] };
            let minus = |row: &LinearModel| LinearModel {
                value: -row.value,
                gradient: row.gradient.iter().map(|s| -s).collect(),
            };
            let mut violations = vec![none];
            violations.extend(criteria.inequalities.iter().chain(&criteria.equalities).cloned());
            violations.extend(criteria.equalities.iter().map(minus));
            let (violation, violation_gradient) = self.smooth_maximum(violations);
            value += PENALTY * violation;
            gradient
                .iter_mut()
                .zip(violation_gradient)
                .for_each(|(gradient, violation_gradient)| *gradient += PENALTY * violation_gradient);
        }
        (value, gradient)
    }

    /// Computes the Kreisselmeier-Steinhauser function of criteria and its gradient.
    fn smooth_maximum(&self, criteria: Vec<LinearModel>) -> (f64, Vec<f64>) {
        let largest = criteria.iter().map(|row| row.value).fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = criteria.iter().map(|row| math::exp(self.sharpness * (row.value - largest))).collect();
        let sum: f64 = weights.iter().sum();
        let mut gradient = vec![0.0; criteria[0].gradient.len()];
        for (row, weight) in criteria.iter().zip(&weights) {
            gradient.iter_mut().zip(&row.gradient).for_each(|(gradient, s)| *gradient += weight / sum * s);
        }
        (largest + math::ln(sum) / self.sharpness, gradient)
    }
}

impl CostFunction for &SmoothProblem<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, v: &Vec<f64>) -> Result<f64, Error> {
        self.evaluate(v, |entry| entry.value)
    }
}

impl Gradient for &SmoothProblem<'_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, v: &Vec<f64>) -> Result<Vec<f64>, Error> {
        self.evaluate(v, |entry| entry.gradient.clone())
    }
}
