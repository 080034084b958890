//! Design of state feedback for `mops linearise`.

use mops_language::Diagnostic;
use mops_linear::{Complex, Placement, StateSpace, eigenvalues, lqr, place};
use mops_math::complex;
use nalgebra::{DMatrix, DVector};
use serde_json::{Value, json};

use super::arguments::{Arguments, complex, rows};
use super::text::{labels, named, poles_table, rounded_matrix};
use crate::terminal::number;

/// Requested design of state feedback.
pub(super) enum Wanted {
    /// Closed-loop poles, in 1/s.
    Poles(Vec<Complex>),
    /// Weights of the states, then of the inputs.
    Weights(Vec<f64>),
}

/// Smallest relative error of the placed poles that is reported; relative to the largest pole.
const OFF: f64 = 1e-6;

impl Wanted {
    /// Reads the requested design from the arguments.
    ///
    /// # Errors
    /// If a number cannot be read, or the count does not match the system.
    pub(super) fn of(system: &StateSpace, arguments: &Arguments) -> Result<Option<Self>, Diagnostic> {
        let (n, m) = (system.order(), system.inputs.len());
        if let Some(text) = &arguments.place {
            let poles: Vec<Complex> = text.split(',').map(pole).collect::<Result<_, _>>()?;
            if poles.len() != n {
                let fact = format!("`--place`: expected {n} poles, one per state, found {}", poles.len());
                return Err(Diagnostic::new(fact));
            }
            return Ok(Some(Self::Poles(poles)));
        }
        let Some(text) = &arguments.lqr else { return Ok(None) };
        let weights: Vec<f64> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
        if weights.len() != n + m || text.split(',').count() != n + m {
            return Err(Diagnostic::new(format!(
                "`--lqr`: expected {n} weights of states and {m} of inputs, found `{text}`"
            ))
            .with_help(format!("order: {}, {}", system.states.join(", "), system.inputs.join(", "))));
        }
        Ok(Some(Self::Weights(weights)))
    }

    /// Designs the feedback; returns it as text and as JSON.
    ///
    /// # Errors
    /// If no such feedback exists for the system, or if it is sampled or has a delay.
    pub(super) fn design(
        &self,
        system: &StateSpace,
        unit: &dyn Fn(&str) -> String,
    ) -> Result<(String, Value), Diagnostic> {
        if system.period.is_some() {
            return Err(Diagnostic::new("state feedback cannot be designed for a sampled system")
                .with_help("design it for a model without clocks, and check the sampled loop by its margins"));
        }
        if system.delay != 0.0 {
            return Err(Diagnostic::new("state feedback cannot be designed for a system with a delay").with_help(
                "model the delay as a rational function, or design for a model without it and check the margins",
            ));
        }
        match self {
            Self::Poles(poles) => {
                let placed = place(&system.a, &system.b, poles);
                let placed = placed.map_err(|why| Diagnostic::new(format!("`--place`: {why}")))?;
                let text = shown("pole placement", &placed.k, &placed.poles, system, unit) + &notes(&placed, poles);
                let value = json!({
                    "k": rows(&placed.k), "poles": complex(&placed.poles), "asked": complex(poles),
                    "error": placed.error, "sensitivity": placed.sensitivity,
                });
                Ok((text, value))
            }
            Self::Weights(weights) => {
                let diagonal = |list: &[f64]| DMatrix::from_diagonal(&DVector::from_column_slice(list));
                let (states, inputs) = weights.split_at(system.order());
                let wrong = |why| Diagnostic::new(format!("`--lqr`: {why}"));
                let k = lqr(&system.a, &system.b, &diagonal(states), &diagonal(inputs)).map_err(wrong)?;
                let closed = eigenvalues(&(&system.a - &system.b * &k)).map_err(wrong)?;
                let text = shown("linear-quadratic feedback", &k, &closed, system, unit);
                Ok((text, json!({ "k": rows(&k), "poles": complex(&closed) })))
            }
        }
    }
}

fn pole(text: &str) -> Result<Complex, Diagnostic> {
    let text: String = text.split_whitespace().collect();
    text.parse().map_err(|_| {
        Diagnostic::new(format!("`--place`: expected a number, found `{text}`"))
            .with_help("write real poles as -5, pairs as -2+3i,-2-3i")
    })
}

fn shown(
    heading: &str,
    k: &DMatrix<f64>,
    closed: &[Complex],
    system: &StateSpace,
    unit: &dyn Fn(&str) -> String,
) -> String {
    let matrix = named("K", &rounded_matrix(k), &labels(&system.inputs, unit), &labels(&system.states, unit));
    format!("\n{heading}, u = -K x\n\n{matrix}{}", poles_table("closed-loop pole", closed, None))
}

/// Formats the sensitivity and the error of the placed poles.
fn notes(placed: &Placement, asked: &[Complex]) -> String {
    let mut text = format!(
        "sensitivity: a relative change of A and B of 1e-6 moves a pole by up to {} 1/s\n",
        number(placed.sensitivity)
    );
    let largest = asked.iter().map(|pole| complex::norm(*pole)).fold(0.0, f64::max);
    if placed.error > OFF * largest {
        text += &format!(
            "note: poles deviate by up to {} 1/s from the requested ones because of rounding\n",
            number(placed.error)
        );
    }
    if let Some(indices) = &placed.defective {
        let indices: Vec<String> = indices.iter().map(usize::to_string).collect();
        text += &format!(
            "note: for controllability indices {} these repeated poles have Jordan blocks and are therefore sensitive\n",
            indices.join(", ")
        );
    }
    text
}
