//! Names that a task needs, to be imported at once: `use mops_tasks::prelude::*;`.

pub use mops_content::figures::{Figure, Group};
pub use mops_content::plot::{Curve, CurveStyle, Plot};
pub use mops_content::section::{Block, Part, Section, Tone, Verdict};
pub use mops_content::table::{Cell, Table};
pub use mops_core::run::{Budget, Record};
pub use mops_core::task::{Place, TaskOptions, TaskSpec};
pub use mops_core::{Evaluation, Oracle, Problem, Run, Study, StudyError, Watch};
pub use mops_outcome::{BlockKind, Finding, Outcome, finding};

pub use crate::{Judgement, Options, Room, Solution, SolveError, Solved, TaskCommand, kind, solve_at};
