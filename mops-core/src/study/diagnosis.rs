//! Settings of `task = "diagnosis"`, and their check.

use super::{Study, Task};
use crate::case::Role;
use crate::model::AnalysisKind;
use crate::study::StudyError;

/// Maximum number of effects that a diagnosis adds.
const MOST_EFFECTS: usize = 6;

/// Settings of the search for missing effects.
#[derive(Debug, Clone, PartialEq)]
pub struct DiagnosisTask {
    /// Maximum number of added effects, at least 1.
    pub max_effects: usize,
    /// Significance level of the test for a lack of fit: effects are added as long as it is significant.
    pub level: f64,
    /// Kinds of effect to try; `None` for the whole catalogue.
    pub effects: Option<Vec<String>>,
    /// Kinds of effect to exclude.
    pub without: Vec<String>,
    /// Effects that the model has in any case, `effect@place` each.
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
}

/// Checks the numbers. The names of effects are checked elsewhere, with the catalogue.
pub(super) fn check(task: DiagnosisTask, study: &Study) -> Result<DiagnosisTask, StudyError> {
    let within = |mistake: StudyError| mistake.within("diagnosis");
    if !(1..=MOST_EFFECTS).contains(&task.max_effects) {
        let fact = format!("expected 1 to {MOST_EFFECTS} effects, found {}", task.max_effects);
        let help = "most data cannot distinguish more effects than the default 3";
        return Err(within(StudyError::new("max-effects", fact).with_help(help)));
    }
    if !(task.level > 0.0 && task.level <= 0.2) {
        let fact = format!("expected a significance level above 0 and at most 0.2, found {}", task.level);
        let help = "with the default 0.05, white noise looks like a lack of fit in one of twenty cases";
        return Err(within(StudyError::new("level", fact).with_help(help)));
    }
    if task.effects.as_ref().is_some_and(Vec::is_empty) {
        return Err(within(StudyError::new("effects", "`effects` is empty").with_help("omit `effects` to try all")));
    }
    if let Some(name) = task.without.iter().find(|name| task.effects.iter().flatten().any(|e| e == *name)) {
        let fact = format!("`{name}` is in both `effects` and `without`");
        let help = "remove it from one of them";
        return Err(within(StudyError::new(name, fact).with_help(help).within("without")));
    }
    if study.task == Task::Diagnosis {
        let measured = study.cases.iter().filter_map(|case| case.experiment.as_ref());
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
    }
    Ok(task)
}

/// Returns the measured signals of simulated models: model, case, signals.
pub(super) fn measured(study: &Study) -> Vec<(usize, usize, Vec<String>)> {
    let mut jobs = Vec::new();
    for (case, experiment) in study.cases.iter().enumerate().filter_map(|(i, c)| Some((i, c.experiment.as_ref()?))) {
        for (model, (_, simulated)) in study.models.iter().enumerate() {
            let interface = simulated.interface();
            let offered = |signal: &String| interface.signals.iter().any(|s| s.name == *signal);
            let signals: Vec<String> =
                experiment.channels.iter().map(|channel| channel.signal.clone()).filter(offered).collect();
            if interface.analysis == AnalysisKind::Time && !signals.is_empty() {
                jobs.push((model, case, signals));
            }
        }
    }
    jobs
}
