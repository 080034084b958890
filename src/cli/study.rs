//! Opens studies: files, folders, shipped ones.

use std::convert::Infallible;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

use clap::Args;
use mops_core::file::{Folder, StudyFile};
use mops_core::{BuiltStudy, Catalogue, CatalogueStudy, Diagnostic, Shipped, Source, StudyFolder, suggestion};

use crate::toml_text::quoted;

/// Which study, and what goes over it.
#[derive(Args)]
pub(super) struct StudyArguments {
    /// A study file, or the name of a shipped study (see `mops list`).
    pub study: String,
    /// Replace or add a value of the study: --set tuners.k.start=5 --set study.task=sensitivity. What is not TOML is a text.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = as_toml)]
    pub settings: Vec<String>,
}

/// Where a study and its data are.
pub(super) enum Home {
    /// In a file; data are in its folder.
    File(PathBuf),
    /// Files in the program.
    Shipped(Shipped),
    /// Built in Rust.
    Built(BuiltStudy),
}

/// Where the study is; a folder stands for the study in it.
pub(super) fn home(catalogue: &Catalogue, arguments: &StudyArguments) -> Home {
    let path = Path::new(&arguments.study);
    match catalogue.study(&arguments.study).filter(|_| !path.is_file()) {
        Some(known) => Home::of(known),
        None if path.is_dir() => Home::File(path.join("study.toml")),
        None => Home::File(path.to_owned()),
    }
}

impl Home {
    /// Returns the place of a study of the catalogue.
    fn of(known: &CatalogueStudy) -> Self {
        match known {
            CatalogueStudy::Shipped(shipped) => Self::Shipped(*shipped),
            CatalogueStudy::Folder(folder) => Self::File(folder.file()),
            CatalogueStudy::Built(built) => Self::Built(built.clone()),
            other => unreachable!("`{}` is of a sort that this program does not know", other.name()),
        }
    }
}

/// Reads and checks a study.
pub(super) fn open(catalogue: &Catalogue, arguments: &StudyArguments) -> Result<StudyFile, Diagnostic> {
    open_as(catalogue, arguments, &[])
}

/// A setting as TOML: a value that is none is a text, `criteria.settling.demand=12 s`. Values that begin as TOML does, and
/// numbers with a decimal comma, are left as they are, so that their mistakes are told.
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

/// The same with more settings.
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
        Home::Shipped(shipped) => return shipped.open(catalogue, settings),
        Home::Built(built) => return mops_core::file::built(catalogue, &built, settings, &program()),
    };
    let bytes = read_text(&path).map_err(|error| no_study(catalogue, study, &error))?;
    let source = Source::from_bytes(&path.display().to_string(), bytes)?;
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    mops_core::file::read(catalogue, &source.name, &source.text, settings, &Folder(folder))
}

/// Text of a file of a study: of one in the program or in a folder.
pub(super) fn text_of(study: &CatalogueStudy, name: &str) -> Option<String> {
    match study {
        CatalogueStudy::Shipped(shipped) => shipped.file(name).map(|bytes| String::from_utf8_lossy(bytes).into_owned()),
        CatalogueStudy::Folder(folder) => std::fs::read_to_string(folder.path().join(name)).ok(),
        _ => None,
    }
}

/// Digest of this program, which builds studies in Rust: another build may give other values.
fn program() -> String {
    let bytes = std::env::current_exe().and_then(std::fs::read);
    bytes.map_or_else(|_| String::new(), |bytes| mops_core::file::digest(&bytes))
}

/// Adds the studies in `folders` to the catalogue: every folder in them that has a `study.toml`, by its name.
///
/// # Errors
/// A folder cannot be read.
pub(super) fn with_folders(mut catalogue: Catalogue, folders: &[PathBuf]) -> Result<Catalogue, Diagnostic> {
    for folder in folders {
        let cannot = |error: std::io::Error| {
            Diagnostic::new(format!("the folder of studies {} cannot be read: {error}", folder.display()))
                .with_help("name a folder of study folders, in --studies or in the variable MOPS_STUDIES")
        };
        let mut paths = Vec::new();
        for entry in std::fs::read_dir(folder).map_err(cannot)? {
            paths.push(entry.map_err(cannot)?.path());
        }
        paths.sort();
        for study in paths.iter().filter_map(|path| StudyFolder::open(path)) {
            catalogue = catalogue.with_study(study);
        }
    }
    Ok(catalogue)
}

/// Bytes of a study, at most: what has no end, such as a device, ends there.
const LONGEST: u64 = 64 << 20;

/// The bytes of a study; it may come out of a pipe.
fn read_text(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    std::fs::File::open(path)?.take(LONGEST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LONGEST {
        return Err(std::io::Error::other(format!("it is longer than {} MiB, and so no study", LONGEST >> 20)));
    }
    Ok(bytes)
}

/// Reads a study whose text is known; `home` is the file it was in, or the name of a shipped study.
pub(super) fn read_at(
    catalogue: &Catalogue,
    home: &Path,
    text: &str,
    settings: &[String],
) -> Result<StudyFile, Diagnostic> {
    let name = home.display().to_string();
    match catalogue.study(&name) {
        Some(CatalogueStudy::Shipped(shipped)) => {
            return mops_core::file::read(catalogue, &format!("{name}/study.toml"), text, settings, shipped);
        }
        Some(CatalogueStudy::Built(built)) => return mops_core::file::built(catalogue, built, settings, &program()),
        _ => {}
    }
    let folder = home.parent().unwrap_or(Path::new("")).to_owned();
    mops_core::file::read(catalogue, &name, text, settings, &Folder(folder))
}

/// The text of a study file as it was before settings of the command line were put at its end.
pub(super) fn without_settings<'t>(text: &'t str, settings: &[String]) -> &'t str {
    let all: String = settings.iter().map(|setting| format!("# --set {setting}\n")).collect();
    text.strip_suffix(all.as_str()).unwrap_or(text)
}

fn no_study(catalogue: &Catalogue, study: &str, error: &std::io::Error) -> Diagnostic {
    let path = Path::new(study);
    if path.is_dir() {
        return Diagnostic::new(format!("the folder `{study}` has no study.toml"))
            .with_help("name the study file; `mops new` writes one into a folder that is not there yet");
    }
    if error.kind() != ErrorKind::NotFound {
        return Diagnostic::new(format!("`{study}` cannot be read: {error}")).with_help("check its permissions");
    }
    if path.extension().is_some() || path.components().count() > 1 {
        return Diagnostic::new(format!("there is no file `{study}`"))
            .with_help("`mops new` writes a study to start from; `mops list` names the shipped ones");
    }
    let names = catalogue.studies.iter().map(CatalogueStudy::name);
    Diagnostic::new(format!("there is no file `{study}`, nor a shipped study of that name"))
        .with_help(suggestion(study, names))
}
