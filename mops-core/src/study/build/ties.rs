//! Dimensions of the expressions of tied tuners.

use mops_language::{
    Expression,
    expression::units::{Conflict, Dimensions, Measure, Named},
};

use crate::study::{StudyError, Tuner};

/// Checks that an expression has the dimension of the tuner `name`, which it sets. Tuners that are `loose` have no
/// unit, neither their own nor that of a parameter.
pub(super) fn check(
    expression: &Expression,
    name: &str,
    tuners: &[Tuner],
    loose: &dyn Fn(&str) -> bool,
) -> Result<(), StudyError> {
    let mut dimensions = Dimensions::default();
    let mut measure = |tuner: &Tuner| match loose(&tuner.parameter) {
        true => dimensions.open(&tuner.parameter),
        false => Measure::declared(&tuner.parameter, &tuner.unit),
    };
    let mut tied = Named(tuners.iter().map(|tuner| (tuner.parameter.clone(), measure(tuner))).collect());
    let Some((_, wanted)) = tied.0.iter().find(|(known, _)| known == name).cloned() else { return Ok(()) };
    dimensions
        .fits(&mut tied, &wanted, expression.root(), "a tied tuner has the dimension of its expression")
        .map_err(|Conflict { span, fact, help }| StudyError::here(fact).with_help(help).at(span))
}
