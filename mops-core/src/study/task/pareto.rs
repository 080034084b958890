//! `task = "pareto"`: the front of designs that no other design improves in one criterion without worsening another.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Place, TaskOptions, TaskSpec};
use crate::case::Role;
use crate::criterion::Usage;
use crate::evaluation::Objective;
use crate::study::{Row, Study, StudyError};

/// Maximum number of points of a Pareto front.
const MOST_OF_FRONT: usize = 200;

/// Settings of `task = "pareto"` and `mops pareto`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct ParetoTask {
    /// Number of points of the Pareto front; default 30.
    pub points: usize,
    /// True: every criterion is an objective in every case. False (default): a criterion is one objective, with the
    /// value of its worst case, which has the largest weighted scaled value.
    pub per_case: bool,
}

impl Default for ParetoTask {
    fn default() -> Self {
        Self { points: 30, per_case: false }
    }
}

impl TaskOptions for ParetoTask {
    const NAME: &'static str = "pareto";
    const ABOUT: &'static str = "Compute the Pareto front of the minimised criteria.";

    fn absent() -> Option<Self> {
        Some(Self::default())
    }
}

impl TaskSpec for ParetoTask {
    fn at(&self) -> Option<Place> {
        Some(Place::Optimum)
    }

    fn objective(&self, _is_measured: bool) -> Objective {
        Objective::Each
    }

    fn chooses_tuners(&self) -> bool {
        true
    }

    fn ignores_uncertain(&self) -> Option<&'static str> {
        Some("this task ignores [uncertain]")
    }

    fn check(&self, study: &Study, is_performed: bool) -> Result<(), StudyError> {
        if !(3..=MOST_OF_FRONT).contains(&self.points) {
            let fact = format!("expected 3 to {MOST_OF_FRONT} points of the front, found {}", self.points);
            return Err(StudyError::new("points", fact)
                .with_help("the default 30 gives a smooth curve")
                .within(Self::TABLE));
        }
        if !is_performed {
            return Ok(());
        }
        if study.objective() != Objective::Each {
            return Err(StudyError::new("objective", "a Pareto front needs objective = \"each\"")
                .with_help("remove `objective`, or set objective = \"each\"")
                .within("study"));
        }
        let counts = |row: &&Row| row.usage == Usage::Minimise && study.case_of(row).role() == Role::Calibration;
        let minimised: Vec<&Row> = study.rows().iter().filter(counts).collect();
        let is_single = |first: &&&Row| minimised.iter().all(|row| row.name == first.name);
        let single = minimised.first().filter(is_single);
        if let Some(row) = single.filter(|_| !self.per_case && minimised.len() > 1) {
            let fact = format!("a Pareto front needs at least two criteria to minimise, found only `{}`", row.name);
            return Err(StudyError::new("task", fact)
                .with_help(
                    "omit `usage` of another criterion, or set per-case = true in [pareto] for the front over the cases",
                )
                .within("study"));
        }
        if minimised.len() < 2 {
            let known = minimised.first().map_or_else(|| "none".to_owned(), |row| format!("only `{}`", row.name));
            return Err(StudyError::new(
                "task",
                format!("a Pareto front needs at least two criteria to minimise, found {known}"),
            )
            .with_help("omit `usage` of another criterion, or set usage = \"minimise\"")
            .within("study"));
        }
        Ok(())
    }
}
