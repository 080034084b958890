//! Parameters of effects with their standard errors and intervals.

use mops_core::Model;
use mops_outcome::diagnosis::StrengthValue;

use crate::estimation::{ErrorModel, Estimate, FALL, ITERATIONS};
use crate::fit::{Added, Global, Sets, Variant, problem, whole};
use crate::records::Subject;
use crate::selection::{FittedSet, estimation};

/// Standard normal quantile at 0.975.
const QUANTILE: f64 = 1.959_964;

/// Returns the parameters of an effect of a set: values from least squares, standard errors and intervals from the
/// likeliest error model. An interval holds both estimates; a parameter at a bound has none.
pub fn strengths(set: &FittedSet<'_>, index: usize) -> Vec<StrengthValue> {
    let added = &set.start_at(&set.least_squares.point).added[index];
    let likeliest = set.likeliest().map(|(_, likeliest)| likeliest);
    let mut all = described(added, &set.variant, index);
    for (k, value) in all.iter_mut().enumerate() {
        let parameter = set.variant.first[index] + k;
        let Some(g) = set.fit.globals.iter().position(|global| global.sets == Sets::Parameter(parameter)) else {
            if added.candidate.effect.parameters()[k].fixed {
                value.interval95 = allowed(set, index, k);
            }
            continue;
        };
        let global = &set.fit.globals[g];
        value.at_bound = global.bounds.contains(&value.value);
        if global.is_stepped() {
            let output = set.under.iter().find(|(kind, _)| *kind != ErrorModel::Force).map(|(_, estimate)| estimate);
            let ends = output.and_then(|estimate| set.estimation(&[]).stepped_interval(estimate, g));
            value.interval95 = ends.map(|[low, high]| [low.min(value.value), high.max(value.value)]);
            continue;
        }
        let Some(estimate) = likeliest else { continue };
        value.interval95 = interval(global, value.value, estimate, g);
        value.std_error = value.interval95.map(|_| estimate.deviations[g]);
    }
    all
}

/// Returns the 95 % confidence interval of a parameter under an error model, widened to one as wide about the value by
/// least squares; `None` at a bound, or if the records do not determine it.
pub fn interval(global: &Global, value: f64, estimate: &Estimate, index: usize) -> Option<[f64; 2]> {
    let (centre, error) = (estimate.point.globals[index], estimate.deviations[index]);
    let is_at_bound = global.bounds.contains(&centre) || global.bounds.contains(&value);
    let end = |from: f64, side: f64| (from + side * QUANTILE * error).clamp(global.bounds[0], global.bounds[1]);
    (error > 0.0 && error.is_finite() && !is_at_bound)
        .then(|| [end(centre.min(value), -1.0), end(centre.max(value), 1.0)])
}

/// Returns the range of the values of a parameter that no fit moves that the records allow, everything else fitted
/// again; `None` if only one is allowed.
fn allowed(set: &FittedSet<'_>, index: usize, k: usize) -> Option<[f64; 2]> {
    let outputs = set.under.iter().filter(|(kind, _)| *kind != ErrorModel::Force);
    let (_, estimate) = outputs.max_by(|a, b| a.1.log_likelihood.total_cmp(&b.1.log_likelihood))?;
    let mut start = set.start_at(&estimate.point);
    let added = &start.added[index];
    let parameter = &added.candidate.effect.parameters()[k];
    let values = added.sizes.values(parameter.dimension, parameter.grid, parameter.bounds);
    let mut range = [added.strengths[k]; 2];
    for value in values {
        start.added[index].strengths[k] = value;
        let pieces = set.fit.pieces.iter().map(|piece| piece.measurement);
        let subject = set.fit.subject;
        let pieces = pieces.map(|index| whole(index, &subject.measurements[index])).collect();
        let (fit, point, variant) =
            problem(subject, &start.added, pieces, &start.tuners, start.locals.clone(), &[], set.fit.simulations);
        let estimation = estimation(subject, &fit, &variant, &start.added, &[], &point);
        let Some(found) = estimation.with(&estimate.errors, point, ITERATIONS / 2) else { continue };
        if found.log_likelihood > estimate.log_likelihood - FALL {
            range = [range[0].min(value), range[1].max(value)];
        }
    }
    (range[0] < range[1]).then_some(range)
}

/// Returns the parameters of a candidate at its guess.
pub fn of_candidate(subject: &Subject, added: &Added) -> Vec<StrengthValue> {
    described(added, &Variant::new(subject, std::slice::from_ref(added), &[]), 0)
}

fn described(added: &Added, variant: &Variant, index: usize) -> Vec<StrengthValue> {
    let parameters = &variant.model.interface().parameters;
    let of = |(k, parameter): (usize, &mops_core::effect::EffectParameter)| StrengthValue {
        name: parameter.name.to_owned(),
        value: added.strengths[k],
        unit: added.candidate.unit(parameter, &parameters[variant.first[index] + k].variable.unit),
        std_error: None,
        interval95: None,
        at_bound: false,
    };
    added.candidate.effect.parameters().iter().enumerate().map(of).collect()
}
