//! The state feedback that `mops linearise` designs on request.

use mops_core::linear::{Complex, Placement, eigenvalues, lqr, place};
use mops_core::math::complex;
use mops_core::{Diagnostic, StateSpace};
use nalgebra::{DMatrix, DVector};
use serde_json::{Value, json};

use super::text::{labels, named, poles_table, rounded_matrix};
use super::{Arguments, complex, rows};
use crate::terminal::number;

/// A design that is asked for, as it was typed.
pub(super) enum Wanted {
    /// Poles, 1/s.
    Poles(Vec<Complex>),
    /// Weights of the states, then of the inputs.
    Weights(Vec<f64>),
}

/// Distance of the poles from those asked for, relative to the largest, that is worth a note.
const OFF: f64 = 1e-6;

impl Wanted {
    /// What the arguments ask for.
    ///
    /// # Errors
    /// Numbers that cannot be read, or are not as many as the system takes.
    pub(super) fn of(system: &StateSpace, arguments: &Arguments) -> Result<Option<Self>, Diagnostic> {
        let (n, m) = (system.order(), system.inputs.len());
        if let Some(text) = &arguments.place {
            let poles: Vec<Complex> = text.split(',').map(pole).collect::<Result<_, _>>()?;
            if poles.len() != n {
                let fact = format!("`--place`: {} poles are asked for, but the system has {n} states", poles.len());
                return Err(Diagnostic::new(fact));
            }
            return Ok(Some(Self::Poles(poles)));
        }
        let Some(text) = &arguments.lqr else { return Ok(None) };
        let weights: Vec<f64> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
        if weights.len() != n + m || text.split(',').count() != n + m {
            return Err(Diagnostic::new(format!(
                "`--lqr` takes {n} weights of states and {m} of inputs, not `{text}`"
            ))
            .with_help(format!("in the order {}, {}", system.states.join(", "), system.inputs.join(", "))));
        }
        Ok(Some(Self::Weights(weights)))
    }

    /// The feedback, as text and as JSON.
    ///
    /// # Errors
    /// A system or numbers for which there is none.
    pub(super) fn design(
        &self,
        system: &StateSpace,
        unit: &dyn Fn(&str) -> String,
    ) -> Result<(String, Value), Diagnostic> {
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
        Diagnostic::new(format!("`--place`: `{text}` is no number"))
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
    format!("\n{heading}, u = -K x\n\n{matrix}{}", poles_table("closed-loop pole", closed))
}

/// How well the poles are placed.
fn notes(placed: &Placement, asked: &[Complex]) -> String {
    let mut text = format!(
        "entries of A and B that change by one part in a million move a pole by up to {} 1/s\n",
        number(placed.sensitivity)
    );
    let largest = asked.iter().map(|pole| complex::norm(*pole)).fold(0.0, f64::max);
    if placed.error > OFF * largest {
        text += &format!(
            "note: rounding alone moves a pole by up to {} 1/s from where it was asked for\n",
            number(placed.error)
        );
    }
    if let Some(indices) = &placed.defective {
        let indices: Vec<String> = indices.iter().map(usize::to_string).collect();
        text += &format!(
            "note: with the controllability indices {} these repeated poles have Jordan blocks, which makes them sensitive\n",
            indices.join(", ")
        );
    }
    text
}
