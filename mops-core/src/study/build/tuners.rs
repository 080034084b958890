//! Tuners, their ties, and free initial states.

use mops_language::{Expression, Quantity, Unit, suggestion};
use mops_math as math;

use super::models::Models;
use super::values::{check_range, converted, names, parameter};
use crate::case::{Case, Channel, Experiment, Role};
use crate::model::Parameter;
use crate::study::draft::{Free, TunerBuilder};
use crate::study::tuner::ratio_of_temperatures;
use crate::study::{Grid, Scale, StudyError, Tuner, matches_pattern};

/// Adds the tuner, or one for every case.
pub(super) fn build_tuner(
    name: &str,
    draft: &TunerBuilder,
    models: &Models,
    cases: &[Case],
    tuners: &mut Vec<Tuner>,
) -> Result<(), StudyError> {
    let known: Vec<&Parameter> = models.iter().flat_map(|(_, m)| &m.interface().parameters).collect();
    let parameter = known.iter().find(|p| p.variable.name == name).copied();
    let unit = unit_of(name, draft, parameter)?;
    let allowed = Allowed::of(draft, &unit)?;
    let elsewhere = own_starts(draft, cases, |case, quantity| {
        let start = in_unit(draft, quantity, &unit).map_err(|m| m.within(case))?;
        allowed.check_start(case, start, &unit)?;
        if allowed.is_fixed || allowed.grid.has(start) {
            return Ok(start);
        }
        Err(StudyError::new(case, format!("{} is not an allowed value of the tuner", unit.amount(start)))
            .with_help("start at an integer, or at one of `values`"))
    })?;
    allowed.check_scale(name, draft.scale, &unit)?;
    if let Some(parameter) = parameter {
        let factor = unit.factor_to(&parameter.variable.unit).expect("units are compatible");
        for (key, bound) in ["min", "max"].into_iter().zip(allowed.bounds) {
            if bound.is_finite() {
                check_range(bound * factor, parameter).map_err(|m| m.within(key))?;
            }
        }
    }
    let Allowed { start, bounds, grid, is_fixed } = allowed;
    let tuner = Tuner {
        name: name.to_owned(),
        parameter: name.to_owned(),
        start,
        bounds,
        scale: draft.scale,
        grid,
        unit,
        case: None,
        active: !is_fixed,
        tie: None,
        guessed: [false; 2],
    };
    let mut separate = separate_in(draft, cases)?;
    // A common value of experiments that estimate nothing would be free: each has its own, from its own data.
    let others = || (0..cases.len()).filter(|case| !separate.contains(case));
    if !separate.is_empty() && others().all(|case| cases[case].role() != Role::Calibration) {
        separate.extend(others().collect::<Vec<_>>());
    }
    if separate.is_empty() || separate.len() < cases.len() {
        tuners.push(tuner.clone());
    }
    for (index, case) in cases.iter().enumerate().filter(|(index, _)| separate.contains(index)) {
        let start = elsewhere.iter().find(|(known, _)| *known == index).map_or(start, |&(_, start)| start);
        tuners.push(Tuner { name: format!("{}/{name}", case.name), case: Some(index), start, ..tuner.clone() });
    }
    Ok(())
}

/// Returns the unit of the tuner of a parameter, if there is one of this name.
fn unit_of(name: &str, draft: &TunerBuilder, parameter: Option<&Parameter>) -> Result<Unit, StudyError> {
    Ok(match (&draft.unit, parameter) {
        (Some(unit), Some(p)) if !unit.is_compatible(&p.variable.unit) => {
            return Err(StudyError::new(
                "unit",
                format!("expected a unit of `{name}` that converts to `{}`, found `{unit}`", p.variable.unit),
            )
            .with_help("correct `unit`, or omit it"));
        }
        // A tuner is its parameter times a factor, in ties too. A temperature on another scale, or a frequency in Hz
        // for a parameter in rad/s, therefore takes the unit of the parameter.
        (Some(unit), Some(p))
            if unit.zero() != p.variable.unit.zero() || unit.counts_cycles() != p.variable.unit.counts_cycles() =>
        {
            p.variable.unit.clone()
        }
        (Some(unit), Some(p)) => unit.clone().of_quantity_in(&p.variable.unit),
        (Some(unit), None) => unit.clone(),
        (None, Some(p)) => p.variable.unit.clone(),
        (None, None) => Unit::one(),
    })
}

/// Returns a quantity in the unit of the tuner. A number without a unit is in the unit that the draft gives, even on
/// another temperature scale.
fn in_unit(draft: &TunerBuilder, quantity: &Quantity, unit: &Unit) -> Result<f64, StudyError> {
    let own = quantity.unit.clone().or_else(|| draft.unit.clone());
    converted(&Quantity { unit: own, ..quantity.clone() }, unit)
}

/// Values that a tuner may have.
struct Allowed {
    /// Initial guess; NaN for a tied tuner.
    start: f64,
    bounds: [f64; 2],
    grid: Grid,
    /// True for a tuner that no solver changes.
    is_fixed: bool,
}

impl Allowed {
    /// Returns the values that a draft allows, in the unit of the tuner.
    fn of(draft: &TunerBuilder, unit: &Unit) -> Result<Self, StudyError> {
        let value = |key: &str, quantity: &Option<Quantity>| -> Result<Option<f64>, StudyError> {
            let Some(quantity) = quantity else { return Ok(None) };
            let value = in_unit(draft, quantity, unit).map_err(|m| m.within(key))?;
            if value.is_finite() {
                Ok(Some(value))
            } else {
                Err(StudyError::new(key, format!("`{key}` must be a finite number, not {value}"))
                    .with_help("every tuner needs finite bounds"))
            }
        };
        let (start, mut min, mut max) =
            (value("start", &draft.start)?, value("min", &draft.min)?, value("max", &draft.max)?);
        let mut grid = if draft.integer { Grid::Integer } else { Grid::Continuous };
        if let Some(list) = &draft.values {
            let values = listed(draft, list, unit)?;
            (min, max) = (values.first().copied(), values.last().copied());
            grid = Grid::List(values);
        }
        if let (Some(_), Some((key, _))) =
            (&draft.tie, [("start", start), ("min", min), ("max", max)].iter().find(|(_, v)| v.is_some()))
        {
            return Err(StudyError::new(*key, format!("`{key}` is not allowed for a tied tuner"))
                .with_help(format!("remove `{key}`, or remove `tie`")));
        }
        let is_fixed = draft.inactive || draft.tie.is_some();
        let missing = |fact: &str, help: &str| Err(StudyError::here(fact).with_help(help));
        let start = match (start, &draft.tie) {
            (Some(start), _) => start,
            (None, Some(_)) => f64::NAN,
            (None, None) => return missing("the tuner has no initial guess", "add `start = ...`"),
        };
        let bounds = match (min, max) {
            (Some(min), Some(max)) => [min, max],
            _ if is_fixed => [min.unwrap_or(f64::NEG_INFINITY), max.unwrap_or(f64::INFINITY)],
            (None, Some(_)) => return missing("the tuner has no lower bound", "add `min = ...`"),
            (Some(_), None) => return missing("the tuner has no upper bound", "add `max = ...`"),
            (None, None) => return missing("the tuner has no bounds", "add `min = ...` and `max = ...`"),
        };
        let allowed = Self { start, bounds, grid, is_fixed };
        allowed.check(unit)?;
        Ok(allowed)
    }

    /// Checks that the range is not empty, and that it contains the initial guess.
    fn check(&self, unit: &Unit) -> Result<(), StudyError> {
        let [min, max] = self.bounds;
        if max <= min {
            let fact = format!("the range is empty: min is {min}, max is {max}");
            return Err(StudyError::new("max", fact).with_help(if max < min {
                "swap the bounds"
            } else {
                "widen the range, or set `active = false` to keep the value"
            }));
        }
        self.check_start("start", self.start, unit)?;
        let off_grid = match &self.grid {
            Grid::Continuous => None,
            Grid::Integer => {
                let is_fraction = |(_, value): &(&str, f64)| value.fract() != 0.0;
                let found = [("start", self.start), ("min", min), ("max", max)].into_iter().find(is_fraction);
                found.map(|(key, value)| {
                    (key, value, "with `integer = true`, `start`, `min` and `max` must be integers")
                })
            }
            Grid::List(values) => {
                (!values.contains(&self.start)).then_some(("start", self.start, "start at one of `values`"))
            }
        };
        if let Some((key, value, way_out)) = off_grid.filter(|_| !self.is_fixed) {
            return Err(StudyError::new(key, format!("{} is not an allowed value of the tuner", unit.amount(value)))
                .with_help(way_out));
        }
        Ok(())
    }

    /// Checks that the bounds contain an initial guess, which stands under this key.
    fn check_start(&self, key: &str, start: f64, unit: &Unit) -> Result<(), StudyError> {
        let [min, max] = self.bounds;
        if self.is_fixed || (min..=max).contains(&start) {
            return Ok(());
        }
        let (start, max) = (unit.amount(start), unit.amount(max));
        Err(StudyError::new(key, format!("the initial guess {start} is outside the bounds, {min} to {max}"))
            .with_help("correct it, or widen the bounds"))
    }

    /// Checks that the range has a logarithm if its scale is logarithmic, and a width.
    fn check_scale(&self, name: &str, scale: Scale, unit: &Unit) -> Result<(), StudyError> {
        let [min, max] = self.bounds;
        if scale == Scale::Log && min <= 0.0 && max >= 0.0 {
            return Err(StudyError::new("scale", format!("a logarithmic range must exclude zero, but `min` is {min}"))
                .with_help("raise `min`, or omit `scale`"));
        }
        if scale == Scale::Log && unit.zero() != 0.0 {
            return Err(StudyError::new("scale", ratio_of_temperatures(name, unit))
                .with_help("omit `scale`, or declare the parameter in K"));
        }
        let width = if scale == Scale::Log { math::ln(max / min) } else { max - min };
        if !self.is_fixed && !width.is_finite() {
            return Err(StudyError::new("max", format!("the range from {min:e} to {max:e} overflows"))
                .with_help("narrow the bounds to plausible values"));
        }
        Ok(())
    }
}

/// Returns the listed values in ascending order, each once.
fn listed(draft: &TunerBuilder, list: &[Quantity], unit: &Unit) -> Result<Vec<f64>, StudyError> {
    let values = list.iter().map(|quantity| in_unit(draft, quantity, unit).map_err(|m| m.within("values")));
    let mut values: Vec<f64> = values.collect::<Result<_, _>>()?;
    values.sort_by(f64::total_cmp);
    values.dedup();
    if values.len() < 2 {
        return Err(StudyError::new("values", "a tuner needs at least two different values")
            .with_help("add values, or set `active = false` to keep the only one"));
    }
    Ok(values)
}

/// Returns the cases with a separate tuner, by index.
fn separate_in(draft: &TunerBuilder, cases: &[Case]) -> Result<Vec<usize>, StudyError> {
    if draft.per_case {
        return Ok((0..cases.len()).collect());
    }
    let mut found = Vec::new();
    for pattern in &draft.separate_in {
        let matching: Vec<usize> =
            (0..cases.len()).filter(|&case| matches_pattern(pattern, &cases[case].name)).collect();
        if matching.is_empty() {
            let fact = format!("there is no case or experiment `{pattern}`");
            return Err(StudyError::new("per-case", fact)
                .with_help(suggestion(pattern, cases.iter().map(|case| case.name.as_str()))));
        }
        found.extend(matching);
    }
    Ok(found)
}

/// Returns the initial guesses of single cases, by index of the case.
fn own_starts(
    draft: &TunerBuilder,
    cases: &[Case],
    value: impl Fn(&str, &Quantity) -> Result<f64, StudyError>,
) -> Result<Vec<(usize, f64)>, StudyError> {
    let separate = separate_in(draft, cases)?;
    if !draft.starts.is_empty() && separate.is_empty() {
        return Err(StudyError::new("starts", "the tuner has one value for all cases")
            .with_help("set `per-case = true` too, or omit `starts`"));
    }
    let one = |(name, quantity): &(String, Quantity)| {
        let index = cases.iter().position(|case| case.name == *name).ok_or_else(|| {
            StudyError::new(name, format!("there is no case or experiment `{name}`"))
                .with_help(suggestion(name, cases.iter().map(|case| case.name.as_str())))
        })?;
        if !separate.contains(&index) {
            return Err(StudyError::new(name, format!("the tuner has no separate value in `{name}`"))
                .with_help("list it in `per-case`, or omit it here"));
        }
        Ok((index, value(name, quantity)?))
    };
    draft.starts.iter().map(|entry| one(entry).map_err(|mistake: StudyError| mistake.within("starts"))).collect()
}

/// Checks that every tuner sets a parameter or is used by one that does.
pub(super) fn check_use(drafts: &[(String, TunerBuilder)], models: &Models) -> Result<(), StudyError> {
    let known: Vec<&str> = models.iter().flat_map(|(_, m)| names(&m.interface().parameters)).collect();
    let ties: Vec<Expression> =
        drafts.iter().filter_map(|(_, draft)| Expression::parse(draft.tie.as_ref()?).ok()).collect();
    for (name, _) in drafts {
        let followed = ties.iter().any(|tie| tie.names().contains(name));
        if !followed && !known.contains(&name.as_str()) {
            return Err(StudyError::new(name, format!("no model has a parameter `{name}`"))
                .with_help(suggestion(name, known.iter().copied()))
                .within("tuners"));
        }
    }
    Ok(())
}

/// Binds the expressions of tied tuners, in an order in which each expression uses earlier tuners only.
pub(super) fn tie_tuners(
    drafts: &[(String, TunerBuilder)],
    tuners: &mut [Tuner],
    models: &Models,
) -> Result<(), StudyError> {
    let parameters: Vec<&str> = models.iter().flat_map(|(_, m)| names(&m.interface().parameters)).collect();
    for (position, (name, draft)) in drafts.iter().enumerate() {
        let Some(text) = &draft.tie else { continue };
        let wrong =
            |message: String, help: &str| StudyError::new("tie", message).with_help(help).within(name).within("tuners");
        let expression = Expression::parse(text).map_err(|e| wrong(e.message, "as in tie = \"2*Ti + 0.1\""))?;
        let mut of = Vec::new();
        for used in expression.names() {
            let earlier: Vec<&str> = drafts[..position].iter().map(|(n, _)| n.as_str()).collect();
            if used == name {
                return Err(wrong("a tuner cannot be tied to itself".to_owned(), "use tuners defined before it"));
            }
            if drafts[position..].iter().any(|(n, _)| n == used) {
                let fact = format!("`{used}` is defined after this tuner");
                return Err(wrong(fact, &format!("a tie uses tuners defined before it: move `{used}` up")));
            }
            if !earlier.contains(&used.as_str()) {
                return Err(wrong(format!("there is no tuner `{used}`"), &suggestion(used, earlier.iter().copied())));
            }
            of.push(tuners.iter().position(|t| t.name == *used).ok_or_else(|| {
                wrong(format!("`{used}` has a separate value in every case"), "tie to tuners of the whole study")
            })?);
        }
        let loose = |name: &str| {
            let draft = drafts.iter().find(|(known, _)| known == name).map(|(_, draft)| draft);
            draft.is_some_and(|draft| draft.unit.is_none()) && !parameters.contains(&name)
        };
        super::ties::check(&expression, name, tuners, &loose)
            .map_err(|m| m.within("tie").within(name).within("tuners"))?;
        for tuner in tuners.iter_mut().filter(|t| t.parameter == *name) {
            tuner.tie = Some((expression.clone(), of.clone()));
        }
    }
    Ok(())
}

/// Returns the tuner of a free initial state; the initial guess and bounds are derived from the data if the study gives
/// none.
pub(super) fn free_start(free: &Free, index: usize, case: &Case, models: &Models) -> Result<Tuner, StudyError> {
    let states: Vec<_> = models.iter().flat_map(|(_, m)| m.interface().states.iter().map(move |s| (m, s))).collect();
    let (model, state) = states.iter().find(|(_, s)| s.name == free.state).ok_or_else(|| {
        StudyError::new(&free.state, format!("no model has a state `{}`", free.state))
            .with_help(suggestion(&free.state, states.iter().map(|(_, s)| s.name.as_str())))
    })?;
    let parameter =
        parameter(&model.interface().parameters, &state.start).expect("a state's initial value is a parameter");
    let unit = parameter.variable.unit.clone();
    let given = |key: &str, q: &Option<Quantity>| -> Result<Option<f64>, StudyError> {
        let Some(q) = q else { return Ok(None) };
        let value = converted(q, &unit).map_err(|m| m.within(key).within(&free.state))?;
        if value.is_finite() {
            return Ok(Some(value));
        }
        Err(StudyError::new(key, format!("`{key}` must be a finite number, not {value}")).within(&free.state))
    };
    let (start, min, max) = (given("start", &free.start)?, given("min", &free.min)?, given("max", &free.max)?);
    let in_case = case.parameters.iter().find(|(name, _)| *name == state.start).map(|(_, value)| *value);
    let experiment = case.experiment.as_ref().expect("only experiments have free initial states");
    let guess = guess_start(state.signal.as_deref(), state.rate_of.as_deref(), experiment);
    let (start, spread) = match (start.or(in_case), guess) {
        (Some(start), Some((_, spread))) => (start, spread),
        (None, Some(guess)) => guess,
        (start, None) if min.is_some() && max.is_some() => {
            (start.unwrap_or(0.5 * (min.unwrap_or(0.0) + max.unwrap_or(0.0))), 0.0)
        }
        _ => {
            let late =
                state.signal.as_deref().and_then(|s| experiment.channel(s)).filter(|channel| begins_late(channel));
            let fact = match late {
                Some(channel) => format!(
                    "the first sample of `{}` is at {} s and does not determine its value at 0 s",
                    channel.signal, channel.times[0]
                ),
                None => format!("the initial value of `{}` is not determined by any measurement", free.state),
            };
            return Err(StudyError::new(&free.state, fact)
                .with_help(format!("write free = {{ {} = {{ start = ..., min = ..., max = ... }} }}", free.state)));
        }
    };
    let [low, high] = parameter.range;
    let bounds = [min.unwrap_or((start - spread).max(low)), max.unwrap_or((start + spread).min(high))];
    if bounds[0] >= bounds[1] || !(bounds[0]..=bounds[1]).contains(&start) {
        return Err(StudyError::new(
            &free.state,
            format!(
                "the initial guess {} is outside its bounds, {} to {}",
                unit.amount(start),
                bounds[0],
                unit.amount(bounds[1])
            ),
        )
        .with_help("correct `start`, `min` and `max`; omitted values are derived from the data"));
    }
    Ok(Tuner {
        name: format!("{}/{}", case.name, state.start),
        parameter: state.start.clone(),
        start,
        bounds,
        scale: Scale::Linear,
        grid: Grid::Continuous,
        unit,
        case: Some(index),
        active: true,
        tie: None,
        guessed: [min.is_none(), max.is_none()],
    })
}

/// Returns true if the first sample comes more than 1.5 intervals after the start of the simulation at 0 s.
fn begins_late(channel: &Channel) -> bool {
    matches!(channel.times[..], [first, second, ..] if first > 1.5 * (second - first))
}

/// Returns the initial guess and half-width of the search for an initial state. For a measured state: its first sample
/// and half its range. For the rate of a measured signal: its derivative over the first samples and 1.5 times its
/// largest derivative.
fn guess_start(signal: Option<&str>, rate_of: Option<&str>, experiment: &Experiment) -> Option<(f64, f64)> {
    let measured = |name: &str| experiment.channel(name).filter(|channel| !begins_late(channel));
    if let Some(channel) = signal.and_then(measured) {
        let (min, max) = channel.values.iter().fold((f64::MAX, f64::MIN), |(a, b), &v| (a.min(v), b.max(v)));
        let floor = 4.0 * channel.noise.unwrap_or(0.0) + 1e-6 * max.abs().max(min.abs());
        return Some((channel.values[0], (0.5 * (max - min)).max(floor).max(f64::MIN_POSITIVE)));
    }
    let channel = rate_of.and_then(measured)?;
    let slope = |i: usize, j: usize| (channel.values[j] - channel.values[i]) / (channel.times[j] - channel.times[i]);
    let n = channel.values.len();
    let span = (n - 1).min(3);
    let largest = (0..n - span).map(|i| slope(i, i + span).abs()).fold(0.0, f64::max);
    Some((slope(0, span), (1.5 * largest).max(f64::MIN_POSITIVE)))
}
