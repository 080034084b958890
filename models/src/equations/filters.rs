//! Filters of clocks: transfer functions as difference equations of their memory.

use mops_core::linear::{StateSpace, TransferFunction, exponential};
use mops_core::{Quantity, StudyError, Unit};
use nalgebra::DMatrix;

use super::definition::{path, under};
use super::options::{Clock, Described, EquationsOptions, Filter, Formula, Method, Polynomials};
use mops_core::file::Short;

/// Returns the options with each filter replaced by memory and its next values.
///
/// The filter `y(z) = (b0 + b1/z + ..)/(1 + a1/z + ..) e(z)` is in the transposed direct form II: `y = b0 e + m1`, then
/// `m1 = b1 e - a1 y + m2` and so on.
///
/// Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing, 3rd edition (2010), section 6.3.4.
pub(super) fn expanded(mut options: EquationsOptions) -> Result<EquationsOptions, StudyError> {
    for (name, clock) in &mut options.clocks.0 {
        for (output, filter) in std::mem::take(&mut clock.filter.0) {
            let wrong = |mistake: StudyError| under(&path(&["clocks", name, "filter", &output]), mistake);
            add(clock, &output, &filter).map_err(wrong)?;
        }
    }
    Ok(options)
}

fn add(clock: &mut Clock, output: &str, filter: &Filter) -> Result<(), StudyError> {
    let declared = clock.memory.0.iter().find(|(key, _)| key == output);
    let Some((_, Short(Described { unit, .. }))) = declared else {
        let fact = format!("`{output}` is not in the memory of the clock");
        return Err(StudyError::here(fact).with_help(format!("declare it: memory = {{ {output} = \"V\" }}")));
    };
    let unit = unit.clone();
    if clock.next.0.iter().any(|(key, _)| key == output) {
        let fact = format!("`{output}` has a new value in `next` as well as by its filter");
        return Err(StudyError::here(fact).with_help("remove one of them"));
    }
    let [above, below] = coefficients(clock, filter)?;
    let order = below.len() - 1;
    let e = format!("({})", filter.of.0);
    let scaled =
        |coefficient: &Option<String>| coefficient.as_ref().map(|c| format!("({c})*{e}/({})", leading(&below)));
    let memory = |k: usize| format!("{output}_{k}");
    let direct = scaled(&above[0]);
    let value = match (direct, order) {
        (Some(direct), 0) => direct,
        (Some(direct), _) => format!("{direct} + {}", memory(1)),
        (None, 0) => format!("0*{e}"),
        (None, _) => memory(1),
    };
    for k in 1..=order {
        let mut next: Vec<String> = scaled(&above[k]).into_iter().collect();
        if k < order {
            next.push(memory(k + 1));
        }
        let back = below[k].as_ref().map(|a| format!("({a})/({})*({value})", leading(&below)));
        let next = match (next.join(" + "), back) {
            (next, Some(back)) if next.is_empty() => format!("-{back}"),
            (next, Some(back)) => format!("{next} - {back}"),
            (next, None) if next.is_empty() => format!("0*({value})"),
            (next, None) => next,
        };
        let about = Some(format!("memory {k} of the filter {output}"));
        clock.memory.0.push((memory(k), Short(Described { unit: unit.clone(), about })));
        clock.next.0.push((memory(k), Formula(next)));
    }
    clock.next.0.push((output.to_owned(), Formula(value)));
    Ok(())
}

fn leading(below: &[Option<String>]) -> &str {
    below[0].as_deref().expect("the leading coefficient is not zero")
}

/// Returns the coefficients of numerator and denominator in descending powers of z, of equal number; `None` for zero.
fn coefficients(clock: &Clock, filter: &Filter) -> Result<[Vec<Option<String>>; 2], StudyError> {
    match (&filter.z, &filter.continuous) {
        (Some(z), None) => {
            if let Some(key) =
                [("method", filter.method.is_some()), ("prewarp", filter.prewarp.is_some())].iter().find(|key| key.1)
            {
                let help = "remove it, or give the filter as `continuous`";
                return Err(StudyError::new(key.0, "a filter in z is discrete already").with_help(help));
            }
            let text = |formula: &Formula| (!is_zero(formula)).then(|| formula.0.clone());
            checked(z, "z")?;
            let below: Vec<Option<String>> = z.denominator.iter().map(text).collect();
            let padding = below.len() - z.numerator.len();
            let above = std::iter::repeat_n(None, padding).chain(z.numerator.iter().map(text)).collect();
            Ok([above, below])
        }
        (None, Some(continuous)) => {
            checked(continuous, "continuous")?;
            match filter.method.unwrap_or(Method::Tustin) {
                Method::Tustin => bilinear(clock, filter, continuous),
                Method::ZeroOrderHold => step_invariant(clock, filter, continuous),
            }
        }
        _ => Err(StudyError::here("a filter is given in `z` or as `continuous`")
            .with_help("for example continuous = { numerator = [\"k*Ti\", \"k\"], denominator = [\"Ti\", 0] }")),
    }
}

fn is_zero(formula: &Formula) -> bool {
    formula.0.trim().parse::<f64>() == Ok(0.0)
}

fn checked(of: &Polynomials, key: &str) -> Result<(), StudyError> {
    let (above, below) = (of.numerator.len(), of.denominator.len());
    if above == 0 || below == 0 || above > below {
        let fact = format!("expected a proper transfer function, found {above} coefficients over {below}");
        let help = "the denominator has at least as many coefficients as the numerator, in descending powers";
        return Err(StudyError::new(key, fact).with_help(help));
    }
    if is_zero(&of.denominator[0]) {
        return Err(StudyError::new(key, "the leading coefficient of the denominator is 0").with_help("leave it out"));
    }
    Ok(())
}

/// Returns the coefficients of `(z - 1)^power (z + 1)^(order - power)` in descending powers of z.
fn binomials(power: usize, order: usize) -> Vec<i64> {
    (0..order).fold(vec![1], |polynomial, k| {
        let root = if k < power { -1 } else { 1 };
        let shifted = polynomial.iter().map(|c| c * root);
        let mut product = [&polynomial[..], &[0]].concat();
        product[1..].iter_mut().zip(shifted).for_each(|(c, shifted)| *c += shifted);
        product
    })
}

/// Returns the bilinear (Tustin) transform: `s = K (z - 1)/(z + 1)` with `K = 2/T`, or `K = w/tan(w T/2)`, so that the gain at the
/// angular frequency `w` is that of the continuous filter.
///
/// Source: K. J. Astrom, B. Wittenmark, Computer-Controlled Systems, 3rd edition (1997), section 8.3.
fn bilinear(clock: &Clock, filter: &Filter, of: &Polynomials) -> Result<[Vec<Option<String>>; 2], StudyError> {
    let period = in_brackets(&clock.every);
    let factor = match &filter.prewarp {
        None => format!("(2/{period})"),
        Some(frequency) => {
            let angular = angular(frequency, clock)?;
            format!("({angular}/tan({angular}*{period}/2))")
        }
    };
    let order = of.denominator.len() - 1;
    let transformed = |coefficients: &[Formula]| -> Vec<Option<String>> {
        let highest = coefficients.len() - 1;
        let mut sums = vec![Vec::new(); order + 1];
        for (index, coefficient) in coefficients.iter().enumerate().filter(|(_, c)| !is_zero(c)) {
            let power = highest - index;
            let term = match power {
                0 => format!("({})", coefficient.0),
                _ => format!("({})*{factor}^{power}", in_seconds(coefficient, power)),
            };
            for (sum, count) in sums.iter_mut().zip(binomials(power, order)).filter(|(_, count)| *count != 0) {
                sum.push(format!("({count})*{term}"));
            }
        }
        sums.into_iter().map(|terms| (!terms.is_empty()).then(|| terms.join(" + "))).collect()
    };
    Ok([transformed(&of.numerator), transformed(&of.denominator)])
}

/// Returns a time as part of an expression.
pub(super) fn in_brackets(time: &Formula) -> String {
    match Quantity::parse(&time.0) {
        Ok(Quantity { number, unit }) => format!("({number:?} [{}])", unit.map_or("s".to_owned(), |u| u.to_string())),
        Err(_) => format!("({})", time.0),
    }
}

/// Returns a frequency as an angular frequency in an expression.
///
/// The factor of the transform is positive below half of the sampling frequency only. If the period depends on parameters, a
/// frequency above makes the filter undefined.
fn angular(frequency: &Quantity, clock: &Clock) -> Result<String, StudyError> {
    let value = frequency.to(&Unit::known("rad/s")).map_err(|why| StudyError::new("prewarp", why))?;
    let value = if frequency.unit.is_none() { std::f64::consts::TAU * frequency.number } else { value };
    let period = Quantity::parse(&clock.every.0).ok().and_then(|period| period.to(&Unit::known("s")).ok());
    let half = period.map_or(f64::INFINITY, |period| 0.5 / period);
    let hertz = value / std::f64::consts::TAU;
    if value.is_nan() || value <= 0.0 || hertz >= half {
        let range = if half.is_finite() {
            format!("above 0 Hz and below half of the sampling frequency, {half} Hz")
        } else {
            "above 0 Hz".to_owned()
        };
        return Err(StudyError::new("prewarp", format!("`prewarp` must be {range}, and is {hertz} Hz"))
            .with_help("a number without a unit is in Hz"));
    }
    if value.is_infinite() {
        return Err(StudyError::new("prewarp", "`prewarp` must be finite"));
    }
    Ok(format!("({value:?} [rad/s])"))
}

/// Returns a coefficient of `s^power`; a number has the unit `s^power`.
fn in_seconds(coefficient: &Formula, power: usize) -> String {
    match coefficient.0.trim().parse::<f64>() {
        Ok(number) => format!("{number:?} [s{power}]"),
        Err(_) => coefficient.0.clone(),
    }
}

/// Returns the list with a number as coefficient of `s^n`, n above 0, beside formulas, which may have the unit of another convention,
/// and how to write the number then.
pub(super) fn number_before_formulas(filter: &Filter) -> Option<(&'static str, String)> {
    let of = filter.continuous.as_ref()?;
    let is_number = |coefficient: &Formula| coefficient.0.trim().parse::<f64>().is_ok();
    let lists = [("denominator", &of.denominator), ("numerator", &of.numerator)];
    if lists.iter().all(|(_, list)| list.iter().all(is_number)) {
        return None;
    }
    lists.into_iter().find_map(|(key, list)| {
        let numbers = list.iter().enumerate().filter(|(_, c)| is_number(c) && !is_zero(c));
        let (index, number) = numbers.map(|(index, c)| (index, c.0.trim())).next()?;
        let power = list.len() - 1 - index;
        let help = format!(
            "the number {number} before s^{power} counts in s^{power}, as each number before s^n in s^n; write \"{number} [1]\" for a \
             number without a unit, as in s^2 + 2 z w s + w^2"
        );
        (power > 0).then_some((key, help))
    })
}

/// Returns the filter whose output at the instants is that of the continuous one for an input that is constant in between.
///
/// Source: K. J. Astrom, B. Wittenmark, Computer-Controlled Systems, 3rd edition (1997), section 2.3.
fn step_invariant(clock: &Clock, filter: &Filter, of: &Polynomials) -> Result<[Vec<Option<String>>; 2], StudyError> {
    if filter.prewarp.is_some() {
        return Err(StudyError::new("prewarp", "a zero-order hold has no prewarping").with_help("remove it"));
    }
    let number = |formula: &Formula| {
        formula.0.trim().parse::<f64>().map_err(|_| {
            let fact = format!("a zero-order hold needs numbers as coefficients, and `{}` is none", formula.0);
            StudyError::new("continuous", fact).with_help("use method = \"tustin\", which takes expressions")
        })
    };
    let period = Quantity::parse(&clock.every.0).and_then(|period| period.to(&Unit::known("s"))).map_err(|_| {
        let fact = format!("a zero-order hold needs a period that is a time, and `{}` is an expression", clock.every.0);
        StudyError::new("method", fact).with_help("write every = \"10 ms\", or use method = \"tustin\"")
    })?;
    let numbers = |list: &[Formula]| list.iter().map(number).collect::<Result<Vec<f64>, _>>();
    let continuous = TransferFunction::new(numbers(&of.numerator)?, numbers(&of.denominator)?);
    let system = continuous.state_space().map_err(|why| StudyError::new("continuous", why))?;
    let n = system.order();
    // The exponential of [A B; 0 0] T has the matrices of the sampled system in its upper rows.
    let mut both = DMatrix::zeros(n + 1, n + 1);
    both.view_mut((0, 0), (n, n)).copy_from(&(&system.a * period));
    both.view_mut((0, n), (n, 1)).copy_from(&(&system.b * period));
    let sampled = exponential(&both);
    let (a, b) = (sampled.view((0, 0), (n, n)).into_owned(), sampled.view((0, n), (n, 1)).into_owned());
    let sampled = TransferFunction::of(&StateSpace::new(a, b, system.c, system.d));
    let TransferFunction { numerator, denominator, .. } = sampled.map_err(|why| StudyError::new("continuous", why))?;
    let text = |c: &f64| (*c != 0.0).then(|| format!("{c:?}"));
    let below: Vec<Option<String>> = denominator.iter().map(text).collect();
    let padding = below.len() - numerator.len();
    Ok([std::iter::repeat_n(None, padding).chain(numerator.iter().map(text)).collect(), below])
}

#[cfg(test)]
mod tests {
    use super::binomials;

    #[test]
    fn the_bilinear_transform_has_binomial_coefficients() {
        assert_eq!(binomials(0, 0), [1]);
        assert_eq!(binomials(1, 1), [1, -1]);
        assert_eq!(binomials(0, 3), [1, 3, 3, 1]);
        assert_eq!(binomials(2, 3), [1, -1, -1, 1]);
    }
}
