//! `task = "worst-case"`: the largest scaled value of every criterion over a box of uncertain parameters.

use mops_language::suggestion;
use schemars::JsonSchema;
use serde::Deserialize;

use super::checks::{MOST_SAMPLES, count, needs_box, needs_uncertain};
use super::{Place, TaskOptions, TaskSpec};
use crate::study::{Study, StudyError};

/// Settings of `task = "worst-case"`: the search of the box of `[uncertain]` for the largest scaled value of every
/// criterion.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct WorstCaseTask {
    /// Design to be examined: `optimum` (default: the study is solved first) or `start`.
    pub at: Place,
    /// Criteria for the worst-case search; default is every criterion that counts, or all criteria if none counts.
    pub criteria: Option<Vec<String>>,
    /// Number of initial sample points per criterion, in addition to the corners of the box; default 128.
    pub samples: usize,
    /// Number of local searches per criterion, from the worst sample points; default 8. One more search covers the
    /// whole box.
    pub starts: usize,
}

impl Default for WorstCaseTask {
    fn default() -> Self {
        Self { at: Place::Optimum, criteria: None, samples: 128, starts: 8 }
    }
}

impl TaskOptions for WorstCaseTask {
    const NAME: &'static str = "worst-case";
    const ABOUT: &'static str = "Find the largest scaled value of every criterion over a box of uncertain parameters.";

    fn absent() -> Option<Self> {
        Some(Self::default())
    }
}

impl TaskSpec for WorstCaseTask {
    fn at(&self) -> Option<Place> {
        Some(self.at)
    }

    fn check(&self, study: &Study, is_performed: bool) -> Result<(), StudyError> {
        if is_performed {
            needs_uncertain(study)?;
            needs_box(study)?;
        }
        self.check_options(study).map_err(|mistake| mistake.within(Self::TABLE))
    }
}

impl WorstCaseTask {
    fn check_options(&self, study: &Study) -> Result<(), StudyError> {
        let known = || study.rows().iter().map(|row| row.name.as_str());
        if let Some(name) = self.criteria.iter().flatten().find(|name| !known().any(|known| known == **name)) {
            let mut names: Vec<&str> = known().collect();
            names.dedup();
            return Err(StudyError::new(name, format!("the study has no criterion `{name}`"))
                .with_help(suggestion(name, names.iter().copied()))
                .within("criteria"));
        }
        count("samples", self.samples, 1, MOST_SAMPLES)?;
        count("starts", self.starts, 1, 1000)
    }
}
