//! The honest stopgap: a force that is a table over position or speed, where no effect of the catalogue explains the data.

use std::sync::Arc;

use mops_core::{Acting, Along, At, Dimension, Effect, EffectClass, Port, PortKind, Scalar, Strength, Trials};

use crate::candidate::{Candidate, Sizes};
use crate::screen::Scene;
use crate::search::{Search, Trial};
use crate::trace_of::sizes;
use crate::variant::Added;

/// Points of a table.
pub const POINTS: usize = 13;

/// A force that is straight between its values at evenly spread positions or speeds, and constant beyond them.
struct ForceTable {
    over_speed: bool,
}

const fn value(name: &'static str) -> Strength {
    Strength::signed(name, "force at a point of the table", Dimension::OUTPUT)
}

/// The strengths of a table over something of this dimension.
const fn strengths(over: Dimension) -> [Strength; 3 + POINTS] {
    const FREE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
    [
        Strength::signed("share", "1, or 0 for no force", Dimension::ONE).kept(),
        Strength::shape("from", "first point of the table", over, FREE, Trials::Linear).kept(),
        Strength::shape("to", "last point of the table", over, FREE, Trials::Linear).kept(),
        value("f1"),
        value("f2"),
        value("f3"),
        value("f4"),
        value("f5"),
        value("f6"),
        value("f7"),
        value("f8"),
        value("f9"),
        value("f10"),
        value("f11"),
        value("f12"),
        value("f13"),
    ]
}

static OVER_POSITION: [Strength; 3 + POINTS] = strengths(Dimension::POSITION);
static OVER_SPEED: [Strength; 3 + POINTS] = strengths(Dimension::SPEED);

struct AtStrengths<S> {
    over_speed: bool,
    share: S,
    ends: [S; 2],
    values: Vec<S>,
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        let x = if self.over_speed { at.v } else { at.q };
        let last = self.values.len() - 1;
        let place = (x - self.ends[0]) / (self.ends[1] - self.ends[0]) * last as f64;
        let force = if place.value() <= 0.0 {
            self.values[0]
        } else if place.value() >= last as f64 {
            self.values[last]
        } else {
            let k = place.value().floor() as usize;
            self.values[k] + (self.values[k + 1] - self.values[k]) * (place - k as f64)
        };
        force * self.share
    }
}

impl ForceTable {
    fn make<S: Scalar>(&self, s: &[S]) -> AtStrengths<S> {
        AtStrengths { over_speed: self.over_speed, share: s[0], ends: [s[1], s[2]], values: s[3..].to_vec() }
    }
}

impl Effect for ForceTable {
    fn name(&self) -> &'static str {
        if self.over_speed { "force-over-speed" } else { "force-over-position" }
    }
    fn about(&self) -> &'static str {
        "A force given by a table: what the data show where no known effect explains them."
    }
    fn formula(&self) -> &'static str {
        "straight between f1 to f13 at evenly spread points"
    }
    fn source(&self) -> &'static str {
        "the data"
    }
    fn class(&self) -> EffectClass {
        EffectClass::Gain
    }
    fn ports(&self) -> &'static [PortKind] {
        if self.over_speed { &[PortKind::Joint] } else { &[PortKind::Joint, PortKind::Process] }
    }
    fn strengths(&self) -> &'static [Strength] {
        if self.over_speed { &OVER_SPEED } else { &OVER_POSITION }
    }
    fn act(&self, strengths: &[f64]) -> Box<dyn Acting<f64>> {
        Box::new(self.make(strengths))
    }
    fn act_along(&self, strengths: &[Along]) -> Box<dyn Acting<Along>> {
        Box::new(self.make(strengths))
    }
}

/// Fits tables at these places to what a trial leaves, and returns the best trial.
pub fn best_table<'a>(search: &Search<'a>, from: &Trial<'a>, scene: &Scene, places: &[Port]) -> Option<Trial<'a>> {
    let interface = search.subject.model.interface();
    let mut best: Option<Trial<'a>> = None;
    for port in places {
        let Some(sizes) = sizes(port, &from.variant.model, &from.fit.pieces, &scene.trajectories) else { continue };
        for over_speed in [false, true] {
            let effect: Arc<dyn Effect> = Arc::new(ForceTable { over_speed });
            if !port.kind(&interface.ports).is_some_and(|kind| effect.ports().contains(&kind)) {
                continue;
            }
            let candidate = Candidate { effect, port: port.clone(), companion: None, only: None };
            let added = Added { strengths: first(&sizes, over_speed), candidate, own: Vec::new(), sizes };
            let all: Vec<Added> = from.added.iter().cloned().chain([added]).collect();
            let Some(trial) = search.from(from, &all, 25) else { continue };
            let trial = if trial.windows > 1 { search.over_whole(&trial).unwrap_or(trial) } else { trial };
            let rank = |t: &Trial<'_>| (t.windows, t.fitted.chi2);
            if best.as_ref().is_none_or(|best| rank(&trial) < rank(best)) {
                best = Some(trial);
            }
        }
    }
    best
}

/// No force, over the range of the motion.
fn first(sizes: &Sizes, over_speed: bool) -> Vec<f64> {
    let [low, high] = if over_speed { [-1.7 * sizes.speed, 1.7 * sizes.speed] } else { sizes.range };
    [1.0, low, high].into_iter().chain([0.0; POINTS]).collect()
}

/// The points of the table that a trial ends with.
#[allow(clippy::cast_precision_loss)]
pub fn points(added: &Added) -> Vec<[f64; 2]> {
    let s = &added.strengths;
    let step = (s[2] - s[1]) / (POINTS - 1) as f64;
    (0..POINTS).map(|k| [s[1] + step * k as f64, s[3 + k]]).collect()
}
