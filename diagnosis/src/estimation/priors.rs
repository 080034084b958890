//! Priors of the unknowns of an augmented model, and nominal rates.

use std::f64::consts::TAU;

use mops_core::{
    Job,
    effect::{Dimension, ParameterKind, Port},
};
use mops_math as math;

use super::estimate::Prior;
use crate::fit::{Added, Fit, Global, Point, Sets, Variant};
use crate::motion::Trajectory;
use crate::records::{Local, Subject};

/// Standard deviation of a uniform distribution in its width: `1/sqrt(12)`.
const UNIFORM: f64 = 0.288_675_134_594_812_9;

/// Returns the priors of the shared parameters, then of the initial states of each record, near a point. A force is
/// expected to be as large as those that move the plant as it is there: the rate that a typical force adds is the same
/// wherever the plant is.
pub fn priors(subject: &Subject, fit: &Fit<'_>, variant: &Variant, added: &[Added], point: &Point) -> Vec<Prior> {
    let parameters = fit.parameters(0, point);
    let piece = &fit.pieces[0];
    let job = Job { case: &piece.case, parameters: &parameters, signals: &[], horizon: piece.horizon };
    let mobilities = variant.model.mobilities(&job).unwrap_or_default();
    // Ratio of a typical force at the point to that for which the sizes of an effect were determined.
    let heavier = |added: &Added| {
        let here = force_of(&added.candidate.port, variant).and_then(|force| mobilities.get(force));
        let ratio = here.map_or(1.0, |here| added.sizes.mobility / here.abs());
        if ratio.is_finite() && ratio > 0.0 { ratio } else { 1.0 }
    };
    let at_centre = |stretch, deviation| Prior { stretch, deviation, centre: None, half: false };
    let declared = |k: usize, global: &Global| {
        let stretch = if global.log { subject.start()[k].abs() } else { global.scale };
        at_centre(stretch, subject.settings.declared_prior)
    };
    let of_effect = |parameter: usize, value: f64| {
        let index =
            variant.first.iter().rposition(|&first| first <= parameter).expect("parameters of effects come last");
        let (added, position) = (&added[index], parameter - variant.first[index]);
        let of = &added.candidate.effect.parameters()[position];
        let is_sensor = matches!(added.candidate.port, Port::Sensor { .. });
        let about_null = |size: f64, deviation| Prior {
            stretch: size,
            deviation,
            centre: of.null_value,
            half: of.null_value.is_some_and(|null| of.bounds.contains(&null)),
        };
        // Not narrower than the smallest size that is tried: a shape of next to nothing has a price, too.
        let typical = || {
            let tried = added.sizes.values(of.dimension, of.grid, added.sizes.bounds(of));
            let least = tried.into_iter().map(f64::abs).filter(|size| *size > 0.0).fold(f64::INFINITY, f64::min);
            value.abs().max(if least.is_finite() { least } else { f64::MIN_POSITIVE })
        };
        match of.kind {
            ParameterKind::Steepness => at_centre(typical(), subject.settings.strength_prior),
            ParameterKind::Strength if of.null_value == Some(0.0) => match of.dimension {
                Dimension::ONE => about_null(1.0, subject.settings.gain_prior),
                Dimension::TIME => about_null(added.sizes.lag(), 1.0),
                Dimension::OUTPUT if is_sensor => {
                    about_null(added.sizes.range[1] - added.sizes.range[0], subject.settings.offset_prior)
                }
                dimension => {
                    let scale = math::powi(heavier(added), dimension.output.into());
                    about_null(added.sizes.of(dimension).abs() * scale, subject.settings.strength_prior)
                }
            },
            ParameterKind::Damping => Prior { centre: Some(0.0), half: true, ..at_centre(added.sizes.time, 1.0) },
            ParameterKind::Phase => at_centre(TAU, UNIFORM),
            ParameterKind::Instant => at_centre(added.sizes.record, UNIFORM),
            ParameterKind::Frequency => at_centre(added.sizes.highest_frequency(), UNIFORM),
            // A limit that vanishes at infinity lies somewhere in the range, too.
            ParameterKind::Level | ParameterKind::LowerEdge | ParameterKind::UpperEdge | ParameterKind::Strength => {
                at_centre(added.sizes.range[1] - added.sizes.range[0], UNIFORM)
            }
            ParameterKind::Shape
            | ParameterKind::Zero
            | ParameterKind::BuildUp
            | ParameterKind::WaveNumber
            | ParameterKind::Duration => at_centre(typical(), subject.settings.shape_prior),
        }
    };
    let shared = fit.globals.iter().zip(&point.globals).map(|(global, &value)| match global.sets {
        Sets::Tuner(k) => declared(k, global),
        Sets::Parameter(parameter) => of_effect(parameter, value),
    });
    let start = |local: &Local| at_centre(local.scale, subject.settings.start_prior);
    shared.chain(fit.pieces.iter().flat_map(|piece| &piece.locals).map(start)).collect()
}

/// Returns the position of the force at a port among the forces of a model; `None` at inputs and sensors.
fn force_of(port: &Port, variant: &Variant) -> Option<usize> {
    let acts_on = match port {
        Port::Joint { velocity, .. } => velocity,
        Port::Speed { state, .. } | Port::Process { state, .. } => state,
        Port::Actuator { .. } | Port::Sensor { .. } => return None,
    };
    let processes = variant.model.model().interface().ports.iter().filter_map(|port| match port {
        Port::Process { state, .. } => Some(state),
        _ => None,
    });
    processes.into_iter().position(|state| state == acts_on)
}

/// Returns the nominal rate of each balance of a model, in the order of its forces: the root mean square along the
/// motion.
#[allow(clippy::cast_precision_loss)]
pub fn nominal_rates(variant: &Variant, trajectories: &[Trajectory]) -> Vec<f64> {
    let ports = &variant.model.model().interface().ports;
    let states = variant.model.model().equation_states();
    let balances = ports.iter().filter_map(|port| match port {
        Port::Process { state, .. } => states.iter().position(|s| s.name == *state),
        _ => None,
    });
    let rms = |state: usize| {
        let squares: Vec<f64> =
            trajectories.iter().flat_map(|t| &t.moments).map(|m| m.rates[state] * m.rates[state]).collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    };
    balances.map(rms).map(|rate| if rate > 0.0 { rate } else { 1.0 }).collect()
}

/// Returns the logarithm of the number of combinations of grid values of the parameters that no fit moves.
#[allow(clippy::cast_precision_loss)]
pub fn log_choices(added: &[Added]) -> f64 {
    let of = |added: &Added| -> f64 {
        let parameters = added.candidate.effect.parameters().iter();
        let chosen = parameters.filter(|p| p.fixed || p.grid.jumps());
        chosen.map(|p| math::ln(added.sizes.values(p.dimension, p.grid, p.bounds).len().max(1) as f64)).sum()
    };
    added.iter().map(of).sum()
}
