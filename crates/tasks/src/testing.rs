//! Catalogue for tests.

use mops_core::Catalogue;

/// Returns all kinds and studies.
pub(crate) fn catalogue() -> Catalogue {
    Catalogue {
        models: mops_models::kinds(),
        criteria: mops_criteria::kinds(),
        solvers: mops_solvers::kinds(),
        tasks: crate::kinds(),
        effects: mops_effects::effects(),
        augment: Some(|model, effects| Ok(Box::new(mops_models::WithEffects::new(model, effects)?))),
        studies: mops_studies::shipped().into_iter().map(Into::into).collect(),
        ..Catalogue::default()
    }
}
