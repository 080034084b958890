//! The built-in catalogue: the kinds that a study file can name without a plug-in.
//!
//! [`catalogue`] combines what the crates of kinds list, each in its `kinds`: models, criteria, solvers, tasks and
//! effects, and the shipped studies. These crates do not depend on each other.

use mops_core::Catalogue;

/// Returns the built-in catalogue: models, criteria, solvers, effects and studies.
pub fn catalogue() -> Catalogue {
    Catalogue {
        models: mops_models::kinds(),
        criteria: mops_criteria::kinds(),
        solvers: mops_solvers::kinds(),
        tasks: mops_tasks::kinds(),
        effects: mops_effects::effects(),
        augment: Some(|model, effects| Ok(Box::new(mops_models::WithEffects::new(model, effects)?))),
        studies: mops_studies::shipped().into_iter().map(Into::into).collect(),
        program: None,
        readable: Vec::new(),
    }
}
