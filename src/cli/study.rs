//! Opens studies, and shows what is wrong with them.

use std::borrow::Cow;
use std::convert::Infallible;
use std::io::{ErrorKind, IsTerminal, Read, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::Args;
use miette::{GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteDiagnostic, NamedSource, Report};
use mops_core::file::{Files, StudyFile};
use mops_core::{Catalogue, Diagnostic, Shipped, Source, suggestion};

use crate::files;
use crate::plain::plain;
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

/// Characters of a line that are shown on either side of a mistake.
const AROUND: usize = 200;

/// A text as it is shown, with a place in it: without control characters, and of long lines what is near the place. The lines
/// keep their numbers.
fn shown(text: &str, place: Range<usize>) -> (String, Range<usize>) {
    let (mut shown, mut start, mut end) = (String::new(), None, None);
    let mut offset = 0;
    for line in text.split_inclusive('\n') {
        let after = offset + line.len();
        let body = line.trim_end_matches('\n').trim_end_matches('\r');
        let is_last = after == text.len() && body.len() == line.len();
        // Of other lines the beginning is shown.
        let is_here = (offset..after).contains(&place.start) || is_last && place.start == after;
        let here = if is_here { (place.start - offset).min(body.len()) } else { 0 };
        let from = body[..here].char_indices().rev().nth(AROUND - 1).map_or(0, |(i, _)| i);
        let to = body[here..].char_indices().nth(AROUND).map_or(body.len(), |(i, _)| here + i);
        shown.push_str(if from > 0 { "... " } else { "" });
        for (i, c) in body[from..to].char_indices() {
            let i = offset + from + i;
            start = start.or((i >= place.start).then_some(shown.len()));
            end = end.or((i >= place.end).then_some(shown.len()));
            shown.push_str(&plain(c.encode_utf8(&mut [0; 4])));
        }
        start = start.or(is_here.then_some(shown.len()));
        end = end.or((after > place.end || is_last).then_some(shown.len()));
        shown.push_str(if to < body.len() { " ..." } else { "" });
        shown.push_str(if is_last { "" } else { "\n" });
        offset = after;
    }
    let start = start.unwrap_or(shown.len());
    (shown, start..end.unwrap_or(start).max(start))
}

/// Shows a mistake on standard error: file, line and column, the fact, the source line, the way out.
pub(super) fn show(diagnostic: &Diagnostic) {
    let mut shown = MietteDiagnostic::new(plain(&diagnostic.message));
    shown.help = diagnostic.help.as_deref().map(plain).map(Cow::into_owned);
    let report = match &diagnostic.place {
        Some((source, span)) if !source.text.is_empty() && *span != (0..0) => {
            let label =
                diagnostic.label.as_deref().map_or_else(|| "here".to_owned(), |label| plain(label).into_owned());
            let (start, end) = (span.start.min(source.text.len()), span.end.min(source.text.len()));
            let (start, end) = (source.text.floor_char_boundary(start), source.text.floor_char_boundary(end));
            // A mistake spanning lines is pointed at by its first.
            let end = source.text[start..end].find('\n').map_or(end, |first| start + first);
            let (text, span) = self::shown(&source.text, start..end);
            shown.labels = Some(vec![LabeledSpan::at(span, label)]);
            // N.B.: the line and the column are ours, since miette counts columns in bytes.
            let (line, column) = diagnostic.line_column().expect("it has a place");
            let place = format!("{}:{line}:{column}", plain(&source.name));
            Report::new(shown).with_source_code(NamedSource::new(place, text))
        }
        Some((source, _)) => {
            shown.message = format!("{}: {}", plain(&source.name), shown.message);
            Report::new(shown)
        }
        None => Report::new(shown),
    };
    let stderr = std::io::stderr();
    let theme = if stderr.is_terminal() { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
    let mut text = String::new();
    let handler = GraphicalReportHandler::new_themed(theme).without_primary_span_start().with_wrap_lines(false);
    if handler.render_report(&mut text, report.as_ref()).is_err() {
        text = plain(&diagnostic.to_string()).into_owned();
    }
    let _ = writeln!(stderr.lock(), "{text}");
}
