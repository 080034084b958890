//! Core types and algorithms of mops: tuners, criteria, demands, usages, cases, experiments, studies, the min-max problem
//! and runs.
//!
//! Concrete criteria, models and solvers are not part of this crate; a [`Catalogue`] provides them.

pub mod band_limited;
mod between;
mod cancellation;
mod case;
mod catalogue;
mod catalogue_study;
mod conclude;
mod criterion;
pub mod data;
mod derivatives;
pub mod diagnosis;
mod diagnostic;
mod differences;
mod effect;
pub mod enclosure;
mod end;
mod evaluation;
mod evaluator;
mod experiment;
pub mod expression;
mod failure;
pub mod file;
pub mod front;
pub mod identification;
mod input;
mod joined;
mod jumps;
mod known;
mod least_squares;
pub mod linear;
mod linearised;
mod loss;
mod model;
mod objectives;
mod outcome;
mod panics;
mod placement;
pub mod plant;
mod port;
mod prediction;
mod problem;
mod random;
mod robustness;
mod run;
mod samples;
mod scalar;
mod slopes;
mod solver;
pub mod statistics;
mod study;
mod study_error;
mod tolerance;
mod trace;
mod trade_offs;
mod tuner;
mod uncertainty;
mod unit;
mod wildcard;

pub use between::Between;
pub use cancellation::{Cancellation, Halt};
pub use case::Case;
pub use catalogue::{
    Augment, Catalogue, CriterionKind, CriterionOptions, ModelKind, ModelOptions, SolverChoice, SolverKind,
    SolverOptions,
};
pub use catalogue_study::{BuiltStudy, CatalogueStudy, Shipped, StudyFolder};
pub use conclude::{Ending, conclude};
pub use criterion::{
    Criterion, CriterionSpec, Demand, Mark, Missed, Other, Scaled, Sense, Side, Tangent, Usage, Value,
};

pub use derivatives::{Beyond, Contradiction, DerivativesReport};
pub use diagnostic::{Diagnostic, Source, nearest, suggestion};
pub use differences::Differences;
pub use effect::{
    BoundEffect, Characteristic, DeclaredTerm, Dimension, DryFriction, Effect, EffectClass, EffectParameter,
    InitialGrid, MOST_LOST, ParameterKind, Placement, PortKind, PortState, Scope,
};
pub use end::{Basins, End, NEGLIGIBLE_DECREASE, Optimality, SMALL_OBJECTIVE};
pub use evaluation::{Evaluation, FEASIBLE, Merit, Objective, Reading};
pub use evaluator::Evaluator;
pub use experiment::{Channel, Experiment, ResponseData, Role};
pub use expression::{Expression, SyntaxError};
pub use failure::Failure;
pub use input::{Chirp, Hold, Input, PRBS_STAGES};
pub use joined::Joined;
pub use jumps::{AwayReport, JumpReport, JumpsReport, MovedKind, ON_JUMP, WITHIN as JUMPS_WITHIN};
pub use known::{CachedGradients, CachedPoint, JobValues, Known, RowSlopes, RowValue, Store};
pub use least_squares::{LeastSquares, LeastSquaresStep};
pub use linear::StateSpace;
pub use linearised::{Linearise, Linearised, Resting, Rough};
pub use loss::Loss;
pub use model::{
    Analysis, AnalysisKind, Cut, Event, Interface, Job, Local, Model, OperatingPoint, Parameter, Response, State,
    Variable, WithTangents, Work,
};
pub use mops_math as math;
pub use objectives::FrontObjective;
pub use outcome::{
    CalibrationReport, ChannelReport, CriterionReport, Design, ExcitationFindings, ExperimentReport, FailureReport,
    Findings, Outcome, ParameterReport, StartReport, SweepAxis, SweepReport, TunerReport, criterion_reports,
    result_schema,
};
pub use placement::EffectBuilder;
pub use plant::{EventInstant, Instant, LeftOut, Plant, PlantScalar, Ported, Selected};
pub use port::Port;
pub use prediction::SignalSlopes;
pub use problem::{Problem, Slopes};
pub use random::{Stream, stream};
pub use robustness::{
    AddedReport, CoordinateReport, DistributionReport, EffectReport, EffectsReport, Estimated, FailedAt,
    GlobalSensitivityReport, MonteCarloReport, QuantileReport, RobustReport, RoundReport, ShareReport, Slice, Subject,
    UncertainReport, WorstCaseReport, WorstReport, uncertain_reports,
};
pub use run::{Budget, FailureCount, Patience, Quiet, Record, Run, State as RunState, Watch};
pub use samples::Samples;
pub use scalar::{DIRECTIONS, Dual, Dual7, Scalar};
pub use slopes::{CriterionSlopes, SlopesReport};
pub use solver::{Linearisation, Oracle, Progress, Shape, Solver, Stop};
pub use study::{
    Axis, AxisBuilder, CaseBuilder, ChannelBuilder, Chosen, CriterionBuilder, DiagnosisTask, Distribution,
    DistributionBuilder, ExcitationBuilder, ExcitationTask, Free, JobPlan, Measured, ModelBuilder, MonteCarloTask,
    ParameterSource, Place, RegressionBuilder, RegressionTask, RobustTask, Row, Scenario, SensitivityMethod,
    SensitivityTask, Study, StudyBuilder, StudyParts, SweepBuilder, SweepTask, Task, Tasks, TasksBuilder, TunerBuilder,
    Uncertain, UncertainBuilder, UncertaintyTask, WorstCaseTask,
};
pub use study_error::StudyError;
pub use tolerance::{IntegrationMethod, Tolerance};
pub use trace::{Earlier, Piece, Trace};
pub use trade_offs::{Certified, Exchange, FrontCriterion, FrontPoint, Pareto, TradeOffs};
pub use tuner::{Grid, Scale, Tuner};
pub use uncertainty::{BandReport, BootstrapParameter, BootstrapReport, ProfileReport, UncertaintyReport};
pub use unit::{Quantity, Unit};
