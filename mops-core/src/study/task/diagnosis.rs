//! `task = "diagnosis"`: the physical effect that a calibrated model lacks.

use std::sync::Arc;

use mops_language::suggestion;
use schemars::JsonSchema;
use serde::Deserialize;

use super::{Place, TaskOptions, TaskSpec};
use crate::case::Role;
use crate::effect::Effect;
use crate::evaluation::Objective;
use crate::model::AnalysisKind;
use crate::study::{Study, StudyError};

/// Maximum number of effects that a diagnosis adds.
const MOST_EFFECTS: usize = 6;

/// Settings of the search for missing effects, for `task = "diagnosis"` and `mops diagnose`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct DiagnosisTask {
    /// Maximum number of added effects; default 3.
    pub max_effects: usize,
    /// Significance level of the test for a lack of fit, up to which effects are added; default 0.05.
    pub level: f64,
    /// Kinds of effect to try; default is the whole catalogue (`mops list`).
    pub effects: Option<Vec<String>>,
    /// Kinds of effect to exclude.
    pub without: Vec<String>,
    /// Effects that the model has in any case, `effect@place` each, such as `coulomb-friction@joint:phi`: the search
    /// adds others.
    pub with: Vec<String>,
}

impl Default for DiagnosisTask {
    fn default() -> Self {
        Self { max_effects: 3, level: 0.05, effects: None, without: Vec::new(), with: Vec::new() }
    }
}

impl DiagnosisTask {
    /// Returns true if a kind of effect is tried.
    pub fn tries(&self, effect: &str) -> bool {
        let named = |list: &[String]| list.iter().any(|name| name == effect);
        self.effects.as_deref().is_none_or(named) && !named(&self.without)
    }

    fn check_options(&self) -> Result<(), StudyError> {
        if !(1..=MOST_EFFECTS).contains(&self.max_effects) {
            let fact = format!("expected 1 to {MOST_EFFECTS} effects, found {}", self.max_effects);
            let help = "most data cannot distinguish more effects than the default 3";
            return Err(StudyError::new("max-effects", fact).with_help(help));
        }
        if !(self.level > 0.0 && self.level <= 0.2) {
            let fact = format!("expected a significance level above 0 and at most 0.2, found {}", self.level);
            let help = "with the default 0.05, white noise looks like a lack of fit in one of twenty cases";
            return Err(StudyError::new("level", fact).with_help(help));
        }
        if self.effects.as_ref().is_some_and(Vec::is_empty) {
            return Err(StudyError::new("effects", "`effects` is empty").with_help("omit `effects` to try all"));
        }
        if let Some(name) = self.without.iter().find(|name| self.effects.iter().flatten().any(|e| e == *name)) {
            let fact = format!("`{name}` is in both `effects` and `without`");
            let help = "remove it from one of them";
            return Err(StudyError::new(name, fact).with_help(help).within("without"));
        }
        Ok(())
    }
}

impl TaskOptions for DiagnosisTask {
    const NAME: &'static str = "diagnosis";
    const ABOUT: &'static str = "Find the physical effect that the model lacks.";

    fn absent() -> Option<Self> {
        Some(Self::default())
    }
}

impl TaskSpec for DiagnosisTask {
    fn at(&self) -> Option<Place> {
        None
    }

    fn objective(&self, _is_measured: bool) -> Objective {
        Objective::Sum
    }

    /// Every channel of an experiment counts with its noise.
    fn needs_criteria(&self) -> bool {
        false
    }

    /// The measured signals of simulated models.
    fn signals(&self, study: &Study) -> Vec<(usize, usize, Vec<String>)> {
        let mut signals = Vec::new();
        let experiments = study.cases().iter().enumerate().filter_map(|(i, c)| Some((i, c.experiment.as_ref()?)));
        for (case, experiment) in experiments {
            for (model, (_, simulated)) in study.models().iter().enumerate() {
                let interface = simulated.interface();
                let offered = |signal: &String| interface.signals.iter().any(|s| s.name == *signal);
                let measured: Vec<String> =
                    experiment.channels.iter().map(|channel| channel.signal.clone()).filter(offered).collect();
                if interface.analysis == AnalysisKind::Time && !measured.is_empty() {
                    signals.push((model, case, measured));
                }
            }
        }
        signals
    }

    fn check(&self, study: &Study, is_performed: bool) -> Result<(), StudyError> {
        self.check_options().map_err(|mistake| mistake.within(Self::TABLE))?;
        if !is_performed {
            return Ok(());
        }
        let measured = study.cases().iter().filter_map(|case| case.experiment.as_ref());
        if !measured.clone().any(|experiment| !experiment.channels.is_empty()) {
            let help = "add one under [experiments], with a `file` and the measured signals as `channels`";
            return Err(StudyError::new(
                "experiments",
                "no experiment measures a signal over time, so that there are no residuals",
            )
            .with_help(help));
        }
        if !measured.clone().any(|e| e.role == Role::Calibration && !e.channels.is_empty()) {
            return Err(StudyError::new("experiments", "no calibration experiment measures a signal over time")
                .with_help("omit `role` in at least one experiment, or set role = \"calibration\""));
        }
        Ok(())
    }

    fn check_effects(&self, effects: &[Arc<dyn Effect>]) -> Result<(), StudyError> {
        let known = || effects.iter().map(|effect| effect.name());
        for (key, names) in [("effects", self.effects.as_deref().unwrap_or_default()), ("without", &self.without)] {
            if let Some(name) = names.iter().find(|name| !known().any(|effect| effect == **name)) {
                return Err(StudyError::new(name, format!("there is no effect `{name}`"))
                    .with_help(suggestion(name, known()))
                    .within(key)
                    .within(Self::TABLE));
            }
        }
        Ok(())
    }
}
