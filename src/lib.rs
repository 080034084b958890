//! Multi-objective parameter synthesis: design and identification as weighted min-max problems.
//!
//! A study combines models, cases, tuners (the parameters to be chosen) and criteria. [`solve`] turns it into a min-max
//! problem over the unit box, runs a solver on it and returns the outcome:
//!
//! ```
//! use mops::{CaseBuilder, CriterionBuilder, StudyBuilder, ModelBuilder, Options, TunerBuilder, criteria::overshoot::Overshoot};
//! # use mops::{Analysis, Failure, Interface, Model, Parameter, Trace, Variable};
//! # use mops::core::{Job, Response};
//! # struct Lag(Interface);
//! # impl Model for Lag {
//! #     fn interface(&self) -> &Interface { &self.0 }
//! #     fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
//! #         let mut y = Trace::starting_at(0.0, 1);
//! #         y.push(1.0, Trace::NODES.map(|s| s + job.parameters[0].powi(2) * s * (1.0 - s)));
//! #         Ok(Analysis::Time(Response { traces: vec![("y".into(), y)], ..Response::default() }))
//! #     }
//! # }
//! # let model = Lag(Interface {
//! #     signals: vec![Variable::new("y", "1", "output")],
//! #     parameters: vec![Parameter::new("k", "1", "gain")],
//! #     horizon: Some(1.0),
//! #     ..Interface::default()
//! # });
//! let study = StudyBuilder {
//!     name: "example".into(),
//!     models: vec![("loop".into(), model.into())],
//!     tuners: vec![("k".into(), TunerBuilder::new(3.0, 0.5, 5.0))],
//!     criteria: vec![(
//!         "overshoot".into(),
//!         CriterionBuilder::minimise(Overshoot { signal: "y".into(), target: Some(1.0.into()), ..Overshoot::default() }, 0.1),
//!     )],
//!     ..StudyBuilder::default()
//! }
//! .build()?;
//! let solved = mops::solve(study, &Options::default(), &())?;
//! assert!(solved.outcome.worst_scaled < 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod prelude;

/// Reports: pages and pictures of a solved study.
#[cfg(feature = "report")]
pub mod report {
    pub use mops_content::plot::{Band, Color, Curve, CurveStyle, Level, ParallelAxis, Plot, Surface, ZAxis};
    pub use mops_report::{Draw, Report, page};
}

/// Rust examples of the guide, compiled and run as doctests.
#[cfg(doctest)]
#[doc = include_str!("../docs/guide/7-in-rust.md")]
mod guide {}

pub use mops_catalogue::catalogue;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub use mops_cli::main as main_as;
#[cfg(feature = "cli")]
pub use mops_cli::terminal;
pub use mops_content as content;
pub use mops_core as core;
pub use mops_core::{
    Analysis, Cancellation, Case, Catalogue, Criterion, CriterionOptions, CriterionSpec, Failure, Input, Instant,
    Interface, Model, ModelOptions, Objective, Parameter, Plant, Study, StudyBuilder, StudyError, Task, Trace, Usage,
    Value, Variable, Watch,
    catalogue::{BuiltStudy, CriterionKind, EffectBuilder, ModelKind, Shipped, SolverKind},
    study::{CaseBuilder, CriterionBuilder, ModelBuilder, TunerBuilder},
};
pub use mops_criteria as criteria;
pub use mops_data as data;
pub use mops_diagnosis as diagnosis;
pub use mops_effects as effects;
pub use mops_file as file;
pub use mops_file::{parse_study, read_study};
pub use mops_language as language;
pub use mops_language::{Diagnostic, Quantity, Scalar, Unit};
pub use mops_linear as linear;
pub use mops_math as math;
pub use mops_models as models;
pub use mops_outcome as outcome;
pub use mops_outcome::Outcome;
pub use mops_solvers as solvers;
pub use mops_statistics as statistics;
pub use mops_studies as studies;
pub use mops_tasks as tasks;
pub use mops_tasks::{DEFAULT_EVALUATIONS, EvaluationStore, Options, SolveError, Solved, solve, suits};

/// Runs the command line with a catalogue, as a program with the name of the calling binary and its version:
/// `fn main() -> std::process::ExitCode { mops::main!(my_mops::catalogue()) }`.
#[cfg(feature = "cli")]
#[macro_export]
macro_rules! main {
    ($catalogue:expr) => {{
        // Cargo names the binary; elsewhere, as in a doctest, the package has the name.
        const NAME: &str = match option_env!("CARGO_BIN_NAME") {
            Some(name) => name,
            None => env!("CARGO_PKG_NAME"),
        };
        $crate::main_as($catalogue, [env!("CARGO_PKG_NAME"), NAME], env!("CARGO_PKG_VERSION"))
    }};
}
