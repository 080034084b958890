//! Where a residual comes from: at every place the unknown signal that would explain it, and how likely each is.
//!
//! The signal at a place is a Gaussian process, free over time or a function of what the place sees (position, speed,
//! input, time), or a sum of these; what the unknowns of the fit absorb is taken out. Places are compared by the marginal likelihood, which
//! pays for freedom: the right place needs the simplest signal. One place at a time, so that there are never more unknown
//! signals than outputs.
//!
//! Source: T. Rogers, T. Friis, A latent restoring force approach to nonlinear system identification, Mechanical Systems and
//! Signal Processing 180 (2022) 109426; here with knots instead of a state-space form.

use mops_core::effect::Port;
use mops_models::WithEffects;
use mops_outcome::diagnosis::{Curve, Evidence};
use nalgebra::DVector;
use rayon::prelude::*;

use crate::family::Over;
use crate::fit::Fit;
use crate::scene::Scene;
use crate::unknown::{Term, Unknown};

/// A place with the signal that is likeliest there.
pub struct Located {
    /// The place.
    pub port: Port,
    /// The signal.
    pub evidence: Evidence,
}

/// Logarithms of a likelihood that are this close count as the same: the place that the model names first is taken.
const SAME: f64 = 0.5;

/// All places where the residual may come from, best first.
pub fn locate(fit: &Fit<'_>, model: &WithEffects, scene: &Scene) -> Vec<Located> {
    let ports = &model.model().interface().ports;
    let places: Vec<&Port> = ports.iter().filter(|port| port.kind(ports).is_some()).collect();
    let mut all: Vec<Located> = places.into_par_iter().filter_map(|port| located(port, fit, model, scene)).collect();
    let best = all.iter().map(|l| l.evidence.evidence).fold(0.0, f64::max);
    let first = all.iter().position(|l| l.evidence.evidence > best - SAME);
    let first = first.map(|first| all.remove(first));
    all.sort_by(|a, b| b.evidence.evidence.total_cmp(&a.evidence.evidence));
    first.into_iter().chain(all).collect()
}

/// A choice of terms with its evidence and variance.
struct Choice {
    terms: Vec<Term>,
    evidence: f64,
    variance: f64,
}

fn choice(unknown: &Unknown, terms: Vec<Term>) -> Option<Choice> {
    let found = unknown.normals.likeliest(&unknown.prior(&terms)?);
    Some(Choice { terms, evidence: found.evidence, variance: found.variance })
}

/// The likelier; of two as likely the first.
fn better(a: Choice, b: Choice) -> Choice {
    if b.evidence > a.evidence { b } else { a }
}

/// A place with the signal that is likeliest there; `None` where none reaches the data.
pub fn located(port: &Port, fit: &Fit<'_>, model: &WithEffects, scene: &Scene) -> Option<Located> {
    let unknown = Unknown::new(port, fit, model, scene)?;
    // Step 1: every family alone.
    let alone = |family: usize| {
        let lengths = unknown.families[family].lengths.iter();
        lengths.filter_map(|&length| choice(&unknown, vec![Term { family, length, factor: 1.0 }])).reduce(better)
    };
    let singles: Vec<Choice> = (0..unknown.families.len()).filter_map(alone).collect();
    let over = |choice: &Choice| unknown.families[choice.terms[0].family].over;
    let mut functions: Vec<&Choice> = singles.iter().filter(|c| over(c) != Over::Free).collect();
    functions.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    // Step 2: sums of two, the size of each about that which it has alone.
    let sum = |a: &Choice, b: &Choice, factor: f64| {
        let scaled = |c: &Choice, by: f64| Term { factor: by * c.variance.sqrt(), ..c.terms[0] };
        choice(&unknown, vec![scaled(a, 1.0), scaled(b, factor)])
    };
    let mut sums = Vec::new();
    let acts: Vec<&Choice> = functions.iter().copied().filter(|c| c.variance > 0.0).collect();
    if let [a, b, ..] = acts[..] {
        sums.extend([0.1, 0.5, 2.0].into_iter().filter_map(|factor| sum(a, b, factor)));
    }
    if let (Some(a), Some(free)) = (acts.first(), singles.iter().find(|c| over(c) == Over::Free && c.variance > 0.0)) {
        sums.extend([0.02, 0.1, 0.5].into_iter().filter_map(|factor| sum(a, free, factor)));
    }
    let best = singles.into_iter().chain(sums).reduce(better)?;
    let evidence = evidence(port, &unknown, &best, fit, model)?;
    Some(Located { port: port.clone(), evidence })
}

/// The share of the squares above the noise that a signal takes away, the freedom it uses paid for; what is less than the
/// spread of the noise's own squares counts as that much.
fn share(unknown: &Unknown, coefficients: &[f64], freedom: f64) -> f64 {
    let n = &unknown.normals;
    let left = &unknown.residuals + &unknown.columns * DVector::from_column_slice(coefficients);
    let before = n.chi2 - n.freedom;
    let after = left.norm_squared() - (n.freedom - freedom);
    ((before - after.max(0.0)) / before.max((2.0 * n.freedom).sqrt())).clamp(0.0, 1.0)
}

/// Of so many points, one in this many is kept in a curve.
pub fn thinning(points: usize) -> usize {
    const POINTS: usize = 800;
    points.div_ceil(POINTS).max(1)
}

fn evidence(port: &Port, unknown: &Unknown, choice: &Choice, fit: &Fit<'_>, model: &WithEffects) -> Option<Evidence> {
    let estimate = unknown.normals.estimate(&unknown.prior(&choice.terms)?, choice.variance)?;
    let coefficients = estimate.coefficients.as_slice();
    let units = Units::of(port, model);
    let mut over_time: Vec<(String, Curve)> = Vec::new();
    let arguments = [(Over::Position, units.position), (Over::Speed, units.speed), (Over::Input, units.input)];
    let mut over: Vec<(Over, String, Curve)> = arguments.map(|(over, unit)| (over, unit, Curve::default())).into();
    for (piece, looks) in unknown.looks.iter().enumerate().filter(|(_, looks)| !looks.is_empty()) {
        let signal = unknown.signal(&choice.terms, coefficients, piece);
        let kept = || looks.iter().zip(&signal).step_by(thinning(looks.len()));
        for (over, _, curve) in &mut over {
            curve.x.extend(kept().map(|(look, _)| look.of(*over)));
            curve.estimated.extend(kept().map(|(_, s)| *s));
        }
        // The windows of an experiment follow each other.
        let name = &fit.subject.measurements[fit.pieces[piece].measurement].name;
        if over_time.last().is_none_or(|(last, _)| last != name) {
            over_time.push((name.clone(), Curve::default()));
        }
        if let Some((_, curve)) = over_time.last_mut() {
            curve.x.extend(kept().map(|(look, _)| look.t));
            curve.estimated.extend(kept().map(|(_, s)| *s));
        }
    }
    let varies = |curve: &Curve| curve.x.iter().any(|x| x != &curve.x[0]);
    over.retain(|(_, _, curve)| varies(curve));
    Some(Evidence {
        place: port.to_string(),
        unit: units.signal,
        evidence: choice.evidence,
        share: share(unknown, coefficients, estimate.freedom),
        freedom: estimate.freedom,
        over_time,
        over: over.into_iter().map(|(over, unit, curve)| (over.name().to_owned(), unit, curve)).collect(),
    })
}

/// Units at a place; empty where the model does not tell.
struct Units {
    signal: String,
    position: String,
    speed: String,
    input: String,
}

impl Units {
    fn of(port: &Port, model: &WithEffects) -> Self {
        let interface = model.model().interface();
        let states = model.model().equation_states();
        let all = || states.iter().chain(&interface.signals).chain(&interface.inputs);
        let unit = |name: &str| all().find(|v| v.name == name).map(|v| v.unit.clone());
        let text = |unit: Option<mops_language::Unit>| unit.map_or_else(String::new, |u| u.to_string());
        let rate = |name: &str| text(unit(name).map(|u| u.power(1, -1)));
        let first = interface.inputs.first().map(|input| input.unit.to_string()).unwrap_or_default();
        match port {
            Port::Joint { position, velocity, unit: force, .. } => Self {
                signal: text(force.clone()),
                position: text(unit(position)),
                speed: text(unit(velocity)),
                input: first,
            },
            Port::Process { state, unit: force, .. } => {
                Self { signal: text(force.clone()), position: text(unit(state)), speed: rate(state), input: first }
            }
            Port::Actuator { input: name } | Port::Sensor { output: name } => {
                let own = text(unit(name));
                Self { signal: own.clone(), position: own.clone(), speed: rate(name), input: own }
            }
        }
    }
}
