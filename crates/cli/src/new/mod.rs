//! `mops new`: writes a study template.

mod from_data;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use mops_core::{Catalogue, catalogue::CatalogueStudy};
use mops_language::{Diagnostic, plain::acts, suggestion};
use mops_output::Outputs;

use super::schema;
use crate::terminal::{CommandError, print};

/// Arguments of `mops new`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Folder to create; its name becomes the name of the study.
    folder: PathBuf,
    /// Commented template.
    #[arg(long, default_value = "pid", conflicts_with_all = ["from", "from_data"])]
    template: Template,
    /// Copy this shipped study, with its data, instead of a template.
    #[arg(long, value_name = "STUDY", conflicts_with = "from_data")]
    from: Option<String>,
    /// Write a calibration of a linear model of order 2 for every output in this data file, with a copy of the data.
    #[arg(long, value_name = "FILE")]
    from_data: Option<PathBuf>,
    /// Time column [default: `t`, `time`, `Zeit` and the like, or the first column of time stamps].
    #[arg(long, value_name = "COLUMN", requires = "from_data")]
    time: Option<String>,
    /// Columns that are inputs [default: by their names and units].
    #[arg(long, value_name = "COLUMNS", value_delimiter = ',', requires = "from_data")]
    inputs: Option<Vec<String>>,
    /// Columns that are outputs [default: all others].
    #[arg(long, value_name = "COLUMNS", value_delimiter = ',', requires = "from_data")]
    outputs: Option<Vec<String>>,
}

/// Commented study templates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Template {
    /// PID controller of a plant given by its poles.
    Pid,
    /// Plant in equations, with a controller, cases and the margins of its loop.
    Equations,
    /// State feedback of a plant in equations.
    StateFeedback,
}

impl Template {
    /// Returns the text; `{name}` is replaced by the name of the study.
    fn text(self) -> &'static str {
        match self {
            Self::Pid => include_str!("pid.toml"),
            Self::Equations => include_str!("equations.toml"),
            Self::StateFeedback => include_str!("state-feedback.toml"),
        }
    }
}

pub(super) fn new(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let Arguments { folder, template, from, from_data, time, inputs, outputs } = arguments;
    if folder.symlink_metadata().is_ok() {
        return Err(Diagnostic::new(format!("`{}` already exists", folder.display()))
            .with_help("name a new folder; nothing was written")
            .into());
    }
    let called = folder.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_else(|| "study".into());
    // The name is written between quotation marks, where these characters would end it or not be valid.
    let called: String = called.chars().map(|c| if acts(c) || "\"\\\n\t".contains(c) { '-' } else { c }).collect();
    let files: Vec<(&Path, Vec<u8>)> = match (from, from_data) {
        (_, Some(data)) => {
            let copy = data.file_name().map_or(data.as_path(), Path::new);
            let copy = if copy == Path::new("study.toml") { Path::new("data.csv") } else { copy };
            let bytes = from_data::bytes(data)?;
            let chosen =
                from_data::Chosen { time: time.as_deref(), inputs: inputs.as_deref(), outputs: outputs.as_deref() };
            let text = from_data::study(&called, data, &copy.to_string_lossy(), &chosen)?;
            vec![(Path::new("study.toml"), text.into_bytes()), (copy, bytes)]
        }
        (Some(name), None) => {
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
                (Path::new(path), if path == "study.toml" { own(bytes) } else { bytes.to_vec() })
            };
            study.files.iter().map(of).collect()
        }
        (None, None) => {
            vec![(Path::new("study.toml"), template.text().replace("{name}", &called).into_bytes())]
        }
    };
    // N.B.: the folder is new, and no file that was read lies there.
    let outputs = Outputs::default();
    let schema = (Path::new("study.schema.json"), schema::text(schema::File::Study, catalogue).into_bytes());
    for (path, bytes) in files.into_iter().chain([schema]) {
        let path = folder.join(path);
        let parent = path.parent().expect("it lies in the folder");
        std::fs::create_dir_all(parent).map_err(CommandError::cannot_write(parent))?;
        outputs.write(&path, bytes).map_err(CommandError::cannot_write(&path))?;
    }
    let study = folder.join("study.toml");
    print(&format!("wrote {}; try: mops run {}\n", study.display(), study.display()))?;
    if from.is_none() && from_data.is_none() && catalogue.study(&called).is_some() {
        print(&format!(
            "note: this is the commented template; `--from {called}` copies the shipped study of that name\n"
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}
