//! `mops list`: what is there.

use std::process::ExitCode;

use mops_core::Catalogue;

use super::tables::table;
use super::{Trouble, print};

pub(super) fn list(catalogue: &Catalogue) -> Result<ExitCode, Trouble> {
    let first_line = |schema: schemars::Schema| {
        let about = schema.as_value().get("description").and_then(|d| d.as_str()).unwrap_or_default().to_owned();
        about.split(['\n', ':', '.', ';']).next().unwrap_or_default().to_owned()
    };
    let row = |name: &str, about: String| vec![format!("  {name}"), about];
    let studies = catalogue.studies.iter().map(|study| {
        let readme = study.file("README.md").map(String::from_utf8_lossy).unwrap_or_default();
        row(study.name, readme.lines().next().unwrap_or_default().trim_start_matches('#').trim().to_owned())
    });
    let models = catalogue.models.iter().map(|k| row(k.name, first_line((k.schema)())));
    let criteria = catalogue.criteria.iter().map(|k| row(k.name, first_line((k.schema)())));
    let solvers = catalogue.solvers.iter().map(|k| row(k.name, first_line((k.schema)())));
    let text = [
        ("studies (mops run NAME)", studies.collect()),
        ("models", models.collect()),
        ("criteria", criteria.collect()),
        ("solvers", solvers.collect::<Vec<_>>()),
    ]
    .map(|(title, rows)| table(&[title, ""], &[], rows))
    .join("\n");
    print(&format!("{text}\nmops describe NAME tells all of one.\n"));
    Ok(ExitCode::SUCCESS)
}
