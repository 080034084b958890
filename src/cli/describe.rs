//! `mops describe`: manual page of a kind, an effect, a study or a table of study files.

use std::process::ExitCode;

use clap::Args;
use mops_core::{Catalogue, CatalogueStudy, Diagnostic, ModelKind, suggestion};

use super::effect;
use super::places::places;
use super::study::text_of;
use crate::terminal::{CommandError, print};

/// Arguments of `mops describe`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Kind of model, criterion or solver; effect; shipped study; table of study files (study, models, tuners, cases,
    /// experiments, criteria, solver) or key of one, such as `step` or `hold`.
    name: String,
}

pub(super) fn describe(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let name = arguments.name.as_str();
    let models = catalogue.models.iter().map(|k| (k.name, k.schema));
    let criteria = catalogue.criteria.iter().map(|k| (k.name, k.schema));
    let solvers = catalogue.solvers.iter().map(|k| (k.name, k.schema));
    let mut kinds = models.chain(criteria).chain(solvers);
    if let Some((table, schema)) = mops_core::file::tables().into_iter().find(|(table, _)| *table == name) {
        print(&mops_core::file::describe(&format!("[{table}] of a study file"), &schema))?;
        return Ok(ExitCode::SUCCESS);
    }
    if let Some((name, schema)) = kinds.clone().find(|(known, _)| *known == name) {
        let model = catalogue.models.iter().find(|kind| kind.name == name).and_then(ModelKind::default_model);
        let places = model.map_or_else(String::new, |model| places(model.interface()));
        let places = if places.is_empty() { places } else { format!("\nPlaces for effects:\n  {places}\n") };
        print(&(mops_core::file::describe(name, &schema()) + &places))?;
        return Ok(ExitCode::SUCCESS);
    }
    if let Some(effect) = catalogue.effects.iter().find(|effect| effect.name() == name) {
        print(&effect::page(effect.as_ref()))?;
        return Ok(ExitCode::SUCCESS);
    }
    if let Some(study) = catalogue.study(name) {
        print(&page_of(study))?;
        return Ok(ExitCode::SUCCESS);
    }
    // A key of a table, such as `step` or `hold`, is described on the page of the table.
    let tables = mops_core::file::tables_with(name);
    if !tables.is_empty() {
        let pages = mops_core::file::tables().into_iter().filter(|(table, _)| tables.contains(table));
        let pages =
            pages.map(|(table, schema)| mops_core::file::describe(&format!("[{table}] of a study file"), &schema));
        let named: Vec<String> = tables.iter().map(|table| format!("[{table}]")).collect();
        print(&format!("`{name}` is a key of {}\n\n{}", named.join(", "), pages.collect::<Vec<_>>().join("\n")))?;
        return Ok(ExitCode::SUCCESS);
    }
    let known: Vec<&str> = kinds
        .by_ref()
        .map(|(name, _)| name)
        .chain(catalogue.effects.iter().map(|effect| effect.name()))
        .chain(catalogue.studies.iter().map(CatalogueStudy::name))
        .chain(mops_core::file::tables().into_iter().map(|(table, _)| table))
        .collect();
    Err(Diagnostic::new(format!("no kind, effect, study or table is named `{name}`"))
        .with_help(suggestion(name, known.iter().copied()))
        .into())
}

/// Returns the page of a study: its README and its study.toml, or the description of a study built in Rust.
fn page_of(study: &CatalogueStudy) -> String {
    match study {
        CatalogueStudy::Built(built) => {
            format!(
                "{}: {}\n\nBuilt in Rust; `mops check {0}` shows its tuners and criteria.\n",
                built.name(),
                built.about()
            )
        }
        _ => {
            let file = |path| text_of(study, path).unwrap_or_default();
            format!("{}\n--- study.toml\n{}", file("README.md"), file("study.toml"))
        }
    }
}
