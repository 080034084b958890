//! Vocabulary and machinery of mops: tuner, criterion, demand, usage, case, experiment, study, the min-max problem, run.
//!
//! This crate knows no concrete criterion, model or solver; they come in through a [`Catalogue`].

mod case;
mod catalogue;
mod conclude;
mod criterion;
pub mod data;
mod diagnostic;
mod differences;
mod effect;
mod evaluator;
mod experiment;
pub mod expression;
pub mod file;
pub mod front;
pub mod identification;
pub mod linear;
mod linearised;
mod model;
mod outcome;
mod placement;
mod plant;
mod port;
mod problem;
mod random;
mod run;
mod scalar;
mod solver;
mod study;
mod tolerance;
mod trace;
mod trade_offs;
mod tuner;
mod unit;

pub use case::Case;
pub use catalogue::{
    Catalogue, CriterionKind, CriterionOptions, ModelKind, ModelOptions, Shipped, SolverChoice, SolverKind,
    SolverOptions,
};
pub use conclude::{Ending, conclude};
pub use criterion::{Criterion, CriterionSpec, Demand, Mark, Tangent, Usage, Value};
pub use diagnostic::{Diagnostic, Source, nearest, suggestion};
pub use effect::{
    Acting, At, Dimension, DryFriction, Effect, EffectClass, Placement, PortKind, Scope, Strength, Trials,
};
pub use evaluator::Evaluator;
pub use experiment::{Channel, Experiment, Hold, Input, ResponseData, Role};
pub use expression::{Expression, SyntaxError};
pub use linear::StateSpace;
pub use linearised::{Linearise, Linearised, Resting};
pub use model::{
    Analysis, AnalysisKind, Event, Failure, Interface, Job, Local, Model, OperatingPoint, Parameter, Response, State,
    Variable, WithTangents, Work,
};
pub use outcome::{
    CalibrationReport, ChannelReport, CriterionReport, ExcitationFindings, ExperimentReport, FailureReport, Findings,
    Outcome, ParameterReport, Pareto, StartReport, SweepAxis, SweepReport, TunerReport, criterion_reports,
};
pub use placement::{Augment, EffectDraft};
pub use plant::{Instant, Open, Opening, Plant};
pub use port::Port;
pub use problem::{Evaluation, FEASIBLE, Merit, Problem, Reading, Slopes};
pub use random::{Stream, stream};
pub use run::{Budget, FailureCount, Record, Run, State as RunState, Watch};
pub use scalar::{Along, DIRECTIONS, Dual, Scalar};
pub use solver::{Halt, Linearisation, Oracle, Progress, Shape, Solver, Stop};
pub use study::{
    Axis, AxisDraft, CaseDraft, ChannelDraft, CriterionDraft, DiagnosisTask, Draft, ExcitationDraft, ExcitationTask,
    Free, JobPlan, Measured, Mistake, ModelDraft, Objective, ParameterSource, Place, RegressionDraft, RegressionTask,
    Row, SensitivityTask, Study, SweepDraft, SweepTask, Task, Tasks, TasksDraft, TunerDraft,
};
pub use tolerance::{IntegrationMethod, Tolerance};
pub use trace::{Piece, Trace};
pub use trade_offs::{Certified, Exchange, FrontCriterion, FrontPoint, TradeOffs};
pub use tuner::{Grid, Scale, Tuner};
pub use unit::{Quantity, Unit};
