//! Text of a linear system: operating point, matrices, poles, zeros and transfer functions.

use mops_core::linear::{Complex, TransferFunction, undecided};
use mops_core::math::{self, complex};
use mops_core::{Resting, StateSpace, Unit, Variable};
use nalgebra::DMatrix;

use super::WHERE;
use crate::cli::families::folded;
use crate::terminal::{number, table};

/// Largest number of states and channels that are printed in full.
pub(super) const MANY: usize = 12;

/// Formats the operating point: values and rates of the states, values of the inputs.
pub(super) fn operating_point(states: &[Variable], inputs: &[Variable], found: &Resting) -> String {
    let of_states = states.iter().zip(found.states.iter().zip(&found.rates));
    let of_states =
        of_states.map(|(v, (value, rate))| vec![v.name.clone(), number(*value), v.unit.to_string(), number(*rate)]);
    let of_inputs = inputs.iter().zip(&found.inputs);
    let of_inputs = of_inputs.map(|(v, value)| vec![v.name.clone(), number(*value), v.unit.to_string(), String::new()]);
    let header = ["operating point", "value", "unit", "rate per s"];
    let mut text = table(&header, &[1, 3], folded(of_states.chain(of_inputs).collect(), 0));
    if found.rates.iter().any(|rate| rate.abs() > 1e-9) {
        text += "note: not an equilibrium; find one with --equilibrium\n";
    }
    text
}

/// Returns the unit of a variable as text; empty if dimensionless.
pub(super) fn unit_of(name: &str, states: &[Variable], inputs: &[Variable], signals: &[Variable]) -> String {
    let variable = states.iter().chain(inputs).chain(signals).find(|v| v.name == name);
    variable.map(|v| v.unit.to_string()).filter(|unit| unit != "1").unwrap_or_default()
}

/// Formats names with their units.
pub(super) fn labels(names: &[String], unit: &dyn Fn(&str) -> String) -> Vec<String> {
    let label = |name: &String| match unit(name) {
        unit if unit.is_empty() => name.clone(),
        unit => format!("{name} [{unit}]"),
    };
    names.iter().map(label).collect()
}

/// Formats the matrices A, B, C and D with names and units.
pub(super) fn matrices(system: &StateSpace, unit: &dyn Fn(&str) -> String) -> String {
    let rate = |name: &String| match unit(name) {
        unit if unit.is_empty() => format!("{name}' [1/s]"),
        unit => format!("{name}' [{}]", Unit::known(&unit).power(1, -1)),
    };
    let (states, rates) = (labels(&system.states, unit), system.states.iter().map(rate).collect());
    let (inputs, outputs) = (labels(&system.inputs, unit), labels(&system.outputs, unit));
    let mut text = String::new();
    if system.order() > MANY {
        text += &format!("\nA, B, C and D ({} states) are in {WHERE}\n", system.order());
    }
    for (name, matrix, rows, columns) in [
        ("A", &system.a, &rates, &states),
        ("B", &system.b, &rates, &inputs),
        ("C", &system.c, &outputs, &states),
        ("D", &system.d, &outputs, &inputs),
    ] {
        if system.order() > MANY {
            break;
        }
        text += &format!("\n{}", named(name, matrix, rows, columns));
    }
    if system.delay != 0.0 {
        text += &format!("\ninput delay: {} s\n", number(system.delay));
    }
    text
}

/// Formats a matrix with the names of its rows and columns.
pub(super) fn named(name: &str, matrix: &DMatrix<f64>, rows: &[String], columns: &[String]) -> String {
    let header: Vec<&str> = [name].into_iter().chain(columns.iter().map(String::as_str)).collect();
    let numeric: Vec<usize> = (1..=columns.len()).collect();
    let line = |(i, row): (usize, &String)| {
        [row.clone()].into_iter().chain(matrix.row(i).iter().map(|x| number(*x))).collect()
    };
    table(&header, &numeric, rows.iter().enumerate().map(line).collect())
}

/// Sets parts of complex numbers to zero that are rounding errors relative to the largest number in `all`.
fn rounded(numbers: &[Complex], all: &[Complex]) -> Vec<Complex> {
    let largest =
        all.iter().chain(numbers).map(|z| complex::norm(*z)).filter(|size| size.is_finite()).fold(0.0, f64::max);
    // The poles of a stiff system may be nine decades apart.
    let part = |part: f64, size: f64| if part.abs() < 1e-12 * largest || part.abs() < 1e-9 * size { 0.0 } else { part };
    numbers.iter().map(|z| Complex::new(part(z.re, complex::norm(*z)), part(z.im, complex::norm(*z)))).collect()
}

/// Sets entries of a matrix to zero that are rounding errors relative to the largest entry.
pub(super) fn rounded_matrix(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let largest = matrix.amax();
    matrix.map(|x| if x.abs() < 1e-9 * largest { 0.0 } else { x })
}

/// Sets terms of a polynomial (highest power first) to zero that are rounding errors at all frequencies of the poles.
fn rounded_polynomial(coefficients: &[f64], poles: &[Complex]) -> Vec<f64> {
    let degree = coefficients.len().saturating_sub(1);
    let poles = rounded(poles, poles);
    let frequencies: Vec<f64> = poles.iter().map(|pole| complex::norm(*pole)).filter(|size| *size > 0.0).collect();
    let term = |i: usize, omega: f64| coefficients[i].abs() * math::powi(omega, (degree - i) as i32);
    let counts = |i: usize, omega: f64| {
        let largest = (0..=degree).map(|j| term(j, omega)).fold(0.0, f64::max);
        term(i, omega) >= 1e-9 * largest
    };
    let frequencies = if frequencies.is_empty() { vec![1.0] } else { frequencies };
    let kept = |(i, &c): (usize, &f64)| if frequencies.iter().any(|&omega| counts(i, omega)) { c } else { 0.0 };
    coefficients.iter().enumerate().map(kept).collect()
}

/// Formats a complex number.
pub(super) fn spelled(z: Complex) -> String {
    match z.im {
        0.0 => number(z.re),
        im => format!("{} {} {}i", number(z.re), if im > 0.0 { "+" } else { "-" }, number(im.abs())),
    }
}

/// Returns a note on poles whose distance to the imaginary axis is within the rounding error; else an empty text.
pub(super) fn undecided_note(a: &DMatrix<f64>) -> String {
    let found = undecided(a).unwrap_or_default();
    if found.is_empty() {
        return String::new();
    }
    let names: Vec<String> = found.iter().map(|pole| spelled(*pole)).collect();
    format!(
        "note: stability undecided, as these poles are within rounding of the imaginary axis: {}\n",
        names.join(", ")
    )
}

/// Formats poles with damping ratio, frequency and time constant, the slowest decay first.
pub(super) fn poles_table(what: &str, poles: &[Complex]) -> String {
    let mut sorted = rounded(poles, poles);
    sorted.sort_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
    let row = |p: &Complex| {
        let damping = if complex::norm(*p) == 0.0 { String::new() } else { number(-p.re / complex::norm(*p)) };
        let constant = if p.re < 0.0 { number(-1.0 / p.re) } else { String::new() };
        vec![spelled(*p), damping, number(complex::norm(*p)), constant]
    };
    let header = [&format!("{what} (1/s)"), "damping", "frequency (rad/s)", "time constant (s)"];
    format!("\n{}", table(&header, &[1, 2, 3], sorted.iter().map(row).collect()))
}

/// Formats the transfer function and the zeros of one channel.
pub(super) fn channel(
    system: &StateSpace,
    zeros: &[Complex],
    function: &TransferFunction,
    poles: &[Complex],
) -> String {
    let spelled_zeros: Vec<String> = rounded(zeros, poles).iter().map(|z| spelled(*z)).collect();
    let spelled_zeros = match spelled_zeros.len() {
        count if count > MANY => vec![format!("{count} zeros, see {WHERE}")],
        _ => spelled_zeros,
    };
    let is_zero = function.numerator.iter().all(|c| *c == 0.0);
    match (is_zero, spelled_zeros.is_empty()) {
        (true, _) => "  0\n".to_owned(),
        (false, empty) => format!(
            "{}  zeros (1/s): {}\n",
            if system.order() > MANY { String::new() } else { format!("  {}\n", quotient(function, poles)) },
            if empty { "none".to_owned() } else { spelled_zeros.join(", ") }
        ),
    }
}

fn quotient(function: &TransferFunction, poles: &[Complex]) -> String {
    let polynomial = |coefficients: &[f64]| {
        let degree = coefficients.len() - 1;
        let mut text = String::new();
        for (i, &c) in coefficients.iter().enumerate().filter(|(_, c)| **c != 0.0) {
            let sign = match (text.is_empty(), c < 0.0) {
                (true, false) => "",
                (true, true) => "-",
                (false, false) => " + ",
                (false, true) => " - ",
            };
            let power = match degree - i {
                0 => String::new(),
                1 => "s".to_owned(),
                power => format!("s^{power}"),
            };
            let factor = if c.abs() == 1.0 && !power.is_empty() { String::new() } else { number(c.abs()) };
            let space = if factor.is_empty() || power.is_empty() { "" } else { " " };
            text += &format!("{sign}{factor}{space}{power}");
        }
        text
    };
    let delay = if function.delay == 0.0 { String::new() } else { format!(" exp(-{} s)", number(function.delay)) };
    let [numerator, denominator] =
        [&function.numerator, &function.denominator].map(|p| polynomial(&rounded_polynomial(p, poles)));
    format!("({numerator})/({denominator}){delay}")
}
