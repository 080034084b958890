//! `mops new`: writes a study template.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use mops_core::{Catalogue, CatalogueStudy, Diagnostic, suggestion};

use super::schema;
use crate::files;
use crate::terminal::{CommandError, print};

/// Arguments of `mops new`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Folder to create; its name becomes the name of the study.
    folder: PathBuf,
    /// Copy this shipped study, with its data, instead of the commented template.
    #[arg(long, value_name = "STUDY")]
    from: Option<String>,
}

/// Commented study template; `{name}` is replaced.
const TEMPLATE: &str = include_str!("new.toml");

pub(super) fn new(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let Arguments { folder, from } = arguments;
    if folder.exists() {
        return Err(Diagnostic::new(format!("`{}` already exists", folder.display()))
            .with_help("name a new folder; nothing was written")
            .into());
    }
    let called = folder.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_else(|| "study".into());
    let called = called.replace(['"', '\\'], "-");
    let files: Vec<(&str, Vec<u8>)> = match from {
        Some(name) => {
            let names = catalogue.studies.iter().map(CatalogueStudy::name);
            let unknown = || Diagnostic::new(format!("no shipped study `{name}`")).with_help(suggestion(name, names));
            let CatalogueStudy::Shipped(study) = catalogue.study(name).ok_or_else(unknown)? else {
                return Err(Diagnostic::new(format!("`{name}` is not a shipped study"))
                    .with_help("copy its folder, or for a study built in Rust its source code")
                    .into());
            };
            let own = |bytes: &[u8]| match std::str::from_utf8(bytes) {
                Ok(text) => text
                    .replacen(&format!("name = \"{}\"", study.name), &format!("name = \"{called}\""), 1)
                    .into_bytes(),
                Err(_) => bytes.to_vec(),
            };
            let of = |&(path, bytes): &(&'static str, &[u8])| {
                (path, if path == "study.toml" { own(bytes) } else { bytes.to_vec() })
            };
            study.files.iter().map(of).collect()
        }
        None => {
            vec![("study.toml", TEMPLATE.replace("{name}", &called).into_bytes())]
        }
    };
    let schema = ("study.schema.json", schema::text(schema::File::Study, catalogue).into_bytes());
    for (path, bytes) in files.into_iter().chain([schema]) {
        let path = folder.join(path);
        let parent = path.parent().expect("it lies in the folder");
        std::fs::create_dir_all(parent).map_err(CommandError::cannot_write(parent))?;
        files::write(&path, bytes).map_err(CommandError::cannot_write(&path))?;
    }
    let study = folder.join("study.toml");
    print(&format!("wrote {}; try: mops run {}\n", study.display(), study.display()))?;
    if from.is_none() && catalogue.study(&called).is_some() {
        print(&format!(
            "note: this is the commented template; `--from {called}` copies the shipped study of that name\n"
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}
