//! Effects at places of a model, as written in a study.

use std::sync::Arc;

use mops_language::suggestion;

use crate::catalogue::Catalogue;
use crate::effect::{Between, Placement, Port};
use crate::error::StudyError;
use crate::model::{Interface, Model};
use crate::study::ModelBuilder;

/// An effect at a place of a model, as written in a study and not yet checked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EffectBuilder {
    /// Name of the effect in the model; its parameters are called `name.parameter`.
    pub name: String,
    /// Kind of effect.
    pub kind: String,
    /// Place that the effect acts at, such as `joint:phi`.
    pub place: String,
    /// Second place, if the effect needs one.
    pub companion: Option<String>,
}

impl EffectBuilder {
    /// Creates an effect of a kind at a place.
    pub fn new(name: impl Into<String>, kind: impl Into<String>, place: impl Into<String>) -> Self {
        Self { name: name.into(), kind: kind.into(), place: place.into(), companion: None }
    }

    /// Sets a second place.
    #[must_use]
    pub fn with_companion(self, place: impl Into<String>) -> Self {
        Self { companion: Some(place.into()), ..self }
    }

    /// Returns the effect and its ports.
    fn placement(&self, catalogue: &Catalogue, model: &Interface) -> Result<Placement, StudyError> {
        if self.name.is_empty() || !self.name.chars().all(|c| c.is_alphanumeric() || "_-".contains(c)) {
            return Err(StudyError::here(format!("invalid effect name `{}`", self.name))
                .with_help("use letters, digits, `_` and `-` only"));
        }
        let effect = catalogue.effects.iter().find(|effect| effect.name() == self.kind).ok_or_else(|| {
            StudyError::new(&self.kind, format!("there is no effect `{}`", self.kind))
                .with_help(suggestion(&self.kind, catalogue.effects.iter().map(|effect| effect.name())))
        })?;
        let port =
            |key: &str, text: &str| Port::named(text, &model.ports).map_err(|m| m.within(key).within(&self.kind));
        let companion = self.companion.as_deref().map(|text| port("companion", text)).transpose()?;
        let between = companion.as_ref().filter(|_| effect.second_port().is_none()).and_then(|_| Between::of(effect));
        let effect = between.unwrap_or_else(|| Arc::clone(effect));
        Ok(Placement { name: self.name.clone(), effect, port: port("place", &self.place)?, companion })
    }
}

impl ModelBuilder {
    /// Adds effects at places of the model; each effect parameter is a model parameter `name.parameter`.
    ///
    /// # Errors
    /// Returns an error as [`Catalogue::with_effects`] does.
    pub fn with_effects(self, catalogue: &Catalogue, effects: &[EffectBuilder]) -> Result<Self, StudyError> {
        Ok(Self { model: catalogue.with_effects(self.model.into(), effects)?, ..self })
    }
}

impl Catalogue {
    /// Returns a model with effects at its places. Each effect parameter is a model parameter `name.parameter`, at its
    /// null value by default.
    ///
    /// # Errors
    /// Returns an error for an unknown kind of effect or place, and for an effect that does not act there. The error
    /// has the effect's name as its first key.
    pub fn with_effects(&self, model: Arc<dyn Model>, effects: &[EffectBuilder]) -> Result<Box<dyn Model>, StudyError> {
        let placement = |draft: &EffectBuilder| {
            draft.placement(self, model.interface()).map_err(|mistake| mistake.within(&draft.name))
        };
        let placements = effects.iter().map(placement).collect::<Result<Vec<_>, _>>()?;
        let augment = self.augment.ok_or_else(|| StudyError::here("this catalogue has no simulation of effects"))?;
        augment(model, placements)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_effect_is_a_mistake_at_its_kind() {
        let catalogue = Catalogue::default();
        let draft = EffectBuilder::new("arm", "coulomb-friction", "joint:phi");
        let mistake = draft.placement(&catalogue, &Interface::default()).err().unwrap();
        assert_eq!(mistake.path, ["coulomb-friction"]);
        let draft = EffectBuilder::new("arm.c", "coulomb-friction", "joint:phi");
        assert!(draft.placement(&catalogue, &Interface::default()).err().unwrap().path.is_empty());
    }
}
