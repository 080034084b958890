//! A table in place of an effect that nobody knows: linear between points over one thing that its place sees.

use std::sync::Arc;

use mops_core::{
    BoundEffect, Dimension, Dual7, Effect, EffectClass, EffectParameter, InitialGrid, PortKind, PortState, Scalar,
};

use crate::candidate::Candidate;
use crate::family::Over;
use crate::locate::{Located, Table};
use crate::search::{Search, Trial};
use crate::trace_of::sizes;
use crate::variant::Added;
use mops_core::diagnosis::Unexplained;

/// What it is called.
const NAME: &str = "table";

/// The table as an effect: its strengths are the values at the points.
struct Stopgap {
    over: Over,
    kind: [PortKind; 1],
    points: Vec<f64>,
}

const fn value_at(name: &'static str) -> EffectParameter {
    let bounds = [f64::NEG_INFINITY, f64::INFINITY];
    EffectParameter::shape(name, "value at a point of the table", Dimension::OUTPUT, bounds, InitialGrid::Plain(&[0.0]))
}

const VALUES: &[EffectParameter] = &[
    value_at("y1"),
    value_at("y2"),
    value_at("y3"),
    value_at("y4"),
    value_at("y5"),
    value_at("y6"),
    value_at("y7"),
    value_at("y8"),
    value_at("y9"),
    value_at("y10"),
    value_at("y11"),
    value_at("y12"),
    value_at("y13"),
    value_at("y14"),
    value_at("y15"),
];

impl Stopgap {
    fn acting<S: Scalar>(&self, values: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtValues {
            over: self.over,
            passes: !matches!(self.kind, [PortKind::Joint | PortKind::Process]),
            points: self.points.clone(),
            values: values.to_vec(),
        })
    }
}

impl Effect for Stopgap {
    fn name(&self) -> &'static str {
        NAME
    }

    fn about(&self) -> &'static str {
        "What no effect explains, as a table."
    }

    fn formula(&self) -> &'static str {
        "linear between the points of a table"
    }

    fn source(&self) -> &'static str {
        "none: it stands for what is not known"
    }

    fn class(&self) -> EffectClass {
        if self.over == Over::Time { EffectClass::TimeVarying } else { EffectClass::Bias }
    }

    fn ports(&self) -> &'static [PortKind] {
        &[PortKind::Joint, PortKind::Process, PortKind::Actuator, PortKind::Sensor]
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        &VALUES[..self.points.len()]
    }

    fn bind(&self, strengths: &[f64]) -> Box<dyn BoundEffect<f64>> {
        self.acting(strengths)
    }

    fn bind_dual(&self, strengths: &[Dual7]) -> Box<dyn BoundEffect<Dual7>> {
        self.acting(strengths)
    }
}

/// The table at given values.
struct AtValues<S> {
    over: Over,
    /// Whether a value passes that the table is added to.
    passes: bool,
    points: Vec<f64>,
    values: Vec<S>,
}

impl<S: Scalar> BoundEffect<S> for AtValues<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        let x = match self.over {
            Over::Position => at.q,
            Over::Speed => at.v,
            Over::Input => at.value,
            Over::Free | Over::Time => S::from(at.t),
        };
        let last = self.points.len() - 1;
        let k = self.points.partition_point(|&p| p <= x.value()).clamp(1, last) - 1;
        let (from, to) = (self.points[k], self.points[k + 1]);
        let table = if x.value() <= self.points[0] {
            self.values[0]
        } else if x.value() >= self.points[last] {
            self.values[last]
        } else {
            self.values[k] + (self.values[k + 1] - self.values[k]) * ((x - S::from(from)) / S::from(to - from))
        };
        if self.passes { at.value + table } else { table }
    }
}

/// Whether an effect is such a table.
pub fn is_table(added: &Added) -> bool {
    added.candidate.effect.name() == NAME
}

/// Residuals, in units of the noise, below which no further table is tried.
const GOOD: f64 = 1.15;

/// The trial with a table at a place, fitted with everything else; and the table. Tried are what explains most and what
/// comes close, from the linear estimate and from nothing. `None` where no table can be fitted.
pub fn stopgap<'a>(search: &Search<'a>, from: &Trial<'a>, located: &Located) -> Option<(Trial<'a>, Table)> {
    let scene = crate::screen::Scene::new(&from.fit, &from.variant.model, &from.fitted)?;
    let sizes = sizes(&located.port, &from.variant.model, &from.fit.pieces, &scene.trajectories)?;
    let ports = &search.subject.model.interface().ports;
    let kind = located.port.kind(ports)?;
    // At a sensor nobody tells the rate.
    let known = |table: &&Table| !(kind == PortKind::Sensor && table.over == Over::Speed);
    let fitted = |table: &Table, size: f64| {
        let effect = Stopgap { over: table.over, kind: [kind], points: table.points.iter().map(|p| p[0]).collect() };
        let candidate = Candidate { effect: Arc::new(effect), port: located.port.clone(), companion: None, only: None };
        let strengths = table.points.iter().map(|p| size * p[1]).collect();
        let added = Added {
            candidate,
            strengths,
            own: Vec::new(),
            starts: Vec::new(),
            sizes,
            expected: table.expected.clone(),
        };
        let all: Vec<Added> = from.added.iter().cloned().chain([added]).collect();
        Some((search.from(from, &all, 25)?, table.clone()))
    };
    let tables: Vec<&Table> = located.tables.iter().filter(known).collect();
    let near = |table: &&&Table| table.evidence > 0.8 * tables[0].evidence;
    let mut best: Option<(Trial<'a>, Table)> = None;
    for table in tables.iter().filter(near).take(2) {
        for size in [1.0, 0.0] {
            if best.as_ref().is_some_and(|best| best.0.fitted.normalised() < GOOD) {
                break;
            }
            let Some(next) = fitted(table, size) else { continue };
            if best.as_ref().is_none_or(|best| next.0.fitted.chi2 < best.0.fitted.chi2) {
                best = Some(next);
            }
        }
    }
    best
}

/// What no effect explains at a place, as a table with these values.
pub fn unexplained(located: &Located, table: &Table, values: &[f64]) -> Unexplained {
    Unexplained {
        place: located.evidence.place.clone(),
        share: located.evidence.share,
        over: table.over.name().to_owned(),
        table: table.points.iter().zip(values).map(|(p, &y)| [p[0], y]).collect(),
    }
}
