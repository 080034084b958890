//! Effects at places of a model, as written in a study.

use std::sync::Arc;

use mops_language::suggestion;

use crate::catalogue::Catalogue;
use crate::effect::{Between, Placement, Port};
use crate::model::{Interface, Model};
use crate::study::{ModelBuilder, StudyError};

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
        let port = |key: &str, text: &str| Port::named(text, model).map_err(|m| m.within(key).within(&self.kind));
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
    /// Returns a model with effects at its places. Each effect parameter is a model parameter `name.parameter`, at its null
    /// value by default.
    ///
    /// # Errors
    /// Returns an error for an unknown kind of effect or place, and for an effect that does not act there. The error has the
    /// effect's name as its first key.
    pub fn with_effects(&self, model: Arc<dyn Model>, effects: &[EffectBuilder]) -> Result<Box<dyn Model>, StudyError> {
        let placement = |draft: &EffectBuilder| {
            draft.placement(self, model.interface()).map_err(|mistake| mistake.within(&draft.name))
        };
        let placements = effects.iter().map(placement).collect::<Result<Vec<_>, _>>()?;
        let augment = self.augment.ok_or_else(|| StudyError::here("this catalogue has no simulation of effects"))?;
        augment(model, placements)
    }
}

impl Interface {
    /// Returns the ports that effects act at; a joint represents the equation of its speed.
    pub fn places(&self) -> impl Iterator<Item = &Port> {
        self.ports.iter().filter(|port| port.kind(&self.ports).is_some())
    }
}

impl Port {
    /// Returns the port of a model with this name, such as `joint:phi`, `process:level`, `actuator:u`, `sensor:theta`.
    ///
    /// # Errors
    /// Returns an error if the model has no such port.
    pub fn named(text: &str, model: &Interface) -> Result<Self, StudyError> {
        if let Some(port) = model.ports.iter().find(|port| port.to_string() == text) {
            return Ok(port.clone());
        }
        if model.ports.is_empty() {
            return Err(StudyError::here("this model has no places for effects: its equations are not accessible")
                .with_help("remove `effects`, or write the model as equations (`mops describe equations`)"));
        }
        let names: Vec<String> = model.places().map(ToString::to_string).collect();
        // A kind alone, or a name alone, is a near match.
        let meant: Vec<&str> = names.iter().filter(|n| n.split(':').any(|part| part == text)).map(|n| &**n).collect();
        let help = if meant.is_empty() {
            suggestion(text, names.iter().map(String::as_str))
        } else {
            format!("such as {}", meant.join(", "))
        };
        Err(StudyError::here(format!("the model has no place `{text}`")).with_help(help))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_found_by_its_kind_and_name() {
        let port = Port::Actuator { input: "u".into() };
        let model =
            Interface { ports: vec![port.clone(), Port::Sensor { output: "theta".into() }], ..Interface::default() };
        assert_eq!(Port::named("actuator:u", &model), Ok(port));
        let wrong = |text: &str| Port::named(text, &model).unwrap_err().help.unwrap();
        assert_eq!(wrong("sensor:thta"), "did you mean `sensor:theta`?");
        assert_eq!(wrong("theta"), "such as sensor:theta");
        assert!(Port::named("joint:phi", &Interface::default()).unwrap_err().message.contains("no places"));
    }

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
