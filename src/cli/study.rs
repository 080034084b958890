//! Opens studies: files, folders, shipped ones.

use std::convert::Infallible;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

use clap::Args;
use mops_core::file::{Files, StudyFile};
use mops_core::{Catalogue, Diagnostic, Shipped, Source, suggestion};

use crate::files;
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

/// Data files in the folder of a study file.
struct Folder(PathBuf);

impl Files for Folder {
    fn read(&self, path: &str) -> std::io::Result<Vec<u8>> {
        files::read(&self.0.join(path))
    }

    fn show(&self, path: &str) -> String {
        self.0.join(path).display().to_string()
    }
}

/// Data files of a shipped study.
struct Inside(Shipped);

impl Files for Inside {
    fn read(&self, path: &str) -> std::io::Result<Vec<u8>> {
        self.0.file(path).map(<[u8]>::to_vec).ok_or_else(|| ErrorKind::NotFound.into())
    }

    fn show(&self, path: &str) -> String {
        format!("{}/{path}", self.0.name)
    }
}

/// Where a study and its data are.
pub(super) enum Home {
    /// In a file; data are in its folder.
    File(PathBuf),
    /// In the program.
    Shipped(Shipped),
}

/// Where the study is; a folder stands for the study in it.
pub(super) fn home(catalogue: &Catalogue, arguments: &StudyArguments) -> Home {
    let path = Path::new(&arguments.study);
    match catalogue.studies.iter().find(|s| s.name == arguments.study) {
        Some(shipped) if !path.is_file() => Home::Shipped(*shipped),
        _ if path.is_dir() => Home::File(path.join("study.toml")),
        _ => Home::File(path.to_owned()),
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
        Home::Shipped(shipped) => {
            let text = shipped.file("study.toml").expect("every shipped study has one");
            let text = std::str::from_utf8(text).expect("shipped studies are text");
            return mops_core::file::read(catalogue, &format!("{study}/study.toml"), text, settings, &Inside(shipped));
        }
    };
    let bytes = read_text(&path).map_err(|error| no_study(catalogue, study, &error))?;
    let source = Source::from_bytes(&path.display().to_string(), bytes)?;
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    mops_core::file::read(catalogue, &source.name, &source.text, settings, &Folder(folder))
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
    if let Some(shipped) = catalogue.studies.iter().find(|shipped| home == Path::new(shipped.name)) {
        return mops_core::file::read(catalogue, &format!("{name}/study.toml"), text, settings, &Inside(*shipped));
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
    let names = catalogue.studies.iter().map(|s| s.name);
    Diagnostic::new(format!("there is no file `{study}`, nor a shipped study of that name"))
        .with_help(suggestion(study, names))
}
