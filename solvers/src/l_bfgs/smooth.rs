//! A smooth function of all rows, over the whole space.

use std::f64::consts::PI;
use std::sync::Mutex;

use argmin::core::{CostFunction, Error, Gradient};
use mops_core::math;
use mops_core::{Halt, Oracle};

use crate::rows::{Linear, Rows};

/// The rows of a problem as one smooth number and its slope.
///
/// `KS(f) = max f + ln(sum exp(p (f - max f))) / p` of the objective rows, and of no violation with the violations.
pub struct Smooth<'a> {
    state: Mutex<State<'a>>,
    sharpness: f64,
    /// Factor of the objective.
    unit: f64,
}

struct State<'a> {
    oracle: &'a mut dyn Oracle,
    halt: Option<Halt>,
    /// The last point with its value and slope.
    last: Option<Known>,
    /// The last point that did not fail.
    safe: Vec<f64>,
    /// What it was worth.
    worth: f64,
}

struct Known {
    v: Vec<f64>,
    value: f64,
    slope: Vec<f64>,
}

/// Weight of violations.
const PENALTY: f64 = 10.0;

/// Distance from a face within which a start is moved away from it: on it the change of variables has no slope.
const AWAY: f64 = 1e-4;

/// What a failed point costs for every unit that it is away from the last one that did not fail.
const WALL: f64 = 100.0;

/// The point of the unit box that variables stand for.
pub fn inside(v: &[f64]) -> Vec<f64> {
    v.iter().map(|v| (0.5 * (1.0 - math::cos(PI * v))).clamp(0.0, 1.0)).collect()
}

impl<'a> Smooth<'a> {
    /// The problem near a point; `None` where that fails.
    ///
    /// # Errors
    /// The run is over.
    pub fn new(oracle: &'a mut dyn Oracle, start: &[f64], sharpness: f64) -> Result<Option<Self>, Halt> {
        let at = oracle.evaluate(&[start.to_vec()])?.pop().expect("one point, one answer");
        let Some(scaled) = &at.scaled else { return Ok(None) };
        let unit = Rows::of_values(oracle.shape(), scaled).unit();
        let state = State { oracle, halt: None, last: None, safe: start.to_vec(), worth: 0.0 };
        Ok(Some(Self { state: Mutex::new(state), sharpness, unit }))
    }

    /// The variables of a point of the box.
    pub fn begin(&self, point: &[f64]) -> Vec<f64> {
        point.iter().map(|u| math::acos(1.0 - 2.0 * u.clamp(AWAY, 1.0 - AWAY)) / PI).collect()
    }

    /// Why the oracle stopped answering, if it did.
    pub fn halt(&self) -> Option<Halt> {
        self.state.lock().expect("nobody panics holding the lock").halt
    }

    /// Value and slope; an error once the run is over.
    fn know<T>(&self, v: &[f64], what: impl Fn(&Known) -> T) -> Result<T, Error> {
        let mut state = self.state.lock().expect("nobody panics holding the lock");
        if let Some(known) = state.last.as_ref().filter(|known| known.v == v) {
            return Ok(what(known));
        }
        if state.halt.is_some() || v.iter().any(|v| !v.is_finite()) {
            return Err(Error::msg("no answer"));
        }
        let point = inside(v);
        let found = state.oracle.linearise(&point, 1.0).map_err(|halt| {
            state.halt = Some(halt);
            Error::msg("the run is over")
        })?;
        let (value, along) = match found {
            Some(at) => {
                let mut rows = Rows::of(state.oracle.shape(), &at);
                rows.multiply_objective(self.unit);
                let (value, slope) = self.together(&rows);
                (state.safe, state.worth) = (point.clone(), value);
                (value, slope)
            }
            None => self.wall(&state, &point),
        };
        let slope = along.iter().zip(v).map(|(slope, v)| slope * 0.5 * PI * math::sin(PI * v)).collect();
        let known = Known { v: v.to_vec(), value, slope };
        let answer = what(&known);
        state.last = Some(known);
        Ok(answer)
    }

    /// A slope that leads back from a failed point.
    fn wall(&self, state: &State<'_>, point: &[f64]) -> (f64, Vec<f64>) {
        let away: Vec<f64> = point.iter().zip(&state.safe).map(|(a, b)| a - b).collect();
        let distance = away.iter().map(|d| d * d).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let slope = away.iter().map(|d| WALL * d / distance).collect();
        (state.worth + WALL * distance, slope)
    }

    /// The penalised objective and its slope.
    fn together(&self, rows: &Rows) -> (f64, Vec<f64>) {
        let (mut value, mut slope) = self.largest(rows.objectives.clone());
        if !(rows.inequalities.is_empty() && rows.equalities.is_empty()) {
            let none = Linear { value: 0.0, slope: vec![0.0; slope.len()] };
            let minus = |row: &Linear| Linear { value: -row.value, slope: row.slope.iter().map(|s| -s).collect() };
            let mut violations = vec![none];
            violations.extend(rows.inequalities.iter().chain(&rows.equalities).cloned());
            violations.extend(rows.equalities.iter().map(minus));
            let (violation, along) = self.largest(violations);
            value += PENALTY * violation;
            slope.iter_mut().zip(along).for_each(|(slope, along)| *slope += PENALTY * along);
        }
        (value, slope)
    }

    /// The smooth largest of rows.
    fn largest(&self, rows: Vec<Linear>) -> (f64, Vec<f64>) {
        let most = rows.iter().map(|row| row.value).fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = rows.iter().map(|row| math::exp(self.sharpness * (row.value - most))).collect();
        let sum: f64 = weights.iter().sum();
        let mut slope = vec![0.0; rows[0].slope.len()];
        for (row, weight) in rows.iter().zip(&weights) {
            slope.iter_mut().zip(&row.slope).for_each(|(slope, s)| *slope += weight / sum * s);
        }
        (most + math::ln(sum) / self.sharpness, slope)
    }
}

impl CostFunction for &Smooth<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, v: &Vec<f64>) -> Result<f64, Error> {
        self.know(v, |known| known.value)
    }
}

impl Gradient for &Smooth<'_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, v: &Vec<f64>) -> Result<Vec<f64>, Error> {
        self.know(v, |known| known.slope.clone())
    }
}
