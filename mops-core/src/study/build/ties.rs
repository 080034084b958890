//! Dimensions of the expressions of tied tuners.

use std::ops::Range;

use crate::expression::units::{Conflict, Dimensions, Measure, Open, Quantities};
use crate::expression::{Expression, Form, Node};
use crate::study::draft::Mistake;
use crate::tuner::Tuner;

/// Checks that an expression measures what the tuner `name` does, which it sets. Tuners that are `loose` have no unit, neither
/// their own nor that of a parameter.
pub(super) fn check(
    expression: &Expression,
    name: &str,
    tuners: &[Tuner],
    loose: &dyn Fn(&str) -> bool,
) -> Result<(), Mistake> {
    let mut dimensions = Dimensions::default();
    let mut measure = |tuner: &Tuner| match loose(&tuner.parameter) {
        true => dimensions.open(&tuner.parameter),
        false => Measure::declared(&tuner.parameter, &tuner.unit),
    };
    let mut tied = Tied(tuners.iter().map(|tuner| (tuner.parameter.clone(), measure(tuner))).collect());
    let Some(wanted) = tied.of(name) else { return Ok(()) };
    dimensions.fits(&mut tied, &wanted, expression.root(), "a tied tuner has the dimension of its expression")
}

/// Tuners by name, and what they measure.
struct Tied(Vec<(String, Measure)>);

impl Tied {
    fn of(&self, name: &str) -> Option<Measure> {
        self.0.iter().find(|(known, _)| known == name).map(|(_, measure)| measure.clone())
    }
}

impl Quantities for Tied {
    type Error = Mistake;

    fn measure(&mut self, _: &mut Dimensions, node: &Node) -> Result<Measure, Mistake> {
        let Form::Name(name) = &node.form else { unreachable!("the reader takes names only") };
        Ok(self.of(name).expect("names were checked"))
    }

    fn constant(&self, _: &str) -> Option<f64> {
        None
    }

    fn counts(&mut self, _: String, _: Range<usize>, _: Open) {}

    fn refuse(&self, Conflict { span, fact, help }: Conflict) -> Mistake {
        Mistake::here(fact).with_help(help).at(span)
    }
}
