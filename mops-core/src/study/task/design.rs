//! `task = "design"`: the tuners that minimise the worst scaled criterion; `[robust]`: also over uncertain parameters.

use schemars::JsonSchema;
use serde::Deserialize;

use super::checks::{MOST_SAMPLES, count, needs_box, no_uncertain};
use super::{Place, Task, TaskOptions, TaskSpec};
use crate::evaluation::Objective;
use crate::study::{Study, StudyError};

/// Design, with the options of a design against worst cases.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(from = "RobustTask")]
#[schemars(with = "RobustTask")]
pub struct DesignTask {
    /// Options of a design against worst cases, if it is one.
    pub robust: Option<RobustTask>,
}

impl From<RobustTask> for DesignTask {
    fn from(robust: RobustTask) -> Self {
        Self { robust: Some(robust) }
    }
}

/// Settings of a design against the worst cases in the box of `[uncertain]`, as far as the search finds them. The
/// design is solved for the present cases, the worst cases are searched and added, and the procedure is repeated.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct RobustTask {
    /// Maximum number of iterations; default 12.
    pub rounds: usize,
    /// Tolerance in scaled values; default 0.001. A worst case is added only if it exceeds the present worst scaled
    /// value by more.
    pub tolerance: f64,
    /// Number of initial sample points, as in `[worst-case]`; default 128.
    pub samples: usize,
    /// Number of local searches, as in `[worst-case]`; default 4.
    pub starts: usize,
}

impl Default for RobustTask {
    fn default() -> Self {
        Self { rounds: 12, tolerance: 1e-3, samples: 128, starts: 4 }
    }
}

impl TaskOptions for DesignTask {
    const NAME: &'static str = "design";
    const TABLE: &'static str = "robust";
    const ABOUT: &'static str = "Choose the tuners that minimise the worst scaled criterion.";

    fn absent() -> Option<Self> {
        Some(Self::default())
    }
}

impl TaskSpec for DesignTask {
    fn at(&self) -> Option<Place> {
        Some(Place::Optimum)
    }

    fn objective(&self, _is_measured: bool) -> Objective {
        Objective::Max
    }

    fn chooses_tuners(&self) -> bool {
        true
    }

    fn ignores_uncertain(&self) -> Option<&'static str> {
        self.robust.is_none().then_some("the design ignores [uncertain]: add [robust] for a design against worst cases")
    }

    fn check(&self, study: &Study, is_performed: bool) -> Result<(), StudyError> {
        let Some(robust) = &self.robust else { return Ok(()) };
        if is_performed {
            if study.objective() != Objective::Max {
                return Err(StudyError::new(
                    "robust",
                    "a design against worst cases minimises the largest scaled value: it needs objective = \"max\"",
                )
                .with_help("remove [robust] or `objective`"));
            }
            if study.uncertain().is_empty() {
                return Err(no_uncertain("robust"));
            }
            needs_box(study)?;
            let fixed = study.uncertain().iter().find(|u| u.tuner.is_some() && u.tolerance.is_none());
            if let Some(uncertain) = fixed {
                let fact = format!(
                    "`{}` is a tuner, so that a design against worst cases cannot have a fixed range of it",
                    uncertain.name
                );
                let help = "give its deviation from the design value: tolerance = 0.05";
                return Err(StudyError::new(&uncertain.name, fact).with_help(help).within("uncertain"));
            }
        }
        robust.check().map_err(|mistake| mistake.within("robust"))
    }
}

impl RobustTask {
    fn check(&self) -> Result<(), StudyError> {
        count("rounds", self.rounds, 1, 1000)?;
        count("samples", self.samples, 1, MOST_SAMPLES)?;
        count("starts", self.starts, 1, 1000)?;
        if self.tolerance > 0.0 && self.tolerance < 1.0 {
            return Ok(());
        }
        let fact = format!("expected a tolerance between 0 and 1 in scaled values, found {}", self.tolerance);
        Err(StudyError::new("tolerance", fact).with_help("the default 0.001 is a thousandth of a demand"))
    }
}

impl Default for Task {
    fn default() -> Self {
        DesignTask::default().into()
    }
}

/// What a robust design means for the other tasks.
impl Study {
    /// Returns true if the task rests on a design for the given cases, although the study has the table of a design
    /// against worst cases.
    pub fn leaves_worst_cases_out(&self) -> bool {
        let is_robust = self.options::<DesignTask>().is_some_and(|design| design.robust.is_some());
        is_robust && !self.task.is::<DesignTask>() && self.task.at() == Some(Place::Optimum)
    }
}
