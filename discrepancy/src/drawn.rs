//! What was found, drawn through the signal that the data show at its place without any formula.
//!
//! In the declared model parameters had absorbed a part of it, and the motion was another one. So the signal is estimated
//! once more, about the repaired model with the effect taken away and everything else held: a component and residual plot.
//! Where the formula is the right one, the points lie about its curve. Source: F. R. Wood, The use of individual effects and
//! residuals in fitting equations to data, Technometrics 15 (1973) 677.

use mops_core::effect::Port;
use mops_outcome::diagnosis::Evidence;

use crate::candidate::Candidate;
use crate::locate::{Located, located, thinning};
use crate::scene::Scene;
use crate::selection::FittedSet;
use crate::trace_of::{Spot, View, spot};
use crate::unknown::respond;

/// Draws what was found into the evidence of the places where effects were added.
pub fn draw(places: &mut [Located], set: &FittedSet<'_>) {
    for place in places {
        let here: Vec<usize> = (0..set.added.len()).filter(|&k| set.added[k].candidate.port == place.port).collect();
        let can = |&k: &usize| can_be_drawn(&set.added[k].candidate);
        if here.is_empty() || !here.iter().all(can) {
            continue;
        }
        if let Some(Evidence { over, over_time, .. }) = drawn(&place.port, &here, set) {
            (place.evidence.over, place.evidence.over_time) = (over, over_time);
        }
    }
}

/// Whether an effect's formula can be drawn along the motion that has it already. What passes an actuator tells nothing where
/// it is held, inertia adds to the acceleration that it changes, and states begin where a fit put them: for these the signal
/// stays as the declared model wants it.
fn can_be_drawn(candidate: &Candidate) -> bool {
    let effect = candidate.effect.as_ref();
    !matches!(candidate.port, Port::Actuator { .. }) && !effect.is_inertial() && effect.states() == 0
}

/// The signal at a port, with what the effects of these indices make of it; `None` where it cannot be had.
fn drawn(port: &Port, effects: &[usize], set: &FittedSet<'_>) -> Option<Evidence> {
    let (mut fit, model, point) = (set.fit.clone(), &set.variant.model, &set.least_squares.point);
    let at_sensor = matches!(port, Port::Sensor { .. });
    if at_sensor {
        // What it shows without them.
        for &index in effects {
            let neutral = set.added[index].candidate.effect.parameters()[0].null_value.unwrap_or(0.0);
            fit.pieces.iter_mut().for_each(|piece| piece.fixed.push((set.variant.first[index], neutral)));
        }
    }
    let mut scene = Scene::new(&fit, model, point)?;
    // Everything else is held.
    scene.basis.clear();
    let mut signals = Vec::new();
    for (piece, own) in fit.pieces.iter().enumerate() {
        let Some(here) = spot(port, model, own) else { continue };
        let along = &scene.trajectories[piece];
        let points = if let Spot::Sensor(series) = here { own.series[series].times.len() } else { along.moments.len() };
        let mut signal = vec![0.0; points];
        for &index in effects {
            let a = &set.added[index];
            let strengths = set.variant.strengths(&set.fit, point, index, a.strengths.len(), piece);
            let added = View::new(&a.candidate, model, own, along)?.added(&strengths)?;
            // Nothing where it does not act.
            signal.iter_mut().zip(added).for_each(|(s, a)| *s += a);
        }
        if !at_sensor {
            let change = respond(here, piece, &signal, &fit, &scene);
            scene.residuals[scene.begins[piece]..].iter_mut().zip(change).for_each(|(r, c)| *r -= c);
        }
        signals.push(signal);
    }
    let mut evidence = located(port, &fit, model, &scene)?.evidence;
    let points: Vec<f64> = signals.iter().flat_map(|s| s.iter().copied().step_by(thinning(s.len()))).collect();
    evidence.over.iter_mut().for_each(|(_, _, curve)| curve.found.clone_from(&points));
    let mut points = points.into_iter();
    evidence.over_time.iter_mut().for_each(|(_, curve)| curve.found = points.by_ref().take(curve.x.len()).collect());
    Some(evidence)
}
