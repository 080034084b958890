//! Tasks above the core: performing them, what they find, and how it is shown.
//!
//! [`solve`] performs the task of a study. Each task is one room: a file or folder of its name with a type that
//! implements [`Room`], and one line in [`kinds`]. Its options are in `mops_core::task`.
//!
//! | module | content |
//! |---|---|
//! | [`design`] | search for the best point; worst cases, jumps and sensitivities near it |
//! | [`calibration`] | fit to measurements; profiles, bootstrap and bands |
//! | [`pareto`] | the front of a design, its trade-offs |
//! | [`sweep`] | the objective over one or two tuners |
//! | [`sensitivity`] | what the criteria or the data determine; effects of uncertain parameters |
//! | [`excitation`] | order of persistent excitation of the inputs, regressions |
//! | [`worst_case`] | the worst value of every criterion over uncertain parameters |
//! | [`monte_carlo`] | distributions of the criteria over uncertain parameters |
//! | [`diagnosis`] | the physical effect that a model lacks |
//! | [`prelude`] | names for authors of tasks |
//! | [`uncertain`] | what tasks over uncertain parameters share |

mod batches;
pub mod calibration;
mod copies;
mod derivatives;
pub mod design;
pub mod diagnosis;
pub mod excitation;
mod identifiability;
pub mod monte_carlo;
pub mod pareto;
pub mod prelude;
mod room;
mod search;
pub mod sensitivity;
mod slopes;
mod solve;
pub mod sweep;
#[cfg(test)]
mod testing;
pub mod uncertain;
pub mod verdict;
pub mod worst_case;

use mops_core::catalogue::TaskKind;
use mops_core::task::{
    CalibrationTask, DesignTask, DiagnosisTask, ExcitationTask, MonteCarloTask, ParetoTask, SensitivityTask, SweepTask,
    WorstCaseTask,
};
use mops_core::{Cancellation, Catalogue};

use mops_outcome::BlockKind;

pub use derivatives::{Beyond, Contradiction, DerivativesReport};
pub use room::{
    CommandOption, Judgement, Origin, OutputFile, OutputNames, Room, Solution, TaskCommand, kind, room, room_of,
    solve_at,
};
pub use search::{DEFAULT_EVALUATIONS, EvaluationStore, Options, SolveError, Solved, solves, suits};
pub use solve::solve;

/// Returns the JSON schema of `result.json` with the blocks of the tasks of a catalogue.
pub fn result_schema(catalogue: &Catalogue) -> serde_json::Value {
    let blocks: Vec<BlockKind> = catalogue.tasks.iter().flat_map(|kind| room(kind).blocks()).collect();
    mops_outcome::result_schema(&blocks)
}

/// Returns the tasks; the first is the default.
pub fn kinds() -> Vec<TaskKind> {
    vec![
        kind::<DesignTask>(design::Design),
        kind::<CalibrationTask>(calibration::Calibration),
        kind::<ParetoTask>(pareto::Front),
        kind::<SweepTask>(sweep::Sweep),
        kind::<SensitivityTask>(sensitivity::Sensitivity),
        kind::<ExcitationTask>(excitation::Excitation),
        kind::<WorstCaseTask>(worst_case::WorstCase),
        kind::<MonteCarloTask>(monte_carlo::MonteCarlo),
        kind::<DiagnosisTask>(diagnosis::Search),
    ]
}

impl Default for Options {
    fn default() -> Self {
        let solver = mops_solvers::kinds().first().expect("there are solvers").default_choice();
        Self {
            solver,
            max_evaluations: DEFAULT_EVALUATIONS,
            replayed: None,
            patience: None,
            jobs: None,
            tasks: kinds(),
            effects: mops_effects::effects(),
            keeping: None,
            cancellation: Cancellation::default(),
        }
    }
}
