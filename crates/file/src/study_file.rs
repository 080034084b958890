//! Study of a file, with what the file says beyond it.

use std::sync::Arc;

use mops_core::catalogue::SolverChoice;
use mops_core::study::{Study, StudyError};
use mops_language::{Diagnostic, Source};

use crate::tree::Text;

/// A study file, read and checked.
pub struct StudyFile {
    /// Study.
    pub study: Study,
    /// Solver of the study, or the first of the catalogue.
    pub solver: SolverChoice,
    /// Maximum number of evaluated points, if the study limits it.
    pub max_evaluations: Option<usize>,
    /// Text of the file, with the settings of the command line appended.
    pub source: Arc<Source>,
    /// Contents of the file, settings included, without comments and layout.
    pub content: serde_json::Value,
    /// Data files that were read: names as in the study, and digests of their bytes.
    pub data: Vec<(String, String)>,
    /// Digest of the program, if its own code computes values or builds the study ([`mops_core::Catalogue::program`]).
    pub program: Option<String>,
    pub(crate) text: Arc<Text>,
}

impl StudyFile {
    /// Returns the diagnostic of an error that occurred when the study was run, with its location in the text.
    pub fn locate(&self, mistake: &StudyError) -> Diagnostic {
        match self.text.parse() {
            Ok(root) => self.text.settle(root.locate(mistake)),
            Err(_) => Diagnostic { help: mistake.help.clone(), ..Diagnostic::new(mistake.message.clone()) },
        }
    }
}
