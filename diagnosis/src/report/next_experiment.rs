//! The experiment that would separate two models that the data cannot distinguish: variations of the existing ones,
//! compared by the distance of the predictions.

use mops_core::{Case, Job};
use mops_math as math;

use crate::selection::{FittedSet, STRONG};

/// Factors by which inputs or start values are varied for the next experiment. Basis: an assumption.
const VARIATIONS: [f64; 4] = [0.3, 0.5, 2.0, 3.0];

/// Ratio to the distance of the predictions as they were from which a variation is worth an experiment. Basis: an
/// assumption.
const WORTH: f64 = 1.5;

/// Largest angle that start values are varied to, rad: a turn further is the same.
const HALF_A_TURN: f64 = std::f64::consts::PI;

/// Returns in words the experiment that would separate two models fitted to the same data; `None` if no variation does
/// better than the experiments themselves, or well enough to distinguish the two.
pub fn separating(a: &FittedSet<'_>, b: &FittedSet<'_>, names: [&str; 2]) -> Option<String> {
    let mut best: Option<(f64, f64, String)> = None;
    for piece in 0..a.fit.pieces.len() {
        let name = &a.fit.subject.measurements[a.fit.pieces[piece].measurement].name;
        let Some(now) = difference(a, b, piece, 1.0, 1.0) else { continue };
        let samples: usize = a.fit.pieces[piece].series.iter().map(|s| s.times.len()).sum();
        let driven = !a.fit.pieces[piece].case.inputs.is_empty();
        for factor in VARIATIONS {
            let inputs = driven.then_some((factor, 1.0, "its inputs"));
            for (input, start, what) in inputs.into_iter().chain([(1.0, factor, "its start values")]) {
                let Some(then) = difference(a, b, piece, input, start) else { continue };
                #[allow(clippy::cast_precision_loss)]
                let is_informative = then * then * samples as f64 >= STRONG;
                if is_informative && then > WORTH * now && best.as_ref().is_none_or(|(most, ..)| then > *most) {
                    best = Some((then, now, format!("`{name}` again with {what} {factor} times as large")));
                }
            }
        }
    }
    let (then, now, what) = best?;
    Some(format!(
        "{what}: {} and {} would then differ by {then:.1} times the noise, now by {now:.1}",
        names[0], names[1]
    ))
}

/// Returns the root mean square difference of two models in a varied experiment, in units of the noise.
#[allow(clippy::cast_precision_loss)]
fn difference(a: &FittedSet<'_>, b: &FittedSet<'_>, piece: usize, input: f64, start: f64) -> Option<f64> {
    let [x, y] = [outputs(a, piece, input, start)?, outputs(b, piece, input, start)?];
    let square: f64 = x.iter().zip(&y).map(|(x, y)| math::powi(x - y, 2)).sum();
    let rms = (square / x.len().max(1) as f64).sqrt();
    rms.is_finite().then_some(rms)
}

fn outputs(set: &FittedSet<'_>, piece: usize, input: f64, start: f64) -> Option<Vec<f64>> {
    let p = &set.fit.pieces[piece];
    let mut parameters = set.fit.parameters(piece, &set.least_squares.point);
    let own = set.fit.subject.measurements[p.measurement].locals.len();
    for local in &p.locals[..own] {
        let value = &mut parameters[local.parameter];
        *value *= start;
        let unit = &set.fit.model.interface().parameters[local.parameter].variable.unit;
        if start > 1.0 && unit.to_string() == "rad" && value.abs() > HALF_A_TURN {
            return None;
        }
    }
    let inputs = p.case.inputs.iter().map(|(name, given)| (name.clone(), given.mapped(&|value| value * input, input)));
    let case = Case { inputs: inputs.collect(), ..p.case.clone() };
    let signals = p.signals();
    let job = Job { case: &case, parameters: &parameters, signals: &signals, horizon: p.horizon };
    let analysis = set.fit.model.analyse(&job).ok()?;
    let sample = |s: &crate::records::Series| {
        let trace = analysis.trace(&s.name).sample(&s.times);
        trace.into_iter().map(|y| y / s.noise).collect::<Vec<f64>>()
    };
    Some(p.series.iter().flat_map(sample).collect())
}
