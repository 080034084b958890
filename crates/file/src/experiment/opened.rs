//! Data files that an experiment has opened.

use std::cell::RefCell;
use std::io::ErrorKind;
use std::path::Path;
use std::sync::Arc;

use mops_data::{DataFile, SOURCES, source_of};
use mops_language::{
    Diagnostic,
    entries::Short,
    files::{Files, OutsideFolder},
};

use super::table::Table;
use crate::sections::{ExperimentSection, RecordedInput};
use crate::tree::Node;

/// Data files that an experiment has opened.
pub(crate) struct Opened<'a> {
    files: &'a dyn Files,
    known: RefCell<Vec<(String, Arc<DataFile>)>>,
}

impl<'a> Opened<'a> {
    /// Creates an empty list of files that are read from `files`.
    pub fn new(files: &'a dyn Files) -> Self {
        Self { files, known: RefCell::default() }
    }

    /// Returns what a reader of the files of an experiment should know.
    pub fn remarks(&self, section: &ExperimentSection, main: &Table) -> Vec<String> {
        let of = |file: &DataFile| {
            let name = format!("`{}`", file.source.name);
            file.remarks().into_iter().map(move |remark| format!("{name}: {remark}")).collect::<Vec<_>>()
        };
        self.of(section, main).iter().flat_map(|(file, _)| of(file)).collect()
    }

    /// Returns the columns of the files of an experiment that it does not use, with their units.
    pub fn unused(&self, section: &ExperimentSection, main: &Table) -> Vec<String> {
        let mut unused = Vec::new();
        for (file, used) in self.of(section, main) {
            for name in file.column_names() {
                let unit = file.column(&name).ok().and_then(|column| column.unit.map(|unit| format!(" [{unit}]")));
                if !used.iter().any(|used| file.is_same(used, &name)) {
                    unused.push(format!("{name}{}", unit.unwrap_or_default()));
                }
            }
        }
        unused
    }

    /// Returns the files of an experiment, with the columns that it uses.
    pub fn of(&self, section: &ExperimentSection, main: &Table) -> Vec<(Arc<DataFile>, Vec<String>)> {
        let mut files = vec![(Arc::clone(&main.file), vec![main.axis.column.clone()])];
        let channels = section.channels.0.iter().map(|(_, Short(c))| (&c.file, &c.column, &c.time));
        let inputs = section.inputs.0.iter().map(|(_, RecordedInput(u))| (&u.file, &u.column, &u.time));
        for (path, column, time) in channels.chain(inputs) {
            let known = self.known.borrow();
            let other = path.as_ref().and_then(|path| known.iter().find(|(own, _)| own == path));
            let file = other.map_or(&main.file, |(_, file)| file);
            let at = files.iter().position(|(own, _)| Arc::ptr_eq(own, file)).unwrap_or_else(|| {
                files.push((Arc::clone(file), file.time_column().into_iter().collect()));
                files.len() - 1
            });
            files[at].1.push(column.clone());
            files[at].1.extend(time.clone());
        }
        files
    }

    /// Opens the file that a key of a table names.
    pub fn open(&self, node: &Node<'_>, key: &str, path: &str) -> Result<Arc<DataFile>, Diagnostic> {
        if let Some((_, file)) = self.known.borrow().iter().find(|(known, _)| known == path) {
            return Ok(Arc::clone(file));
        }
        let file = Arc::new(open(node, key, path, self.files)?);
        self.known.borrow_mut().push((path.to_owned(), Arc::clone(&file)));
        Ok(file)
    }
}

fn open(node: &Node<'_>, key: &str, path: &str, files: &dyn Files) -> Result<DataFile, Diagnostic> {
    let shown = files.show(path);
    let error = match files.read(path) {
        Ok(bytes) => return DataFile::parse(&shown, bytes),
        Err(error) => error,
    };
    let mut way_out = None;
    let why = match error.kind() {
        ErrorKind::NotFound => {
            let sources = Path::new(path).with_file_name(SOURCES).to_string_lossy().into_owned();
            if let Ok(bytes) = files.read(&sources) {
                way_out = source_of(Path::new(&shown), &files.show(&sources), bytes)?;
            }
            format!("no data file `{shown}`")
        }
        ErrorKind::IsADirectory => format!("`{shown}` is a folder, not a data file"),
        _ if OutsideFolder::is_reason_of(&error) => {
            way_out = Some(OutsideFolder::HELP.to_owned());
            format!("the data file `{shown}` cannot be read: {error}")
        }
        _ => format!("the data file `{shown}` cannot be read: {error}"),
    };
    let place = node.child(key).expect("it was just read");
    Err(place
        .diagnostic(why)
        .with_help(way_out.as_deref().unwrap_or("paths are relative to the folder of the study file")))
}
