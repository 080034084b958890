//! A task as one room: performing it, its findings, and how they are shown.

use std::io;
use std::path::Path;
use std::sync::Arc;

use mops_content::section::{Block, Part, Section, Verdict};
use mops_core::catalogue::{Shipped, TaskKind};
use mops_core::run::Record;
use mops_core::task::{Place, TaskOptions};
use mops_core::{Effect, Evaluation, Problem, Stop, Study, Watch};
use mops_language::Diagnostic;
use mops_outcome::{BlockKind, Outcome};

use crate::search::{Options, SolveError, Solved, evaluate_start, search, solves};

/// A task above the core. Only [`Room::title`], [`Room::perform`] and [`Room::verdict`] have no default.
pub trait Room: Send + Sync {
    /// Returns the title of reports.
    fn title(&self) -> &'static str;

    /// Performs the task of a study.
    ///
    /// # Errors
    /// If the solver does not accept the problem.
    fn perform(&self, study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError>;

    /// Returns the command that performs the task whatever the task of the study; `None` for `mops run` alone.
    fn command(&self) -> Option<TaskCommand> {
        None
    }

    /// Returns the blocks that the task may add to `result.json`.
    fn blocks(&self) -> Vec<BlockKind> {
        Vec::new()
    }

    /// Judges the result.
    fn verdict(&self, of: &Solution<'_>) -> Judgement;

    /// Returns the findings for a report, which shows them first.
    fn findings(&self, _of: &Solution<'_>) -> Vec<Section> {
        Vec::new()
    }

    /// Returns further findings for a report, which shows them after the tables of criteria and tuners.
    fn details(&self, _of: &Solution<'_>) -> Vec<Section> {
        Vec::new()
    }

    /// Returns the findings for the terminal.
    fn lines(&self, _outcome: &Outcome) -> Vec<Block> {
        Vec::new()
    }

    /// Returns true if the result is a point: values of tuners and criteria.
    fn has_point(&self) -> bool {
        true
    }

    /// Returns facts for the head of a report, if the result is no point: name and value.
    fn facts(&self, _outcome: &Outcome) -> Vec<(String, String)> {
        Vec::new()
    }

    /// Returns true if each criterion is judged by its demand, not by its part of a sum.
    fn judges_demands(&self) -> bool {
        true
    }

    /// Returns the explanation of the table of criteria in a report.
    fn about_criteria(&self, _outcome: &Outcome) -> Vec<Part> {
        vec![Part::text(SCALED)]
    }

    /// Returns true if a report shows the Pareto optimality of the point.
    fn has_optimality(&self) -> bool {
        false
    }

    /// Returns true if the evaluations are those of a single search, so that its convergence can be plotted.
    fn has_convergence(&self, of: &Solution<'_>) -> bool {
        of.archive.len() > 1
    }

    /// Returns the sentence on a result without a search.
    fn not_solved(&self) -> &'static str {
        "Not solved: the initial guess was evaluated"
    }

    /// Returns the sentence on a study before it is solved; `None` for its numbers of tuners, criteria and cases.
    fn introduction(&self, _study: &Study) -> Option<String> {
        None
    }

    /// Returns true if the task evaluates points at other values of the uncertain parameters.
    fn samples_uncertain(&self, _study: &Study) -> bool {
        false
    }

    /// Returns true if the task evaluates points that can be stored.
    fn stores_points(&self, study: &Study) -> bool {
        solves(study) || self.samples_uncertain(study)
    }

    /// Returns the names of the files that the task may write beside the report.
    fn outputs(&self) -> OutputNames {
        OutputNames::default()
    }

    /// Returns the files that the task writes beside the report.
    fn files(&self, _of: &Solution<'_>, _origin: &Origin<'_>) -> Vec<OutputFile> {
        Vec::new()
    }

    /// Returns the name of the study that the task writes, if it writes one.
    fn written_study(&self) -> Option<&'static str> {
        None
    }

    /// Returns true if the task can write a program.
    fn can_export(&self) -> bool {
        false
    }

    /// Returns the name of the file from which an earlier result is restored; `None` if its evaluations are run again.
    fn restored_from(&self) -> Option<&'static str> {
        None
    }

    /// Returns the result of an earlier run from the content of the file [`Room::restored_from`].
    ///
    /// # Errors
    /// If the file cannot be read, or is none of the task.
    fn restored(
        &self,
        _study: &Study,
        _options: &Options,
        _content: io::Result<Vec<u8>>,
    ) -> Result<Solved, Diagnostic> {
        Err(Diagnostic::new("this task stores no findings"))
    }
}

/// Command of a task.
#[derive(Debug, Clone, Copy)]
pub struct TaskCommand {
    /// Name.
    pub name: &'static str,
    /// What it does, without a full stop.
    pub about: &'static str,
    /// Explanation and examples; may be empty.
    pub after_help: &'static str,
    /// True if the command takes a solver, a budget and stored evaluations.
    pub has_solver: bool,
    /// Options that set keys of the study.
    pub options: &'static [CommandOption],
}

/// Option of a command that sets a key of the study.
#[derive(Debug, Clone, Copy)]
pub struct CommandOption {
    /// Name, without its dashes.
    pub name: &'static str,
    /// Name of its value; `None` for an option without a value, which sets the key to true.
    pub value: Option<&'static str>,
    /// What it does, without a full stop.
    pub about: &'static str,
    /// Key of the study.
    pub key: &'static str,
}

/// What a scaled value is.
pub(crate) const SCALED: &str = "Scaled value = value / demand: 0 is ideal, at most 1 means the demand is met. ";

/// Judgement of a result, with what it rests on.
pub enum Judgement {
    /// Complete: nothing is added.
    Whole(Verdict),
    /// Of findings at a point, whose doubts come first.
    OfFindings(Verdict),
    /// Of a feasible point, whose doubts come first; another point is judged by its violation.
    OfPoint(Verdict),
}

/// Names of files that a task may write: files, and folders with the extensions of the files in them.
#[derive(Debug, Clone, Copy, Default)]
pub struct OutputNames {
    /// Files.
    pub files: &'static [&'static str],
    /// Folders.
    pub folders: &'static [(&'static str, &'static [&'static str])],
}

/// File that a task writes.
#[derive(Debug, Clone)]
pub struct OutputFile {
    /// Path within the folder of the run, with `/`.
    pub path: String,
    /// Content.
    pub bytes: Vec<u8>,
}

impl OutputFile {
    /// Creates a file.
    pub fn new(path: impl Into<String>, bytes: impl Into<Vec<u8>>) -> Self {
        Self { path: path.into(), bytes: bytes.into() }
    }
}

/// Where the study of a run comes from.
pub struct Origin<'a> {
    /// Text of the study without settings; `None` for a study built in Rust.
    pub text: Option<&'a str>,
    /// Settings of the command line.
    pub own: &'a [String],
    /// Settings of the command line, and those made by the command itself.
    pub settings: &'a [String],
    /// The study, if its files are in the program.
    pub shipped: Option<&'a Shipped>,
    /// Converts the path of a data file from relative to the study to relative to the folder of the run.
    pub locate: &'a dyn Fn(&str) -> String,
    /// Folder of the run.
    pub folder: &'a Path,
    /// Effects of the catalogue.
    pub effects: &'a [Arc<dyn Effect>],
    /// True if a program is asked for.
    pub is_exported: bool,
}

impl Origin<'_> {
    /// Returns the data files of a study whose files are in the program: a study in the folder of the run reads them
    /// there.
    pub fn data(&self) -> Vec<OutputFile> {
        let is_data =
            |name: &str| ["csv", "mat"].iter().any(|end| Path::new(name).extension().is_some_and(|e| e == *end));
        let files = self.shipped.iter().flat_map(|shipped| shipped.files.iter());
        files.filter(|(name, _)| is_data(name)).map(|(name, bytes)| OutputFile::new(*name, *bytes)).collect()
    }
}

/// Result of a run with what it rests on, for reports.
#[derive(Clone, Copy)]
pub struct Solution<'a> {
    /// Result of the run.
    pub outcome: &'a Outcome,
    /// Solved problem.
    pub problem: &'a Problem,
    /// Evaluation at the reported point.
    pub best: &'a Evaluation,
    /// All points in the order of evaluation; the first is the initial guess.
    pub archive: &'a [Record],
    /// Points of the Pareto front, in the order of the result; empty for other tasks.
    pub front: &'a [Evaluation],
}

impl<'a> From<&'a Solved> for Solution<'a> {
    fn from(solved: &'a Solved) -> Self {
        let Solved { outcome, problem, best, archive, front, .. } = solved;
        Self { outcome, problem, best, archive, front }
    }
}

impl Solution<'_> {
    /// Returns the name of the reported point: `optimum` only if the solver converged to a feasible point.
    pub fn best_name(&self) -> &'static str {
        if self.outcome.solver == "none" {
            "initial guess"
        } else if self.outcome.stop == Stop::Converged && self.outcome.feasible {
            "optimum"
        } else {
            "best point"
        }
    }
}

/// Returns the kind of a task with the options `O`, for a catalogue.
pub fn kind<O: TaskOptions>(room: impl Room + 'static) -> TaskKind {
    TaskKind::of::<O>(Arc::new(Box::new(room) as Box<dyn Room>))
}

/// Returns what performs a task.
///
/// # Panics
/// If the kind was not made by [`kind`].
pub fn room(kind: &TaskKind) -> &dyn Room {
    kind.room.downcast_ref::<Box<dyn Room>>().expect("kinds of tasks are made by `kind`").as_ref()
}

/// Returns what performs the task with a name.
pub fn room_of<'t>(tasks: &'t [TaskKind], name: &str) -> Option<&'t dyn Room> {
    tasks.iter().find(|kind| kind.name == name).map(room)
}

/// Returns the solution at which a task is performed: the start values, evaluated, or the optimum.
///
/// # Errors
/// If the solver does not accept the problem.
pub fn solve_at(place: Place, study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    match place {
        Place::Start => Ok(evaluate_start(study, options, watch)),
        Place::Optimum => search(study, options, watch),
    }
}
