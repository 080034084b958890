//! `mops new`: a study to start from.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use mops_core::{Catalogue, CatalogueStudy, Diagnostic, suggestion};

use super::schema;
use crate::files;
use crate::terminal::{CommandError, print};

/// What is written.
#[derive(Args)]
pub(super) struct Arguments {
    /// Folder to make; its name becomes the study's.
    folder: PathBuf,
    /// Copy this shipped study, with its data, instead of the commented template.
    #[arg(long, value_name = "STUDY")]
    from: Option<String>,
}

/// The commented study; `{name}` is replaced.
const TEMPLATE: &str = include_str!("new.toml");

pub(super) fn new(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let Arguments { folder, from } = arguments;
    if folder.exists() {
        return Err(Diagnostic::new(format!("`{}` is already there", folder.display()))
            .with_help("give a folder that does not exist; nothing was written")
            .into());
    }
    let called = folder.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_else(|| "study".into());
    let called = called.replace(['"', '\\'], "-");
    let files: Vec<(&str, Vec<u8>)> = match from {
        Some(name) => {
            let names = catalogue.studies.iter().map(CatalogueStudy::name);
            let unknown = || Diagnostic::new(format!("no shipped study `{name}`")).with_help(suggestion(name, names));
            let CatalogueStudy::Shipped(study) = catalogue.study(name).ok_or_else(unknown)? else {
                return Err(Diagnostic::new(format!("`{name}` is not a study of files in the program"))
                    .with_help("copy its folder; a study built in Rust is copied in its crate")
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
    let schema = ("study.schema.json", schema::text(catalogue).into_bytes());
    for (path, bytes) in files.into_iter().chain([schema]) {
        let path = folder.join(path);
        let parent = path.parent().expect("it lies in the folder");
        std::fs::create_dir_all(parent).map_err(CommandError::cannot_write(parent))?;
        files::write(&path, bytes).map_err(CommandError::cannot_write(&path))?;
    }
    let study = folder.join("study.toml");
    print(&format!("wrote {}; try: mops run {}\n", study.display(), study.display()))?;
    if from.is_none() && catalogue.study(&called).is_some() {
        print(&format!("it is the commented template; `--from {called}` copies the shipped study of that name\n"))?;
    }
    Ok(ExitCode::SUCCESS)
}
