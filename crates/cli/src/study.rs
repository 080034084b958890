//! Opening of studies: files, folders, shipped and built studies.

use std::convert::Infallible;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

use clap::Args;
use mops_core::{
    Catalogue,
    catalogue::{CatalogueStudy, StudyFolder},
};
use mops_file::{StudyFile, edit::quoted};
use mops_language::{Diagnostic, Source, suggestion};
use mops_output::{Inputs, Outputs};

use super::home::Home;
use super::reading;

/// Study and settings that override it.
#[derive(Args)]
pub(super) struct StudyArguments {
    /// Study file, or name of a shipped study (see `mops list`).
    pub study: String,
    /// Set a value of the study: --set tuners.k.start=5 --set study.task=sensitivity. A value that is not TOML is a
    /// string.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = as_toml)]
    pub settings: Vec<String>,
}

/// Returns the location of the study; a folder means the study.toml in it.
pub(super) fn home(catalogue: &Catalogue, arguments: &StudyArguments) -> Home {
    let path = Path::new(&arguments.study);
    match catalogue.study(&arguments.study).filter(|_| !path.is_file()) {
        Some(known) => Home::of(known),
        None if path.is_dir() => Home::File(path.join("study.toml")),
        None => Home::File(path.to_owned()),
    }
}

/// Returns the writer of a command that reads this study: it replaces neither the study nor its data.
pub(super) fn outputs(home: &Home, file: &StudyFile) -> Outputs {
    Outputs::besides(inputs(home, file))
}

/// Returns the files that a study consists of; those in the program need no protection.
pub(super) fn inputs(home: &Home, file: &StudyFile) -> Inputs {
    let mut inputs = Inputs::default();
    if let Home::File(path) = home {
        inputs.add(path, "the study");
        for (name, _) in &file.data {
            inputs.add(&path.with_file_name("").join(name), &format!("the data file `{name}` of the study"));
        }
    }
    inputs
}

/// Reads and checks a study.
pub(super) fn open(catalogue: &Catalogue, arguments: &StudyArguments) -> Result<StudyFile, Diagnostic> {
    open_as(catalogue, arguments, &[])
}

/// Converts a setting to TOML: a value that is not TOML becomes a string, `criteria.settling.demand=12 s`. Values that
/// start like TOML, and numbers with a decimal comma, stay as they are, so that their errors are reported.
fn as_toml(setting: &str) -> Result<String, Infallible> {
    let is_toml = toml::de::DeTable::parse(setting).is_ok();
    let Some((key, value)) = setting.split_once('=').filter(|_| !is_toml) else { return Ok(setting.to_owned()) };
    let value = value.trim();
    let is_decimal_comma = value.contains(',') && value.chars().all(|c| c.is_ascii_digit() || "+-,.".contains(c));
    if value.is_empty() || value.starts_with(['"', '\'', '{', '[']) || is_decimal_comma {
        return Ok(setting.to_owned());
    }
    Ok(format!("{key}={}", quoted(value)))
}

/// Reads and checks a study with additional settings.
pub(super) fn open_as(
    catalogue: &Catalogue,
    arguments: &StudyArguments,
    more: &[String],
) -> Result<StudyFile, Diagnostic> {
    let StudyArguments { study, settings } = arguments;
    let settings: Vec<String> = settings.iter().chain(more).cloned().collect();
    let settings = settings.as_slice();
    let path = match home(catalogue, arguments) {
        Home::File(path) => path,
        Home::Shipped(shipped) => return mops_file::read_shipped(catalogue, &shipped, settings),
        Home::Built(built) => return mops_file::built(catalogue, &built, settings),
    };
    let bytes = read_text(&path).map_err(|error| no_study(catalogue, study, &error))?;
    let source = Source::from_bytes(&path.display().to_string(), bytes)?;
    mops_file::read(catalogue, &source.name, &source.text, settings, &reading::folder(catalogue, &path))
}

/// Returns the text of a file of a shipped study or of a study folder.
pub(super) fn text_of(study: &CatalogueStudy, name: &str) -> Option<String> {
    match study {
        CatalogueStudy::Shipped(shipped) => shipped.file(name).map(|bytes| String::from_utf8_lossy(bytes).into_owned()),
        CatalogueStudy::Folder(folder) => std::fs::read_to_string(folder.path().join(name)).ok(),
        _ => None,
    }
}

/// Returns the digest of this program: another build may compute other values.
///
/// # Errors
/// If the program cannot be read.
pub(super) fn digest_of_program() -> Result<String, Diagnostic> {
    let bytes = std::env::current_exe().and_then(std::fs::read).map_err(|error| {
        Diagnostic::new(format!("cannot read this program, whose digest identifies its runs: {error}"))
            .with_help("give the user read permission for it")
    })?;
    Ok(mops_file::digest(&bytes))
}

/// Adds the studies in `folders` to the catalogue: every subfolder that has a `study.toml`. A folder that is given
/// twice is read once.
///
/// # Errors
/// If a folder cannot be read, or two studies have one name.
pub(super) fn with_folders(mut catalogue: Catalogue, folders: &[PathBuf]) -> Result<Catalogue, Diagnostic> {
    let mut seen = Vec::new();
    for folder in folders {
        let cannot = |error: std::io::Error| {
            Diagnostic::new(format!("cannot read the folder of studies {}: {error}", folder.display()))
                .with_help("set --studies or MOPS_STUDIES to a folder of study folders")
        };
        let real = folder.canonicalize().map_err(cannot)?;
        if seen.contains(&real) {
            continue;
        }
        seen.push(real);
        let mut paths = Vec::new();
        for entry in std::fs::read_dir(folder).map_err(cannot)? {
            paths.push(entry.map_err(cannot)?.path());
        }
        paths.sort();
        for study in paths.iter().filter_map(|path| StudyFolder::open(path)) {
            catalogue = catalogue.with_study(study);
        }
    }
    catalogue.check_names()?;
    Ok(catalogue)
}

/// Largest size of a study in bytes; also limits endless sources such as devices.
const LONGEST: u64 = 64 << 20;

/// Reads the bytes of a study, also from a pipe.
fn read_text(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    std::fs::File::open(path)?.take(LONGEST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LONGEST {
        return Err(std::io::Error::other(format!("not a study: larger than {} MiB", LONGEST >> 20)));
    }
    Ok(bytes)
}

/// Reads a study from its text; `home` is its original file, or the name of a shipped study.
pub(super) fn read_at(
    catalogue: &Catalogue,
    home: &Path,
    text: &str,
    settings: &[String],
) -> Result<StudyFile, Diagnostic> {
    let name = home.display().to_string();
    match catalogue.study(&name) {
        Some(CatalogueStudy::Shipped(shipped)) => {
            return mops_file::read(catalogue, &format!("{name}/study.toml"), text, settings, shipped);
        }
        Some(CatalogueStudy::Built(built)) => return mops_file::built(catalogue, built, settings),
        // Only a study built in Rust has no text.
        None if text.trim().is_empty() => {
            return Err(Diagnostic::new(format!("this program has no study `{name}`, which was built in Rust"))
                .with_help("use the program that made the run"));
        }
        _ => {}
    }
    mops_file::read(catalogue, &name, text, settings, &reading::folder(catalogue, home))
}

/// Returns the text of a study file without the settings of the command line that were appended to it.
pub(super) fn without_settings<'t>(text: &'t str, settings: &[String]) -> &'t str {
    let all: String = settings.iter().map(|setting| format!("# --set {setting}\n")).collect();
    text.strip_suffix(all.as_str()).unwrap_or(text)
}

fn no_study(catalogue: &Catalogue, study: &str, error: &std::io::Error) -> Diagnostic {
    let path = Path::new(study);
    if path.is_dir() {
        return Diagnostic::new(format!("the folder `{study}` has no study.toml"))
            .with_help("name the study file; `mops new` writes one into a new folder");
    }
    if error.kind() != ErrorKind::NotFound {
        return Diagnostic::new(format!("cannot read `{study}`: {error}")).with_help("check its permissions");
    }
    if path.extension().is_some() || path.components().count() > 1 {
        return Diagnostic::new(format!("there is no file `{study}`"))
            .with_help("`mops new` writes a template; `mops list` lists the shipped studies");
    }
    let names = catalogue.studies.iter().map(CatalogueStudy::name);
    Diagnostic::new(format!("there is no file and no shipped study `{study}`")).with_help(suggestion(study, names))
}
