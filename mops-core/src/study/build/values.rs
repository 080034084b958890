//! Names, units and ranges of single values.

use mops_language::{Quantity, Unit, suggestion};

use crate::error::StudyError;
use crate::model::{Parameter, Variable};
use crate::study::draft::CaseBuilder;

pub(super) fn section(case: &CaseBuilder) -> &'static str {
    if case.measured.is_some() { "experiments" } else { "cases" }
}

pub(super) fn parameter<'a>(parameters: &'a [Parameter], name: &str) -> Option<&'a Parameter> {
    parameters.iter().find(|p| p.variable.name == name)
}

pub(super) fn names(parameters: &[Parameter]) -> impl Iterator<Item = &str> + Clone {
    parameters.iter().map(|p| p.variable.name.as_str())
}

pub(super) fn signal_names(signals: &[Variable]) -> impl Iterator<Item = &str> + Clone {
    signals.iter().map(|s| s.name.as_str())
}

pub(super) fn check_horizon(end: Option<f64>) -> Result<(), StudyError> {
    match end {
        Some(end) if !(end.is_finite() && end > 0.0) => {
            Err(StudyError::new("horizon", format!("expected a positive horizon, found {end} s"))
                .with_help("a simulation starts at 0 s; give its end time, such as \"60 s\""))
        }
        _ => Ok(()),
    }
}

/// Returns the parameter values of a model that the study fixes, in the units of the parameters.
pub(super) fn fixed_values(
    given: &[(String, Quantity)],
    known: &[Parameter],
) -> Result<Vec<(String, f64)>, StudyError> {
    given
        .iter()
        .map(|(name, quantity)| {
            let parameter = parameter(known, name).ok_or_else(|| {
                StudyError::new(name, format!("the model has no parameter `{name}`"))
                    .with_help(suggestion(name, names(known)))
            })?;
            Ok((name.clone(), in_range(quantity, parameter).map_err(|m| m.within(name))?))
        })
        .collect()
}

/// Returns the value of a parameter, in its unit.
pub(super) fn in_range(quantity: &Quantity, parameter: &Parameter) -> Result<f64, StudyError> {
    let value = converted(quantity, &parameter.variable.unit)?;
    check_range(value, parameter)?;
    Ok(value)
}

pub(super) fn check_range(value: f64, parameter: &Parameter) -> Result<(), StudyError> {
    let [low, high] = parameter.range;
    if (low..=high).contains(&value) && (value.is_finite() || parameter.infinite) {
        return Ok(());
    }
    let Variable { name, unit, about } = &parameter.variable;
    let wanted = if (low..=high).contains(&value) {
        "be finite".to_owned()
    } else if high < f64::INFINITY {
        format!("lie between {low} and {}", unit.amount(high))
    } else if low == 0.0 {
        "not be negative".to_owned()
    } else if low == f64::MIN_POSITIVE {
        "be positive".to_owned()
    } else if low > f64::NEG_INFINITY {
        format!("be at least {}", unit.amount(low))
    } else {
        "be a number".to_owned()
    };
    Err(StudyError::here(format!("`{name}` must {wanted}, not {}", unit.amount(value)))
        .with_help(format!("`{name}` is: {about}")))
}

/// Returns the number in `unit`.
pub(super) fn converted(quantity: &Quantity, unit: &Unit) -> Result<f64, StudyError> {
    quantity.to(unit).map_err(|why| {
        let unit = unit.to_string();
        StudyError::here(why).with_help(match unit.as_str() {
            "1" => "write a pure number".to_owned(),
            _ => format!("a number without a unit is in `{unit}`"),
        })
    })
}
