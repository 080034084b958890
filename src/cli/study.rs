//! Opens studies, and shows what is wrong with them.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use miette::{GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteDiagnostic, NamedSource, Report};
use mops_core::file::{Files, StudyFile};
use mops_core::{Catalogue, Diagnostic, Shipped, suggestion};

/// Which study, and what goes over it.
#[derive(Args)]
pub(super) struct StudyArguments {
    /// A study file, or the name of a shipped study (see `mops list`).
    pub study: String,
    /// Replace or add a value of the study: --set tuners.k.start=5.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<String>,
}

/// Data files in the folder of a study file.
struct Folder(PathBuf);

impl Files for Folder {
    fn read(&self, path: &str) -> std::io::Result<Vec<u8>> {
        std::fs::read(self.0.join(path))
    }

    fn show(&self, path: &str) -> String {
        self.0.join(path).display().to_string()
    }
}

/// Data files of a shipped study.
struct Inside(Shipped);

impl Files for Inside {
    fn read(&self, path: &str) -> std::io::Result<Vec<u8>> {
        self.0.file(path).map(<[u8]>::to_vec).ok_or_else(|| std::io::ErrorKind::NotFound.into())
    }

    fn show(&self, path: &str) -> String {
        format!("{}/{path}", self.0.name)
    }
}

/// Reads and checks a study.
pub(super) fn open(catalogue: &Catalogue, arguments: &StudyArguments) -> Result<StudyFile, Diagnostic> {
    let StudyArguments { study, settings } = arguments;
    let path = Path::new(study);
    let shipped = catalogue.studies.iter().find(|s| s.name == study);
    if let (Some(shipped), false) = (shipped, path.is_file()) {
        let text = shipped.file("study.toml").expect("every shipped study has one");
        let text = std::str::from_utf8(text).expect("shipped studies are text");
        return mops_core::file::read(catalogue, &format!("{study}/study.toml"), text, settings, &Inside(*shipped));
    }
    // A folder stands for the study in it.
    let path = if path.is_dir() { path.join("study.toml") } else { path.to_owned() };
    let text = std::fs::read(&path).map_err(|error| no_study(catalogue, study, &error))?;
    let text = String::from_utf8(text).map_err(|_| {
        Diagnostic::new(format!("`{study}` is not a text in UTF-8")).with_help("a study is a TOML file; see `mops new`")
    })?;
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    mops_core::file::read(catalogue, &path.display().to_string(), &text, settings, &Folder(folder))
}

fn no_study(catalogue: &Catalogue, study: &str, error: &std::io::Error) -> Diagnostic {
    let names = catalogue.studies.iter().map(|s| s.name);
    Diagnostic::new(format!("no study `{study}`: {error}"))
        .with_help(format!("give a study file, or a shipped study; {}", suggestion(study, names)))
}

/// Shows a mistake on standard error: file, line and column, the fact, the source line, the way out.
pub(super) fn show(diagnostic: &Diagnostic) {
    let mut shown = MietteDiagnostic::new(diagnostic.message.clone());
    shown.help.clone_from(&diagnostic.help);
    let report = match &diagnostic.place {
        Some((source, span)) if !source.text.is_empty() => {
            let label = diagnostic.label.clone().unwrap_or_else(|| "here".into());
            let (start, end) = (span.start.min(source.text.len()), span.end.min(source.text.len()));
            let (start, end) = (source.text.floor_char_boundary(start), source.text.floor_char_boundary(end));
            // A mistake spanning lines is pointed at by its first.
            let end = source.text[start..end].find('\n').map_or(end, |first| start + first);
            shown.labels = Some(vec![LabeledSpan::at(start..end, label)]);
            Report::new(shown).with_source_code(NamedSource::new(&source.name, source.text.clone()))
        }
        Some((source, _)) => {
            shown.message = format!("{}: {}", source.name, shown.message);
            Report::new(shown)
        }
        None => Report::new(shown),
    };
    let stderr = std::io::stderr();
    let theme = if stderr.is_terminal() { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
    let mut text = String::new();
    let handler = GraphicalReportHandler::new_themed(theme).with_width(110);
    if handler.render_report(&mut text, report.as_ref()).is_err() {
        text = diagnostic.to_string();
    }
    let _ = writeln!(stderr.lock(), "{text}");
}
