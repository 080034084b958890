//! A smooth function of all rows, over the whole space.

use std::f64::consts::PI;
use std::sync::Mutex;

use argmin::core::{CostFunction, Error, Gradient};
use mops_core::math;
use mops_core::{Halt, Oracle};

use crate::linearised_criteria::{LinearModel, LinearisedCriteria};

/// The rows of a problem as one smooth number and its slope.
///
/// `KS(f) = max f + ln(sum exp(p (f - max f))) / p` of the objective rows, and of no violation with the violations.
pub struct SmoothProblem<'a> {
    state: Mutex<State<'a>>,
    sharpness: f64,
    /// Factor of the objective.
    objective_scale: f64,
}

struct State<'a> {
    oracle: &'a mut dyn Oracle,
    halt: Option<Halt>,
    /// The last point with its value and slope.
    cache: Option<CacheEntry>,
    /// The last point that did not fail.
    last_success: Vec<f64>,
    /// What it was worth.
    last_success_value: f64,
}

struct CacheEntry {
    v: Vec<f64>,
    value: f64,
    gradient: Vec<f64>,
}

/// Weight of violations.
const PENALTY: f64 = 10.0;

/// Distance from a face within which a start is moved away from it: on it the change of variables has no slope.
const FACE_MARGIN: f64 = 1e-4;

/// What a failed point costs for every unit that it is away from the last one that did not fail.
const FAILURE_SLOPE: f64 = 100.0;

/// The point of the unit box that variables stand for.
pub fn point_of(v: &[f64]) -> Vec<f64> {
    v.iter().map(|v| (0.5 * (1.0 - math::cos(PI * v))).clamp(0.0, 1.0)).collect()
}

impl<'a> SmoothProblem<'a> {
    /// The problem near a point; `None` where that fails.
    ///
    /// # Errors
    /// The run is over.
    pub fn new(oracle: &'a mut dyn Oracle, start: &[f64], sharpness: f64) -> Result<Option<Self>, Halt> {
        let at = oracle.evaluate(&[start.to_vec()])?.pop().expect("one point, one answer");
        let Some(scaled) = &at.scaled else { return Ok(None) };
        let objective_scale = LinearisedCriteria::from_values(oracle.shape(), scaled).objective_scale();
        let state = State { oracle, halt: None, cache: None, last_success: start.to_vec(), last_success_value: 0.0 };
        Ok(Some(Self { state: Mutex::new(state), sharpness, objective_scale }))
    }

    /// The variables of a point of the box.
    pub fn variables_of(&self, point: &[f64]) -> Vec<f64> {
        point.iter().map(|u| math::acos(1.0 - 2.0 * u.clamp(FACE_MARGIN, 1.0 - FACE_MARGIN)) / PI).collect()
    }

    /// Why the oracle stopped answering, if it did.
    pub fn halt(&self) -> Option<Halt> {
        self.state.lock().expect("nobody panics holding the lock").halt
    }

    /// Value and slope; an error once the run is over.
    fn evaluate<T>(&self, v: &[f64], select: impl Fn(&CacheEntry) -> T) -> Result<T, Error> {
        let mut state = self.state.lock().expect("nobody panics holding the lock");
        if let Some(entry) = state.cache.as_ref().filter(|entry| entry.v == v) {
            return Ok(select(entry));
        }
        if state.halt.is_some() || v.iter().any(|v| !v.is_finite()) {
            return Err(Error::msg("no answer"));
        }
        let point = point_of(v);
        let found = state.oracle.linearise(&point, 1.0).map_err(|halt| {
            state.halt = Some(halt);
            Error::msg("the run is over")
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

    /// A slope that leads back from a failed point.
    fn failure_barrier(&self, state: &State<'_>, point: &[f64]) -> (f64, Vec<f64>) {
        let away: Vec<f64> = point.iter().zip(&state.last_success).map(|(a, b)| a - b).collect();
        let distance = away.iter().map(|d| d * d).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let gradient = away.iter().map(|d| FAILURE_SLOPE * d / distance).collect();
        (state.last_success_value + FAILURE_SLOPE * distance, gradient)
    }

    /// The penalised objective and its slope.
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

    /// The smooth largest of rows.
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
