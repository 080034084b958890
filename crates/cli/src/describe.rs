//! `mops describe`: manual page of a kind, an effect, a study or a table of study files.

use std::process::ExitCode;

use clap::Args;
use mops_core::{
    Catalogue,
    catalogue::{CatalogueStudy, ModelKind},
};
use mops_language::{Diagnostic, nearest};
use schemars::Schema;

use super::effect;
use super::places::places;
use super::study::text_of;
use crate::terminal::{CommandError, print};

/// Arguments of `mops describe`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Kind of model, criterion or solver; effect; shipped study; table of study files (study, models, tuners, cases,
    /// experiments, criteria, solver); or key of a table or a kind, such as `step`, `hold` or `clocks`.
    name: String,
}

pub(super) fn describe(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let name = arguments.name.as_str();
    let models = catalogue.models.iter().map(|k| (k.name, k.schema));
    let criteria = catalogue.criteria.iter().map(|k| (k.name, k.schema));
    let solvers = catalogue.solvers.iter().map(|k| (k.name, k.schema));
    let mut kinds = models.chain(criteria).chain(solvers);
    if let Some((table, schema)) = mops_file::tables(catalogue).into_iter().find(|(table, _)| *table == name) {
        print(&mops_file::describe(&format!("[{table}] of a study file"), &schema))?;
        return Ok(ExitCode::SUCCESS);
    }
    if let Some((name, schema)) = kinds.clone().find(|(known, _)| *known == name) {
        let model = catalogue.models.iter().find(|kind| kind.name == name).and_then(ModelKind::default_model);
        let places = model.map_or_else(String::new, |model| places(model.interface()));
        let places = if places.is_empty() { places } else { format!("\nPlaces for effects:\n  {places}\n") };
        print(&(mops_file::describe(name, &schema()) + &places))?;
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
    let tables = mops_file::tables(catalogue).into_iter().map(|(table, schema)| (format!("[{table}]"), schema));
    let pages = keys_named(name, tables.chain(kinds.clone().map(|(kind, schema)| (kind.to_owned(), schema()))));
    if !pages.is_empty() {
        print(&pages)?;
        return Ok(ExitCode::SUCCESS);
    }
    let known: Vec<&str> = kinds
        .by_ref()
        .map(|(name, _)| name)
        .chain(catalogue.effects.iter().map(|effect| effect.name()))
        .chain(catalogue.studies.iter().map(CatalogueStudy::name))
        .chain(mops_file::tables(catalogue).into_iter().map(|(table, _)| table))
        .collect();
    let help = nearest(name, known.iter().copied()).map_or_else(
        || "`mops list` shows the kinds, effects and studies".to_owned(),
        |known| format!("did you mean `{known}`?"),
    );
    Err(Diagnostic::new(format!("no kind, effect, study, table or key is named `{name}`")).with_help(help).into())
}

/// Returns the documentation of a key, with its places in tables and kinds; empty if there is none.
fn keys_named(key: &str, schemas: impl Iterator<Item = (String, Schema)>) -> String {
    // Keys with identical documentation share one entry.
    let mut pages: Vec<(String, Vec<String>)> = Vec::new();
    for (of, schema) in schemas {
        for (path, page) in mops_file::places_of(key, &schema) {
            let place = if path == key { of.clone() } else { format!("{of} ({path})") };
            match pages.iter_mut().find(|(known, _)| *known == page) {
                Some((_, places)) => places.push(place),
                None => pages.push((page, vec![place])),
            }
        }
    }
    let one = |(page, places): &(String, Vec<String>)| format!("`{key}` of {}\n\n{page}", places.join(", "));
    pages.iter().map(one).collect::<Vec<_>>().join("\n")
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
