//! Names that a study in Rust needs, to be imported at once: `use mops::prelude::*;`.
//!
//! Names for authors of effects are in [`crate::effects::prelude`], those for authors of solvers in
//! [`crate::solvers::prelude`]; everything else is in [`crate::core`].

pub use crate::{
    Analysis, BuiltStudy, Case, CaseBuilder, Catalogue, Criterion, CriterionBuilder, CriterionKind, CriterionOptions,
    CriterionSpec, EffectBuilder, Failure, Input, Instant, Interface, Model, ModelBuilder, ModelKind, ModelOptions,
    Objective, Options, Outcome, Parameter, Plant, Quantity, Scalar, Shipped, Solved, SolverKind, Study, StudyBuilder,
    StudyError, Task, Trace, TunerBuilder, Unit, Usage, Value, Variable, catalogue, read_study, solve,
};
