//! Declared terms that turned out to be the wrong ones, and where they act: a term acts where some effect of the catalogue
//! changes the outputs as it does.

use crate::candidate::Candidate;
use crate::fit::dot;
use crate::screen::Scene;
use crate::search::{Search, Trial};
use crate::trace_of::{View, sizes};
use mops_core::diagnosis::Removed;

/// Likeness from which on a term counts as acting at the place of an effect.
const ALIKE: f64 = 0.999;

impl Search<'_> {
    /// What is told of the tuners in `held`, which stand at zero; `declared` is the model with them.
    pub fn removed(&self, declared: &Trial<'_>, held: &[usize]) -> Vec<Removed> {
        if held.is_empty() {
            return Vec::new();
        }
        let scene = Scene::new(&declared.fit, &declared.variant.model, &declared.fitted);
        let name = |k: usize| self.subject.study.tuners()[self.subject.globals[k]].parameter.clone();
        let place = |k: usize| scene.as_ref().and_then(|scene| self.acts_at(k, declared, scene)).unwrap_or_default();
        held.iter().map(|&k| Removed { term: name(k), place: place(k) }).collect()
    }

    /// The place at which an effect has the trace of a tuner.
    fn acts_at(&self, tuner: usize, declared: &Trial<'_>, scene: &Scene) -> Option<String> {
        let own: Vec<f64> = scene.slopes.iter().flat_map(|piece| piece.j[tuner].iter().copied()).collect();
        let model = declared.variant.model.as_ref();
        let pieces = &declared.fit.pieces;
        let likeness = |candidate: &Candidate| {
            let sizes = sizes(&candidate.port, model, pieces, &scene.trajectories)?;
            let strengths = sizes.combinations(candidate.effect.as_ref()).into_iter().next()?;
            let mut trace = Vec::with_capacity(own.len());
            for (piece, along) in pieces.iter().zip(&scene.trajectories) {
                trace.extend(View::new(candidate, model, piece, along)?.trace(&strengths)?);
            }
            let size = dot(&own, &own) * dot(&trace, &trace);
            Some((dot(&own, &trace).abs() / size.sqrt(), candidate.place()))
                .filter(|(likeness, _)| likeness.is_finite())
        };
        // One strength, in proportion to which it acts: what a declared term is.
        let plain = |c: &&Candidate| c.effect.parameters().len() == 1 && c.only.is_none();
        let all = self.candidates(&[]);
        let best = all.iter().filter(plain).filter_map(likeness).max_by(|a, b| a.0.total_cmp(&b.0))?;
        (best.0 > ALIKE).then_some(best.1)
    }
}
