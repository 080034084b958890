//! Effects of a model in a study file: `[models.NAME.effects]`.

use mops_core::{
    catalogue::{Catalogue, EffectBuilder},
    model::Model,
};
use mops_language::{Diagnostic, entries::Entries};

use super::reading::kind;
use super::sections::EffectSection;
use super::tree::Node;

/// Returns the model with the effects of the table.
pub(super) fn add(
    catalogue: &Catalogue,
    model: Box<dyn Model>,
    effects: Entries<Entries<EffectSection>>,
    table: &Node<'_>,
) -> Result<Box<dyn Model>, Diagnostic> {
    let mut drafts = Vec::new();
    for (name, kinds) in effects.0 {
        let node = table.child(&name).expect("it was just read");
        kind(&node, &[], &catalogue.effects, |effect| effect.name(), "effect")?;
        let draft = |(kind, section)| {
            let EffectSection { place, companion } = section;
            EffectBuilder { name: name.clone(), kind, place, companion }
        };
        drafts.extend(kinds.0.into_iter().map(draft));
    }
    catalogue.with_effects(model.into(), &drafts).map_err(|mistake| table.locate(&mistake))
}
