//! Effects between two joints: those of one joint, on the relative position and speed of two.

use std::sync::Arc;

use mops_language::{Dual7, Scalar};

use crate::effect::{
    BoundEffect, Characteristic, DeclaredTerm, Dimension, Effect, EffectClass, EffectParameter, PortKind, PortState,
};

/// An effect that acts between two joints: a function of the position and the speed of the first relative to the
/// second. Its force acts on the first joint, its reaction on the second.
pub struct Between(Arc<dyn Effect>);

impl Between {
    /// Returns an effect between two joints, if it may act there ([`Effect::acts_between`]).
    pub fn of(effect: &Arc<dyn Effect>) -> Option<Arc<dyn Effect>> {
        effect.acts_between().then(|| Arc::new(Self(Arc::clone(effect))) as Arc<dyn Effect>)
    }
}

impl Effect for Between {
    fn name(&self) -> &'static str {
        self.0.name()
    }
    fn about(&self) -> &'static str {
        self.0.about()
    }
    fn formula(&self) -> &'static str {
        self.0.formula()
    }
    fn source(&self) -> &'static str {
        self.0.source()
    }
    fn class(&self) -> EffectClass {
        self.0.class()
    }
    fn form_of(&self) -> Option<&'static str> {
        self.0.form_of()
    }
    fn ports(&self) -> &'static [PortKind] {
        &[PortKind::Joint]
    }
    fn quantities(&self) -> &'static [&'static str] {
        self.0.quantities()
    }
    fn second_port(&self) -> Option<PortKind> {
        Some(PortKind::Joint)
    }
    fn mutual(&self) -> bool {
        true
    }
    fn modifies(&self) -> Option<DeclaredTerm> {
        Some(DeclaredTerm::Coupling)
    }
    fn parameters(&self) -> &'static [EffectParameter] {
        self.0.parameters()
    }
    fn states(&self) -> usize {
        self.0.states()
    }
    fn free_starts(&self) -> &'static [Dimension] {
        self.0.free_starts()
    }
    fn is_sum(&self) -> bool {
        self.0.is_sum()
    }
    fn characteristic(&self) -> Option<Characteristic> {
        self.0.characteristic()
    }
    fn rarity(&self) -> u8 {
        self.0.rarity()
    }
    fn bind(&self, parameters: &[f64]) -> Box<dyn BoundEffect<f64>> {
        Box::new(Relative(self.0.bind(parameters)))
    }
    fn bind_dual(&self, parameters: &[Dual7]) -> Box<dyn BoundEffect<Dual7>> {
        Box::new(Relative(self.0.bind_dual(parameters)))
    }
}

/// The effect at given parameters.
struct Relative<S>(Box<dyn BoundEffect<S>>);

/// Returns the state of a port that is the first joint relative to the second.
fn relative<'a, S: Scalar>(at: &PortState<'a, S>) -> PortState<'a, S> {
    let none = S::from(0.0);
    PortState { q: at.q - at.other, v: at.v - at.other_speed, other: none, other_speed: none, ..*at }
}

impl<S: Scalar> BoundEffect<S> for Relative<S> {
    fn start(&self, at: &PortState<'_, S>, z: &mut [S]) {
        self.0.start(&relative(at), z);
    }
    fn rates(&self, at: &PortState<'_, S>, z: &[S], dz: &mut [S]) {
        self.0.rates(&relative(at), z, dz);
    }
    fn value(&self, at: &PortState<'_, S>, z: &[S]) -> S {
        self.0.value(&relative(at), z)
    }
    fn onward(&self, at: &PortState<'_, S>, z: &[S]) -> S {
        -self.0.value(&relative(at), z)
    }
    fn gap(&self, at: &PortState<'_, S>) -> Option<S> {
        self.0.gap(&relative(at))
    }
    fn breaks(&self) -> Vec<S> {
        self.0.breaks()
    }
    fn longest_step(&self) -> f64 {
        self.0.longest_step()
    }
    fn damped_step(&self) -> f64 {
        self.0.damped_step()
    }
}
