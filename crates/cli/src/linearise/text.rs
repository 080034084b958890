//! Text of a linear system: operating point, matrices, poles, zeros and transfer functions.

use mops_core::{Variable, model::Resting};
use mops_language::Unit;
use mops_linear::{Complex, NEXT, StateSpace, TransferFunction, undecided};
use mops_math as math;
use mops_math::complex;
use nalgebra::DMatrix;

use super::arguments::WHERE;
use crate::families::folded;
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
    let name = name.trim_start_matches(NEXT);
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

/// Formats the matrices A, B, C and D with names and units; with a sampling period, those of a difference equation.
pub(super) fn matrices(system: &StateSpace, period: Option<f64>, unit: &dyn Fn(&str) -> String) -> String {
    let rate = |name: &String| match unit(name) {
        _ if period.is_some() => format!("{name}(k+1)"),
        unit if unit.is_empty() => format!("{name}' [1/s]"),
        unit => format!("{name}' [{}]", Unit::known(&unit).power(1, -1)),
    };
    let (states, rates) = (labels(&system.states, unit), system.states.iter().map(rate).collect());
    let (inputs, outputs) = (labels(&system.inputs, unit), labels(&system.outputs, unit));
    let mut text = period.map_or_else(String::new, |period| {
        let period = number(period);
        format!("\ndiscrete equivalent with a period of {period} s; inputs are constant in between\n")
    });
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

/// Returns a note on poles whose distance to the border of stability is within the rounding error; else an empty text.
pub(super) fn undecided_note(system: &StateSpace) -> String {
    let found = undecided(&system.a).unwrap_or_default();
    if found.is_empty() {
        return String::new();
    }
    let (border, names): (_, Vec<String>) = match system.period {
        Some(period) => ("unit circle", found.iter().map(|pole| spelled(StateSpace::z(*pole, period))).collect()),
        None => ("imaginary axis", found.iter().map(|pole| spelled(*pole)).collect()),
    };
    format!("note: stability undecided, as these poles are within rounding of the {border}: {}\n", names.join(", "))
}

/// Formats poles with damping ratio, frequency and time constant, the slowest decay first. With a sampling period, the
/// poles are those in z, and the others are those of `ln(z)/T`.
pub(super) fn poles_table(what: &str, poles: &[Complex], period: Option<f64>) -> String {
    let in_seconds = |z: Complex| period.map_or(z, |period| StateSpace::logarithm(z, period));
    let mut sorted: Vec<(Complex, Complex)> = rounded(poles, poles).into_iter().map(|p| (p, in_seconds(p))).collect();
    sorted.sort_by(|a, b| b.1.re.total_cmp(&a.1.re).then(b.1.im.total_cmp(&a.1.im)));
    let row = |(pole, p): &(Complex, Complex)| {
        let size = complex::norm(*p);
        let text = |shown: bool, value: f64| if shown { number(value) } else { String::new() };
        let (damping, constant) = (-p.re / size, -1.0 / p.re);
        // A pole at z = 0 is a delay by a period.
        let is_finite = size.is_finite();
        vec![
            spelled(*pole),
            text(size > 0.0 && is_finite, damping),
            text(is_finite, size),
            text(p.re < 0.0 && is_finite, constant),
        ]
    };
    let unit = if period.is_some() { "(z)" } else { "(1/s)" };
    let header = [&format!("{what} {unit}"), "damping", "frequency (rad/s)", "time constant (s)"];
    format!("\n{}", table(&header, &[1, 2, 3], sorted.iter().map(row).collect()))
}

/// Formats the transfer function and the zeros of one channel; with a sampling period, those in z.
pub(super) fn channel(
    system: &StateSpace,
    period: Option<f64>,
    zeros: &[Complex],
    function: &TransferFunction,
    poles: &[Complex],
) -> String {
    let spelled_zeros: Vec<String> = rounded(zeros, poles).iter().map(|z| spelled(*z)).collect();
    let spelled_zeros = match spelled_zeros.len() {
        count if count > MANY => vec![format!("{count} zeros, see {WHERE}")],
        _ => spelled_zeros,
    };
    let (variable, unit) = if period.is_some() { ("z", "(z)") } else { ("s", "(1/s)") };
    let is_zero = function.numerator.iter().all(|c| *c == 0.0);
    match (is_zero, spelled_zeros.is_empty()) {
        (true, _) => "  0\n".to_owned(),
        (false, empty) => format!(
            "{}  zeros {unit}: {}\n",
            if system.order() > MANY { String::new() } else { format!("  {}\n", quotient(function, poles, variable)) },
            if empty { "none".to_owned() } else { spelled_zeros.join(", ") }
        ),
    }
}

fn quotient(function: &TransferFunction, poles: &[Complex], variable: &str) -> String {
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
                1 => variable.to_owned(),
                power => format!("{variable}^{power}"),
            };
            let factor = number(c.abs());
            let factor = if factor == "1" && !power.is_empty() { String::new() } else { factor };
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
