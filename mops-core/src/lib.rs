//! The seams of mops: study, model, plant, effect, criterion, solver, the min-max problem that a study becomes, and its
//! run.
//!
//! Concrete models, effects, criteria and solvers are not part of this crate; a [`Catalogue`] provides them.
//!
//! | module | content |
//! |---|---|
//! | [`study`] | [`Study`]: models, cases, tuners and criteria that belong together, checked; its builder and its errors |
//! | [`task`] | [`Task`]: what the study is solved or examined for, and the facts that the core needs of it |
//! | [`model`] | [`Model`]: signals, parameters, states, inputs and the [`Analysis`] that criteria read |
//! | [`plant`] | [`Plant`]: the equations of a model that simulates, and the order in which the simulation calls them |
//! | [`effect`] | [`Effect`]: what a model may lack at one of its ports |
//! | [`case`](mod@case) | [`Case`]: parameters, inputs and a measurement for which criteria are evaluated |
//! | [`criterion`] | [`Criterion`]: a number for every analysis; its [`Demand`] and [`Usage`] |
//! | [`problem`] | [`Problem`]: active tuners as coordinates of the unit box, criteria as rows of scaled values |
//! | [`evaluation`] | values of a point, and the order of points |
//! | [`solver`] | [`Solver`], and the [`Oracle`] that it asks for evaluations |
//! | [`run`] | [`Run`]: budget, cache, archive and random streams of a search; its observer and its store |
//! | [`front`] | non-dominated points, their hypervolume and distance to a known front |
//! | [`least_squares`] | the Levenberg-Marquardt iteration within bounds |
//! | [`trace`] | [`Trace`]: a signal as a piecewise quartic polynomial |
//! | [`catalogue`] | [`Catalogue`]: kinds of models, criteria, solvers and effects, and studies by name |
//! | [`failure`] | [`Failure`]: why an analysis has no result |
//! | [`cancellation`] | [`Cancellation`]: request to end simulations |

pub mod cancellation;
pub mod case;
pub mod catalogue;
pub mod criterion;
pub mod effect;
mod error;
pub mod evaluation;
pub mod failure;
pub mod front;
pub mod least_squares;
pub mod model;
pub mod plant;
pub mod problem;
pub mod run;
pub mod solver;
pub mod study;
pub mod trace;

pub use cancellation::{Cancellation, Halt};
pub use case::{Case, Input, Role};
pub use catalogue::{Catalogue, CriterionOptions, ModelOptions, SolverOptions};
pub use criterion::{Criterion, CriterionSpec, Demand, Sense, Usage, Value};
pub use effect::Effect;
pub use evaluation::{Evaluation, Merit, Objective};
pub use failure::Failure;
pub use model::{Analysis, AnalysisKind, Interface, Job, Model, Parameter, Response, Variable};
pub use plant::{Instant, Plant};
pub use problem::Problem;
pub use run::{Run, Watch};
pub use solver::{Oracle, Progress, Shape, Solver, Stop};
pub use study::{Study, StudyBuilder, StudyError, task};
pub use task::Task;
pub use trace::Trace;
