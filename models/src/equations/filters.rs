//! Filters of clocks: transfer functions as difference equations of their memory.

use mops_core::StudyError;
use mops_language::{Quantity, Unit, entries::Short};
use mops_linear::{TransferFunction, exponential_m1};
use mops_math as math;
use nalgebra::DMatrix;

use super::definition::{path, under};
use super::options::{Clock, Described, EquationsOptions, Filter, Formula, Method, Polynomials};

/// Returns the options with each filter replaced by memory and its next values.
pub(super) fn expanded(mut options: EquationsOptions) -> Result<EquationsOptions, StudyError> {
    for (name, clock) in &mut options.clocks.0 {
        for (output, filter) in std::mem::take(&mut clock.filter.0) {
            let wrong = |mistake: StudyError| under(&path(&["clocks", name, "filter", &output]), mistake);
            add(clock, &output, &filter).map_err(wrong)?;
        }
    }
    Ok(options)
}

/// Loss of digits from the coefficients of a filter in z to its gain at frequency 0 from which on the model has a note.
const LOSS: f64 = 1e6;

/// Returns what the digits of the filters are worth that are given in z with numbers, where they lose many.
pub(super) fn notes(options: &EquationsOptions) -> Vec<String> {
    let filters = options.clocks.0.iter().flat_map(|(_, clock)| &clock.filter.0);
    let lost = filters.filter_map(|(name, filter)| {
        let below = filter.z.as_ref()?.denominator.iter().map(|c| c.0.trim().parse::<f64>());
        let below = below.collect::<Result<Vec<f64>, _>>().ok()?;
        let (sum, terms) = below.iter().fold((0.0f64, 0.0), |(sum, terms), c| (sum + c, terms + c.abs()));
        // Poles at z = 1 are integrators.
        (sum != 0.0 && terms > LOSS * sum.abs()).then(|| {
            let digits = (-math::log10(f64::EPSILON * terms / sum.abs())).floor().max(0.0);
            format!(
                "filter `{name}`: its coefficients in z, with 16 digits, determine its gain at low frequencies to {digits:.0} digits; \
                 `continuous` keeps them all"
            )
        })
    });
    lost.collect()
}

/// Difference equations of a filter, as expressions of its memory.
struct Difference {
    /// Next values of the memory.
    next: Vec<String>,
    /// Output.
    value: String,
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
    let memory = |k: usize| format!("{output}_{k}");
    let Difference { next, value } = difference(clock, filter, &memory)?;
    for (k, next) in next.into_iter().enumerate() {
        let about = Some(format!("memory {} of the filter {output}", k + 1));
        clock.memory.0.push((memory(k + 1), Short(Described { unit: unit.clone(), about })));
        clock.next.0.push((memory(k + 1), Formula(next)));
    }
    clock.next.0.push((output.to_owned(), Formula(value)));
    Ok(())
}

/// Returns the difference equations of `y(z) = (b0 + b1/z + ..)/(1 + a1/z + ..) e(z)` in the transposed direct form II:
/// `y = b0 e + m1`, then `m1 = b1 e - a1 y + m2` and so on. The coefficients are in descending powers of z, of equal
/// number; `None` for zero.
///
/// Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing, 3rd edition (2010), section 6.3.4.
fn direct_form(above: &[Option<String>], below: &[Option<String>], e: &str, memory: Memory<'_>) -> Difference {
    let order = below.len() - 1;
    let scaled = |coefficient: &Option<String>| coefficient.as_ref().map(|c| format!("({c})*{e}/({})", leading(below)));
    let value = match (scaled(&above[0]), order) {
        (Some(direct), 0) => direct,
        (Some(direct), _) => format!("{direct} + {}", memory(1)),
        (None, 0) => format!("0*{e}"),
        (None, _) => memory(1),
    };
    let next = |k: usize| {
        let mut next: Vec<String> = scaled(&above[k]).into_iter().collect();
        if k < order {
            next.push(memory(k + 1));
        }
        let back = below[k].as_ref().map(|a| format!("({a})/({})*({value})", leading(below)));
        match (next.join(" + "), back) {
            (next, Some(back)) if next.is_empty() => format!("-{back}"),
            (next, Some(back)) => format!("{next} - {back}"),
            (next, None) if next.is_empty() => format!("0*({value})"),
            (next, None) => next,
        }
    };
    Difference { next: (1..=order).map(next).collect(), value }
}

/// Returns the name of a memory of a filter, by its number from 1 on.
type Memory<'a> = &'a dyn Fn(usize) -> String;

fn leading(below: &[Option<String>]) -> &str {
    below[0].as_deref().expect("the leading coefficient is not zero")
}

fn difference(clock: &Clock, filter: &Filter, memory: Memory<'_>) -> Result<Difference, StudyError> {
    let e = format!("({})", filter.of.0);
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
            let above: Vec<Option<String>> =
                std::iter::repeat_n(None, padding).chain(z.numerator.iter().map(text)).collect();
            Ok(direct_form(&above, &below, &e, memory))
        }
        (None, Some(continuous)) => {
            checked(continuous, "continuous")?;
            match filter.method.unwrap_or(Method::Tustin) {
                Method::Tustin => bilinear(clock, filter, continuous, &e, memory),
                Method::ZeroOrderHold => step_invariant(clock, filter, continuous, &e, memory),
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

/// Returns the bilinear (Tustin) transform: `s = K (z - 1)/(z + 1)` with `K = 2/T`, or `K = w/tan(w T/2)`, so that the
/// gain at the angular frequency `w` is that of the continuous filter.
///
/// The filter `(b0 s^n + b1 s^(n-1) + ..)/(a0 s^n + ..)` is a chain of integrators in observer form, integrated by the
/// trapezoidal rule. With `B_k = (b_k K^(n-k) + .. + b_n)/S`, `A_k` alike of the denominator and `S` so that `A_0 = 1`,
/// it is
///
/// ```text
/// y = B_0 e + m1 + .. + mn,   mk[next] = mk + 2 (B_k e - A_k y + m(k+1) + .. + mn)
/// ```
///
/// The memory changes by small amounts where the sampling is fast. The coefficients of the polynomials in z would lose
/// digits there, all beyond `1e-16/(w T)^n`.
///
/// Sources: K. J. Astrom, B. Wittenmark, Computer-Controlled Systems, 3rd edition (1997), section 8.3; G. C. Goodwin,
/// R. H. Middleton, H. V. Poor, High-speed digital signal processing and control, Proceedings of the IEEE 80 (1992)
/// 240-259 (changes, not shifts).
fn bilinear(
    clock: &Clock,
    filter: &Filter,
    of: &Polynomials,
    e: &str,
    memory: Memory<'_>,
) -> Result<Difference, StudyError> {
    let period = in_brackets(&clock.every);
    let factor = match &filter.prewarp {
        None => format!("(2/{period})"),
        Some(frequency) => {
            let angular = angular(frequency, clock)?;
            format!("({angular}/tan({angular}*{period}/2))")
        }
    };
    let order = of.denominator.len() - 1;
    // Sums of the last terms, from each power on; `None` for zero.
    let sums = |coefficients: &[Formula]| -> Vec<Option<String>> {
        let highest = coefficients.len() - 1;
        let terms = coefficients.iter().enumerate().map(|(index, coefficient)| {
            let power = highest - index;
            let term = match power {
                0 => format!("({})", coefficient.0),
                _ => format!("({})*{factor}^{power}", in_seconds(coefficient, power)),
            };
            (!is_zero(coefficient)).then_some(term)
        });
        let terms: Vec<Option<String>> = std::iter::repeat_n(None, order - highest).chain(terms).collect();
        let sum = |from: usize| {
            let terms: Vec<&str> = terms[from..].iter().flatten().map(String::as_str).collect();
            (!terms.is_empty()).then(|| terms.join(" + "))
        };
        (0..=order).map(sum).collect()
    };
    let (above, below) = (sums(&of.numerator), sums(&of.denominator));
    let all = leading(&below);
    let memories = |from: usize| (from..=order).map(memory).collect::<Vec<_>>().join(" + ");
    let driven = |k: usize| above[k].as_ref().map(|sum| format!("({sum})/({all})*{e}"));
    let value = match (driven(0), order) {
        (Some(direct), 0) => direct,
        (Some(direct), _) => format!("{direct} + {}", memories(1)),
        (None, 0) => format!("0*{e}"),
        (None, _) => memories(1),
    };
    let next = |k: usize| {
        let back = below[k].as_ref().map(|sum| format!(" - ({sum})/({all})*({value})")).unwrap_or_default();
        let rest = (k < order).then(|| memories(k + 1));
        let parts: Vec<String> = [driven(k), rest].into_iter().flatten().collect();
        let change = parts.join(" + ") + &back;
        if change.is_empty() { memory(k) } else { format!("{} + 2*({change})", memory(k)) }
    };
    Ok(Difference { next: (1..=order).map(next).collect(), value })
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
/// The factor of the transform is positive below half of the sampling frequency only. If the period depends on
/// parameters, a frequency above makes the filter undefined.
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

/// Returns the list with a number as coefficient of `s^n`, n above 0, beside formulas, which may have the unit of
/// another convention, and how to write the number then.
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

/// Returns the filter whose output at the instants is that of the continuous one for an input that is constant in
/// between.
///
/// Source: K. J. Astrom, B. Wittenmark, Computer-Controlled Systems, 3rd edition (1997), section 2.3.
fn step_invariant(
    clock: &Clock,
    filter: &Filter,
    of: &Polynomials,
    e: &str,
    memory: Memory<'_>,
) -> Result<Difference, StudyError> {
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
    // Coefficients in the time unit of a period.
    let numbers = |list: &[Formula]| {
        let power = |index: usize| i32::try_from(list.len() - 1 - index).expect("a short list");
        let scaled = |(index, formula)| number(formula).map(|c| c / math::powi(period, power(index)));
        list.iter().enumerate().map(scaled).collect::<Result<Vec<f64>, _>>()
    };
    let continuous = TransferFunction::new(numbers(&of.numerator)?, numbers(&of.denominator)?);
    let system = continuous.state_space().map_err(|why| StudyError::new("continuous", why))?;
    let n = system.order();
    // The exponential of [A B; 0 0] has the matrices of the sampled system in its upper rows.
    let mut both = DMatrix::zeros(n + 1, n + 1);
    both.view_mut((0, 0), (n, n)).copy_from(&system.a);
    both.view_mut((0, n), (n, 1)).copy_from(&system.b);
    let change = exponential_m1(&both);
    let sum = |row: &dyn Fn(usize) -> f64| {
        let name = |j: usize| if j < n { memory(j + 1) } else { e.to_owned() };
        let terms = (0..=n).filter(|&j| row(j) != 0.0).map(|j| format!("({:?})*{}", row(j), name(j)));
        terms.collect::<Vec<_>>().join(" + ")
    };
    let next = |i: usize| match sum(&|j| change[(i, j)]) {
        sum if sum.is_empty() => memory(i + 1),
        sum => format!("{} + ({sum})", memory(i + 1)),
    };
    let value = match sum(&|j| if j < n { system.c[(0, j)] } else { system.d[(0, 0)] }) {
        sum if sum.is_empty() => format!("0*{e}"),
        sum => sum,
    };
    Ok(Difference { next: (0..n).map(next).collect(), value })
}
